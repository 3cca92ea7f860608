"""Named arrays packed into bytes, with a checksum."""

from __future__ import annotations

import math
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

TYPE = "<f8"


def packed(
    arrays: Mapping[str, NDArray[np.float64]],
) -> tuple[dict[str, Any], bytes]:
    """Return ({bytes, crc, shapes}, data): header for `unpacked`, and the bytes.

    Parameters
    ----------
    arrays : {name: of any shape}; the order is kept
    """
    data = b"".join(np.asarray(a, dtype=TYPE).tobytes() for a in arrays.values())
    shapes = {name: list(array.shape) for name, array in arrays.items()}
    return {"bytes": len(data), "crc": zlib.crc32(data), "shapes": shapes}, data


def unpacked(
    head: Mapping[str, Any], data: bytes
) -> dict[str, NDArray[np.float64]] | None:
    """Return {name: read-only array}; None if the data are damaged."""
    if len(data) != head["bytes"] or zlib.crc32(data) != head["crc"]:
        return None
    out: dict[str, NDArray[np.float64]] = {}
    start = 0
    for name, shape in head["shapes"].items():
        values = np.frombuffer(data, TYPE, math.prod(shape), start)
        out[name] = values.reshape(shape)
        start += values.nbytes
    return out
