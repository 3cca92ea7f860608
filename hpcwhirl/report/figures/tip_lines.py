"""Figures of single blades: displacements of their tips, stress at named points."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.ticker import MaxNLocator

from hpcwhirl.arrays import Floats
from hpcwhirl.case.resolve import resolve
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.points import TipPoints
from hpcwhirl.report.canvas import (
    DIVERGING,
    axis_of,
    legend_below,
    new_figure,
    title_of,
)
from hpcwhirl.report.figures.motions import MOST_POINTS, in_window, unit_of
from hpcwhirl.store.reading.results_file import Results

MOST_COLUMNS = 600  # largest number of cells of a map along time
DIRECTIONS = "radial", "tangential"
MEGA = 1e-6  # MPa in a Pa
MOST_LINES = 10  # largest number of points drawn: those with the largest stress


def draw_tips(cases: Results, case: int, *, transient: bool = False) -> Any:
    """Return a figure of the displacements of all tips in colours over time and blade.

    They are radial and tangential, in the rotating frame. With several contact points
    per tip, two more panels show the chord of the blade that moves most. A cell shows
    its sample of largest magnitude.

    cases, case : results with traces; number of the case
    transient : also show the time before the window
    """
    traces, row = cases.traces(case), cases.rows[case]
    shown = in_window(traces["time"], row) | transient
    points = resolve(cases.scene(case)).model.rotor.points
    moved = traces["point_tips"][shown] if points else traces["tips"][shown, :, None]
    if not np.abs(moved).max(initial=0.0) > 0.0:
        where = "" if transient else " in the window; --transient shows earlier times"
        raise InputError(f"no displacement of a tip{where}")
    least = np.abs(moved).max(axis=0).max(axis=(1, 2))
    blade, middle = int(least.argmax()), points.reference if points else 0
    edges = edges_of(traces["time"][shown], row["sample_interval"])
    figure, panels = new_figure(
        (11, 10 if points else 6.5), 4 if points else 2, sharex=True
    )
    for part, name in enumerate(DIRECTIONS):
        own = moved[..., part]
        look = _scale(own)
        bars = [_map(panels[part], edges, own[:, :, middle], look)]
        panels[part].set_ylabel("blade")
        if points:
            axes = panels[2 + part]
            bars.append(_map(axes, edges, own[:, blade], look))
            _label_chord(axes, points, blade)
        for axes, mesh in zip(panels[part::2], bars, strict=True):
            bar = figure.colorbar(mesh, ax=axes, label=f"{name}, {look['unit']}")
            if name == DIRECTIONS[0]:
                _mark_gap(bar, row, look)
    panels[-1].set_xlabel(axis_of("time"))
    _count_revolutions(panels[0], row)
    figure.suptitle(f"Displacements of tips, rotating frame. {title_of(row)}")
    return figure


def edges_of(time: Floats, interval: float) -> Floats:
    """Return the edges of the cells into which a figure joins samples, (c + 1,), s.

    There are c <= `MOST_COLUMNS` cells along time, each of as many samples.

    time, interval : (n,), s, times of samples; s, between two samples, each of which is
        at the end of its interval
    """
    every = -(-len(time) // MOST_COLUMNS)
    return np.append(time[::every], time[-1] + interval) - interval


def extremes(values: Floats) -> Floats:
    """Return the sample of largest magnitude in each of c cells along time, (c, r).

    The cells are those of `edges_of`.

    values : (n, r), samples of r quantities, such as r tips
    """
    every = -(-len(values) // MOST_COLUMNS)
    cells = [values[first : first + every] for first in range(0, len(values), every)]
    found = [np.take_along_axis(own, np.abs(own).argmax(0)[None], 0) for own in cells]
    return np.concatenate(found)


def _scale(values: Floats) -> dict[str, Any]:
    """Return the unit and the scale of colours in which a figure shows lengths.

    Returns {"unit": such as "mm", "factor": from m to it, "end": largest |value| in it}

    values : lengths, m, any shape
    """
    most = float(np.abs(values).max())
    factor, unit = unit_of(most)
    return {"factor": factor, "unit": unit, "end": factor * most or 1.0}


def _map(axes: Any, edges: Floats, values: Floats, look: Mapping[str, Any]) -> Any:
    """Draw displacements in colours over time, a row for each tip or point.

    Returns matplotlib's mesh, for a colour bar

    edges, values : edges of the cells along time, s; (n, r), m, of r tips or points
    look : unit and scale, result of `_scale`
    """
    rows, end = np.arange(values.shape[1] + 1) - 0.5, look["end"]
    shown = look["factor"] * extremes(values).T
    return axes.pcolormesh(
        edges, rows, shown, cmap=DIVERGING, vmin=-end, vmax=end, rasterized=True
    )


def _label_chord(axes: Any, points: TipPoints, blade: int) -> None:
    """Label the rows of a panel by the axial positions of a blade's contact points."""
    ticks = [f"{1e3 * place:.4g}" for place in points.station]
    axes.set_yticks(np.arange(points.count), ticks)
    axes.set_ylabel(f"blade {blade}:\naxial place, mm")


