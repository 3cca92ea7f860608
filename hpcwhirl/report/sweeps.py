"""Figures over many speeds: maps of frequency, cascades, bifurcations, interaction."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.analysis.cascade import after_revolutions, cascade
from hpcwhirl.analysis.critical import campbell, coincidences
from hpcwhirl.analysis.poincare import section
from hpcwhirl.analysis.spectrum import amplitude_spectrum, full_spectrum
from hpcwhirl.case.resolve import resolve
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.families import Line, first_family, modal_table
from hpcwhirl.report.labels import axis_of, eq13_of, value_of
from hpcwhirl.report.palette import SEQUENTIAL
from hpcwhirl.report.ranges import (
    centre_top,
    highest_order,
    own_waves,
    rotating_top,
    wave_limits,
)
from hpcwhirl.scene.words import SHOWN, word_of
from hpcwhirl.store.reading.cases import Cases

Floats = NDArray[np.float64]
STEADY_AFTER = 5.0  # revolutions, as the paper's Figs. 6 and 7
FEW_TURNS = 50  # drawn as larger dots
DECADES = 4.0  # shown below the largest amplitude
AT_REST = 1e-9  # mm


def edges_of(values: Floats) -> Floats:
    """Return the (n + 1,) edges of cells around ascending values (n,)."""
    if len(values) == 1:
        return np.array([values[0] - 0.5, values[0] + 0.5])
    middle = (values[1:] + values[:-1]) / 2
    ends = 2 * values[[0, -1]] - middle[[0, -1]]
    return np.concatenate([ends[:1], middle, ends[1:]])


def rotating(traces: dict[str, Floats], speed: float) -> Floats:
    """Return the centre in the rotating frame, (n, 2), m: Eq. (12) undone."""
    z = traces["centre"] @ np.array([1.0, 1j]) * np.exp(-1j * speed * traces["time"])
    return np.column_stack([z.real, z.imag])


def _mesh(
    axes: Any, speeds: Floats, edges: Floats, amplitude: Floats, least: float = 0.0
) -> Any:
    """Draw amplitudes (m, speeds) on a logarithmic scale of `DECADES` decades.

    What is nowhere above `least` is at rest, and nothing of it is drawn.
    """
    from matplotlib.colors import LogNorm

    largest = float(np.nanmax(amplitude, initial=0.0))
    if largest <= least:
        axes.text(0.5, 0.5, f"at rest (≤ {largest:.1g} mm)", color="white",
                  ha="center", transform=axes.transAxes)  # fmt: skip
        largest = 1.0
    norm = LogNorm(largest * 10.0**-DECADES, largest)
    shown = np.maximum(amplitude, largest * 10.0**-DECADES)
    return axes.pcolormesh(
        edges_of(speeds), edges, shown, norm=norm, cmap=SEQUENTIAL, rasterized=True
    )


def frequency_spectra(
    cases: Cases, line: list[int], blade: int = 0
) -> dict[str, list[tuple[Floats, Floats]]]:
    """Return spectra (Hz, m) of a blade's tip and of the centre, after revolution 5.

    Both in the rotating frame: the tip's tangential displacement, and x_o.

    Parameters
    ----------
    cases : a campaign with `tips`
    line : its cases, in the order wanted
    blade : 0 .. N - 1
    """
    out: dict[str, list[tuple[Floats, Floats]]] = {"tip": [], "centre": []}
    for case in line:
        traces, row = cases.traces(case), cases.rows[case]
        part = after_revolutions(traces["time"], row["speed"], STEADY_AFTER)
        if len(traces["time"][part]) < 16:  # ended before
            part = slice(0, None)
        signals = {
            "tip": traces["tips"][part, blade, 1],
            "centre": rotating(traces, row["speed"])[part, 0],
        }
        for name, signal in signals.items():
            out[name].append(amplitude_spectrum(signal, row["sample_interval"]))
    return out


def draw_frequency(cases: Cases, line: list[int], title: str = "") -> Any:
    """Return speed-frequency maps of a tip and of the centre (Figs. 6 and 7)."""
    from matplotlib.figure import Figure

    speeds = np.array([cases.rows[i]["speed"] for i in line])
    spectra = frequency_spectra(cases, line)
    figure = Figure(figsize=(11, 4.6), layout="constrained")
    names = {"tip": "(a) tip of blade 0, tangential", "centre": "(b) centre, $x_o$"}
    edges = np.linspace(0.0, rotating_top(cases, line), 301)
    for axes, (place, label) in zip(figure.subplots(1, 2), names.items(), strict=True):
        amplitude = 1e3 * cascade(spectra[place], edges)
        mesh = _mesh(axes, speeds, edges, amplitude, AT_REST)
        axes.set(
            xlabel=axis_of("speed"),
            ylabel=axis_of("frequency") + " (rotating frame)",
            title=label,
        )
        if (amplitude > AT_REST).any():
            figure.colorbar(mesh, ax=axes, label="amplitude, mm (peak of the sine)")
    figure.suptitle(
        title or f"After revolution {STEADY_AFTER:g}. {heading(cases, line)}"
    )
    return figure


def heading(cases: Cases, line: list[int]) -> str:
    """Return the inputs that the cases of a line share."""
    row = cases.rows[line[0]]
    shared = ("nodal_diameter", "gap", "friction")
    told = [value_of(name, row[name]) for name in shared]
    return ", ".join(filter(None, (*told, cases.others(line[0], but=shared))))


def draw_cascade(cases: Cases, line: list[int], *, transient: bool = False) -> Any:
    """Return the full-spectrum cascade of the static-frame centre, in the window."""
    from matplotlib.figure import Figure

    top = centre_top(cases, line)
    edges = np.linspace(-top, top, 401)
    speeds = np.array([cases.rows[i]["speed"] for i in line])
    spectra = []
    for case in line:
        traces, row = cases.traces(case), cases.rows[case]
        z = traces["centre"] @ np.array([1.0, 1j])
        part = _part(traces, row, transient=transient)
        omega, amplitude = full_spectrum(z[part], row["sample_interval"])
        turned = -1 if row["speed"] < 0 else 1
        spectra.append((turned * omega[::turned], amplitude[::turned]))
    figure = Figure(figsize=(8.5, 6), layout="constrained")
    axes = figure.subplots()
    mesh = _mesh(axes, speeds, edges, 1e3 * cascade(spectra, edges))
    axes.plot(speeds, np.abs(speeds), "w--", lw=0.8)
    axes.axhline(0.0, c="w", lw=0.6)
    axes.set(
        xlabel=axis_of("speed"),
        ylabel="ω, rad/s, static frame:\nbackward < 0 < forward",
        title=f"Full spectrum of the centre, {heading(cases, line)}\n(dashed: ω = Ω)",
        ylim=(-top, top),
    )
    figure.colorbar(mesh, ax=axes, label="radius of the line's circle, mm")
    return figure


def _part(traces: dict[str, Floats], row: dict[str, Any], *, transient: bool) -> slice:
    """Return the window of the words, or everything."""
    start = 0.0 if transient else row["end_time"] - row["window"]
    return slice(int(np.searchsorted(traces["time"], start, side="right")), None)


def draw_bifurcation(cases: Cases, line: list[int], *, transient: bool = False) -> Any:
    """Return X_o and |Z| once a revolution over the speed, in the window."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 6), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True)
    for case in line:
        traces, row = cases.traces(case), cases.rows[case]
        part = _part(traces, row, transient=transient)
        points = section(traces["time"][part], traces["centre"][part], row["speed"])
        at = np.full(len(points), row["speed"])
        colour = colour_of(row)
        look = {"c": colour, "mew": 0, "ms": 2 if len(points) > FEW_TURNS else 5}
        upper.plot(at, 1e3 * points[:, 0], ".", **look)
        lower.plot(at, 1e3 * np.hypot(*points.T), ".", **look)
    gap = 1e3 * cases.rows[line[0]]["gap_scale"]  # of a gap of 0, too
    upper.set_yscale("symlog", linthresh=gap)
    lower.axhline(gap, c="k", ls="--", lw=0.8)
    lower.set(yscale="log", xlabel=axis_of("speed"), ylabel="|Z|, mm (dashed: gap)")
    if lower.get_ylim()[0] < 1e-6 * gap:
        lower.set_ylim(bottom=1e-6 * gap)
    upper.set_ylabel("$X_o$, mm, static frame\n(linear within the gap)")
    upper.set_title(f"Once a revolution, {heading(cases, line)}")
    regime_legend(figure, cases, line)
    return figure


