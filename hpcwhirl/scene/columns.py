"""Read tables as people write them: CSV text with a head, and its columns of numbers.

Values are separated by commas, semicolons, tabs or blanks, whichever the head has;
where it is not the comma, a comma may be the decimal sign. Lines without values, and
lines that begin with # or %, are skipped; the last of these before the numbers is the
head, if no other line is. A unit stands in the head, as "kxx [N/mm]", or in a line of
units below it; a number without one is in SI. Names of columns become lower case.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from hpcwhirl.errors import is_number, nearest, one_line, shown
from hpcwhirl.scene.units import in_si, is_unit

NOTE = "#", "%"  # first characters of lines that are no part of a table
SEPARATORS = "\t", ";", ","  # in the order in which a head is searched for them
HEAD = re.compile(r"\s*(.*?)\s*(?:[\[(]\s*([^\])]*?)\s*[\])])?\s*")  # name [unit]
COMMA = re.compile(r"[+-]?\d+,\d+(?:[eE][+-]?\d+)?")  # a number with a decimal comma


@dataclass(frozen=True)
class Column:
    """One column of a table: its name in lower case, its unit, its cells as text.

    Attributes
    ----------
    name, unit : as "kxx" and "N/mm"; "" is no unit
    cells : {number of the line, from 1: text of the cell}
    """

    name: str
    unit: str
    cells: Mapping[int, str]

    def numbers(self, unit: str) -> list[float]:
        """Return the column's values, in SI; ValueError with the line for no number.

        unit : SI unit of the values; "1": none, also none in the head
        """
        return [self._number(text, line, unit) for line, text in self.cells.items()]

    def _number(self, text: str, line: int, unit: str) -> float:
        try:
            value = in_si(f"{float(text)!r} {self.unit}" if self.unit else text, unit)
            number = float(value)
        except ValueError as failed:
            why = f"it must be a number, got {shown(text)}"
            if self.unit and is_number(text):
                why = f"its unit {failed}"
            raise ValueError(f"line {line}, column {self.name}: {why}") from None
        if not math.isfinite(number):
            told = f"it must be finite, got {shown(text)}"
            raise ValueError(f"line {line}, column {self.name}: {told}")
        return number


class Lines(NamedTuple):
    """A table's text in cells: those of its head, and {line number, from 1: cells}."""

    head: list[str]
    rows: dict[int, list[str]]


def lines_of(text: str) -> Lines:
    """Return the cells of a table's lines; without any, the head is empty.

    text : of a CSV file

    Raises
    ------
    ValueError
        with the line's number, if a line has not as many cells as the head
    """
    numbered = _numbered(text)
    if not numbered:
        return Lines([], {})
    mark = _separator(numbered[0][1])
    cells = _cells([line for _, line in numbered], mark)
    rows = dict(zip((number for number, _ in numbered[1:]), cells[1:], strict=True))
    for number, row in rows.items():
        if len(row) != len(cells[0]):
            told = f"it must have {len(cells[0])} values as the head, got {len(row)}"
            raise ValueError(f"line {number}: {told}")
    if mark != ",":
        rows = {at: [_with_point(cell) for cell in row] for at, row in rows.items()}
    return Lines(cells[0], rows)


def _numbered(text: str) -> list[tuple[int, str]]:
    """Return (number, line) of each line of a table, the head first.

    A comment is the head, as in tables of Dakota, if it has as many words as the first
    line, and that begins with a number.
    """
    lines: list[tuple[int, str]] = []
    noted: list[tuple[int, str]] = []
    for number, line in enumerate(text.splitlines(), 1):
        if not line.lstrip().startswith(NOTE):
            lines += [(number, line)] if line.strip(" \t;,") else []
        elif not lines:
            noted = [(number, line.lstrip()[1:])]
    if not lines or not noted:
        return lines
    head, first = (part[0][1].split() for part in (noted, lines))
    is_head = len(head) == len(first) and is_number(first[0])
    return [*noted, *lines] if is_head else lines


def columns_of(text: str) -> dict[str, Column]:
    """Return the columns of a table, {name in lower case: column}, in their order.

    text : of a CSV file

    Raises
    ------
    ValueError
        with the line's number, if a line has not as many cells as the head, or two
        columns have one name
    """
    head, rows = lines_of(text)
    pairs = [name_and_unit(cell) for cell in head]
    units = next(iter(rows.values()), [])
    if _are_units(units):
        del rows[next(iter(rows))]
        pairs = [(n, u or _bare(v)) for (n, u), v in zip(pairs, units, strict=True)]
    out: dict[str, Column] = {}
    for i, (name, unit) in enumerate(pairs):
        if name.lower() in out:
            raise ValueError(f"it must name each column once, got {shown(name)} twice")
        cells = {line: cells[i] for line, cells in rows.items()}
        out[name.lower()] = Column(name.lower(), unit, cells)
    return out


def name_and_unit(cell: str) -> tuple[str, str]:
    """Return the name and the unit, or "", in a cell of a head, as "kxx [N/mm]"."""
    found = HEAD.fullmatch(cell)
    return (found[1], found[2] or "") if found else (cell, "")


def _separator(head: str) -> str | None:
    """Return the character that separates values; None: blanks."""
    found = next((mark for mark in SEPARATORS if mark in head), None)
    return "," if found is None and len(_words(head)) < 2 else found


def _words(line: str) -> list[str]:
    return re.sub(r"\s+([\[(])", r"\1", line).split()


def _cells(lines: list[str], mark: str | None) -> list[list[str]]:
    """Return the cells of each line; ValueError for quotes that are not closed."""
    if mark is None:
        return [_words(line) for line in lines]
    reader = csv.reader(lines, delimiter=mark, strict=True)
    try:
        rows = [[cell.strip() for cell in row] for row in reader]
    except csv.Error as failed:
        raise ValueError(f"line {reader.line_num}: {one_line(str(failed))}") from None
    if len(rows) != len(lines):
        raise ValueError("a text in quotes must end in the line in which it begins")
    return rows


def _bare(unit: str) -> str:
    return unit.strip("[]() ")


def _are_units(cells: list[str]) -> bool:
    """Return whether cells are a line of units, some of which may be left out."""
    told = [_bare(cell) for cell in cells if _bare(cell) not in {"", "-", "1"}]
    are_words = all(any(map(str.isalpha, cell)) for cell in told)
    return bool(told) and are_words and all(map(is_unit, told))


def _with_point(cell: str) -> str:
    return cell.replace(",", ".") if COMMA.fullmatch(cell) else cell


def refuse_unknown(
    columns: Mapping[str, Column],
    known: Callable[[str], bool],
    names: tuple[str, ...],
    why: Callable[[str], str] = lambda _: "",
) -> None:
    """Raise ValueError for a column that is not known and not zero throughout.

    known : whether a name is that of a column which is read, or may be skipped
    names : names of columns that are read, for a hint at a misspelt one
    why : function from a name to a reason, such as "added mass is not modelled"
    """
    for name, column in columns.items():
        if known(name) or not any(map(_counts, column.cells.values())):
            continue
        hint = why(name) or nearest(name, names) or f"; known: {', '.join(names)}"
        raise ValueError(f"it has the unknown column {shown(one_line(name))}{hint}")


def _counts(cell: str) -> bool:
    """Return whether a cell is anything but empty or zero."""
    return cell.strip() != "" and not (is_number(cell) and float(cell) == 0.0)
