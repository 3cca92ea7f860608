"""Tables over time of an input, such as the speed, that a scene keeps as text.

A table has two columns, the time in s and the quantity in its unit.
"""

from __future__ import annotations

import itertools
import math

from hpcwhirl.errors import shown
from hpcwhirl.scene.kept_table import Rows, kept_rows, kept_table, lines_of, rows_of

TIME = "time"


def table_over_time(text: str, name: str) -> str:
    """Return a table over time as one line of text, the form that a scene keeps.

    Parameters
    ----------
    text : name of a CSV file with the columns time and `name`, or a table in one line,
        as "time,speed;0,100;2,300"; "" is returned as it is
    name : name of the quantity

    Raises
    ------
    ValueError
        if the file cannot be read, or is not a table over time
    """
    if not text:
        return ""
    lines = lines_of(text)
    head = [word.strip().lower() for word in lines[0].split(",")]
    if head != [TIME, name]:
        msg = f"it must have the columns {TIME},{name}, got {shown(lines[0])}"
        raise ValueError(msg)
    try:
        rows: Rows = [(time, value) for time, value in rows_of(lines[1:])]
    except ValueError:
        msg = f"every row must have two numbers, {TIME} and {name}"
        raise ValueError(msg) from None
    _check(rows)
    return kept_table(f"{TIME},{name}", rows)


def scaled(text: str, factor: float) -> str:
    """Return a kept table over time with its second column times a factor."""
    if not text:
        return ""
    rows: Rows = [(time, factor * value) for time, value in kept_rows(text)]
    return kept_table(text.split(";", maxsplit=1)[0], rows)


def _check(rows: Rows) -> None:
    """Raise ValueError unless times begin at 0 and ascend, and all is finite."""
    if len(rows) < 2 or not all(map(math.isfinite, itertools.chain(*rows))):
        msg = "it must have two rows at least, of finite numbers"
        raise ValueError(msg)
    pairs = itertools.pairwise(time for time, _ in rows)
    if rows[0][0] != 0.0 or any(after <= before for before, after in pairs):
        msg = f"its {TIME} must begin at 0 s and ascend"
        raise ValueError(msg)
