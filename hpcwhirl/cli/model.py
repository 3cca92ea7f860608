"""`hpcwhirl model`: print modal table, critical speeds and time-step limits."""

from __future__ import annotations

import argparse
import math
from dataclasses import asdict
from itertools import product
from pathlib import Path
from typing import Any

from hpcwhirl.analysis.rotation import (
    critical_of,
    lines_of,
    rotation_of_case,
    side_by_side,
)
from hpcwhirl.case.explain import facts_of_file, facts_of_plan
from hpcwhirl.case.profile import profile_of, told_of_profile
from hpcwhirl.case.resolve import WHOLE, Case, resolve
from hpcwhirl.cli import options
from hpcwhirl.cli.command import add_option
from hpcwhirl.cli.rotor_tables import (
    critical_heads,
    critical_rows,
    limit_told,
    wave_heads,
    wave_rows,
)
from hpcwhirl.errors import SHOWN, InputError, WhirlError, one_line, say, shown
from hpcwhirl.reduction.families import UNKNOWN, modal_table
from hpcwhirl.scene import Scene, apply_settings, title_of
from hpcwhirl.scene.quantities import DERIVED
from hpcwhirl.scene.units import ANGULAR, in_shown, showing, shown_in, with_unit
from hpcwhirl.structure import blade_stiffness

