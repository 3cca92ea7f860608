"""Small tables that users give as files and a scene stores as one line of text.

So a scene does not depend on the file later. The line has the names of the columns and
the rows of numbers, as "time,speed;0,100;2,300". There are three kinds:

- over time: the time, s, and a quantity such as the speed, in its unit;
- the shape of a casing that is not round: harmonics, w = sum of a cos(h theta - phi),
  in the columns harmonic, amplitude (m) and phase (rad); or values over angle, in the
  columns angle (rad) and departure (m), joined by straight lines around the casing. w
  is the departure from a circle, outward, by which the gap is wider;
- the coefficients of a bearing over speed. Names of columns, their defaults and units
  are those of ROSS (R. Timbo et al., ROSS - Rotordynamic open source software, JOSS
  2020): frequency, or w, rad/s; kxx and cxx; and, optionally, kyy and cyy (default kxx
  and cxx), kxy, kyx, cxy and cyx (default 0).

Each function that reads a table raises ValueError if the file cannot be read, or does
not hold such a table.
"""

from __future__ import annotations

import csv
import itertools
import math
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from hpcwhirl.errors import shown

MOST_BYTES = 1 << 20  # largest file with a table
Rows = list[tuple[float, ...]]
TIME = "time"
HARMONICS = "harmonic,amplitude,phase"
ANGLES = "angle,departure"
MOST_ROWS = 4096  # largest number of rows of a shape's table
HIGHEST = 200  # highest harmonic that a table may name
FEWEST_ANGLES = 3
SPEED = "frequency"
COEFFICIENTS = "kxx", "kxy", "kyx", "kyy", "cxx", "cxy", "cyx", "cyy"
HEAD = ",".join((SPEED, *COEFFICIENTS))
USUAL = {"kyy": "kxx", "cyy": "cxx"}  # default of a bearing's missing column


def kept_rows(text: str) -> Rows:
    """Return the rows of numbers in a table such as "time,speed;0,100;2,300"."""
    return _rows_of(text.split(";")[1:])


def kept_table(head: str, rows: Rows) -> str:
    """Return a table as the line of text that a scene stores.

    head, rows : names of the columns, with commas between them; rows of numbers
    """
    return ";".join([head, *(",".join(map(repr, row)) for row in rows)])


def table_over_time(text: str, name: str) -> str:
    """Return a table of speed or gap over time as the line of text that a scene stores.

    Parameters
    ----------
    text : name of a CSV file with the columns time and `name`, or a table in one line,
        as "time,speed;0,100;2,300"; "" is returned unchanged
    name : name of the second column, "speed" or "gap"
    """
    if not text:
        return ""
    lines = _lines_of(text)
    head = [word.strip().lower() for word in lines[0].split(",")]
    told = f"it must have the columns {TIME},{name}, got {shown(lines[0])}"
    _must(head == [TIME, name], told)
    try:
        rows: Rows = [(time, value) for time, value in _rows_of(lines[1:])]
    except ValueError:
        msg = f"every row must have two numbers, {TIME} and {name}"
        raise ValueError(msg) from None
    are_enough = len(rows) >= 2 and _are_finite(rows)
    _must(are_enough, "it must have two rows at least, of finite numbers")
    starts = rows[0][0] == 0.0
    _must(starts and _ascends(rows), f"its {TIME} must begin at 0 s and ascend")
    return kept_table(f"{TIME},{name}", rows)


def scaled(text: str, factor: float) -> str:
    """Return the text of a table over time with its second column times a factor."""
    if not text:
        return ""
    rows: Rows = [(time, factor * value) for time, value in kept_rows(text)]
    return kept_table(text.split(";", maxsplit=1)[0], rows)


def profile_table(text: str) -> str:
    """Return the table of a casing's shape as the line of text that a scene stores.

    text : name of a CSV file, or a table in one line, as "harmonic,amplitude,phase;
        2,1e-5,0"; "" is returned unchanged
    """
    if not text:
        return ""
    lines = _lines_of(text)
    head = ",".join(word.strip().lower() for word in lines[0].split(","))
    told = f"it must have the columns {HARMONICS}, or {ANGLES}, got {shown(head)}"
    _must(head in {HARMONICS, ANGLES}, told)
    try:
        rows = _rows_of(lines[1:])
    except ValueError:
        raise ValueError("its values must be numbers") from None
    wide = head.count(",") + 1
    told = f"every row must have {wide} numbers, {head}"
    _must(all(len(row) == wide for row in rows), told)
    are_rows = 0 < len(rows) <= MOST_ROWS and _are_finite(rows)
    _must(are_rows, f"it must have 1 to {MOST_ROWS} rows, of finite numbers")
    first = [row[0] for row in rows]
    if head == HARMONICS:
        are_harmonics = all(h == int(h) and 0 <= h <= HIGHEST for h in first)
        told = f"its harmonics must be whole numbers from 0 to {HIGHEST}"
        _must(are_harmonics, told)
        _must(len(set(first)) == len(first), "it must name each harmonic once")
    else:
        are_angles = len(rows) >= FEWEST_ANGLES and _ascends(rows)
        _must(are_angles, f"its angles, {FEWEST_ANGLES} at least, must ascend")
        told = "its angles must lie within one turn, the first not repeated as the last"
        _must(first[-1] < first[0] + 2 * math.pi, told)
    return kept_table(head, rows)


