"""`hpcwhirl margin`: list safe ranges, and how far a point lies from their ends."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcwhirl.cli.margin_views import each_input, first_change, setting_text
from hpcwhirl.cli.options import OR_FILE, asked_units
from hpcwhirl.cli.tables import add_format, in_units, print_data, print_table, unit_of
from hpcwhirl.scene.units import showing

if TYPE_CHECKING:
    import xarray

    from hpcwhirl.analysis.margins import SafeRange

ENDS = ("low", "high", "below", "above")
OVER = (*ENDS, "distance")  # columns in the unit of the input of --over


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("folder", type=Path, metavar="DIR", help=OR_FILE)
    parser.add_argument(
        "--over", default="speed", metavar="NAME",
        help="swept input whose safe ranges are listed (default speed); each: for "
        "every input of --at, the safe range around that point",
    )  # fmt: skip
    parser.add_argument(
        "--at", action="append", default=[], metavar="NAME=V",
        help="for the input of --over: also print the distance of this point from the "
        "nearest boundary; for another input: only cases with this value",
    )  # fmt: skip
    parser.add_argument(
        "--sure", type=float, default=0.0, metavar="SHARE",
        help="in a campaign with [twins]: a case counts as damped if at least this "
        "share of its twins is damped (default: if most are)",
    )  # fmt: skip
    parser.add_argument(
        "--first", action="store_true",
        help="list only up to which value of the input, from its least one, all cases "
        "are damped, with --at also in multiples of that value: how strong a pulse may "
        "be",
    )  # fmt: skip
    parser.add_argument(
        "--plot", type=Path, metavar="FILE.png",
        help="with --first: draw that limit over the other swept inputs",
    )  # fmt: skip
    add_format(parser)


def run(args: argparse.Namespace) -> int:
    """Print a row for each safe range; --first: each limit; --over each: each input."""
    from hpcwhirl.store.hdf5 import reading
    from hpcwhirl.store.reading.reader import open_results
    from hpcwhirl.store.reading.results_file import results_of
    from hpcwhirl.store.reading.select import swept_of, variable_of

    _check(args)
    place = results_of(args.folder)
    with reading(place), open_results(place) as results:
        if args.over == "each":
            return each_input(args, results)
        over = variable_of(args.over, swept_of(results))
        point, data = _chosen(results, over, args.at)
        if args.first:
            return first_change(args, data, over, point)
        return _print_ranges(args, data, over, point)


def _check(args: argparse.Namespace) -> None:
    """Raise InputError for options that do not go together or are out of range."""
    from hpcwhirl.cli.options import check_writable
    from hpcwhirl.errors import InputError

    if not 0.0 <= args.sure <= 1.0:
        msg = f"--sure must be >= 0 and <= 1, got {args.sure:g}"
        raise InputError(msg)
    if args.plot and not args.first:
        msg = "--plot draws what --first lists: give --first, too"
        raise InputError(msg)
    if args.first and args.over == "each":
        msg = "--first needs one input: --over must be a swept input, got each"
        raise InputError(msg)
    if args.plot and args.plot.suffix not in {".png", ".svg", ".pdf"}:
        msg = f"--plot must end in .png, .svg or .pdf, got '{args.plot.name}'"
        raise InputError(msg)
    check_writable(args.plot, folder=False)


def _print_ranges(
    args: argparse.Namespace, data: xarray.Dataset, over: str, point: float | None
) -> int:
    from hpcwhirl.analysis.margins import safe_ranges

    found = safe_ranges(data, over, args.sure)
    columns = _columns(found, point)
    units = {n: unit_of(data, over if n in OVER else n) for n in columns}
    columns, units = in_units(args, columns, units)
    if not print_data(args, columns, units, "ranges", over=over):
        print(f"damped over {over}; the boundary lies between low and below, and "
              "between high and above")  # fmt: skip
        print_table(columns, units, len(found))
        if point is not None:
            print(_nearest(found, over, point, asked_units(args.units)))
    return 0


def _chosen(
    data: xarray.Dataset, over: str, settings: list[str]
) -> tuple[float | None, xarray.Dataset]:
    """Return the value of ``--at`` in the input `over`, or None, and the cases chosen.

    Parameters
    ----------
    data : results of the campaign
    over : the input whose ranges are listed
    settings : texts ``NAME=V`` of --at; those of other inputs choose cases
    """
    from hpcwhirl.errors import InputError
    from hpcwhirl.store.reading.select import number_of, swept_of, variable_of, where

    swept, point, others = swept_of(data), None, []
    for text in settings:
        name, sign, raw = text.partition("=")
        if sign and variable_of(name.strip(), swept, "input of --at") == over:
            if point is not None:
                msg = f"--at {over} is given twice"
                raise InputError(msg)
            point = number_of(raw, over, "--at")
        else:
            others.append(text)
    mask = where(others, {n: data[n].to_numpy() for n in swept})
    if mask is None:
        return point, data
    return point, data.isel(case=np.flatnonzero(mask))


def _columns(found: list[SafeRange], point: float | None) -> dict[str, Any]:
    """Return {name: values (ranges,)} of the table; `point` adds the distance."""
    out: dict[str, list[Any]] = {n: [r.fixed[n] for r in found] for n in found[0].fixed}
    out |= {n: [getattr(r, n) for r in found] for n in ENDS}
    for side in ("below", "above"):
        out[f"word_{side}"] = [getattr(r, f"word_{side}") for r in found]
    out["cases"] = [r.cases for r in found]
    if any(np.isfinite(r.share) for r in found):
        out["least_share"] = [r.share for r in found]
    if point is not None:
        out["distance"] = [r.distance(point) for r in found]
    return {name: np.array(values) for name, values in out.items()}


def _nearest(
    found: list[SafeRange], over: str, point: float, asked: tuple[str, ...]
) -> str:
    """Return a line on the distance from the point to the nearest boundary."""
    inside = [r for r in found if r.distance(point) >= 0.0]
    lines = len({tuple(r.fixed.values()) for r in found})
    with showing(asked):
        told = setting_text(over, point)
        if not inside:
            return f"{told}: in no safe range of {lines} lines"
        least = min(inside, key=lambda r: r.distance(point))
        where = ", ".join(
            setting_text(name, value) for name, value in least.fixed.items()
        )
        far = setting_text(over, least.distance(point)).partition(" = ")[2]
    count = len({tuple(r.fixed.values()) for r in inside})
    if not np.isfinite(least.distance(point)):
        return f"{told}: in a safe range on {count} of {lines} lines, no boundary met"
    at = f" at {where}" if where else ""
    return (
        f"{told}: in a safe range on {count} of {lines} lines; the nearest boundary "
        f"is {far} or more away{at}"
    )
