"""`hpcwhirl tradeoff`: measure error and cost of solver inputs on this machine."""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hpcwhirl import __version__
from hpcwhirl.cli import options
from hpcwhirl.cli.command import add_option
from hpcwhirl.errors import InputError, number_told
from hpcwhirl.scene import (
    NAMED,
    Scene,
    apply_settings,
    load_document,
)

if TYPE_CHECKING:
    from hpcwhirl.benchmark.tradeoff import Row, Tradeoff
    from hpcwhirl.benchmark.wish import Wish

NOT_OFFERED = (
    "single precision is not offered, and contact has no tolerance: "
    "non-penetration is solved to round-off"
)
Tell = Callable[[str], None]


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `hpcwhirl tradeoff` on its parser."""
    # fmt: off
    from hpcwhirl.benchmark.trials import axes
    from hpcwhirl.benchmark.wish import NAMES, WORDS

    parser.add_argument(
        "scenes", nargs="*", metavar="FILE",
        help="campaign files, of which cases are drawn in proportion to their words; "
        f"scene files; or some of {', '.join(NAMED)} (default: one motion of each "
        "kind)",
    )
    options.add_set(parser)
    add_option(parser, "--cases N",
        "cases to draw from each campaign (default 12); four times as many are "
        "computed by the fastest preset beforehand, for their words", default=12)
    add_option(parser, "--for 'NAME SHARE'",
        "print the cheapest setting whose error is below SHARE, such as '1 %%', in "
        f"nine cases of ten; may be repeated: {', '.join(NAMES)}; {WORDS} with the "
        "least share that keeps its word", default=[], dest="wishes")
    add_option(parser, "--apply",
        "write what --for finds to [solver] of the campaign's file")
    add_option(parser, "--axis NAME",
        "vary only this aspect of the computation; may be repeated: "
        f"{', '.join(axes())} (default for a campaign: preset and together; else all "
        "but the last two, which are slow)",
        default=[], dest="axes")
    add_option(parser, "--repeats N",
        "rounds in which each setting is timed, with steps shorter by 3 %% each "
        "(default 3)", default=3)
    add_option(parser, "--out DIR",
        "write tradeoff.json and tradeoff.md to DIR; both name the machine", type=Path)
    add_option(parser, "--plot",
        "also draw tradeoff.png, in --out or the working directory")
    options.add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Measure cost and error of solver settings; print a table, write the files.

    Returns the exit code, 1 where no setting meets what --for asks
    """
    from hpcwhirl.benchmark.tradeoff import measure
    from hpcwhirl.benchmark.trials import settings_of
    from hpcwhirl.benchmark.wish import wish_of

    wishes = [wish_of(text) for text in args.wishes]
    _check(args, wishes)
    settings = settings_of(args.axes or _usual_axes(args.scenes))
    start, tell = time.monotonic(), _teller()
    scenes = _scenes(args, tell)
    found = measure(scenes, settings, args.repeats, tell)
    facts = found.facts() | _about(args, time.monotonic() - start)
    advice = _advice(args, found, wishes) if wishes else {}
    _show(args, facts | ({"advice": advice} if advice else {}))
    return 0 if not advice or advice["options"] is not None else 1


def _check(args: argparse.Namespace, wishes: list[Wish]) -> None:
    if args.repeats < 2:
        msg = f"--repeats must be >= 2, for the scatter of twins, got {args.repeats}"
        raise InputError(msg)
    if args.cases < 1:
        raise InputError(f"--cases must be >= 1, got {args.cases}")
    options.check_writable(args.out or Path(), folder=True)
    if not args.apply:
        return
    if not wishes or len(args.scenes) != 1 or not is_campaign(args.scenes[0]):
        msg = "--apply needs --for, and the file of one campaign to write to, got "
        raise InputError(msg + (", ".join(args.scenes) or "none"))
    options.check_writable(Path(args.scenes[0]), folder=False)


def _teller() -> Tell:
    start = time.monotonic()

    def tell(line: str) -> None:
        spent = f"{time.monotonic() - start:.0f} s"
        print(f"tradeoff: {spent}, {line}", file=sys.stderr)

    return options.seldom(tell)


def is_campaign(name: str) -> bool:
    """Return whether a name is that of a file with tables of a campaign's design."""
    path = Path(name)
    if path.suffix != ".toml":
        return False
    return not {"sweep", "zip", "cases", "sample"}.isdisjoint(load_document(path))


def _usual_axes(names: list[str]) -> tuple[str, ...]:
    from hpcwhirl.benchmark.trials import BOTH, PRESET

    return (PRESET, BOTH) if any(map(is_campaign, names)) else ()


def _scenes(args: argparse.Namespace, tell: Tell) -> dict[str, Scene]:
    """Return the cases to compare, {name: scene}: of campaigns some that are drawn."""
    from hpcwhirl.benchmark.trials import default_scenes

    given = options.parsed(args.settings)
    if not args.scenes:
        kinds = default_scenes(Scene())
        return {name: apply_settings(scene, given) for name, scene in kinds.items()}
    if len(set(args.scenes)) < len(args.scenes):
        raise InputError(f"a scene is named twice: {' '.join(args.scenes)}")
    out: dict[str, Scene] = {}
    for name in args.scenes:
        if is_campaign(name):
            drawn = _drawn(Path(name), args.cases, given, tell)
            several = len(args.scenes) > 1
            out |= {f"{name}: {n}" if several else n: s for n, s in drawn.items()}
        else:
            out[name] = options.scene_of(name, args.settings)
    return out