def _mark_gap(bar: Any, row: Mapping[str, Any], look: Mapping[str, Any]) -> None:
    """Mark the gap on the colour bar of radial displacements, if within its range.

    row, look : results of the case by name; unit and scale, result of `_scale`
    """
    gap = look["factor"] * row["gap"]
    if 0.0 < gap <= look["end"]:
        bar.ax.axhline(gap, c="k", ls="--", lw=1.0)
        bar.set_label(f"{bar.ax.get_ylabel()} (dashed: gap)")


def _count_revolutions(axes: Any, row: Mapping[str, Any]) -> None:
    """Add an axis of revolutions above a panel over time.

    None is added if the speed is 0 or changes; row : results of the case by name
    """
    if row["speed"] == 0.0 or "words_over_speed" in row:
        return
    turn = 2 * np.pi / abs(row["speed"])
    above = axes.secondary_xaxis("top", functions=(lambda t: t / turn,
                                                   lambda n: n * turn))  # fmt: skip
    above.set_xlabel("revolutions")


def draw_stress(cases: Results, case: int, *, transient: bool = False) -> Any:
    """Return a figure of the stress at named points: over time, and largest by blade.

    Over time, each point is shown on that blade on which its |stress| is largest.
    """
    traces, row = cases.traces(case), cases.rows[case]
    own = resolve(cases.scene(case)).model.rotor.stress
    if own is None or len(own.names) != traces["stress"].shape[2]:
        raise InputError("engine.file has changed, and now has other named points")
    shown = in_window(traces["time"], row) | transient
    time, stress = traces["time"][shown], MEGA * traces["stress"][shown]
    most = np.abs(stress).max(axis=0)  # (N, P)
    order = np.argsort(-most.max(axis=0), kind="stable")[:MOST_LINES]
    step = max(1, len(time) // MOST_POINTS)
    figure, (over, around) = new_figure((11, 7.5), 2)
    for point in order.tolist():
        blade = int(most[:, point].argmax())
        told = f"{own.names[point]}: {most[blade, point]:.4g} MPa, blade {blade}"
        over.plot(time[::step], stress[::step, blade, point], lw=0.7, label=told)
        around.plot(most[:, point], ".-", lw=0.7)
    kind = "von Mises stress" if own.rows.shape[2] > 1 else "stress"
    over.set(xlabel=axis_of("time"), ylabel=f"{kind}, MPa\n(each on its blade)")
    around.set(xlabel="blade", ylabel=f"largest {kind}, MPa\n(in size, in any sample)")
    around.xaxis.set_major_locator(MaxNLocator(integer=True))
    legend_below(figure, over)
    left = len(own.names) - len(order)
    few = f", the {MOST_LINES} largest of {len(own.names)} points" if left else ""
    figure.suptitle(f"Stress of the vibration{few}. {title_of(row)}")
    return figure
