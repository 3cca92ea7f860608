"""Printing of results as a table, as CSV or as JSON.

The data are columns, {name: (rows,)}, and their units, {name: unit}.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.cli.command import add_option
from hpcwhirl.cli.options import add_json, add_units, asked_units, json_of
from hpcwhirl.errors import csv_cell, one_line
from hpcwhirl.scene.units import AS_STORED, showing, shown_in

if TYPE_CHECKING:
    import xarray

SPELLS = "words_over_speed"
AT_ONCE = 10_000  # rows converted at a time: Python objects take 10 times the memory
Columns = Mapping[str, NDArray[Any]]
Units = Mapping[str, str]


def add_format(parser: argparse.ArgumentParser) -> None:
    """Add the options ``--units``, ``--csv``, ``--json`` and ``--no-units``."""
    # fmt: off
    add_units(parser, "numbers")
    add_option(parser, "--no-units", "write CSV headers without units")
    how = parser.add_mutually_exclusive_group()
    add_option(how, "--csv", "print comma-separated values")
    add_json(how)


def unit_of(data: xarray.Dataset, name: str) -> str:
    """Return the SI unit of a variable of results; "" without unit or variable."""
    unit = str(data[name].attrs.get("units", "")) if name in data else ""
    return "" if unit == "1" else unit


def in_units(
    args: argparse.Namespace, columns: Columns, units: Units
) -> tuple[dict[str, NDArray[Any]], dict[str, str]]:
    """Return columns converted to the units that the user chose, and these units.

    Parameters
    ----------
    args : arguments that include the options of `add_format`
    columns : {name: values (rows,)}, in SI
    units : {name: unit}, "" for a column without a unit
    """
    asked, stored = asked_units(args.units), args.units is None and _is_data(args)
    if stored:
        asked = (AS_STORED,)
    with showing(asked):
        shown = {name: shown_in(unit) for name, unit in units.items()}
        spells = {SPELLS} & ({*columns} if not stored else set())
        told = {name: _spells(columns[name]) for name in spells}
    return (
        {n: _times(values, shown[n][1]) for n, values in columns.items()} | told,
        {name: unit for name, (unit, _) in shown.items()},
    )


def _spells(values: NDArray[Any]) -> NDArray[Any]:
    """Return texts of `words_over_speed` with speeds in the unit that is shown."""
    from hpcwhirl.analysis.over_speed import in_shown_units

    return np.array([in_shown_units(one) for one in values.tolist()], dtype=object)


def _is_data(args: argparse.Namespace) -> bool:
    return bool(args.csv or args.json)


def _times(values: NDArray[Any], factor: float) -> NDArray[Any]:
    """Return values in another unit, rounded to 15 digits.

    values, factor : (rows,), in SI; from SI to the unit
    """
    if factor == 1.0:
        return values
    return np.array([float(f"{factor * one:.15g}") for one in values.tolist()])


def print_data(
    args: argparse.Namespace, columns: Columns, units: Units, rows: str, **facts: Any
) -> bool:
    """Print columns as CSV or JSON if ``--csv`` or ``--json`` is given.

    Parameters
    ----------
    args : arguments that include the options of `add_format`
    columns : {name: values (rows,)}
    units : {name: unit}, "" for a column without a unit
    rows : key of the list of rows in the JSON object
    facts : further entries of the JSON object

    Returns
    -------
    whether one of the options is given; otherwise nothing is printed
    """
    if args.csv:
        _print_csv(columns, units, headed=not args.no_units)
    elif args.json:
        told = {n: u for n, u in units.items() if u}
        _print_json({**facts, "units": told}, rows, columns)
    return _is_data(args)


def _print_json(facts: Mapping[str, Any], rows: str, columns: Columns) -> None:
    """Print a JSON object on stdout: facts, and columns as a list of rows.

    Parameters
    ----------
    facts : entries of the object, at least one
    rows : key of the list, whose elements are {column: value}
    columns : {name: values (rows,)}
    """
    print(json_of(facts).removesuffix("\n}"), end=f',\n  "{rows}": [')
    between, close = "", "]"
    for part in _parts(columns):
        each = [dict(zip(columns, row, strict=True)) for row in zip(*part, strict=True)]
        listed = json_of(each)[1:-2].replace("\n", "\n  ")
        print(between + listed, end="")
        between, close = ",", "\n  ]"
    print(f"{close}\n}}")


def _parts(columns: Columns) -> Iterator[list[list[Any]]]:
    """Yield the values of each column as lists, `AT_ONCE` rows at a time."""
    rows = len(next(iter(columns.values())))
    for start in range(0, rows, AT_ONCE):
        yield [c[start : start + AT_ONCE].tolist() for c in columns.values()]


def _print_csv(columns: Columns, units: Units, *, headed: bool) -> None:
    """Print columns as CSV on stdout, with a header.

    Parameters
    ----------
    columns : {name: values (rows,)}
    units : {name: unit}, "" for a column without a unit
    headed : whether headers are ``name [unit]`` instead of ``name``
    """
    out = csv.writer(sys.stdout, lineterminator="\n")
    out.writerow(f"{n} [{units[n]}]" if headed and units[n] else n for n in columns)
    for part in _parts(columns):
        out.writerows(zip(*(map(csv_cell, values) for values in part), strict=True))


def print_table(columns: Columns, units: Units, shown: int) -> None:
    """Print columns as a table on stdout, with their names and units above.

    In a terminal texts are wrapped at spaces; a number or word is never shortened, so
    that lines may be longer than a narrow terminal.

    columns, units : {name: (rows,)}; {name: unit}
    shown : number of rows to print, the first ones
    """
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, pad_edge=False)
    cells: list[list[str]] = []
    for name, values in columns.items():
        head = name + (f"\n{units[name]}" if units[name] else "")
        one = values[0] if len(values) and values.dtype.kind == "O" else ""
        right = values.dtype.kind in "iuf" or not isinstance(one, str)
        texts = [cell(value) for value in values[:shown].tolist()]
        whole = not any(" " in text for text in texts)
        table.add_column(Text(head), justify="right" if right else "left",
                         no_wrap=whole)  # fmt: skip
        cells.append(texts)
    for row in zip(*cells, strict=True):
        table.add_row(*map(Text, row))
    wide = Console(width=100_000)  # lines in a pipe are not wrapped
    if sys.stdout.isatty():
        wide = Console(width=max(Console().width, wide.measure(table).minimum))
    with wide.capture() as drawn:
        wide.print(table)
    print(*map(str.rstrip, drawn.get().splitlines()), sep="\n")


def cell(value: Any) -> str:
    """Return a value as text for a printed table; "" for NaN."""
    if isinstance(value, float):
        return "" if value != value else f"{value:.6g}"  # noqa: PLR0124 - NaN
    return one_line(str(value))
