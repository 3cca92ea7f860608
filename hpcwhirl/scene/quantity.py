"""A quantity: what an input or an output is, said once for whoever shows it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pydantic import Field


@dataclass(frozen=True)
class Quantity:
    """Unit, meaning and symbol of an input or an output.

    Attributes
    ----------
    unit : as UDUNITS and CF read it, "1" for none
    meaning : the long name
    symbol : in pictures, "" for none
    kind : how a file keeps it: "f8", "i8", "enum", or text as "S16", of 16 bytes
    axes : of a trace, beside case and sample
    rules : of an input, what else to know, or ""
    """

    unit: str
    meaning: str
    symbol: str = ""
    kind: str = "f8"
    axes: tuple[str, ...] = ()
    rules: str = ""

    def labelled(self, name: str) -> str:
        """Return a name with the unit, if there is one."""
        return with_unit(name, self.unit)


def with_unit(text: str, unit: str, sign: str = ", ") -> str:
    """Return a text and its unit; units "" and "1" are not told."""
    return text if unit in {"", "1"} else f"{text}{sign}{unit}"


def given(
    default: Any, told: str, unit: str = "1", *, symbol: str = "", **limits: Any
) -> Any:
    """Return the field of an input.

    Parameters
    ----------
    default : where a file does not say
    told : meaning and, after a semicolon, what else to know
    unit, symbol : of the quantity
    limits : as `pydantic.Field` takes them
    """
    meaning, _, rules = told.partition("; ")
    field = Field(default, description=told, **limits)
    field.metadata.append(Quantity(unit, meaning, symbol, rules=rules))
    return field


def quantity_of(field: Any) -> Quantity:
    """Return what an input's field was given."""
    return next(told for told in field.metadata if isinstance(told, Quantity))
