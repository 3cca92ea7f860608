"""`hpcwhirl map`: regimes, whirl or a number over a campaign's inputs."""

from __future__ import annotations

import argparse
from pathlib import Path

from hpcwhirl.cli.options import OR_FILE


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("folder", type=Path, metavar="DIR", help=OR_FILE)
    parser.add_argument("--out", type=Path, metavar="DIR", help="default: DIR itself")
    for side in ("x", "y"):
        parser.add_argument(
            f"--{side}", metavar="NAME", help="swept input of this axis, as in the TOML"
        )
    parser.add_argument(
        "--panel", action="append", default=[], metavar="NAME", dest="panels",
        help="swept input that gets a panel for each of its values; of two, for each "
        "pair; default: those that differ besides, up to 12 panels",
    )  # fmt: skip
    parser.add_argument(
        "--at", action="append", default=[], metavar="NAME=V[,V]",
        help="only cases with this value of an input",
    )  # fmt: skip
    parser.add_argument(
        "--colour", "--color", default="regime", metavar="WHAT", dest="colour",
        help="regime (default), whirl, a number of the file such as growth_rate, or "
        "one over another: orbit_radius/gap",
    )  # fmt: skip
    parser.add_argument("--rpm", action="store_true", help="speeds in rpm")
    parser.add_argument(
        "--critical", action="store_true",
        help="mark the critical speeds of Eq. 13 and its super-harmonics",
    )  # fmt: skip
    parser.add_argument(
        "--csv", action="store_true", help="also write what is drawn to map.csv"
    )


def run(args: argparse.Namespace) -> int:
    """Draw map.png and map.svg, and write map.csv if asked."""
    from hpcwhirl.report.maps import drawing_of, save_map
    from hpcwhirl.report.picture import Wish
    from hpcwhirl.store.reading.reader import results_of

    wish = Wish(
        args.x, args.y, tuple(args.panels), tuple(args.at), args.colour,
        rpm=args.rpm, critical=args.critical,
    )  # fmt: skip
    results = results_of(args.folder)
    out = args.out or results.parent
    drawing = drawing_of(results, wish)
    paths = save_map(drawing, out)
    if args.csv:
        paths.append(drawing.write_table(out / "map.csv"))
    for path in paths:
        print(path)
    return 0
