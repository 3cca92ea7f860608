"""Checksums: named arrays packed into bytes, and lines of JSON with a CRC-32."""

from __future__ import annotations

import json
import math
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.store.directory.record import Record

TYPE = "<f8"


def packed(arrays: Mapping[str, NDArray[np.float64]]) -> tuple[dict[str, Any], bytes]:
    """Return (header, data) of arrays: their size, CRC-32 and shapes; their bytes.

    Parameters
    ----------
    arrays : {name: array of any shape}; the order is kept
    """
    data = b"".join(np.asarray(a, dtype=TYPE).tobytes() for a in arrays.values())
    shapes = {name: list(array.shape) for name, array in arrays.items()}
    return {"bytes": len(data), "crc": zlib.crc32(data), "shapes": shapes}, data


def unpacked(
    head: Mapping[str, Any], data: bytes
) -> dict[str, NDArray[np.float64]] | None:
    """Return {name: read-only array} of packed data; None if these are damaged."""
    if len(data) != head["bytes"] or zlib.crc32(data) != head["crc"]:
        return None
    out: dict[str, NDArray[np.float64]] = {}
    start = 0
    for name, shape in head["shapes"].items():
        values = np.frombuffer(data, TYPE, math.prod(shape), start)
        out[name] = values.reshape(shape)
        start += values.nbytes
    return out


def sealed(record: Record) -> bytes:
    """Return a JSON object as a line with its checksum."""
    body = json.dumps(record).encode()
    return f"{zlib.crc32(body):08x} ".encode() + body + b"\n"


def opened(line: bytes) -> Record | None:
    """Return the JSON object of a line, None if its checksum is wrong."""
    seal, _, body = line.rstrip(b"\n").partition(b" ")
    if not line.endswith(b"\n") or seal != f"{zlib.crc32(body):08x}".encode():
        return None
    try:
        record = json.loads(body)
    except (ValueError, RecursionError):  # not written by this program
        return None
    return record if isinstance(record, dict) else None
