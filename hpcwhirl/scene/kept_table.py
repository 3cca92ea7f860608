"""Small tables from files that inputs name, kept by a scene as one line of text.

So a scene no longer depends on the file. The line holds the names of the columns and
the rows of numbers, as "time,speed;0,100;2,300".
"""

from __future__ import annotations

import csv
from collections.abc import Iterable
from pathlib import Path

from hpcwhirl.errors import shown

MOST_BYTES = 1 << 20
Rows = list[tuple[float, ...]]


def text_of(path: Path) -> str:
    """Return the text of a small file.

    Raises
    ------
    ValueError
        if it cannot be read, is empty, or is larger than `MOST_BYTES`
    """
    try:
        size = path.stat().st_size
        if not path.is_file() or size > MOST_BYTES:
            msg = f"must name a file of at most {MOST_BYTES} bytes, got {shown(path)}"
            raise ValueError(msg)
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeError) as failed:
        told = getattr(failed, "strerror", None) or "it is not UTF-8"
        msg = f"cannot read {shown(path)}: {told}"
        raise ValueError(msg) from None
    if not text.strip():
        msg = f"must name a file that has a table, got {shown(path)}, which is empty"
        raise ValueError(msg)
    return text


def lines_of(text: str) -> list[str]:
    """Return the lines of a kept table `text`, or of the CSV file that it names.

    Raises
    ------
    ValueError
        if the file cannot be read, or is empty
    """
    if ";" in text:
        return text.split(";")
    lines = text_of(Path(text)).splitlines()
    return [",".join(row) for row in csv.reader(lines) if row]


def rows_of(lines: Iterable[str]) -> Rows:
    """Return the numbers of each line; raise ValueError where one is no number."""
    return [tuple(map(float, line.split(","))) for line in lines]


def kept_rows(text: str) -> Rows:
    """Return the numbers in the rows of a kept table."""
    return rows_of(text.split(";")[1:])


def kept_table(head: str, rows: Rows) -> str:
    """Return a table as the line that a scene keeps; head : names of the columns."""
    return ";".join([head, *(",".join(map(repr, row)) for row in rows)])
