"""Diagrams of frequencies over the speed, Campbell and interaction, and their axes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from hpcwhirl.analysis.critical import campbell, coincidences, critical_of_families
from hpcwhirl.case.resolve import resolve
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.families import (
    Line,
    first_family,
    modal_table,
    moving_families,
)
from hpcwhirl.report.labels import axis_of, eq13_of, value_of
from hpcwhirl.report.map.axes import cell_edges
from hpcwhirl.scene import Scene, title_of
from hpcwhirl.scene.units import shown_in
from hpcwhirl.scene.words import SHOWN, word_of
from hpcwhirl.store.reading.results_file import Results

Floats = NDArray[np.float64]
MARGIN = 1.2
FAMILIES = ("1F", "2F", "suspension")
COLOURS = dict(zip(FAMILIES, ("#0072B2", "#56B4E9", "#009E73"), strict=True))
MOST_ORDERS = 12  # of the engine, and of the casing's super-harmonics


def draw_campbell(scene: Scene, speeds: Floats) -> Any:
    """Return frequencies over the speed: blades, casing as blades see it, orders.

    The rotor's frequencies do not depend on the speed (no centrifugal terms). A wave of
    the casing with k lobes passes the blades at |omega_c -+ k Omega|; where one meets
    1F or the suspension of the same k against the rotation is Eq. 13.

    Parameters
    ----------
    scene : engine and nodal diameter
    speeds : (n,), rad/s, of the campaign
    """
    check_at_rest(scene, "the Campbell diagram")
    table, k = modal_table(resolve(scene).model), scene.nodal_diameter
    if not any(m.body == "rotor" for m in table):
        msg = "a Campbell diagram needs modes of the rotor"
        raise InputError(msg)
    most = MARGIN * (float(np.abs(speeds).max(initial=0.0)) or 1.0)
    span = np.linspace(0.0, most, 201)
    figure = Figure(figsize=(9.5, 6.2), layout="constrained")
    axes = figure.subplots()
    top = _families(axes, table, span)
    _orders(axes, span, top)
    _casing(axes, table, k, span)
    _marks(axes, table, k, most)
    axes.axvspan(*(np.abs(speeds).min(), np.abs(speeds).max()), color="#EEEEEE", lw=0,
                 zorder=0, label="speeds of the campaign")  # fmt: skip
    axes.set(xlim=(0.0, most), ylim=(0.0, top), xlabel=axis_of("speed"),
             ylabel=axis_of("frequency") + " (rotating frame)")  # fmt: skip
    name = title_of(scene.engine.name, scene.engine.file)
    axes.set_title(f"{name}: casing of k = {k}", parse_math=False)
    axes.legend(fontsize=8, loc="upper left")
    return figure


def _families(axes: Any, table: list[Line], span: Floats) -> float:
    """Draw the rotor's families as bands over all k; return the top of the axis, Hz."""
    top = 0.0
    for name, colour in COLOURS.items():
        own = [m.frequency_hz for m in table if m.body == "rotor" and m.family == name]
        if not own:
            continue
        axes.fill_between(span, min(own), max(own), color=colour, lw=1.2,
                          label=f"rotor {name}")  # fmt: skip
        top = max(top, MARGIN * max(own))
    return top or 1.0


def _orders(axes: Any, span: Floats, top: float) -> None:
    """Draw engine orders n Omega / 2 pi, named where they leave the axes."""
    for n in range(1, MOST_ORDERS + 1):
        line = n * span / (2 * np.pi)
        axes.plot(span, line, c="#999999", lw=0.5)
        end = min(span[-1], 2 * np.pi * top / n)
        look = {"color": "#666666", "fontsize": 7, "ha": "right", "va": "top"}
        axes.annotate(f"{n}", (end, n * end / (2 * np.pi)), (-2, -2),
                      textcoords="offset points", **look)  # fmt: skip


def _casing(axes: Any, table: list[Line], k: int, span: Floats) -> None:
    """Draw the casing's first wave of k as the blades meet it, both ways."""
    first = first_family(table, "casing").get(k)
    if first is None:
        return
    for sign, look, told in ((-1, "-", "against"), (1, "--", "with")):
        seen = np.abs(first - sign * k * span) / (2 * np.pi)
        axes.plot(span, seen, look, c="#D55E00", lw=1.0,
                  label=f"casing, k = {k}, wave {told} the rotation")  # fmt: skip


def _marks(axes: Any, table: list[Line], k: int, most: float) -> None:
    """Mark Eq. 13 on the families of the rotor that have it."""
    rotor = own_waves(table, k)
    for row in critical_of_families(table):
        if row["nodal_diameter"] == k and row["speed"] <= most:
            name, speed = row["family"], row["speed"]
            at = speed, rotor[name] / (2 * np.pi)
            axes.plot(*at, "o", c="black", mfc="white", ms=5, zorder=4)
            axes.annotate(f"{eq13_of(name)}: {_speed(speed)}", at,
                          (6, 8 if name == "1F" else -14), fontsize=8,
                          textcoords="offset points")  # fmt: skip


