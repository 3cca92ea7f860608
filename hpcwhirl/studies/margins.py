"""Safe ranges of an input, in which all cases are damped, and first cases not damped.

Cases that differ in only one swept input form a line, in ascending order of this input.
A safe range is an unbroken sequence of damped cases on a line. It is a sample: nothing
is known between its cases, which are up to a `step` apart. Points drawn between them
and computed (`studies.margin_check`) measure which share of the range is damped;
`with_points` adds them to the line.

A pulse is safe only if all weaker pulses that were tried are damped, too. So
`first_changes` counts on each line only the damped cases up to the first one that is
not damped. Words may change more than once; the number of changes is given.
`working_point` lists the safe ranges of every swept input around one point.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.analysis.columns import WORD, source_of
from hpcwhirl.errors import InputError
from hpcwhirl.store.reading.select import counted, follows, swept_of, variable_of
from hpcwhirl.store.reading.shares import COUNT, MAJORITY

if TYPE_CHECKING:
    import xarray

SAFE = "damped"
SHARE = f"share_{SAFE}"
Texts = NDArray[np.str_]


class Line(NamedTuple):
    """Cases that differ in one swept input only, in ascending order of this input.

    Attributes
    ----------
    fixed : {other swept input: its value in all cases of the line}
    values : (n,), values of the input that differs
    words : (n,), word of each case; with twins, that of the majority, or "unsure"
    share : (n,), share of a case's twins that are damped; NaN without twins
    cases : (n,), number of each case in the campaign; -1 for a point drawn later
    """

    fixed: dict[str, Any]
    values: NDArray[np.float64]
    words: Texts
    share: NDArray[np.float64]
    cases: NDArray[np.int64]


@dataclass(frozen=True)
class SafeRange:
    """An unbroken sequence of damped cases on a line of cases.

    On a line without damped cases `cases` is 0 and the other numbers are NaN.

    Attributes
    ----------
    fixed : {swept input: value} of the line
    low, high : the input's value in the first and in the last damped case
    below, above : its value in the adjacent cases, not damped; NaN where the sweep ends
    word_below, word_above : words of these adjacent cases; "" where the sweep ends
    cases : number of damped cases
    share : smallest share of damped twins among its cases; NaN if no case has twins
    step : largest distance between successive cases from `below` to `above`; NaN if
        there are no two
    """

    fixed: dict[str, Any]
    low: float
    high: float
    below: float
    above: float
    word_below: str
    word_above: str
    cases: int
    share: float
    step: float

    def distance(self, value: float) -> float:
        """Return how far a value of the input lies inside the safe range; < 0: outside.

        Inside, it is the distance to the last damped case before the nearest case that
        is not damped: infinite if there is no such case at either end. Outside, it is
        minus the distance to the nearer end. NaN if the range is empty.

        value : value of the input, SI
        """
        if not self.cases:
            return float("nan")
        ends = [
            (value - self.low, self.word_below),
            (self.high - value, self.word_above),
        ]
        beyond = [gap for gap, _ in ends if gap < 0.0]
        return min(beyond or [gap for gap, word in ends if word] or [float("inf")])


def safe_ranges(
    data: xarray.Dataset, over: str = "speed", sure: float = 0.0
) -> list[SafeRange]:
    """Return the ranges of an input in which all cases of a line are damped.

    With [twins], a case counts as damped if most of the case and its twins are damped.

    Parameters
    ----------
    data : results of `open_results`
    over : name of a swept numeric input
    sure : least share of damped twins with which a case counts as damped

    Returns
    -------
    safe ranges of all lines, sorted by the other swept inputs; a line without damped
    cases has one empty range. Of a refined campaign only lines that span the whole
    sweep of `over` count

    Raises
    ------
    InputError
        if `over` was not swept, is not numeric, or was drawn, so that no cases form a
        line
    """
    return [found for line in lines_of(data, over, sure) for found in ranges_of(line)]


def lines_of(data: xarray.Dataset, over: str, sure: float) -> list[Line]:
    """Return a campaign's lines of cases, which differ only in the input `over`.

    Cases whose word a confirming preset has superseded are on no line. Parameters are
    those of `safe_ranges`.
    """
    data = counted(data)
    swept = swept_of(data)
    name = variable_of(over, swept)
    values = data[name].to_numpy()
    if values.dtype.kind not in "iuf":
        msg = f"safe ranges need an input of numbers, got {name}, which is text"
        raise InputError(msg)
    words, share = _words(data, sure)
    lines = _lines(data, _fixed(data, name, swept), values)
    if not lines:
        raise InputError(
            f"no two cases differ in {name} alone: safe ranges need a sweep; where "
            "inputs were drawn, hpcwhirl.shares gives the probability of each regime"
        )
    out = []
    for fixed, line in lines:
        order = line[np.argsort(values[line], kind="stable")]
        at = values[order].astype(float)
        cases = data["case"].to_numpy()[order]
        out.append(Line(fixed, at, words[order], share[order], cases))
    return out


def with_points(line: Line, values: Sequence[float], words: Sequence[str]) -> Line:
    """Return a line with further points, which were computed between its cases.

    values, words : (m,), the input's value at each point; its word
    """
    at = np.concatenate([line.values, values])
    order = np.argsort(at, kind="stable")
    both = np.concatenate([line.words, np.asarray(words, "U16")])
    none = np.full(len(values), np.nan)
    cases = np.concatenate([line.cases, np.full(len(values), -1)])
    share = np.concatenate([line.share, none])
    return Line(line.fixed, at[order], both[order], share[order], cases[order])


def _words(data: xarray.Dataset, sure: float) -> tuple[Texts, NDArray[np.float64]]:
    """Return each case's word, (cases,), and the share of its twins that are damped.

    A case with twins has the word of most of them. A damped case whose share is below
    `sure` has the word "unsure"; a case without twins has the share NaN.

    data : results of `open_results`
    """
    source = source_of(data)
    words = source.column(WORD).astype("U16")
    if MAJORITY not in data:
        return words, np.full(source.cases, np.nan)
    majority, count = source.column(MAJORITY).astype("U16"), source.column(COUNT)
    words = np.where((count > 0) & (majority != "none"), majority, words)
    share = source.column(SHARE)
    return np.where((words == SAFE) & (share < sure), "unsure", words), share


def _fixed(data: xarray.Dataset, over: str, swept: list[str]) -> list[str]:
    """Return the names of the swept inputs that are constant along a line of cases.

    over : name of the input that differs between the cases of a line; inputs that were
        swept as functions of it are left out, too
    swept : names of all swept inputs
    """
    return [n for n in swept if n != over and not follows(data, n, over)]


def _lines(
    data: xarray.Dataset, fixed: list[str], values: NDArray[Any]
) -> list[tuple[dict[str, Any], NDArray[np.intp]]]:
    """Return each line of cases: {fixed input: its value}, and (n,), indices of cases.

    Lines that do not reach from the least to the largest value are left out.

    Parameters
    ----------
    data : results from `open_results`
    fixed : names of the inputs that are constant along a line
    values : (cases,), each case's value of the input that differs along lines
    """
    columns = [data[n].to_numpy().tolist() for n in fixed]
    keys = list(zip(*columns, strict=True)) if fixed else [()] * len(values)
    order = sorted(range(len(values)), key=lambda i: keys[i])
    ends = values.min(), values.max()
    out = []
    for key, cases in groupby(order, key=lambda i: keys[i]):
        line = np.array(list(cases))
        along = values[line]
        if ends[0] < ends[1] and (along.min(), along.max()) == ends:
            out.append((dict(zip(fixed, key, strict=True)), line))
    return out


def ranges_of(line: Line) -> list[SafeRange]:
    """Return the safe ranges, unbroken sequences of damped cases, of a line of cases.

    There is one, empty, if no case is damped.
    """
    fixed, values, words, share, _ = line
    safe = np.concatenate([[False], words == SAFE, [False]])
    runs = np.flatnonzero(safe[1:] != safe[:-1]).reshape(-1, 2)
    nan = float("nan")
    if not len(runs):
        return [SafeRange(fixed, nan, nan, nan, nan, "", "", 0, nan, nan)]
    at, told = [nan, *values.tolist(), nan], ["", *words.tolist(), ""]
    return [
        SafeRange(
            fixed,
            low=at[first + 1],
            high=at[end],
            below=at[first],
            above=at[end + 1],
            word_below=told[first],
            word_above=told[end + 1],
            cases=end - first,
            share=float(np.fmin.reduce(share[first:end])),
            step=_step(values[max(first - 1, 0) : end + 1]),
        )
        for first, end in runs.tolist()
    ]


def _step(values: NDArray[np.float64]) -> float:
    """Return the largest distance between successive values, NaN if there are no two.

    values : ascending
    """
    return float(np.diff(values).max()) if len(values) > 1 else float("nan")


@dataclass(frozen=True)
class FirstChange:
    """Where a line of cases, followed from the least value upward, stops being damped.

    Attributes
    ----------
    fixed : {other swept input: its value in all cases of the line}
    safe : largest value up to which all cases are damped; NaN if the first case is not
    unsafe : value of the next case, which is not damped; NaN if all cases are damped
    word : word of the case at `unsafe`; "" if all cases are damped
    changes : number of changes between damped and not damped along the whole line
    step : largest distance between successive cases up to `unsafe`; NaN if there are no
        two
    """

    fixed: dict[str, Any]
    safe: float
    unsafe: float
    word: str
    changes: int
    step: float


def first_changes(
    data: xarray.Dataset, over: str = "force", sure: float = 0.0
) -> list[FirstChange]:
    """Return up to which value of an input all cases are damped, on each line of cases.

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
    return [first_of(line) for line in lines_of(data, over, sure)]


