"""Results over the swept inputs: one axis per input instead of a list of cases."""

from __future__ import annotations

import itertools
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.arrays import Floats
from hpcwhirl.errors import InputError
from hpcwhirl.refinement.boundary import Cells
from hpcwhirl.store.directory.refined import PLACE
from hpcwhirl.store.reading.select import follows, swept_of

if TYPE_CHECKING:
    import xarray

SPARSEST = 4.0  # largest number of grid cells for each case
MOST = 20_000_000  # largest number of points of a grid
CELL = [field.name for field in fields(Cells)]
Ints = NDArray[np.int64]


def grid(data: xarray.Dataset) -> xarray.Dataset:
    """Return results over the swept inputs instead of over `case`.

    Traces are included where every combination of inputs was computed; they are read
    from the file when they are asked for, as `grid(data).centre.sel(speed=440)`. An
    input that is a function of another input, as in [zip], becomes a coordinate along
    that one.

    For a refined campaign the grid has all values of its refined inputs. Each point
    shows the case at the nearest corner of the cell around it; `computed` is 1 if that
    case is at the point itself.

    Parameters
    ----------
    data : results from `open_results`

    Returns
    -------
    xarray.Dataset; combinations that were not computed are NaN or empty

    Raises
    ------
    InputError
        where the cases leave most cells of a grid empty
    """
    swept, traced = swept_of(data), data
    if "final" in data:
        data = nearest(data)
    own = [n for n, v in data.variables.items() if v.dims == ("case",) and n != "case"]
    table = data[own].reset_coords().drop_vars("case", errors="ignore")
    numbers = data["number"] if "number" in data else np.arange(data.sizes["case"])
    table = table.assign(number=("case", np.asarray(numbers)))
    axes = _axes(table, swept)
    if not axes:
        only = table.isel(case=0, drop=True).rename(number="case")
        return only.assign(_traces(traced, only["case"]))
    cells = float(np.prod([len(set(table[n].to_numpy().tolist())) for n in axes]))
    count = data.sizes["case"]
    if cells > SPARSEST * count:
        over = " x ".join(axes)
        msg = f"{count} cases over {over} do not fill a grid of {cells:.0f} cells"
        raise InputError(msg)
    along = {n: _followed(table, n, axes) for n in swept if n not in axes}
    told = {n: _levels(table, n, by) for n, by in along.items() if by}
    rest = table.drop_vars(list(told))
    if len(axes) == 1:
        full = rest.set_coords(axes).swap_dims(case=axes[0]).sortby(axes[0])
    else:
        full = rest.set_index(case=axes).unstack("case")
    coords = {
        n: (by, [told[n][v] for v in full[by].to_numpy().tolist()], data[n].attrs)
        for n, by in along.items()
        if by
    }
    whole = full.assign_coords(coords).rename(number="case")
    return whole.assign(_traces(traced, whole["case"]))


def _traces(data: xarray.Dataset, number: xarray.DataArray) -> dict[str, Any]:
    """Return {name: trace over a grid's axes}, still in the file.

    It is empty where a point of the grid has no case.

    Parameters
    ----------
    data : results over `case`
    number : number of the case at each point of the grid
    """
    from hpcwhirl.store.reading.gridded import gridded

    if not np.isfinite(number.to_numpy()).all():
        return {}
    return {
        str(name): gridded(variable, number)
        for name, variable in data.variables.items()
        if len(variable.dims) > 1 and variable.dims[0] == "case"
    }


def nearest(data: xarray.Dataset) -> xarray.Dataset:
    """Return a refined campaign on a full grid of its finest values.

    Each point has the variables of the nearest case. `computed` is 1 where that case
    lies at the point itself; `number` is the case's number.
    """
    rows, values = nearest_rows(data)
    at = {n: data[n].to_numpy() for n in values}
    own = [n for n, v in data.variables.items() if v.dims == ("case",) and n != "case"]
    found = data[own].drop_vars("case", errors="ignore").isel(case=rows)
    same = np.logical_and.reduce([at[n][rows] == v for n, v in values.items()])
    new: dict[str, Any] = {n: ("case", v, data[n].attrs) for n, v in values.items()}
    new |= {"computed": ("case", same.astype(np.int8)), "number": ("case", rows)}
    return found.assign(new)


