"""Ranges of damped cases of `hpcwhirl margin`, as a table and in sentences."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcwhirl.cli.margin_checks import (
    check_of,
    check_told,
    facts_of_checks,
    lines_and_checks,
)
from hpcwhirl.cli.options import asked_units
from hpcwhirl.cli.setting_text import line_text, setting_text, value_text
from hpcwhirl.cli.tables import in_units, print_data, print_table, unit_of
from hpcwhirl.errors import number_told
from hpcwhirl.scene.units import showing

if TYPE_CHECKING:
    import xarray

    from hpcwhirl.studies.margin_check import Check
    from hpcwhirl.studies.margins import Line, SafeRange

ENDS = ("low", "high", "below", "above")
WORDS = ("word_below", "word_above")
OVER = (*ENDS, "step", "distance")  # columns in the unit of the input of --over


def print_ranges(
    args: argparse.Namespace, data: xarray.Dataset, over: str, point: float | None
) -> int:
    """Print the ranges of damped cases of an input, and return the exit code.

    args, data : options of `hpcwhirl margin`; results of the selected cases
    over, point : name of the input; its value at the point of --at, or None
    """
    from hpcwhirl.studies.margins import ranges_of

    def parts(line: Line) -> list[tuple[float, float]]:
        return [(one.low, one.high) for one in ranges_of(line) if one.cases]

    lines, checks = lines_and_checks(args, data, over, parts)
    found = [one for line in lines for one in ranges_of(line)]
    columns = _columns(found, point) | _checked_columns(found, checks)
    units = {n: unit_of(data, over if n in OVER else n) for n in columns}
    columns, units = in_units(args, columns, units)
    facts = {"over": over} | ({"checks": facts_of_checks(checks)} if checks else {})
    if not print_data(args, columns, units, "ranges", **facts):
        print(f"over {over}, all cases from low to high are damped; up to a step "
              "between two cases nothing was computed")  # fmt: skip
        print_table(columns, units, len(found))
        with showing(asked_units(args.units)):
            print_told(found, checks, over)
            if point is not None:
                print(_nearest(found, checks, over, point))
    return 0


def print_told(found: Sequence[SafeRange], checks: Sequence[Check], over: str) -> None:
    """Print sentences on the checks of ranges, or that no case is damped."""
    if not any(one.cases for one in found):
        lines = len({tuple(one.fixed.values()) for one in found})
        print(f"no case is damped on any of {number_told(lines, 'line')} over {over}")
    for check in checks:
        print(check_told(check, over))


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


def _checked_columns(
    found: Sequence[SafeRange], checks: Sequence[Check]
) -> dict[str, Any]:
    """Return columns on the points drawn around each range, {} without --check."""
    if not checks:
        return {}
    own = [check_of(one, checks) for one in found]
    nan = float("nan")
    rows = [(len(c.drawn), c.damped, *c.share[1:]) if c else (0, 0, nan, nan)
            for c in own]  # fmt: skip
    names = ("drawn", "damped", "damped_low", "damped_high")
    return {n: np.array(v) for n, v in zip(names, zip(*rows, strict=True), strict=True)}


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
    far, step = (
        value_text(over, value) for value in (least.distance(point), least.step)
    )
    at = f" at {where}" if (where := line_text(least.fixed)) else ""
    check = check_of(least, checks)
    if check and check.holds:
        tried = f"{len(check.drawn)} drawn points"
        return f"{text}the nearest boundary is at least {far} away{at}, by {tried}"
    more = "" if checks else ": --check 20 tries points between"
    text += f"no computed case nearer than {far} is not damped{at}"
    return f"{text}, in steps of up to {step}{more}"
