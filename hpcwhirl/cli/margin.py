"""`hpcwhirl margin`: list ranges of damped cases, and a point's distance from others.

A range is a sample of the sweep; --check computes points between its cases.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hpcwhirl.cli.command import add_option
from hpcwhirl.cli.margin_each import each_input
from hpcwhirl.cli.margin_first import first_change
from hpcwhirl.cli.margin_ranges import print_ranges
from hpcwhirl.cli.options import OR_FILE, check_picture
from hpcwhirl.cli.tables import add_format
from hpcwhirl.errors import InputError, say
from hpcwhirl.store.reading import select

if TYPE_CHECKING:
    import xarray

SPEED, RATE = "speed", "acceleration"
MOST = 10_000  # largest number of points that --check draws in a range


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `hpcwhirl margin` on its parser."""
    # fmt: off
    parser.add_argument("folder", type=Path, metavar="DIR", help=OR_FILE)
    add_option(parser, "--over NAME",
        "swept input over which ranges of damped cases are listed (default speed, or "
        "the first swept number where the speed is not swept); each: for every input "
        "of --at, the range around that point", default="")
    add_option(parser, "--at NAME=V",
        "for the input of --over: also print how far this point lies inside a range of "
        "damped cases; for another input: only cases with this value", default=[])
    add_option(parser, "--check N",
        "compute N points drawn inside each range, between its cases; print which "
        "share of them is damped, and bisect beside those that are not", type=int)
    add_option(parser, "--sure SHARE",
        "in a campaign with [twins]: a case counts as damped if at least this share of "
        "its twins is damped (default: if most twins are)", default=0.0)
    add_option(parser, "--first",
        "list only the limit up to which, from the least value of the input, all "
        "computed cases are damped, with --at also as a multiple of that value: how "
        "strong a pulse may be")
    add_option(parser, "--plot FILE.png",
        "with --first: draw the limit over the other swept inputs", type=Path)
    add_format(parser)


def run(args: argparse.Namespace) -> int:
    """Print an input's ranges of damped cases, as a table, and return the exit code.

    With --first it prints only up to which value all cases are damped; with --over each
    the range along every input around one point.
    """
    from hpcwhirl.store.hdf5 import reading
    from hpcwhirl.store.reading.reader import open_results
    from hpcwhirl.store.reading.results_file import results_of

    _check(args)
    place = results_of(args.folder)
    with reading(place), open_results(place) as results:
        if args.over == "each":
            return each_input(args, results)
        over = _over(args.over, results)
        point, data = _chosen(results, over, args.at)
        if args.first:
            if point is not None and not point > 0.0:
                msg = f"--at {over} must be > 0 with --first, which tells multiples of "
                raise InputError(f"{msg}it, got {point:g}")
            return first_change(args, data, over, point)
        return print_ranges(args, data, over, point)


def _over(asked: str, data: xarray.Dataset) -> str:
    """Return the input over which ranges are listed; say if it changes during a run.

    asked : that of --over; "": the speed, or else the first swept number
    """
    swept = select.swept_of(data)
    numbers = [name for name in swept if data[name].dtype.kind in "iuf"]
    if not asked and SPEED not in swept and numbers:
        return numbers[0]
    over = select.variable_of(asked or SPEED, swept)
    if over == SPEED and RATE in data and np.any(data[RATE].to_numpy() != 0.0):
        say("speed is that at which a run begins, and changes during it; the words of "
            "its windows: hpcwhirl cases DIR --columns words_over_speed")  # fmt: skip
    return over


def _check(args: argparse.Namespace) -> None:
    """Raise InputError for options of `margin` that exclude each other or are wrong."""
    if not 0.0 <= args.sure <= 1.0:
        raise InputError(f"--sure must be >= 0 and <= 1, got {args.sure:g}")
    if args.check is not None and not 1 <= args.check <= MOST:
        msg = f"--check must be >= 1 and <= {MOST} points in each range, got "
        raise InputError(f"{msg}{args.check}")
    if args.plot and not args.first:
        raise InputError("--plot draws the limits that --first lists: add --first")
    if args.first and args.over == "each":
        msg = "--first needs one input: --over must be a swept input, got each"
        raise InputError(msg)
    check_picture(args.plot)


def _chosen(
    data: xarray.Dataset, over: str, settings: list[str]
) -> tuple[float | None, xarray.Dataset]:
    """Return the point and the cases that --at chooses.

    The point is the value of the input `over` in --at, None if it is not there; values
    of other inputs select cases.

    Parameters
    ----------
    data : results of the campaign
    over : name of the input whose ranges are listed
    settings : texts ``NAME=V`` of --at
    """
    swept, point, others = select.swept_of(data), None, []
    for text in settings:
        name, sign, raw = text.partition("=")
        what = "input of --at"
        if sign and select.variable_of(name.strip(), swept, what) == over:
            if point is not None:
                raise InputError(f"--at {over} is given twice")
            point = select.number_of(raw, over, "--at")
        else:
            others.append(text)
    return point, select.chosen(data, others)
