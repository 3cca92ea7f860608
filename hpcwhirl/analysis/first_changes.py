"""First changes: the value of an input up to which all cases are damped.

A pulse is safe only if all weaker pulses that were tried are damped, too. So along each
line of `margins` only the run of damped cases counts that begins at the least value.
Words may change more than once; the number of changes is given. `working_point` lists
the safe ranges of every swept input around one point.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcwhirl.analysis.margins import SAFE, Line, SafeRange, lines_of, safe_ranges
from hpcwhirl.errors import InputError
from hpcwhirl.store.reading.select import swept_of, variable_of

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True)
class FirstChange:
    """The end of the damped cases, from the least value of an input upward.

    Attributes
    ----------
    fixed : {swept input: value} of the line
    safe : largest value up to which all cases are damped; NaN if the first one is not
    unsafe : value of the next case, which is not damped; NaN if all are damped
    word : word of that case; "" if all are damped
    changes : number of changes between damped and not damped along the whole line
    """

    fixed: dict[str, Any]
    safe: float
    unsafe: float
    word: str
    changes: int

    def times(self, value: float) -> str:
        """Return the two values that enclose the change, as multiples of a value.

        Examples are ``1.7 to 1.75``, ``>= 3`` if there is no change, or ``< 0.5`` if
        the first case is not damped.
        """
        if not self.word:
            return f">= {self.safe / value:.4g}"
        if np.isnan(self.safe):
            return f"< {self.unsafe / value:.4g}"
        return f"{self.safe / value:.4g} to {self.unsafe / value:.4g}"


def first_changes(
    data: xarray.Dataset, over: str = "force", sure: float = 0.0
) -> list[FirstChange]:
    """Return a `FirstChange` along an input for each line of cases.

    Parameters
    ----------
    data : results from `open_results`
    over : name of a swept numeric input, such as the pulse's `force`
    sure : least share of damped twins with which a case counts as damped

    Raises
    ------
    InputError
        as for `safe_ranges`
    """
    return [_first(line) for line in lines_of(data, over, sure)]


def _first(line: Line) -> FirstChange:
    safe = line.words == SAFE
    changes = int(np.count_nonzero(safe[1:] != safe[:-1]))
    if safe.all():
        last = float(line.values[-1])
        return FirstChange(line.fixed, last, float("nan"), "", changes)
    at = int(np.argmin(safe))
    last = float(line.values[at - 1]) if at else float("nan")
    word = str(line.words[at])
    return FirstChange(line.fixed, last, float(line.values[at]), word, changes)


@dataclass(frozen=True)
class Along:
    """The safe range around a point along one input.

    Attributes
    ----------
    name, value : the input, and its value at the point
    found : the safe range that contains the value, or the nearest one
    """

    name: str
    value: float
    found: SafeRange


def working_point(
    data: xarray.Dataset, point: Mapping[str, float], sure: float = 0.0
) -> list[Along]:
    """Return the safe range around a point along each of its inputs.

    Each range is taken on the line that is nearest to the point in the other inputs,
    measured in parts of their spans.

    Parameters
    ----------
    data : results from `open_results`
    point : {swept input of numbers: value}
    sure : least share of damped twins with which a case counts as damped

    Raises
    ------
    InputError
        if the point has no input, or one that was not swept or is no number
    """
    swept = swept_of(data)
    if not point:
        msg = f"a point needs values of swept inputs ({', '.join(swept)}), got none"
        raise InputError(msg)
    named = {variable_of(n, swept, "input of the point"): v for n, v in point.items()}
    return [_along(data, name, named, sure) for name in named]


def _along(
    data: xarray.Dataset, name: str, point: Mapping[str, float], sure: float
) -> Along:
    ranges = safe_ranges(data, name, sure)
    away = [_away(data, found.fixed, point) for found in ranges]
    near = [r for r, far in zip(ranges, away, strict=True) if far == min(away)]
    value = point[name]
    return Along(name, value, max(near, key=lambda r: _depth(r, value)))


def _depth(found: SafeRange, value: float) -> float:
    return found.distance(value) if found.cases else -float("inf")


def _away(
    data: xarray.Dataset, fixed: Mapping[str, Any], point: Mapping[str, float]
) -> float:
    """Return the distance of a line from a point, in units of the inputs' spans."""
    away = 0.0
    for name in fixed.keys() & point.keys():
        values = data[name].to_numpy()
        if values.dtype.kind in "iuf":
            span = float(values.max() - values.min()) or 1.0
            away += abs(fixed[name] - point[name]) / span
    return away
