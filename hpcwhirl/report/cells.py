"""Panels of a map: cells of a grid, cells around scattered cases, or points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.report.axes import Axis, straight
from hpcwhirl.report.colours import Colours
from hpcwhirl.scene.words import WHIRLS, Look

HATCHES = {"missing": "////", "failed": "xxx", "unstable": "+++"}
HATCHED = "#8A8A8A"
MOST_VORONOI = 20_000  # cases of a panel with a cell each; above, points
MOST_MARKED = 300  # scattered cases of a map whose places and whirl are marked
FEW_LEVELS = 12
COVER = 0.35  # share of a panel that points cover, if they may be so large
NO_CELL = -1
NARROW = 9.0  # points that a letter or a marker needs
Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Part:
    """The cases of one panel.

    Attributes
    ----------
    x, y : axes of the whole map
    rows : (n,), numbers of the panel's cases among those of the map
    colours : what the colours tell
    whirl : (n,), of these cases
    size : of the panel, points
    lettered : whether letters and markers tell what the colour tells, too
    """

    x: Axis
    y: Axis
    rows: NDArray[np.intp]
    colours: Colours
    whirl: NDArray[np.str_]
    size: tuple[float, float]
    lettered: bool

    @property
    def kind(self) -> NDArray[np.str_]:
        """Return the words of these cases, "" where a number is shown."""
        return self.colours.kind[self.rows]


def draw_grid(axes: Any, part: Part) -> Any:
    """Draw a cell for each case, to scale; return the mesh of numbers, if any."""
    ix, iy = part.x.index[part.rows], part.y.index[part.rows]
    edges = part.x.edges(), part.y.edges()
    shape = len(part.y.levels), len(part.x.levels)
    line = {"edgecolors": "white", "linewidth": 0.8} if part.lettered else {}
    mesh = None
    if part.colours.number is not None:
        values = np.full(shape, np.nan)
        own = part.kind == ""
        values[iy[own], ix[own]] = part.colours.number[part.rows][own]
        mesh = _mesh(axes, edges, values, part.colours, line)
    words, codes = coded(part.colours.looks, part.kind)
    if words:
        from matplotlib.colors import ListedColormap

        grid = np.full(shape, NO_CELL)
        grid[iy, ix] = codes
        plain = np.ma.masked_equal(grid, NO_CELL)
        fills = ListedColormap([fill_of(w, part.colours) for w in words])
        drawn = axes.pcolormesh(
            *edges,
            plain,
            cmap=fills,
            vmin=-0.5,
            vmax=len(words) - 0.5,
            rasterized=True,
            **line,
        )
        drawn.set_gid("words " + " ".join(words))
        for word in hatched(part.colours, words):
            _hatch(axes, _runs(grid == words.index(word), *edges), word)
    if part.lettered:
        _letters(axes, part)
    return mesh


def _mesh(axes: Any, edges: Any, values: Floats, colours: Colours, line: Any) -> Any:
    shown = np.ma.masked_invalid(values)
    mesh = axes.pcolormesh(*edges, shown, norm=colours.norm(), cmap=colours.map(),
                           rasterized=True, **line)  # fmt: skip
    mesh.set_gid("numbers")
    return mesh


def coded(
    looks: dict[str, Look], kind: NDArray[np.str_]
) -> tuple[list[str], NDArray[np.intp]]:
    """Return the words that occur, in the order of `looks`, and each case's place.

    A case that is told by a number has `NO_CELL`.
    """
    found = set(np.unique(kind).tolist())
    words = [word for word in looks if word in found]
    codes = np.full(len(kind), NO_CELL)
    for i, word in enumerate(words):
        codes[kind == word] = i
    return words, codes


def fill_of(word: str, colours: Colours) -> str:
    """Return the fill of a word; beside a colour bar, white under a hatch."""
    return colours.looks[word].colour if colours.number is None else "#FFFFFF"


def hatched(colours: Colours, words: list[str]) -> list[str]:
    """Return the words that have a hatch: beside colours of words, `missing` alone."""
    hatches = {"missing"} if colours.number is None else HATCHES.keys()
    return [word for word in words if word in hatches]


def _runs(wanted: Mask, x: Floats, y: Floats) -> list[Floats]:
    """Return rectangles that cover the wanted cells, one for each run in a row."""
    boxes = []
    for row in np.flatnonzero(wanted.any(axis=1)):
        ends = np.flatnonzero(np.diff(np.r_[0, wanted[row].astype(int), 0]))
        for a, b in zip(ends[::2], ends[1::2], strict=True):
            low, high = y[row], y[row + 1]
            boxes.append(
                np.array([[x[a], low], [x[b], low], [x[b], high], [x[a], high]])
            )
    return boxes


def _hatch(axes: Any, polygons: list[Floats], word: str) -> None:
    """Hatch the polygons of a word."""
    hatch_polygons(axes, polygons, (HATCHES[word], HATCHED), f"hatch {word}")


def hatch_grid(axes: Any, part: Part, chosen: Mask, look: tuple[str, str]) -> None:
    """Hatch the cells of chosen cases of a grid, in a pattern and colour."""
    wanted = np.zeros((len(part.y.levels), len(part.x.levels)), dtype=bool)
    rows = part.rows[chosen]
    wanted[part.y.index[rows], part.x.index[rows]] = True
    polygons = _runs(wanted, part.x.edges(), part.y.edges())
    hatch_polygons(axes, polygons, look, "hatch chosen")


def hatch_cells(axes: Any, part: Part, chosen: Mask, look: tuple[str, str]) -> None:
    """Hatch the nearest cells of chosen scattered cases."""
    polygons = voronoi(part, (axes.get_xlim(), axes.get_ylim()))
    mine = [polygons[i] for i in np.flatnonzero(chosen)]
    hatch_polygons(axes, mine, look, "hatch chosen")


def hatch_polygons(
    axes: Any, polygons: Sequence[Floats], look: tuple[str, str], name: str
) -> None:
    """Hatch polygons as one patch: many of them cost little more than one."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    whole = Path.make_compound_path(*(Path(p, closed=False) for p in polygons))
    axes.add_artist(
        PathPatch(whole, facecolor="none", edgecolor=look[1], lw=0.0,
                  hatch=look[0], gid=name, rasterized=True)
    )  # fmt: skip


