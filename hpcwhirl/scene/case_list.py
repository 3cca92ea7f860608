"""Cases that a user lists one by one: [[cases]] of a campaign's file, or a CSV file."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hpcwhirl.errors import InputError, MissingFileError, one_line, shown
from hpcwhirl.safe_open import read_regular
from hpcwhirl.scene.documents import setting_value
from hpcwhirl.scene.input_names import Value, by_full_name, full_name, value_in_si
from hpcwhirl.scene.quantities import INPUTS, variable_name
from hpcwhirl.scene.swept import MOST_CASES, flat

CASE = "case"  # column of case numbers in tables of results; not an input
HEAD = re.compile(r"\s*([^\[\]]*?)\s*(?:\[([^\[\]]*)\])?\s*")
VARIABLES = {variable_name(name): name for name in INPUTS}


def listed_cases(given: Any, folder: Path | str = "") -> list[dict[str, Value]]:
    """Return {full dotted input: value in SI} of each listed case.

    Parameters
    ----------
    given : parsed tables [[cases]], or the name of a CSV file, see `cases_in_file`
    folder : directory to which a relative name refers; "": the working directory

    Raises
    ------
    InputError, MissingFileError
        for a wrong value, an unknown input, or a file that is not a table of cases
    """
    if isinstance(given, str):
        return cases_in_file(Path(folder) / given)
    if not isinstance(given, list) or not all(isinstance(c, Mapping) for c in given):
        msg = '[[cases]] must be tables of inputs, or cases = "FILE.csv", got '
        raise InputError(msg + shown(given))
    rows = [by_full_name(flat(case).items(), "[[cases]]") for case in given]
    return [{name: value_in_si(name, v) for name, v in row.items()} for row in rows]


def cases_in_file(path: Path) -> list[dict[str, Value]]:
    """Return {full dotted input: value in SI} of each case in a CSV file, one a line.

    The header names inputs as in a TOML file or in results, with the unit of the column
    if it is not SI: ``speed [rpm],gap [mm],friction``. An empty cell keeps the value
    that all cases share; a column `case` is ignored. Columns are separated by commas,
    or by semicolons if the header has no comma.

    Raises
    ------
    InputError, MissingFileError
        naming file, line and column of the error
    """
    try:
        text = read_regular(path).decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as failed:
        msg = f"cannot read {path}: {getattr(failed, 'strerror', None) or failed}"
        raise MissingFileError(msg) from None
    head = text.partition("\n")[0]
    comma = "," if "," in head or ";" not in head else ";"
    reader = csv.reader(io.StringIO(text), delimiter=comma, strict=True)
    rows: list[dict[str, Value]] = []
    try:
        columns = _columns(next(reader, []), path)
        for cells in reader:
            if any(cell.strip() for cell in cells):
                rows.append(_row(columns, cells, f"{path}, line {reader.line_num}"))
            if len(rows) > MOST_CASES:
                raise InputError(f"{path} has more than {MOST_CASES} cases")
    except csv.Error as failed:
        msg = f"{path}, line {reader.line_num}: {one_line(str(failed))}"
        raise InputError(msg) from None
    if not rows:
        msg = f"{path} has no cases: it must have a line of names and one for each case"
        raise InputError(msg)
    return rows


def _columns(heads: list[str], path: Path) -> list[tuple[str, str]]:
    """Return (full dotted input, unit or "") of each column of a CSV file of cases.

    A column `case`, which is ignored, gives ("", "").

    heads, path : cells of the file's first line; the file, for messages
    """
    found: list[tuple[str, str]] = []
    for head in heads:
        parts = HEAD.fullmatch(head)
        if parts is None or not parts[1]:
            msg = f"{path}: a column must be NAME or NAME [UNIT], got {shown(head)}"
            raise InputError(msg)
        name, unit = VARIABLES.get(parts[1], parts[1]), parts[2] or ""
        if name == CASE:
            found.append(("", ""))
            continue
        try:
            full = full_name(name)
        except InputError as failed:
            raise InputError(f"{path}: {failed}") from None
        if full in {known for known, _ in found}:
            raise InputError(f"{path} names {full} twice")
        found.append((full, "" if unit.strip() == "1" else unit.strip()))
    return found


def _row(
    columns: list[tuple[str, str]], cells: list[str], where: str
) -> dict[str, Value]:
    """Return {full dotted input: value in SI} of the case in one line of a CSV file.

    Parameters
    ----------
    columns : (full dotted input, unit or "") of each column
    cells : texts of the line; an empty one leaves its input out
    where : file and line, for messages
    """
    if len(cells) != len(columns):
        raise InputError(f"{where}: must have {len(columns)} columns, got {len(cells)}")
    row: dict[str, Value] = {}
    for (name, unit), cell in zip(columns, cells, strict=True):
        if not name or not cell.strip():
            continue
        try:
            row[name] = _value(name, unit, cell.strip())
        except (InputError, ValueError) as failed:
            raise InputError(f"{where}: {failed}") from None
    return row


def _value(name: str, unit: str, cell: str) -> Value:
    value = setting_value(name, cell)
    if unit and isinstance(value, int | float):
        value = f"{cell} {unit}"
    return value_in_si(name, value)  # type: ignore[no-any-return]
