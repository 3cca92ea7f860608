"""`hpcwhirl edge`: follow the motion on the edge between two words, from two pulses.

In a campaign swept over force, one edge is followed for each line of cases, which
differ in force only.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from hpcwhirl.cli import options
from hpcwhirl.cli.command import add_option
from hpcwhirl.errors import InputError
from hpcwhirl.scene.units import showing, shown_in, with_unit
from hpcwhirl.store.reading import select

if TYPE_CHECKING:
    from hpcwhirl.scene import Scene
    from hpcwhirl.studies.edge import Edge

TRACKING = {"span": 1.0, "look": 1.0, "near": 1e-6, "far": 1e-3}
UNITS = {
    "begin": "s", "end": "s", "orbit_radius": "m", "turning_rate": "rad/s",
    "line_frequency": "rad/s", "leaving_rate": "1/s", "leaving_low": "1/s",
    "leaving_high": "1/s",
}  # fmt: skip


COLUMNS = (
    "low", "high", "word_high", "orbit_radius", "orbit_change", "turning_rate",
    "contact_share", "leaving_rate", "leaving_low", "leaving_high", "message",
)  # fmt: skip

# texts in the row of a line of cases whose edge was lost; its numbers are NaN
NONE = {"word_high": "", "message": ""}


class Asked(NamedTuple):
    """An edge to follow: a scene, and two pulses that lead to different words.

    Attributes
    ----------
    fixed : {input: value} of the line of a campaign's cases on which it was found; {}
        for a scene that the user named
    scene, low, high : the scene; forces of the weaker and the stronger pulse, N
    """

    fixed: dict[str, Any]
    scene: Scene
    low: float
    high: float


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `hpcwhirl edge` on its parser."""
    # fmt: off
    options.add_scene(parser)
    for side, word in (("low", "weaker"), ("high", "stronger")):
        add_option(parser, f"--{side} FORCE",
            f"force of the {word} pulse, N or with a unit; instead of SCENE and "
            "pulses, name the directory of a campaign swept over force: for each "
            "combination of its other swept inputs an edge is followed, between the "
            "forces of the first change of word")
    add_option(parser, "--at NAME=V",
        "for a campaign: only cases with this value of another swept input",
        default=[])
    helps = {
        "span": "time over which the edge is followed, s",
        "look": "time after which a motion gets its word, s; if undecided, up to 3 "
        "times as long",
        "near": "relative distance of the two states at which bisection ends",
        "far": "relative distance of the two states at which they are bisected again",
    }
    for name, value in TRACKING.items():
        add_option(parser, f"--{name} X",
            f"{helps[name]} (default {value:g})", default=value, type=float)
    add_option(parser, "--plot FILE.png",
        "draw radius and orbit of the edge", type=Path)
    options.add_units(parser, "numbers")
    add_option(parser, "--quiet", "show no progress")


def run(args: argparse.Namespace) -> int:
    """Follow the motion on one edge, or on one for each line of a campaign's cases.

    Prints the numbers of the motion; returns the exit code
    """
    options.check_picture(args.plot)
    asked = _asked(args)
    with showing(options.asked_units(args.units)):
        if len(asked) > 1:
            return _print_lines(args, asked)
        options.tell_preset(asked[0].scene)
        found, facts = _followed(args, asked[0])
        options.print_json(facts) if args.json else _show(facts)
        if args.plot:
            _plot(args.plot, asked[0].scene, found)
    return 0


def _followed(args: argparse.Namespace, asked: Asked) -> tuple[Edge, dict[str, Any]]:
    """Follow the motion on an edge; return it, and the numbers to print, by name.

    asked : scene and pulses
    """
    from hpcwhirl.studies.edge import Tracking, edge

    how = Tracking(**{name: getattr(args, name) for name in TRACKING})

    def tell(text: str) -> None:
        if not args.quiet:
            print(f"edge: {text}", file=sys.stderr)

    found = edge(asked.scene, asked.low, asked.high, how, options.seldom(tell))
    ends = {"low": asked.low, "high": asked.high}
    words = {"word_low": found.low.word, "word_high": found.high.word}
    return found, ends | words | found.numbers


def _asked(args: argparse.Namespace) -> list[Asked]:
    """Return the edges to follow: one of a scene, or one on each line of a campaign.

    A line is a group of cases that differ in force only.
    """
    from hpcwhirl.store.reading.results_file import results_of

    given = {side: select.number_of(text, "force", f"--{side}")
             for side in ("low", "high") if (text := getattr(args, side))}  # fmt: skip
    if Path(args.scene).is_dir():
        if args.settings or given:
            msg = "--set, --preset, --low and --high go with a scene, not a campaign"
            raise InputError(f"{msg}: choose a line of cases by --at")
        return _of_campaign(results_of(Path(args.scene)), args.at)
    if args.at:
        msg = "--at selects cases of a campaign: use --set for a scene"
        raise InputError(msg)
    scene = options.scene_of(args.scene, args.settings)
    if len(given) < 2:
        raise InputError(
            "an edge needs two pulses that lead to different words: give --low and "
            "--high, such "
            f"as --low {scene.force / 2000:g}kN --high {scene.force / 1000:g}kN"
        )
    return [Asked({}, scene, given["low"], given["high"])]