def nearest_rows(data: xarray.Dataset) -> tuple[Ints, dict[str, NDArray[Any]]]:
    """Return the case nearest to each point of a refined map's finest grid.

    There is a grid for each combination of inputs not refined, one after the other.
    Only the corners of the unsplit cell around a point are considered. Distances are
    measured along each input in intervals of its coarse values.

    data : results of a refined campaign, from `open_results`

    Returns
    -------
    rows : (points,), numbers of cases
    values : {refined input: (points,)}, its values at the points
    """
    over = str(data["cell_corner"].attrs["over"]).split()
    place = {n: data[PLACE + n].to_numpy() for n in over}
    known = [np.unique(place[n], return_index=True) for n in over]
    panels = int(data["panel"].to_numpy().max()) + 1
    if panels * np.prod([len(k[0]) for k in known], dtype=float) > MOST:
        msg = f"the finest grid of {' x '.join(over)} has more than {MOST} points: "
        raise InputError(msg + "use the cases without a grid")
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
    """Return the number of the case nearest to each point of a grid; -1 for none.

    A position is measured in intervals between coarse values, from the first.

    Parameters
    ----------
    cells : cells of a refined map that are not split
    place : (cases,), position of each case along each refined input
    at : positions of the grid along each refined input, ascending
    panels : number of panels, combinations of inputs not refined

    Returns
    -------
    (panels, points along the first input, along the second, ...)
    """
    found = np.full((panels, *map(len, at)), -1)
    for number in np.argsort(cells.level, kind="stable"):
        corner, panel = cells.corner[number], cells.panel[number]
        sides = _sides(corner, place, at)
        for rows, box in zip(corner, itertools.product(*sides), strict=True):
            found[(panel, *box)] = rows
    return found


def _sides(corner: Ints, place: list[Floats], at: list[Floats]) -> list[list[slice]]:
    """Return which grid points in a cell are nearer to its low and to its high corners.

    Parameters
    ----------
    corner : (2^d,), numbers of the cases at the corners of a cell
    place, at : positions of cases and of grid points, as in `nearest_cases`

    Returns
    -------
    along each of d inputs, [slice of the points nearer to the low end, slice of those
    nearer to the high end]
    """
    out = []
    for own, known in zip(place, at, strict=True):
        low, high = own[corner[0]], own[corner[-1]]
        first, last = np.searchsorted(known, [low, high])
        middle = int(np.searchsorted(known, (low + high) / 2, side="right"))
        out.append([slice(first, middle), slice(middle, last + 1)])
    return out


def _levels(table: xarray.Dataset, name: str, by: str) -> dict[Any, Any]:
    """Return {value of one input: value of another one that follows from it}.

    Parameters
    ----------
    table : results over `case`
    name : the input that follows
    by : the input that determines it
    """
    keys, values = (table[n].to_numpy().tolist() for n in (by, name))
    return dict(zip(keys, values, strict=True))


def _axes(table: xarray.Dataset, swept: list[str]) -> list[str]:
    """Return the names of the swept inputs that become axes of the grid.

    They are those that vary, without inputs that are functions of an earlier one.

    Parameters
    ----------
    table : results over `case`
    swept : names of the swept inputs
    """
    varied = [n for n in swept if len(set(table[n].to_numpy().tolist())) > 1]
    cells = np.prod([float(len(set(table[n].to_numpy().tolist()))) for n in varied])
    if cells <= table.sizes["case"]:
        return varied or swept[:1]
    axes: list[str] = []
    for name in varied:
        if not _followed(table, name, axes):
            axes.append(name)
    return axes


def _followed(table: xarray.Dataset, name: str, axes: list[str]) -> str:
    """Return the axis of the grid whose value determines an input's value, else "".

    Parameters
    ----------
    table : results over `case`
    name : the input
    axes : inputs that are axes of the grid
    """
    return next((axis for axis in axes if follows(table, name, axis)), "")