def draw_interaction(cases: Results, line: list[int]) -> Any:
    """Return the interaction diagram: waves and regimes over the speed (Eq. 13).

    Casing's frame, n omega_c = |k Omega +- omega_bd|; strips below are the regimes.
    """
    scene = cases.scene(line[0])
    check_at_rest(scene, "the interaction diagram")
    table = modal_table(resolve(scene).model)
    k = scene.nodal_diameter
    if k == 0 or not any(m.body == "casing" for m in table):
        msg = "the interaction diagram needs k > 0 lobes and an elastic casing"
        raise InputError(msg)
    figure = Figure(figsize=(10, 6), layout="constrained")
    axes, strip = figure.subplots(2, 1, sharex=True, height_ratios=(8, 1))
    cells = cell_edges(np.array([cases.rows[i]["speed"] for i in line]))
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
            axes.annotate(f"{name}: {_speed(speed)}", (speed, height),
                          place if main else (-6, 26), ha="left" if main else "right",
                          textcoords="offset points", fontsize=8,
                          arrowprops={"arrowstyle": "-", "lw": 0.5})  # fmt: skip


def _speed(speed: float) -> str:
    """Return a speed, rad/s, as it stands beside a mark, in the unit shown."""
    unit, factor = shown_in("rad/s")
    return f"{factor * speed:.0f} {unit}"


def heading(cases: Results, line: list[int]) -> str:
    """Return the inputs that the cases of a line share."""
    row = cases.rows[line[0]]
    shared = ("nodal_diameter", "gap", "friction")
    told = [value_of(name, row[name]) for name in shared]
    return ", ".join(filter(None, (*told, cases.others(line[0], but=shared))))


def shown_word(row: dict[str, Any]) -> str:
    """Return the word that a finished case is shown by."""
    return word_of(str(row.get("status", "ok")), row["outcome"], row["regime"])


def regime_legend(figure: Any, cases: Results, line: list[int]) -> None:
    """Tell the colours of the regimes below a figure."""
    found = {shown_word(cases.rows[i]) for i in line}
    keys = [
        Line2D(
            [], [], marker="o", ls="", mfc=look.colour, mec=look.stroke, label=look.told
        )
        for word, look in SHOWN.items()
        if word in found
    ]
    figure.legend(handles=keys, loc="outside lower center", ncols=len(keys), fontsize=8)


def check_at_rest(scene: Scene, what: str) -> None:
    """Raise InputError where lines of the rotor at rest are not those at speed."""
    if scene.engine.rotation != "none":
        msg = (
            f"{what} is drawn with the lines at rest: rotation must be none, got "
            f"{scene.engine.rotation}; hpcwhirl model tells those at a speed"
        )
        raise InputError(msg)


def rotating_top(cases: Results, line: Sequence[int]) -> float:
    """Return the highest frequency of a map in the rotating frame, Hz.

    Above both bending families of the blades and the suspension, up to what the
    samples tell.
    """
    table = modal_table(resolve(cases.scene(line[0])).model)
    own = [m.frequency_hz for m in table if m.body == "rotor" and m.family in FAMILIES]
    return min(MARGIN * max(own), nyquist(cases, line))


def centre_top(cases: Results, line: Sequence[int]) -> float:
    """Return the highest |omega| of a cascade of the static-frame centre, rad/s.

    The centre moves with nodal diameter 1, at omega_bd +- Omega, and at Omega.
    """
    table = modal_table(resolve(cases.scene(line[0])).model)
    own = [
        m.frequency_hz for m in table
        if m.body == "rotor" and m.nodal_diameter == 1 and m.family in FAMILIES
        and m.family != "2F"
    ]  # fmt: skip
    speed = max(abs(cases.rows[i]["speed"]) for i in line)
    top = MARGIN * (2 * np.pi * max(own, default=0.0) + speed)
    return float(min(top or np.inf, 2 * np.pi * nyquist(cases, line)))


def nyquist(cases: Results, line: Sequence[int]) -> float:
    """Return the highest frequency that the samples of all cases tell, Hz."""
    return 0.5 / float(max(cases.rows[i]["sample_interval"] for i in line))


def own_waves(table: list[Line], k: int) -> dict[str, float]:
    """Return {family: omega, rad/s} of the moving families of a nodal diameter."""
    found = moving_families(table)
    return {family: own[k] for family, own in found.items() if k in own}


def wave_limits(own: Mapping[str, float], k: int, span: Floats) -> tuple[float, float]:
    """Return the least and the largest omega of an interaction diagram, rad/s."""
    waves = [*campbell(own, k, span).values()]
    ends = np.concatenate([np.ravel(w) for w in waves]) if waves else k * span
    low, high = min(ends.min(), 0.0), max(ends.max(), 0.0)
    more = (MARGIN - 1.0) / 2 * ((high - low) or 1.0)
    return float(low - more), float(high + more)


def highest_order(first: float, limits: tuple[float, float]) -> int:
    """Return how many of the casing's harmonics lie within limits, at least 1."""
    if first <= 0.0:
        return 1
    return int(np.clip(max(map(abs, limits)) // first, 1, MOST_ORDERS))
