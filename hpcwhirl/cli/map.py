"""`hpcwhirl map`: the regime map of a campaign."""

from __future__ import annotations

import argparse
from pathlib import Path


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("folder", type=Path, metavar="DIR")
    parser.add_argument("--out", type=Path, metavar="DIR", help="default: DIR itself")
    parser.add_argument(
        "--y",
        metavar="NAME",
        help="swept input of the second axis (default: the first)",
    )


def run(args: argparse.Namespace) -> int:
    """Draw map.png and map.svg."""
    from hpcwhirl.report.maps import draw_map

    for path in draw_map(args.folder / "results.h5", args.out or args.folder, args.y):
        print(path)
    return 0
