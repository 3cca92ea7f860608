"""Panels of a refined campaign's map: cells at their own sizes, and boundaries."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.refinement.boundary import STATES
from hpcwhirl.report.axes import Axis, scale_of
from hpcwhirl.report.cells import Mask, Part, draw_polygons, hatch_polygons
from hpcwhirl.report.picture import Picture
from hpcwhirl.store.results.cells import Refined

if TYPE_CHECKING:
    import xarray

INK = "#000000"
SPECKLED = "#FFFFFF"
MOST_DRAWN = 2000  # outlines and lines as such in an SVG
Floats = NDArray[np.float64]
Ints = NDArray[np.intp]


def with_cells(
    picture: Picture, data: xarray.Dataset, refined: Refined | None
) -> Picture:
    """Return a picture that is drawn by cells, where an axis is a refined input."""
    if refined is None or not {picture.x.name, picture.y.name} & {*refined.over}:
        return picture
    x, y = (_scaled(axis, data, refined) for axis in (picture.x, picture.y))
    return replace(picture, x=x, y=y, refined=refined, scattered=True, free=False)


def _scaled(axis: Axis, data: xarray.Dataset, refined: Refined) -> Axis:
    """Return an axis with the scale of its coarse values: finer ones crowd."""
    if axis.name not in refined.over:
        return axis
    coarse = np.unique(data[axis.name].to_numpy()[data["level"].to_numpy() == 0])
    log = refined.scale[refined.over.index(axis.name)] == "log"
    return replace(axis, scale="log" if log else scale_of(coarse))


def draw_refined(axes: Any, part: Part, picture: Picture) -> Any:
    """Draw a panel; return the mesh of numbers, if any."""
    refined = picture.refined
    if refined is None:
        return None
    rows, boxes, number = _boxes(part, picture, refined)
    tiles = replace(part, rows=rows, whirl=picture.whirl[rows])
    drawn = draw_polygons(axes, tiles, list(_corners(boxes)))
    _mark(axes, refined, boxes, number)
    _draw_lines(axes, part, picture, refined)
    axes.set(xlim=_limits(part.x, boxes[:, :2]), ylim=_limits(part.y, boxes[:, 2:]))
    return drawn


def hatch_refined(
    axes: Any, part: Part, picture: Picture, chosen: Mask, look: tuple[str, str]
) -> None:
    """Hatch the parts of cells whose nearest case is a chosen one of the map."""
    if picture.refined is not None:
        rows, boxes, _ = _boxes(part, picture, picture.refined)
        hatch_polygons(axes, list(_corners(boxes[chosen[rows]])), look, "hatch chosen")


def _limits(axis: Axis, ends: Floats) -> tuple[float, float]:
    return (float(ends.min()), float(ends.max())) if axis.name else (-0.5, 0.5)


def _boxes(part: Part, picture: Picture, refined: Refined) -> tuple[Ints, Floats, Ints]:
    """Return what is nearest to each corner of each cell within it.

    Returns
    -------
    rows : (k,), of the picture
    boxes : (k, 4), left, right, bottom, top
    number : (k,), of the cell
    """
    own = np.full(1 + max(picture.case.max(), refined.cells.corner.max()), -1)
    own[picture.case[part.rows]] = part.rows
    found = own[refined.cells.corner]
    count, rows, boxes, number = len(refined.over), [], [], []
    for i in range(1 << count):
        keep = (found[:, i] >= 0) & _in_plane(part, refined, found, i)
        ends = []
        for axis in (part.x, part.y):
            low, high, there = _ends(axis, refined, found, i)
            keep &= there
            ends += [low, high]
        rows.append(found[keep, i])
        boxes.append(np.column_stack(ends)[keep])
        number.append(np.flatnonzero(keep))
    return np.concatenate(rows), np.concatenate(boxes), np.concatenate(number)


def _bit(refined: Refined, name: str) -> int:
    return 1 << (len(refined.over) - 1 - refined.over.index(name))


def _in_plane(part: Part, refined: Refined, found: Ints, i: int) -> NDArray[np.bool_]:
    """Return whether a cell shows this corner where a refined input is no axis.

    A plane between two cells is that of the upper one, but for the last plane.
    """
    keep = np.ones(len(found), dtype=bool)
    for name in refined.over:
        if name not in (part.x.name, part.y.name):
            bit = _bit(refined, name)
            if i & bit:
                keep &= refined.last[name][refined.cells.corner[:, i]]
    return keep


def _ends(
    axis: Axis, refined: Refined, found: Ints, i: int
) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """Return from where to where a corner is the nearest, and whether that is known."""
    own = found[:, i]
    if axis.name not in refined.over:
        edges, level = axis.edges(), axis.index[own]
        return edges[level], edges[level + 1], np.ones(len(own), dtype=bool)
    mate = found[:, i ^ _bit(refined, axis.name)]
    at = axis.scaled()
    ends = np.sort([at[own], (at[own] + at[mate]) / 2], axis=0)
    ends = np.exp(ends) if axis.scale == "log" else ends
    return ends[0], ends[1], mate >= 0


def _corners(boxes: Floats) -> NDArray[np.float64]:
    """Return the corners of boxes, (k, 4, 2)."""
    left, right, low, high = boxes.T
    x, y = [left, right, right, left], [low, low, high, high]
    return np.stack([np.transpose(x), np.transpose(y)], axis=-1)


def _mark(axes: Any, refined: Refined, boxes: Floats, number: Ints) -> None:
    """Hatch speckle, and outline confirmed cells."""
    from matplotlib.collections import PolyCollection

    speckle = refined.cells.state == STATES.index("speckle")
    looks: dict[str, tuple[Any, dict[str, Any]]] = {
        "speckle": (speckle, {"hatch": "....", "linewidth": 0.0,
                              "edgecolor": SPECKLED}),
        "confirmed": (refined.cells.confirmed == 1,
                      {"linewidth": 0.3, "edgecolor": INK, "alpha": 0.45}),
    }  # fmt: skip
    for name, (wanted, look) in looks.items():
        shown = np.unique(number[wanted[number]])
        if not len(shown):
            continue
        order = np.argsort(number, kind="stable")
        starts = np.searchsorted(number[order], shown)
        ends = np.searchsorted(number[order], shown, side="right")
        pairs = zip(starts, ends, strict=True)
        whole = np.array([_hull(boxes[order[a:b]]) for a, b in pairs])
        patch = PolyCollection(list(_corners(whole)), facecolor="none", **look)
        patch.set_rasterized(len(shown) > MOST_DRAWN)
        patch.set_gid(name)
        axes.add_collection(patch, autolim=False)


def _hull(boxes: Floats) -> Floats:
    """Return the box around boxes."""
    low, high = boxes.min(axis=0), boxes.max(axis=0)
    return np.array([low[0], high[1], low[2], high[3]])


def _draw_lines(axes: Any, part: Part, picture: Picture, refined: Refined) -> None:
    """Draw boundaries: lines of two refined inputs, bars of one."""
    from matplotlib.collections import LineCollection

    panels = np.unique(refined.panel_of[picture.case[part.rows]])
    if {*refined.over} == {part.x.name, part.y.name}:
        lines = _lines(part, refined, panels)
    elif refined.over == [part.x.name]:
        lines = _bars(part, picture, refined, panels)
    else:
        return
    drawn = LineCollection(list(lines), colors=INK, linewidths=1.0)
    drawn.set_gid("boundary")
    drawn.set_rasterized(len(lines) > MOST_DRAWN)
    axes.add_collection(drawn, autolim=False)


def _lines(part: Part, refined: Refined, panels: Ints) -> Floats:
    """Return the ends of lines, (s, 2, xy)."""
    ends = refined.lines[np.isin(refined.panel[refined.lines[:, 0]], panels)]
    both = [axis.factor * refined.at[axis.name][ends] for axis in (part.x, part.y)]
    return np.stack(both, axis=-1)


def _bars(part: Part, picture: Picture, refined: Refined, panels: Ints) -> Floats:
    """Return upright bars over the height of their panel's row, (s, 2, xy)."""
    edges, bars = part.y.edges(), []
    for panel in panels:
        rows = part.rows[refined.panel_of[picture.case[part.rows]] == panel]
        x = part.x.factor * refined.at[part.x.name][refined.panel == panel]
        for level in np.unique(part.y.index[rows]):
            bars += [[(v, edges[level]), (v, edges[level + 1])] for v in x]
    return np.array(bars, dtype=float).reshape(-1, 2, 2)
