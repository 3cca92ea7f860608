"""`hpcwhirl margin`: list safe ranges, and a point's distance from their ends."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcwhirl.cli.command import add_option
from hpcwhirl.cli.options import OR_FILE, asked_units, check_picture
from hpcwhirl.cli.tables import add_format, in_units, print_data, print_table, unit_of
from hpcwhirl.errors import InputError
from hpcwhirl.scene.units import showing, shown_in, with_unit
from hpcwhirl.store.reading import select

if TYPE_CHECKING:
    import xarray

    from hpcwhirl.analysis.margins import Along, FirstChange, SafeRange

ENDS = ("low", "high", "below", "above")
WORDS = ("word_below", "word_above")
TOLD = 12  # largest number of lines of cases for each of which a sentence is printed
OVER = (*ENDS, "distance")  # columns in the unit of the input of --over


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `hpcwhirl margin` on its parser."""
    # fmt: off
    parser.add_argument("folder", type=Path, metavar="DIR", help=OR_FILE)
    add_option(parser, "--over NAME",
        "swept input whose safe ranges are listed (default speed); each: for every "
        "input of --at, the safe range around that point", default="speed")
    add_option(parser, "--at NAME=V",
        "for the input of --over: also print the distance of this point from the "
        "nearest boundary; for another input: only cases with this value", default=[])
    add_option(parser, "--sure SHARE",
        "in a campaign with [twins]: a case counts as damped if at least this share of "
        "its twins is damped (default: if most twins are)", default=0.0)
    add_option(parser, "--first",
        "list only the limit up to which, from the least value of the input, all cases "
        "are damped, with --at also as a multiple of that value: how strong a pulse "
        "may be")
    add_option(parser, "--plot FILE.png",
        "with --first: draw the limit over the other swept inputs", type=Path)
    add_format(parser)


def run(args: argparse.Namespace) -> int:
    """Print the safe ranges of an input, as a table, and return the exit code.

    With --first it prints only up to which value all cases are damped; with --over each
    the safe range along every input around one point.
    """
    from hpcwhirl.store.hdf5 import reading
    from hpcwhirl.store.reading.reader import open_results
    from hpcwhirl.store.reading.results_file import results_of

    _check(args)
    place = results_of(args.folder)
    with reading(place), open_results(place) as results:
        if args.over == "each":
            return each_input(args, results)
        over = select.variable_of(args.over, select.swept_of(results))
        point, data = _chosen(results, over, args.at)
        if args.first:
            if point is not None and not point > 0.0:
                msg = f"--at {over} must be > 0 with --first, which tells multiples of "
                raise InputError(f"{msg}it, got {point:g}")
            return first_change(args, data, over, point)
        return _print_ranges(args, data, over, point)


def _check(args: argparse.Namespace) -> None:
    """Raise InputError for options of `margin` that exclude each other or are wrong."""
    if not 0.0 <= args.sure <= 1.0:
        raise InputError(f"--sure must be >= 0 and <= 1, got {args.sure:g}")
    if args.plot and not args.first:
        raise InputError("--plot draws the limits that --first lists: add --first")
    if args.first and args.over == "each":
        msg = "--first needs one input: --over must be a swept input, got each"
        raise InputError(msg)
    check_picture(args.plot)


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


def _columns(found: list[SafeRange], point: float | None) -> dict[str, Any]:
    """Return the printed table of safe ranges, {column: (ranges,)}.

    found : the ranges
    point : value of the input for which a column has the distance to each range's
        boundary; None: no such column
    """
    out: dict[str, list[Any]] = {n: [r.fixed[n] for r in found] for n in found[0].fixed}
    out |= {n: [getattr(r, n) for r in found] for n in (*ENDS, *WORDS)}
    out["cases"] = [r.cases for r in found]
    if any(np.isfinite(r.share) for r in found):
        out["least_share"] = [r.share for r in found]
    if point is not None:
        out["distance"] = [r.distance(point) for r in found]
    return {name: np.array(values) for name, values in out.items()}


def _nearest(
    found: list[SafeRange], over: str, point: float, asked: tuple[str, ...]
) -> str:
    """Return a sentence on how far a point is from the nearest end of a safe range.

    found : safe ranges of the input
    over, point, asked : name of the input; its value at the point; units to print in
    """
    inside = [r for r in found if r.distance(point) >= 0.0]
    lines = len({tuple(r.fixed.values()) for r in found})
    with showing(asked):
        at_point = setting_text(over, point)
        if not inside:
            return f"{at_point}: in no safe range on any of {lines} lines"
        least = min(inside, key=lambda r: r.distance(point))
        where = _line(least.fixed)
        far = setting_text(over, least.distance(point)).partition(" = ")[2]
    count = len({tuple(r.fixed.values()) for r in inside})
    if not np.isfinite(least.distance(point)):
        many = f"{at_point}: in a safe range on {count} of {lines} lines"
        return f"{many}, no boundary met"
    at = f" at {where}" if where else ""
    return (
        f"{at_point}: in a safe range on {count} of {lines} lines; the nearest "
        f"boundary is {far} or more away{at}"
    )


