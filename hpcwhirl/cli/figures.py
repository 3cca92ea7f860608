"""`hpcwhirl figures`: draw spectra, orbits, contributions, contacts and ledgers."""

from __future__ import annotations

import argparse
from pathlib import Path

from hpcwhirl.cli.options import OF_CAMPAIGN, add_units, asked_units


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("folder", type=Path, metavar="DIR", help=OF_CAMPAIGN)
    parser.add_argument(
        "--kind", action="append", metavar="NAME",
        help="kind of figure, may be repeated (default: all but basins, chord, "
        "stress and wear, branches only of a campaign with [branch]); over the speed: "
        "frequency, cascade, bifurcation, interaction, growth; of sweeps up and down: "
        "branches; of the engine: shapes, campbell, stability; of the starts: basins; "
        "of each case: orbit, section, contributions, contacts, chord (several points "
        "a tip), tips, stress (a file with a stress matrix), waterfall (speed or gap "
        "that changes), wear (a layer), ledger",
    )  # fmt: skip
    parser.add_argument(
        "--case", action="append", type=int, metavar="I", dest="cases",
        help="only this case, by its number; a figure over the speed shows the cases "
        "that differ from it in speed alone; may be repeated",
    )  # fmt: skip
    parser.add_argument(
        "--at", action="append", default=[], metavar="NAME=V[,V]",
        help="only cases with this value of an input, e.g. speed=410",
    )  # fmt: skip
    parser.add_argument(
        "--transient", action="store_true",
        help="show the whole run, not only its last part, which decides the regime",
    )  # fmt: skip
    parser.add_argument(
        "--out", type=Path, metavar="DIR",
        help="directory for the figures (default: figures in the campaign's directory)",
    )  # fmt: skip
    add_units(parser, "titles and axes")


def run(args: argparse.Namespace) -> int:
    """Draw the figures; print for each its path, or why it cannot be drawn.

    If none can be drawn, the exit code is 2.
    """
    from hpcwhirl.errors import InputError, WhirlError
    from hpcwhirl.report.figures.kinds import cases_at, draw_figures
    from hpcwhirl.store.reading.results_file import Results

    out = args.out or args.folder / "figures"
    only, results = args.cases, Results(args.folder)
    if args.at:
        only = sorted({*(only or []), *cases_at(results, args.at)})
    drawn = 0
    figures = draw_figures(
        results, out, args.kind, only,
        transient=args.transient, units=asked_units(args.units),
    )  # fmt: skip
    try:
        for made in figures:
            drawn += isinstance(made, Path)
            print(made)
    except (BrokenPipeError, WhirlError):
        for _ in figures:  # draw the remaining figures, although no one reads the list
            pass
        raise
    if not drawn:
        msg = f"nothing drawn of {args.folder}"
        raise InputError(msg)
    return 0