def colour_of(row: dict[str, Any]) -> str:
    """Return the colour of a row's word, dark enough for a dot."""
    return SHOWN[shown_word(row)].stroke


def shown_word(row: dict[str, Any]) -> str:
    """Return the word that a finished case is shown by."""
    return word_of(str(row.get("status", "ok")), row["outcome"], row["regime"])


def regime_legend(figure: Any, cases: Cases, line: list[int]) -> None:
    """Tell the colours of the regimes below a figure."""
    from matplotlib.lines import Line2D

    found = {shown_word(cases.rows[i]) for i in line}
    keys = [
        Line2D(
            [], [], marker="o", ls="", mfc=look.colour, mec=look.stroke, label=look.told
        )
        for word, look in SHOWN.items()
        if word in found
    ]
    figure.legend(handles=keys, loc="outside lower center", ncols=len(keys), fontsize=8)


def draw_interaction(cases: Cases, line: list[int]) -> Any:
    """Return the interaction diagram: waves and regimes over the speed (Eq. 13).

    Casing's frame, n omega_c = |k Omega +- omega_bd|; strips below are the regimes.
    """
    from matplotlib.figure import Figure

    scene = cases.scene(line[0])
    table = modal_table(resolve(scene).model)
    k = scene.nodal_diameter
    if k == 0 or not any(m.body == "casing" for m in table):
        msg = "the interaction diagram needs k > 0 lobes and an elastic casing"
        raise InputError(msg)
    figure = Figure(figsize=(10, 6), layout="constrained")
    axes, strip = figure.subplots(2, 1, sharex=True, height_ratios=(8, 1))
    cells = edges_of(np.array([cases.rows[i]["speed"] for i in line]))
    span = cells[[0, -1]]
    first = first_family(table, "casing").get(k, 0.0)
    limits = wave_limits(own_waves(table, k), k, span)
    orders = highest_order(first, limits)
    _waves(axes, own_waves(table, k), k, span)
    _harmonics(axes, first, orders)
    axes.set(ylabel="ω, rad/s, casing's frame:\nagainst < 0 < with the rotation")
    axes.set_ylim(limits)
    _crossings(axes, table, k, span, orders)
    for i, case in enumerate(line):
        fill = SHOWN[shown_word(cases.rows[case])].colour
        strip.axvspan(cells[i], cells[i + 1], color=fill, lw=0)
    strip.set_xlim(span)
    strip.set(yticks=[], xlabel=axis_of("speed"), ylabel="regime")
    axes.set_title(f"Interaction of nodal diameter {k}, {heading(cases, line)}")
    axes.legend(loc="upper left", fontsize=8)
    regime_legend(figure, cases, line)
    return figure