def first_change(
    args: argparse.Namespace, data: xarray.Dataset, over: str, point: float | None
) -> int:
    """Print up to which value of an input cases are damped, for each line of cases.

    This is --first. Returns the exit code

    Parameters
    ----------
    args : options of `hpcwhirl margin`
    data : results of the selected cases
    over : name of the input
    point : value of that input to compare limits with; None: no comparison
    """
    from hpcwhirl.analysis.margins import first_changes

    found = first_changes(data, over, args.sure)
    columns = _first_columns(found, point)
    ends = ("safe", "unsafe")
    units = {n: unit_of(data, over if n in ends else n) for n in columns}
    columns, units = in_units(args, columns, units)
    if not print_data(args, columns, units, "first", over=over, at=point):
        print(f"damped from the least {over} up to safe; unsafe: the next value tried")
        print_table(columns, units, len(found))
        if point is not None:
            with showing(asked_units(args.units)):
                print("\n".join(_sentences(found, over, point)))
    if args.plot:
        from hpcwhirl.report.map.limits import draw_limits

        with showing(asked_units(args.units)):
            draw_limits(data, found, over, point, args.plot)
    return 0


def _first_columns(found: list[FirstChange], point: float | None) -> dict[str, Any]:
    """Return the printed table of limits, {column: (lines,)}, for each line of cases.

    found : up to which value of the input cases are damped, on each line
    point : value of the input, of which columns have the limits as multiples; None: no
        such columns
    """
    out: dict[str, Any] = {n: [f.fixed[n] for f in found] for n in found[0].fixed}
    out |= {n: [getattr(f, n) for f in found] for n in ("safe", "unsafe", "word")}
    out["changes"] = [f.changes for f in found]
    if point is not None:
        for name in ("safe", "unsafe"):
            out[f"times_{name}"] = [getattr(f, name) / point for f in found]
    return {name: np.array(values) for name, values in out.items()}


def _sentences(found: list[FirstChange], over: str, point: float) -> list[str]:
    """Return sentences that compare limits with a value of the input.

    There is one for each line of cases or, for many lines, one for the lowest limit.

    found : up to which value of the input cases are damped, on each line
    over, point : name of the input; the value that limits are compared with
    """
    at_point = setting_text(over, point)
    if len(found) <= TOLD:
        return [f"{_place(f)}safe {f.times(point)} times {at_point}{_then(f)}"
                for f in found]  # fmt: skip
    least = min(found, key=lambda f: np.nan_to_num(f.safe))
    open_ = sum(not f.word for f in found)
    text = (
        f"{at_point}: the lowest of {len(found)} limits is {least.times(point)} times"
    )
    return [f"{text} this ({_place(least).rstrip(': ')}); no change was met on {open_}"]


def _place(found: FirstChange) -> str:
    return f"at {at}: " if (at := _line(found.fixed)) else ""


def _then(found: FirstChange) -> str:
    """Return the end of a sentence on a limit: the word of the next case above it.

    found : the limit on a line of cases
    """
    if not found.word:
        return ", the largest value tried"
    more = found.changes - (not np.isnan(found.safe))
    return f", then {found.word}" + (
        f"; {more} more change{'s' * (more > 1)}" if more else ""
    )


def each_input(args: argparse.Namespace, data: xarray.Dataset) -> int:
    """Print the safe range around a point along each input, and return the exit code.

    The point and its inputs are those of --at.
    """
    from hpcwhirl.analysis.margins import working_point

    found = working_point(data, _point(args.at), args.sure)
    columns = _each_columns(found)
    units = dict.fromkeys(columns, "")
    if print_data(args, columns, units, "inputs"):
        return 0
    with showing(asked_units(args.units)):
        for n in ("at", "distance", *ENDS):
            cells = map(_cell, columns["input"].tolist(), columns[n].tolist())
            columns[n] = np.array([*cells])
    print("safe range around the point along each input, with the other inputs at the "
          "point or at the nearest computed values")  # fmt: skip
    print_table(columns, units, len(found))
    return 0


def _point(settings: list[str]) -> dict[str, float]:
    """Return the point that --at gives, {input: value in SI}.

    settings : texts ``NAME=V`` of --at
    """
    from hpcwhirl.scene import input_names

    out: dict[str, float] = {}
    for text in settings:
        name, sign, raw = text.partition("=")
        if not sign:
            raise InputError(f"--at must be NAME=VALUE, got '{text}'")
        known = {*select.UNITS, *input_names()}
        variable = select.variable_of(name.strip(), known, "input of --at")
        if variable in out:
            raise InputError(f"--at {variable} is given twice")
        out[variable] = select.number_of(raw, variable, "--at")
    return out


def _each_columns(found: list[Along]) -> dict[str, Any]:
    """Return the table of safe ranges along each input, {column: (inputs,)}, in SI.

    found : safe range along each input around a point
    """
    out: dict[str, Any] = {"input": [a.name for a in found]}
    out["unit"] = [select.UNITS.get(a.name, "1") for a in found]
    out["at"] = [a.value for a in found]
    out |= {n: [getattr(a.found, n) for a in found] for n in (*ENDS, *WORDS)}
    out["distance"] = [a.found.distance(a.value) for a in found]
    out["line"] = [_line(a.found.fixed) for a in found]
    return {name: np.array(values) for name, values in out.items()}


def _line(fixed: Mapping[str, Any]) -> str:
    """Return a line of cases as text: the inputs that all of its cases share.

    fixed : {input: value in SI}
    """
    return ", ".join(setting_text(n, v) for n, v in fixed.items())


def _cell(variable: str, value: float) -> str:
    """Return an input's value as text, in the unit that the user chose; "" for NaN."""
    text = setting_text(variable, value).partition(" = ")[2]
    return "" if np.isnan(value) else text


def setting_text(variable: str, value: Any) -> str:
    """Return an input as text ``name = value unit``, in the unit that the user chose.

    variable, value : name of the input; its value in SI, or a text
    """
    if not isinstance(value, float):
        return f"{variable} = {value}"
    unit, factor = shown_in(select.UNITS.get(variable, "1"))
    return with_unit(f"{variable} = {factor * value:g}", unit, " ")
