"""`hpcwhirl sensitivity`: print Sobol' indices of outputs for each drawn input."""

from __future__ import annotations

import argparse
import csv
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hpcwhirl.cli.command import add_option
from hpcwhirl.cli.options import OR_FILE, add_json, add_units, asked_units, print_json
from hpcwhirl.errors import say
from hpcwhirl.scene.units import showing, shown_in

if TYPE_CHECKING:
    import xarray

ENDS = ("first", "first_low", "first_high", "total", "total_low", "total_high")
FARTHEST = 64  # largest number of draws advised, as a multiple of the draws made
RESTS = ("draws", "dropped", "mean", "deviation")  # columns alike for all inputs
# not in the printed table, which has the ends of an interval beside its index
HIDDEN = {"first_low", "first_high", "total_low", "total_high", "mean", "deviation"}


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `hpcwhirl sensitivity` on its parser."""
    # fmt: off
    parser.add_argument("folder", type=Path, metavar="DIR", help=OR_FILE)
    add_option(parser, "--of NAME,...",
        "outputs: numeric variables, or regimes, which stand for the probability of "
        "that regime (default growth_rate,orbit_radius,divergent)", dest="names")
    add_option(parser, "--at NAME=V[,V]",
        "only points of the sweep with this value of a swept input", default=[])
    add_option(parser, "--out DIR",
        "directory for the figures (default: directory of the results)", type=Path)
    add_units(parser, "swept inputs and figures")
    add_option(parser, "--csv", "print the table as CSV")
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Print the Sobol' indices of outputs with their intervals, and draw them.

    Returns the exit code
    """
    from hpcwhirl.report.figures.indices import draw_sensitivity
    from hpcwhirl.store.hdf5 import reading
    from hpcwhirl.store.reading.reader import open_results
    from hpcwhirl.store.reading.results_file import results_of

    place, asked = results_of(args.folder), asked_units(args.units)
    with open_results(place) as data, reading(place), showing(asked):
        found = _found(args, data)
        paths = draw_sensitivity(data, found, args.out or place.parent)
    rows = _rows(found)
    if args.json:
        print_json({"indices": rows, "figures": [str(path) for path in paths]})
    elif args.csv:
        out = csv.DictWriter(sys.stdout, list(rows[0]), lineterminator="\n")
        out.writeheader()
        out.writerows(rows)
    else:
        _print_table(rows, found, asked)
        for path in paths:
            print(path)
    tell(found)
    return 0


def _found(args: argparse.Namespace, data: xarray.Dataset) -> xarray.Dataset:
    """Return the Sobol' indices that the command prints.

    They are those of the outputs in --of, at the points of the sweep that --at selects.
    """
    from hpcwhirl.store.reading.select import chosen
    from hpcwhirl.store.results.sampled import drawn_of
    from hpcwhirl.studies.sensitivity import USUAL, sensitivity

    names = [n.strip() for n in args.names.split(",")] if args.names else USUAL
    return sensitivity(chosen(data, args.at, drawn_of(data).swept), names)


def _rows(found: xarray.Dataset) -> list[dict[str, Any]]:
    """Return the rows of the printed table of Sobol' indices, {column: value} each.

    There is a row for each point of the sweep, output and drawn input.

    found : Sobol' indices, result of `_found`
    """
    from hpcwhirl.studies.shares import swept_in

    order = ["point", "quantity", "input"]
    names = [*swept_in(found), *order[1:], *ENDS, *RESTS]
    table = found.to_dataframe(dim_order=order).reset_index()
    return list(table[names].to_dict("records"))


def _print_table(
    rows: list[dict[str, Any]], found: xarray.Dataset, asked: tuple[str, ...]
) -> None:
    import numpy as np

    from hpcwhirl.cli.tables import print_table, unit_of

    shown = [name for name in rows[0] if name not in HIDDEN]
    columns = {name: np.array([row[name] for row in rows]) for name in shown}
    units = dict.fromkeys(columns, "")
    with showing(asked):
        for name in set(shown) & set(map(str, found.variables)):
            units[name], factor = shown_in(unit_of(found, name))
            columns[name] = columns[name] * factor if factor != 1.0 else columns[name]
    for order in ("first", "total"):
        columns[order] = np.array([_interval(row, order) for row in rows])
    print_table(columns, units, len(rows))


def _interval(row: dict[str, Any], order: str) -> str:
    """Return a Sobol' index with its confidence interval as text.

    row, order : a row of `_rows`; which index: "first" or "total"
    """
    value, low, high = (row[f"{order}{end}"] for end in ("", "_low", "_high"))
    if value != value:  # noqa: PLR0124 - NaN
        return "-"
    ends = "no interval" if low != low else f"{low:.3f}, {high:.3f}"  # noqa: PLR0124
    return f"{value:.3f} [{ends}]"


def tell(found: xarray.Dataset) -> None:
    """Print warnings on Sobol' indices on stderr.

    They name draws left out, outputs that do not vary, and wide intervals.

    found : Sobol' indices, result of `_found`
    """
    from hpcwhirl.studies.sensitivity import pairs_needed, widest

    for name in found["quantity"].values.tolist():
        one = found.sel(quantity=name)
        lost, used = int(one["dropped"].sum()), int(one["draws"].sum())
        if lost:
            text = f"{name}: {lost} of {lost + used} pairs of draws have a case without"
            say(f"{text} this number and are left out")
        still = int((one["deviation"] == 0.0).sum())
        if still:
            text = f"{name}: does not vary at {still} of {found.sizes['point']} points"
            say(f"{text}: no index there")
        needed, draws = pairs_needed(one), int(one["draws"].max())
        if needed:
            text = f"{name}: intervals up to {widest(one):.2g} wide: too few draws"
            how = f"about count = {needed} may suffice"
            if needed > FARTHEST * draws:
                how = f"even count = {FARTHEST * draws} may not suffice: the variance "
                how += "is due to a few cases"
            say(f"{text} ({draws}) to rank inputs; {how}")