def _waves(axes: Any, own: dict[str, float], k: int, span: Floats) -> None:
    """Draw both waves of each family, {family: rad/s}, over a span of speeds."""
    colours = {"1F": "#0072B2", "suspension": "#009E73"}
    for name, (plus, minus) in campbell(own, k, span).items():
        label = f"{name}: kΩ ± ω$_{{bd}}$"
        colour = colours.get(name, "#56B4E9")
        axes.plot(span, plus, c=colour, lw=1.2, label=label)
        axes.plot(span, minus, c=colour, lw=1.2, ls="--")


def _harmonics(axes: Any, first: float, orders: int) -> None:
    """Draw the casing's frequency and its multiples, of waves both ways."""
    told = "±ω$_c$" if orders == 1 else f"±n ω$_c$, n = 1..{orders}"
    for n in range(1, orders + 1):
        for sign in (-1, 1):
            label = told if n == sign == 1 else None
            axes.axhline(sign * n * first, c="#D55E00", lw=0.6, label=label)


def _crossings(axes: Any, table: list[Line], k: int, span: Floats, orders: int) -> None:
    """Mark the coincidences of 1F, and of other families those of n = 1."""
    casing = first_family(table, "casing")
    for family, own in own_waves(table, k).items():
        rows = coincidences({k: own}, casing, orders if family == "1F" else 1)
        seen = [
            row for row in rows
            if span[0] <= row["speed"] <= span[-1] and row["side"] != 1
        ]  # fmt: skip
        _marked(axes, family, seen, casing.get(k, 0.0))


def _marked(
    axes: Any, family: str, seen: list[dict[str, float | int]], first: float
) -> None:
    """Mark coincidences; the speed is told for the first and last in view."""
    named = [int(row["order"]) for row in seen if row["side"] == -1]
    for row in seen:
        speed, n = float(row["speed"]), int(row["order"])
        height = (1.0 if row["side"] == -1 else -1.0) * n * first
        axes.plot(speed, height, "o", c="black", ms=4, mfc="white", zorder=3)
        if row["side"] == -1 and n in {named[0], named[-1]}:
            name = eq13_of(family) if n == 1 else f"n = {n}"
            place = (6, -34) if n == named[0] else (6, 18)
            main = family == "1F"  # the others' names stand on the line's other side
            axes.annotate(f"{name}: {speed:.0f} rad/s", (speed, height),
                          place if main else (-6, 26), ha="left" if main else "right",
                          textcoords="offset points", fontsize=8,
                          arrowprops={"arrowstyle": "-", "lw": 0.5})  # fmt: skip
