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
        "orbit, section, contributions, contacts, ledger (one a case); default: all",
    )  # fmt: skip
    parser.add_argument(
        "--case", action="append", type=int, metavar="I", dest="cases",
        help="number of a case; of figures over the speed, the ones like it",
    )  # fmt: skip
    parser.add_argument(
        "--transient", action="store_true", help="show the transient part, too"
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="default: figures in DIR"
    )


def run(args: argparse.Namespace) -> int:
    """Draw the figures; one line for each, also where there can be none."""
    from hpcwhirl.report.figures import draw_figures

    out = args.out or args.folder / "figures"
    for line in draw_figures(
        args.folder, out, args.kind, args.cases, transient=args.transient
    ):
        print(line)
    return 0
