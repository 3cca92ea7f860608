"""How a quantity is stored in `results.h5`: its type and its value for "missing"."""

from __future__ import annotations

from typing import Any

import numpy as np

from hpcwhirl.errors import unknown
from hpcwhirl.scene.quantity import Quantity
from hpcwhirl.scene.words import ENUMS

FORMAT = 5


def dtype(quantity: Quantity) -> np.dtype[Any]:
    """Return the NumPy dtype in which a variable is stored."""
    return np.dtype("i1" if quantity.kind == "enum" else quantity.kind)


def missing(quantity: Quantity) -> float | int | bytes:
    """Return the value that is stored if a case has none, such as NaN."""
    empty: dict[str, float | int | bytes] = {"f8": np.nan, "i8": -1, "enum": 0}
    return empty.get(quantity.kind, b"")


def encode(name: str, quantity: Quantity, value: float | str) -> float | int | bytes:
    """Return a value as it is stored; raise for an unknown word."""
    if quantity.kind == "enum":
        if value not in ENUMS[name]:
            raise unknown(name, str(value), ENUMS[name])
        return ENUMS[name].index(str(value))
    if quantity.kind.startswith("S"):
        cut = str(value).encode()[: dtype(quantity).itemsize]
        return cut.decode(errors="ignore").encode()  # drops a truncated character
    return float(value) if quantity.kind == "f8" else int(value)
