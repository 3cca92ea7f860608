"""Cases listed one by one: by [[cases]] of a campaign's file, or in a table's file.

A file of tables may be long: it is read in parts, and its numbers become arrays, so
that a million cases need a few bytes each.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hpcwhirl.errors import InputError, say, shown
from hpcwhirl.scene.columns import headed, name_and_unit
from hpcwhirl.scene.documents import readable, setting_value
from hpcwhirl.scene.input_names import (
    IN_UNITS,
    Value,
    by_full_name,
    full_name,
    takes_list,
    value_in_si,
)
from hpcwhirl.scene.quantities import INPUTS, variable_name
from hpcwhirl.scene.swept import MOST_CASES, flat
from hpcwhirl.scene.table import LONG, Axis, Block, Table, Values, listed
from hpcwhirl.scene.table_files import text_of_table
from hpcwhirl.scene.table_model import TableModel, key
from hpcwhirl.scene.units import factor_to

# columns that number cases; not inputs
SKIPPED = "", "case", "id", "index", "run", "eval_id", "interface"
VARIABLES = {variable_name(name): name for name in INPUTS}
ALLOWED = (
    'must be tables of inputs, or cases = "FILE.csv", or cases = { file = "FILE", '
    "skip = [names], columns = [names] }"
)
EVERY = 2.0  # s, least time between two lines on the progress of reading
PLAIN = IN_UNITS - {name for name in INPUTS if takes_list(name)}  # inputs of a number
Rows = dict[int, list[str]]


class CaseFile(TableModel):
    """The value of `cases` that names a file and columns: {file, skip, columns}."""

    file: str = key(..., allowed="the name of a file")
    skip: list[str] = key([], allowed="a list of names of columns that are left out")
    columns: list[str] = key(
        [], allowed='a list of names, as ["speed [rpm]", "gap"], for a file without'
    )


def listed_cases(given: Any, folder: Path | str = "") -> Table:
    """Return the cases that a campaign's file lists, with values in SI.

    Parameters
    ----------
    given : parsed tables [[cases]]; or the name of a file, or a `CaseFile`, see
        `cases_in_file`
    folder : directory to which a relative name refers; "": the working directory

    Raises
    ------
    InputError, MissingFileError
        for a wrong value, an unknown input, or a file that is not a table of cases
    """
    if isinstance(given, str | Mapping):
        whole = {"file": given} if isinstance(given, str) else given
        file = CaseFile.read(whole, "cases")
        return cases_in_file(Path(folder) / file.file, file.skip, file.columns)
    if not isinstance(given, list) or not all(isinstance(c, Mapping) for c in given):
        raise InputError(f"[[cases]] {ALLOWED}, got {shown(given)}")
    rows = [by_full_name(flat(case).items(), "[[cases]]") for case in given]
    return Table.of([{n: value_in_si(n, v) for n, v in row.items()} for row in rows])


def cases_in_file(
    path: Path, skip: Sequence[str] = (), columns: Sequence[str] = ()
) -> Table:
    """Return the cases in a CSV file or a spreadsheet, one a line, with values in SI.

    The head names inputs as in a TOML file or in results, with the unit of the column
    if it is not SI: ``speed [rpm],gap [mm],friction``. An empty cell keeps the value
    that all cases share. Columns that number the cases (`SKIPPED`, or a first one
    without a name) are ignored. For separators and comments see `columns`.

    Parameters
    ----------
    path : the file
    skip : names of columns that are left out, such as responses
    columns : names, as in a head, of the columns of a file without a head; "" or "-":
        left out

    Raises
    ------
    InputError, MissingFileError
        naming file, line and column of the error
    """
    text = readable(path, lambda data: text_of_table(data, path))
    cells = ["" if name == "-" else name for name in columns]
    try:
        pairs, parts = headed(text, cells)
        inputs = _inputs_of_columns(pairs, path, skip, named=bool(columns))
        pieces = list(_pieces(inputs, _telling(parts, path), path))
    except InputError:
        raise
    except ValueError as failed:
        raise InputError(f"{path}, {failed}") from None
    table = Table(b for piece in _joined(pieces) for b in _blocks(piece))
    if len(table) > MOST_CASES:
        raise InputError(f"{path} has more than {MOST_CASES} cases")
    if not len(table):
        msg = f"{path} has no cases: it must have a line of names and one for each case"
        raise InputError(msg)
    return table


class _Input(NamedTuple):
    """An input that a column holds: its place, full dotted name, unit or ""."""

    place: int
    name: str
    unit: str


@dataclass
class _Piece:
    """Successive cases that set the same inputs: names, and values of each."""

    names: tuple[str, ...]
    columns: list[list[Values]]
    cases: int


def _inputs_of_columns(
    pairs: Iterable[tuple[str, str]], path: Path, skip: Sequence[str], *, named: bool
) -> list[_Input]:
    """Return the inputs that the columns of a list of cases hold.

    Parameters
    ----------
    pairs : (name, unit or "") of each column
    path : the file, for messages
    skip : names of columns that are left out; an unknown one is refused
    named : whether the user named the columns, so that any may have no name
    """
    left = dict.fromkeys(name_and_unit(name)[0] for name in skip)
    found: dict[str, _Input] = {}
    for place, (name, unit) in enumerate(pairs):
        numbers = name.lower() in SKIPPED and (name or named or place == 0)
        if numbers or name in left:
            left.pop(name, None)
            continue
        if not name or "[" in name:
            msg = f"{path}: a column must be NAME or NAME [UNIT], got {shown(name)}"
            raise InputError(msg)
        full = _input_named(name, path)
        if full in found:
            raise InputError(f"{path} names {full} twice")
        found[full] = _Input(place, full, "" if unit.strip() == "1" else unit.strip())
    if left:
        raise InputError(f"{path} has no column {shown(min(left))}, which skip names")
    return list(found.values())


def _input_named(name: str, path: Path) -> str:
    """Return the full dotted name of an input as a head has it, also in capitals."""
    name = VARIABLES.get(name, name)
    try:
        return full_name(name)
    except InputError as failed:
        try:
            return full_name(VARIABLES.get(name.lower(), name.lower()))
        except InputError:
            how = f"to leave a column out: cases = {{ file = ..., skip = [{name!r}] }}"
            raise InputError(f"{path}: {failed}; {how}") from None


def _pieces(
    inputs: Sequence[_Input], parts: Iterable[Rows], path: Path
) -> Iterator[_Piece]:
    """Yield the cases of a table's parts, in pieces whose cases set the same inputs."""
    for part in parts:
        for which, rows in _alike(inputs, part):
            columns = [[_values(inputs[i], rows, path)] for i in which]
            names = tuple(inputs[i].name for i in which)
            yield _Piece(names, columns, len(rows))


