"""The case nearest to any point of a refined campaign, by the cell that it lies in."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import InputError
from hpcwhirl.store.refined import PLACE

if TYPE_CHECKING:
    import xarray

MOST = 20_000_000  # points of a grid
Ints = NDArray[np.int64]
Floats = NDArray[np.float64]


def nearest_rows(
    data: xarray.Dataset,
) -> tuple[Ints, dict[str, NDArray[Any]]]:
    """Return the case nearest to each point of the finest grid, panel after panel.

    Distances are along the inputs, in intervals of their coarse values, within the
    cells that are not split; the words at the corners of a cell decided that it is not.

    Returns
    -------
    rows : (points,), numbers of cases
    values : {refined input: (points,)}
    """
    over = str(data["cell_corner"].attrs["over"]).split()
    place = {n: data[PLACE + n].to_numpy() for n in over}
    known = {n: np.unique(place[n], return_index=True) for n in over}
    shape = tuple(len(known[n][0]) for n in over)
    panels = int(data["panel"].to_numpy().max()) + 1
    if panels * np.prod(shape, dtype=float) > MOST:
        msg = f"the finest grid of {' x '.join(over)} has more than {MOST} points: "
        raise InputError(msg + "take the cases themselves")
    found = np.full((panels, *shape), -1)
    at = [known[n][0] for n in over]
    corner, panel = data["cell_corner"].to_numpy(), data["cell_panel"].to_numpy()
    for number in np.argsort(data["cell_level"].to_numpy(), kind="stable"):
        sides = _sides(corner[number], [place[n] for n in over], at)
        for rows, box in zip(corner[number], itertools.product(*sides), strict=True):
            found[(panel[number], *box)] = rows
    grids = np.meshgrid(*(data[n].to_numpy()[known[n][1]] for n in over), indexing="ij")
    values = {n: np.tile(g.ravel(), panels) for n, g in zip(over, grids, strict=True)}
    return found.ravel(), values


def _sides(corner: Ints, place: list[Floats], at: list[Floats]) -> list[list[slice]]:
    """Return, along each input, the points nearer to the low and to the high corner."""
    out = []
    for own, known in zip(place, at, strict=True):
        low, high = own[corner[0]], own[corner[-1]]
        first, last = np.searchsorted(known, [low, high])
        middle = int(np.searchsorted(known, (low + high) / 2, side="right"))
        out.append([slice(first, middle), slice(middle, last + 1)])
    return out
