"""`hpcwhirl map`: draw regimes, whirl or a number over the swept inputs.

The map without options is map.png; the name of a map with options contains these, such
as map-growth_rate.png.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from hpcwhirl.cli.command import add_option
from hpcwhirl.cli.options import (
    OR_FILE,
    add_json,
    add_units,
    asked_units,
    print_paths,
)
from hpcwhirl.cli.so_far import gathered_so_far


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `hpcwhirl map` on its parser."""
    # fmt: off
    parser.add_argument("folder", type=Path, metavar="DIR", help=OR_FILE)
    add_option(parser, "--out DIR",
        "directory for the map (default: directory of the results)", type=Path)
    for side in ("x", "y"):
        add_option(parser, f"--{side} NAME", f"swept input of the {side} axis")
    add_option(parser, "--panel NAME",
        "swept input with one panel for each value; if repeated, one panel for each "
        "pair of values (default: swept inputs that are on no axis, up to 12 panels)",
        default=[], dest="panels")
    add_option(parser, "--at NAME=V[,V]",
        "only cases with this value of an input", default=[])
    add_option(parser, "--colour|--color WHAT",
        "what the colours show: regime (default), whirl, motion, attractor, a numeric "
        "variable such as growth_rate, or a ratio such as orbit_radius/gap",
        default="regime", dest="colour")
    add_units(parser, "axes, panels, title and colour")
    add_option(parser, "--rpm", "show speeds in rpm, as --units rpm")
    add_option(parser, "--critical",
        "mark the critical speeds of Eq. 13 and its super-harmonics")
    add_option(parser, "--csv", "also write the values drawn as CSV")
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Draw a campaign's map as PNG and SVG; with --csv also write its table.

    Returns the exit code
    """
    from hpcwhirl.report.map.data import Wish
    from hpcwhirl.report.map.maps import draw_map
    from hpcwhirl.store.reading.results_file import results_of

    wish = Wish(
        args.x, args.y, tuple(args.panels), tuple(args.at), args.colour,
        rpm=args.rpm, critical=args.critical, units=asked_units(args.units),
    )  # fmt: skip
    gathered_so_far(args.folder)
    results = results_of(args.folder)
    out = args.out or results.parent
    print_paths(args, draw_map(results, out, wish, table=args.csv))
    return 0
