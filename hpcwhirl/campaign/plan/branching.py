"""The table [branch]: sweeps in which each case begins where the one before it ended.

A branch is such a sequence of cases, with ascending or descending values of one input.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from hpcwhirl.errors import InputError, shown
from hpcwhirl.scene.campaign_tables import MOST_POINTS, BranchTable
from hpcwhirl.scene.history import history_of
from hpcwhirl.scene.input_names import is_number
from hpcwhirl.scene.swept import axes_of
from hpcwhirl.scene.table import Axis

BRANCH, HISTORY = "branch", "history"  # inputs of a case
APART = ("zip", "cases", "sample", "twins")  # tables that exclude [branch]
FIXED = (
    "--extend and [branch] exclude each other, since each case begins where the "
    'preceding one ended: use until = "decided" in [solver] instead'
)


def axes_with_branches(
    document: Mapping[str, Any],
    grid: dict[str, list[Any]],
    zipped: dict[str, list[Any]],
) -> list[Axis]:
    """Return the axes of a campaign's cases, with those along branches last.

    A branch is a sequence of cases, each of which begins where the one before ended;
    along the last axis its cases have successive numbers.

    Parameters
    ----------
    document : the campaign's TOML
    grid, zipped : {dotted input: values} of [sweep] and [zip]

    Raises
    ------
    InputError
        naming the key of [branch], its value and what is allowed
    """
    if BRANCH not in document:
        return axes_of(grid, zipped)
    table = BranchTable.read(document[BRANCH], "[branch]")
    for other in APART:
        if other in document:
            msg = f"[branch] is used with [sweep] and [refine] only, not with [{other}]"
            raise InputError(msg)
    values = _values(table.over, grid)
    branches = _branches(table, values)
    rest = {name: each for name, each in grid.items() if name != table.over}
    cases = [
        (line[place], name, history_of(table.over, line[:place]))
        for name, line in branches
        for place in range(len(line))
    ]
    names = table.over, BRANCH, HISTORY
    columns = tuple(list(column) for column in zip(*cases, strict=True))
    return [*axes_of(rest, {}), Axis(names, columns)]


def _values(over: str, grid: Mapping[str, Sequence[Any]]) -> list[Any]:
    """Return the values of the input that varies along branches, ascending.

    Parameters
    ----------
    over : name of the input
    grid : {dotted input: values} of [sweep]
    """
    values = grid.get(over)
    if values is None or not all(map(is_number, values)):
        names = [n for n, each in grid.items() if all(map(is_number, each))]
        msg = f"[branch] over must be a numeric input of [sweep], got {over}"
        raise InputError(f"{msg}; such inputs: {', '.join(names) or 'none'}")
    for name in (BRANCH, HISTORY):
        if name in grid:
            raise InputError(f"[branch] sets {name}: remove {name} from [sweep]")
    if not 2 <= len(set(values)) <= MOST_POINTS or len(set(values)) < len(values):
        msg = f"[branch] over {over}: {over} needs 2 to {MOST_POINTS} different values"
        raise InputError(f"{msg}, got {len(values)}")
    return sorted(values)


def _branches(table: BranchTable, values: list[Any]) -> list[tuple[str, list[Any]]]:
    """Return (name, values of the input in the order of the sweep) of each branch.

    Parameters
    ----------
    table : table [branch]
    values : values of the input that varies along branches, ascending
    """
    starts = table.starts
    strange = [start for start in starts if start not in values]
    if strange:
        msg = f"[branch] starts must be values of [sweep] {table.over}, got "
        raise InputError(msg + shown(strange[0]))
    for value, times in Counter(starts).most_common(1):
        if times > 1:
            msg = f"[branch] starts must be different values, got {shown(value)} "
            raise InputError(f"{msg}{times} times")
    found = []
    for start in starts or (None,):
        end = f" from {start:.10g}" if start is not None else ""
        up = [v for v in values if start is None or v >= start]
        down = [v for v in reversed(values) if start is None or v <= start]
        found += [(f"up{end}", up), (f"down{end}", down)]
    wanted = [
        each for each in found if table.directions in ("both", each[0].split()[0])
    ]
    return [each for each in wanted if len(each[1]) > 1] or wanted
