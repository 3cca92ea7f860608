"""`hpcwhirl figures`: spectra, orbits, contributions, contacts of a campaign."""

from __future__ import annotations

import argparse
from pathlib import Path


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("folder", type=Path, metavar="DIR")
    parser.add_argument(
        "--kind", action="append", metavar="NAME",
        help="frequency, cascade, bifurcation, interaction, growth (all speeds); "
        "shapes, campbell (the engine); "
        "orbit, section, contributions, contacts, ledger (one a case); default: all",
    )  # fmt: skip
    parser.add_argument(
        "--case", action="append", type=int, metavar="I", dest="cases",
        help="number of a case; of figures over the speed, the ones like it",
    )  # fmt: skip
    parser.add_argument(
        "--at", action="append", default=[], metavar="NAME=V[,V]",
        help="cases by an input's value instead of their number: speed=410",
    )  # fmt: skip
    parser.add_argument(
        "--transient", action="store_true", help="show the transient part, too"
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="default: figures in DIR"
    )


def run(args: argparse.Namespace) -> int:
    """Draw the figures; one line for each, also where there can be none.

    Where nothing at all could be drawn, what was asked for is wrong: exit code 2.
    """
    from hpcwhirl.errors import InputError, WhirlError
    from hpcwhirl.report.figures import cases_at, draw_figures

    out = args.out or args.folder / "figures"
    only = args.cases
    if args.at:
        only = sorted({*(only or []), *cases_at(args.folder, args.at)})
    drawn = 0
    figures = draw_figures(args.folder, out, args.kind, only, transient=args.transient)
    try:
        for made in figures:
            drawn += isinstance(made, Path)
            print(made)
    except (BrokenPipeError, WhirlError):
        for _ in figures:  # who closes the list wants the figures still
            pass
        raise
    if not drawn:
        msg = f"nothing drawn of {args.folder}"
        raise InputError(msg)
    return 0
