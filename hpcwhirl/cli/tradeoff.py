"""`hpcwhirl tradeoff`: measure error and cost of solver inputs on this machine."""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hpcwhirl import __version__
from hpcwhirl.cli import options
from hpcwhirl.cli.command import add_option
from hpcwhirl.errors import InputError, number_told
from hpcwhirl.scene import NAMED, Scene, apply_settings
from hpcwhirl.scene.documents import naming_lines

if TYPE_CHECKING:
    from hpcwhirl.benchmark.tradeoff import Measurement, Row, Tradeoff
    from hpcwhirl.benchmark.trials import Setting
    from hpcwhirl.benchmark.wish import Wish
    from hpcwhirl.campaign.plan.design import Design

NOT_OFFERED = (
    "single precision is not offered, and contact has no tolerance: "
    "non-penetration is solved to round-off"
)
Tell = Callable[[str], None]
# tables of a campaign's design
DRAWN = 24  # cases of a campaign, unless given
SOUGHT = 48  # with --for: of 24, one that misses a wish would leave no setting sure
DESIGNED = {"sweep", "zip", "cases", "sample"}


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `hpcwhirl tradeoff` on its parser."""
    # fmt: off
    from hpcwhirl.benchmark.trials import axes
    from hpcwhirl.benchmark.wish import BATCH, NAMES, WORDS

    parser.add_argument(
        "scenes", nargs="*", metavar="FILE",
        help="campaign files, of which cases are drawn in proportion to their words; "
        f"scene files; or some of {', '.join(NAMED)} (default: one motion of each "
        "kind)",
    )
    options.add_set(parser)
    add_option(parser, "--cases N",
        f"cases to draw from each campaign (default {DRAWN}), with --for at most "
        f"(default {SOUGHT}); four times as many are computed by the fastest preset, "
        "for their words", type=int)
    add_option(parser, "--for 'NAME SHARE'",
        "print the cheapest setting that is sure to have an error below SHARE, such as "
        f"'1 %%', in nine cases of ten, from {BATCH} cases at a time until no further "
        f"ones could change it; may be repeated: {', '.join(NAMES)}; {WORDS} with the "
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


@dataclass(frozen=True)
class Source:
    """What the command line names: a file, which is read once, or a built-in scene.

    Attributes
    ----------
    name : path of the file, or name of the scene
    document : parsed TOML of the file; None of a built-in scene
    """

    name: str
    document: dict[str, Any] | None

    @property
    def is_campaign(self) -> bool:
        """Whether it is a file with tables of a campaign's design."""
        return not DESIGNED.isdisjoint(self.document or {})

    def scenes(
        self, args: argparse.Namespace, tell: Tell
    ) -> tuple[dict[str, Scene], int]:
        """Return its cases, {name: scene}, and of how many they were drawn."""
        path = Path(self.name)
        if self.document is None:
            return {self.name: options.scene_of(self.name, args.settings)}, 1
        if not self.is_campaign:
            scene = options.scene_in(path, self.document, args.settings)
            return {self.name: scene}, 1
        given = options.parsed(args.settings)
        with naming_lines(path, given):
            design = _design_of(self.document, given, path.parent)
        count = args.cases or (SOUGHT if args.wishes else DRAWN)
        return _drawn(design, count, tell), len(design.settings)


def run(args: argparse.Namespace) -> int:
    """Measure cost and error of solver settings; print a table, write the files.

    Returns the exit code, 1 where no setting meets what --for asks
    """
    from hpcwhirl.benchmark.trials import settings_of
    from hpcwhirl.benchmark.wish import wish_of

    wishes = [wish_of(text) for text in args.wishes]
    _check(args)
    sources = _sources(args.scenes)
    if args.apply:
        _check_apply(sources, wishes)
    settings = settings_of(args.axes or _usual_axes(sources))
    start, tell = time.monotonic(), _teller()
    scenes, total = _scenes(args, sources, tell)
    measurement = _measurement(settings, args.repeats, total, tell)
    found = _measured(measurement, scenes, wishes)
    facts = found.facts() | _about(args, time.monotonic() - start)
    advice = _advice(args, sources, found, wishes) if wishes else {}
    _show(args, facts | ({"advice": advice} if advice else {}))
    return 0 if not advice or advice["options"] is not None else 1


def _check(args: argparse.Namespace) -> None:
    if args.repeats < 2:
        msg = f"--repeats must be >= 2, for the scatter of twins, got {args.repeats}"
        raise InputError(msg)
    if args.cases is not None and args.cases < 1:
        raise InputError(f"--cases must be >= 1, got {args.cases}")
    options.check_writable(args.out or Path(), folder=True)


def _check_apply(sources: list[Source], wishes: list[Wish]) -> None:
    if not wishes or len(sources) != 1 or not sources[0].is_campaign:
        msg = "--apply needs --for, and the file of one campaign to write to, got "
        raise InputError(msg + (", ".join(one.name for one in sources) or "none"))
    options.check_writable(Path(sources[0].name), folder=False)


