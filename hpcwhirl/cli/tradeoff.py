"""`hpcwhirl tradeoff`: measure error and cost of solver inputs on this machine."""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path
from typing import Any

from hpcwhirl import __version__
from hpcwhirl.cli import options
from hpcwhirl.cli.command import add_option
from hpcwhirl.errors import InputError, number_told
from hpcwhirl.scene import NAMED, Scene, apply_settings

NOT_OFFERED = (
    "single precision is not offered, and contact has no tolerance: "
    "non-penetration is solved to round-off"
)


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `hpcwhirl tradeoff` on its parser."""
    # fmt: off
    from hpcwhirl.benchmark.tradeoff import axes

    parser.add_argument(
        "scenes", nargs="*", metavar="SCENE",
        help=f"scene files (TOML), or some of {', '.join(NAMED)} (default: one motion "
        "of each kind)",
    )
    options.add_set(parser)
    add_option(parser, "--axis NAME",
        "vary only this aspect of the computation; may be repeated: "
        f"{', '.join(axes())} (default: all but the last two, which are slow)",
        default=[], dest="axes")
    add_option(parser, "--repeats N",
        "timed runs of each setting, with forces that differ by 1e-7 (default 3)",
        default=3)
    add_option(parser, "--out DIR",
        "write tradeoff.json and tradeoff.md to DIR; both name the machine", type=Path)
    add_option(parser, "--plot",
        "also draw tradeoff.png, in --out or the working directory")
    options.add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Measure cost and error of solver settings; print a table, write the files.

    Returns the exit code
    """
    from hpcwhirl.benchmark.tradeoff import measure, settings_of
    from hpcwhirl.cluster.facts import machine_facts
    from hpcwhirl.report.figures.pareto import markdown

    if args.repeats < 2:
        msg = f"--repeats must be >= 2, for the scatter of repeats, got {args.repeats}"
        raise InputError(msg)
    settings, scenes = settings_of(args.axes), _scenes(args)
    options.check_writable(args.out or Path(), folder=True)
    start, machine = time.monotonic(), machine_facts()

    def tell(line: str) -> None:
        every = number_told(len(scenes), "scene")
        spent = f"{time.monotonic() - start:.0f} s"
        print(f"tradeoff: {spent}, {line} (of {every})", file=sys.stderr)

    facts = measure(scenes, settings, args.repeats, options.seldom(tell)).facts()
    facts |= {
        "machine": f"{machine['host']}, {machine['cpu']}",
        "version": __version__,
        "repeats": args.repeats,
        "elapsed": time.monotonic() - start,
        "not_offered": NOT_OFFERED,
    }
    text = _heading(facts) + markdown(facts)
    try:
        _write(args, facts, text)
    finally:  # files first, then the table: each even if the other fails
        if args.json:
            options.print_json(facts)
        else:
            print(text)
    return 0


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


def _scenes(args: argparse.Namespace) -> dict[str, Scene]:
    from hpcwhirl.benchmark.tradeoff import default_scenes

    if not args.scenes:
        kinds = default_scenes(Scene())
        given = options.parsed(args.settings)
        return {name: apply_settings(scene, given) for name, scene in kinds.items()}
    scenes = {name: options.scene_of(name, args.settings) for name in args.scenes}
    if len(scenes) < len(args.scenes):
        raise InputError(f"a scene is named twice: {' '.join(args.scenes)}")
    return scenes


def _heading(facts: dict[str, Any]) -> str:
    who = f"{facts['machine']}; hpcwhirl {facts['version']}"
    lines = [f"{who}; {facts['repeats']} repeats; {facts['elapsed']:.0f} s", ""]
    reference = ", ".join(f"{n} {v}" for n, v in facts["reference"].items())
    lines.append(f"Reference, at least: {reference}; words of its twins:")
    for name, words in facts["words"].items():
        distinct = ", ".join(dict.fromkeys(words))
        seconds = facts["reference_seconds"][name]
        lines.append(f"- {name}: {distinct} ({seconds:.1f} s a twin)")
    return "\n".join([*lines, "", facts["not_offered"] + ".", "", ""])
