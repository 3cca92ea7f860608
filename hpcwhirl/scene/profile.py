"""The shape of a casing that is not round, from a table that an input names.

Two layouts: harmonics, w = sum of a cos(h theta - phi), in the columns harmonic,
amplitude (m) and phase (rad); or values over angle, in the columns angle (rad) and
departure (m), joined by straight lines around the casing. w is the departure from
round, outward: the gap is wider by it.
"""

from __future__ import annotations

import itertools
import math

from hpcwhirl.errors import shown
from hpcwhirl.scene.kept_table import Rows, kept_table, lines_of, rows_of

HARMONICS = "harmonic,amplitude,phase"
ANGLES = "angle,departure"
MOST_ROWS = 4096
HIGHEST = 200  # highest harmonic that a table may name
FEWEST_ANGLES = 3


def profile_table(text: str) -> str:
    """Return a profile's table as one line of text, the form that a scene keeps.

    text : name of a CSV file, or a table in one line, as "harmonic,amplitude,phase;
        2,1e-5,0"; "" is returned as it is

    Raises
    ------
    ValueError
        if the file cannot be read, or is not a table of a profile
    """
    if not text:
        return ""
    lines = lines_of(text)
    head = ",".join(word.strip().lower() for word in lines[0].split(","))
    if head not in {HARMONICS, ANGLES}:
        msg = f"it must have the columns {HARMONICS}, or {ANGLES}, got {shown(head)}"
        raise ValueError(msg)
    try:
        rows = rows_of(lines[1:])
    except ValueError:
        msg = "its values must be numbers"
        raise ValueError(msg) from None
    if any(len(row) != head.count(",") + 1 for row in rows):
        msg = f"every row must have {head.count(',') + 1} numbers, {head}"
        raise ValueError(msg)
    if not 0 < len(rows) <= MOST_ROWS or not all(
        map(math.isfinite, itertools.chain(*rows))
    ):
        msg = f"it must have 1 to {MOST_ROWS} rows, of finite numbers"
        raise ValueError(msg)
    (_check_harmonics if head == HARMONICS else _check_angles)(rows)
    return kept_table(head, rows)


def _check_harmonics(rows: Rows) -> None:
    orders = [row[0] for row in rows]
    if any(h != int(h) or not 0 <= h <= HIGHEST for h in orders):
        msg = f"its harmonics must be whole numbers from 0 to {HIGHEST}"
        raise ValueError(msg)
    if len(set(orders)) < len(orders):
        msg = "it must name each harmonic once"
        raise ValueError(msg)


def _check_angles(rows: Rows) -> None:
    angles = [row[0] for row in rows]
    pairs = itertools.pairwise(angles)
    if len(rows) < FEWEST_ANGLES or any(after <= before for before, after in pairs):
        msg = f"its angles, {FEWEST_ANGLES} at least, must ascend"
        raise ValueError(msg)
    if not angles[-1] < angles[0] + 2 * math.pi:
        msg = "its angles must lie within one turn, the first not repeated as the last"
        raise ValueError(msg)