def _sources(names: list[str]) -> list[Source]:
    """Return what the command line names; each file is read here, and nowhere else."""
    if len(set(names)) < len(names):
        raise InputError(f"a scene is named twice: {' '.join(names)}")
    return [Source(name, options.document_of(name)) for name in names]


def _teller() -> Tell:
    start = time.monotonic()

    def tell(line: str) -> None:
        spent = f"{time.monotonic() - start:.0f} s"
        print(f"tradeoff: {spent}, {line}", file=sys.stderr)

    return options.seldom(tell)


def _usual_axes(sources: list[Source]) -> tuple[str, ...]:
    from hpcwhirl.benchmark.trials import BOTH, PRESET

    return (PRESET, BOTH) if any(one.is_campaign for one in sources) else ()


def _scenes(
    args: argparse.Namespace, sources: list[Source], tell: Tell
) -> tuple[dict[str, Scene], int]:
    """Return the cases to compare, {name: scene}, and of how many they were drawn."""
    from hpcwhirl.benchmark.trials import default_scenes

    if not sources:
        given = options.parsed(args.settings)
        kinds = default_scenes(Scene())
        out = {name: apply_settings(scene, given) for name, scene in kinds.items()}
        return out, len(out)
    out, total = dict[str, Scene](), 0
    for one in sources:
        scenes, of = one.scenes(args, tell)
        total += of
        several = one.is_campaign and len(sources) > 1
        out |= {f"{one.name}: {n}" if several else n: s for n, s in scenes.items()}
    return out, total


def _design_of(
    document: Mapping[str, Any], given: Mapping[str, Any], folder: Path
) -> Design:
    from hpcwhirl.campaign.plan.design import design_of

    return design_of(document, given, folder)


def _drawn(design: Design, count: int, tell: Tell) -> dict[str, Scene]:
    from hpcwhirl.benchmark.drawing import drawn_cases

    return drawn_cases(design, count, tell)


def _measurement(
    settings: list[Setting], repeats: int, total: int, tell: Tell
) -> Measurement:
    from hpcwhirl.benchmark.tradeoff import Measurement

    return Measurement(settings, repeats, total, tell)


def _measured(
    measurement: Measurement, scenes: dict[str, Scene], wishes: list[Wish]
) -> Tradeoff:
    """Return what was measured of all cases, with wishes of as many as settle them."""
    from hpcwhirl.benchmark.wish import search

    if not wishes:
        return measurement.add(scenes).found()
    return search(measurement, scenes, wishes)


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
    args: argparse.Namespace,
    sources: list[Source],
    found: Tradeoff,
    wishes: list[Wish],
) -> dict[str, Any]:
    """Return what meets the wishes at the least cost, after writing it for --apply."""
    from hpcwhirl.benchmark.applied import write_setting
    from hpcwhirl.benchmark.wish import cheapest

    row = cheapest(found, wishes)
    if row is None:
        return {"options": None, "text": _missed(found, wishes)}
    if args.apply and row.inputs:
        write_setting(Path(sources[0].name), row, sources[0].document or {})
    return {
        "options": row.options,
        "cost": row.cost,
        "text": _met(args, sources, found, (row, wishes)),
    }


def _asked(found: Tradeoff, wishes: list[Wish], row: Row) -> str:
    from hpcwhirl.report.figures.pareto import percent

    parts = []
    for wish in wishes:
        support = wish.support(row, found)
        error = percent(wish.error(row, found.cases))
        parts.append(
            f"{wish.name} {error} (asked {percent(wish.most)}), met in {support.met} "
            f"of {support.of} cases: in {percent(support.level)} of the {support.all} "
            f"that can be judged with {percent(support.confidence)} confidence"
        )
    return "; ".join(parts)


def _met(
    args: argparse.Namespace,
    sources: list[Source],
    found: Tradeoff,
    chosen: tuple[Row, list[Wish]],
) -> str:
    row, wishes = chosen
    files = [one.name for one in sources if one.is_campaign]
    kind = "campaign" if files else "run"
    typed = " ".join(["hpcwhirl", kind, *(files or args.scenes)[:1], row.options])
    if args.apply:
        typed = f"hpcwhirl campaign {files[0]}   # [solver] of it was written"
    cost = f"{row.cost:.3g} times the cost of the file as it is"
    asked = _asked(found, wishes, row)
    return f"cheapest that is sure to meet it, {cost}: {asked}\n    {typed.strip()}"


def _missed(found: Tradeoff, wishes: list[Wish]) -> str:
    from hpcwhirl.benchmark.wish import fewest, nearest_to

    row = nearest_to(found, wishes)
    least = max(fewest(wish.level, found.total) for wish in wishes)
    return (
        "no setting that was tried is sure to meet it, which takes at least "
        f"{number_told(least, 'case')} that can be judged and meet it (--cases); "
        f"nearest: {row.label}: {_asked(found, wishes, row)}"
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
