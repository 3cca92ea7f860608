"""A map as a plotly figure that shows the numbers of the case under the pointer."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import InputError
from hpcwhirl.report import palette
from hpcwhirl.report.canvas import value_of
from hpcwhirl.report.map.captions import panel_title, title_of
from hpcwhirl.report.map.data import Picture, Wish
from hpcwhirl.report.map.drawing import Part
from hpcwhirl.report.map.layout import Sheet, sheet_of
from hpcwhirl.report.map.maps import picture_in
from hpcwhirl.report.map.probabilities import wants_shares
from hpcwhirl.report.map.refined import boxes_of
from hpcwhirl.scene.units import showing
from hpcwhirl.store.hdf5 import reading
from hpcwhirl.store.reading.reader import open_results

if TYPE_CHECKING:
    import xarray

# numbers shown for the case under the pointer
TOLD = ("growth_rate", "orbit_radius", "line_frequency", "word_share")
WIDTH, HEIGHT, ABOVE = 800, 460, 110  # pixels: size of a panel; height of the heading
LETTERS = 7.0  # inches, width of a panel's column by which the title is broken
POINT = 9  # pixels, size of a point


def hover_map(results: Path, wish: Wish) -> Any:
    """Return the map of a campaign as a plotly figure.

    Parameters
    ----------
    results : path of `results.h5`
    wish : options of the map; `critical` has no effect

    Raises
    ------
    InputError
        if plotly is not installed, or the map would show shares of regimes
    """
    try:
        from plotly.subplots import make_subplots
    except ImportError:
        msg = "hover needs the package plotly: pip install 'hpcwhirl[plotly]'"
        raise InputError(msg) from None
    with open_results(results) as data, showing(wish.shown), reading(results):
        if wants_shares(data, wish):
            msg = "hover cannot show shares of regimes: choose drawn inputs as x and y"
            raise InputError(msg)
        picture = picture_in(data, results, wish)
        told = _told(data, picture)
        sheet = sheet_of(picture)
        figure = make_subplots(
            sheet.rows, sheet.columns, shared_xaxes=True, shared_yaxes=True,
            subplot_titles=[panel_title(values) for values in picture.panels],
        )  # fmt: skip
        title = title_of(data, picture, LETTERS * sheet.columns)
    for number in range(len(picture.panels)):
        place = dict(zip(("row", "col"), divmod(number, sheet.columns), strict=True))
        place = {name: 1 + at for name, at in place.items()}
        for trace in _traces(sheet, number, told):
            figure.add_trace(trace, **place)
    for axis, way in ((picture.x, "xaxes"), (picture.y, "yaxes")):
        ticks = {"tickvals": axis.levels, "ticktext": axis.names} if axis.names else {}
        getattr(figure, f"update_{way}")(title_text=axis.label, type=axis.scale,
                                         showgrid=False, **ticks)  # fmt: skip
    figure.update_layout(
        title={"text": title.replace("\n", "<br>"), "font": {"size": 13}},
        width=WIDTH * sheet.columns, height=HEIGHT * sheet.rows + ABOVE,
        template="plotly_white", hovermode="closest", hoverdistance=-1,
    )  # fmt: skip
    return figure


def _told(data: xarray.Dataset, picture: Picture) -> NDArray[np.str_]:
    """Return for each case of a map the text shown when the pointer is at it, (n,)."""
    names = [*picture.inputs, *(name for name in TOLD if name in data)]
    words = list(zip(picture.word, picture.whirl, strict=True))
    columns = {name: data[name].to_numpy()[picture.case] for name in names}
    units = {name: str(data[name].attrs.get("units", "")) for name in names}
    return np.array([
        "<br>".join([
            f"<b>case {case}: {words[i][0]}, {words[i][1]}</b>",
            *(value_of(n, _short(own[i]), units[n]) for n, own in columns.items()),
        ])
        for i, case in enumerate(picture.case.tolist())
    ])  # fmt: skip


def _short(value: Any) -> Any:
    plain = value.item() if isinstance(value, np.generic) else value
    return float(f"{plain:.6g}") if isinstance(plain, float) else plain


def _traces(sheet: Sheet, number: int, told: NDArray[np.str_]) -> list[Any]:
    """Return the objects, traces, that plotly draws in a panel of a map.

    They are the filled cells of each word, and a point for each case.

    sheet, number : layout of the map; number of the panel
    told : (n,), text shown at each case of the map
    """
    from plotly.graph_objects import Scatter

    picture, part = sheet.picture, sheet.part(number)
    colours, first = picture.colours, number == 0
    looks: dict[str, Any] = {"size": POINT, "opacity": float(picture.scattered),
                             "line": {"width": 0.5, "color": palette.INK}}  # fmt: skip
    if colours.number is not None:
        looks = {"color": part.number, "colorscale": "Cividis", "symbol": "square",
                 "size": POINT, "showscale": first,
                 "colorbar": {"title": colours.label}}  # fmt: skip
    elif picture.scattered:
        looks["color"] = [colours.fill(word) for word in part.kind]
    points = Scatter(
        x=picture.x.place[part.rows], y=picture.y.place[part.rows], mode="markers",
        marker=looks, showlegend=False, customdata=picture.case[part.rows],
        text=told[part.rows], hovertemplate="%{text}<extra></extra>",
    )  # fmt: skip
    rows, boxes = _cells(part, picture)
    filled = []
    for word in colours.words(part.kind):
        own = boxes[colours.kind[rows].isin([word])]
        x, y = (_outlines(own[:, ends]) for ends in ([0, 0, 1, 1, 0], [2, 3, 3, 2, 2]))
        nothing = [None] if not len(own) else None  # keeps its entry in the legend
        filled.append(Scatter(
            x=nothing or x, y=nothing or y, hoverinfo="skip", legendgroup=word,
            name=colours.looks[word].told, showlegend=first, fill="toself",
            fillcolor=colours.fill(word), mode="lines",
            line={"width": 0 if len(own) else 8, "color": colours.fill(word)},
        ))  # fmt: skip
    return [*filled, points]


def _outlines(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the outlines of k boxes as one broken line for plotly: its x or its y.

    The result, (6 k,), has NaN between boxes.

    corners : (k, 5), x or y of the corners, the first one repeated at the end
    """
    return np.column_stack([corners, np.full(len(corners), np.nan)]).ravel()


def _cells(part: Part, picture: Picture) -> tuple[NDArray[Any], NDArray[np.float64]]:
    """Return the k cells of a panel, none if cases are scattered.

    Returns (k,), index of the case that each cell shows; and (k, 4), the cells' left,
    right, bottom and top
    """
    if picture.refined is not None:
        return boxes_of(part, picture, picture.refined)[:2]
    if picture.scattered:
        return part.rows[:0], np.zeros((0, 4))
    ends = []
    for axis in (picture.x, picture.y):
        edges, level = axis.edges(), axis.index[part.rows]
        ends += [edges[level], edges[level + 1]]
    return part.rows, np.column_stack(ends)
