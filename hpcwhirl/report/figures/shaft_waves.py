"""Waves of nodal diameter 1 over the speed, as bearings see them: growth as colour."""

from __future__ import annotations

from typing import Any

import numpy as np

from hpcwhirl.analysis import rotation
from hpcwhirl.arrays import Floats
from hpcwhirl.case.resolve import Case
from hpcwhirl.report import palette
from hpcwhirl.report.canvas import axis_of

GROWS = palette.ORANGE  # colour of a wave that grows, whatever its rate
PALEST = 0.85  # end of the colour map, beyond which a line fades on white
WIDE, THIN = 4.0, 1.8  # points, width of a line where the wave grows, and where not
LINES = "-", "--"  # of the forward and the backward wave
DAMPED, UNDAMPED = "D", "o"  # markers of critical speeds


def draw_shaft_waves(axes: Any, case: Case, span: Floats) -> None:
    """Draw frequencies of the waves of k = 1 in the static frame, coloured by growth.

    Where a wave meets the line of the speed, an unbalance excites it: critical speeds
    are marked, with damping and without. A wave that grows is wider, too.

    Parameters
    ----------
    axes : axes with a figure, whose x-axis is the speed, rad/s
    case, span : the case, with rotation full and equal sectors; (n,), rad/s, speeds
    """
    found = rotation.shaft_waves_over(case, span)
    rates = np.array(list(found["growth"].values()))
    least = min(float(rates.min()), 0.0) or -1.0
    drawn = [
        _wave(axes, span, np.abs(pair[way]), found["growth"][name][way], (way, least))
        for name, pair in found["static"].items()
        for way in (0, 1)
    ]
    top = float(np.abs(np.array(list(found["static"].values()))).max())
    axes.plot(span, span / (2 * np.pi), c=palette.QUIET, lw=1.0, label="speed, 1 Ω")
    _criticals(axes, case, float(span[-1]))
    for line, way in zip(LINES, ("forward", "backward"), strict=True):
        axes.plot([], [], line, c=palette.INK, label=f"k = 1, {way}")
    axes.plot([], [], c=GROWS, lw=WIDE, label="the wave grows")
    axes.set(xlim=(0.0, span[-1]), ylim=(0.0, 1.1 * top / (2 * np.pi)),
             xlabel=axis_of("speed"),
             ylabel=axis_of("frequency") + " (static frame)")  # fmt: skip
    axes.figure.colorbar(drawn[0], ax=axes, extend="max",
                         label="growth rate, 1/s")  # fmt: skip


def _wave(
    axes: Any, span: Floats, omega: Floats, growth: Floats, look: tuple[int, float]
) -> Any:
    """Draw one wave over the speed as a line whose colour is its growth rate.

    span, omega, growth : (n,), rad/s; rad/s, |omega|, static frame; 1/s
    look : 0 for a forward wave, 1 for a backward one; 1/s, rate of the first colour
    """
    from matplotlib import colormaps
    from matplotlib.collections import LineCollection
    from matplotlib.colors import ListedColormap, Normalize

    way, least = look
    points = np.column_stack([span, omega / (2 * np.pi)])
    middle = (growth[:-1] + growth[1:]) / 2
    part = ListedColormap(colormaps[palette.SEQUENTIAL](np.linspace(0.0, PALEST, 256)))
    shades = part.with_extremes(over=GROWS)
    dashed = "solid" if way == 0 else (0, (1.2, 0.6))
    lines = LineCollection(
        np.stack([points[:-1], points[1:]], axis=1).tolist(), array=middle,
        cmap=shades, norm=Normalize(least, 0.0), linestyles=[dashed],
        linewidths=np.where(middle > 0.0, WIDE, THIN),
    )  # fmt: skip
    axes.add_collection(lines)
    return lines


def _criticals(axes: Any, case: Case, most: float) -> None:
    """Mark critical speeds of an unbalance on the line of the speed.

    most : rad/s, end of the axis of speeds
    """
    damped = [one["speed"] for one in rotation.damped_speeds_of(case, most)]
    undamped = rotation.unbalance_speeds_of(case, most)
    for speeds, marker, told in (
        (undamped, UNDAMPED, "critical speed, undamped"),
        (damped, DAMPED, "critical speed, damped"),
    ):
        seen = np.array([speed for speed in speeds if speed <= most])
        axes.plot(seen, seen / (2 * np.pi), marker, c=palette.INK, mfc="none", ms=8,
                  label=told)  # fmt: skip
