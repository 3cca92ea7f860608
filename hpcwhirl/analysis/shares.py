"""The probability of each regime, from cases whose inputs were drawn."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.scene.words import REGIMES
from hpcwhirl.store.reading.reader import words
from hpcwhirl.store.reading.shares import interval
from hpcwhirl.store.results.sampled import drawn_of, points_of

if TYPE_CHECKING:
    import xarray

Floats = NDArray[np.float64]


def shares(data: xarray.Dataset) -> xarray.Dataset:
    """Return the share of each regime at each point of a sampled campaign's sweep.

    Cases without a regime, failed or unstable, are counted in `lost` and in no share.
    Of a sample of method `saltelli` only the independent draws A and B are counted.

    Parameters
    ----------
    data : results of `open_results`, of a campaign with [sample]

    Returns
    -------
    xarray.Dataset over `point`, with the swept inputs as coordinates, and `regime`:
    `share`, `share_low`, `share_high` (Wilson's 95 % interval for independent draws;
    low-discrepancy draws err less), `count`; over `point` alone `cases`, the number
    with a regime, and `lost`

    Raises
    ------
    InputError
        where no input of the campaign was drawn
    """
    import xarray

    drawn = drawn_of(data)
    points, swept = points_of(data, drawn)
    count = counts(data, drawn.independent, drawn.point)
    asked = np.bincount(drawn.point[drawn.independent])[points]
    cases = count.sum(axis=1)
    bounds = np.array([[interval(int(n), int(total)) for n in row]
                         for row, total in zip(count, cases, strict=True)])  # fmt: skip
    both = ("point", "regime")
    dataset = xarray.Dataset(
        {
            "share": (
                both,
                bounds[..., 0],
                _attributes("share of cases that have a regime"),
            ),
            "share_low": (
                both,
                bounds[..., 1],
                _attributes("lower end of its interval, 95 %"),
            ),
            "share_high": (
                both,
                bounds[..., 2],
                _attributes("upper end of its interval, 95 %"),
            ),
            "count": (both, count, _attributes("cases of this regime")),
            "cases": ("point", cases, _attributes("cases that have a regime")),
            "lost": ("point", asked - cases, _attributes("cases without a regime")),
        },
        coords={"regime": list(REGIMES), "point": points},
    )
    return dataset.assign_coords(swept)


def counts(
    data: xarray.Dataset, chosen: NDArray[np.bool_], group: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Return the number of chosen cases by group and regime, (groups, regimes).

    chosen, group : (cases,), which cases count, and their groups' numbers
    """
    word, number = words(data["regime"]), np.unique(group, return_inverse=True)[1]
    table = np.zeros((number.max(initial=-1) + 1, len(REGIMES)), dtype=np.int64)
    for column, name in enumerate(REGIMES):
        np.add.at(table[:, column], number[chosen & (word == name)], 1)
    return table


def _attributes(meaning: str) -> dict[str, Any]:
    return {"units": "1", "long_name": meaning}
