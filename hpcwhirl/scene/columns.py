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
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, islice

from hpcwhirl.errors import is_number, nearest, one_line, shown
from hpcwhirl.scene.units import in_si, is_unit

BLANK = " \t;,\r"  # what an empty line may have
NOTE = "#", "%"  # first characters of lines that are no part of a table
SEPARATORS = "\t", ";", ","  # in the order in which a head is searched for them
HEAD = re.compile(r"\s*(.*?)\s*(?:[\[(]\s*([^\])]*?)\s*[\])])?\s*")  # name [unit]
AT_ONCE = 1 << 14  # lines of a long table that are split into cells together
PIECE = 1 << 20  # characters of a long text that are split into lines together
VALUE = re.compile(r"[+-]?\.?\d+(?!/)|[^a-zA-Z]*$")  # what a unit does not begin with
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


def parts_of(
    text: str, names: Sequence[str] = ()
) -> tuple[list[str], Iterator[dict[int, list[str]]]]:
    """Return a table's head, and its lines in parts of at most `AT_ONCE` lines.

    So a long table is never held in cells as a whole.

    Parameters
    ----------
    text : of a CSV file
    names : cells of the head, of a table that has no line of names

    Returns
    -------
    head, empty without any line, and an iterator of {line number, from 1: cells}

    Raises
    ------
    ValueError
        with the line's number, if the head has no names; the iterator, if a line has
        not as many cells as the head
    """
    numbered = _numbered(text, has_head=not names)
    first = next(numbered, None)
    if first is None:
        return [], iter(())
    mark = _separator(first[1])
    if names:
        return list(names), _parts(chain([first], numbered), mark, len(names))
    head = _cells([first], mark)[0]
    if all(is_number(_with_point(cell)) for cell in head):
        told = f"it must name the columns, got {shown(one_line(first[1]))}"
        raise ValueError(f"line {first[0]}: {told}")
    second = next(numbered, None)
    rest = chain([] if second is None else [second], numbered)
    if second and mark is None and len(_words(second[1])) == len(head) + 1:
        head = ["", *head]  # R and pandas leave out the name of the rows' numbers
    while head and not head[-1]:
        head.pop()
    return head, _parts(rest, mark, len(head))


def _parts(
    numbered: Iterator[tuple[int, str]], mark: str | None, wide: int
) -> Iterator[dict[int, list[str]]]:
    """Yield {line number: cells} of numbered lines in parts, see `parts_of`.

    mark : character that separates values; None: blanks
    wide : number of cells that a line must have; further ones must be empty
    """
    while some := list(islice(numbered, AT_ONCE)):
        rows = _cells(some, mark)
        part = {at: row for (at, _), row in zip(some, rows, strict=True)}
        for at, row in part.items():
            while len(row) > wide and not row[-1]:
                row.pop()
            if len(row) != wide:
                told = f"it must have {wide} values as the head, got {len(row)}"
                raise ValueError(f"line {at}: {told}")
        if mark != ",":
            part = {at: [_with_point(cell) for cell in row] for at, row in part.items()}
        yield part


def _numbered(text: str, *, has_head: bool = True) -> Iterator[tuple[int, str]]:
    """Yield (number, line) of each line of a table, the head first.

    A comment is the head, as in tables of Dakota, if it has as many words as the first
    line, and that begins with a number.

    has_head : whether the table has a line of names
    """
    noted, begun = (0, ""), False
    for number, line in enumerate(_each(text), 1):
        bare = line.lstrip(BLANK)
        if bare[:1] in NOTE:
            noted = noted if begun else (number, bare[1:])
        elif bare:
            if not begun and has_head and _is_head(noted[1], line):
                yield noted
            begun = True
            yield number, line


def _each(text: str) -> Iterator[str]:
    """Yield the lines of a text; a long one is split piece by piece."""
    start = 0
    while start < len(text):
        end = text.find("\n", start + PIECE) + 1 or len(text)
        yield from text[start:end].splitlines()
        start = end


def _is_head(noted: str, line: str) -> bool:
    """Return whether a comment names the values of the line of numbers below it."""
    head, first = noted.split(), line.split()
    return len(head) == len(first) and is_number(first[0])


def columns_of(text: str) -> dict[str, Column]:
    """Return the columns of a table, {name in lower case: column}, in their order.

    A first column without a name numbers the rows, and is left out.

    text : of a CSV file

    Raises
    ------
    ValueError
        with the line's number, if a line has not as many cells as the head, or two
        columns have one name
    """
    pairs, parts = headed(text)
    rows = {at: row for part in parts for at, row in part.items()}
    out: dict[str, Column] = {}
    for i, (name, unit) in enumerate(pairs):
        if name.lower() in out:
            raise ValueError(f"it must name each column once, got {shown(name)} twice")
        cells = {line: cells[i] for line, cells in rows.items()}
        if name or i:
            out[name.lower()] = Column(name.lower(), unit, cells)
    return out


def headed(
    text: str, names: Sequence[str] = ()
) -> tuple[list[tuple[str, str]], Iterator[dict[int, list[str]]]]:
    """Return (name, unit or "") of each column of a table, and its lines in parts.

    A line of units below the head gives the units of columns without one.

    text, names : as for `parts_of`, which also tells the parts and the errors
    """
    head, parts = parts_of(text, names)
    pairs = [name_and_unit(cell) for cell in head]
    first = next(parts, {})
    units = next(iter(first.values()), [])
    if _are_units(units):
        del first[next(iter(first))]
        pairs = [(n, u or _bare(v)) for (n, u), v in zip(pairs, units, strict=True)]
    return pairs, chain([first] if first else [], parts)


def name_and_unit(cell: str) -> tuple[str, str]:
    """Return the name and the unit, or "", in a cell of a head, as "kxx [N/mm]".

    A name "rpm" is that of a speed.
    """
    if cell.strip().lower() == "rpm":
        return "speed", "rpm"
    found = HEAD.fullmatch(cell)
    return (found[1], found[2] or "") if found else (cell, "")


def _separator(head: str) -> str | None:
    """Return the character that separates values; None: blanks."""
    found = next((mark for mark in SEPARATORS if mark in head), None)
    return "," if found is None and len(_words(head)) < 2 else found


def _words(line: str) -> list[str]:
    words = re.sub(r"\s+([\[(])", r"\1", line).split()
    return [word.strip('"') for word in words]


def _cells(numbered: list[tuple[int, str]], mark: str | None) -> list[list[str]]:
    """Return the cells of each line; ValueError for quotes that are not closed."""
    if mark is None:
        return [_words(line) for _, line in numbered]
    reader = csv.reader((line for _, line in numbered), delimiter=mark, strict=True)
    try:
        rows = [[cell.strip() for cell in row] for row in reader]
    except csv.Error as failed:
        at = numbered[reader.line_num - 1][0]
        raise ValueError(f"line {at}: {one_line(str(failed))}") from None
    if len(rows) != len(numbered):
        raise ValueError("a text in quotes must end in the line in which it begins")
    return rows


def _bare(unit: str) -> str:
    return unit.strip("[]() ")


def _are_units(cells: list[str]) -> bool:
    """Return whether cells are a line of units, some of which may be left out."""
    told = [_bare(cell) for cell in cells if _bare(cell) not in {"", "-", "1"}]
    if told == ["exact"]:  # a scheme, which UDUNITS takes for exa-carats
        return False
    are_words = all(VALUE.match(cell) is None for cell in told)
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
