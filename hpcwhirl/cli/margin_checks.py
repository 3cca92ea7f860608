"""The points that `hpcwhirl margin --check` computes between the cases of a range."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from hpcwhirl.cli.options import seldom
from hpcwhirl.cli.setting_text import line_text, setting_text, value_text
from hpcwhirl.errors import InputError
from hpcwhirl.store.reading import select

if TYPE_CHECKING:
    import xarray

    from hpcwhirl.store.reading.results_file import Results
    from hpcwhirl.studies.margin_check import Check
    from hpcwhirl.studies.margins import Line, SafeRange

    Parts = Callable[[Line], Sequence[tuple[float, float]]]

NAMED = 6  # largest number of drawn points that a sentence names


def lines_and_checks(
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
    check_followers(data, over, lines[0])
    out, checks = [], []
    with Results(results_of(args.folder)) as results:
        for line in lines:
            checked, own = drawn_in(args, results, over, line, parts(line))
            out.append(checked)
            checks += own
    return out, checks


def check_followers(data: xarray.Dataset, over: str, line: Line) -> None:
    """Raise InputError if another input changes along a line, as in [zip].

    data, over, line : results; the input that differs along the line; the line
    """
    for name in {*select.swept_of(data)} - {over, *line.fixed}:
        if len(set(data[name].to_numpy().tolist())) > 1:
            msg = f"--check needs inputs that do not change with {over}, but {name} "
            raise InputError(f"{msg}has values only where cases were computed")


def drawn_in(
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


def facts_of_checks(checks: Sequence[Check]) -> list[dict[str, Any]]:
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


def check_of(found: SafeRange, checks: Sequence[Check]) -> Check | None:
    """Return the check of the range from which a range is left; None if none was."""
    for check in checks:
        if check.fixed == found.fixed and check.low <= found.low <= check.high:
            return check
    return None


def check_told(check: Check, over: str) -> str:
    """Return a sentence on the points drawn inside a range.

    over : name of the input
    """
    share, low, high = check.share
    line = f"at {at}, " if (at := line_text(check.fixed)) else ""
    ends = f"{setting_text(over, check.low)} to {value_text(over, check.high)}"
    text = f"{line}{ends}: {check.damped} of {len(check.drawn)} points drawn inside "
    text += f"are damped, {share:.2f} [{low:.2f}, {high:.2f}]"
    bad = [f"{value_text(over, one.value)} ({one.word})" for one in check.unsafe]
    more = f" and {len(bad) - NAMED} more" if len(bad) > NAMED else ""
    return text + (f"; not at {', '.join(bad[:NAMED])}{more}" if bad else "")
