"""Frequencies over the speed: Campbell, stability and interaction diagrams."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import Any

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from hpcwhirl.analysis import rotation
from hpcwhirl.analysis.critical import coincidences
from hpcwhirl.arrays import Floats
from hpcwhirl.case.growth import stability_of
from hpcwhirl.case.resolve import Case, resolve
from hpcwhirl.errors import InputError
from hpcwhirl.reduction import families
from hpcwhirl.reduction.growth import Span
from hpcwhirl.report import palette
from hpcwhirl.report.canvas import (
    BOX,
    axis_of,
    eq13_of,
    legend_below,
    new_figure,
    value_of,
)
from hpcwhirl.report.figures.shaft_waves import draw_shaft_waves
from hpcwhirl.report.map.axes import cell_edges
from hpcwhirl.scene import Scene, title_of
from hpcwhirl.scene.units import shown_in
from hpcwhirl.scene.words import SHOWN, Look, word_of
from hpcwhirl.store.reading.results_file import Results

MARGIN = 1.2
POINTS = 61  # speeds at which curves are computed
FAMILIES = ("1F", "2F", "suspension")
COLOURS = dict(
    zip(FAMILIES, (palette.BLUE, palette.PURPLE, palette.GREEN), strict=True)
)
OTHER = COLOURS["2F"]  # colour of all other families
INWARD = 0.75  # fraction of the speed axis beyond which labels are left of their point
WAYS = "forward", "backward"  # both waves of a family, in the order of `Waves`
MOST_ORDERS = 12  # largest number of engine orders, and of harmonics of the casing


def draw_campbell(scene: Scene, speeds: Floats) -> Any:
    """Return the Campbell diagram in the rotating frame: rotor, casing, engine orders.

    With full rotation and equal sectors, waves of k = 1 are drawn below in the static
    frame, see `draw_shaft_waves`.

    The blades see a wave of the casing with k lobes at |omega_c -+ k Omega|. Eq. 13
    holds where such a wave against the rotation meets 1F or the suspension of the same
    k. With full rotation the rotor's frequencies depend on the speed; frequencies
    without rotation are dotted. Vertical lines mark the speeds at which an unbalance
    excites a wave, and the speed from which a free motion grows.

    Parameters
    ----------
    scene : scene with the engine, and the nodal diameter k of the pulse
    speeds : (n,), rad/s, speeds of the campaign
    """
    case = resolve(scene)
    table, k = families.modal_table(case.model), scene.nodal_diameter
    if not any(m.body == "rotor" for m in table):
        raise InputError("a Campbell diagram needs modes of the rotor")
    most = MARGIN * (float(np.abs(speeds).max(initial=0.0)) or 1.0)
    span = np.linspace(0.0, most, POINTS)
    spin = case.model.rotor.spin
    rows = 2 if spin is not None and len(spin.waves) > 1 else 1
    figure, panels = new_figure((9.5, 6.2 if rows == 1 else 10.0), rows, squeeze=False)
    axes = panels[0, 0]
    top = _families(axes, bands_in_hz(case, span), span)
    _casing(axes, table, k, span)
    _marks(axes, case, families.first_family(table, "casing"), most)
    if spin is not None:
        top = max(top, _of_centre(axes, case, span))
        other = rotation.beside(case)
        _beside(axes, span, bands_in_hz(other, span) if other else {})
        _at_speed(axes, case, most)
    engine_orders(axes, span, top)
    ends, look = (np.abs(speeds).min(), np.abs(speeds).max()), {"lw": 0.5, "zorder": 0}
    axes.axvspan(*ends, fc=palette.FAINT, ec=palette.EDGE,
                 label="speeds of the campaign", **look)  # fmt: skip
    axes.set(xlim=(0.0, most), ylim=(0.0, top), xlabel=axis_of("speed"),
             ylabel=axis_of("frequency") + " (rotating frame)")  # fmt: skip
    name = title_of(scene.engine.name, scene.engine.file)
    axes.set_title(f"{name}: casing of k = {k}", parse_math=False)
    if rows == 2:
        draw_shaft_waves(panels[1, 0], case, span)
    legend_below(figure, *panels[:, 0])
    return figure


def bands_in_hz(case: Case, span: Floats) -> dict[str, Floats]:
    """Return the band of natural frequencies of each family of rotor modes over speed.

    Returns {family: (2, n)}, Hz, rotating frame: the least and the largest frequency of
    all nodal diameters at n speeds; only of the families that have a colour, `COLOURS`

    span : (n,), rad/s, speeds
    """
    bands = rotation.bands_over(case, span)
    return {n: np.array(bands[n]) / (2 * np.pi) for n in COLOURS if n in bands}


def _families(axes: Any, bands: Mapping[str, Floats], span: Floats) -> float:
    """Draw the rotor's families as bands over the speed; return the axis' end, Hz.

    bands, span : result of `bands_in_hz`; (n,), rad/s, speeds
    """
    for name, band in bands.items():
        axes.fill_between(span, *band, color=COLOURS[name], lw=1.2,
                          label=f"rotor {name}")  # fmt: skip
    top = max((float(band.max()) for band in bands.values()), default=0.0)
    return MARGIN * top or 1.0


def _of_centre(axes: Any, case: Case, span: Floats) -> float:
    """Draw frequencies of the waves of k = 1, which move the centre, over the speed.

    Return the end of the frequency axis that they need, Hz.

    span : (n,), rad/s, speeds
    """
    top = 0.0
    for name, waves in rotation.waves_over(case, 1, span).items():
        seen = np.abs(np.array(waves) - span) / (2 * np.pi)
        told = [f"{name}, k = 1, {way}" for way in WAYS]
        _pair(axes, span, seen, told, c=COLOURS.get(name, OTHER), lw=1.6)
        top = max(top, MARGIN * float(seen.max()))
    return top


def _pair(axes: Any, span: Floats, pair: Any, told: Sequence[str], **look: Any) -> None:
    """Draw two curves over the speed, the first solid, the second dashed.

    span, pair : (n,), rad/s, speeds; (2, n), values of both curves
    told, look : labels of the curves; keyword arguments of matplotlib's `plot`
    """
    for curve, line, label in zip(pair, ("-", "--"), told, strict=True):
        axes.plot(span, curve, line, label=label, **look)


def _beside(axes: Any, span: Floats, pairs: Mapping[str, Any]) -> None:
    """Draw the rotor's frequencies without the effects of rotation, dotted.

    span : (n,), rad/s, speeds
    pairs : {family: (2, n), two curves, in the unit of the axis}
    """
    told: str | None = "without effects of rotation"
    for name, pair in pairs.items():
        axes.plot(span, np.transpose(pair), ":", c=COLOURS.get(name, OTHER), lw=1.0,
                  label=[told, None])  # fmt: skip
        told = None


def _at_speed(axes: Any, case: Case, most: float) -> None:
    """Mark speeds at which an unbalance excites a wave, and bands where motions grow.

    Speeds beyond the search, such as beyond a bearing's table, are hatched.

    most : rad/s, end of the axis of speeds
    """
    for speed in rotation.unbalance_speeds_of(case, most):
        if speed <= most:
            axes.axvline(speed, color=palette.GROWING, lw=1.2, ls="-.",
                         label=f"unbalance: {_speed(speed)}")  # fmt: skip
    found = stability_of(case.model, most)
    if found is None:
        return
    for band in [band for band in found.bands if band.start < most]:
        ends = f" to {_speed(band.end)}" if band.ends else ""
        told = f"free motion grows from {_speed(band.start)}{ends}"
        axes.axvspan(band.start, min(band.end, most), fc=palette.GROWING,
                     alpha=0.15, lw=0, label=told)  # fmt: skip
    _beyond(axes, found.span, most)


def _beyond(axes: Any, searched: Span, most: float) -> None:
    """Hatch the speeds that were not searched, at which no case can run.

    searched, most : the search; rad/s, end of the axis of speeds
    """
    why = {"table": "beyond the bearing's table"}.get(
        searched.ends, "blades have no stiffness"
    )
    parts = [(0.0, searched.low), (searched.high, most)]
    for place, (low, high) in enumerate(part for part in parts if part[0] < part[1]):
        axes.axvspan(low, high, fc="none", ec=palette.EDGE, hatch="////", lw=0,
                     label=None if place else why)  # fmt: skip


def engine_orders(
    axes: Any,
    span: Floats,
    top: float,
    colours: tuple[str, str] = (palette.EDGE, palette.QUIET),
) -> None:
    """Draw engine orders n Omega / 2 pi, with n where each line leaves the axes.

    span, top : (n,), rad/s, speeds; Hz, end of the frequency axis
    colours : colour of the lines, and of their labels
    """
    for n in range(1, MOST_ORDERS + 1):
        line = n * span / (2 * np.pi)
        axes.plot(span, line, c=colours[0], lw=0.5)
        end = min(span[-1], 2 * np.pi * top / n)
        if end < span[0]:  # beyond the axes
            break
        look = {"color": colours[1], "fontsize": 7, "ha": "right", "va": "top"}
        axes.annotate(f"{n}", (end, n * end / (2 * np.pi)), (-2, -2),
                      textcoords="offset points", **look)  # fmt: skip


def _casing(axes: Any, table: list[families.Line], k: int, span: Floats) -> None:
    """Draw the frequency at which blades see a wave of the casing, over the speed.

    It is the casing's first wave of k lobes, once with and once against the rotation.

    table, span : modal table of the engine; (n,), rad/s, speeds
    """
    first = families.first_family(table, "casing").get(k)
    if first is None:
        return
    seen = np.abs([first + k * span, first - k * span]) / (2 * np.pi)
    told = [f"casing, k = {k}, wave {way} the rotation" for way in ("against", "with")]
    _pair(axes, span, seen, told, c=palette.ORANGE, lw=1.0)


def _marks(axes: Any, case: Case, casing: Mapping[int, float], most: float) -> None:
    """Mark the critical speeds of Eq. 13 on the curves of the rotor's families.

    casing : {nodal diameter: omega of 1F, rad/s}; most : rad/s, end of the axis
    """
    k = case.given.nodal_diameter
    for row in rotation.critical_of(case, 1):
        if row["nodal_diameter"] == k and row["speed"] <= most:
            name, speed = row["family"], row["speed"]
            at = speed, (k * speed - casing[k]) / (2 * np.pi)
            axes.plot(*at, "o", c=palette.INK, mfc=palette.GROUND, ms=5, zorder=4)
            axes.annotate(f"{eq13_of(name)}: {_speed(speed)}", at,
                          (6, 8 if name == "1F" else -14), fontsize=8, bbox=BOX,
                          textcoords="offset points", zorder=5)  # fmt: skip


def draw_stability(scene: Scene, speeds: Floats) -> Any:
    """Return a figure of growth rates of the rotor's free motions without contact.

    A motion with a growth rate above 0 grows by rotating damping, by cross-coupled
    stiffness, or where two waves meet. The largest growth rate over all nodal diameters
    is drawn with and without the effects of rotation; with them, also the growth rates
    of the waves of k = 1, which move the centre.

    Parameters
    ----------
    scene : scene with the engine
    speeds : (n,), rad/s, speeds of the campaign
    """
    case = resolve(scene)
    most = MARGIN * (float(np.abs(speeds).max(initial=0.0)) or 1.0)
    span = np.linspace(0.0, most, POINTS)
    figure, axes = new_figure((9.5, 5.0))
    fastest, waves = rotation.growth_over(case, span)
    for name in [name for name in FAMILIES if name in waves]:
        told = [f"{name}, k = 1, {way}" for way in WAYS]
        _pair(axes, span, waves[name], told, c=COLOURS[name], lw=1.2)
    axes.plot(span, fastest, "-", c=palette.INK, lw=2.0, label="largest of all waves")
    other = rotation.beside(case)
    if other is not None:
        kind = other.reduced.engine.rotation
        axes.plot(span, rotation.growth_over(other, span)[0], ":", c=palette.INK,
                  lw=1.4, label=f"largest, rotation = {kind}")  # fmt: skip
    axes.axhline(0.0, c=palette.EDGE, lw=0.8)
    if case.model.rotor.spin is not None:
        _at_speed(axes, case, most)
    axes.set(xlim=(0.0, most), xlabel=axis_of("speed"), ylabel=axis_of("growth_rate"))
    name = title_of(scene.engine.name, scene.engine.file)
    axes.set_title(f"{name}: free motions without contact", parse_math=False)
    legend_below(figure, axes)
    return figure


def draw_interaction(cases: Results, line: list[int]) -> Any:
    """Return the interaction diagram: waves of both bodies and regimes over the speed.

    In the casing's frame, waves coincide where n omega_c = |k Omega +- omega_bd|. The
    strip below shows regimes. With full rotation omega_bd depends on the speed; waves
    without rotation are dotted.

    line : numbers of cases that differ only in speed
    """
    scene = cases.scene(line[0])
    case = resolve(scene)
    table = families.modal_table(case.model)
    k = scene.nodal_diameter
    if k == 0 or not any(m.body == "casing" for m in table):
        msg = "the interaction diagram needs k > 0 lobes and an elastic casing"
        raise InputError(msg)
    figure, (axes, strip) = new_figure((10, 6), 2, sharex=True, height_ratios=(8, 1))
    cells = cell_edges(np.array([cases.rows[i]["speed"] for i in line]))
    span = cells[[0, -1]]
    first = families.first_family(table, "casing").get(k, 0.0)
    speeds = np.linspace(span[0], span[1], POINTS)
    own = rotation.waves_over(case, k, speeds)
    limits = wave_limits(own, k, span)
    orders = highest_order(first, limits)
    for name, pair in own.items():
        told = [f"{name}: kΩ {sign} ω$_{{bd}}$" for sign in "+−"]
        _pair(axes, speeds, pair, told, c=COLOURS.get(name, OTHER), lw=1.2)
    other = rotation.beside(case) if case.model.rotor.spin is not None else None
    _beside(axes, speeds, rotation.waves_over(other, k, speeds) if other else {})
    _harmonics(axes, first, orders)
    axes.set(ylabel="ω, rad/s, casing's frame:\nagainst < 0 < with the rotation")
    axes.set_ylim(limits)
    _crossings(axes, case, span, orders)
    _tell_words(strip, cells, [shown_word(cases.rows[i]) for i in line])
    strip.set_xlim(span)
    strip.set(yticks=[], xlabel=axis_of("speed"), ylabel="regime")
    axes.set_title(f"Interaction of nodal diameter {k}, {heading(cases, line)}")
    regime_legend(figure, cases, line, axes, strip=True)
    return figure


def _tell_words(strip: Any, cells: Floats, words: list[str]) -> None:
    """Draw words over the speed as cells, with a letter in the middle of equal ones.

    cells, words : (m + 1,), rad/s, edges of the cells; word of each
    """
    begin = 0
    for word, equal in groupby(words):
        end, look = begin + len([*equal]), SHOWN[word]
        strip.axvspan(cells[begin], cells[end], color=look.colour, lw=0)
        strip.text((cells[begin] + cells[end]) / 2.0, 0.5, look.letter, c=look.ink,
                   ha="center", va="center", fontsize=8, clip_on=True,
                   transform=strip.get_xaxis_transform())  # fmt: skip
        begin = end


def _harmonics(axes: Any, first: float, orders: int) -> None:
    """Draw the casing's frequencies +- n omega_c as horizontal lines, n = 1 .. orders.

    The signs stand for waves with and against the rotation.

    first : omega_c, rad/s, frequency of the casing's first mode
    """
    told = {1: "±ω$_c$", 2: f"±n ω$_c$, n = 2..{orders}"}
    for n in range(1, orders + 1):
        look = {"lw": 1.2} if n == 1 else {"lw": 0.6, "alpha": 0.4}
        for sign in (-1, 1):
            label = told.get(n) if sign == 1 else None
            axes.axhline(sign * n * first, c=palette.ORANGE, label=label, **look)


def _crossings(axes: Any, case: Case, span: Floats, orders: int) -> None:
    """Mark the speeds at which waves of the rotor meet the casing's n omega_c.

    Waves of 1F are marked for n up to `orders`, those of other families for n = 1. With
    full rotation only coincidences of Eq. 13 and its super-harmonics are marked.

    span : rad/s, speeds, of which the first and the last are the ends of the axis
    """
    table, k = families.modal_table(case.model), case.given.nodal_diameter
    casing = families.first_family(table, "casing")
    found: dict[str, list[dict[str, Any]]] = {}
    if case.model.rotor.spin is None:
        for family, own in rotation.own_waves(table, k).items():
            most = orders if family == "1F" else 1
            found[family] = list(coincidences({k: own}, casing, most))
    else:
        for row in rotation.critical_of(case, orders):
            if row["nodal_diameter"] == k:
                found.setdefault(row["family"], []).append(row | {"side": -1})
    for family, rows in found.items():
        seen = [
            row | {"speed": at} for row in rows for at in (row["speed"], -row["speed"])
            if span[0] <= at <= span[-1] and row["side"] != 1
        ]  # fmt: skip
        _marked(axes, family, seen, casing.get(k, 0.0), span)


def _marked(
    axes: Any,
    family: str,
    seen: list[dict[str, float | int]],
    first: float,
    span: Floats,
) -> None:
    """Mark coincidences of a family's waves with the casing's n omega_c.

    The first and the last critical speed (Eq. 13 or super-harmonic) get a label.

    seen : coincidences to mark, see `analysis.critical.coincidences`
    first : omega_c, rad/s
    span : rad/s, speeds at the ends of the axis
    """
    named = [int(row["order"]) for row in seen if row["side"] == -1]
    told = {"label": "a wave meets ±n ω$_c$"} if family == "1F" else {}
    for row in seen:
        speed, n = float(row["speed"]), int(row["order"])
        height = (1.0 if row["side"] == -1 else -1.0) * n * first
        axes.plot(
            speed,
            height,
            "o",
            c=palette.INK,
            ms=4,
            mfc=palette.GROUND,
            zorder=3,
            **told,
        )
        told = {}
        if row["side"] == -1 and n in {named[0], named[-1]}:
            name = eq13_of(family) if n == 1 else f"n = {n}"
            up = -34 if n == named[0] else 18
            main = family == "1F"  # other names are on the other side of the line
            left = not main or speed > span[0] + INWARD * (span[-1] - span[0])
            axes.annotate(f"{name}: {_speed(speed)}", (speed, height),
                          (-6 if left else 6, up if main else 26),
                          ha="right" if left else "left",
                          textcoords="offset points", fontsize=8,
                          arrowprops={"arrowstyle": "-", "lw": 0.5})  # fmt: skip


def _speed(speed: float) -> str:
    """Return a speed, rad/s, as text in the unit that the user chose for speeds."""
    unit, factor = shown_in("rad/s")
    return f"{factor * speed:.0f} {unit}"


def heading(cases: Results, line: list[int]) -> str:
    """Return the title of a figure over the speed: the inputs that its cases share.

    cases, line : results; numbers of cases that differ only in speed
    """
    row = cases.rows[line[0]]
    shared = ("nodal_diameter", "gap", "friction")
    told = [value_of(name, row[name]) for name in shared]
    return ", ".join(filter(None, (*told, cases.others(line[0], but=shared))))


def shown_word(row: dict[str, Any]) -> str:
    """Return the word, such as "damped", whose colour a case has in figures.

    row : results of the case by name
    """
    return word_of(str(row.get("status", "ok")), row["outcome"], row["regime"])


def regime_legend(
    figure: Any, cases: Results, line: list[int], *panels: Any, strip: bool = False
) -> None:
    """Add a legend below a figure over the speed.

    It explains the labelled curves of the panels, and colours and markers of the words
    that occur.

    cases, line : results; numbers of the cases shown
    panels : axes whose labelled curves are listed
    strip : whether words are cells with letters, not markers
    """
    found = {shown_word(cases.rows[i]) for i in line}
    looks = [look for word, look in SHOWN.items() if word in found]
    if strip:
        keys = [_cell_key(look) for look in looks]
    else:
        keys = [_mark_key(look) for look in looks]
    legend_below(figure, *panels, more=keys)


def _cell_key(look: Look) -> Any:
    """Return the entry of a legend for a word's cells."""
    label = f"{look.letter}  {look.told}"
    return Patch(fc=look.colour, ec=palette.INK, lw=0.4, label=label)


