"""Small tables that users give as files and a scene stores as one line of text.

So a scene does not depend on the file later. The line has the names of the columns and
the rows of numbers, as "time,speed;0,100;2,300". There are four kinds:

- over time: the time, s, and a quantity such as the speed, in its unit;
- over the sliding speed, m/s: the coefficient of friction;
- the shape of a casing that is not round: harmonics, w = sum of a cos(h theta - phi),
  in the columns harmonic, amplitude (m) and phase (rad); or values over angle, in the
  columns angle (rad) and departure (m), joined by straight lines around the casing. w
  is the departure from a circle, outward, by which the gap is wider;
- the coefficients of a bearing over speed, see `bearing_tables`.

Each function that reads a table raises ValueError if the file cannot be read, or does
not hold such a table.
"""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from typing import Any

from hpcwhirl.errors import shown
from hpcwhirl.scene.columns import columns_of
from hpcwhirl.scene.table_files import text_of_table

MOST_BYTES = 1 << 20  # largest file with a table
Rows = list[tuple[float, ...]]
TIME, SLIDING = "time", "slip"
HARMONICS = "harmonic,amplitude,phase"
ANGLES = "angle,departure"
MOST_ROWS = 4096  # largest number of rows of a shape's table
HIGHEST = 200  # highest harmonic that a table may name
FEWEST_ANGLES = 3
UNITS = {  # SI units of columns
    TIME: "s", "speed": "rad/s", "gap": "m", "harmonic": "1", "amplitude": "m",
    "phase": "rad", "angle": "rad", "departure": "m", SLIDING: "m/s",
    "friction": "1",
}  # fmt: skip


def kept_rows(text: str) -> Rows:
    """Return the rows of numbers in a table such as "time,speed;0,100;2,300"."""
    return [tuple(map(float, line.split(","))) for line in text.split(";")[1:]]


def kept_table(head: str, rows: Rows) -> str:
    """Return a table as the line of text that a scene stores.

    head, rows : names of the columns, with commas between them; rows of numbers
    """
    return ";".join([head, *(",".join(map(repr, row)) for row in rows)])


def table_over_time(text: str, name: str) -> str:
    """Return a table of speed or gap over time as the line of text that a scene stores.

    Parameters
    ----------
    text : name of a CSV file or spreadsheet with the columns time and `name`, or a
        table in one line, as "time,speed;0,100;2,300"; "" is returned unchanged
    name : name of the second column, "speed" or "gap"
    """
    return _table_from_0(text, TIME, name)[0]


def table_over_slip(text: str) -> str:
    """Return a table of friction over the sliding speed as a scene stores it.

    text : as for `table_over_time`, with the columns slip and friction
    """
    kept, rows = _table_from_0(text, SLIDING, "friction")
    lowest = min((mu for _, mu in rows), default=0.0)
    must(lowest >= 0.0, f"its friction must be >= 0, got {lowest!r}")
    return kept


def _table_from_0(text: str, first: str, name: str) -> tuple[str, Rows]:
    """Return a table whose first column ascends from 0 as text, and its rows.

    text, first, name : as for `table_over_time`; names of both columns
    """
    if not text:
        return "", []
    head, rows = _head_and_rows(text, (f"{first},{name}",))
    are_enough = len(rows) >= 2 and are_finite(rows)
    must(are_enough, "it must have two rows at least, of finite numbers")
    begins = rows[0][0] == 0.0 and ascends(rows)
    must(begins, f"its {first} must begin at 0 {UNITS[first]} and ascend")
    return kept_table(head, rows), rows


def scaled(text: str, factor: float) -> str:
    """Return the text of a table over time with its second column times a factor."""
    if not text:
        return ""
    rows: Rows = [(time, factor * value) for time, value in kept_rows(text)]
    return kept_table(text.split(";", maxsplit=1)[0], rows)


def profile_table(text: str) -> str:
    """Return the table of a casing's shape as the line of text that a scene stores.

    text : name of a CSV file or spreadsheet, or a table in one line, as
        "harmonic,amplitude,phase;2,1e-5,0"; "" is returned unchanged
    """
    if not text:
        return ""
    head, rows = _head_and_rows(text, (HARMONICS, ANGLES))
    are_rows = 0 < len(rows) <= MOST_ROWS and are_finite(rows)
    must(are_rows, f"it must have 1 to {MOST_ROWS} rows, of finite numbers")
    first = [row[0] for row in rows]
    if head == HARMONICS:
        are_harmonics = all(h == int(h) and 0 <= h <= HIGHEST for h in first)
        told = f"its harmonics must be whole numbers from 0 to {HIGHEST}"
        must(are_harmonics, told)
        must(len(set(first)) == len(first), "it must name each harmonic once")
    else:
        are_angles = len(rows) >= FEWEST_ANGLES and ascends(rows)
        must(are_angles, f"its angles, {FEWEST_ANGLES} at least, must ascend")
        told = "its angles must lie within one turn, the first not repeated as the last"
        must(first[-1] < first[0] + 2 * math.pi, told)
    return kept_table(head, rows)


def must(holds: Any, told: str) -> None:
    """Raise ValueError with the text `told` unless the condition `holds`."""
    if not holds:
        raise ValueError(told)


def are_finite(rows: Rows) -> bool:
    """Return whether all numbers of a table are finite."""
    return all(map(math.isfinite, itertools.chain(*rows)))


def ascends(rows: Rows) -> bool:
    """Return whether the numbers in the first column of a table's rows ascend."""
    return all(a[0] < b[0] for a, b in itertools.pairwise(rows))


def read(path: Path) -> str:
    """Return a file's text; ValueError if empty, or if larger than `MOST_BYTES`."""
    name = shown(str(path))
    try:
        is_small = path.stat().st_size <= MOST_BYTES and path.is_file()
        told = f"must name a file of at most {MOST_BYTES} bytes, got {name}"
        must(is_small, told)
        data = path.read_bytes()
    except OSError as failed:
        raise ValueError(f"cannot read {name}: {failed.strerror}") from None
    try:
        text = text_of_table(data, path)
    except ValueError as failed:
        raise ValueError(f"cannot read {name}: {failed}") from None
    told = f"must name a file that has a table, got {name}, which is empty"
    must(text.strip(), told)
    return text


def _head_and_rows(text: str, heads: tuple[str, ...]) -> tuple[str, Rows]:
    """Return which of several heads a table has, and its rows of numbers, in SI.

    text : the table in one line, as a scene stores it, or the name of a CSV file
    heads : names of the columns that a table may have, with commas between them
    """
    found = text.partition(";")[0].replace(" ", "").lower()
    if ";" in text and found in heads:
        return found, _rows_in_line(text, found)
    columns = columns_of(text.replace(";", "\n") if ";" in text else read(Path(text)))
    for head in heads:
        if sorted(columns) == sorted(head.split(",")):
            parts = [columns[name].numbers(UNITS[name]) for name in head.split(",")]
            return head, list(zip(*parts, strict=True))
    wanted = ", or ".join(heads)
    given = shown(",".join(columns))
    raise ValueError(f"it must have the columns {wanted}, got {given}")


def _rows_in_line(text: str, head: str) -> Rows:
    wide = head.count(",") + 1
    told = f"every row must have {wide} numbers, {head}"
    try:
        rows = kept_rows(text)
    except ValueError:
        raise ValueError(told) from None
    must(all(len(row) == wide for row in rows), told)
    return rows
