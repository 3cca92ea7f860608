"""Figures of Sobol' indices and their confidence intervals, for each drawn input.

They are bars, or lines over a swept input if the sweep has many points.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcwhirl.errors import InputError
from hpcwhirl.report import palette
from hpcwhirl.report.canvas import (
    in_defaults,
    legend_below,
    name_of,
    new_figure,
    save,
    value_of,
)
from hpcwhirl.report.map.captions import engine_of
from hpcwhirl.report.map.data import label_of
from hpcwhirl.report.map.probabilities import varied
from hpcwhirl.scene.words import COUNTED
from hpcwhirl.studies.sensitivity import pairs_needed

if TYPE_CHECKING:
    import xarray

ORDERS = {"first": "alone (first order)", "total": "with others (total)"}
LOOKS = {"first": palette.BLUE, "total": palette.PALE}
MOST_BARS = 6  # points of a sweep up to which bars are drawn, else lines
MOST_LINES = 7  # largest number of inputs with lines: those with the largest indices
HIGH = 0.38  # height of a bar, in rows


def title_of(quantity: str) -> str:
    """Return the title of a quantity's panel: its name, or P(regime), a probability."""
    return f"P({quantity})" if quantity in COUNTED else quantity.replace("_", " ")


@in_defaults
def draw_sensitivity(
    data: xarray.Dataset, found: xarray.Dataset, out: Path
) -> list[Path]:
    """Draw Sobol' indices into sensitivity.png and .svg; return their paths.

    Quantities that do not vary, or with too few draws, are left out; if none is left,
    no figure is drawn, and the list is empty.

    Parameters
    ----------
    data : results
    found : result of `studies.sensitivity`
    out : directory of the figures

    Raises
    ------
    InputError
        if the points of the sweep differ in more than one input
    """
    every = found["quantity"].values.tolist()
    told = [name for name in every if _is_told(found.sel(quantity=name))]
    if not told:
        return []
    found, over = found.sel(quantity=told), varied(found)
    if len(over) > 1:
        msg = f"indices are drawn over one swept input, not {' and '.join(over)}: add "
        raise InputError(msg + f"--at {over[-1]}=VALUE")
    if over and found.sizes["point"] > MOST_BARS:
        figure = _lines(data, found, over[0])
    else:
        figure = _bars(data, found, over)
    figure.suptitle(_heading(data, found), fontsize=10, parse_math=False)
    return [save(figure, out / f"sensitivity.{kind}") for kind in ("png", "svg")]


def _is_told(one: xarray.Dataset) -> bool:
    """Return whether a quantity has Sobol' indices, so that a figure can show them.

    It has none if it does not vary, or there were too few draws.

    one : result of `sensitivity` for one quantity
    """
    return bool(np.isfinite(one["total"]).any()) and not pairs_needed(one)


def _heading(data: xarray.Dataset, found: xarray.Dataset) -> str:
    """Return the heading of a figure of Sobol' indices: engine, number of draws."""
    least, most = int(found["draws"].min()), int(found["draws"].max())
    draws = f"{least}" if least == most else f"{least} to {most}"
    dropped = int(found["dropped"].max())
    text = f"{engine_of(data)}: Sobol' indices of {draws} pairs of draws; 95 %"
    return text + (f"; up to {dropped} pairs without a number" if dropped else "")


