"""Arrangement of a map on paper: number and size of panels, titles, legend."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.colors import SymLogNorm
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter, NullLocator
from numpy.typing import NDArray

from hpcwhirl.report.canvas import new_figure
from hpcwhirl.report.map import drawing
from hpcwhirl.report.map.axes import Axis
from hpcwhirl.report.map.captions import (
    add_legend,
    growing_key,
    panel_title,
    title_of,
    twin_keys,
)
from hpcwhirl.report.map.colours import GROWING, TINT, UNSURE
from hpcwhirl.report.map.critical import mark_critical
from hpcwhirl.report.map.data import Picture, Wish
from hpcwhirl.report.map.refined import draw_refined, refined_cells
from hpcwhirl.store.reading.shares import SURE

if TYPE_CHECKING:
    import xarray

GROWTH = "free_growth"  # variable of the results
LETTERED = 300  # number of cells up to which letters and markers are drawn
READABLE = 0.5  # share of the cells in which a letter must fit
WIDEST, LOWEST = 9.5, 5.6  # inches, largest width and height of a single panel
PAGE = 13.0  # inches, width of all columns of panels together
A_LEVEL = 1.1  # inches, largest width of a cell
MOST_DECADES = 3.0  # largest number of decades of an axis without exponents
LABEL = 0.2  # inches, height of a label of a colour bar with its margins
BAR = 0.7  # least height of a colour bar, as a share of that of the figure
BESIDE = 0.9, 0.45  # inches, width and height that ticks and labels of a panel take


@dataclass(frozen=True)
class Sheet:
    """The layout of a map on paper.

    Attributes
    ----------
    picture : content of the map
    rows, columns : numbers of rows and columns of panels
    width, height : size of a panel with its labels, inches
    lettered : whether letters and markers are drawn in the cells
    """

    picture: Picture
    rows: int
    columns: int
    width: float
    height: float
    lettered: bool = False

    @property
    def points(self) -> tuple[float, float]:
        """Width and height of a panel without its labels, in points, 1/72 inch."""
        return 72 * (self.width - BESIDE[0]), 72 * (self.height - BESIDE[1])

    @property
    def has_cells(self) -> bool:
        """Whether cells can be hatched: not for points of a plane without meaning."""
        return not (self.picture.scattered and self.picture.free)

    def part(self, number: int) -> drawing.Part:
        """Return the cases of a panel, and how they are drawn; number : from 0."""
        picture = self.picture
        rows = np.flatnonzero(picture.panel == number)
        whirl = picture.whirl[rows]
        return drawing.Part(picture.x, picture.y, rows, picture.colours, whirl,
                            self.points, self.lettered)  # fmt: skip

    def fits(self) -> NDArray[np.bool_]:
        """Return for the cells of all panels whether a letter and a marker fit in."""
        parts = [self.part(number) for number in range(len(self.picture.panels))]
        return np.concatenate([np.logical_or(*drawing.rooms(part)) for part in parts])


def sheet_of(picture: Picture) -> Sheet:
    """Return the layout of a map on paper: rows, columns and size of its panels."""
    rows = _rows(picture)
    columns = -(-len(picture.panels) // rows)
    width = _narrower(picture.x, WIDEST if columns == 1 else max(PAGE / columns, 2.8))
    few = BESIDE[1] + A_LEVEL * len(picture.y.levels)
    height = min(0.62 * width, LOWEST, few) if picture.y.name else 1.9
    if picture.y.names:
        height = BESIDE[1] + 0.55 * len(picture.y.levels)
    plain = Sheet(picture, rows, columns, width, max(height, 1.5))
    lettered = picture.gridded and len(picture) <= LETTERED
    lettered = lettered and bool(plain.fits().mean() >= READABLE)
    return replace(plain, lettered=lettered)


def _narrower(axis: Axis, width: float) -> float:
    """Return the width of a panel, inches: less than `width` if it has few cells.

    axis : x axis of the map
    """
    few = BESIDE[0] + A_LEVEL * (len(axis.levels) + 1)
    return float(min(width, max(few, 3.4)))


def _rows(picture: Picture) -> int:
    """Return the number of rows in which the panels of a map are arranged.

    If panels differ in two inputs, each row has one value of the first input.
    """
    count, names = len(picture.panels), list(picture.panels[0])
    if len(names) == 2:
        sides = [len({panel[n] for panel in picture.panels}) for n in names]
        if sides[0] * sides[1] == count and max(sides) <= 6:
            return sides[0]
    return 1 if count <= 3 else (2 if count <= 8 else int(np.ceil(np.sqrt(count))))


def figure_of(data: xarray.Dataset, picture: Picture, wish: Wish, results: Path) -> Any:
    """Draw a map; return its figure.

    Parameters
    ----------
    data : results
    picture, wish : content and options of the map
    results : path of `results.h5`
    """
    sheet = sheet_of(picture)
    size = sheet.width * sheet.columns, sheet.height * sheet.rows + 1.1
    figure, grid = new_figure(
        size, sheet.rows, sheet.columns, squeeze=False, sharex=True, sharey=True
    )
    panels = grid.ravel()
    _fill(figure, panels, sheet)
    more = [*_mark_unsure(data, panels, sheet), *_mark_growing(data, panels, sheet)]
    _decorate(grid, sheet)
    if wish.critical:
        mark_critical(panels, picture, results)
    add_legend(figure, picture, more, lettered=sheet.lettered)
    figure.suptitle(title_of(data, picture, size[0]), fontsize=10,
                    parse_math=False)  # fmt: skip
    return figure


def _mark_unsure(data: xarray.Dataset, panels: Any, sheet: Sheet) -> list[Any]:
    """Hatch and fade the cells of cases whose word too few of their twins have.

    Returns legend entries for them, [] in a campaign without twins
    """
    picture = sheet.picture
    regimes = picture.colours.name not in {"whirl", "motion", "attractor"}
    if not (
        regimes and sheet.has_cells and "word_share" in data and SURE in data.attrs
    ):
        return []
    unsure = data["word_share"].to_numpy()[picture.case] < float(data.attrs[SURE])
    _hatch(panels, sheet, unsure, UNSURE, "hatch chosen", tint=TINT)
    return twin_keys(data, picture, unsure)


def _mark_growing(data: xarray.Dataset, panels: Any, sheet: Sheet) -> list[Any]:
    """Hatch the cells of cases in which a free motion grows without contact.

    Returns legend entries for them, [] if there are none
    """
    picture = sheet.picture
    if GROWTH not in data or not sheet.has_cells:
        return []
    growing = data[GROWTH].to_numpy()[picture.case] > 0.0
    if not growing.any():
        return []
    _hatch(panels, sheet, growing, GROWING, "hatch growing")
    return [growing_key(int(growing.sum()))]


def _hatch(
    panels: Any,
    sheet: Sheet,
    chosen: NDArray[np.bool_],
    look: tuple[str, str],
    name: str,
    tint: str = "none",
) -> None:
    """Hatch the cells of chosen cases in all panels.

    chosen : (n,), for each case of the map
    look, name, tint : see `drawing.hatch`
    """
    picture = sheet.picture
    for number, axes in enumerate(panels[: len(picture.panels)]):
        part = sheet.part(number)
        if picture.refined is not None:
            cells: Any = refined_cells(part, picture, picture.refined, chosen)
        else:
            cells = drawing.cells_of(part, picture, chosen)
        if len(cells):
            drawing.hatch(axes, cells, look, name, tint=tint)


def _fill(figure: Any, panels: NDArray[Any], sheet: Sheet) -> None:
    """Draw the cases of a map into its panels, with panel titles and a colour bar."""
    picture, drawn = sheet.picture, None
    for axes in panels[len(picture.panels) :]:
        axes.set_visible(False)
    for number, values in enumerate(picture.panels):
        axes, part = panels[number], sheet.part(number)
        if picture.refined is not None:
            found = draw_refined(axes, part, picture, picture.refined)
        elif picture.scattered:
            found = drawing.draw_scattered(axes, part, free=picture.free)
        else:
            found = drawing.draw_grid(axes, part)
        drawn = found or drawn
        axes.set_title(panel_title(values), fontsize=9, parse_math=False)
    if drawn is not None:
        bar = figure.colorbar(drawn, ax=list(panels), pad=0.01, aspect=30)
        if isinstance(bar.norm, SymLogNorm):
            bar.set_ticks(apart(bar, figure.get_figheight()))
        bar.set_label(picture.colours.label, parse_math=False)


def apart(bar: Any, height: float) -> list[float]:
    """Return the ticks of a colour bar whose labels do not overlap, nearest 0 first.

    On a symmetric logarithmic scale the powers of ten near 0 lie close together.

    bar, height : colour bar of matplotlib; height of its figure, inches
    """
    least = LABEL / (BAR * height)  # distance of labels, as a share of the bar
    kept: list[float] = []
    for tick in sorted(bar.get_ticks(), key=abs):
        places = bar.norm([tick, *kept])
        if 0.0 <= places[0] <= 1.0 and all(abs(places[1:] - places[0]) >= least):
            kept.append(float(tick))
    return sorted(kept)


def _decorate(grid: NDArray[Any], sheet: Sheet) -> None:
    """Set scales, limits, ticks and labels of all panels of a map."""
    picture = sheet.picture
    for axes in grid.ravel():
        axes.set(xscale=picture.x.scale, yscale=picture.y.scale)
        _ticks(axes.xaxis, picture.x, sheet.points[0])
        _ticks(axes.yaxis, picture.y, sheet.points[1])
        if picture.gridded:
            axes.set(xlim=picture.x.edges()[[0, -1]], ylim=picture.y.edges()[[0, -1]])
        axes.label_outer()
    for axes in grid[-1]:
        axes.set_xlabel(picture.x.label, parse_math=False)
    for axes in grid[:, 0]:
        axes.set_ylabel(picture.y.label, parse_math=False)
    for above, below in zip(grid[:-1].ravel(), grid[1:].ravel(), strict=True):
        if not below.get_visible() and above.get_visible():
            above.tick_params(labelbottom=True)
            above.set_xlabel(picture.x.label, parse_math=False)


def _plain_decades(own: Any, axis: Axis) -> None:
    """Write numbers without exponents on a logarithmic axis that spans few decades.

    own, axis : the axis as an object of Matplotlib; axis of the map
    """
    decades = np.ptp(np.log10(axis.levels[axis.levels > 0]))
    if decades <= MOST_DECADES:
        subs = (1.0, 2.0, 5.0) if decades > 1.0 else (1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0)
        own.set_major_locator(LogLocator(subs=subs))
        own.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
        own.set_minor_formatter(NullFormatter())


def _ticks(own: Any, axis: Any, points: float) -> None:
    upright = own.axis_name == "y"
    if not axis.name:
        own.set_ticks([])
        return
    places, texts = axis.ticks(points, upright=upright)
    if not len(places):
        if axis.scale == "linear" and axis.whole:
            own.get_major_locator().set_params(integer=True)
        if axis.scale == "log":
            _plain_decades(own, axis)
        else:  # no number at the end of the axis that all others lack
            own.get_major_formatter().set_useOffset(False)
        return
    long = not upright and 6.5 * sum(map(len, texts)) > points
    across = "right" if long or upright else "center"
    turned = 30 if long else 0
    own.set_ticks(places, texts, parse_math=False, rotation=turned, ha=across)
    own.set_minor_locator(NullLocator())
    own.set_minor_formatter(NullFormatter())
