"""The limit of `hpcwhirl margin --first`: up to which value cases are damped."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcwhirl.cli.margin_checks import check_told, facts_of_checks, lines_and_checks
from hpcwhirl.cli.options import asked_units
from hpcwhirl.cli.setting_text import line_text, setting_text
from hpcwhirl.cli.tables import in_units, print_data, print_table, unit_of
from hpcwhirl.errors import number_told
from hpcwhirl.scene.units import showing

if TYPE_CHECKING:
    import xarray

    from hpcwhirl.studies.margins import FirstChange, Line

TOLD = 12  # largest number of lines of cases for each of which a sentence is printed


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

    lines, checks = lines_and_checks(args, data, over, parts)
    found = [first_of(line) for line in lines]
    columns = _first_columns(found, point)
    ends = ("safe", "unsafe", "step")
    units = {n: unit_of(data, over if n in ends else n) for n in columns}
    columns, units = in_units(args, columns, units)
    facts = {"over": over, "at": point} | (
        {"checks": facts_of_checks(checks)} if checks else {}
    )
    if not print_data(args, columns, units, "first", **facts):
        print(f"all cases from the least {over} up to safe are damped; unsafe: the "
              "next; up to a step between two cases nothing was computed")  # fmt: skip
        print_table(columns, units, len(found))
        with showing(asked_units(args.units)):
            if point is not None:
                print("\n".join(_sentences(found, over, point)))
            for check in checks:
                print(check_told(check, over))
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
    return f"at {at}: " if (at := line_text(found.fixed)) else ""


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