def _bars(data: xarray.Dataset, found: xarray.Dataset, over: list[str]) -> Any:
    """Draw Sobol' indices as bars: a row of panels for each point, one per quantity.

    found, over : result of `sensitivity`; swept input by which points differ, if any
    """
    names, count = found["quantity"].values.tolist(), found.sizes["input"]
    points = found.sizes["point"]
    size = 2.0 + 2.8 * len(names), 1.2 + points * (0.5 + 0.55 * count)
    figure, grid = new_figure(
        size, points, len(names), sharex=True, sharey=True, squeeze=False
    )
    labels = [name_of(name) for name in found["input"].values.tolist()]
    for point, row in enumerate(grid):
        for axes, name in zip(row, names, strict=True):
            _panel(axes, found.sel(quantity=name).isel(point=point))
            axes.set_title(title_of(name), fontsize=9, parse_math=False)
        row[0].set_yticks(np.arange(count), labels, parse_math=False)
        if over:
            unit = str(data[over[0]].attrs.get("units", ""))
            at = value_of(over[0], found[over[0]].to_numpy()[point].item(), unit)
            row[0].set_ylabel(at, parse_math=False)
    grid[0, 0].invert_yaxis()
    legend_below(figure, grid[0, 0], ncols=2)
    return figure


def _panel(axes: Any, one: xarray.Dataset) -> None:
    """Draw a quantity's Sobol' indices at a point of the sweep, bars for each input.

    one : result of `sensitivity` for this quantity and point
    """
    at = np.arange(one.sizes["input"])
    for place, (order, told) in enumerate(ORDERS.items()):
        value, away = _ends(one, order)
        axes.barh(at + (place - 0.5) * HIGH, value, HIGH, color=LOOKS[order],
                  xerr=away, capsize=2, ecolor=palette.INK, label=told)  # fmt: skip
    _note(axes, one)
    axes.axvline(0.0, c=palette.GREY, lw=0.6)
    axes.set_xlim(min(-0.05, axes.get_xlim()[0]), max(1.05, axes.get_xlim()[1]))


def _ends(one: xarray.Dataset, order: str) -> tuple[Any, Any]:
    """Return Sobol' indices of m inputs, (m,), and the lengths of error bars, (2, m).

    Error bars show the 95 % intervals.

    one, order : result of `sensitivity` for one quantity; "first" or "total"
    """
    value, low, high = (
        one[f"{order}{end}"].to_numpy() for end in ("", "_low", "_high")
    )
    return value, np.maximum(np.stack([value - low, high - value]), 0.0)


def _note(axes: Any, one: xarray.Dataset) -> None:
    """Write into a quantity's panel why it has no Sobol' indices, if it has none.

    one : result of `sensitivity` for the quantity
    """
    if not np.isfinite(one["first"]).any():
        why = "does not vary" if int(one["draws"]) else "no draws left"
        axes.text(0.5, 0.5, why, transform=axes.transAxes, ha="center", va="center",
                  color=palette.GREY)  # fmt: skip


def _lines(data: xarray.Dataset, found: xarray.Dataset, over: str) -> Any:
    names = found["quantity"].values.tolist()
    figure, grid = new_figure(
        (11.0, 1.4 + 2.3 * len(names)), len(names), 2, sharex=True, squeeze=False
    )
    order = np.argsort(found[over].to_numpy())
    label, factor = label_of(data, over)
    x, sorted_ = factor * found[over].to_numpy()[order], found.isel(point=order)
    largest = found["total"].max(["point", "quantity"]).fillna(-1.0).to_numpy()
    shown = np.argsort(-largest, kind="stable")[:MOST_LINES]
    for row, name in zip(grid, names, strict=True):
        for axes, (kind, told) in zip(row, ORDERS.items(), strict=True):
            for place, number in enumerate(shown):
                one = sorted_.sel(quantity=name).isel(input=number)
                ends = one[f"{kind}_low"].to_numpy(), one[f"{kind}_high"].to_numpy()
                look = palette.look_of(place)
                axes.fill_between(x, *ends, color=look["c"], alpha=0.2, lw=0)
                axes.plot(x, one[kind].to_numpy(), ms=4, **look,
                          label=name_of(str(one["input"].item())))  # fmt: skip
            axes.axhline(0.0, c=palette.GREY, lw=0.6)
            axes.set_title(f"{title_of(name)}: {told}", fontsize=9, parse_math=False)
    for axes in grid[-1]:
        axes.set_xlabel(label, parse_math=False)
    legend_below(figure, grid[0, 0])
    return figure