def _drawn(
    path: Path, count: int, given: Mapping[str, Any], tell: Tell
) -> dict[str, Scene]:
    from hpcwhirl.benchmark.drawing import drawn_cases
    from hpcwhirl.campaign.plan.design import load_design

    return drawn_cases(load_design(path, given), count, tell)


def _about(args: argparse.Namespace, elapsed: float) -> dict[str, Any]:
    from hpcwhirl.cluster.facts import machine_facts

    machine = machine_facts()
    return {
        "machine": f"{machine['host']}, {machine['cpu']}",
        "version": __version__,
        "repeats": args.repeats,
        "elapsed": elapsed,
        "not_offered": NOT_OFFERED,
    }


def _advice(
    args: argparse.Namespace, found: Tradeoff, wishes: list[Wish]
) -> dict[str, Any]:
    """Return what meets the wishes at the least cost, after writing it for --apply."""
    from hpcwhirl.benchmark.applied import write_setting
    from hpcwhirl.benchmark.wish import cheapest

    row = cheapest(found, wishes)
    if row is None:
        return {"options": None, "text": _missed(found, wishes)}
    if args.apply and row.inputs:
        write_setting(Path(args.scenes[0]), row)
    return {
        "options": row.options,
        "cost": row.cost,
        "text": _met(args, found, row, wishes),
    }


def _asked(found: Tradeoff, wishes: list[Wish], row: Row) -> str:
    from hpcwhirl.report.figures.pareto import percent

    return ", ".join(
        f"{w.name} {percent(w.error(row, found.cases))} (asked {percent(w.most)})"
        for w in wishes
    )


def _met(
    args: argparse.Namespace, found: Tradeoff, row: Row, wishes: list[Wish]
) -> str:
    files = [name for name in args.scenes if is_campaign(name)]
    kind = "campaign" if files else "run"
    typed = " ".join(["hpcwhirl", kind, *(files or args.scenes)[:1], row.options])
    if args.apply:
        typed = f"hpcwhirl campaign {args.scenes[0]}   # [solver] of it was written"
    cost = f"{row.cost:.3g} times the cost of the file as it is"
    asked = _asked(found, wishes, row)
    return f"cheapest that meets it, {cost}: {asked}\n    {typed.strip()}"


def _missed(found: Tradeoff, wishes: list[Wish]) -> str:
    from hpcwhirl.benchmark.wish import nearest_to

    row = nearest_to(found, wishes)
    return (
        "no setting that was tried meets it, or too few cases can tell; nearest: "
        f"{row.label}: {_asked(found, wishes, row)}"
    )


def _show(args: argparse.Namespace, facts: dict[str, Any]) -> None:
    """Write the files of --out and --plot, then print: each even if the other fails."""
    from hpcwhirl.report.figures.pareto import markdown

    text = _heading(facts) + markdown(facts)
    if "advice" in facts:
        text += "\n" + facts["advice"]["text"] + "\n"
    try:
        _write(args, facts, text)
    finally:
        if args.json:
            options.print_json(options.finite(facts))
        else:
            print(text)


def _write(args: argparse.Namespace, facts: dict[str, Any], text: str) -> None:
    """Write the files of --out and the figure of --plot, where given.

    facts, text : measured numbers as data for JSON; table that was printed
    """
    from hpcwhirl.report.figures.pareto import draw_tradeoff
    from hpcwhirl.store.atomic import write_whole

    folder = args.out or Path()
    if args.out:
        plain = json.dumps(options.finite(facts), indent=1) + "\n"
        write_whole(folder / "tradeoff.json", plain.encode())
        write_whole(folder / "tradeoff.md", text.encode())
    if args.plot:
        print(draw_tradeoff(facts, folder / "tradeoff.png"), file=sys.stderr)


def _heading(facts: dict[str, Any]) -> str:
    from hpcwhirl.report.figures.pareto import COLUMNS

    who = f"{facts['machine']}; hpcwhirl {facts['version']}"
    rounds = number_told(facts["repeats"], "round")
    lines = [f"{who}; {rounds}; {facts['elapsed']:.0f} s", ""]
    reference = ", ".join(f"{n} {v}" for n, v in facts["reference"].items())
    lines.append(f"Reference, at least: {reference}; its words:")
    for name, case in facts["cases"].items():
        distinct = ", ".join(dict.fromkeys(case["words"]))
        unsure = "; ".join([COLUMNS[n] for n in case["sensitive"]])
        kind = f"; not sure: {unsure}" if unsure else ""
        lines.append(f"- {name}: {distinct}{kind} ({case['seconds']:.1f} s a twin)")
    return "\n".join([*lines, "", facts["not_offered"] + ".", "", ""])
