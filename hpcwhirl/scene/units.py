"""Quantities, and conversion of values with units, such as "0.8 mm", to SI and back.

Plain numbers of inputs are in SI; UDUNITS is imported only for a text with a unit.
Decimal arithmetic avoids rounding: "0.8 mm" gives the same number as 0.8e-3.

Printed tables and figures are in the units of the campaign's file, see `written_in`,
else in practical units, mm and kN, or in those of an option --units, see `showing`;
CSV, JSON and results, which programs read, are in SI.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from decimal import Decimal
from functools import lru_cache
from typing import Any, TypeVar

from pydantic import Field

from hpcwhirl.errors import SHOWN, nearest, one_line, shown


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


MEASURE = re.compile(
    r"\s*((?>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?))\s*((?:1/|[^\s\d]).*?)\s*"
)
ANGULAR = "rad/s"
# units of an angular speed that count revolutions, for which UDUNITS would take 1 Hz
# as 1 rad/s
CYCLES = {
    "Hz": "cycle/s", "kHz": "1000 cycle/s", "rev/s": "cycle/s", "rev/min": "rpm",
    "1/min": "rpm", "deg/s": "degree/s",
}  # fmt: skip
# spellings that UDUNITS lacks, or reads as another unit: its "oz" is a volume
SPELLED = {
    "RPM": "rpm", "rev": "cycle", "deg": "degree", "cP": "centipoise",
    "oz in": "0.028349523125 kg inch",
}  # fmt: skip
REVOLUTIONS = {"rev", "revolution", "turn", "cycle"}  # a number may count these
USUAL = (
    "m", "mm", "um", "inch", "s", "ms", "rad/s", "rpm", "Hz", "N", "kN", "MN", "N/m",
    "N/mm", "kN/mm", "MN/m", "Pa", "MPa", "GPa", "kg/m^3", "g/cm^3", "%", "1/s",
    "lbf", "lbf/in", "psi", "g mm", "oz in", "cP", "deg", "rev",
)  # fmt: skip
# units that may follow a number in a condition, as in "gap > 0.5 mm"; the page knows
# these alone
WRITTEN = (
    *USUAL, "cm", "in", "mil", "ft", "us", "RPM", "krpm", "kHz", "rev/s", "rev/min",
    "1/min", "deg/s", "rad", "rad/s^2", "rpm/s", "m/s", "mm/s", "N s", "N s/m", "ksi",
    "Pa s", "J", "mJ", "kJ", "kg m", "g m", "kg mm", "kg m^2",
)  # fmt: skip
TURNING = {ANGULAR, "rpm", "RPM", "krpm", *CYCLES}
# {SI unit: (unit shown, factor)}
PRACTICAL = {"m": ("mm", 1e3), "N": ("kN", 1e-3), "kg m": ("kg mm", 1e3)}
AS_SHOWN, AS_STORED = "practical", "si"  # words accepted instead of names of units
Found = TypeVar("Found")
_asked: ContextVar[tuple[str, ...]] = ContextVar("asked", default=(AS_SHOWN,))
_written: ContextVar[tuple[str, ...]] = ContextVar("written", default=())


def measure(value: object) -> tuple[str, str] | None:
    """Split a text such as "0.8 mm" into (number, unit); None for anything else."""
    found = MEASURE.fullmatch(value) if isinstance(value, str) else None
    if found is None or not any(c.isalpha() or c in "%°" for c in found[2]):
        return None
    return found[1], found[2]


def in_si(value: Found, unit: str) -> Found | float:
    """Convert a text with a unit to a number; return anything else unchanged.

    Parameters
    ----------
    value : text such as "0.8 mm", or any other value
    unit : unit of the number, "1" for none

    Raises
    ------
    ValueError
        if the text's unit is unknown or of another quantity
    """
    found = measure(value)
    if found is None:
        return value
    return float(Decimal(found[0]) * _factor(found[1], unit))


def each_in_si(value: Any, unit: str) -> Any:
    """Return a value in SI, or a list with each value in SI, by `in_si`."""
    if isinstance(value, list):
        return [in_si(one, unit) for one in value]
    return in_si(value, unit)


@contextmanager
def showing(asked: Sequence[str]) -> Iterator[None]:
    """Within this context, show numbers in the units `asked`, see `shown_in`.

    asked : units in order of preference, from `units_asked`
    """
    before = _asked.set(tuple(asked))
    try:
        yield
    finally:
        _asked.reset(before)


@contextmanager
def written_in(units: Sequence[str]) -> Iterator[None]:
    """Within this context, practical units are these, and then those of `PRACTICAL`.

    units : those of a campaign's file, from `documents.units_of_document`
    """
    before = _written.set(tuple(units))
    try:
        yield
    finally:
        _written.reset(before)


def written_units() -> tuple[str, ...]:
    """Return the units set by `written_in`."""
    return _written.get()


def shown_in(unit: str) -> tuple[str, float]:
    """Return the unit in which to show numbers of an SI unit, and the factor to it.

    The unit is the first one set by `showing` that measures the same quantity, where
    `AS_SHOWN` stands for those set by `written_in` and of `PRACTICAL`; if none does,
    the SI unit with factor 1. Numbers without unit ("1") are never converted, and only
    an angular speed, rad/s, is shown in revolutions or cycles.
    """
    found = _asked.get()
    if AS_SHOWN in found:
        at = found.index(AS_SHOWN)
        found = (*found[:at], *_written.get(), *found[at:])
    for asked in found:
        if asked == AS_STORED:
            break
        if asked == AS_SHOWN:
            if unit in PRACTICAL:
                return PRACTICAL[unit]
        elif factor := _shown(unit, asked):
            return asked, factor
    return unit, 1.0


@lru_cache(maxsize=256)
def _shown(unit: str, asked: str) -> float:
    """Return the factor from an SI unit to the unit `asked`; 0 if quantities differ."""
    if unit in {"", "1"} or asked == "%" or (asked in TURNING) != (unit == ANGULAR):
        return 0.0
    try:
        return float(1 / _factor(asked, unit))
    except ValueError:
        return 0.0


def in_shown(value: float, unit: str, digits: int = 6) -> str:
    """Return a number in SI as text with its unit, both as `shown_in` has them."""
    name, factor = shown_in(unit)
    return with_unit(f"{factor * value:.{digits}g}", name, " ")


def is_shown_in(unit: str, asked: str) -> bool:
    """Return whether `shown_in` may show numbers of an SI unit in the unit `asked`."""
    return _shown(unit, asked) != 0.0


def units_asked(text: str | None, known: Sequence[str]) -> tuple[str, ...]:
    """Return the unit names in an option ``--units mm,rpm``; None: the practical ones.

    Parameters
    ----------
    text : units, "practical" or "si", separated by commas
    known : SI units of the quantities that the command shows

    Raises
    ------
    ValueError
        for a unit in which nothing is shown
    """
    if text is None:
        return (AS_SHOWN,)
    asked = [part.strip() for part in text.split(",")]
    words = [one for one in asked if one in {AS_SHOWN, AS_STORED}]
    for one in asked:
        if one not in words and not any(_shown(unit, one) for unit in known):
            kinds = ", ".join((*USUAL, AS_SHOWN, AS_STORED))
            msg = f"must be units such as mm,rpm, got {shown(one_line(one))}"
            hint = nearest(one, [*USUAL, AS_SHOWN, AS_STORED])
            raise ValueError(msg + (hint or f"; known are {kinds}"))
    return (*asked, *(() if words else (AS_SHOWN,)))


def factor_to(unit: str, name: str) -> Decimal:
    """Return the factor from a unit to an SI unit `name`; ValueError as `in_si`."""
    return _factor(unit, name)


@lru_cache(maxsize=256)
def _factor(given: str, wanted: str) -> Decimal:
    from cf_units import suppress_errors

    with suppress_errors():  # UDUNITS prints lines of its own
        return _factor_of(given, wanted)


def _factor_of(given: str, wanted: str) -> Decimal:
    from cf_units import Unit

    allowed = f"in {wanted} or a unit of the same kind" if wanted != "1" else "a number"
    if len(given) > SHOWN:
        raise ValueError(f"must be {allowed}, got a unit of {len(given)} characters")
    if wanted == "1" and given in REVOLUTIONS:
        return Decimal(1)
    name = (SPELLED | CYCLES if wanted == ANGULAR else SPELLED).get(given, given)
    try:
        source = Unit(name)
    except ValueError:
        hint = nearest(given, USUAL) or f"; known are {', '.join(USUAL)} and others"
        msg = f"must be {allowed}, got the unknown unit {shown(one_line(given))}{hint}"
        raise ValueError(msg) from None
    force = "; pounds of force are lbf" if re.search(r"\blb\b", given) else ""
    refused = f"must be {allowed}, got {shown(given)}{force}"
    if wanted == "1" and "rad" in source.definition:  # UDUNITS takes 1 rad as 1
        raise ValueError(refused)
    return _of(source, wanted, refused)


def _of(source: Any, wanted: str, refused: str) -> Decimal:
    """Return the factor that converts numbers of one unit to another.

    Parameters
    ----------
    source, wanted : unit, an object of cf_units; name of the target unit
    refused : message of the ValueError if the units measure different quantities, or
        have different zeros, as degrees Celsius and kelvins
    """
    from cf_units import Unit

    target = Unit(wanted)
    if not source.is_convertible(target):
        raise ValueError(refused)
    zero, one = (float(source.convert(number, target)) for number in (0.0, 1.0))
    if zero != 0.0 or not math.isfinite(one):
        raise ValueError(refused)
    short = f"{one:.12g}"  # undo the library's rounding of powers of ten
    return Decimal(short if math.isclose(float(short), one, rel_tol=1e-15) else one)


@lru_cache(maxsize=256)
def written_factors(unit: str) -> dict[str, str]:
    """Return the units of `WRITTEN` that measure the same quantity as an SI unit.

    Returns {unit: factor from it to the SI unit, as decimal digits}
    """
    factors = {}
    turning = () if unit == ANGULAR else TURNING - {"Hz", "kHz", "1/min"}
    for name in WRITTEN:
        if name in turning and name != unit:
            continue
        try:
            factors[name] = str(_factor(name, unit))
        except ValueError:
            continue
    return factors


def is_unit(name: str) -> bool:
    """Return whether a name is one of a unit, such as "rpm" or "mm"."""
    from cf_units import Unit

    if name in TURNING or name in SPELLED:
        return True
    try:
        Unit(name)
    except ValueError:
        return False
    return True


def told_of(name: str, convert: Callable[[], Found]) -> Found:
    """Return a converted value of an input; a ValueError becomes an InputError.

    Parameters
    ----------
    name : name of the input, with which the message begins
    convert : function without arguments that returns the converted value
    """
    from hpcwhirl.errors import InputError

    try:
        return convert()
    except ValueError as failed:
        raise InputError(f"{name} {failed}") from None
