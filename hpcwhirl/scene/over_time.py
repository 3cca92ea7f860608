"""Tables over time of an input, such as the speed, that a scene keeps as text.

A table has two columns, the time in s and the quantity in its unit. A scene keeps it in
one line, so that it does not depend on the file any more.
"""

from __future__ import annotations

import csv
import itertools
import math
from pathlib import Path

from hpcwhirl.errors import shown

TIME = "time"
MOST_BYTES = 1 << 20
Rows = list[tuple[float, float]]


def table_over_time(text: str, name: str) -> str:
    """Return a table as one line of text, the form that a scene keeps.

    Parameters
    ----------
    text : name of a CSV file with the columns time and `name`, or a table in one line,
        as "time,speed;0,100;2,300"; "" is returned as it is
    name : of the quantity

    Raises
    ------
    ValueError
        where the file cannot be read, or is no such table
    """
    if not text:
        return ""
    lines = lines_of(text)
    head = [word.strip().lower() for word in lines[0].split(",")]
    if head != [TIME, name]:
        msg = f"it must have the columns {TIME},{name}, got {shown(lines[0])}"
        raise ValueError(msg)
    try:
        rows = [_row(line) for line in lines[1:]]
    except ValueError:
        msg = f"every row must have two numbers, {TIME} and {name}"
        raise ValueError(msg) from None
    _check(rows)
    return ";".join([f"{TIME},{name}", *(f"{t!r},{value!r}" for t, value in rows)])


def rows_over_time(text: str) -> Rows:
    """Return (s, value) of each row of a table that a scene keeps."""
    return [_row(line) for line in text.split(";")[1:]]


def scaled(text: str, factor: float) -> str:
    """Return a table that a scene keeps, with its values times a factor."""
    if not text:
        return ""
    rows = [f"{time!r},{factor * value!r}" for time, value in rows_over_time(text)]
    return ";".join([text.split(";", maxsplit=1)[0], *rows])


def _row(line: str) -> tuple[float, float]:
    time, value = map(float, line.split(","))
    return time, value


def lines_of(text: str) -> list[str]:
    """Return the rows of a table in one line, or of the CSV file that a text names.

    Raises
    ------
    ValueError
        where the file cannot be read
    """
    if ";" in text:
        return text.split(";")
    path = Path(text)
    try:
        if not path.is_file() or path.stat().st_size > MOST_BYTES:
            msg = f"must name a file of at most {MOST_BYTES} bytes, got {shown(path)}"
            raise ValueError(msg)
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeError) as failed:
        told = getattr(failed, "strerror", None) or "it is not UTF-8"
        msg = f"cannot read {shown(path)}: {told}"
        raise ValueError(msg) from None
    return [",".join(row) for row in csv.reader(text.splitlines()) if row]


def _check(rows: Rows) -> None:
    """Raise ValueError unless times begin at 0 and ascend, and all is finite."""
    if len(rows) < 2 or not all(map(math.isfinite, itertools.chain(*rows))):
        msg = "it must have two rows at least, of finite numbers"
        raise ValueError(msg)
    pairs = itertools.pairwise(time for time, _ in rows)
    if rows[0][0] != 0.0 or any(after <= before for before, after in pairs):
        msg = f"its {TIME} must begin at 0 s and ascend"
        raise ValueError(msg)
