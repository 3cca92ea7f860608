"""The history of a case: the cases that precede it on a branch.

A case may begin with the last state of another case instead of at rest. `history` names
an input and its values in the preceding cases, such as "speed = 300.0, 310.0". The
first of these cases began at rest with its pulse, each later one with the last state of
the preceding one, and the case itself begins with the last state of the last one. All
other inputs of these cases are equal, so that history and inputs determine the case.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence

from hpcwhirl.errors import shown

FORM = re.compile(r"([A-Za-z_.]+) = (\S.*)")
LIKE = 'such as "speed = 300.0, 310.0"'


def history_of(over: str, values: Sequence[float]) -> str:
    """Return the text `history` of a case on a branch; "" for the branch's first case.

    over, values : input that the branch sweeps; its values in the preceding cases
    """
    return f"{over} = {json.dumps(list(values))[1:-1]}" if values else ""


def parsed(history: str) -> tuple[str, list[float]]:
    """Return (input, its values in the preceding cases) of a history; ("", []) for "".

    history : text such as "speed = 300.0, 310.0"

    Raises
    ------
    ValueError
        if the text is no history
    """
    if not history:
        return "", []
    found = FORM.fullmatch(history)
    try:
        values = json.loads(f"[{found[2]}]") if found else None
    except ValueError:
        values = None
    if not found or not values or not all(type(v) in {int, float} for v in values):
        msg = f"must be an input and its values, {LIKE}, got {shown(history)}"
        raise ValueError(msg)
    return found[1], values


def checked(history: str) -> str:
    """Return a history unchanged; raise ValueError if the text is not in that form."""
    parsed(history)
    return history
