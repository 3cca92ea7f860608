"""The largest value of an input up to which cases are damped, over other inputs.

Over one input, a bar joins the last damped case and the next case, which has another
word; over two inputs, colours show the last damped value. Triangles mark lines of cases
that are all damped, and lines whose first case is not damped.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcwhirl.arrays import Floats
from hpcwhirl.errors import InputError
from hpcwhirl.report import canvas, palette
from hpcwhirl.report.map.captions import engine_of, shared
from hpcwhirl.report.map.data import label_of

if TYPE_CHECKING:
    import xarray

    from hpcwhirl.studies.margins import FirstChange

INK, UNMET = palette.BLUE, palette.GREY
MOST_AXES = 2


@canvas.in_defaults
def draw_limits(
    data: xarray.Dataset,
    found: Sequence[FirstChange],
    over: str,
    point: float | None,
    path: Path,
) -> Path:
    """Draw up to which value of an input cases are damped, over one or two others.

    Parameters
    ----------
    data : results
    found : for each line of cases, up to which value of `over` they are damped
    over : name of the input whose limits are drawn, such as "force"
    point : present value of that input, by which limits are divided; None: not divided
    path : file to write

    Raises
    ------
    InputError
        unless one or two other inputs vary, and their values are numbers
    """
    varied = [n for n in found[0].fixed if len({f.fixed[n] for f in found}) > 1]
    texts = [n for n in varied if data[n].dtype.kind not in "iuf"]
    if texts or not 1 <= len(varied) <= MOST_AXES:
        told = ", ".join(varied) or "none"
        msg = f"--plot needs one or two other swept inputs of numbers, got {told}"
        raise InputError(f"{msg}: choose values of other inputs with --at")
    label, factor = label_of(data, over)
    if point is not None:
        label, factor = f"{canvas.name_of(over)} / the present value", 1.0 / point
    ends = factor * np.array([[f.safe, f.unsafe] for f in found])
    figure, axes = canvas.new_figure((8.0, 4.4))
    if len(varied) == 1:
        _bars(axes, data, varied[0], found, ends)
        axes.set_ylabel(f"limit of {label}", parse_math=False)
        if point is not None:
            axes.axhline(1.0, color=palette.INK, lw=0.8, ls=":")
    else:
        _map(axes, data, varied, found, ends, label)
    names = [n for n in (*canvas.FIXED, "duration") if n not in {*varied, over}]
    text = f"{engine_of(data)}: {', '.join(shared(data, names))}"
    figure.suptitle(text, fontsize=10, parse_math=False)
    return canvas.save(figure, path)


def _bars(
    axes: Any,
    data: xarray.Dataset,
    name: str,
    found: Sequence[FirstChange],
    ends: Floats,
) -> None:
    """Draw the limit of each line of cases over one other input, as a vertical bar.

    name : the other input
    found : the limits, see `draw_limits`
    ends : (lines, 2), last damped value and next value of the limited input, as drawn;
        NaN where a line has none
    """
    label, factor = label_of(data, name)
    x = factor * np.array([f.fixed[name] for f in found], dtype=float)
    low, high = ends.T
    met, open_, none = np.isfinite(ends).all(axis=1), np.isnan(high), np.isnan(low)
    axes.vlines(x[met], low[met], high[met], color=INK, lw=3, gid="bracket")
    again = met & np.array([f.changes > 1 for f in found])
    for gid, told, marker, colour, which, y in (
        ("safe", "last damped", "_", INK, ~none, low),
        ("open", "no change met", "^", UNMET, open_, low),
        ("none", "first case not damped", "v", UNMET, none, high),
        ("again", "changes again above", "x", palette.INK, again, high),
    ):
        if which.any():  # the legend has what occurs
            axes.plot(x[which], y[which], marker, c=colour, label=told, gid=gid)
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel(label, parse_math=False)
    canvas.legend_below(axes.figure, axes)


def _map(
    axes: Any,
    data: xarray.Dataset,
    names: Sequence[str],
    found: Sequence[FirstChange],
    ends: Floats,
    label: str,
) -> None:
    """Draw the limit of each line of cases over two other inputs, in colours.

    The colours show the last damped value of the limited input.

    names, label : the two other inputs; label of the limited one
    found, ends : parameters of `_bars`
    """
    told = [label_of(data, name) for name in names]
    grids = [np.unique([f.fixed[name] for f in found]) for name in names]
    values = np.full((len(grids[1]), len(grids[0])), np.nan)
    marks: dict[str, list[tuple[int, int]]] = {"^": [], "v": []}
    for one, (low, high) in zip(found, ends.tolist(), strict=True):
        i, j = (int(np.searchsorted(g, one.fixed[n]))
                for g, n in zip(grids, names, strict=True))  # fmt: skip
        values[j, i] = 0.0 if np.isnan(low) else low
        if np.isnan(low) or np.isnan(high):
            marks["v" if np.isnan(low) else "^"].append((i, j))
    drawn = axes.imshow(values, origin="lower", aspect="auto", cmap=palette.SEQUENTIAL)
    for mark, places in marks.items():
        if places:
            legend = {"^": "no change met", "v": "first case not damped"}
            axes.plot(*zip(*places, strict=True), mark, c=palette.GROUND,
                      mec=palette.INK, ls="", label=legend[mark],
                      gid=legend[mark])  # fmt: skip
    if any(marks.values()):
        canvas.legend_below(axes.figure, axes)
    for axis, grid, (text, factor) in zip("xy", grids, told, strict=True):
        step = max(1, len(grid) // 10)
        texts = [f"{factor * v:.4g}" for v in grid[::step].tolist()]
        getattr(axes, f"set_{axis}ticks")(range(0, len(grid), step), texts)
        getattr(axes, f"set_{axis}label")(text, parse_math=False)
    axes.figure.colorbar(drawn, label=f"limit of {label}")
