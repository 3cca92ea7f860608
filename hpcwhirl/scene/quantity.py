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
    axes : axes of a trace in addition to case and sample
    rules : further explanation of an input, or ""
    later : whether an input was added after the first release: it is part of a digest
        only if it is not the default, so that older cases keep their digests
    """

    unit: str
    meaning: str
    symbol: str = ""
    kind: str = "f8"
    axes: tuple[str, ...] = ()
    rules: str = ""
    later: bool = False

    def labelled(self, name: str) -> str:
        """Return a name followed by the unit, if there is one."""
        return with_unit(name, self.unit)


def with_unit(text: str, unit: str, sign: str = ", ") -> str:
    """Return text, sign (a separator) and unit; text alone if the unit is "" or "1"."""
    return text if unit in {"", "1"} else f"{text}{sign}{unit}"


def given(
    default: Any,
    told: str,
    unit: str = "1",
    *,
    symbol: str = "",
    later: bool = False,
    **limits: Any,
) -> Any:
    """Return the pydantic field of an input, with its `Quantity` as metadata.

    Parameters
    ----------
    default : default value
    told : meaning and, after a semicolon, further explanation
    unit, symbol, later : see `Quantity`
    limits : arguments of `pydantic.Field` such as ``gt=0``
    """
    meaning, _, rules = told.partition("; ")
    field = Field(default, description=told, **limits)
    field.metadata.append(Quantity(unit, meaning, symbol, rules=rules, later=later))
    return field


def quantity_of(field: Any) -> Quantity:
    """Return the `Quantity` that `given` has stored in an input's pydantic field."""
    return next(told for told in field.metadata if isinstance(told, Quantity))
