"""The probability of each regime, from cases whose inputs were drawn by [sample].

It is the share of a regime among the cases of each point of the sweep, a combination of
the swept inputs. Overloaded cases, which have no regime, have a share of their own:
they are those of the strongest draws, without which the others' shares would be wrong.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.scene.words import COUNTED
from hpcwhirl.store.reading.reader import words
from hpcwhirl.store.reading.shares import interval
from hpcwhirl.store.results.sampled import drawn_of, points_of

if TYPE_CHECKING:
    import xarray

Words = NDArray[np.str_]


def shares(data: xarray.Dataset) -> xarray.Dataset:
    """Return the share of each regime at each point of a sampled campaign's sweep.

    Overloaded cases count as a regime; cases without a result, failed or unstable, only
    in `lost`. With sample.method "saltelli", only the independent draws A and B count.

    Parameters
    ----------
    data : results of `open_results`, of a campaign with [sample]

    Returns
    -------
    xarray.Dataset over `point`, with the swept inputs as coordinates, and `regime`:
    `share`, `share_low`, `share_high` (Wilson's 95 % interval for independent draws;
    low-discrepancy draws err less), `count`; over `point` only `cases`, the number of
    cases with a result, and `lost`, the number of those without

    Raises
    ------
    InputError
        if no input of the campaign was drawn
    """
    drawn = drawn_of(data)
    swept = points_of(data, drawn)[1]
    word = ends_of(data)
    found = shares_of(word, list(COUNTED), drawn.point, drawn.independent)
    return found.assign_coords(swept)


def ends_of(data: xarray.Dataset) -> Words:
    """Return how each case has ended, (cases,): a word of `COUNTED`, or another one.

    data : results of `open_results`
    """
    over = words(data["outcome"]) == "overloaded"
    return np.where(over, "overloaded", words(data["regime"]))


def shares_of(
    word: Words,
    kinds: Sequence[str],
    point: NDArray[np.int64],
    chosen: NDArray[np.bool_],
    along: str = "regime",
) -> xarray.Dataset:
    """Return the share of each kind of motion among the cases of each point of a sweep.

    A kind is a word of `COUNTED` or an attractor. The table has the variables that
    `shares` returns.

    Parameters
    ----------
    word : (cases,), kind of motion of each case; a case of none of `kinds` is `lost`
    kinds : names of the kinds, values of the coordinate `along`
    point : (cases,), number of the case's point of the sweep
    chosen : (cases,), whether the case counts
    along : name of the table's second dimension: "regime" or "attractor"
    """
    import xarray

    points = np.unique(point)
    count = counts(word, kinds, point, chosen)
    asked = np.bincount(point[chosen], minlength=points.max(initial=-1) + 1)[points]
    cases = count.sum(axis=1)
    bounds = np.array([[interval(int(n), int(total)) for n in row]
                         for row, total in zip(count, cases, strict=True)])  # fmt: skip
    told = {
        "share": "share of the cases that have a result",
        "share_low": "lower end of the share's interval, 95 %",
        "share_high": "upper end of the share's interval, 95 %",
        "count": f"cases of this {along}",
        "cases": "cases that have a result",
        "lost": "cases without a result",
    }
    both, each = ("point", along), ("point",)
    ends = {n: (both, bounds[..., i]) for i, n in enumerate([*told][:3])}
    rest = {
        "count": (both, count),
        "cases": (each, cases),
        "lost": (each, asked - cases),
    }
    dataset = xarray.Dataset(ends | rest, coords={along: list(kinds), "point": points})
    for name, meaning in told.items():
        dataset[name].attrs = {"units": "1", "long_name": meaning}
    return dataset


def swept_in(found: xarray.Dataset) -> list[str]:
    """Return the names of the swept inputs, which are coordinates of a table of shares.

    found : table of shares, from `shares` or `basins`
    """
    names = [str(n) for n, c in found.coords.items() if c.dims == ("point",)]
    return [name for name in names if name != "point"]


def counts(
    word: Words,
    kinds: Sequence[str],
    group: NDArray[np.int64],
    chosen: NDArray[np.bool_],
) -> NDArray[np.int64]:
    """Return how many cases of each group have each kind of motion, (groups, kinds).

    Parameters
    ----------
    word : (cases,), kind of motion of each case, such as its regime
    kinds : names of the kinds that are counted
    group : (cases,), number of each case's group, such as its point of the sweep
    chosen : (cases,), whether the case is counted
    """
    number = np.unique(group, return_inverse=True)[1]
    table = np.zeros((number.max(initial=-1) + 1, len(kinds)), dtype=np.int64)
    for column, name in enumerate(kinds):
        np.add.at(table[:, column], number[chosen & (word == name)], 1)
    return table
