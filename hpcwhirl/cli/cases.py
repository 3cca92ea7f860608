"""`hpcwhirl cases`: print cases of a campaign as a table, filtered and sorted."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.cli.command import add_option
from hpcwhirl.cli.options import OR_FILE
from hpcwhirl.cli.so_far import gathered_so_far
from hpcwhirl.cli.tables import (
    add_format,
    cell,
    in_units,
    print_data,
    print_table,
    unit_of,
)
from hpcwhirl.errors import InputError, say
from hpcwhirl.scene.units import with_unit
from hpcwhirl.store.reading.select import FINAL, counting, swept_of, where

if TYPE_CHECKING:
    import xarray

    from hpcwhirl.analysis.condition import Source

SHOWN = 200  # default number of rows of the printed table
NUMBERS = ("growth_rate", "orbit_radius", "contacts")
ENDS = ("outcome", "stop")  # columns that tell how the run of a case ended
TWINS = ("word_majority", "word_share", "twin_count")
Columns = dict[str, NDArray[Any]]


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `hpcwhirl cases` on its parser."""
    # fmt: off
    parser.add_argument("folder", type=Path, metavar="DIR", help=OR_FILE)
    add_option(parser, "--where CONDITION",
        'only cases that meet this condition, e.g. "regime == sustained and speed > '
        '400" or "word == failed"; word is the regime or, for cases without one, '
        "overloaded, unstable, failed or missing")
    add_option(parser, "--at NAME=V[,V]",
        "only cases with this value of an input", default=[])
    add_option(parser, "--sort NAME", "sort by this column, ascending")
    add_option(parser, "--reverse", "reverse the order: descending")
    add_option(parser, "--columns NAME[,NAME]",
        "columns in addition to case number and swept inputs; '?' lists all columns "
        "with their meanings")
    add_option(parser, "--limit N",
        f"rows of the printed table (default {SHOWN}; 0: all; CSV and JSON always "
        "have all)", default=SHOWN, type=int)
    add_format(parser)


def run(args: argparse.Namespace) -> int:
    """Print the chosen cases as a table, or the list of all columns (--columns '?').

    Returns the exit code
    """
    from hpcwhirl.analysis.columns import source_of
    from hpcwhirl.store.hdf5 import reading
    from hpcwhirl.store.reading.reader import open_coded
    from hpcwhirl.store.reading.results_file import results_of

    if args.limit < 0:
        raise InputError(f"--limit must be >= 0, got {args.limit}")
    gathered_so_far(args.folder)
    place = results_of(args.folder)
    with reading(place), open_coded(place) as data:
        if args.columns == "?":
            _tell_columns(data)
            return 0
        source = source_of(data)
        chosen = _chosen(args, data, source)
        columns = _columns(args, data, source, chosen)
        short = _shortened(columns, source, data)
        units = {n: unit_of(data, n) for n in columns}
        remark = _remark(args, source) if not len(chosen) else ""
    named = {"case", *(args.columns or "").replace(" ", "").split(",")}
    columns, units = in_units(args, columns, units)
    if not print_data(args, columns, units, "cases"):
        _print_first(columns | short, units, args.limit, named)
    if not len(chosen):
        say(f"no case matches{remark}")
    return 0


def _remark(args: argparse.Namespace, source: Source) -> str:
    """Return a clause why --where selects nothing, if it is that numbers are in SI."""
    from hpcwhirl.analysis.columns import unit_remark

    remark = unit_remark(args.where, source) if args.where else ""
    return f"; {remark}" if remark else ""


def _shortened(columns: Columns, source: Source, data: xarray.Dataset) -> Columns:
    """Return the columns whose texts are too long for a printed table, shortened.

    Long lists become ``#2 [0.1, …``: #2 is the second list that the input has in the
    campaign; ``--at`` accepts this number instead of the list.

    columns : columns of the chosen cases
    source, data : results of all cases, as columns by name and as a dataset
    """
    from hpcwhirl.report.map.axes import short_names

    short = {}
    for name in set(columns) & set(swept_of(data)):
        if columns[name].dtype.kind in "OUS":
            texts = list(dict.fromkeys(source.column(name).astype(str).tolist()))
            told = dict(zip(texts, short_names(texts), strict=True))
            values = columns[name].astype(str).tolist()
            short[name] = np.array([told[text] for text in values])
    return short


