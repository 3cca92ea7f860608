"""The probability of each regime, from cases whose inputs were drawn."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.scene.words import REGIMES
from hpcwhirl.store.reading.reader import words
from hpcwhirl.store.reading.shares import interval
from hpcwhirl.store.results.sampled import drawn_of, points_of

if TYPE_CHECKING:
    import xarray

Words = NDArray[np.str_]


def shares(data: xarray.Dataset) -> xarray.Dataset:
    """Return the share of each regime at each point of a sampled campaign's sweep.

    Cases without a regime, failed or unstable, count only in `lost`. With sample.method
    "saltelli", only the independent draws A and B count.

    Parameters
    ----------
    data : results of `open_results`, of a campaign with [sample]

    Returns
    -------
    xarray.Dataset over `point`, with the swept inputs as coordinates, and `regime`:
    `share`, `share_low`, `share_high` (Wilson's 95 % interval for independent draws;
    low-discrepancy draws err less), `count`; over `point` only `cases`, the number with
    a regime, and `lost`

    Raises
    ------
    InputError
        if no input of the campaign was drawn
    """
    drawn = drawn_of(data)
    swept = points_of(data, drawn)[1]
    word = words(data["regime"])
    found = shares_of(word, list(REGIMES), drawn.point, drawn.independent)
    return found.assign_coords(swept)


def shares_of(
    word: Words,
    kinds: Sequence[str],
    point: NDArray[np.int64],
    chosen: NDArray[np.bool_],
    along: str = "regime",
) -> xarray.Dataset:
    """Return the share of each kind of motion at each point, in the form of `shares`.

    Parameters
    ----------
    word : (cases,), kind of each case; cases of other kinds than `kinds` are `lost`
    kinds : names along the dimension `along`
    point : (cases,), number of each case's point
    chosen : (cases,), which cases count
    """
    import xarray

    points = np.unique(point)
    count = counts(word, kinds, point, chosen)
    asked = np.bincount(point[chosen], minlength=points.max(initial=-1) + 1)[points]
    cases = count.sum(axis=1)
    bounds = np.array([[interval(int(n), int(total)) for n in row]
                         for row, total in zip(count, cases, strict=True)])  # fmt: skip
    told = {
        "share": f"share of cases that have a {along}",
        "share_low": "lower end of the share's interval, 95 %",
        "share_high": "upper end of the share's interval, 95 %",
        "count": f"cases of this {along}",
        "cases": f"cases that have a {along}",
        "lost": f"cases without a {along}",
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
    """Return the names of swept inputs in a table of shares, its coordinates."""
    names = [str(n) for n, c in found.coords.items() if c.dims == ("point",)]
    return [name for name in names if name != "point"]


def counts(
    word: Words,
    kinds: Sequence[str],
    group: NDArray[np.int64],
    chosen: NDArray[np.bool_],
) -> NDArray[np.int64]:
    """Return the number of chosen cases by group and kind of motion, (groups, kinds).

    group : (cases,), such as points of the sweep; others see `shares_of`
    """
    number = np.unique(group, return_inverse=True)[1]
    table = np.zeros((number.max(initial=-1) + 1, len(kinds)), dtype=np.int64)
    for column, name in enumerate(kinds):
        np.add.at(table[:, column], number[chosen & (word == name)], 1)
    return table
