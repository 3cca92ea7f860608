"""`hpcwhirl edge`: follow the motion between two words, from two pulses."""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hpcwhirl.cli.options import (
    add_scene,
    add_units,
    asked_units,
    check_writable,
    print_json,
    scene_of,
    tell_preset,
)
from hpcwhirl.errors import InputError

if TYPE_CHECKING:
    from hpcwhirl.campaign.edge import Edge
    from hpcwhirl.scene import Scene

EVERY = 5.0  # s between lines on the progress
TIMES = {"span": 1.0, "look": 1.0}
NEAR = {"near": 1e-6, "far": 1e-3}
UNITS = {
    "begin": "s", "end": "s", "orbit_radius": "m", "turning_rate": "rad/s",
    "line_frequency": "rad/s", "leaving_rate": "1/s",
}  # fmt: skip


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_scene(parser)
    for side, word in (("low", "weaker"), ("high", "stronger")):
        parser.add_argument(
            f"--{side}", metavar="FORCE",
            help=f"force of the {word} pulse, N or with a unit; of the directory of a "
            "campaign swept over force, the bracket of its first change is the default",
        )  # fmt: skip
    parser.add_argument(
        "--at", action="append", default=[], metavar="NAME=V",
        help="of a campaign: the values of its other swept inputs",
    )  # fmt: skip
    helps = {
        "span": "how long the edge is followed, s",
        "look": "time after which a motion's word is judged, s; up to 3 times as long",
        "near": "relative distance down to which states are bisected",
        "far": "relative distance from which they are bisected again",
    }
    for name, value in (TIMES | NEAR).items():
        parser.add_argument(
            f"--{name}", type=float, default=value, metavar="X",
            help=f"{helps[name]} (default {value:g})",
        )  # fmt: skip
    parser.add_argument(
        "--plot", type=Path, metavar="FILE.png", help="draw radius and orbit of it"
    )
    add_units(parser, "numbers")
    parser.add_argument("--quiet", action="store_true", help="show no progress")


def run(args: argparse.Namespace) -> int:
    """Follow the edge, print its numbers, draw it if asked to."""
    from hpcwhirl.campaign.edge import Tracking, edge
    from hpcwhirl.scene.units import showing

    if args.plot and args.plot.suffix not in {".png", ".svg", ".pdf"}:
        msg = f"--plot must end in .png, .svg or .pdf, got '{args.plot.name}'"
        raise InputError(msg)
    check_writable(args.plot, folder=False)
    scene, low, high = _asked(args)
    tell_preset(scene)
    how = Tracking(**{name: getattr(args, name) for name in TIMES | NEAR})
    found = edge(scene, low, high, how, _teller(quiet=args.quiet))
    facts = {"low": low, "high": high, "word_low": found.low.word,
             "word_high": found.high.word} | found.numbers  # fmt: skip
    with showing(asked_units(args.units)):
        print_json(facts) if args.json else _show(facts)
        if args.plot:
            _plot(args.plot, scene, found)
    return 0


def _asked(args: argparse.Namespace) -> tuple[Scene, float, float]:
    """Return the scene and the forces of both pulses, N."""
    from hpcwhirl.store.reading.select import number_of

    given = {side: number_of(text, "force", f"--{side}")
             for side in ("low", "high") if (text := getattr(args, side))}  # fmt: skip
    if Path(args.scene).is_dir():
        if args.settings:
            msg = "--set and --preset change a scene, not a campaign: use --at"
            raise InputError(msg)
        scene, found = _of_campaign(Path(args.scene), args.at)
        given = found | given
    else:
        if args.at:
            msg = "--at chooses among the cases of a campaign: use --set for a scene"
            raise InputError(msg)
        scene = scene_of(args.scene, args.settings)
    if len(given) < 2:
        msg = (
            "an edge needs two pulses of different words: give --low and --high, such "
            f"as --low {scene.force / 2000:g}kN --high {scene.force / 1000:g}kN"
        )
        raise InputError(msg)
    return scene, given["low"], given["high"]


def _of_campaign(folder: Path, at: list[str]) -> tuple[Scene, dict[str, float]]:
    """Return the scene of one line of a campaign over force, and its first change."""
    import numpy as np

    from hpcwhirl.analysis.first_changes import first_changes
    from hpcwhirl.store.reading.reader import open_results
    from hpcwhirl.store.reading.results_file import Results, results_of
    from hpcwhirl.store.reading.select import swept_of, where

    place = results_of(folder)
    with open_results(place) as data:
        swept = {n: data[n].to_numpy() for n in swept_of(data)}
        mask = where(at, swept)
        cases = np.arange(data.sizes["case"]) if mask is None else np.flatnonzero(mask)
        found = first_changes(data.isel(case=cases), "force")
        if len(found) > 1:
            names = " or ".join(f"--at {n}=..." for n in found[0].fixed)
            msg = f"{folder} has {len(found)} lines of pulses: choose one by {names}"
            raise InputError(msg)
    (one,) = found
    if not one.word or np.isnan(one.safe):
        why = "none of its pulses" if not one.word else "the weakest pulse already"
        msg = f"{folder}: {why} changes the word: give --low and --high"
        raise InputError(msg)
    same = [c for c in cases.tolist() if swept["force"][c] == one.safe]
    with Results(place) as results:
        return results.scene(same[0]), {"low": one.safe, "high": one.unsafe}


def _teller(*, quiet: bool) -> Any:
    """Return a function that prints a line on stderr now and then."""
    last = [0.0]

    def tell(text: str) -> None:
        now = time.monotonic()
        if quiet or now - last[0] < EVERY:
            return
        last[0] = now
        print(f"edge: {text}", file=sys.stderr)

    return tell


def _show(facts: dict[str, Any]) -> None:
    from hpcwhirl.cli.margin_views import setting_text
    from hpcwhirl.scene.quantity import with_unit
    from hpcwhirl.scene.units import shown_in

    low, high = (setting_text("force", facts.pop(side)) for side in ("low", "high"))
    words = facts.pop("word_low"), facts.pop("word_high")
    print(f"edge between {low} ({words[0]}) and {high} ({words[1]})")
    for name, value in facts.items():
        unit, factor = shown_in(UNITS.get(name, "1"))
        told = with_unit(f"{factor * value:.6g}", "" if unit == "1" else unit, " ")
        print(f"  {name.replace('_', ' '):16} {told}")


def _plot(path: Path, scene: Scene, found: Edge) -> None:
    from hpcwhirl.report.figures.edges import edge_figure
    from hpcwhirl.report.saving import save

    print(f"figure: {save(edge_figure(scene, found), path)}", file=sys.stderr)
