"""Figures of contact: over time, around the casing, along the chord; layer's wear."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from hpcwhirl.analysis.blade_motion import Touches, lobes_of, touches
from hpcwhirl.arrays import Floats
from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.operators import rods_of
from hpcwhirl.errors import InputError
from hpcwhirl.report.canvas import axis_of, new_figure, title_of
from hpcwhirl.scene.quantities import TRACES
from hpcwhirl.store.reading.results_file import Results

BINS = 120  # number of cells along time and around the casing
DECADES = 1e-3  # least impulse on the scale of colours, relative to the largest
MICRO = 1e6  # micrometres in a metre
MOST_ROWS = 400  # largest number of times at which the worn depth is drawn


def _shown(
    found: Touches, row: Mapping[str, Any], *, transient: bool
) -> tuple[float, Touches]:
    """Return the contacts that a figure shows, and the time, s, at which it begins.

    They are those in the window, or all; InputError if there is none.

    found, row : contacts of the whole run; results of the case by name
    transient : whether contacts before the window are shown, too
    """
    start = 0.0 if transient else row["end_time"] - row["window"]
    shown = found.time >= start
    if not shown.any():
        where = "" if transient else " in the window; --transient shows earlier times"
        raise InputError(f"no contact{where}")
    return start, Touches._make(part[shown] for part in found)


def draw_contacts(cases: Results, case: int, *, transient: bool = False) -> Any:
    """Return a figure of a case's contacts: which blade, where on the casing, when.

    cases, case : results with traces; number of the case
    transient : also show the time before the window
    """
    traces, row = cases.traces(case), cases.rows[case]
    found = touches(traces["time"], traces["blade_impulse"], row["speed"])
    start, found = _shown(found, row, transient=transient)
    figure, panels = new_figure((11, 6.5), 2, sharex=True)
    top = float(found.impulse.max(initial=1e-12))
    places = {"blade": found.blade, "angle on the casing, °": np.degrees(found.angle)}
    for axes, (label, value) in zip(panels, places.items(), strict=True):
        axes.scatter(found.time, value, s=3, c=found.impulse, lw=0, cmap="viridis_r",
                     norm=LogNorm(DECADES * top, top), rasterized=True)  # fmt: skip
        axes.set(ylabel=label)
    figure.axes[0].yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set(xlabel=axis_of("time"), yticks=np.arange(0, 361, 60), ylim=(-5, 365))
    axes.set_xlim(start, row["end_time"])
    figure.axes[0].set_title(f"Contacts. {title_of(row)}")
    interval = 1e3 * row["sample_interval"]
    label = f"normal impulse in {interval:.3g} ms, {TRACES['impulse'].unit}"
    figure.colorbar(figure.axes[0].collections[0], ax=figure.axes[:2], label=label)
    return figure


def draw_chord(cases: Results, case: int, *, transient: bool = False) -> Any:
    """Return a figure of contact along the chord of tips with several contact points.

    Colours show the normal impulse in three panels: contact point over time, contact
    point over angle on the casing, angle over time.

    cases, case : results with traces; number of the case
    transient : also show the time before the window
    """
    traces, row = cases.traces(case), cases.rows[case]
    impulse = traces["point_impulse"]
    model = resolve(cases.scene(case)).model
    points = model.rotor.points
    if points is None:
        msg = "engine.file has changed, and now has one contact point per tip"
        raise InputError(msg)
    flat = impulse.reshape(len(impulse), -1)
    found = touches(traces["time"], flat, row["speed"], model.angles)
    start, (time, blade, angle, push) = _shown(found, row, transient=transient)
    number, angle = 1 + blade % points.count, np.degrees(angle)
    times = np.linspace(start, row["end_time"], BINS + 1)
    angles = np.linspace(0.0, 360.0, BINS + 1)
    numbers = np.arange(points.count + 1) + 0.5
    figure, panels = new_figure((11, 9), 3)
    places = [
        (time, times, number, numbers),
        (angle, angles, number, numbers),
        (time, times, angle, angles),
    ]
    for axes, place in zip(panels, places, strict=True):
        _map(figure, axes, place, push)
    _label(figure.axes[:3], points.station)
    figure.axes[0].set_title(f"Contact along the chord. {title_of(row)}")
    return figure


def _label(panels: list[Any], station: Floats) -> None:
    """Label the axes of the three panels of `draw_chord`.

    station : (n_c,), m, axial positions of a tip's contact points
    """
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
    """Draw a panel of cells coloured by the sum of the impulses of contacts in each.

    Parameters
    ----------
    place : x of each contact; edges of the cells along x; y of each contact; edges
        along y
    push : (contacts,), N s, impulse of each contact
    """
    x, of_x, y, of_y = place
    total, _, _ = np.histogram2d(x, y, bins=[of_x, of_y], weights=push)
    shown = np.ma.masked_less_equal(total.T, 0.0)
    norm = LogNorm(DECADES * float(total.max()), float(total.max()))
    mesh = axes.pcolormesh(of_x, of_y, shown, cmap="viridis_r", norm=norm)
    label = f"normal impulse, {TRACES['impulse'].unit}"
    figure.colorbar(mesh, ax=axes, label=label)


def draw_wear(cases: Results, case: int) -> Any:
    """Return the figure of the worn depth of the casing's layer around the casing.

    Above at the end of the run, below over time.
    """
    traces, row = cases.traces(case), cases.rows[case]
    depth = MICRO * traces["worn"][:, : rods_of(cases.scene(case))]
    if not np.nan_to_num(depth[-1]).any():
        raise InputError("no rod of the layer was worn")
    edges = np.linspace(0.0, 360.0, depth.shape[1] + 1)
    figure, (final, over) = new_figure((9, 7), 2, sharex=True)
    final.stairs(depth[-1], edges, fill=True, color="0.6")
    final.set_ylabel("worn depth at the end, µm")
    final.set_title(
        f"Wear of the casing, strongest harmonic {lobes_of(depth[-1])}\n{title_of(row)}"
    )
    rows = slice(None, None, -(-len(depth) // MOST_ROWS))
    mesh = over.pcolormesh(
        0.5 * (edges[:-1] + edges[1:]), traces["time"][rows], depth[rows],
        cmap="viridis_r", shading="nearest",
    )  # fmt: skip
    figure.colorbar(mesh, ax=over, label="worn depth, µm")
    over.set(xlabel="angle on the casing, °", ylabel=axis_of("time"))
    over.set_xticks(np.arange(0, 361, 60))
    return figure