def _telling(parts: Iterable[Rows], path: Path) -> Iterator[Rows]:
    """Yield the parts of a long table, and print how many lines were read so far."""
    lines, last = 0, time.monotonic()
    for part in parts:
        yield part
        lines += len(part)
        if time.monotonic() - last >= EVERY:
            last = time.monotonic()
            say(f"{path}: {lines} cases read")


def _alike(
    inputs: Sequence[_Input], part: Rows
) -> Iterator[tuple[tuple[int, ...], Rows]]:
    """Yield (indices of inputs, lines) of successive lines that set the same inputs."""
    if all("" not in row for row in part.values()):
        yield tuple(range(len(inputs))), part
        return
    for which, some in groupby(part.items(), lambda row: _set_in(inputs, row[1])):
        yield which, dict(some)


def _set_in(inputs: Sequence[_Input], cells: list[str]) -> tuple[int, ...]:
    """Return the indices of inputs that a line sets: those whose cell is not empty."""
    return tuple(i for i, one in enumerate(inputs) if cells[one.place])


def _values(one: _Input, rows: Rows, path: Path) -> Values:
    """Return the values of an input in some lines, in SI; numbers as an array."""
    cells = [row[one.place] for row in rows.values()]
    if one.name in PLAIN:
        try:
            return np.array(_numbers(one, cells)) + 0.0  # no -0.0
        except (ValueError, InvalidOperation):
            pass  # a text with a unit, or what is refused below
    return [
        _value(one, row[one.place], f"{path}, line {at}") for at, row in rows.items()
    ]


def _numbers(one: _Input, cells: list[str]) -> list[float]:
    """Return numbers in SI of cells that are plain numbers; else ValueError."""
    if not one.unit:
        return list(map(float, cells))
    factor = factor_to(one.unit, INPUTS[one.name].unit)
    return [float(Decimal(cell) * factor) for cell in cells]


def _value(one: _Input, cell: str, where: str) -> Value:
    """Return an input's value in SI from one cell.

    where : file and line, for messages
    """
    try:
        value = setting_value(one.name, cell)
        if one.unit and isinstance(value, int | float):
            value = f"{cell} {one.unit}"
        return value_in_si(one.name, value)  # type: ignore[no-any-return]
    except (InputError, ValueError) as failed:
        raise InputError(f"{where}: {failed}") from None


def _joined(pieces: Iterable[_Piece]) -> Iterator[_Piece]:
    """Yield pieces with successive ones that set the same inputs made one."""
    for _, same in groupby(pieces, lambda piece: piece.names):
        first, *others = same
        for other in others:
            first.cases += other.cases
            for own, more in zip(first.columns, other.columns, strict=True):
                own.extend(more)
        yield first


def _blocks(piece: _Piece) -> list[Block]:
    """Return the cases of a piece as blocks: one, or one each if they set nothing."""
    if not piece.names:
        return [Block()] * piece.cases
    return [Block([Axis(piece.names, tuple(map(_whole, piece.columns)))])]


def _whole(parts: list[Values]) -> Values:
    """Return the values of an input in all parts; many numbers as an array."""
    if all(isinstance(part, np.ndarray) for part in parts):
        values = np.concatenate(parts)
        return values if len(values) >= LONG else values.tolist()
    return [value for part in parts for value in listed(part)]
