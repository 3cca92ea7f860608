"""Tables of a page: changes along branches, limits of damped cases, shares of motions.

The tables show which motions coexist, which the word of a single case cannot show.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcwhirl.report.canvas import NAMED, name_of
from hpcwhirl.scene.quantities import variable_name
from hpcwhirl.scene.units import shown_in, with_unit
from hpcwhirl.store.reading.results_file import Results
from hpcwhirl.store.reading.select import value_text
from hpcwhirl.studies.branches import branches_of, changes_along, count_differences

if TYPE_CHECKING:
    import xarray

STRENGTHS = ("force", "start_energy")  # inputs that set the strength of a start
FEWEST = 8  # least number of starts at every point of the sweep to show shares
MOST = 100  # largest number of rows of a table
DIGITS = 6


Table = dict[str, Any]  # a table as data for the page, see `tables_of`


def tables_of(results: Results) -> list[Table]:
    """Return the tables that a campaign's page shows below the map; [] if none.

    Each is {"title": what it shows, "head" and "rows": texts of its column heads and of
    each row, "command": the command that prints the whole table}.
    """
    swept = [variable_name(name) for name in results.plan.swept]
    if "branch" in swept:
        return [_of_branches(results)]
    return [*_of_starts(results)] if set(swept) & {*STRENGTHS, "start_draw"} else []


def _of_branches(results: Results) -> Table:
    over, branches = branches_of(results)
    changes, name = changes_along(branches), variable_name(over)
    others = [variable_name(other) for other in branches[0].others]
    variables = *others, "branch", name, name, "word", "following", "", "orbit_radius"
    rows = [_shown(variables, row) for row in zip(*changes.values(), strict=True)]
    differ, several = count_differences(branches)
    title = f"Where branches change their word; they differ at {differ} of {several} "
    head = [
        *map(_head, others),
        "branch",
        _head(name),
        "to",
        "word",
        "following",
        "kind",
    ]
    return _table(
        title + "points", [*head, _head("orbit_radius")], rows, "branches DIR"
    )


def _of_starts(results: Results) -> Iterator[Table]:
    """Yield the tables of a campaign whose starts differ.

    They show the force or energy up to which all cases are damped, and the shares of
    starts that end on each motion.
    """
    from hpcwhirl.errors import InputError
    from hpcwhirl.store.reading.reader import open_results
    from hpcwhirl.studies.basins import starts_of

    with open_results(results.path) as data:
        for name in STRENGTHS:
            if variable_name(name) in map(variable_name, results.plan.swept):
                yield from _of_strength(data, name)
        try:
            starts = starts_of(data)
        except InputError:  # starts of a refined map, or of drawn engines
            return
        if np.bincount(starts.point).min() >= FEWEST:
            yield _of_shares(data)


def _of_strength(data: xarray.Dataset, name: str) -> Iterator[Table]:
    from hpcwhirl.store.results.sampled import is_sampled
    from hpcwhirl.studies.margins import first_changes

    if is_sampled(data) or len(set(data[name].to_numpy().tolist())) <= 2:
        return
    found = first_changes(data, name)
    others = [*found[0].fixed]
    variables = *others, name, name, "word", name
    rows = [
        _shown(
            variables,
            [*f.fixed.values(), f.safe, f.unsafe, f.word or "none met", f.step],
        )
        for f in found
    ]
    head = [*map(_head, others), f"damped up to {_head(name)}", "changed at", "word",
            "largest step between cases"]  # fmt: skip
    title = (
        f"Limit of {name.replace('_', ' ')} up to which all computed cases are damped"
    )
    yield _table(title, head, rows, f"margin DIR --over {name} --first")


def _of_shares(data: xarray.Dataset) -> Table:
    from hpcwhirl.studies.basins import basins
    from hpcwhirl.studies.shares import swept_in

    found = basins(data)
    seen = found.sel(regime=found["count"].any("point").to_numpy())
    kinds, swept = seen["regime"].to_numpy().tolist(), swept_in(found)
    columns = [found[name].to_numpy().tolist() for name in swept]
    rows = [
        [*_shown(swept, values), *map(_share, *ends)]
        for *values, ends in zip(*columns, _ends(seen), strict=True)
    ]
    starts = ", ".join(found.attrs["starts"].split()).replace("_", " ")
    title = f"Shares of {int(found['cases'].max())} starts that end on each motion"
    head = [*map(_head, swept), *kinds]
    return _table(f"{title} ({starts})", head, rows, "basins DIR")


def _ends(seen: xarray.Dataset) -> Any:
    """Return shares and both ends of their intervals, (points, 3, kinds of motion)."""
    names = ("share", "share_low", "share_high")
    return np.stack([seen[name].to_numpy() for name in names], axis=1)


def _share(share: float, low: float, high: float) -> str:
    """Return a share with its interval as text: ``0.203 [0.123, 0.317]``."""
    return f"{share:.3g} [{low:.3g}, {high:.3g}]"


def _table(
    title: str, head: Sequence[str], rows: list[list[str]], command: str
) -> Table:
    if len(rows) > MOST:
        title = f"{title}; {MOST} of {len(rows)} rows"
    table = {"title": title, "head": [*head], "rows": rows[:MOST]}
    return table | {"command": f"hpcwhirl {command}"}


def _head(name: str) -> str:
    unit, _ = shown_in(NAMED[name].unit) if name in NAMED else ("", 1.0)
    return with_unit(name_of(name), unit)


def _shown(names: Sequence[str], values: Any) -> list[str]:
    """Return values as texts for a row of a table, in the units shown; "" for NaN.

    names, values : variable of each value; the values in SI
    """
    cells = []
    for name, value in zip(names, values, strict=True):
        _, factor = shown_in(NAMED[name].unit) if name in NAMED else ("", 1.0)
        real = isinstance(value, int | float)
        text = f"{factor * value:.{DIGITS}g}" if real else value_text(value)
        cells.append("" if text == "nan" else text)
    return cells