def _of_campaign(place: Path, at: list[str]) -> list[Asked]:
    """Return the edges to follow in a campaign swept over force.

    On each line, cases that differ in force only, an edge lies between the two pulses
    at the first change of word; a line without change has none.

    place, at : path of results.h5; texts ``NAME=V`` of --at, which select cases
    """
    from hpcwhirl.store.reading.reader import open_results
    from hpcwhirl.store.reading.results_file import Results
    from hpcwhirl.studies.margins import first_changes

    with open_results(place) as data, Results(place) as results:
        swept = {n: data[n].to_numpy() for n in select.swept_of(data)}
        mask = select.where(at, swept)
        mask = select.counting(data) & (True if mask is None else mask)
        cases = np.flatnonzero(mask)
        found = first_changes(data.isel(case=cases), "force")
        out = []
        for one in found:
            if one.word and not np.isnan(one.safe):
                wanted = {**one.fixed, "force": one.safe}
                scene = results.scene(_case_of(swept, cases.tolist(), wanted))
                out.append(Asked(one.fixed, scene, one.safe, one.unsafe))
    if not out:
        msg = f"{place.parent}: no pulse changes the word from damped on {len(found)} "
        raise InputError(f"{msg}lines: sweep force from weaker to stronger pulses")
    return out


def _case_of(swept: dict[str, Any], cases: list[int], wanted: dict[str, Any]) -> int:
    """Return the number of the first case that has given values of swept inputs.

    swept, wanted : {swept input: (cases,)}; {swept input: value}
    cases : numbers of the cases among which it is searched
    """
    return next(c for c in cases if all(swept[n][c] == v for n, v in wanted.items()))


def _print_lines(args: argparse.Namespace, asked: list[Asked]) -> int:
    """Follow the edges of a campaign, one for each line of cases; print a table.

    A row has the numbers of an edge's motion, or the reason why the edge was lost.
    Returns the exit code

    asked : the edges to follow
    """
    from hpcwhirl.cli.tables import print_table
    from hpcwhirl.studies.edge_tracking import LostEdgeError

    if args.plot:
        msg = f"--plot draws one edge, got {len(asked)} lines: choose one by --at"
        raise InputError(msg)
    rows = []
    for one in asked:
        try:
            rows.append(one.fixed | _followed(args, one)[1] | {"message": ""})
        except (InputError, LostEdgeError) as lost:
            ends = {"low": one.low, "high": one.high, "message": str(lost)}
            rows.append(one.fixed | ends)
    if args.json:
        options.print_json({"edges": rows})
        return 0
    known = {n: in_shown(n) for n in (*one.fixed, *COLUMNS)}
    columns = {
        name: np.array(
            [_scaled(row.get(name, NONE.get(name, np.nan)), f) for row in rows]
        )
        for name, (_, f) in known.items()
    }
    print_table(columns, {name: unit for name, (unit, _) in known.items()}, len(rows))
    return 0


def _scaled(value: Any, factor: float) -> Any:
    return factor * value if isinstance(value, int | float) else value


def in_shown(name: str) -> tuple[str, float]:
    """Return the unit in which a number of an edge is printed, and the factor from SI.

    name : name of the number, such as "orbit_radius", or of an input
    """
    given = {"low": "N", "high": "N"}
    known = UNITS | given
    unit, factor = shown_in(known.get(name, select.UNITS.get(name, "1")))
    return ("" if unit == "1" else unit), factor


def _show(facts: dict[str, Any]) -> None:
    from hpcwhirl.cli.setting_text import setting_text

    low, high = (setting_text("force", facts.pop(side)) for side in ("low", "high"))
    words = facts.pop("word_low"), facts.pop("word_high")
    print(f"edge between {low} ({words[0]}) and {high} ({words[1]})")
    for name, value in facts.items():
        unit, factor = in_shown(name)
        number = with_unit(f"{factor * value:.6g}", unit, " ")
        print(f"  {name.replace('_', ' '):16} {number}")


def _plot(path: Path, scene: Scene, found: Edge) -> None:
    from hpcwhirl.report.figures.coexisting import draw_edge

    print(f"figure: {draw_edge(scene, found, path)}", file=sys.stderr)
