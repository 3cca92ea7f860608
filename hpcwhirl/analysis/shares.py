"""How probable each regime is, from cases whose inputs were drawn."""

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
    """Return how probable each regime is at each point of a sampled campaign's sweep.

    Cases that have no regime, failed or unstable, are `lost`: they count for no word.
    Of a sample of method `saltelli` the draws A and B count, which are independent.

    Parameters
    ----------
    data : of `open_results`, of a campaign with [sample]

    Returns
    -------
    xarray.Dataset over `point`, with the swept inputs as coordinates, and `regime`:
    `share`, `share_low`, `share_high` (Wilson's interval, 95 %, as of independent
    draws; low-discrepancy ones err less), `count`; over `point` alone `cases`, those
    that have a regime, and `lost`

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
    own = np.array([[interval(int(n), int(total)) for n in row]
                         for row, total in zip(count, cases, strict=True)])  # fmt: skip
    both = ("point", "regime")
    found = xarray.Dataset(
        {
            "share": (both, own[..., 0], _told("share of cases that have a regime")),
            "share_low": (both, own[..., 1], _told("lower end of its interval, 95 %")),
            "share_high": (both, own[..., 2], _told("upper end of it")),
            "count": (both, count, _told("cases of this regime")),
            "cases": ("point", cases, _told("cases that have a regime")),
            "lost": ("point", asked - cases, _told("cases without one")),
        },
        coords={"regime": list(REGIMES), "point": points},
    )
    return found.assign_coords(swept)


def counts(
    data: xarray.Dataset, chosen: NDArray[np.bool_], group: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Return how many chosen cases of each group have each regime, (groups, regimes).

    Failed and unstable cases have none.
    """
    word, number = words(data["regime"]), np.unique(group, return_inverse=True)[1]
    found = np.zeros((number.max(initial=-1) + 1, len(REGIMES)), dtype=np.int64)
    for place, name in enumerate(REGIMES):
        np.add.at(found[:, place], number[chosen & (word == name)], 1)
    return found


def _told(meaning: str) -> dict[str, Any]:
    return {"units": "1", "long_name": meaning}