def _mark_key(look: Look) -> Any:
    """Return the entry of a legend for a word's markers."""
    return Line2D([], [], marker=look.marker, ls="", mfc=look.colour, mec=look.stroke,
                  label=look.told)  # fmt: skip


def rotating_top(cases: Results, line: Sequence[int]) -> float:
    """Return the end, Hz, of the frequency axis of spectra in the rotating frame.

    The end lies above the suspension and both bending families of the blades, but not
    above the Nyquist frequency.

    cases, line : results; numbers of the cases shown
    """
    table = families.modal_table(resolve(cases.scene(line[0])).model)
    own = [m.frequency_hz for m in table if m.body == "rotor" and m.family in FAMILIES]
    return min(MARGIN * max(own), nyquist(cases, line))


def centre_top(cases: Results, line: Sequence[int]) -> float:
    """Return the end, rad/s, of the frequency axis of the centre's spectra.

    In the static frame, the axis covers omega_bd +- Omega of nodal diameter 1, which
    moves the centre, and Omega.

    cases, line : results; numbers of the cases shown
    """
    table = families.modal_table(resolve(cases.scene(line[0])).model)
    own = [
        m.frequency_hz for m in table
        if m.body == "rotor" and m.nodal_diameter == 1 and m.family in FAMILIES
        and m.family != "2F"
    ]  # fmt: skip
    speed = max(abs(cases.rows[i]["speed"]) for i in line)
    top = MARGIN * (2 * np.pi * max(own, default=0.0) + speed)
    return float(min(top or np.inf, 2 * np.pi * nyquist(cases, line)))


