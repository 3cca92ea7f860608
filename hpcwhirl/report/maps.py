"""The regime map: colour and letter the regime, marker the direction of whirl."""

from __future__ import annotations

import uuid
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import InputError, unknown, unwritable
from hpcwhirl.store.reader import open_results, words

if TYPE_CHECKING:
    import xarray

# Okabe and Ito's colours; a letter says the same without colour
REGIMES = {
    "damped": ("#56B4E9", "d"),
    "sustained": ("#F0E442", "S"),
    "divergent": ("#D55E00", "X"),
    "undecided": ("#DDDDDD", "?"),
    "unstable": ("#999999", "U"),
    "failed": ("#FFFFFF", "!"),
}
WHIRLS = {"forward": "^", "backward": "v", "mixed": "o", "none": None}
NOTE = (
    "Casing section, damping, support and pulse are inputs the paper does not give: "
    "this is not the paper's map."
)


def labels(data: xarray.Dataset) -> NDArray[np.str_]:
    """Return a word per case: regime, or `unstable`, or `failed`."""
    regime, outcome = words(data["regime"]), words(data["outcome"])
    named = np.where(outcome == "unstable", "unstable", regime)
    return np.where(words(data["status"]) == "ok", named, "failed")


def _second_axis(data: xarray.Dataset, wanted: str | None) -> str | None:
    swept = str(data.attrs.get("swept", "")).split()
    if wanted is not None and wanted not in swept:
        raise unknown("swept input", wanted, swept)
    others = [n for n in swept if n != "speed" and data[n].dtype.kind in "if"]
    others = [n for n in others if len(np.unique(data[n])) > 1]
    return wanted or (others[0] if others else None)


def draw_map(results: Path, out: Path, second: str | None = None) -> list[Path]:
    """Draw map.png and map.svg of a campaign and return their paths.

    Parameters
    ----------
    results : `results.h5`
    out : directory of the figures
    second : the swept input of the vertical axis; the first but speed if None
    """
    data = open_results(results)
    if not data.sizes.get("case"):
        msg = f"{results} has no cases: nothing to draw"
        raise InputError(msg)
    name = _second_axis(data, second)
    x = data["speed"].to_numpy()
    rows = data[name].to_numpy() if name else np.zeros(len(x))
    figure = _figure(x, rows, labels(data), words(data["whirl"]))
    axes = figure.axes[0]
    _decorate(axes, data, name, rows)
    return _save(figure, out, "map")


def _edges(values: NDArray[np.float64]) -> dict[float, tuple[float, float]]:
    """Return {value: (lower, upper)} of cells that tile the axis."""
    known = np.unique(values)
    if len(known) == 1:
        return {float(known[0]): (float(known[0]) - 0.5, float(known[0]) + 0.5)}
    middle = (known[1:] + known[:-1]) / 2
    low = np.r_[2 * known[0] - middle[0], middle]
    high = np.r_[middle, 2 * known[-1] - middle[-1]]
    return {
        float(v): (float(a), float(b)) for v, a, b in zip(known, low, high, strict=True)
    }


def _figure(
    x: NDArray[np.float64],
    rows: NDArray[np.float64],
    regime: NDArray[np.str_],
    whirl: NDArray[np.str_],
) -> Any:
    from matplotlib.figure import Figure
    from matplotlib.patches import Rectangle

    levels = np.unique(rows)
    figure = Figure(
        figsize=(11, 2.6 + 0.55 * min(len(levels), 20)), layout="constrained"
    )
    axes = figure.subplots()
    columns = _edges(x)
    spots: dict[tuple[float, int], int] = {}
    for i in range(len(x)):
        level = int(np.searchsorted(levels, rows[i]))
        key = (float(x[i]), level)
        if key in spots:  # a third input was swept: the first case of the cell shows
            continue
        spots[key] = i
        left, right = columns[float(x[i])]
        colour, letter = REGIMES[str(regime[i])]
        axes.add_patch(
            Rectangle(
                (left, level - 0.5), right - left, 1, fc=colour, ec="white", lw=0.8
            )
        )
        axes.text(x[i], level + 0.2, letter, ha="center", va="center", fontsize=8)
        marker = WHIRLS[str(whirl[i])]
        if marker:
            axes.plot(x[i], level - 0.2, marker, c="black", ms=4.5, mfc="none")
    axes.set_xlim(
        min(a for a, _ in columns.values()), max(b for _, b in columns.values())
    )
    axes.set_ylim(-0.5, len(levels) - 0.5)
    return figure


def _decorate(
    axes: Any,
    data: xarray.Dataset,
    name: str | None,
    rows: NDArray[np.float64],
) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    axes.set_xlabel("rotational speed Ω, rad/s")
    levels = np.unique(rows)
    shown = levels if name else np.array([])
    axes.set_yticks(range(len(shown)), [_tick(v) for v in shown])
    if name:
        unit = data[name].attrs.get("units", "")
        axes.set_ylabel(f"{name.replace('_', ' ')}{', ' + unit if unit else ''}")
    keys: list[Any] = [
        Patch(fc=colour, ec="grey", label=f"{letter}  {regime}")
        for regime, (colour, letter) in REGIMES.items()
    ]
    keys += [
        Line2D([], [], marker=m, c="black", ls="", mfc="none", label=w)
        for w, m in WHIRLS.items()
        if m
    ]
    axes.figure.legend(handles=keys, loc="outside lower center", ncols=9, fontsize=8,
                       frameon=False)  # fmt: skip
    lobes = ", ".join(str(k) for k in np.unique(data["nodal_diameter"].to_numpy()))
    title = str(data.attrs.get("title", "hpcwhirl campaign"))
    axes.set_title(f"{title}, k = {lobes}\n", fontsize=11)
    axes.text(0.5, 1.02, NOTE, transform=axes.transAxes, ha="center", fontsize=7.5)
    hidden = data.sizes["case"] - len(
        {*zip(data["speed"].to_numpy(), rows, strict=True)}
    )
    if hidden:
        axes.text(1.0, -0.02, f"{hidden} cases of other inputs not shown", fontsize=7,
                  transform=axes.transAxes, ha="right", va="top")  # fmt: skip


def _tick(value: float | bytes) -> str:
    return value.decode() if isinstance(value, bytes) else f"{value:.4g}"


def _save(figure: Any, out: Path, stem: str) -> list[Path]:
    paths = [out / f"{stem}.png", out / f"{stem}.svg"]
    try:
        out.mkdir(parents=True, exist_ok=True)
        for path in paths:  # whole or not at all: two shards may draw at once
            part = path.with_name(f".{uuid.uuid4().hex}{path.suffix}")
            try:
                figure.savefig(part, dpi=140)
                part.replace(path)
            finally:
                part.unlink(missing_ok=True)
    except OSError as failed:
        msg = f"cannot write figures in {out}: {failed.strerror or failed}"
        raise unwritable(msg, failed) from None
    return paths
