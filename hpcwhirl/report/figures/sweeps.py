"""Figures over the speed: frequency, cascade, bifurcation, growth, waterfall."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.patches import Patch

from hpcwhirl.analysis import whirl
from hpcwhirl.analysis.over_speed import crossings, spells_of
from hpcwhirl.analysis.stability import SLOW, growth_of_diameter
from hpcwhirl.arrays import Floats
from hpcwhirl.case.resolve import Case, resolve
from hpcwhirl.case.speed import law_of, speed_at
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.families import rotor_by_diameter
from hpcwhirl.report import palette
from hpcwhirl.report.canvas import axis_of, legend_below, new_figure, title_of
from hpcwhirl.report.figures.frequencies import (
    COLOURS,
    POINTS,
    bands_in_hz,
    centre_top,
    engine_orders,
    heading,
    regime_legend,
    rotating_top,
    shown_word,
)
from hpcwhirl.report.figures.motions import in_window, rotating
from hpcwhirl.report.map.axes import cell_edges
from hpcwhirl.scene.quantities import ROW
from hpcwhirl.scene.words import SHOWN
from hpcwhirl.store.reading.results_file import Results

STEADY_AFTER = 5.0  # revolutions left out of spectra, as in the paper's Figs. 6 and 7
FEW_TURNS = 50  # revolutions, up to which dots are larger
PLAIN = 10.0  # largest |work / losses|, or |X_o| / gap, up to which an axis is linear
DECADES = 4.0  # decades of amplitude shown below the largest one
AT_REST = 1e-9  # mm, amplitude up to which a structure counts as at rest
STRIP = 0.05  # height of the strip of words, over that of the axes
NARROW = 0.02  # least width of an interval with a letter, over that of the axes


def _mesh(
    axes: Any, speeds: Floats, edges: Floats, amplitude: Floats, least: float = 0.0
) -> Any:
    """Draw amplitudes of spectra in colours over speed and frequency.

    If no amplitude exceeds `least`, mm, a text says that the structure is at rest.

    speeds, edges : rad/s; (m + 1,), edges of the m cells along the frequency
    amplitude : (m, speeds), mm
    """
    largest = float(np.nanmax(amplitude, initial=0.0))
    if largest <= least:
        axes.text(0.5, 0.5, f"at rest (≤ {largest:.1g} mm)", color=palette.GROUND,
                  ha="center", transform=axes.transAxes)  # fmt: skip
        largest = 1.0
    norm = LogNorm(largest * 10.0**-DECADES, largest)
    shown = np.maximum(amplitude, largest * 10.0**-DECADES)
    return axes.pcolormesh(
        cell_edges(speeds),
        edges,
        shown,
        norm=norm,
        cmap=palette.SEQUENTIAL,
        rasterized=True,
    )


def frequency_spectra(
    cases: Results, line: list[int]
) -> dict[str, list[tuple[Floats, Floats]]]:
    """Return spectra of a tip and of the centre for each case of a line.

    Returns {"tip": [(Hz, m) of each case], "centre": ...}: frequencies and amplitudes
    of the tangential displacement of blade 0's tip and of x_o, both after revolution 5
    and in the rotating frame

    Parameters
    ----------
    cases : results with the trace `tips`
    line : numbers of the cases, ascending in speed
    """
    out: dict[str, list[tuple[Floats, Floats]]] = {"tip": [], "centre": []}
    for case in line:
        traces, row = cases.traces(case), cases.rows[case]
        part = whirl.after_revolutions(traces["time"], row["speed"], STEADY_AFTER)
        if len(traces["time"][part]) < 16:  # the run ended too early: take all samples
            part = slice(0, None)
        signals = {
            "tip": traces["tips"][part, 0, 1],
            "centre": rotating(traces, row["speed"])[part, 0],
        }
        for name, signal in signals.items():
            out[name].append(whirl.amplitude_spectrum(signal, row["sample_interval"]))
    return out


def draw_frequency(cases: Results, line: list[int], title: str = "") -> Any:
    """Return a figure of spectra of a tip and of the centre over the speed.

    Colours show the amplitude over speed and frequency (the paper's Figs. 6 and 7).

    cases, line : results; numbers of cases that differ only in speed
    """
    speeds = np.array([cases.rows[i]["speed"] for i in line])
    spectra = frequency_spectra(cases, line)
    figure, panels = new_figure((11, 4.6), 1, 2)
    names = {"tip": "(a) tip of blade 0, tangential", "centre": "(b) centre, $x_o$"}
    top = rotating_top(cases, line)
    edges = np.linspace(0.0, top, 301)
    for axes, (place, label) in zip(panels, names.items(), strict=True):
        amplitude = 1e3 * whirl.cascade(spectra[place], edges)
        mesh = _mesh(axes, speeds, edges, amplitude, AT_REST)
        axes.set(
            xlabel=axis_of("speed"),
            ylabel=axis_of("frequency") + " (rotating frame)",
            title=label,
        )
        if (amplitude > AT_REST).any():
            figure.colorbar(mesh, ax=axes, label="amplitude, mm (peak of the sine)")
        if place == "tip" and speeds.min() > 0.0:
            _interactions(axes, resolve(cases.scene(line[0])), cell_edges(speeds), top)
    figure.suptitle(
        title or f"After revolution {STEADY_AFTER:g}. {heading(cases, line)}"
    )
    return figure


def _interactions(axes: Any, case: Case, edges: Floats, top: float) -> None:
    """Draw engine orders and natural frequencies omega(Omega) over a tip's spectra.

    Dashed lines bound the natural frequencies of each family over nodal diameters. With
    full rotation, waves of unequal sectors have no nodal diameter, so no such lines.

    edges, top : rad/s, edges of the cells along the speed; Hz, end of the axis
    """
    span = np.linspace(edges[0], edges[-1], POINTS)
    engine_orders(axes, span, top, (palette.GROUND, palette.GROUND))
    spin = rotor_by_diameter(case.model).spin
    bands = {} if spin is not None and not spin.waves else bands_in_hz(case, span)
    for name, band in bands.items():
        axes.plot(span, band.T, "--", lw=0.9, c=COLOURS[name],
                  label=[f"{name}, ω(Ω)", None])  # fmt: skip
    axes.set(xlim=edges[[0, -1]], ylim=(0.0, top))
    if bands:
        axes.legend(fontsize=7, loc="upper left")


def draw_cascade(cases: Results, line: list[int], *, transient: bool = False) -> Any:
    """Return a cascade: the centre's full spectra in the window over the speed.

    Colours show the amplitude; static frame, backward < 0 < forward.

    cases, line : results; numbers of cases that differ only in speed
    transient : also use the time before the window
    """
    top = centre_top(cases, line)
    edges = np.linspace(-top, top, 401)
    speeds = np.array([cases.rows[i]["speed"] for i in line])
    spectra = []
    for case in line:
        traces, row = cases.traces(case), cases.rows[case]
        z = traces["centre"] @ np.array([1.0, 1j])
        part = in_window(traces["time"], row) | transient
        omega, amplitude = whirl.full_spectrum(z[part], row["sample_interval"])
        turned = -1 if row["speed"] < 0 else 1
        spectra.append((turned * omega[::turned], amplitude[::turned]))
    figure, axes = new_figure((8.5, 6))
    mesh = _mesh(axes, speeds, edges, 1e3 * whirl.cascade(spectra, edges))
    axes.plot(speeds, np.abs(speeds), "--", c=palette.GROUND, lw=0.8)
    axes.axhline(0.0, c=palette.GROUND, lw=0.6)
    axes.set(
        xlabel=axis_of("speed"),
        ylabel="ω, rad/s, static frame:\nbackward < 0 < forward",
        title=f"Full spectrum of the centre, {heading(cases, line)}\n(dashed: ω = Ω)",
        ylim=(-top, top),
    )
    figure.colorbar(mesh, ax=axes, label="radius of the line's circle, mm")
    return figure


def draw_bifurcation(
    cases: Results, line: list[int], *, transient: bool = False
) -> Any:
    """Return a bifurcation diagram: the centre's position once a revolution over speed.

    Panels show X_o and |Z|, static frame, in the window.

    cases, line : results; numbers of cases that differ only in speed
    transient : also show the time before the window
    """
    figure, (upper, lower) = new_figure((10, 6), 2, sharex=True)
    for case in line:
        traces, row = cases.traces(case), cases.rows[case]
        part = in_window(traces["time"], row) | transient
        points = whirl.section(
            traces["time"][part], traces["centre"][part], row["speed"]
        )
        at = np.full(len(points), row["speed"])
        shown, few = SHOWN[shown_word(row)], len(points) <= FEW_TURNS
        look = {"c": shown.stroke, "marker": shown.marker, "ls": "", "mew": 0,
                "ms": 4 if few else 2.5}  # fmt: skip
        upper.plot(at, 1e3 * points[:, 0], **look)
        lower.plot(at, 1e3 * np.hypot(*points.T), **look)
    gap = 1e3 * cases.rows[line[0]]["gap_scale"]  # also if the gap is 0
    label = "$X_o$, mm, static frame"
    if max(map(abs, upper.dataLim.intervaly), default=0.0) > PLAIN * gap:
        linear = 10.0 ** np.ceil(np.log10(gap))  # a power of ten: ticks fit
        upper.set_yscale("symlog", linthresh=linear)
        label += f"\n(linear within {linear:g} mm)"
    upper.set_ylabel(label)
    lower.axhline(gap, c=palette.INK, ls="--", lw=0.8)
    lower.set(yscale="log", xlabel=axis_of("speed"), ylabel="|Z|, mm (dashed: gap)")
    if lower.get_ylim()[0] < 1e-6 * gap:
        lower.set_ylim(bottom=1e-6 * gap)
    upper.set_title(f"Once a revolution, {heading(cases, line)}")
    regime_legend(figure, cases, line)
    return figure


def draw_growth(cases: Results, line: list[int]) -> Any:
    """Return a figure over the speed of growth rates, measured and by linear theory.

    The panel below shows the energy input over the losses.

    Linear theory holds the contacts of nodal diameter k closed, or replaces them by
    springs of the stiffness with which motion grows fastest; only roots with |omega| <
    `SLOW` count.
    """
    rows = [cases.rows[i] for i in line]
    linear = [_linear(cases, i) for i in line]
    speeds = np.array([row["speed"] for row in rows])
    figure, (upper, lower) = new_figure((10, 7), 2, sharex=True)
    for name, look, told in (
        ("slow", "-", "closed"),
        ("sprung", ":", "as worst springs"),
    ):
        label = f"linear, contacts {told}"
        upper.plot(speeds, [r[name] for r in linear], look, c=palette.INK, lw=1,
                   label=label)  # fmt: skip
    for row in rows:
        shown = SHOWN[shown_word(row)]
        upper.plot(row["speed"], row["growth_rate"], shown.marker, mfc=shown.colour,
                   mec=shown.stroke, ms=5)  # fmt: skip
    unit = ROW["growth_rate"].unit
    upper.set_ylabel(f"growth of ln amplitude, {unit}\n(marks: measured in the window)")
    below = f"linear: roots below {SLOW / 2 / np.pi:g} Hz"
    upper.set_title(f"Growth, {heading(cases, line)}; {below}")
    upper.axhline(0.0, c=palette.GREY, lw=0.6)
    _feeding(lower, rows)
    regime_legend(figure, cases, line, upper, lower)
    return figure


def _linear(cases: Results, case: int) -> dict[str, float]:
    scene = cases.scene(case)
    around = scene.nodal_diameter % scene.engine.rotor.blades
    k = min(around, scene.engine.rotor.blades - around)  # as the tips see the lobes
    return growth_of_diameter(resolve(scene).model, k, scene.speed, scene.friction)


def _feeding(axes: Any, rows: list[dict[str, Any]]) -> None:
    """Draw the energy that contact feeds in the window over the speed.

    It is the work of friction, and that of carrying contacts over the deformed ring,
    each divided by the losses.

    rows : results by name of each case
    """
    touching = [r for r in rows if r["late_contacts"] and r["late_lost"] > 0]
    speeds = [r["speed"] for r in touching]
    for name, label, marker in (
        ("late_friction", "friction", "o"),
        ("late_rotation", "transport over the deformed ring", "x"),
    ):
        share = [r[name] / r["late_lost"] for r in touching]
        axes.plot(speeds, share, marker, ms=5, mfc="none", label=label)
    axes.axhline(1.0, c=palette.GREY, lw=0.6, ls="--")
    if max(map(abs, axes.dataLim.intervaly), default=0.0) > PLAIN:
        axes.set_yscale("symlog", linthresh=1.0)
    axes.margins(y=0.1)
    axes.set(xlabel=axis_of("speed"), ylabel="energy fed / lost in the window")


def draw_waterfall(cases: Results, case: int) -> Any:
    """Return a waterfall: the centre's spectra over time and over a speed that changes.

    The strip below shows the word of each window, dashed lines Omega and -Omega, dotted
    lines the times and speeds at which a critical speed is crossed.
    """
    resolved, traces = resolve(cases.scene(case)), cases.traces(case)
    row = cases.rows[case]
    spells = spells_of(str(row.get("words_over_speed", "")))
    if not spells:
        raise InputError(
            "a waterfall needs a case whose speed or gap changes in time, or that "
            "loses a blade later"
        )
    scene, time = resolved.scene, traces["time"]
    if len(time) < 2 * whirl.FEWEST:
        msg = f"a waterfall needs {2 * whirl.FEWEST} samples, got {len(time)}"
        raise InputError(f"{msg}: lower interval")
    mean = float(np.abs(speed_at(scene, time)).mean())
    turn = 2 * np.pi / mean if mean > 0.0 else float(time[-1])
    sense = whirl.sense_of(scene.speed)  # forward above 0
    spectra = whirl.spectra_over(
        time, traces["centre"] @ np.array([1.0, sense * 1j]), turn
    )
    names = ["time"] if law_of(scene) is None else ["time", "speed"]
    figure, (panels,) = new_figure(
        (11 if names[1:] else 7, 5.6), 1, len(names), sharey=True, squeeze=False
    )
    for axes, name in zip(panels, names, strict=True):
        _waterfall(axes, name, resolved, spectra)
        for one in spells:
            ends = (one.begin, one.end) if name == "time" else (one.first, one.last)
            _tell_word(axes, ends, one.regime)
    panels[0].set_ylabel("ω, rad/s, static frame: backward < 0 < forward")
    label = "radius of the line's circle, mm"
    figure.colorbar(panels[0].collections[0], ax=list(panels), label=label)
    figure.suptitle(title_of(row))
    regimes = dict.fromkeys(spell.regime for spell in spells)
    patches = [
        Patch(fc=look.colour, ec=palette.INK, lw=0.4, label=f"{look.letter}  {regime}")
        for regime, look in ((regime, SHOWN[regime]) for regime in regimes)
    ]
    legend_below(figure, more=patches)
    return figure


def _tell_word(axes: Any, ends: tuple[float, float], regime: str) -> None:
    """Draw an interval of the strip of words, with its letter if there is room.

    ends : of the interval, on the axis
    """
    look, (low, high) = SHOWN[regime], axes.get_xlim()
    axes.axvspan(*ends, 0.0, STRIP, fc=look.colour, ec=palette.INK, lw=0.4)
    if abs(ends[1] - ends[0]) > NARROW * (high - low):
        axes.text(
            sum(ends) / 2.0, STRIP / 2.0, look.letter, fontsize=8, ha="center",
            va="center", transform=axes.get_xaxis_transform(), clip_on=True,
        )  # fmt: skip


def _top(omega: Floats, amplitude: Floats, speed: float) -> float:
    """Return the end of a waterfall's frequency axis, rad/s: 1.2 to 3 times the speed.

    Within these limits, it is the highest |omega| with an amplitude above 1/1000 of the
    largest one.

    omega, amplitude, speed : (f,), rad/s; (c, f), m, of c spectra; highest speed, rad/s
    """
    seen = (amplitude > 1e-3 * amplitude.max(initial=0.0)).any(axis=0)
    highest = float(np.abs(omega[seen]).max(initial=0.0))
    return min(max(highest, 1.2 * speed), 3.0 * speed)


def _waterfall(
    axes: Any, name: str, case: Case, spectra: tuple[Floats, Floats, Floats]
) -> None:
    """Draw a panel of a waterfall: spectra over the time or over the speed of a run.

    Of a speed that is passed repeatedly the last spectrum is drawn.

    name, spectra : "time" or "speed"; result of `whirl.spectra_over`
    """
    middles, omega, amplitude = spectra
    speeds = speed_at(case.scene, middles)
    most = _top(omega, amplitude, float(np.abs(speeds).max()))
    shown = np.abs(omega) <= most
    values = 1e3 * amplitude[:, shown]
    top = float(values.max(initial=0.0)) or 1.0
    norm = LogNorm(top * 10.0**-DECADES, top, clip=True)
    places = middles if name == "time" else speeds
    at, last = np.unique(places[::-1], return_index=True)
    axes.pcolormesh(
        at, omega[shown], values[::-1][last].T, norm=norm, shading="nearest",
        rasterized=True,
    )  # fmt: skip
    for sign in (1.0, -1.0):
        axes.plot(at, sign * speeds[::-1][last], "--", c=palette.GROUND, lw=0.8)
    sense = whirl.sense_of(case.scene.speed) if name == "speed" else 1.0
    for one in crossings(case):
        axes.axvline(sense * one[name], c=palette.GROUND, ls=":", lw=0.9)
    axes.set(xlabel=axis_of(name), ylim=(-most, most))
