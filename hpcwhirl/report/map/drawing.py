"""Drawing of a panel of a map, in which a colour shows the word of each case.

Cases that form a grid have a cell each. Scattered cases are points, over small cells
that have the colour of the nearest case.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from matplotlib.transforms import ScaledTranslation
from numpy.typing import NDArray

from hpcwhirl.arrays import Floats
from hpcwhirl.report import palette
from hpcwhirl.report.map.axes import Axis, straight
from hpcwhirl.report.map.colours import HATCHES, INK, Colours
from hpcwhirl.report.map.data import Picture
from hpcwhirl.scene.words import BAD, WHIRLS
from hpcwhirl.store.reading.coded import Coded

FEW_LEVELS = 12
COVER = 0.35  # fraction of a panel that points cover, within limits of their size
RASTER = 480, 320  # cells along x and y, each with the nearest of scattered cases
FAINT = 0.45  # opacity of this raster, behind the points
NO_CELL = -1
NARROW = 9.0  # points, width of a letter or a marker
MOST_DRAWN = 2000  # largest number of vector shapes in an SVG; more are rasterized
Ints = NDArray[np.intp]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Part:
    """The n cases of one panel of a map, and how they are drawn.

    Attributes
    ----------
    x, y : axes of the whole map
    rows : (n,), indices of the panel's cases among those of the map
    colours : meaning of the colours, for all cases of the map
    whirl : (n,), word of the whirl of the panel's cases
    size : width and height of the panel, points
    lettered : whether each cell has a letter for its word and a marker for its whirl
    """

    x: Axis
    y: Axis
    rows: Ints
    colours: Colours
    whirl: Coded
    size: tuple[float, float]
    lettered: bool

    @property
    def kind(self) -> Coded:
        """Word that gives each case of the panel its colour, "" where a number does."""
        return self.colours.kind[self.rows]

    @property
    def number(self) -> Floats:
        """Number that gives each case of the panel its colour; NaN: a word does."""
        if self.colours.number is None:
            return np.full(len(self.rows), np.nan)
        return np.where(self.kind.isin([""]), self.colours.number[self.rows], np.nan)


@dataclass(frozen=True)
class Mesh:
    """The rectangular cells of a panel, k rows of m, and the case that each one shows.

    Attributes
    ----------
    x, y : (m + 1,) and (k + 1,), edges of the cells
    case : (k, m), index of a case among those of the panel; `NO_CELL`: no case
    """

    x: Floats
    y: Floats
    case: Ints


def grid_of(part: Part) -> Mesh:
    """Return the cells of a panel of a grid: one for each case, around its position."""
    case = np.full((len(part.y.levels), len(part.x.levels)), NO_CELL)
    case[part.y.index[part.rows], part.x.index[part.rows]] = np.arange(len(part.rows))
    return Mesh(part.x.edges(), part.y.edges(), case)


def raster_of(part: Part) -> Mesh:
    """Return small cells that cover a panel of scattered cases, each with a case.

    A cell shows the nearest case that has a result; distances are measured with both
    axes scaled to length 1.
    """
    from scipy.spatial import cKDTree

    edges, middles, places = [], [], []
    for axis, count in zip((part.x, part.y), RASTER, strict=True):
        low, high = straight(np.asarray(limits_of(axis)), axis.scale)
        at = np.linspace(low, high, count + 1)
        edges.append(np.exp(at) if axis.scale == "log" else at)
        middles.append((np.arange(count) + 0.5) / count)
        places.append((axis.scaled()[part.rows] - low) / (high - low))
    whole = np.flatnonzero(~part.kind.isin(BAD))
    if not len(whole):
        return Mesh(edges[0], edges[1], np.full(RASTER[::-1], NO_CELL))
    pixels = np.stack(np.meshgrid(*middles), axis=-1)
    nearest = cKDTree(np.transpose(places)[whole]).query(pixels)[1]
    return Mesh(edges[0], edges[1], whole[nearest])


def limits_of(axis: Axis) -> tuple[float, float]:
    """Return the ends of an axis of scattered cases, a little beyond the outermost."""
    at = straight(axis.levels, axis.scale)
    more = 0.02 * np.ptp(at) or 0.5
    if len(at) <= FEW_LEVELS:  # as for the cells of a grid
        more = 0.5 * np.ptp(at) / max(len(at) - 1, 1) or 0.5
    low, high = at[0] - more, at[-1] + more
    return (np.exp(low), np.exp(high)) if axis.scale == "log" else (low, high)


def draw_grid(axes: Any, part: Part) -> Any:
    """Draw a panel of a grid: a cell for each case, in its colour.

    Returns Matplotlib's artist for a colour bar, None if words are shown
    """
    line = {"edgecolors": palette.GROUND, "linewidth": 0.8} if part.lettered else {}
    drawn = draw_mesh(axes, part, grid_of(part), "words", **line)
    if part.lettered:
        _letters(axes, part)
    return drawn


def draw_scattered(axes: Any, part: Part, *, free: bool) -> Any:
    """Draw a panel of scattered cases: a point for each, over cells of the nearest one.

    Returns Matplotlib's artist for a colour bar, None if words are shown

    free : whether an input varies that is neither axis nor panel; then there are no
        cells, as the plane between cases has no meaning
    """
    axes.set(xlim=limits_of(part.x), ylim=limits_of(part.y))
    if not free:
        draw_mesh(axes, part, raster_of(part), "nearest", alpha=FAINT)
    return _points(axes, part)


def draw_mesh(axes: Any, part: Part, mesh: Mesh, name: str, **look: Any) -> Any:
    """Colour the cells of a mesh by the cases that they show.

    Parameters
    ----------
    axes : axes of matplotlib
    part : cases of one panel
    mesh : cells, and the case that each one shows
    name : first word of the identifier that the cells have in an SVG file
    look : keyword arguments of matplotlib's `pcolormesh`

    Returns
    -------
    the artist of cells coloured by number, for a colour bar; None without numbers
    """
    colours, drawn = part.colours, None
    look |= {"rasterized": True}
    if colours.number is not None:
        values = np.append(part.number, np.nan)[mesh.case]
        drawn = axes.pcolormesh(mesh.x, mesh.y, np.ma.masked_invalid(values),
                                norm=colours.norm(), cmap=colours.map(),
                                gid="numbers", **look)  # fmt: skip
    words = colours.words(part.kind)
    codes = np.append(_codes(words, part.kind), NO_CELL)[mesh.case]
    if words:
        fills = ListedColormap([colours.fill(word) for word in words])
        axes.pcolormesh(mesh.x, mesh.y, np.ma.masked_equal(codes, NO_CELL), cmap=fills,
                        vmin=-0.5, vmax=len(words) - 0.5,
                        gid=" ".join([name, *words]), **look)  # fmt: skip
    for i, word in enumerate(words):
        if look_of_hatch := colours.hatch(word):
            hatch(axes, runs(mesh, codes == i), look_of_hatch, f"hatch {word}")
    return drawn


def _codes(words: Sequence[str], kind: Coded) -> NDArray[np.int8]:
    """Return each case's word as its index in a list, `NO_CELL` if it is not in it.

    words, kind : the list; word of each case
    """
    place = {word: i for i, word in enumerate(words)}
    return np.array([place.get(word, NO_CELL) for word in kind.known], np.int8)[
        kind.code
    ]


def runs(mesh: Mesh, wanted: Mask) -> list[Floats]:
    """Return rectangles that cover chosen cells of a panel, as corners (4, 2) each.

    Adjacent cells of a row are joined to one rectangle.

    mesh, wanted : the cells; (k, m), whether each one is chosen
    """
    boxes = []
    for row in np.flatnonzero(wanted.any(axis=1)):
        ends = np.flatnonzero(np.diff(np.r_[0, wanted[row].astype(int), 0]))
        low, high = mesh.y[row : row + 2]
        for left, right in mesh.x[ends].reshape(-1, 2):
            boxes.append(
                np.array([[left, low], [right, low], [right, high], [left, high]])
            )
    return boxes


def hatch(
    axes: Any,
    polygons: Sequence[Floats],
    look: tuple[str, str],
    name: str,
    tint: str = "none",
) -> None:
    """Hatch polygons as one patch, which costs little more than a single polygon.

    polygons : corners (c, 2) of each
    look, name : pattern and colour of the hatch; identifier of the SVG element
    tint : colour laid over the polygons
    """
    whole = Path.make_compound_path(*(Path(p, closed=False) for p in polygons))
    axes.add_artist(PathPatch(whole, facecolor=tint, edgecolor=look[1], lw=0.0,
                              hatch=look[0], gid=name, rasterized=True))  # fmt: skip


def cells_of(part: Part, picture: Picture, chosen: Mask) -> list[Floats]:
    """Return rectangles that cover the cells of chosen cases in a panel, to hatch them.

    chosen : for each case of the map, whether it is chosen
    """
    mesh = raster_of(part) if picture.scattered else grid_of(part)
    return runs(mesh, np.append(chosen[part.rows], [False])[mesh.case])


def rooms(part: Part) -> tuple[Mask, Mask]:
    """Return which of a panel's n cells have room for a letter and a marker.

    Returns two arrays (n,): room for the letter above the marker; if not, room for the
    letter beside the marker
    """
    wide = part.x.widths(part.size[0])[part.x.index[part.rows]]
    high = part.y.widths(part.size[1])[part.y.index[part.rows]]
    stacked = (wide >= NARROW) & (high >= 2 * NARROW)
    return stacked, ~stacked & (wide >= 2 * NARROW) & (high >= NARROW)


def _letters(axes: Any, part: Part) -> None:
    """Write the letter of its word into each cell of a panel that has room for it.

    A marker of the whirl is drawn below or beside the letter.
    """
    x, y = part.x.middles(part.rows), part.y.middles(part.rows)
    stacked, beside = rooms(part)
    plain = part.colours.number is None
    for (right, up), chosen in (((0.0, 4.5), stacked), ((-4.5, 0.0), beside)):
        for i in np.flatnonzero(chosen & ~part.kind.isin([""])):
            look = part.colours.looks[part.kind.known[part.kind.code[i]]]
            axes.annotate(look.letter, (x[i], y[i]), (right, up), fontsize=8,
                          color=look.ink if plain else INK, ha="center", va="center",
                          textcoords="offset points")  # fmt: skip
        if part.colours.name == "whirl":  # the letter shows the whirl
            continue
        marked = chosen & ~part.kind.isin(HATCHES)
        shift = ScaledTranslation(-right / 72 * plain, -up / 72 * plain,
                                  axes.figure.dpi_scale_trans)  # fmt: skip
        for word, look in WHIRLS.items():
            own = marked & part.whirl.isin([word])
            if word != "none" and own.any():
                axes.plot(x[own], y[own], look.marker, c=palette.INK, ms=4.5,
                          mfc=palette.GROUND, mew=0.8, transform=axes.transData + shift,
                          gid=f"whirl {word}")  # fmt: skip


def _points(axes: Any, part: Part) -> Any:
    """Draw a point for each case of a panel, in its colour and with its word's marker.

    Returns Matplotlib's artist for a colour bar, None if words are shown
    """
    x, y, kind = part.x.place[part.rows], part.y.place[part.rows], part.kind
    size = float(np.clip(COVER * np.prod(part.size) / max(len(x), 1), 3.0, 40.0))
    look = {"s": size, "lw": 0.4 if size > 8 else 0.0, "edgecolors": palette.INK,
            "rasterized": len(x) > MOST_DRAWN}  # fmt: skip
    colours, own, drawn = part.colours, kind.isin([""]), None
    if own.any():
        drawn = axes.scatter(x[own], y[own], c=part.number[own], norm=colours.norm(),
                             cmap=colours.map(), gid="numbers", **look)  # fmt: skip
    for word in colours.words(kind):
        own, of = kind.isin([word]), colours.looks[word]
        axes.scatter(x[own], y[own], c=of.colour, marker=of.marker,
                     gid=f"points {word}", **look)  # fmt: skip
    return drawn
