"""Figures of one motion: orbits, traces, contributions, section, ledger."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from hpcwhirl.analysis.participation import family_amplitudes
from hpcwhirl.analysis.whirl import section
from hpcwhirl.arrays import Floats
from hpcwhirl.case.resolve import resolve
from hpcwhirl.report import palette
from hpcwhirl.report.canvas import (
    axis_of,
    in_defaults,
    legend_below,
    new_figure,
    save,
    title_of,
)
from hpcwhirl.scene.quantities import TRACES
from hpcwhirl.store.reading.results_file import Results

LIGHT, DARK = palette.SKY, palette.DEEP
MOST_POINTS = 20_000
TURNED = np.radians(15.0)  # turn of the path at a sample above which the path is coarse
DECADES = 6  # decades of the axis of energies
WINDOW = "window of the words"  # not "steady state": also drawn for divergent orbits


def rotating(traces: Mapping[str, Floats], speed: float) -> Floats:
    """Return the centre's motion in the rotating frame, (n, 2), m; inverse of Eq. (12).

    traces : {name of trace: its samples}, with `time` and, in the static frame,
        `centre`
    speed : Omega, rad/s
    """
    z = traces["centre"] @ np.array([1.0, 1j]) * np.exp(-1j * speed * traces["time"])
    return np.column_stack([z.real, z.imag])


def in_window(time: Floats, row: Mapping[str, Any]) -> NDArray[np.bool_]:
    """Return which samples lie in the window that decides a case's words, (n,).

    time, row : (n,), s, times of the samples; results of the case by name
    """
    return np.asarray(time > row["end_time"] - row["window"])


def unit_of(largest: float) -> tuple[float, str]:
    """Return a unit that suits lengths up to `largest`, m, and the factor from m to it.

    Returns (factor, unit), such as (1e3, "mm")
    """
    for factor, unit in ((1e3, "mm"), (1e6, "µm"), (1e9, "nm")):
        if largest * factor >= 0.1:
            return factor, unit
    return 1e12, "pm"


def draw_orbits(cases: Results, case: int, *, transient: bool = False) -> Any:
    """Return a figure of the centre's orbit in the window.

    It shows the static frame and, at a constant speed and gap, the rotating frame.

    Parameters
    ----------
    cases, case : results with traces; number of the case
    transient : also draw the time before the window
    """
    return orbits_of(cases.traces(case), cases.rows[case], transient=transient)


def orbits_of(
    traces: Mapping[str, Floats], row: Mapping[str, Any], *, transient: bool = False
) -> Any:
    """Return a figure of the centre's orbit from traces that are not in a file.

    traces : {name of trace: its samples} of the case, with `time` and `centre`
    row : results of the case by name
    transient : also draw the time before the window
    """
    frames = {"static": (traces["centre"], "$X_o$", "$Y_o$")}
    if "words_over_speed" not in row:  # at a changing speed the angle is not Omega t
        path = rotating(traces, row["speed"])
        frames["rotating"] = (path, "$x_o$", "$y_o$")
    late = in_window(traces["time"], row)
    figure, (panels,) = new_figure((11, 5.4), 1, len(frames), squeeze=False)
    for axes, (name, (path, x, y)) in zip(panels, frames.items(), strict=True):
        draw_orbit(axes, path, late, row["gap"], transient=transient)
        unit = axes.get_label()
        axes.set(xlabel=f"{x}, {unit} ({name} frame)", ylabel=f"{y}, {unit}")
    legend_below(figure, figure.axes[0])
    figure.suptitle(title_of(row))
    return figure


def is_coarse(path: Floats) -> bool:
    """Return whether a path is sampled so coarsely that lines would look like polygons.

    At most of its samples the path then turns by more than `TURNED`; a figure marks its
    samples by dots.

    path : (n, 2), positions
    """
    steps = np.diff(path @ np.array([1.0, 1j]))
    steps = steps[np.abs(steps) > 0.0]
    if len(steps) < 2:
        return False
    return bool(np.median(np.abs(np.angle(steps[1:] / steps[:-1]))) > TURNED)


def draw_orbit(
    axes: Any, path: Floats, late: NDArray[np.bool_], gap: float, *, transient: bool
) -> None:
    """Draw the centre's orbit into a panel, with a unit that suits its size.

    The circle of the gap is left out if it is over 5 times larger than the orbit, and
    then told in the legend.

    Parameters
    ----------
    axes : axes of matplotlib
    path : (n, 2), m, positions of the centre
    late : (n,), whether a sample is in the window
    gap : m
    transient : whether samples before the window are drawn
    """
    shown = path if transient else path[late]
    factor, unit = unit_of(float(np.abs(shown).max(initial=0.0)))
    axes.set_label(unit)
    if transient:
        axes.plot(*(factor * path[~late]).T, c=LIGHT, lw=0.5, label="transient")
    dots = {"marker": ".", "ms": 3} if is_coarse(path[late]) else {}
    told = f"{WINDOW}: dots are samples" if dots else WINDOW
    axes.plot(*(factor * path[late]).T, c=DARK, lw=0.6, label=told, **dots)
    if 0.2 * gap >= np.abs(shown).max(initial=0.0):
        axes.plot(
            [], [], " ", label=f"the gap, {factor * gap:.4g} {unit}, lies outside"
        )
    else:
        turn = np.linspace(0, 2 * np.pi, 200)
        circle = factor * gap * np.array([np.cos(turn), np.sin(turn)])
        (round_it,) = axes.plot(
            *circle, "--", c=palette.INK, lw=0.8, zorder=3, label="gap"
        )
        round_it.set_path_effects(
            [withStroke(linewidth=2.4, foreground=palette.GROUND)]
        )
    axes.set_aspect("equal", "datalim")


def draw_contributions(cases: Results, case: int) -> Any:
    """Return a figure of modal amplitudes |q_k| over time, for each nodal diameter k.

    Panels show the families 1F, 2F and suspension (the paper's Figs. 10, 12, 14).
    """
    traces, row = cases.traces(case), cases.rows[case]
    amplitude = family_amplitudes(
        traces["tips"],
        rotating(traces, row["speed"]),
        row["sample_interval"],
        resolve(cases.scene(case)).model,
    )
    figure, ((whole, log), (second, hub)) = new_figure((11, 7.5), 2, 2, sharex=True)
    for axes, scale in ((whole, "linear"), (log, "log")):
        _curves(axes, traces["time"], amplitude["1F"])
        axes.set(yscale=scale, title=f"1F, {scale} scale")
    _curves(second, traces["time"], amplitude["2F"])
    second.set(title="2F", xlabel=axis_of("time"))
    step = max(1, len(traces["time"]) // MOST_POINTS)
    hub.plot(
        traces["time"][::step],
        amplitude["suspension"][::step, 1],
        c=palette.PURPLE,
        lw=0.7,
    )
    hub.set(title="suspension (k = 1)", xlabel=axis_of("time"))
    top = np.nanmax(amplitude["1F"], initial=0.0)
    log.set_ylim(max(1e-6 * top, 1e-300), 2 * top or 1.0)
    for axes in figure.axes:
        axes.set_ylabel("|$q_k$|, m √kg")
    figure.legend(handles=whole.get_legend_handles_labels()[0][::-1], title="k",
                  loc="outside right center", fontsize=8)  # fmt: skip
    figure.suptitle(f"Modal contributions. {title_of(row)}")
    return figure


def _curves(axes: Any, time: Floats, amplitude: Floats) -> None:
    """Draw modal amplitudes |q_k| of a family over time; thick lines for k = 0 and 1.

    time, amplitude : (n,), s; (n, diameters), m sqrt(kg)
    """
    step = max(1, len(time) // MOST_POINTS)
    colours = colormaps[palette.SEQUENTIAL](np.linspace(0, 0.9, amplitude.shape[1]))
    for k in reversed(range(amplitude.shape[1])):
        colour = {0: palette.ORANGE, 1: palette.BLUE}.get(k, colours[k])
        shown = time[::step], amplitude[::step, k]
        look = palette.spaced(k, amplitude.shape[1], len(shown[0])) | {"c": colour}
        axes.plot(*shown, **look,
                  lw=0.9 if k < 2 else 0.5, label=f"{k}")  # fmt: skip


def draw_section(cases: Results, case: int, *, transient: bool = False) -> Any:
    """Return a figure of the centre's Poincaré section: its position once a revolution.

    cases, case : results with traces; number of the case
    transient : also show the time before the window
    """
    traces, row = cases.traces(case), cases.rows[case]
    late = in_window(traces["time"], row) | transient
    points = section(traces["time"][late], traces["centre"][late], row["speed"])
    factor, unit = unit_of(float(np.abs(points).max(initial=0.0)))
    figure, axes = new_figure((6.8, 6))
    dots = axes.scatter(
        factor * points[:, 0], factor * points[:, 1], c=np.arange(len(points)), s=8
    )
    axes.set_aspect("equal", "datalim")
    axes.set(xlabel=f"$X_o$, {unit}", ylabel=f"$Y_o$, {unit} (static frame)")
    axes.set_title(f"Once a revolution{_motion(row)}\n{title_of(row)}")
    figure.colorbar(dots, label="revolution of the part shown")
    return figure


def _motion(row: Mapping[str, Any]) -> str:
    """Return the word of a case's motion for a title: ": periodic, 3 revolutions".

    It is "" for a case without `output.chaos`; row : results of the case by name
    """
    if row.get("motion", "none") == "none":
        return ""
    number = f", {row['period']} revolutions" * (row["motion"] == "periodic")
    return f": {row['motion']}{number}"


def draw_ledger(cases: Results, case: int) -> Any:
    """Return a figure of a case's energy, energy inputs and losses over time."""
    traces, row = cases.traces(case), cases.rows[case]
    step = max(1, len(traces["time"]) // MOST_POINTS)
    time = traces["time"][::step]
    fed, rubbed = traces["fed"][::step], traces["rubbed"][::step]
    terms = {
        "energy of both bodies": traces["energy"][::step],
        "fed by friction": rubbed,
        "fed by transport over the ring": fed - rubbed,
        "lost in damping and impacts": traces["lost"][::step],
    }
    figure, axes = new_figure((10, 5))
    for place, (name, values) in enumerate(terms.items()):
        look = palette.spaced(place, len(terms), len(time)) | {"lw": 1.0}
        axes.plot(time, np.where(values > 0.0, values, np.nan), **look, label=name)
        if (values < 0.0).any():
            axes.plot(time, np.where(values < 0.0, -values, np.nan),
                      **look | {"ls": "--"}, label=f"{name}, negative")  # fmt: skip
    top = max(float(np.abs(v).max(initial=0.0)) for v in terms.values())
    if top > 0.0:
        axes.set_yscale("log")
        axes.set_ylim(top / 10.0**DECADES, 2.0 * top)
    else:
        axes.text(0.5, 0.5, "no contact, and no motion about the steady one: all are 0",
                  ha="center", va="center", transform=axes.transAxes)  # fmt: skip
        axes.set(yticks=[], xlim=(0.0, row["end_time"]))
    axes.axvline(row["end_time"] - row["window"], c=palette.GREY, ls=":", lw=0.8)
    axes.set(
        xlabel=f"{axis_of('time')} (dotted: window of the words)", title=title_of(row)
    )
    axes.set_ylabel(f"{TRACES['energy'].unit}, cumulative")
    legend_below(figure, axes)
    return figure


@in_defaults
def draw_case(
    folder: Path, traces: Mapping[str, Floats], row: Mapping[str, Any]
) -> list[Path]:
    """Draw orbit.png and traces.png of one run, for `hpcwhirl run --plot`.

    Returns their paths

    Parameters
    ----------
    folder : directory of the figures
    traces : `time` (n,), s; `centre` (n, 2), m, static frame; `energy`, `fed`,
        `lost` (n,), J; perhaps `tips` (n, N, 2), m
    row : results of the case by name
    """
    (orbit, axes), late = new_figure((6, 6)), in_window(traces["time"], row)
    draw_orbit(axes, traces["centre"], late, row["gap"], transient=True)
    unit = axes.get_label()
    axes.set(xlabel=f"$X_o$, {unit} (static frame)", ylabel=f"$Y_o$, {unit}")
    axes.set_title(title_of(row), fontsize=9)
    legend_below(orbit, axes)
    figures = {"orbit": orbit, "traces": draw_traces(traces, row)}
    return [save(figure, folder / f"{name}.png") for name, figure in figures.items()]


def draw_traces(traces: Mapping[str, Floats], row: Mapping[str, Any]) -> Any:
    """Return a figure of a run over time: centre, energies, largest tip motion.

    traces, row : parameters of `draw_case`; without `tips` the last panel is left out
    """
    tips = traces.get("tips")
    panels = 3 if tips is not None else 2
    figure, axes = new_figure((9, 2.6 * panels), panels, sharex=True)
    step = max(1, len(traces["time"]) // MOST_POINTS)
    time = traces["time"][::step]
    for place, name in enumerate(("$X_o$", "$Y_o$")):
        look = palette.spaced(place, 2, len(time)) | {"lw": 0.5}
        axes[0].plot(time, 1e3 * traces["centre"][::step, place], **look, label=name)
    axes[0].set(ylabel="centre, mm (static)", title=title_of(row))
    for place, name in enumerate(("energy", "fed", "lost")):
        look = palette.spaced(place, 3, len(time)) | {"lw": 0.8}
        axes[1].plot(time, np.abs(traces[name][::step]), **look, label=name)
    moved = any(np.any(traces[name]) for name in ("energy", "fed", "lost"))
    axes[1].set(
        ylabel=f"{TRACES['energy'].unit} (absolute value)",
        yscale="log" if moved else "linear",
    )
    if tips is not None:
        for place, name in enumerate(("radial", "tangential")):
            peak = np.abs(1e3 * tips[::step, :, place]).max(axis=1)
            look = palette.spaced(place, 2, len(time)) | {"lw": 0.5}
            axes[2].plot(time, peak, **look, label=f"largest {name}")
        axes[2].set(ylabel="tips, mm (rotating)")
    for panel in axes:
        panel.axvline(row["end_time"] - row["window"], c=palette.GREY, ls=":", lw=0.8)
        panel.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=8,
                     frameon=False)  # fmt: skip
    axes[-1].set_xlabel(axis_of("time"))
    return figure