def first_of(line: Line) -> FirstChange:
    """Return up to which value of the input all cases of a line are damped."""
    safe = line.words == SAFE
    changes = int(np.count_nonzero(safe[1:] != safe[:-1]))
    if safe.all():
        last = float(line.values[-1])
        return FirstChange(
            line.fixed, last, float("nan"), "", changes, _step(line.values)
        )
    at = int(np.argmin(safe))
    last = float(line.values[at - 1]) if at else float("nan")
    word = str(line.words[at])
    step = _step(line.values[: at + 1])
    return FirstChange(line.fixed, last, float(line.values[at]), word, changes, step)


@dataclass(frozen=True)
class Along:
    """The safe range of one input around a working point.

    Attributes
    ----------
    name, value : the input, and its value at the point
    found : the safe range that contains the value, or else the one nearest to it
    """

    name: str
    value: float
    found: SafeRange


def working_point(
    data: xarray.Dataset, point: Mapping[str, float], sure: float = 0.0
) -> list[Along]:
    """Return the safe range around a working point along each of its inputs.

    Each range is taken on the line of cases that is nearest to the point in the other
    inputs; distances are in units of an input's swept span.

    Parameters
    ----------
    data : results from `open_results`
    point : the working point, {swept numeric input: value}
    sure : least share of damped twins with which a case counts as damped

    Raises
    ------
    InputError
        if the point has no input, or an input that was not swept or is no number
    """
    swept = swept_of(data)
    if not point:
        msg = f"a point needs a value of a swept input ({', '.join(swept)}), got none"
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
    return Along(name, value, nearest_range(near, value))


def nearest_range(ranges: Sequence[SafeRange], value: float) -> SafeRange:
    """Return the range that contains a value of the input, or else the nearest one."""
    return max(ranges, key=lambda found: _depth(found, value))


def _depth(found: SafeRange, value: float) -> float:
    return found.distance(value) if found.cases else -float("inf")


def _away(
    data: xarray.Dataset, fixed: Mapping[str, Any], point: Mapping[str, float]
) -> float:
    """Return the distance of a line of cases from a point.

    It is the sum over numeric inputs of |difference| / swept span.

    fixed, point : {input: its value along the line}; {input: its value at the point}
    """
    away = 0.0
    for name in fixed.keys() & point.keys():
        values = data[name].to_numpy()
        if values.dtype.kind in "iuf":
            span = float(values.max() - values.min()) or 1.0
            away += abs(fixed[name] - point[name]) / span
    return away
