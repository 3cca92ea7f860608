"""Which cases of a grid have a neighbour of another word."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.scene.files import is_number

Settings = Sequence[Mapping[str, Any]]


def along(settings: Settings, swept: Sequence[str]) -> list[str]:
    """Return the swept inputs that are numbers in every case: the sides of a grid."""
    return [
        name
        for name in swept
        if all(is_number(row.get(name)) for row in settings)
        and len({row[name] for row in settings}) > 1
    ]


def at_boundary(
    settings: Settings, swept: Sequence[str], words: Sequence[str]
) -> NDArray[np.bool_]:
    """Return which cases have a neighbour of another word, (cases,).

    A neighbour differs in one number alone, which stands next among the values that
    this input has in cases that are alike in all others.

    Parameters
    ----------
    settings : the swept inputs' values of each case
    swept : names of the swept inputs
    words : of each case
    """
    found = np.zeros(len(settings), dtype=bool)
    for name in along(settings, swept):
        lines: dict[str, list[tuple[float, int]]] = {}
        for case, row in enumerate(settings):
            others = {n: v for n, v in row.items() if n != name}
            key = json.dumps(others, sort_keys=True)
            lines.setdefault(key, []).append((float(row[name]), case))
        for line in lines.values():
            cases = [case for _, case in sorted(line)]
            for one, next_ in pairwise(cases):
                if words[one] != words[next_]:
                    found[[one, next_]] = True
    return found
