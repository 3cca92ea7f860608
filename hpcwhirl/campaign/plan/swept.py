"""The values that inputs take in a campaign's file: [sweep], [zip] and [[cases]]."""

from __future__ import annotations

from collections.abc import Mapping
from decimal import Decimal
from typing import Any

import numpy as np

from hpcwhirl.errors import InputError, as_table, shown, unknown
from hpcwhirl.scene.files import Value, by_full_name, is_number, takes_list, undotted
from hpcwhirl.scene.table import Axis, column_of

RANGE_KEYS = ("start", "stop", "step", "num")
MOST_CASES = 10_000_000
LARGEST = 1e300  # of a range's numbers: differences stay finite


def swept_values(document: Mapping[str, Any], table: str) -> dict[str, list[Value]]:
    """Return {input: its values} of the table [sweep] or [zip]."""
    flat = _flat(as_table(f"[{table}]", document.get(table, {})))
    full = by_full_name(flat.items(), f"[{table}]")
    return {name: _values(table, name, given) for name, given in full.items()}


def _flat(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return {dotted name: value}, of which a range is one."""
    return dict(undotted(content, lambda table: bool(table.keys() & set(RANGE_KEYS))))


def _values(table: str, name: str, given: Any) -> list[Value]:
    if isinstance(given, Mapping):
        return _range(name, given)
    kinds = list if takes_list(name) else bool | int | float | str
    if isinstance(given, list) and given and all(isinstance(v, kinds) for v in given):
        return list(given)
    msg = f"[{table}] {name} must be a list or {{start, stop, step or num}}, "
    raise InputError(msg + f"got {shown(given)}")


def _range(name: str, given: Mapping[str, Any]) -> list[Value]:
    for key, value in given.items():
        if key not in RANGE_KEYS:
            raise unknown(f"key of range {name}", key, RANGE_KEYS)
        if not is_number(value) or not abs(value) < LARGEST:
            msg = f"range {name}: {key} must be a finite number, got {shown(value)}"
            raise InputError(msg)
    if not {"start", "stop"} <= given.keys() or len(given) != 3:
        msg = (
            f"range {name} takes start, stop and either step or num, got {shown(given)}"
        )
        raise InputError(msg)
    start, stop = given["start"], given["stop"]
    if "num" in given:
        return _spaced(name, start, stop, given["num"])
    step = given["step"]
    if step == 0 or (stop - start) / step < 0 or (stop - start) / step > MOST_CASES:
        msg = f"range {name}: step must lead from start to stop, got {shown(given)}"
        raise InputError(msg)
    # by decimals: 0.1, 0.2, 0.3 are the numbers that a list would give
    a, b, d = (Decimal(str(v)) for v in (start, stop, step))
    count = int((b - a) / d + Decimal("1e-9")) + 1
    whole = isinstance(start, int) and isinstance(step, int)
    return [int(v) if whole else float(v) for v in (a + i * d for i in range(count))]


def _spaced(name: str, start: float, stop: float, num: float) -> list[Value]:
    if not isinstance(num, int) or not 1 <= num <= MOST_CASES:
        msg = f"range {name}: num must be a whole number > 0, got {shown(num)}"
        raise InputError(msg)
    return [float(v) for v in np.linspace(start, stop, num)]


def axes_of(grid: dict[str, list[Value]], zipped: dict[str, list[Value]]) -> list[Axis]:
    """Return the axes of a grid, and that of lists side by side, which is the last.

    Raises
    ------
    InputError
        for lists of unequal length, an input in both, or more than `MOST_CASES` cases
    """
    lengths = {name: len(values) for name, values in zipped.items()}
    if len(set(lengths.values())) > 1:
        msg = f"[zip] lists must have one length, got {lengths}"
        raise InputError(msg)
    both = sorted(grid.keys() & zipped.keys())
    if both:
        msg = f"{both[0]} is in [sweep] and in [zip]"
        raise InputError(msg)
    total = float(np.prod([float(len(v)) for v in grid.values()]))
    check_count(total, "[sweep] asks for")
    axes = [Axis((name,), (column_of(values),)) for name, values in grid.items()]
    if zipped:
        axes.append(Axis(tuple(zipped), tuple(map(column_of, zipped.values()))))
    return axes


def check_count(cases: float, told: str) -> None:
    """Refuse more cases than a campaign may have."""
    if cases > MOST_CASES:
        msg = f"a campaign has at most {MOST_CASES} cases, {told} {cases:.9g}"
        raise InputError(msg)


def listed_cases(given: Any) -> list[dict[str, Value]]:
    """Return {input: value} of each case of [[cases]]."""
    if not isinstance(given, list) or not all(isinstance(c, Mapping) for c in given):
        msg = f"[[cases]] must be tables of inputs, got {shown(given)}"
        raise InputError(msg)
    return [by_full_name(_flat(case).items(), "[[cases]]") for case in given]
