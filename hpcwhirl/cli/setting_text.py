"""Inputs and lines of cases as text, in the units that the user chose."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from hpcwhirl.scene.units import shown_in, with_unit
from hpcwhirl.store.reading import select


def setting_text(variable: str, value: Any) -> str:
    """Return an input as text ``name = value unit``, in the unit that the user chose.

    variable, value : name of the input; its value in SI, or a text
    """
    if not isinstance(value, float):
        return f"{variable} = {value}"
    unit, factor = shown_in(select.UNITS.get(variable, "1"))
    return with_unit(f"{variable} = {factor * value:g}", unit, " ")


def value_text(variable: str, value: float) -> str:
    """Return an input's value as text, in the unit that the user chose; "" for NaN."""
    text = setting_text(variable, value).partition(" = ")[2]
    return "" if np.isnan(value) else text


def line_text(fixed: Mapping[str, Any]) -> str:
    """Return a line of cases as text: the inputs that all of its cases share.

    fixed : {input: value in SI}
    """
    return ", ".join(setting_text(n, v) for n, v in fixed.items())
