"""`hpcwhirl run`: integrate one case; print its summary, write traces and figures."""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hpcwhirl.cli import options
from hpcwhirl.cli.command import add_option
from hpcwhirl.errors import InputError
from hpcwhirl.scene.units import (
    ANGULAR,
    Quantity,
    in_shown,
    showing,
    shown_in,
    with_unit,
)

if TYPE_CHECKING:
    from hpcwhirl.campaign.plan.design import Design
    from hpcwhirl.campaign.simulate import Course, Result
    from hpcwhirl.dynamics.march import March
    from hpcwhirl.scene import Scene

LEDGER = "ledger_"
FED, SPENT = ("pulse", "friction", "rotation"), ("damping", "impact", "wear")
BALANCE = {
    **{term: f"energy in: {term}" for term in FED},
    **{term: f"energy out: {term}" for term in SPENT},
    "energy": "energy at the end",
    "residual": "energy at the end + out - in",
}


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `hpcwhirl run` on its parser."""
    # fmt: off
    options.add_scene(parser)
    add_option(parser, "--out FILE.h5",
        "write the results and traces of the case, in the format of results.h5",
        type=Path)
    add_option(parser, "--plot DIR", "draw orbit and traces into DIR", type=Path)
    options.add_explain(parser)
    add_option(parser, "--quiet", "show no progress")
    options.add_units(parser, "the summary")


def run(args: argparse.Namespace) -> int:
    """Integrate one case, print its summary, write file and figures that are asked for.

    Returns the exit code, 1 if the run was unstable
    """
    from hpcwhirl.analysis.over_speed import crossings
    from hpcwhirl.campaign.plan.design import Design
    from hpcwhirl.campaign.simulate import course_of, notes_on
    from hpcwhirl.case.speed import changes

    asked = options.asked_units(args.units)
    scene = options.scene_of(args.scene, args.settings)
    _check_outputs(args, scene)
    options.tell_preset(scene)
    design = Design.one(scene)
    course = course_of(scene)
    options.tell_remarks(scene, load=True)
    _tell_unequal(course.march, quiet=args.quiet)
    with _progress(course, quiet=args.quiet) as tick:
        result = course.run(tick)
    facts = summary(result.row | result.performance)
    if changes(scene):
        facts["crossings"] = crossings(course.march.case)
    if args.explain:
        facts |= _explained(course.march, result.row)
    try:
        _write(args, design, result)
    finally:  # files first, then the summary: each even if the other fails
        with showing(asked):
            (options.print_json if args.json else _show)(facts)
    for note in notes_on(scene, result.row):
        print(note, file=sys.stderr)
    return 1 if result.row["outcome"] == "unstable" else 0


def _check_outputs(args: argparse.Namespace, scene: Scene) -> None:
    if scene.output.traces in {"summary", "blades"} and args.plot:
        msg = f"--plot needs traces = orbit or full, got {scene.output.traces}"
        raise InputError(msg)
    options.check_writable(args.out, folder=False)
    options.check_writable(args.plot, folder=True)


def _write(args: argparse.Namespace, design: Design, result: Result) -> None:
    """Write the results file of --out and the figures of --plot, where given.

    design, result : the case as a campaign of one; result of its integration
    """
    from hpcwhirl.campaign.finalize import write_case

    if args.out:
        write_case(args.out, design, result)
    if args.plot:
        from hpcwhirl.report.figures.motions import draw_case

        for path in draw_case(args.plot, result.traces, result.row):
            print(f"figure: {path}", file=sys.stderr)


def _tell_unequal(march: March, *, quiet: bool) -> None:
    """Print on stderr that a rotor from file has unequal sectors, which takes longer.

    march, quiet : integration of the case; whether nothing is printed
    """
    from hpcwhirl.case.explain import facts_of_file

    if march.case.given.engine.file and not (quiet or march.model.rotor.cyclic):
        print(facts_of_file(march.model.rotor)["told"], file=sys.stderr)


def _explained(march: March, row: Mapping[str, Any]) -> dict[str, Any]:
    """Return what `run --explain` tells of the work that was left out, by name.

    row : results of the case by name

    Returns
    -------
    left_out : dicts of what was left out, why, and what that saves
    bounds : dicts of the bounds by which, and what the run made of them
    marched : number of steps that were integrated
    work_share : amplitudes times steps integrated, divided by those of the whole model
    """
    from hpcwhirl.case.explain import amplitudes, facts_of_bounds, notes_of

    few, many = amplitudes(march.lean.model), amplitudes(march.model)
    share = few * march.marched / (many * march.total)
    return {
        "left_out": notes_of(march.case),
        "bounds": facts_of_bounds(march.case, row),
        "marched": march.marched,
        "work_share": share,
    }


def summary(row: dict[str, Any]) -> dict[str, Any]:
    """Return a case's results as printed: terms of the ledger are in entry `ledger`.

    row : results of the case by name
    """
    facts = {n: v for n, v in row.items() if not (n.startswith(LEDGER))}
    facts["ledger_error"] = row["ledger_error"]
    terms = {n.removeprefix(LEDGER): v for n, v in row.items() if n.startswith(LEDGER)}
    terms.pop("error", None)
    return facts | {"ledger": terms}


@contextmanager
def _progress(course: Course, *, quiet: bool) -> Iterator[Callable[[], None]]:
    if quiet or not sys.stderr.isatty():
        yield (lambda: None) if quiet else _plain(course)
        return
    from rich.console import Console
    from rich.progress import Progress, TimeElapsedColumn

    columns = (*Progress.get_default_columns(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task("integrating", total=course.march.total)
        yield lambda: bar.update(
            task, completed=course.march.steps, total=course.march.total
        )


def _plain(course: Course) -> Callable[[], None]:
    start = time.monotonic()

    def tick() -> None:
        march, spent = course.march, time.monotonic() - start
        left = spent * (march.total - march.steps) / max(march.steps, 1)
        share = 100 * march.steps / march.total
        print(f"integrating: {share:.0f} %, {left:.0f} s left", file=sys.stderr)

    return options.seldom(tick, start)


def motion_told(facts: Mapping[str, Any]) -> str:
    """Return a line of text on whether a motion is periodic or chaotic.

    It also tells the Lyapunov exponent.

    facts : results of a case with `output.chaos` > 0, by name
    """
    if "exponent" not in facts:
        return f"motion {facts['motion']}: exponent, period and K were not measured"
    turn = 2 * math.pi / abs(facts["speed"])
    rate, error = facts["exponent"], facts["exponent_error"]
    told = facts["motion"]
    if told == "periodic":
        told += f", {facts['period']} revolutions"
    return (
        f"motion {told}; exponent {rate:.4g} ± {error:.2g} 1/s, {rate * turn:.3g} "
        f"± {error * turn:.2g} a revolution; K {facts.get('zero_one', math.nan):.2f}"
    )


def _row(told: Quantity, name: str, value: float) -> tuple[str, str]:
    """Return name with unit, and value, of a quantity in the unit that is shown."""
    unit, factor = shown_in(told.unit)
    return with_unit(name, unit), f"{factor * value:.6g}"


def over_speed_told(facts: Mapping[str, Any]) -> list[str]:
    """Return lines of text on the words of a run whose speed or gap changes.

    They list the intervals of time with one word, and the critical speeds crossed.

    facts : results of the case by name
    """
    from hpcwhirl.analysis.over_speed import speeds_told, spells_of

    lines = [
        f"{one.begin:.4g} to {one.end:.4g} s, {speeds_told(one, ' to ')}: "
        f"{one.regime}, whirl {one.whirl}"
        for one in spells_of(facts.get("words_over_speed", ""))
    ]
    lines += [
        f"critical speed {in_shown(one['speed'], ANGULAR)} of {one['of']}, crossed at "
        f"{one['time']:.4g} s"
        for one in facts.get("crossings", ())
    ]
    return [*lines, ""] if lines else []


def _show(facts: dict[str, Any]) -> None:
    from rich.console import Console
    from rich.table import Table

    from hpcwhirl.scene.quantities import ROW, WORN

    console = Console()
    words = f"outcome {facts['outcome']}, regime {facts['regime']}, "
    console.print(words + f"whirl {facts['whirl']}")
    if "motion" in facts:
        console.print(motion_told(facts))
    if not facts["contacts"]:
        console.print(options.UNTOUCHED)
    rate = 1e6 / facts["microseconds_per_step"]
    console.print(
        f"{facts['steps']} steps in {facts['seconds']:.2f} s, "
        f"{rate:,.0f} steps a second"
    )
    console.print(*over_speed_told(facts), sep="\n", end="", highlight=False)
    table = Table("quantity", "value")
    for name in (
        "speed", "nodal_diameter", "gap", "friction", "time_step", "contacts",
        "contact_impulse", "last_contact", "orbit_radius", "centre_peak",
        "growth_rate", "growth_error", "whirl_ratio", "line_frequency",
    ):  # fmt: skip
        table.add_row(*_row(ROW[name], name, facts[name]))
    if facts["tip_growth"] > 0.0:
        table.add_row(*_row(ROW["tip_growth"], "tip_growth", facts["tip_growth"]))
    for term, value in facts["ledger"].items():
        told = (ROW | WORN)[f"{LEDGER}{term}"]
        table.add_row(*_row(told, BALANCE[term], value))
    console.print(table)
    taken = [term for term in FED if facts["ledger"][term] < 0]
    if taken:
        console.print(f"{' and '.join(taken)} took energy out: negative entries")
    if "left_out" in facts:
        options.print_notes(facts["left_out"])
        options.print_bounds(facts["bounds"])
        print(
            f"saved: {facts['marched']} steps were integrated, "
            f"{facts['work_share']:.1%} of the whole model's amplitudes times steps"
        )
