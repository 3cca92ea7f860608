"""Lines of critical speeds on a map: Eq. 13, and super-harmonics of the casing."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.analysis.rotation import critical_of
from hpcwhirl.arrays import Floats
from hpcwhirl.case.resolve import resolve
from hpcwhirl.errors import InputError
from hpcwhirl.report import palette
from hpcwhirl.report.canvas import BOX, eq13_of
from hpcwhirl.report.map.axes import Axis, straight
from hpcwhirl.report.map.data import Picture
from hpcwhirl.scene import Scene
from hpcwhirl.store.reading.results_file import Results

ORDERS = 12  # highest super-harmonic of the casing
CLOSE = 0.035  # fraction of the speed axis within which labels would overlap
# Largest number of models for which critical speeds are computed along the other axis;
# each is drawn as far as half way to the next one.
MOST_MODELS = 7
Rows = list[dict[str, Any]]  # as `critical_of_families` returns


@dataclass(frozen=True)
class _Level:
    """A cell of the map's axis that is not the speed's, in which one model holds.

    Attributes
    ----------
    low, high : ends of the cell, in the unit of the axis
    case : number of a case in the cell, whose model is taken
    """

    low: float
    high: float
    case: int


def mark_critical(panels: Iterable[Any], picture: Picture, path: Path) -> None:
    """Draw the critical speeds (omega_bd + n omega_c) / k into every panel of a map.

    Lines of other families than 1F are labelled with the family.

    Parameters
    ----------
    panels : axes of matplotlib; surplus ones are not used
    picture : content of the map
    path : `results.h5`; the plan beside it has the scenes
    """
    if "speed" not in {picture.x.name, picture.y.name}:
        raise InputError("--critical marks speeds: speed must be on an axis")
    results = Results(path)
    upright = picture.x.name == "speed"
    speed, across = picture.x, picture.y
    if not upright:
        speed, across = across, speed
    for number, axes in zip(range(len(picture.panels)), panels, strict=False):
        found = _levels(across, picture, number)
        lines = [(level, speeds_of(results.scene(level.case))) for level in found]
        _draw(axes, lines, speed.factor, upright=upright)


def speeds_of(scene: Scene) -> Rows:
    """Return the critical speeds of a scene for the nodal diameter of its pulse.

    Each is a dict with the keys `nodal_diameter` (of the blades' wave), `order` (n of
    the excitation by the casing's wave), `speed` (rad/s) and `family` (of the blades'
    modes, such as 1F).
    """
    k, rows = scene.nodal_diameter, critical_of(resolve(scene), ORDERS)
    return [row for row in rows if row["nodal_diameter"] == k]


def _levels(across: Axis, picture: Picture, number: int) -> list[_Level]:
    """Return the cells along the map's other axis, for each of which a model is made.

    If a real input has more than `MOST_MODELS` cells, they are joined to that many.

    across, number : axis that is not the speed's; number of the panel
    """
    rows = np.flatnonzero(picture.panel == number)
    index = across.index[rows]
    chosen = np.unique(index)
    cells = across.edges()
    low, high = cells[chosen], cells[chosen + 1]
    if len(chosen) > MOST_MODELS and not across.names and not across.whole:
        some = np.linspace(0, len(chosen) - 1, MOST_MODELS).round().astype(int)
        low, high = _halfway(across, chosen[some])
        chosen = chosen[some]
    first = [int(picture.case[rows[np.argmax(index == i)]]) for i in chosen]
    return [
        _Level(float(a), float(b), case)
        for a, b, case in zip(low, high, first, strict=True)
    ]


def _halfway(across: Axis, chosen: NDArray[np.intp]) -> tuple[Floats, Floats]:
    """Return lower and upper ends of wider cells around chosen levels of an axis.

    Cells meet half way between these levels; the first and the last end with the axis.

    across, chosen : the axis; indices of the chosen levels
    """
    at = straight(across.levels[chosen], across.scale)
    middle = (at[1:] + at[:-1]) / 2
    inner = np.exp(middle) if across.scale == "log" else middle
    ends = across.edges()
    return np.r_[ends[0], inner], np.r_[inner, ends[-1]]


def _draw(
    axes: Any, lines: list[tuple[_Level, Rows]], factor: float, *, upright: bool
) -> None:
    """Draw the critical speeds of a panel, a line segment across each cell.

    They are the same clockwise, at negative speeds.

    Parameters
    ----------
    axes : axes of matplotlib
    lines : each cell of the other axis, and the critical speeds of its model
    factor : from rad/s to the unit of the axis of speeds
    upright : whether the speed is along x, so that lines are vertical
    """
    along, across = axes.get_xlim(), axes.get_ylim()
    along, across = (along, across) if upright else (across, along)
    low, high = sorted(along)
    named: dict[str, float] = {}
    for level, rows in lines[::-1]:  # names are at the ends of the lines
        for row, sense in product(rows, (1.0, -1.0)):
            at = sense * factor * row["speed"]
            if not low <= at <= high:
                continue
            _piece(axes, row, at, level, upright=upright)
            text = eq13_of(row["family"]) if row["order"] == 1 else f"n={row['order']}"
            near = (abs(at - other) for other in named.values())
            if text not in named and min(near, default=np.inf) > CLOSE * (high - low):
                named[text] = at
                _name(axes, text, (at, min(level.high, max(across))), upright=upright)


def _piece(
    axes: Any, row: dict[str, Any], at: float, level: _Level, *, upright: bool
) -> None:
    """Draw the segment of one critical speed across the cell of its model.

    row, at : the critical speed, see `speeds_of`; its position on the axis of speeds
    level, upright : the cell; whether the segment is vertical
    """
    ends, order = ([at, at], [level.low, level.high]), row["order"]
    main = row["family"] == "1F"
    axes.plot(
        *(ends if upright else ends[::-1]), scalex=False, scaley=False, c=palette.INK,
        ls=("-" if main else "-.") if order == 1 else "--",
        lw=1.6 if order == 1 else 0.8,
        gid=f"n{order}" if main else f"n{order} {row['family']}",
    )  # fmt: skip


def _name(axes: Any, text: str, at: tuple[float, float], *, upright: bool) -> None:
    """Write the label of a critical speed at the end of its line, on a white box.

    at, upright : end of the line; whether the line is vertical
    """
    look = {"fontsize": 6.5, "textcoords": "offset points"}
    if upright:  # two lines, since wide names would overlap
        axes.annotate(text.replace(", ", ",\n"), at, (0, -2), ha="center", va="top",
                      bbox=BOX, **look)  # fmt: skip
    else:
        axes.annotate(text, at[::-1], (-2, 0), ha="right", va="center", bbox=BOX,
                      **look)  # fmt: skip
