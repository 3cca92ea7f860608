"""`hpcwhirl cases`: the cases of a campaign as a table, chosen and sorted."""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.cli.options import OR_FILE, print_json
from hpcwhirl.scene.quantity import with_unit

if TYPE_CHECKING:
    import xarray

    from hpcwhirl.store.reading.query import Source

SHOWN = 200  # rows of a table on a terminal
AT_ONCE = 10_000  # rows of CSV: Python's objects take ten times what arrays do
NUMBERS = ("growth_rate", "orbit_radius", "contacts")
WORD = "word"  # regime, or why there is none
Columns = dict[str, NDArray[Any]]


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("folder", type=Path, metavar="DIR", help=OR_FILE)
    parser.add_argument(
        "--where", metavar="CONDITION",
        help='e.g. "regime == sustained and speed > 400", or "word == failed"; word is '
        "the regime, or unstable, failed, missing",
    )  # fmt: skip
    parser.add_argument(
        "--at", action="append", default=[], metavar="NAME=V[,V]",
        help="only cases with this value of an input",
    )  # fmt: skip
    parser.add_argument("--sort", metavar="NAME", help="by this column, ascending")
    parser.add_argument("--reverse", action="store_true", help="descending")
    parser.add_argument(
        "--columns", metavar="NAME[,NAME]",
        help="what is shown besides case and swept inputs; ?: tell what there is",
    )  # fmt: skip
    parser.add_argument(
        "--limit", type=int, default=SHOWN, metavar="N",
        help=f"rows of the table (default {SHOWN}; 0: all; CSV and JSON have all)",
    )  # fmt: skip
    how = parser.add_mutually_exclusive_group()
    how.add_argument("--csv", action="store_true", help="print comma-separated values")
    how.add_argument("--json", action="store_true", help="print facts as JSON")


def run(args: argparse.Namespace) -> int:
    """Print the table."""
    from hpcwhirl.errors import InputError
    from hpcwhirl.store.hdf5 import reading
    from hpcwhirl.store.reading.reader import open_results, results_of

    if args.limit < 0:
        msg = f"--limit must be >= 0, got {args.limit}"
        raise InputError(msg)
    place = results_of(args.folder)
    with reading(place), open_results(place) as data:
        if args.columns == "?":
            _tell_columns(data)
            return 0
        source = source_of(data)
        chosen = _chosen(args, data, source)
        columns = _columns(args, data, source, chosen)
        units = {n: _unit(data, n) for n in columns}
    if args.csv:
        _print_csv(columns, units)
    elif args.json:
        print_json({"units": {n: u for n, u in units.items() if u},
                    "cases": _records(columns)})  # fmt: skip
    else:
        _print_table(columns, units, args.limit)
    return 0


def source_of(data: xarray.Dataset) -> Source:
    """Return the columns of a file, and `case` and `word`, for conditions."""
    from hpcwhirl.errors import InputError, nearest
    from hpcwhirl.scene.words import ENUMS, SHOWN
    from hpcwhirl.store.reading.query import Source
    from hpcwhirl.store.reading.reader import words
    from hpcwhirl.store.reading.select import variable_of
    from hpcwhirl.store.reading.shown import words_of

    known = [str(n) for n, v in data.variables.items() if v.dims == ("case",)]

    def variable(name: str) -> str:
        if name == WORD or name in known:
            return name
        try:
            return variable_of(name, known, "variable")
        except InputError:
            hint = nearest(name, known) or "; --columns '?' lists what there is"
            msg = f"unknown variable '{name}'{hint}"
            raise InputError(msg) from None

    def column(name: str) -> NDArray[Any]:
        if name != WORD:
            return np.asarray(data[name].to_numpy())
        return words_of(*(words(data[n]) for n in ("status", "outcome", "regime")))

    allowed: dict[str, Any] = {n: ENUMS[n] for n in ENUMS if n in known}
    return Source(variable, column, allowed | {WORD: tuple(SHOWN)}, data.sizes["case"])