def _letters(axes: Any, part: Part) -> None:
    """Write a letter into each cell, and a marker of whirl below or beside it."""
    x, y = part.x.middles(part.rows), part.y.middles(part.rows)
    stacked, beside = rooms(part)
    told = part.colours.name != "whirl"  # by a marker, where no letter tells it
    for shift, chosen in (((0.0, 4.5), stacked), ((-4.5, 0.0), beside)):
        for i in np.flatnonzero(chosen & (part.kind != "")):
            look = part.colours.looks[part.kind[i]]
            ink = look.ink if part.colours.number is None else "#000000"
            axes.annotate(
                look.letter,
                (x[i], y[i]),
                shift,
                color=ink,
                fontsize=8,
                textcoords="offset points",
                ha="center",
                va="center",
            )
        marked = chosen & ~np.isin(part.kind, list(HATCHES)) & told
        alone = part.colours.number is not None
        away = (0.0, 0.0) if alone else (-shift[0], -shift[1])
        draw_whirls(axes, x[marked], y[marked], part.whirl[marked], away)


def rooms(part: Part) -> tuple[Mask, Mask]:
    """Return which cells have room for a letter over a marker, which for a row."""
    wide = part.x.widths(part.size[0])[part.x.index[part.rows]]
    high = part.y.widths(part.size[1])[part.y.index[part.rows]]
    stacked = (wide >= NARROW) & (high >= 2 * NARROW)
    return stacked, ~stacked & (wide >= 2 * NARROW) & (high >= NARROW)


def draw_whirls(
    axes: Any,
    x: Floats,
    y: Floats,
    whirl: NDArray[np.str_],
    shift: tuple[float, float] = (0.0, 0.0),
) -> None:
    """Draw a marker for each case that whirls, some points from its place."""
    from matplotlib.transforms import ScaledTranslation

    moved = ScaledTranslation(shift[0] / 72, shift[1] / 72, axes.figure.dpi_scale_trans)
    for word, look in WHIRLS.items():
        own = whirl == word
        if word != "none" and own.any():
            axes.plot(
                x[own],
                y[own],
                look.marker,
                c="black",
                ms=4.5,
                mfc="white",
                mew=0.8,
                transform=axes.transData + moved,
                gid=f"whirl {word}",
            )


def draw_scattered(axes: Any, part: Part, *, points: bool) -> Any:
    """Draw scattered cases as the cells nearest to them, or as points.

    Parameters
    ----------
    axes, part : where, and what
    points : whether an input differs that the axes do not tell, so that the plane
        between cases means nothing
    """
    limits = _margins(part.x), _margins(part.y)
    axes.set(xlim=limits[0], ylim=limits[1])
    if points or len(part.rows) > MOST_VORONOI:
        return _points(axes, part)
    polygons = voronoi(part, limits)
    drawn = draw_polygons(axes, part, polygons)
    if len(part.x.place) > MOST_MARKED or part.colours.name == "whirl":
        return drawn
    x, y = part.x.place[part.rows], part.y.place[part.rows]
    good = ~np.isin(part.kind, list(HATCHES))
    still = (part.whirl == "none") | ~good
    axes.plot(x[still], y[still], ".", c="black", ms=3)
    draw_whirls(axes, x[good], y[good], part.whirl[good])
    return drawn