MOST_ORDERS = 10_000  # largest number of super-harmonics
SHOWN_HZ = 300.0  # highest frequency printed by default
SHOWN_SPEED = 600.0  # rad/s, highest critical speed printed, except for the pulse's k
OVERDAMPED = 0.7  # damping ratio above which a wave is no oscillation to speak of


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `hpcwhirl model` on its parser."""
    # fmt: off
    options.add_scene(parser)
    options.add_explain(parser)
    add_option(parser, "--orders N",
        "number of super-harmonics of the critical speed of 1F, Eq. 13 (default 12)",
        default=12)
    add_option(parser, "--up-to HZ",
        f"highest frequency printed (default {SHOWN_HZ:g}; JSON has all)",
        default=SHOWN_HZ, type=float)
    options.add_units(parser, "speeds and lengths")


def facts_of(case: Case, orders: int, fastest: float = 0.0) -> dict[str, Any]:
    """Return what `model --json` prints on the model of a case, by name.

    orders : highest order of super-harmonics among the critical speeds
    fastest : rad/s, highest speed of interest, such as of a sweep
    """
    engine, table = case.given.engine, modal_table(case.model)
    foreign = engine.file != ""  # only the tips of such a rotor's blades are known
    return {
        "engine": title_of(engine.name, engine.file),
        "modes": [asdict(line) for line in table],
        "blade_stiffness": None if foreign else blade_stiffness(engine.rotor),
        "critical_speeds": critical_of(case, orders),
        "lines": lines_of(case),
        "rotation": rotation_of_case(case, fastest),
        "rotor_from_file": facts_of_file(case.model.rotor) if foreign else None,
        "time_step_limits": case.model.limits(case.given.speed),
        "profile_missed": profile_of(case.given).missed,
        "plan": facts_of_plan(case),
    }


def run(args: argparse.Namespace) -> int:
    """Print modes, critical speeds and time-step limits of a scene's model.

    It also says what the integration leaves out (the plan). Returns the exit code
    """
    if not 1 <= args.orders <= MOST_ORDERS:
        msg = f"--orders must be >= 1 and <= {MOST_ORDERS}, got {shown(args.orders)}"
        raise InputError(msg)
    asked = options.asked_units(args.units)
    scene = options.scene_of(args.scene, args.settings)
    case = resolve(scene)
    fastest = _fastest(args.scene, args.settings)
    facts = facts_of(case, args.orders, fastest)
    if args.explain:
        from hpcwhirl.dynamics.integration import integration_of

        facts["integration"] = integration_of(case)
        facts["rotations"] = _rotations(case, fastest)
    options.tell_remarks(scene)
    if told := told_of_profile(scene):
        say(told)
    if args.json:
        options.print_json(facts)
        return 0
    with showing(asked):
        if args.explain:
            _explain(facts, scene)
        else:
            _show(facts, args.up_to, scene)
    return 0


def _rotations(case: Case, fastest: float) -> dict[str, Any]:
    """Return `side_by_side`; of a rotor that loses a blade in the run, also before.

    case, fastest : the case; highest speed of interest, rad/s
    """
    found = side_by_side(case, 1, fastest)
    if not case.loses:
        return found
    whole = side_by_side(resolve(apply_settings(case.given, WHOLE)), 1, fastest)
    return {"full, all blades": whole["full"], "full, one lost": found["full"]}


def _fastest(name: str, settings: list[str]) -> float:
    """Return the highest |speed|, rad/s, in the cases of a campaign file, else 0.

    name, settings : SCENE of the command line; texts of --set
    """
    from hpcwhirl.campaign.foresight.growth import fastest_of
    from hpcwhirl.campaign.plan.design import Design

    if not Path(name).is_file():
        return 0.0
    try:
        design = Design.of(Path(name), options.parsed(settings))
    except WhirlError:  # of tables that this command ignores
        return 0.0
    return fastest_of(design)


def _explain(facts: dict[str, Any], scene: Scene) -> None:
    from hpcwhirl.dynamics.integration import told_of

    print(told_of(facts["integration"]))
    options.print_notes(facts["plan"]["left_out"])
    options.print_bounds(facts["plan"]["bounds"])
    for fit in facts["plan"]["fits"]:
        print(fit["told"])
        if told := _outside(fit, facts["lines"]):
            print(told)
    _show_rotations(facts["rotations"], scene)
    if facts["rotation"]["auto"] is not None:
        print(facts["rotation"]["auto"]["told"])


def _outside(fit: dict[str, Any], lines: list[dict[str, Any]]) -> str:
    """Return a sentence on waves beyond the range of a table over their frequency.

    fit, lines : see `case.explain.facts_of_fits`; waves of the rotor
    """
    own = [
        line
        for line in lines
        if line["nodal_diameter"] == 1 and line["damping_ratio"] < OVERDAMPED
    ]
    own.sort(key=lambda line: abs(line["static"]))
    slow = [line for line in own if abs(line["static"]) < fit["low"]][-1:]
    fast = [line for line in own if abs(line["static"]) > fit["high"]][:1]
    ends = [
        f"{side} {line['family']} with {in_shown(abs(line['static']), ANGULAR, 4)}"
        for side, found in (("below", slow), ("above", fast))
        for line in found
    ]
    told = f"{fit['name']}: beyond its table the fit is not judged; the nearest waves"
    return f"{told} of k = 1 there are {', '.join(ends)}, static frame" if ends else ""


def _show_plan(plan: dict[str, Any]) -> None:
    if plan["truncation_error"] is not None:
        print(
            f"modes left out: relative error of some {plan['truncation_error']:.2g} in "
            "motions with contact (estimate)"
        )
    part = f"one of {plan['folds']} sectors" if plan["folds"] > 1 else "the whole"
    marched = " and ".join(f"{n} {body}" for body, n in plan["marched"].items())
    print(f"plan {plan['kind']}: {part} is integrated, {marched} amplitudes", end="")
    closed = plan["settles"]
    print("; once no contact can recur, the rest is in closed form" if closed else "")


def _show_rotations(rotations: dict[str, Any], scene: Scene) -> None:
    """Print a rotor's frequencies and critical speeds with and without rotation.

    They are columns of one table, for --explain.

    Parameters
    ----------
    rotations : {"none" or "full": facts}, from `analysis.rotation.side_by_side`
    scene : scene with the speed and the lobes
    """
    from rich.console import Console
    from rich.table import Table

    kinds = list(rotations)
    table = Table(f"rotation, at {in_shown(scene.speed, ANGULAR)}", *kinds)
    rows: dict[str, dict[str, str]] = {}
    for kind, facts in rotations.items():
        for name, number in _numbers(facts, {1, scene.nodal_diameter}).items():
            rows.setdefault(name, {})[kind] = number
    for name, row in rows.items():
        table.add_row(name, *(row.get(kind, "-") for kind in kinds))
    Console().print(table)


def _numbers(facts: dict[str, Any], diameters: set[int]) -> dict[str, str]:
    """Return a column of the table of --explain, {quantity with unit: number as text}.

    Quantities are natural frequencies of 1F and suspension, critical speeds, stability,
    and radial growth of the tips.

    Parameters
    ----------
    facts : facts of the rotor, with or without the terms of rotation
    diameters : nodal diameters to include
    """
    (unit, factor), out = shown_in(ANGULAR), {}
    for k, family in product(sorted(diameters), ("1F", "suspension")):
        lines = [
            line
            for line in facts["lines"]
            if (line["nodal_diameter"], line["family"]) == (k, family)
        ]
        for frame in ("rotating", "static") if lines else ():
            numbers = ", ".join(f"{factor * line[frame]:.1f}" for line in lines)
            out[f"{family}, k = {k}: {frame} frame, {unit}"] = numbers
        if lines:
            numbers = ", ".join(f"{line['damping_ratio']:.3g}" for line in lines)
            out[f"{family}, k = {k}: damping ratio"] = numbers
    for row in facts["critical_speeds"]:
        if row["nodal_diameter"] in diameters:
            name = f"Eq. 13, {row['family']}, k = {row['nodal_diameter']}, {unit}"
            out[name] = f"{factor * row['speed']:.1f}"
    for speed in facts["unbalance_speeds"]:
        name = f"critical speed of an unbalance, undamped, {unit}"
        shown = f"{factor * speed:.1f}"
        out[name] = ", ".join(filter(None, [out.get(name, ""), shown]))
    out[f"free motion grows, {unit}"] = _spans_of_growth(facts)
    of = "growth" if facts["growth"] > 0.0 else "slowest decay"
    out[f"{of} of free motion, 1/s"] = f"{abs(facts['growth']):.3g}"
    if facts["tip_growth"] is not None:
        length, scale = shown_in("m")
        growth = scale * facts["tip_growth"]
        out[f"radial growth of the tips, {length}"] = f"{growth:.3g}"
        out[f"clearance at speed, {length}"] = f"{scale * facts['clearance']:.4g}"
    return out | _film_numbers(facts["film"]) | _circle_numbers(facts["unbalance"])


def _spans_of_growth(facts: dict[str, Any]) -> str:
    """Return the bands of speed in which free motion grows as text, without the unit.

    facts : facts of the rotor, see `analysis.rotation.rotation_of_case`
    """
    if not facts["bands"]:
        return f"none {searched_told(facts['searched'])}"
    return ", ".join(map(_band_told, facts["bands"]))


def _band_told(band: dict[str, Any], unit: str = "") -> str:
    """Return a band of speed as text, "200.0 to 300.0 rpm" or "200.0 rpm on".

    unit : of the speeds; "": none is written
    """
    factor = shown_in(ANGULAR)[1]
    start = f"{factor * band['start']:.1f}"
    if band["ends"]:
        return with_unit(f"{start} to {factor * band['end']:.1f}", unit, " ")
    return f"{with_unit(start, unit, ' ')} on"


def searched_told(searched: dict[str, Any] | None) -> str:
    """Return which speeds were searched as text, such as "up to 1025 rad/s".

    searched : entry of `analysis.rotation.rotation_of_case`; None: rotation is none
    """
    if searched is None:
        return "(rotation none)"
    unit, factor = shown_in(ANGULAR)
    low, high = factor * searched["low"], factor * searched["high"]
    told = f"from {low:.4g} to {high:.4g}" if low else f"up to {high:.4g}"
    ends = {
        "table": ", where the bearing's table ends",
        "stiffness": ", where blades lose their stiffness",
    }
    return f"{told} {unit}{ends.get(searched['ends'], '')}"


def growth_told(rotation: dict[str, Any]) -> list[str]:
    """Return lines of text on the speeds at which free motion grows.

    rotation : result of `analysis.rotation.rotation_of_case`
    """
    searched = rotation["searched"]
    within = searched_told(searched)
    if searched and searched["resolution"]:
        width = in_shown(searched["resolution"], ANGULAR, 2)
        within += f"; no band wider than {width} is missed"
    if not rotation["bands"]:
        return [f"free motion grows at no speed {within}"]
    lines = [
        f"free motion grows from {_band_told(band, shown_in(ANGULAR)[0])}: at most "
        f"{band['growth']:.3g} 1/s, at {in_shown(band['speed'], ANGULAR, 4)}, "
        f"{band['family']} of k = {band['nodal_diameter']} with "
        f"{in_shown(abs(band['frequency']), ANGULAR, 4)} "
        f"{'forward' if band['frequency'] > 0.0 else 'backward'} in the static frame"
        for band in rotation["bands"]
    ]
    return [*lines, f"growth of free motion was searched {within}"]


def _film_numbers(film: dict[str, float] | None) -> dict[str, str]:
    """Return lines on a squeeze film for --explain, {quantity with unit: number}.

    film : facts of the film, see `analysis.rotation`; None: no film, and {} is returned
    """
    if film is None:
        return {}
    ends = f"{film['straight']:.3f}, {film['circling']:.3f}"
    return {
        "squeeze film: c of small motions, N s/m": f"{film['damping']:.4g}",
        "displacement / clearance where c is 10 % larger (straight, circle)": ends,
    }


def _circle_numbers(circle: dict[str, Any] | None) -> dict[str, str]:
    """Return numbers of an unbalanced rotor's orbit, {quantity with unit: number}.

    The orbit is the circle on which the centre moves without contact.

    circle : radius, m, and lag, rad, of the orbit; None: no unbalance, {} is returned
    """
    if circle is None:
        return {}
    return {
        "circle of the unbalance: radius, mm": f"{1e3 * circle['radius']:.3g}",
        "lag of the circle, degrees": f"{math.degrees(circle['lag']):.1f}",
    }


def told_circle(circle: dict[str, Any]) -> str:
    """Return a sentence on the circle on which an unbalance moves the rotor's centre.

    circle : result of `case.unbalance.facts_of_unbalance`
    """
    share = circle["over_gap"]
    back = circle["backward"]
    ellipse = f" forward and {1e3 * back:.4g} mm backward" if back else ""
    meets = "the casing holds them" if circle["touches"] else "they touch nothing"
    of_gap = ""
    if share is not None:
        part = f"{100 * share:.3g} %" if share < 10.0 else f"{share:.3g} times the size"
        of_gap = f", {part} of the gap: {meets}"
    return (
        f"unbalance {in_shown(circle['unbalance'], 'kg m', 4)}, "
        f"{in_shown(circle['force'], 'N', 4)}: the centre"
        f" circles with {1e3 * circle['radius']:.4g} mm{ellipse}"
        f", {math.degrees(circle['lag']):.1f} degrees behind the unbalance; blades "
        f"reach {1e3 * circle['reach']:.4g} mm{of_gap}"
    )


def _limits_and_circle(facts: dict[str, Any]) -> list[str]:
    """Return lines of text on time-step limits, growth of the tips, and unbalance.

    facts : result of `facts_of`
    """
    unit, rotation = DERIVED["time_step_limit"].unit, facts["rotation"]
    circle, growth = rotation["unbalance"], rotation["tip_growth"]
    lines = [
        f"time-step limit of the {body}: {limit:.4g} {unit}"
        for body, limit in facts["time_step_limits"].items()
    ]
    if growth is not None:
        lines.append(
            f"rotation pulls tips out by {in_shown(growth, 'm', 3)}: clearance at "
            f"speed {in_shown(rotation['clearance'], 'm', 4)}"
        )
    lines += growth_told(rotation)
    if weight := rotation["weight"]:
        lines.append(told_sag(weight))
    return [*lines, told_circle(circle)] if circle else lines


def told_sag(weight: dict[str, Any]) -> str:
    """Return a sentence on the sag by the rotor's weight, beside the gap.

    weight : result of `case.unbalance.facts_of_weight`
    """
    share, angle = weight["over_gap"], math.degrees(weight["angle"])
    of_gap = "" if share is None else f", +-{100 * share:.3g} % of the gap"
    return (
        f"weight moves the centre by {1e3 * weight['sag']:.4g} mm at {angle:.1f} "
        f"degrees: a blade's gap changes by {1e3 * weight['change']:.4g} mm in a "
        f"revolution{of_gap}; the same offset and offset_angle of the casing would "
        "make it even"
    )


def folded(modes: list[dict[str, Any]]) -> list[tuple[str, ...]]:
    """Return the rows of the modal table as printed, texts.

    Modes of one family of the rotor that do not move the centre share a row. Columns:
    body, family, nodal diameters, frequencies in Hz, share of strain energy in the
    shaft's springs, clearance consumption.

    Parameters
    ----------
    modes : lines of the modal table as dicts, by frequency
    """
    groups: dict[tuple[Any, ...], list[dict[str, Any]]] = {}
    for number, mode in enumerate(modes):
        alone = mode["body"] != "rotor" or mode["centre_share"] != 0.0
        key = mode["body"], mode["family"], number if alone else None
        groups.setdefault(key, []).append(mode)
    rows: list[tuple[str, ...]] = []
    for (body, family, _), own in groups.items():
        share = own[0]["centre_share"]
        ends = [f"{mode['frequency_hz']:.3f}" for mode in (own[0], own[-1])]
        around = spans_of(sorted(mode["nodal_diameter"] for mode in own))
        told = UNKNOWN if share is None else f"{share:.3f}"
        used = sorted(mode["clearance_consumption"] or 0.0 for mode in own)
        closed = (f"{one:.3f}" for one in (used[0], used[-1]))
        closes = " to ".join(dict.fromkeys(closed)) if body == "rotor" else ""
        hertz = " to ".join(dict.fromkeys(ends))
        rows.append((body, family, around, hertz, told, closes))
    return rows


def spans_of(numbers: list[int]) -> str:
    """Return ascending integers as text, consecutive ones as a range: "0, 2 to 9"."""
    spans: list[list[int]] = []
    for number in numbers:
        if spans and number - spans[-1][1] <= 1:
            spans[-1][1] = number
        else:
            spans.append([number, number])
    return ", ".join(" to ".join(map(str, dict.fromkeys(span))) for span in spans)


def _show(facts: dict[str, Any], up_to: float, scene: Scene) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    console = Console()
    hertz = DERIVED["frequency"].unit
    columns = "nodal diameter", hertz, "centre share", "clearance consumption"
    table = Table("body", "family", *columns)
    shown = [mode for mode in facts["modes"] if mode["frequency_hz"] <= up_to]
    for row in folded(shown):
        table.add_row(*row)
    name = escape(one_line(facts["engine"], SHOWN))
    console.print(f"engine {name}, modes up to {up_to:g} {hertz}", table)
    if facts["rotor_from_file"] is None:
        unit = DERIVED["blade_stiffness"].unit
        console.print(
            f"blade stiffness k_blade = {facts['blade_stiffness']:.4g} {unit}"
        )
    else:
        console.print(facts["rotor_from_file"]["told"], soft_wrap=True, markup=False)
    _show_coincidences(facts["critical_speeds"], scene.nodal_diameter)
    if facts["rotation"]["searched"] is not None:
        _show_waves(facts, 2 * math.pi * up_to)
    for line in _limits_and_circle(facts) + limit_told(facts["rotation"], scene.speed):
        console.print(line, soft_wrap=True, markup=False)
    plan = facts["plan"]
    told = ", ".join(f"{n} of the {body}" for body, n in plan["coordinates"].items())
    console.print(f"coordinates: {told}")
    _show_plan(plan)


def _show_waves(facts: dict[str, Any], fastest: float) -> None:
    """Print two tables: waves that move the shaft, and critical speeds of an unbalance.

    facts : result of `facts_of`, of a rotor with terms of rotation
    fastest : rad/s, highest frequency that is printed
    """
    from rich.console import Console
    from rich.table import Table

    tables = (
        (wave_heads(), wave_rows(facts["lines"], fastest)),
        (critical_heads(), critical_rows(facts["rotation"])),
    )
    for heads, rows in tables:
        table = Table(*heads)
        for row in rows:
            table.add_row(*row)
        if rows:
            Console().print(table)


def _show_coincidences(rows: list[dict[str, Any]], lobes: int) -> None:
    """Print the critical speeds of Eq. 13 as a table, if there are any.

    rows, lobes : result of `critical_of`; number k of the pulse's lobes
    """
    from rich.console import Console
    from rich.table import Table

    if not rows:
        return
    speed, factor = shown_in(ANGULAR)
    heading = f"critical speed (Eq. 13), {speed}: up to {factor * SHOWN_SPEED:.4g}"
    heading += f", all of the load's k = {lobes}"
    table = Table("nodal diameter", "family", "order", heading)
    for row in rows:
        if row["speed"] > SHOWN_SPEED and row["nodal_diameter"] != lobes:
            continue
        cells = (row[n] for n in ("nodal_diameter", "family", "order"))
        table.add_row(*map(str, cells), f"{factor * row['speed']:.1f}")
    console = Console()
    console.print(table)
    console.print(
        "order n: waves of rotor and casing meet at n times the casing's frequency, "
        "(ω_rotor + n ω_casing) / k; --orders 1 lists the first alone", soft_wrap=True
    )  # fmt: skip
