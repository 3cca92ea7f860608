"""A quantity: unit, meaning and symbol of an input or a result."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pydantic import Field


@dataclass(frozen=True)
class Quantity:
    """Unit, meaning and symbol of an input or a result.

    Attributes
    ----------
    unit : unit in UDUNITS and CF notation, "1" for none
    meaning : explanation in a phrase, the long name in files
    symbol : symbol in figures, "" for none
    kind : type in a file: "f8", "i8", "enum", or text such as "S16", of 16 bytes
    axes : names of a trace's dimensions in addition to case and sample, see `AXES`
    rules : further explanation of an input; "" for none
    """

    unit: str
    meaning: str
    symbol: str = ""
    kind: str = "f8"
    axes: tuple[str, ...] = ()
    rules: str = ""

    def labelled(self, name: str) -> str:
        """Return a text, such as a variable's name, with the unit: "gap, m"."""
        return with_unit(name, self.unit)


def with_unit(text: str, unit: str, sign: str = ", ") -> str:
    """Return `text`, `sign` and `unit`, such as "gap, m"; text alone without a unit.

    sign : separator; a unit "" or "1" is none
    """
    return text if unit in {"", "1"} else f"{text}{sign}{unit}"


def given(
    default: Any, unit: str, told: str, *, symbol: str = "", **limits: Any
) -> Any:
    """Return the pydantic field of an input, with its `Quantity` as metadata.

    Parameters
    ----------
    default : default value
    unit, symbol : see `Quantity`
    told : the input's meaning and, after a semicolon, further explanation
    limits : arguments of `pydantic.Field` such as ``gt=0``
    """
    meaning, _, rules = told.partition("; ")
    field = Field(default, description=told, **limits)
    field.metadata.append(Quantity(unit, meaning, symbol, rules=rules))
    return field


def quantity_of(field: Any) -> Quantity:
    """Return the `Quantity` that `given` has stored in an input's pydantic field."""
    return next(told for told in field.metadata if isinstance(told, Quantity))