def _print_first(
    columns: Columns, units: dict[str, str], limit: int, named: set[str]
) -> None:
    """Print the first cases as a table, and the number of further ones.

    A value that is the same in all rows is printed once above the table.

    columns, units : {name: (rows,)}; {name: unit}
    limit, named : number of rows, 0 for all; columns that the user named, which are
        always printed in the table
    """
    count = len(columns["case"])
    shown = count if not limit else min(limit, count)
    same = [n for n, v in columns.items() if n not in named and _is_same(v)]
    if same:
        told = (with_unit(f"{n} = {cell(columns[n][0])}", units[n], " ") for n in same)
        print(f"all {count} cases: {', '.join(told)}")
    print_table({n: v for n, v in columns.items() if n not in same}, units, shown)
    if shown < count:
        print(f"{count - shown} more of {count} cases: --limit 0, --csv or --json")


def _is_same(values: NDArray[Any]) -> bool:
    """Return whether a column has the same value in all of several rows."""
    return len(values) > 1 and bool((values == values[0]).all())


def _chosen(
    args: argparse.Namespace, data: xarray.Dataset, source: Source
) -> NDArray[np.intp]:
    """Return numbers of the cases that --at and --where select, sorted by --sort.

    data, source : results of all cases, as a dataset and as columns by name
    """
    from hpcwhirl.analysis.columns import matching

    mask = np.ones(source.cases, dtype=bool)
    at = where(args.at, {n: data[n].to_numpy() for n in swept_of(data)})
    mask &= True if at is None else at
    if args.where is not None:
        mask &= matching(args.where, source)
    chosen = np.flatnonzero(mask)
    if not args.sort:
        return chosen[::-1] if args.reverse else chosen
    keys = source.column(source.variable(args.sort))[chosen]
    keys = keys.astype(str) if keys.dtype.kind == "O" else keys
    order = np.argsort(keys, kind="stable")
    if args.reverse:
        valid = keys[order] == keys[order]  # NaN stays last
        order = np.r_[order[valid][::-1], order[~valid]]
    return chosen[order]


def _columns(
    args: argparse.Namespace,
    data: xarray.Dataset,
    source: Source,
    chosen: NDArray[np.intp],
) -> Columns:
    from hpcwhirl.analysis.columns import WORD
    from hpcwhirl.scene.quantities import OVER_SPEED

    swept = swept_of(data) or ["speed"]
    if args.columns:
        wanted = [source.variable(n.strip()) for n in args.columns.split(",")]
    else:
        twins = (n for n in TWINS if n in data)
        numbers = (n for n in NUMBERS if n in data)
        over = (n for n in OVER_SPEED if n in data)
        again = [] if counting(data).all() else [FINAL]
        wanted = [WORD, *again, *ENDS, *twins, "whirl", *numbers, *over, "message"]
    names = dict.fromkeys(["case", *swept, *wanted])
    columns = {name: _counts(source.column(name), data, name) for name in names}
    if not np.array_equal(chosen, np.arange(source.cases)):
        columns = {name: values[chosen] for name, values in columns.items()}
    if not args.columns and not (columns["message"] != "").any():
        del columns["message"]
    return columns


def _counts(values: NDArray[Any], data: xarray.Dataset, name: str) -> NDArray[Any]:
    """Return a column for the table, in which counts are printed without a decimal.

    A column of counts has NaN for cases without a result, and so has become floats: its
    counts are turned back into whole numbers, its NaN stay. Other columns are returned
    as they are.

    values : (cases,), column `name`
    data : the results, whose type of this variable says whether it has counts
    """
    if values.dtype.kind != "f" or name not in data or data[name].dtype.kind == "f":
        return values
    told = values.tolist()
    whole = (int(v) if v == v else v for v in told)  # noqa: PLR0124 - NaN
    return np.fromiter(whole, dtype=object, count=len(told))


def _tell_columns(data: xarray.Dataset) -> None:
    from hpcwhirl.analysis.columns import WORD

    print(f"{WORD}: the regime, or overloaded, unstable, failed, missing")
    for name, variable in data.variables.items():
        if variable.dims == ("case",):
            meaning = variable.attrs.get("long_name", "")
            print(f"{with_unit(str(name), unit_of(data, str(name)))}: {meaning}")
