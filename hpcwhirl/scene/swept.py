"""The tables [sweep] and [zip] of a campaign's file: values over which inputs vary."""

from __future__ import annotations

import math
from collections.abc import Mapping
from decimal import Decimal
from typing import TYPE_CHECKING, Annotated, Any, Self

from pydantic import AfterValidator, model_validator

from hpcwhirl.errors import InputError, as_table, shown
from hpcwhirl.scene.input_names import (
    Value,
    by_full_name,
    takes_list,
    undotted,
    value_in_si,
)
from hpcwhirl.scene.table_model import Key, TableModel, key
from hpcwhirl.scene.units import measure

if TYPE_CHECKING:
    from hpcwhirl.scene.table import Axis

MOST_CASES = 10_000_000
ROUND_OFF = 1e-9  # steps by which a range may miss its stop and still include it
LARGEST = 1e300  # largest number of a range, so that differences are finite
_VALUES = "[values], {start, stop, step} or {start, stop, num}"
KEYS = {  # {table: documentation of its keys, which are any inputs}
    "sweep": Key(
        "values of an input; cases are every combination of all of them", _VALUES
    ),
    "zip": Key(
        "values of inputs that change together", "as in [sweep], all of equal length"
    ),
    "cases": Key(
        "inputs of one case, below [[cases]]; or, above all tables, cases = "
        '"FILE.csv", whose first line names inputs and units: speed [rpm],gap [mm]; or '
        '{ file = "FILE", skip = [columns left out], columns = [names, for no head] }',
        "a value",
    ),
}


def _bounded(value: float) -> float:
    if not abs(value) < LARGEST:
        raise ValueError(f"must be a finite number, got {shown(value)}")
    return value


Number = Annotated[int | float, AfterValidator(_bounded)]


class Range(TableModel):
    """A range in [sweep] or [zip]: values of an input at equal steps.

    The file has {start, stop, step} or {start, stop, num}, num the number of values.
    """

    start: Number = key(..., allowed="a finite number")
    stop: Number = key(..., allowed="a finite number")
    step: Number | None = key(None, allowed="a finite number")
    num: int | None = key(None, allowed="a whole number > 0", gt=0, le=MOST_CASES)

    @model_validator(mode="after")
    def _leads_somewhere(self) -> Self:
        got = shown(self.model_dump(exclude_unset=True))
        if (self.step is None) == (self.num is None):
            raise ValueError(f"needs start, stop and either step or num, got {got}")
        width = self.stop - self.start
        if self.num == 1 and width:
            raise ValueError(f"needs num >= 2 to include its stop, got {got}")
        if self.step is not None and not (
            self.step and 0 <= width / self.step <= MOST_CASES
        ):
            raise ValueError(f"needs a step that leads from start to stop, got {got}")
        if self.step is not None and width and width / self.step < 1 - ROUND_OFF:
            raise ValueError(f"needs a step of at most stop - start, got {got}")
        return self

    def values(self) -> list[Value]:
        """Return the list of values; whole numbers if start and step are whole."""
        if self.num is not None:
            import numpy as np  # not needed to list the tables

            return [float(v) for v in np.linspace(self.start, self.stop, self.num)]
        # decimals give the same numbers 0.1, 0.2, 0.3 as a list
        a, b, d = (Decimal(str(v)) for v in (self.start, self.stop, self.step))
        count = int((b - a) / d + Decimal(str(ROUND_OFF))) + 1
        whole = isinstance(self.start, int) and isinstance(self.step, int)
        kind = int if whole else float
        return [kind(a + i * d) for i in range(count)]


def swept_values(document: Mapping[str, Any], table: str) -> dict[str, list[Value]]:
    """Return {full dotted input: values in SI} of the table [sweep] or [zip].

    document, table : parsed campaign file; "sweep" or "zip"
    """
    given = flat(as_table(f"[{table}]", document.get(table, {})))
    full = by_full_name(given.items(), f"[{table}]")
    return {name: _values(table, name, values) for name, values in full.items()}


def flat(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return {dotted name: value} of a parsed table, such as [sweep].

    A range {start, stop, ...} counts as one value.
    """
    keys = Range.model_fields.keys()
    return dict(undotted(content, lambda table: bool(table.keys() & keys)))


def _values(table: str, name: str, given: Any) -> list[Value]:
    if given and isinstance(given, Mapping):
        return _range(name, given)
    kinds = list if takes_list(name) else bool | int | float | str
    if isinstance(given, list) and given and all(isinstance(v, kinds) for v in given):
        return list(value_in_si(name, given))
    msg = f"[{table}] {name} must be a list or {{start, stop, step or num}}, "
    raise InputError(msg + f"got {shown(given)}")


def _range(name: str, given: Mapping[str, Any]) -> list[Value]:
    """Return the values of a range in SI; its start, stop and step must share a unit.

    name, given : full dotted name of the input; {start, stop, step or num} as parsed
    """
    found = {key: measure(value) for key, value in given.items()}
    units = {each[1] for each in found.values() if each}
    told = [each for key, each in found.items() if key != "num"]
    if units and (len(units) > 1 or None in told):
        msg = f"range {name} must have one unit for all its numbers, got {shown(given)}"
        raise InputError(msg)
    plain = {key: float(each[0]) if each else given[key] for key, each in found.items()}
    where = f"range {name}"
    values = Range.read(plain, where, lambda key: f"{where}: {key}").values()
    if not units:
        return values
    unit = units.pop()
    return list(value_in_si(name, [f"{value!r} {unit}" for value in values]))


def axes_of(grid: dict[str, list[Value]], zipped: dict[str, list[Value]]) -> list[Axis]:
    """Return the axes of a grid of cases: one per input of [sweep], one for [zip].

    grid, zipped : {full dotted input: values} of [sweep] and of [zip]

    Raises
    ------
    InputError
        for zipped lists of unequal length, an input in both mappings, or more than
        `MOST_CASES` cases
    """
    from hpcwhirl.scene.table import Axis, column_of

    lengths = {name: len(values) for name, values in zipped.items()}
    if len(set(lengths.values())) > 1:
        raise InputError(f"[zip] lists must have one length, got {lengths}")
    both = sorted(grid.keys() & zipped.keys())
    if both:
        raise InputError(f"{both[0]} is in [sweep] and in [zip]")
    total = math.prod(float(len(v)) for v in grid.values())
    check_count(total, "[sweep] asks for")
    axes = [Axis((name,), (column_of(values),)) for name, values in grid.items()]
    if zipped:
        axes.append(Axis(tuple(zipped), tuple(map(column_of, zipped.values()))))
    return axes


def check_count(cases: float, told: str) -> None:
    """Raise InputError if a campaign has more cases than `MOST_CASES`.

    Parameters
    ----------
    cases : number of cases
    told : text before `cases` in the error message, such as "got"
    """
    if cases > MOST_CASES:
        msg = f"a campaign has at most {MOST_CASES} cases, {told} {cases:.9g}"
        raise InputError(msg)
