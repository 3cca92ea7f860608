"""`hpcwhirl map`: draw regimes, whirl or a number over the swept inputs.

The map without options is map.png; one with options is named by them, such as
map-growth_rate.png.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from hpcwhirl.cli.options import OR_FILE, add_units, asked_units


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("folder", type=Path, metavar="DIR", help=OR_FILE)
    parser.add_argument(
        "--out", type=Path, metavar="DIR",
        help="directory for the map (default: that of the results)",
    )  # fmt: skip
    for side in ("x", "y"):
        parser.add_argument(
            f"--{side}", metavar="NAME", help=f"swept input of the {side} axis"
        )
    parser.add_argument(
        "--panel", action="append", default=[], metavar="NAME", dest="panels",
        help="swept input with one panel for each value; if repeated, one panel for "
        "each pair of values (default: inputs that are on no axis, up to 12 panels)",
    )  # fmt: skip
    parser.add_argument(
        "--at", action="append", default=[], metavar="NAME=V[,V]",
        help="only cases with this value of an input",
    )  # fmt: skip
    parser.add_argument(
        "--colour", "--color", default="regime", metavar="WHAT", dest="colour",
        help="what the colours show: regime (default), whirl, motion, attractor, a "
        "numeric variable such as growth_rate, or a ratio such as orbit_radius/gap",
    )  # fmt: skip
    add_units(parser, "axes, panels, title and colour")
    parser.add_argument(
        "--rpm", action="store_true", help="show speeds in rpm, as --units rpm"
    )
    parser.add_argument(
        "--critical", action="store_true",
        help="mark the critical speeds of Eq. 13 and its super-harmonics",
    )  # fmt: skip
    parser.add_argument(
        "--csv", action="store_true", help="also write the values drawn as CSV"
    )


def run(args: argparse.Namespace) -> int:
    """Draw map.png and map.svg, or map-OPTIONS.png and .svg; --csv: write a table."""
    from hpcwhirl.report.map.data import Wish
    from hpcwhirl.report.map.maps import drawing_of, save_map, stem_of
    from hpcwhirl.store.reading.results_file import results_of

    wish = Wish(
        args.x, args.y, tuple(args.panels), tuple(args.at), args.colour,
        rpm=args.rpm, critical=args.critical, units=asked_units(args.units),
    )  # fmt: skip
    results = results_of(args.folder)
    out = args.out or results.parent
    drawing = drawing_of(results, wish)
    paths = save_map(drawing, out)
    if args.csv:
        paths.append(drawing.write_table(out / f"{stem_of(wish)}.csv"))
    for path in paths:
        print(path)
    return 0
