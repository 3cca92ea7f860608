"""`hpcwhirl margin`: list ranges of damped cases, and a point's distance from others.

A range is a sample of the sweep; --check computes points between its cases.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcwhirl.cli.command import add_option
from hpcwhirl.cli.options import OR_FILE, asked_units, check_picture, seldom
from hpcwhirl.cli.tables import add_format, in_units, print_data, print_table, unit_of
from hpcwhirl.errors import InputError, number_told
from hpcwhirl.scene.units import showing, shown_in, with_unit
from hpcwhirl.store.reading import select

if TYPE_CHECKING:
    import xarray

    from hpcwhirl.store.reading.results_file import Results
    from hpcwhirl.studies.margin_check import Check
    from hpcwhirl.studies.margins import Along, FirstChange, Line, SafeRange

    Parts = Callable[[Line], Sequence[tuple[float, float]]]

ENDS = ("low", "high", "below", "above")
WORDS = ("word_below", "word_above")
NAMED = 6  # largest number of drawn points that a sentence names
MOST = 10_000  # largest number of points that --check draws in a range
TOLD = 12  # largest number of lines of cases for each of which a sentence is printed
OVER = (*ENDS, "step", "distance")  # columns in the unit of the input of --over


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `hpcwhirl margin` on its parser."""
    # fmt: off
    parser.add_argument("folder", type=Path, metavar="DIR", help=OR_FILE)
    add_option(parser, "--over NAME",
        "swept input over which ranges of damped cases are listed (default speed); "
        "each: for every input of --at, the range around that point", default="speed")
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
    if args.check is not None and not 1 <= args.check <= MOST:
        msg = f"--check must be >= 1 and <= {MOST} points in each range, got "
        raise InputError(f"{msg}{args.check}")
    if args.plot and not args.first:
        raise InputError("--plot draws the limits that --first lists: add --first")
    if args.first and args.over == "each":
        msg = "--first needs one input: --over must be a swept input, got each"
        raise InputError(msg)
    check_picture(args.plot)


def _print_ranges(
    args: argparse.Namespace, data: xarray.Dataset, over: str, point: float | None
) -> int:
    from hpcwhirl.studies.margins import ranges_of

    def parts(line: Line) -> list[tuple[float, float]]:
        return [(one.low, one.high) for one in ranges_of(line) if one.cases]

    lines, checks = _lines(args, data, over, parts)
    found = [one for line in lines for one in ranges_of(line)]
    columns = _columns(found, point) | _checked_columns(found, checks)
    units = {n: unit_of(data, over if n in OVER else n) for n in columns}
    columns, units = in_units(args, columns, units)
    facts = {"over": over} | ({"checks": _facts(checks)} if checks else {})
    if not print_data(args, columns, units, "ranges", **facts):
        print(f"over {over}, all cases from low to high are damped; up to a step "
              "between two cases nothing was computed")  # fmt: skip
        print_table(columns, units, len(found))
        with showing(asked_units(args.units)):
            _print_told(found, checks, over)
            if point is not None:
                print(_nearest(found, checks, over, point))
    return 0


def _print_told(found: Sequence[SafeRange], checks: Sequence[Check], over: str) -> None:
    """Print sentences on the checks of ranges, or that no case is damped."""
    if not any(one.cases for one in found):
        lines = len({tuple(one.fixed.values()) for one in found})
        print(f"no case is damped on any of {number_told(lines, 'line')} over {over}")
    for check in checks:
        print(_check_told(check, over))


def _lines(
    args: argparse.Namespace, data: xarray.Dataset, over: str, parts: Parts
) -> tuple[list[Line], list[Check]]:
    """Return the lines of cases over an input, and the checks that --check asks for.

    parts : function from a line to the ends of its parts that are checked
    """
    from hpcwhirl.store.reading.results_file import Results, results_of
    from hpcwhirl.studies.margins import lines_of

    lines = lines_of(data, over, args.sure)
    if not args.check:
        return lines, []
    _check_followers(data, over, lines[0])
    out, checks = [], []
    with Results(results_of(args.folder)) as results:
        for line in lines:
            checked, own = _drawn(args, results, over, line, parts(line))
            out.append(checked)
            checks += own
    return out, checks


def _check_followers(data: xarray.Dataset, over: str, line: Line) -> None:
    """Raise InputError if another input changes along a line, as in [zip].

    data, over, line : results; the input that differs along the line; the line
    """
    for name in {*select.swept_of(data)} - {over, *line.fixed}:
        if len(set(data[name].to_numpy().tolist())) > 1:
            msg = f"--check needs inputs that do not change with {over}, but {name} "
            raise InputError(f"{msg}has values only where cases were computed")


