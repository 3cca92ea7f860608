"""Panels of a refined campaign's map: cells of different sizes, and boundaries.

Refinement divides cells whose corners, cases, have different words. On the map each
cell is divided into parts, one for each corner, which have the colours of its cases.
The border between words runs half way between cases.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.collections import LineCollection, PolyCollection
from numpy.typing import NDArray

from hpcwhirl.arrays import Floats
from hpcwhirl.refinement.boundary import STATES
from hpcwhirl.report import palette
from hpcwhirl.report.map.axes import Axis
from hpcwhirl.report.map.colours import INK
from hpcwhirl.report.map.data import Picture
from hpcwhirl.report.map.drawing import MOST_DRAWN, Mask, Part, hatch
from hpcwhirl.store.results.cells import Refined

LOOKS: dict[str, dict[str, Any]] = {
    "speckle": {"hatch": "....", "linewidth": 0.0, "edgecolor": palette.GROUND},
    "confirmed": {"linewidth": 0.3, "edgecolor": INK, "alpha": 0.45},
}
MOST_EDGED = 300  # number of cases up to which cells have white edges
Ints = NDArray[np.intp]


def draw_refined(axes: Any, part: Part, picture: Picture, refined: Refined) -> Any:
    """Draw a panel of a refined campaign's map: coloured cells and borders of words.

    Returns Matplotlib's artist for a colour bar, None if words are shown

    part, picture : cases of the panel; content of the map
    refined : cells and boundaries of the campaign
    """
    rows, boxes, number = boxes_of(part, picture, refined)
    drawn = _tiles(axes, replace(part, rows=rows), _corners(boxes))
    _outline(axes, refined, boxes, number)
    _draw_lines(axes, part, picture, refined)
    axes.set(xlim=_limits(part.x, boxes[:, :2]), ylim=_limits(part.y, boxes[:, 2:]))
    return drawn


def _tiles(axes: Any, part: Part, polygons: Floats) -> Any:
    """Draw parts of cells in the colours of their cases.

    Returns Matplotlib's artist for a colour bar, None if words are shown

    part : case of each of k parts of cells
    polygons : corners of the parts, (k, 4, 2)
    """
    edged, drawn = len(part.x.index) <= MOST_EDGED, None
    line: dict[str, Any] = {"edgecolors": palette.GROUND if edged else "face",
                            "linewidths": 0.6 if edged else 0.2,
                            "rasterized": not edged}  # fmt: skip
    colours, own = part.colours, part.kind.isin([""])
    if own.any():
        mine = list(polygons[own])
        drawn = PolyCollection(mine, array=part.number[own], norm=colours.norm(),
                               cmap=colours.map(), gid="numbers", **line)  # fmt: skip
        axes.add_collection(drawn, autolim=False)
    for word in colours.words(part.kind):
        mine = list(polygons[part.kind.isin([word])])
        cells = PolyCollection(mine, facecolor=colours.fill(word),
                               gid=f"cells {word}", **line)  # fmt: skip
        axes.add_collection(cells, autolim=False)
        if look := colours.hatch(word):
            hatch(axes, mine, look, f"hatch {word}")
    return drawn


def refined_cells(
    part: Part, picture: Picture, refined: Refined, chosen: Mask
) -> Floats:
    """Return the parts of a panel's cells that belong to chosen cases, to hatch them.

    Returns their corners, (k, 4, 2)

    chosen : for each case of the map, whether it is chosen
    """
    rows, boxes, _ = boxes_of(part, picture, refined)
    return _corners(boxes[chosen[rows]])


def _limits(axis: Axis, ends: Floats) -> tuple[float, float]:
    return (float(ends.min()), float(ends.max())) if axis.name else (-0.5, 0.5)


def boxes_of(
    part: Part, picture: Picture, refined: Refined
) -> tuple[Ints, Floats, Ints]:
    """Divide the cells of a panel into parts, one around each corner; return k parts.

    Returns
    -------
    rows : (k,), index of the case at the corner among the cases of the map
    boxes : (k, 4), left, right, bottom, top of the part
    number : (k,), index of the cell that the part belongs to
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
    """Return which cells have corner i in the plane that the panel shows, (cells,).

    If a refined input is no axis, the panel shows one value of it, a plane through the
    cells. A plane on the border of two cells belongs to the upper cell, and the last
    plane to the last cell.

    found, i : (cells, corners), index of the case at each corner; number of the corner
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
    """Return for each cell the part of an axis that is nearest to its corner i.

    Parameters
    ----------
    axis : axis of the map
    refined : cells of the campaign
    found : (cells, corners), index of the case at each corner among those of the map;
        -1: not shown
    i : number of the corner

    Returns
    -------
    lower and upper end, (cells,) each; and whether the map shows the cases at both
    corners along the axis, (cells,)
    """
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
    """Return x and y of the four corners of k boxes, (k, 4, 2), to draw them.

    boxes : (k, 4), left, right, bottom, top of each box
    """
    left, right, low, high = boxes.T
    x, y = [left, right, right, left], [low, low, high, high]
    return np.stack([np.transpose(x), np.transpose(y)], axis=-1)


def _outline(axes: Any, refined: Refined, boxes: Floats, number: Ints) -> None:
    """Hatch cells of speckle, where words mix at random; outline confirmed cells.

    boxes, number : (k, 4), ends of parts of cells; (k,), index of each one's cell, see
        `boxes_of`
    """
    speckle = refined.cells.state == STATES.index("speckle")
    for name, wanted in (("speckle", speckle), ("confirmed", refined.cells.confirmed)):
        shown = np.unique(number[wanted.astype(bool)[number]])
        whole = np.stack([np.full(len(speckle), sign * np.inf)
                          for sign in (1, -1, 1, -1)], axis=-1)  # fmt: skip
        for side, least in enumerate((np.minimum, np.maximum) * 2):
            least.at(whole[:, side], number, boxes[:, side])
        if len(shown):
            cells = list(_corners(whole[shown]))
            patch = PolyCollection(cells, facecolor="none", gid=name,
                                   rasterized=len(cells) > MOST_DRAWN,
                                   **LOOKS[name])  # fmt: skip
            axes.add_collection(patch, autolim=False)


def _draw_lines(axes: Any, part: Part, picture: Picture, refined: Refined) -> None:
    """Draw the boundaries between words into a panel.

    They are lines if both axes are refined inputs, bars if only the x axis is.
    """
    panels = np.unique(refined.panel_of[picture.case[part.rows]])
    if {*refined.over} == {part.x.name, part.y.name}:
        lines = _lines(part, refined, panels)
    elif refined.over == [part.x.name]:
        lines = _bars(part, picture, refined, panels)
    else:
        return
    drawn = LineCollection(list(lines), colors=INK, linewidths=1.0, gid="boundary",
                           rasterized=len(lines) > MOST_DRAWN)  # fmt: skip
    axes.add_collection(drawn, autolim=False)


def _lines(part: Part, refined: Refined, panels: Ints) -> Floats:
    """Return the line segments of the boundaries between words in a panel, (s, 2, 2).

    They are x and y of both ends of s segments.

    panels : numbers by which refinement counts the panels that this one shows
    """
    ends = refined.lines[np.isin(refined.panel[refined.lines[:, 0]], panels)]
    both = [axis.factor * refined.at[axis.name][ends] for axis in (part.x, part.y)]
    return np.stack(both, axis=-1)


def _bars(part: Part, picture: Picture, refined: Refined, panels: Ints) -> Floats:
    """Return vertical bars, as high as a cell, at the boundaries along x, (s, 2, 2).

    They are x and y of both ends of s bars.

    panels : numbers by which refinement counts the panels that this one shows
    """
    edges, bars = part.y.edges(), []
    for panel in panels:
        rows = part.rows[refined.panel_of[picture.case[part.rows]] == panel]
        x = part.x.factor * refined.at[part.x.name][refined.panel == panel]
        for level in np.unique(part.y.index[rows]):
            bars += [[(v, edges[level]), (v, edges[level + 1])] for v in x]
    return np.array(bars, dtype=float).reshape(-1, 2, 2)
