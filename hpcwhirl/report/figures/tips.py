"""Figures of contacts and blades of one case.

They show contacts over time, around the casing and along the chord; wear of the
casing's layer; displacements of the tips; stress at named points of the blades.
"""

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
from hpcwhirl.dynamics.bodies.operators import rods_of
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.points import TipPoints
from hpcwhirl.report import palette
from hpcwhirl.report.canvas import (
    axis_of,
    legend_below,
    new_figure,
    title_of,
)
from hpcwhirl.report.figures.motions import MOST_POINTS, in_window, unit_of
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
        axes.scatter(found.time, value, s=3, c=found.impulse, lw=0,
                     cmap=f"{palette.SEQUENTIAL}_r",
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
    mesh = axes.pcolormesh(of_x, of_y, shown, cmap=f"{palette.SEQUENTIAL}_r", norm=norm)
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
    final.stairs(depth[-1], edges, fill=True, color=palette.EDGE)
    final.set_ylabel("worn depth at the end, µm")
    final.set_title(
        f"Wear of the casing, strongest harmonic {lobes_of(depth[-1])}\n{title_of(row)}"
    )
    rows = slice(None, None, -(-len(depth) // MOST_ROWS))
    mesh = over.pcolormesh(
        0.5 * (edges[:-1] + edges[1:]), traces["time"][rows], depth[rows],
        cmap=f"{palette.SEQUENTIAL}_r", shading="nearest",
    )  # fmt: skip
    figure.colorbar(mesh, ax=over, label="worn depth, µm")
    over.set(xlabel="angle on the casing, °", ylabel=axis_of("time"))
    over.set_xticks(np.arange(0, 361, 60))
    return figure


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
        bars = [_rows_over_time(panels[part], edges, own[:, :, middle], look)]
        panels[part].set_ylabel("blade")
        panels[part].yaxis.set_major_locator(MaxNLocator(integer=True))
        if points:
            axes = panels[2 + part]
            bars.append(_rows_over_time(axes, edges, own[:, blade], look))
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


def _rows_over_time(
    axes: Any, edges: Floats, values: Floats, look: Mapping[str, Any]
) -> Any:
    """Draw displacements in colours over time, a row for each tip or point.

    Returns matplotlib's mesh, for a colour bar

    edges, values : edges of the cells along time, s; (n, r), m, of r tips or points
    look : unit and scale, result of `_scale`
    """
    rows, end = np.arange(values.shape[1] + 1) - 0.5, look["end"]
    shown = look["factor"] * extremes(values).T
    return axes.pcolormesh(
        edges, rows, shown, cmap=palette.DIVERGING, vmin=-end, vmax=end, rasterized=True
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
        bar.ax.axhline(gap, c=palette.INK, ls="--", lw=1.0)
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
    when = time[::step]
    for place, point in enumerate(order.tolist()):
        blade = int(most[:, point].argmax())
        told = f"{own.names[point]}: {most[blade, point]:.4g} MPa, blade {blade}"
        look = palette.spaced(place, len(order), len(when)) | {"lw": 0.7}
        over.plot(when, stress[::step, blade, point], **look, label=told)
        around.plot(most[:, point], **palette.look_of(place) | {"ms": 3, "lw": 0.7})
    kind = "von Mises stress" if own.rows.shape[2] > 1 else "stress"
    over.set(xlabel=axis_of("time"), ylabel=f"{kind}, MPa\n(each on its blade)")
    around.set(xlabel="blade", ylabel=f"largest {kind}, MPa\n(in size, in any sample)")
    around.xaxis.set_major_locator(MaxNLocator(integer=True))
    legend_below(figure, over)
    left = len(own.names) - len(order)
    few = f", the {MOST_LINES} largest of {len(own.names)} points" if left else ""
    figure.suptitle(f"Stress of the vibration{few}. {title_of(row)}")
    return figure