def _drawn(
    args: argparse.Namespace,
    results: Results,
    over: str,
    line: Line,
    parts: Sequence[tuple[float, float]],
) -> tuple[Line, list[Check]]:
    """Compute the points that --check draws inside parts of a line.

    Returns the line with these points, and a check for each part with several cases.
    """
    from hpcwhirl.studies.margin_check import check_line

    wide = [(low, high) for low, high in parts if low < high]
    tell = seldom(lambda text: print(f"margin: {text}", file=sys.stderr))
    return check_line(results, over, line, wide, args.check, tell=tell)


def _facts(checks: Sequence[Check]) -> list[dict[str, Any]]:
    """Return checks as data for JSON: ends of each range, its points, the share."""
    names = ("share", "share_low", "share_high")
    return [
        {
            **check.fixed, "low": check.low, "high": check.high,
            "drawn": len(check.drawn), "damped": check.damped,
            **dict(zip(names, check.share, strict=True)),
            "not_damped": [one._asdict() for one in check.unsafe],
        }
        for check in checks
    ]  # fmt: skip


def _check_of(found: SafeRange, checks: Sequence[Check]) -> Check | None:
    """Return the check of the range from which a range is left; None if none was."""
    for check in checks:
        if check.fixed == found.fixed and check.low <= found.low <= check.high:
            return check
    return None


def _checked_columns(
    found: Sequence[SafeRange], checks: Sequence[Check]
) -> dict[str, Any]:
    """Return columns on the points drawn around each range, {} without --check."""
    if not checks:
        return {}
    own = [_check_of(one, checks) for one in found]
    nan = float("nan")
    rows = [(len(c.drawn), c.damped, *c.share[1:]) if c else (0, 0, nan, nan)
            for c in own]  # fmt: skip
    names = ("drawn", "damped", "damped_low", "damped_high")
    return {n: np.array(v) for n, v in zip(names, zip(*rows, strict=True), strict=True)}


def _check_told(check: Check, over: str) -> str:
    """Return a sentence on the points drawn inside a range.

    over : name of the input
    """
    share, low, high = check.share
    line = f"at {at}, " if (at := _line(check.fixed)) else ""
    ends = f"{setting_text(over, check.low)} to {_cell(over, check.high)}"
    text = f"{line}{ends}: {check.damped} of {len(check.drawn)} points drawn inside "
    text += f"are damped, {share:.2f} [{low:.2f}, {high:.2f}]"
    bad = [f"{_cell(over, one.value)} ({one.word})" for one in check.unsafe]
    more = f" and {len(bad) - NAMED} more" if len(bad) > NAMED else ""
    return text + (f"; not at {', '.join(bad[:NAMED])}{more}" if bad else "")


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
    out |= {n: [getattr(r, n) for r in found] for n in (*ENDS, *WORDS, "cases", "step")}
    if any(np.isfinite(r.share) for r in found):
        out["least_share"] = [r.share for r in found]
    if point is not None:
        out["distance"] = [r.distance(point) for r in found]
    return {name: np.array(values) for name, values in out.items()}


def _nearest(
    found: Sequence[SafeRange], checks: Sequence[Check], over: str, point: float
) -> str:
    """Return a sentence on how far a point lies inside a range of damped cases.

    "At least" stands only where all points drawn inside that range are damped, too.

    found, checks : ranges of the input; their checks, [] without --check
    over, point : name of the input; its value at the point
    """
    inside = [r for r in found if r.distance(point) >= 0.0]
    lines = len({tuple(r.fixed.values()) for r in found})
    at_point = setting_text(over, point)
    if not inside:
        return f"{at_point}: in no range of damped cases on any of {lines} lines"
    least = min(inside, key=lambda r: r.distance(point))
    count = len({tuple(r.fixed.values()) for r in inside})
    text = f"{at_point}: in a range of damped cases on {count} of {lines} lines; "
    if not np.isfinite(least.distance(point)):
        return f"{text}no case beyond it"
    far, step = (_cell(over, value) for value in (least.distance(point), least.step))
    at = f" at {where}" if (where := _line(least.fixed)) else ""
    check = _check_of(least, checks)
    if check and check.holds:
        tried = f"{len(check.drawn)} drawn points"
        return f"{text}the nearest boundary is at least {far} away{at}, by {tried}"
    more = "" if checks else ": --check 20 tries points between"
    text += f"no computed case nearer than {far} is not damped{at}"
    return f"{text}, in steps of up to {step}{more}"


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
    from hpcwhirl.studies.margins import first_of

    def parts(line: Line) -> list[tuple[float, float]]:
        safe = first_of(line).safe
        return [] if np.isnan(safe) else [(float(line.values[0]), safe)]

    lines, checks = _lines(args, data, over, parts)
    found = [first_of(line) for line in lines]
    columns = _first_columns(found, point)
    ends = ("safe", "unsafe", "step")
    units = {n: unit_of(data, over if n in ends else n) for n in columns}
    columns, units = in_units(args, columns, units)
    facts = {"over": over, "at": point} | ({"checks": _facts(checks)} if checks else {})
    if not print_data(args, columns, units, "first", **facts):
        print(f"all cases from the least {over} up to safe are damped; unsafe: the "
              "next; up to a step between two cases nothing was computed")  # fmt: skip
        print_table(columns, units, len(found))
        with showing(asked_units(args.units)):
            if point is not None:
                print("\n".join(_sentences(found, over, point)))
            for check in checks:
                print(_check_told(check, over))
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
    out |= {n: [getattr(f, n) for f in found] for n in ("changes", "step")}
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
        return [f"{_place(f)}{_limit(f, point)} times {at_point}{_then(f, point)}"
                for f in found]  # fmt: skip
    least = min(found, key=lambda f: np.nan_to_num(f.safe))
    open_ = sum(not f.word for f in found)
    text = f"{at_point}: of {len(found)} lines the lowest is {_limit(least, point)} "
    text += f"times this ({_place(least).rstrip(': ')})"
    return [f"{text}; no change was met on {open_}"]


