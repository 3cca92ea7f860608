"""Cases of a grid that have a neighbour with another regime."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.scene.input_names import is_number
from hpcwhirl.scene.table import Table, distinct, labels, listed

Settings = Sequence[Mapping[str, Any]]


def along(settings: Settings, swept: Sequence[str]) -> list[str]:
    """Return the swept inputs that are numbers in every case: the axes of the grid."""
    table = Table.of(settings)
    columns = {name: listed(table.column(name, None).values) for name in swept}
    return [
        name
        for name, values in columns.items()
        if all(map(is_number, values)) and len(set(values)) > 1
    ]


def at_boundary(
    settings: Settings, swept: Sequence[str], words: Sequence[str] | NDArray[Any]
) -> NDArray[np.bool_]:
    """Return which cases have a neighbour with another regime, (cases,).

    Neighbours differ in only one numeric input, and their values of it are adjacent
    among the cases that agree in all other inputs. Cases without a regime are skipped.

    Parameters
    ----------
    settings : {swept input: value} of each case
    swept : names of the swept inputs
    words : regime of each case, "" for none
    """
    table = Table.of(settings)
    found = np.zeros(len(table), dtype=bool)
    word = np.asarray(words)
    known = word != ""
    columns = {name: table.column(name, None) for name in table.names}
    numbers = {n: distinct(column.values) for n, column in columns.items()}
    cases = np.arange(len(table))
    for name in along(table, swept):
        others = [(columns[n], numbers[n]) for n in columns if n != name]
        line, values = labels(others, cases), columns[name].values
        order = np.lexsort((columns[name].of(cases, np.array(values, float)), line))
        one, next_ = order[:-1], order[1:]
        apart = (line[one] == line[next_]) & (word[one] != word[next_])
        apart &= known[one] & known[next_]
        found[one[apart]] = found[next_[apart]] = True
    return found