def bearing_table(text: str) -> str:
    """Return the table of a bearing over speed as the text that a scene stores.

    text : name of a CSV or TOML file, or such a line, which is only checked; "" is
        returned unchanged
    """
    if not text:
        return ""
    path = Path(text)
    if text.startswith(f"{HEAD};"):
        rows = kept_rows(text)
    elif path.suffix == ".toml":
        rows = _of_columns(_columns_of_toml(_text_of(path)))
    else:
        rows = _of_columns(_columns_of_csv(_text_of(path)))
    wide = 1 + len(COEFFICIENTS)
    _must(all(len(row) == wide for row in rows), f"every row must have {wide} numbers")
    are_rows = rows and _are_finite(rows)
    _must(are_rows, "it must have one row at least, of finite numbers")
    rises = rows[0][0] >= 0.0 and _ascends(rows)
    _must(rises, f"its {SPEED} must be >= 0 rad/s and ascend")
    return kept_table(HEAD, rows)


def _must(holds: Any, told: str) -> None:
    """Raise ValueError with the text `told` unless the condition `holds`."""
    if not holds:
        raise ValueError(told)


def _are_finite(rows: Rows) -> bool:
    return all(map(math.isfinite, itertools.chain(*rows)))


def _ascends(rows: Rows) -> bool:
    """Return whether the numbers in the first column of a table's rows ascend."""
    return all(a[0] < b[0] for a, b in itertools.pairwise(rows))


def _text_of(path: Path) -> str:
    """Return a file's text; ValueError if empty, or if larger than `MOST_BYTES`."""
    name = shown(str(path))
    try:
        is_small = path.stat().st_size <= MOST_BYTES and path.is_file()
        told = f"must name a file of at most {MOST_BYTES} bytes, got {name}"
        _must(is_small, told)
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeError) as failed:
        why = getattr(failed, "strerror", None) or "it is not UTF-8"
        raise ValueError(f"cannot read {name}: {why}") from None
    told = f"must name a file that has a table, got {name}, which is empty"
    _must(text.strip(), told)
    return text


def _lines_of(text: str) -> list[str]:
    """Return the lines of a table; the first has the names of its columns.

    text : the table, such as "time,speed;0,100;2,300", or the name of its CSV file
    """
    if ";" in text:
        return text.split(";")
    lines = _text_of(Path(text)).splitlines()
    return [",".join(row) for row in csv.reader(lines) if row]


def _rows_of(lines: Iterable[str]) -> Rows:
    """Return the numbers of each line of a table; ValueError if a text is no number."""
    return [tuple(map(float, line.split(","))) for line in lines]


def _columns_of_csv(text: str) -> dict[str, list[Any]]:
    read = csv.DictReader(text.splitlines())
    heads = [(head or "").strip().lower() for head in read.fieldnames or ()]
    lines = [list(line.values()) for line in read]
    told = "every row must have as many values as the head has names"
    _must(all(len(line) == len(heads) for line in lines), told)
    return {head: [line[i] for line in lines] for i, head in enumerate(heads)}


def _columns_of_toml(text: str) -> dict[str, list[Any]]:
    try:
        found = _tables(tomllib.loads(text))
    except tomllib.TOMLDecodeError as failed:
        raise ValueError(f"it is no TOML: {failed}") from None
    told = f"a TOML file must have one table with kxx, got {len(found)}"
    _must(len(found) == 1, told)
    listed = {n: v if isinstance(v, list) else [v] for n, v in found[0].items()}
    count = max(len(listed.get(name, [])) for name in (SPEED, "w", "kxx"))
    return {n: v * count if len(v) == 1 else v for n, v in listed.items()}


def _tables(table: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Return all tables in a parsed TOML file that have the key kxx, at any depth."""
    own = [table] if "kxx" in table else []
    inner = [value for value in table.values() if isinstance(value, Mapping)]
    return own + [found for value in inner for found in _tables(value)]


def _of_columns(columns: Mapping[str, list[Any]]) -> Rows:
    """Return (speed, kxx, ..., cyy), rad/s, N/m, N s/m, of each row of a bearing table.

    columns : {name of the column in the file: its values}; optional ones may be missing
    """
    speeds = columns.get(SPEED, columns.get("w", []))
    missing = [name for name in ("kxx", "cxx") if name not in columns]
    missing += [] if {SPEED, "w"} & columns.keys() else [SPEED]
    told = f"it must have the columns {', '.join(missing)}, separated by commas, got "
    _must(not missing, f"{told}{shown(', '.join(columns))}")
    none = ["0"] * len(speeds)
    named = [columns.get(n, columns.get(USUAL.get(n, ""), none)) for n in COEFFICIENTS]
    are_alike = all(len(column) == len(speeds) for column in named)
    _must(are_alike, "its columns must be of one length")
    try:
        return [tuple(map(float, row)) for row in zip(speeds, *named, strict=True)]
    except (TypeError, ValueError):
        raise ValueError("its values must be numbers") from None