def _limit(found: FirstChange, point: float) -> str:
    """Return a limit as text, as a multiple of a value of the input.

    It is ``damped up to 1.7``, or ``sustained at 0.5`` if the first case is.
    """
    if np.isnan(found.safe):
        return f"{found.word} at {found.unsafe / point:.4g}"
    return f"damped up to {found.safe / point:.4g}"


def _place(found: FirstChange) -> str:
    return f"at {at}: " if (at := _line(found.fixed)) else ""


def _then(found: FirstChange, point: float) -> str:
    """Return the end of a sentence on a limit: the steps, and the next case above it.

    found : the limit on a line of cases
    point : value of the input, of which steps are multiples
    """
    steps = "" if np.isnan(found.step) else f" in steps of {found.step / point:.4g}"
    if not found.word:
        return f"{steps}, the largest value tried"
    if np.isnan(found.safe):
        text, more = ", the least value tried", found.changes
    else:
        text = f"{steps}, then {found.word} at {found.unsafe / point:.4g}"
        more = found.changes - 1
    return text + (f"; {number_told(more, 'more change')}" if more else "")


def each_input(args: argparse.Namespace, data: xarray.Dataset) -> int:
    """Print the safe range around a point along each input, and return the exit code.

    The point and its inputs are those of --at.
    """
    from hpcwhirl.studies.margins import working_point

    found = working_point(data, _point(args.at), args.sure)
    both = [_along(args, data, one) for one in found]
    found = [one for one, _ in both]
    checks = {one.name: own for one, own in both if own}
    columns = _each_columns(found)
    units = dict.fromkeys(columns, "")
    told = {name: _facts(own) for name, own in checks.items()}
    if print_data(args, columns, units, "inputs", **({"checks": told} if told else {})):
        return 0
    with showing(asked_units(args.units)):
        for n in ("at", *OVER):
            cells = map(_cell, columns["input"].tolist(), columns[n].tolist())
            columns[n] = np.array([*cells])
        print("range of damped cases around the point along each input, with the other "
              "inputs at the point or at the nearest computed values; up to a step "
              "between two cases nothing was computed")  # fmt: skip
        print_table(columns, units, len(found))
        for one in found:
            _print_told([one.found], checks.get(one.name, []), one.name)
    return 0


def _along(
    args: argparse.Namespace, data: xarray.Dataset, one: Along
) -> tuple[Along, list[Check]]:
    """Return the range around a point along one input after the check of --check."""
    from hpcwhirl.store.reading.results_file import Results, results_of
    from hpcwhirl.studies.margins import Along, lines_of, nearest_range, ranges_of

    if not args.check or not one.found.cases:
        return one, []
    lines = lines_of(data, one.name, args.sure)
    line = next(line for line in lines if line.fixed == one.found.fixed)
    _check_followers(data, one.name, line)
    with Results(results_of(args.folder)) as results:
        ends = [(one.found.low, one.found.high)]
        line, checks = _drawn(args, results, one.name, line, ends)
    found = nearest_range(ranges_of(line), one.value)
    return Along(one.name, one.value, found), checks


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
    out |= {n: [getattr(a.found, n) for a in found] for n in (*ENDS, *WORDS, "step")}
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
