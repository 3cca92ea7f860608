"""The case nearest to any point of a refined campaign, by the cell that it lies in."""

from __future__ import annotations

import itertools
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import InputError
from hpcwhirl.refinement.boundary import Cells
from hpcwhirl.store.directory.refined import PLACE

if TYPE_CHECKING:
    import xarray

MOST = 20_000_000  # points of a grid
CELL = [field.name for field in fields(Cells)]
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
    known = [np.unique(place[n], return_index=True) for n in over]
    panels = int(data["panel"].to_numpy().max()) + 1
    if panels * np.prod([len(k[0]) for k in known], dtype=float) > MOST:
        msg = f"the finest grid of {' x '.join(over)} has more than {MOST} points: "
        raise InputError(msg + "take the cases themselves")
    cells = Cells(*(data[f"cell_{name}"].to_numpy() for name in CELL))
    at = [places for places, _ in known]
    found = nearest_cases(cells, list(place.values()), at, panels)
    values = [data[n].to_numpy()[k[1]] for n, k in zip(over, known, strict=True)]
    grids = np.meshgrid(*values, indexing="ij")
    told = {n: np.tile(g.ravel(), panels) for n, g in zip(over, grids, strict=True)}
    return found.ravel(), told


def nearest_cases(
    cells: Cells, place: list[Floats], at: list[Floats], panels: int = 1
) -> Ints:
    """Return the case nearest to each point of a grid, (panels, ...).

    Parameters
    ----------
    cells : that are not split
    place : (cases,) along each refined input
    at : places of the grid along it, ascending
    panels : how many there are
    """
    found = np.full((panels, *map(len, at)), -1)
    for number in np.argsort(cells.level, kind="stable"):
        corner, panel = cells.corner[number], cells.panel[number]
        sides = _sides(corner, place, at)
        for rows, box in zip(corner, itertools.product(*sides), strict=True):
            found[(panel, *box)] = rows
    return found


def _sides(corner: Ints, place: list[Floats], at: list[Floats]) -> list[list[slice]]:
    """Return, along each input, the points nearer to the low and to the high corner."""
    out = []
    for own, known in zip(place, at, strict=True):
        low, high = own[corner[0]], own[corner[-1]]
        first, last = np.searchsorted(known, [low, high])
        middle = int(np.searchsorted(known, (low + high) / 2, side="right"))
        out.append([slice(first, middle), slice(middle, last + 1)])
    return out