def _chosen(
    args: argparse.Namespace, data: xarray.Dataset, source: Source
) -> NDArray[np.intp]:
    """Return the numbers of the cases asked for, in the order asked for."""
    from hpcwhirl.store.reading.query import matching
    from hpcwhirl.store.reading.select import swept_of, where

    found = np.ones(source.cases, dtype=bool)
    at = where(args.at, {n: data[n].to_numpy() for n in swept_of(data)})
    found &= True if at is None else at
    if args.where is not None:
        found &= matching(args.where, source)
    chosen = np.flatnonzero(found)
    if not args.sort:
        return chosen[::-1] if args.reverse else chosen
    keys = source.column(source.variable(args.sort))[chosen]
    keys = keys.astype(str) if keys.dtype.kind == "O" else keys
    order = np.argsort(keys, kind="stable")
    if args.reverse:
        known = keys[order] == keys[order]
        order = np.r_[order[known][::-1], order[~known]]
    return chosen[order]


def _columns(
    args: argparse.Namespace,
    data: xarray.Dataset,
    source: Source,
    chosen: NDArray[np.intp],
) -> Columns:
    from hpcwhirl.store.reading.select import swept_of

    swept = swept_of(data) or ["speed"]
    if args.columns:
        wanted = [source.variable(n.strip()) for n in args.columns.split(",")]
    else:
        wanted = [WORD, "whirl", *(n for n in NUMBERS if n in data), "message"]
    names = dict.fromkeys(["case", *swept, *wanted])
    columns = {name: source.column(name)[chosen] for name in names}
    if not args.columns and not (columns["message"] != "").any():
        del columns["message"]
    return columns


def _unit(data: xarray.Dataset, name: str) -> str:
    unit = str(data[name].attrs.get("units", "")) if name in data else ""
    return "" if unit == "1" else unit


def _tell_columns(data: xarray.Dataset) -> None:
    print(f"{WORD}: the regime, or unstable, failed, missing")
    for name, variable in data.variables.items():
        if variable.dims == ("case",):
            told = variable.attrs.get("long_name", "")
            print(f"{with_unit(str(name), _unit(data, str(name)))}: {told}")


def _print_csv(columns: Columns, units: Mapping[str, str]) -> None:
    out = csv.writer(sys.stdout, lineterminator="\n")
    out.writerow(f"{n} [{units[n]}]" if units[n] else n for n in columns)
    for start in range(0, len(columns["case"]), AT_ONCE):
        part = slice(start, start + AT_ONCE)
        rows = zip(*(c[part].tolist() for c in columns.values()), strict=True)
        out.writerows(rows)


def _records(columns: Columns) -> list[dict[str, Any]]:
    rows = zip(*(c.tolist() for c in columns.values()), strict=True)
    return [dict(zip(columns, row, strict=True)) for row in rows]


def _print_table(columns: Columns, units: Mapping[str, str], limit: int) -> None:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    count = len(columns["case"])
    shown = count if not limit else min(limit, count)
    table = Table(box=None, pad_edge=False)
    for name, values in columns.items():
        head = name + (f"\n{units[name]}" if units[name] else "")
        right = values.dtype.kind in "iuf"
        table.add_column(Text(head), justify="right" if right else "left")
    for row in zip(*(c[:shown].tolist() for c in columns.values()), strict=True):
        table.add_row(*(Text(_cell(value)) for value in row))
    wide = None if sys.stdout.isatty() else 100_000  # a pipe gets whole lines
    Console(width=wide).print(table)
    if not count:
        print("hpcwhirl: no case is as asked", file=sys.stderr)
    if shown < count:
        print(f"{count - shown} more of {count} cases: --limit 0, --csv or --json")


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return "" if value != value else f"{value:.6g}"  # noqa: PLR0124 - NaN
    return str(value)
