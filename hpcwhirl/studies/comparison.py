"""Two campaigns side by side: which words changed, and which numbers moved.

Cases of two campaigns are compared where they meet: where all inputs that either of
them varies have the same value. An input that only one of them varies is a constant of
the other. Other inputs may differ, such as the time step or a preset: what they change
is what is compared. Of a refined map only the case of highest fidelity at each point
counts.
"""

from __future__ import annotations

import json
import tomllib
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.analysis.columns import WORD, source_of
from hpcwhirl.errors import InputError
from hpcwhirl.scene.quantities import CHAOS, ROW, variable_name
from hpcwhirl.store.reading.select import counting, known_counts, swept_of

if TYPE_CHECKING:
    import xarray

Cases = NDArray[np.intp]
Floats = NDArray[np.float64]
# numbers that describe the computation, not the motion
COMPUTED = {"time_step", "sample_interval", "modes", "folds", "steps", "step_share",
            "lean_checked",
            "gap_error", "ledger_error", "ledger_residual"}  # fmt: skip
NONE = {"certificate", "last_contact"}  # times, of which -1 stands for none
DIGITS = 10  # significant digits to which two values of an input must agree


@dataclass(frozen=True)
class Moved:
    """How far a number differs between the cases that meet.

    Attributes
    ----------
    name : variable of the results
    cases : number of pairs in which both campaigns have the number
    differ : number of pairs in which it differs
    median, ninety, largest : median, ninth decile and largest value of |b - a| /
        max(|a|, |b|) over these pairs
    """

    name: str
    cases: int
    differ: int
    median: float
    ninety: float
    largest: float


@dataclass(frozen=True)
class Comparison:
    """Two campaigns A and B, compared in n cases that meet.

    Attributes
    ----------
    over : names of the inputs that either campaign varies
    inputs : {input: (its value in A, in B)}, of the other inputs that differ
    cases : (n, 2), number of each case in A and in B
    alone : number of cases of A, and of B, that meet none of the other campaign
    at : {input: (n,)}, values of the varied inputs
    words : (n, 2), word of each case in A and in B
    moved : numbers of the motion in both results, those that moved most first
    """

    over: tuple[str, ...]
    inputs: dict[str, tuple[Any, Any]]
    cases: Cases
    alone: tuple[int, int]
    at: dict[str, NDArray[Any]]
    words: NDArray[np.str_]
    moved: tuple[Moved, ...]

    @property
    def changed(self) -> NDArray[np.bool_]:
        """Whether the word of each case changed, (n,)."""
        return np.asarray(self.words[:, 0] != self.words[:, 1])

    def transitions(self) -> dict[tuple[str, str], int]:
        """Return {(word in A, word in B): cases}, changed words first."""
        counts = Counter(map(tuple, self.words.tolist()))
        order = sorted(counts, key=lambda pair: (pair[0] == pair[1], -counts[pair]))
        return {(pair[0], pair[1]): counts[pair] for pair in order}


def compare(a: xarray.Dataset, b: xarray.Dataset) -> Comparison:
    """Return two campaigns' words and numbers, side by side where their cases meet.

    Parameters
    ----------
    a, b : results of `open_results`

    Raises
    ------
    InputError
        if no cases meet, or two cases of a campaign have equal inputs
    """
    both = a, b
    shared = [_shared(data) for data in both]
    over = tuple(dict.fromkeys(n for data in both for n in swept_of(data)))
    final = [np.flatnonzero(counting(data)) for data in both]
    keys = [
        _keys(data, over, some, cases)
        for data, some, cases in zip(both, shared, final, strict=True)
    ]
    meet = [key for key in keys[0] if key in keys[1]]
    if not meet:
        raise InputError(
            f"no case of one campaign has the {', '.join(over) or 'inputs'} of a case "
            "of the other"
        )
    cases = np.array([[known[key] for known in keys] for key in meet], np.intp)
    words = [
        source_of(data).column(WORD).astype("U16")[cases[:, i]]
        for i, data in enumerate(both)
    ]
    at = {name: np.array([key[i] for key in meet]) for i, name in enumerate(over)}
    moved = tuple(_moved(a, b, cases))
    alone = len(keys[0]) - len(meet), len(keys[1]) - len(meet)
    differing = _differing(shared[0], shared[1], over)
    return Comparison(over, differing, cases, alone, at, np.stack(words, axis=1), moved)


