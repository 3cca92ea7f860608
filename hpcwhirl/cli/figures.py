"""`hpcwhirl figures`: draw spectra, orbits, contributions, contacts and ledgers."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

from hpcwhirl.cli.command import add_option
from hpcwhirl.cli.options import (
    OF_CAMPAIGN,
    add_json,
    add_units,
    asked_units,
    print_json,
)
from hpcwhirl.errors import InputError, WhirlError


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `hpcwhirl figures` on its parser."""
    # fmt: off
    parser.add_argument("folder", type=Path, metavar="DIR", help=OF_CAMPAIGN)
    add_option(parser, "--kind NAME",
        "kind of figure; may be repeated (default: all but basins, chord, loads, "
        "motion, movie, stress and wear; branches only for a campaign with [branch]); "
        "over the speed: frequency, cascade, bifurcation, interaction, growth; of "
        "sweeps up and down: branches; of the engine: shapes, campbell, "
        "stability; of the starts: basins; of each case: orbit, section, "
        "contributions, contacts, chord (several "
        "points a tip), tips, motion (the wheel, as six frames and as a GIF), movie "
        "(the same as MP4, which needs ffmpeg), loads (of the shaft), stress (a file "
        "with a stress matrix), "
        "waterfall (speed or gap that changes), wear (a layer), ledger",
        action="append")
    add_option(parser, "--case I",
        "only this case, by its number; a figure over the speed shows the cases that "
        "differ from it in speed alone; may be repeated",
        type=int, dest="cases", action="append")
    add_option(parser, "--at NAME=V[,V]",
        "only cases with this value of an input, e.g. speed=410", default=[])
    add_option(parser, "--transient",
        "show the whole run, not only its last part, which decides the regime")
    add_option(parser, "--out DIR",
        "directory for the figures (default: figures in the campaign's directory)",
        type=Path)
    add_units(parser, "titles and axes")
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Draw figures of a campaign; print for each its path, or why it cannot be drawn.

    Returns the exit code, 2 if none can be drawn
    """
    from hpcwhirl.report.figures.kinds import cases_at, draw_figures
    from hpcwhirl.store.reading.results_file import Results

    if args.folder.is_file():
        msg = f"DIR must be the directory of a campaign, got the file {args.folder}; "
        raise InputError(msg + "hpcwhirl run --plot draws the orbit of one case")
    out = args.out or args.folder / "figures"
    only, results = args.cases, Results(args.folder)
    if args.at:
        only = sorted({*(only or []), *cases_at(results, args.at)})
    figures = draw_figures(
        results, out, args.kind, only,
        transient=args.transient, units=asked_units(args.units),
    )  # fmt: skip
    made = _told(figures, quiet=args.json)
    paths = [str(one) for one in made if isinstance(one, Path)]
    if not paths:
        raise InputError(f"no figure of {args.folder} could be drawn")
    if args.json:
        lacking = [one for one in made if isinstance(one, str)]
        print_json({"files": paths, "not_drawn": lacking})
    return 0


def _told(figures: Iterator[Path | str], *, quiet: bool) -> list[Path | str]:
    """Draw figures, print a line for each unless `quiet`; return paths and reasons."""
    made: list[Path | str] = []
    try:
        for one in figures:
            made.append(one)
            if not quiet:
                print(one)
    except (BrokenPipeError, WhirlError):
        for _ in figures:  # draw the remaining figures, although no one reads the list
            pass
        raise
    return made