def nyquist(cases: Results, line: Sequence[int]) -> float:
    """Return the lowest Nyquist frequency of the stored traces of some cases, Hz.

    cases, line : results; numbers of the cases
    """
    return 0.5 / float(max(cases.rows[i]["sample_interval"] for i in line))


def wave_limits(own: rotation.Waves, k: int, span: Floats) -> tuple[float, float]:
    """Return the ends of the frequency axis of an interaction diagram, rad/s.

    Parameters
    ----------
    own : {family: frequencies of its two waves over the speed, rad/s, static frame}
    k : nodal diameter
    span : rad/s, speeds at the ends of the other axis
    """
    waves = [*own.values()]
    ends = np.concatenate([np.ravel(w) for w in waves]) if waves else k * span
    low, high = min(ends.min(), 0.0), max(ends.max(), 0.0)
    more = (MARGIN - 1.0) / 2 * ((high - low) or 1.0)
    return float(low - more), float(high + more)


def highest_order(first: float, limits: tuple[float, float]) -> int:
    """Return how many multiples n omega_c of the casing's frequency fit into an axis.

    At least 1.

    first, limits : omega_c, rad/s; ends of the axis, rad/s
    """
    if first <= 0.0:
        return 1
    return int(np.clip(max(map(abs, limits)) // first, 1, MOST_ORDERS))
