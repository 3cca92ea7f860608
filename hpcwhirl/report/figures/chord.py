"""Figure of contact along the chord, of tips with several contact points."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from numpy.typing import NDArray

from hpcwhirl.analysis.contact_map import touches
from hpcwhirl.case.resolve import resolve
from hpcwhirl.errors import InputError
from hpcwhirl.report.labels import axis_of, title_of
from hpcwhirl.scene.quantities import TRACES
from hpcwhirl.store.reading.results_file import Results

Floats = NDArray[np.float64]
BINS = 120  # number of cells along time and around the casing
DECADES = 1e-3  # least impulse on the scale of colours, relative to the largest


def draw_chord(cases: Results, case: int, *, transient: bool = False) -> Any:
    """Return the figure of contact impulses over time, angle on the casing and chord.

    Three panels: point over time, point over angle, angle over time.
    """
    traces, row = cases.traces(case), cases.rows[case]
    impulse = traces["point_impulse"]
    model = resolve(cases.scene(case)).model
    points = model.rotor.points
    if points is None:
        msg = "engine.file has changed: it now has one contact point per tip"
        raise InputError(msg)
    flat = impulse.reshape(len(impulse), -1)
    found = touches(traces["time"], flat, row["speed"], model.angles)
    start = 0.0 if transient else row["end_time"] - row["window"]
    shown = found.time >= start
    if not shown.any():
        where = "" if transient else " in the window; --transient shows earlier ones"
        msg = f"no contact{where}"
        raise InputError(msg)
    time, angle = found.time[shown], np.degrees(found.angle[shown])
    number, push = 1 + found.blade[shown] % points.count, found.impulse[shown]
    times = np.linspace(start, row["end_time"], BINS + 1)
    angles = np.linspace(0.0, 360.0, BINS + 1)
    numbers = np.arange(points.count + 1) + 0.5
    figure = Figure(figsize=(11, 9), layout="constrained")
    places = [
        (time, times, number, numbers),
        (angle, angles, number, numbers),
        (time, times, angle, angles),
    ]
    for axes, place in zip(figure.subplots(3, 1), places, strict=True):
        _map(figure, axes, place, push)
    _label(figure.axes[:3], points.station)
    figure.axes[0].set_title(f"Contact along the chord. {title_of(row)}")
    return figure


def _label(panels: list[Any], station: Floats) -> None:
    """Label the panels: point over time, point over angle, angle over time."""
    along, around, over = panels
    for axes in (along, around):
        axes.set_ylabel("axial place of the point, mm")
        ticks = [f"{1e3 * place:.4g}" for place in station]
        axes.set_yticks(np.arange(1, len(station) + 1), ticks)
    for axes in (along, over):
        axes.set_xlabel(axis_of("time"))
    around.set(xlabel="angle on the casing, °", xticks=np.arange(0, 361, 60))
    over.set(ylabel="angle on the casing, °", yticks=np.arange(0, 361, 60))


def _map(figure: Any, axes: Any, place: tuple[NDArray[Any], ...], push: Floats) -> None:
    """Draw the sum of the contact impulses in each cell of a panel.

    Parameters
    ----------
    place : x of each contact, edges of the cells along x; y, edges along y
    push : (contacts,), N s, impulse of each contact
    """
    x, of_x, y, of_y = place
    total, _, _ = np.histogram2d(x, y, bins=[of_x, of_y], weights=push)
    shown = np.ma.masked_less_equal(total.T, 0.0)
    norm = LogNorm(DECADES * float(total.max()), float(total.max()))
    mesh = axes.pcolormesh(of_x, of_y, shown, cmap="viridis_r", norm=norm)
    label = f"normal impulse, {TRACES['impulse'].unit}"
    figure.colorbar(mesh, ax=axes, label=label)
