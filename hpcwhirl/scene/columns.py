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

from hpcwhirl.errors import nearest, one_line, shown
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
            if self.unit and _is_number(text):
                why = f"its unit {failed}"
            raise ValueError(f"line {line}, column {self.name}: {why}") from None
        if not math.isfinite(number):
            told = f"it must be finite, got {shown(text)}"
            raise ValueError(f"line {line}, column {self.name}: {told}")
        return number


def columns_of(text: str) -> dict[str, Column]:
    """Return the columns of a table, {name in lower case: column}, in their order.

    text : of a CSV file

    Raises
    ------
    ValueError
        with the line's number, if a line has other columns than the head, or two
        columns have one name
    """
    lines: list[tuple[int, str]] = []
    noted = ""
    for number, line in enumerate(text.splitlines(), 1):
        if line.lstrip().startswith(NOTE):
            noted = noted if lines else line.lstrip()[1:]
        elif line.strip(" \t;,"):
            lines.append((number, line))
    if lines and noted and all(map(_is_number, _cells(lines[0][1], None))):
        lines.insert(0, (0, noted))
    if not lines:
        return {}
    mark = _separator(lines[0][1])
    rows = {number: _cells(line, mark) for number, line in lines}
    (_, head), *others = rows.items()
    for number, cells in others:
        if len(cells) != len(head):
            told = f"it must have {len(head)} values as the head, got {len(cells)}"
            raise ValueError(f"line {number}: {told}")
    return _named(head, dict(others), decimal_comma=mark != ",")


def _named(
    head: list[str], rows: dict[int, list[str]], *, decimal_comma: bool
) -> dict[str, Column]:
    found = [HEAD.fullmatch(cell) for cell in head]
    pairs = [(m[1].lower(), m[2] or "") if m else ("", "") for m in found]
    units = next(iter(rows.values()), [])
    if _are_units(units):
        del rows[next(iter(rows))]
        pairs = [(n, u or _bare(v)) for (n, u), v in zip(pairs, units, strict=True)]
    out: dict[str, Column] = {}
    for i, (name, unit) in enumerate(pairs):
        if name in out:
            raise ValueError(f"it must name each column once, got {shown(name)} twice")
        cells = {line: cells[i] for line, cells in rows.items()}
        if decimal_comma:
            cells = {line: _with_point(cell) for line, cell in cells.items()}
        out[name] = Column(name, unit, cells)
    return out


def _separator(head: str) -> str | None:
    """Return the character that separates values; None: blanks."""
    return next((mark for mark in SEPARATORS if mark in head), None)


def _cells(line: str, mark: str | None) -> list[str]:
    if mark is None:
        return re.sub(r"\s+([\[(])", r"\1", line).split()
    return [cell.strip() for cell in next(csv.reader([line], delimiter=mark), [])]


def _bare(unit: str) -> str:
    return unit.strip("[]() ")


def _are_units(cells: list[str]) -> bool:
    """Return whether cells are a line of units, some of which may be left out."""
    told = [_bare(cell) for cell in cells if _bare(cell) not in {"", "-", "1"}]
    are_words = all(any(map(str.isalpha, cell)) for cell in told)
    return bool(told) and are_words and all(map(is_unit, told))


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


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
    return cell.strip() != "" and not (_is_number(cell) and float(cell) == 0.0)