def _shared(data: xarray.Dataset) -> dict[str, Any]:
    """Return {variable: value} of the inputs that all cases of a campaign share."""
    document = tomllib.loads(str(data.attrs["scene"]))
    return {
        variable_name(name.removeprefix("scene.")): value
        for name, value in _flat(document, "")
    }


def _flat(table: Mapping[str, Any], before: str) -> list[tuple[str, Any]]:
    """Return (dotted name, value) of all values in nested tables.

    before : dotted name of the table, with a dot at its end
    """
    out: list[tuple[str, Any]] = []
    for name, value in table.items():
        if isinstance(value, Mapping):
            out += _flat(value, f"{before}{name}.")
        else:
            out.append((f"{before}{name}", value))
    return out


def _keys(
    data: xarray.Dataset, over: Sequence[str], shared: Mapping[str, Any], cases: Cases
) -> dict[tuple[Any, ...], int]:
    """Return {values of the varied inputs: number of the case}.

    Parameters
    ----------
    data : results
    over : varied inputs; one that this campaign does not vary is taken from `shared`
    shared, cases : inputs of all cases; numbers of the cases that count
    """
    columns = []
    for name in over:
        if name not in data and name not in shared:
            raise InputError(f"one campaign varies {name}, the other has no such input")
        values = data[name].to_numpy()[cases] if name in data else [shared[name]]
        columns.append([*map(_rounded, values)] * (1 if name in data else len(cases)))
    keys = list(zip(*columns, strict=True)) if over else [()] * len(cases)
    out = dict(zip(keys, cases.tolist(), strict=True))
    if len(out) < len(keys):
        raise InputError(
            "two cases of a campaign have equal inputs: campaigns with [branch] or "
            "repeated draws cannot be compared case by case"
        )
    return out


def _rounded(value: Any) -> Any:
    if isinstance(value, str | list | tuple):
        return value if isinstance(value, str) else json.dumps(value)
    return float(f"{float(value):.{DIGITS}g}")


def _differing(
    a: Mapping[str, Any], b: Mapping[str, Any], over: Sequence[str]
) -> dict[str, tuple[Any, Any]]:
    """Return {input: (value in A, in B)} of inputs that differ but do not vary."""
    names = [n for n in dict.fromkeys([*a, *b]) if n not in over]
    return {n: (a.get(n), b.get(n)) for n in names if a.get(n) != b.get(n)}


def _moved(a: xarray.Dataset, b: xarray.Dataset, cases: Cases) -> list[Moved]:
    """Return how far each number of the results differs, that with most first.

    cases : (n, 2), numbers of the cases in A and in B
    """
    known = [
        n
        for n in (*ROW, *CHAOS)
        if n not in COMPUTED
        and all(n in d and d[n].dims == ("case",) and d[n].dtype.kind in "iuf"
               for d in (a, b))
    ]  # fmt: skip
    found = [
        _difference(n, *(_known(d, n)[cases[:, i]] for i, d in enumerate((a, b))))
        for n in known
    ]  # fmt: skip
    moved = [one for one in found if one.cases]
    return sorted(moved, key=lambda one: (-one.median, -one.largest))


def _known(data: xarray.Dataset, name: str) -> Floats:
    """Return a number of all cases, (cases,), NaN where it is missing."""
    values = known_counts(data[name].to_numpy()).astype(float)
    return np.where(values < 0.0, np.nan, values) if name in NONE else values


def _difference(name: str, a: Floats, b: Floats) -> Moved:
    """Return how far a number, (n,) in A and in B, differs; NaN is no number."""
    both = np.isfinite(a) & np.isfinite(b)
    a, b = a[both], b[both]
    size = np.maximum(abs(a), abs(b))
    part = np.divide(abs(b - a), size, out=np.zeros(len(a)), where=size > 0.0)
    if not len(part):
        return Moved(name, 0, 0, np.nan, np.nan, np.nan)
    middle, high, most = np.quantile(part, (0.5, 0.9, 1.0)).tolist()
    return Moved(name, len(part), int((part > 0.0).sum()), middle, high, most)