def _margins(axis: Axis) -> tuple[float, float]:
    """Return limits a little beyond the cases."""
    at = np.unique(axis.scaled())
    more = 0.02 * np.ptp(at) or 0.5
    if len(at) <= FEW_LEVELS:  # as far as the cells of a grid would reach
        more = 0.5 * np.ptp(at) / max(len(at) - 1, 1) or 0.5
    low, high = at[0] - more, at[-1] + more
    return (np.exp(low), np.exp(high)) if axis.scale == "log" else (low, high)


def voronoi(part: Part, limits: Any) -> list[Floats]:
    """Return the polygon of all that is nearest to each case, within limits.

    Distances are those on the paper, both axes one long. The cases are mirrored on the
    four sides, so that every cell ends there.
    """
    from scipy.spatial import Voronoi

    both = part.x, part.y
    ends = [straight(np.asarray(e), a.scale) for a, e in zip(both, limits, strict=True)]
    low, high = np.transpose(ends)
    plane = np.column_stack([axis.scaled()[part.rows] for axis in both])
    own = (plane - low) / (high - low)
    mirrored = [own]
    for side, wall in ((0, 0.0), (0, 1.0), (1, 0.0), (1, 1.0)):
        other = own.copy()
        other[:, side] = 2 * wall - other[:, side]
        mirrored.append(other)
    found = Voronoi(np.concatenate(mirrored))
    corners = low + np.clip(found.vertices, 0.0, 1.0) * (high - low)
    for side, axis in enumerate(both):
        if axis.scale == "log":
            corners[:, side] = np.exp(corners[:, side])
    regions = (found.regions[found.point_region[i]] for i in range(len(own)))
    return [corners[region] for region in regions]


def draw_polygons(axes: Any, part: Part, polygons: list[Floats]) -> Any:
    """Draw a polygon for each of a part's rows; return the mesh of numbers, if any."""
    from matplotlib.collections import PolyCollection

    kind, drawn = part.kind, None
    marked = len(part.x.place) <= MOST_MARKED
    line: dict[str, Any] = {"edgecolors": "white" if marked else "face",
                            "linewidths": 0.6 if marked else 0.2,
                            "rasterized": not marked}  # fmt: skip
    if part.colours.number is not None and (kind == "").any():
        own = np.flatnonzero(kind == "")
        numbers = part.colours.number[part.rows][own]
        drawn = PolyCollection(
            [polygons[i] for i in own],
            array=numbers,
            norm=part.colours.norm(),
            cmap=part.colours.map(),
            **line,
        )
        drawn.set_gid("numbers")
        axes.add_collection(drawn, autolim=False)
    for word in coded(part.colours.looks, kind)[0]:
        own = np.flatnonzero(kind == word)
        mine = [polygons[i] for i in own]
        cells = PolyCollection(mine, facecolor=fill_of(word, part.colours), **line)
        cells.set_gid(f"cells {word}")
        axes.add_collection(cells, autolim=False)
        if word in hatched(part.colours, [word]):
            _hatch(axes, mine, word)
    return drawn


def _points(axes: Any, part: Part) -> Any:
    """Draw a point for each case, its shape the word's; return that of numbers."""
    x, y, kind = part.x.place[part.rows], part.y.place[part.rows], part.kind
    size = float(np.clip(COVER * np.prod(part.size) / max(len(x), 1), 3.0, 40.0))
    many = {"s": size, "lw": 0.4 if size > 8 else 0.0, "edgecolors": "black",
            "rasterized": len(x) > MOST_MARKED}  # fmt: skip
    drawn = None
    if part.colours.number is not None and (kind == "").any():
        own = kind == ""
        drawn = axes.scatter(
            x[own],
            y[own],
            c=part.colours.number[part.rows][own],
            norm=part.colours.norm(),
            cmap=part.colours.map(),
            **many,
        )
        drawn.set_gid("numbers")
    for word in coded(part.colours.looks, kind)[0]:
        own, look = kind == word, part.colours.looks[word]
        fill = fill_of(word, part.colours)
        dots = axes.scatter(x[own], y[own], c=fill, marker=look.marker, **many)
        dots.set_gid(f"points {word}")
    return drawn
