"""`hpcwhirl compare`: two campaigns side by side, where their cases meet."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcwhirl.cli.command import add_option
from hpcwhirl.cli.options import OR_FILE, asked_units, check_picture
from hpcwhirl.cli.tables import add_format, in_units, print_data, print_table
from hpcwhirl.scene.units import showing
from hpcwhirl.store.reading.select import UNITS, variable_of

if TYPE_CHECKING:
    from hpcwhirl.studies.comparison import Comparison

LEAST = 12  # default number of printed rows of the numbers that moved
MOST = 40  # largest number of printed cases whose word changed


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `hpcwhirl compare` on its parser."""
    # fmt: off
    parser.add_argument("a", type=Path, metavar="A", help=OR_FILE)
    parser.add_argument("b", type=Path, metavar="B", help="the same, to compare with A")
    add_option(parser, "--plot FILE",
        "draw the words of both over one or two inputs (.png, .svg or .pdf)", type=Path)
    for side in ("x", "y"):
        add_option(parser, f"--{side} NAME", f"input on the {side} axis of --plot")
    add_option(parser, "--numbers N",
        f"rows of the table of numbers that moved (default {LEAST}; 0: all)",
        default=LEAST, type=int)
    add_format(parser)


def run(args: argparse.Namespace) -> int:
    """Print which words changed and which numbers moved; return the exit code.

    CSV and JSON have a row for each case that meets one of the other campaign.
    """
    from hpcwhirl.store.hdf5 import reading
    from hpcwhirl.store.reading.reader import open_results
    from hpcwhirl.store.reading.results_file import results_of
    from hpcwhirl.studies.comparison import compare

    check_picture(args.plot)
    with (
        reading(results_of(args.a)),
        reading(results_of(args.b)),
        open_results(args.a) as a,
        open_results(args.b) as b,
    ):
        found = compare(a, b)
    if args.plot:
        _draw(args, found)
    columns, shown = in_units(args, *_pairs(found))
    facts: dict[str, Any] = {
        "changed": int(found.changed.sum()),
        "alone": list(found.alone),
        "inputs": {name: list(pair) for name, pair in found.inputs.items()},
        "moved": [vars(one) for one in found.moved],
    }
    if not print_data(args, columns, shown, "cases", **facts):
        _print(args, found, columns, shown)
    return 0


def _pairs(found: Comparison) -> tuple[dict[str, Any], dict[str, str]]:
    """Return a row for each pair of cases, {column: (n,)} in SI, and {column: unit}."""
    columns: dict[str, Any] = dict(found.at)
    units = {n: "" if UNITS.get(n, "1") == "1" else UNITS[n] for n in found.at}
    more = {
        "case_a": found.cases[:, 0],
        "case_b": found.cases[:, 1],
        "word_a": found.words[:, 0].astype(object),
        "word_b": found.words[:, 1].astype(object),
    }
    return columns | more, units | dict.fromkeys(more, "")


def _print(
    args: argparse.Namespace,
    found: Comparison,
    columns: dict[str, Any],
    shown: dict[str, str],
) -> None:
    """Print the comparison as text.

    columns, shown : a row for each pair, in the units shown
    """
    count, changed = len(found.words), found.changed
    print(f"{count} cases meet; A has {found.alone[0]} others, B {found.alone[1]}")
    for name, (a, b) in found.inputs.items():
        print(f"  {name}: {a} in A, {b} in B")
    print(f"words: {int(changed.sum())} of {count} changed")
    pairs = found.transitions()
    ends = [np.array([pair[i] for pair in pairs], object) for i in (0, 1)]
    table = {"A": ends[0], "B": ends[1], "cases": np.array([*pairs.values()])}
    print_table(table, dict.fromkeys(table, ""), len(pairs))
    if changed.any():
        print()
        some = {n: v[changed] for n, v in columns.items()}
        print_table(some, shown, min(MOST, int(changed.sum())))
        if changed.sum() > MOST:
            print(f"{changed.sum() - MOST} more: --csv or --json")
    print("\nnumbers that moved, |B - A| / larger of both, over the cases that meet")
    rows = found.moved[: args.numbers or None]
    fields = ("name", "cases", "differ", "median", "ninety", "largest")
    moved = {n: np.array([getattr(m, n) for m in rows]) for n in fields}
    moved["name"] = moved["name"].astype(object)
    print_table(moved, dict.fromkeys(moved, ""), len(rows))


def _draw(args: argparse.Namespace, found: Comparison) -> None:
    """Write the figure of --plot."""
    from hpcwhirl.report.figures.comparison import axes_of, write_comparison

    asked = [variable_of(n, found.over) if n else None for n in (args.x, args.y)]
    with showing(asked_units(args.units)):
        print(write_comparison(found, axes_of(found, *asked), args.plot))
