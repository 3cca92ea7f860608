"""Errors of the numbers of a motion against a finer reference, and their quantiles.

A motion with contact makes small differences larger, also those that the time step
makes by itself. So each computation is repeated with steps that are shorter by `NUDGE`
and more, its twins; what they differ by is the scatter. The twins of the reference
differ in modes, too: where they disagree, no error is known.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from scipy import stats

from hpcwhirl.analysis.estimate import LEAST
from hpcwhirl.campaign.simulate import Result
from hpcwhirl.scene.words import NO_END, word_of

NUDGE = 0.03  # by which the time step of a twin is shorter than that of the one before
CONFIDENCE = 0.95
NINE = 0.9  # share of cases whose errors are below the higher quantile
SENSITIVE = 0.05  # scatter of the reference from which a case is compared otherwise
# {name of a number: scale of its error, see `scale_of`}
NUMBERS = {
    "orbit_radius": "radius",
    "contact_impulse": "itself",
    "centre_peak": "radius",
    "blade_peak": "itself",
    "orbit_area": "area",
    "line_frequency": "itself",
    "growth_rate": "window",
}
# numbers that can be compared between runs of different duration
ONLY_LATE = ("orbit_radius", "line_frequency", "growth_rate")
SCORED = ("orbit_radius", "contact_impulse", "centre_peak", "blade_peak")
NOTHING = math.nan


@dataclass(frozen=True)
class Run:
    """Words, numbers and cost of one integration of a case.

    Attributes
    ----------
    regime, whirl : words; the regime is the reason why there is none, where that is so
    numbers : {name in `NUMBERS`: number}, and the window, s, and |ledger error|
    seconds : processor time, s
    """

    regime: str
    whirl: str
    numbers: dict[str, float]
    seconds: float

    @property
    def words(self) -> str:
        """Regime and whirl, as one text."""
        return f"{self.regime} {self.whirl}"

    @property
    def is_decided(self) -> bool:
        """Whether the run has a regime."""
        return self.regime not in NO_END


def run_of(result: Result, seconds: float) -> Run:
    """Return what is compared of a result.

    seconds : processor time that it took
    """
    row = result.row
    regime = word_of("ok", str(row["outcome"]), str(row["regime"]))
    numbers = {n: float(row[n]) for n in NUMBERS if n in row}
    numbers["window"] = float(row["window"])
    numbers["ledger_error"] = abs(float(row["ledger_error"]))
    return Run(regime, str(row["whirl"]), numbers, seconds)


def usual_words(runs: Sequence[Run]) -> str:
    """Return the words that most of the twins have."""
    words = [run.words for run in runs]
    return max(words, key=words.count)


def _values(number: str, runs: Sequence[Run]) -> Any:
    return np.array([run.numbers.get(number, NOTHING) for run in runs])


def scale_of(number: str, reference: Sequence[Run], gap: float) -> float:
    """Return by what the error of a number is divided: its size in the reference.

    A displacement of the centre is at least `LEAST` gap, an area swept at least that
    of a circle of this radius at the frequency of the line. The error of a growth rate
    is multiplied by the window, which makes it a change of ln amplitude.

    Parameters
    ----------
    number : one of `NUMBERS`
    reference : the reference's twins of one case
    gap : m
    """
    size = abs(float(_values(number, reference).mean()))
    kind = NUMBERS[number]
    if kind == "radius":
        return max(size, LEAST * gap)
    if kind == "window":
        return 1.0 / max(run.numbers["window"] for run in reference)
    if kind == "area":
        line = 2.0 * math.pi * abs(_values("line_frequency", reference))
        rate = np.nan_to_num(line).max()
        return max(size, float(0.5 * rate * (LEAST * gap) ** 2))
    return size


def error_of(
    number: str, runs: Sequence[Run], reference: Sequence[Run], gap: float
) -> tuple[float, float] | None:
    """Return the error of a number in one case: that of the mean, and of the worst run.

    Both are relative to `scale_of`. None where a value is not finite, or where the
    number is 0 in all runs; infinite where the reference's alone are 0.

    Parameters
    ----------
    number : one of `NUMBERS`
    runs, reference : twins of one case, with a setting and with the reference
    gap : m
    """
    a, b = _values(number, runs), _values(number, reference)
    if not (np.isfinite(a).all() and np.isfinite(b).all()):
        return None
    scale = scale_of(number, reference, gap)
    if scale == 0.0:
        return (math.inf, math.inf) if a.any() else None
    mean = float(b.mean())
    return abs(float(a.mean()) - mean) / scale, float(abs(a - mean).max()) / scale


def scatter_of(runs: Sequence[Run], gap: float) -> dict[str, float]:
    """Return how far the twins of a case differ by the length of the step alone.

    Returns {number: largest distance of a twin from the mean of the others / scale}

    runs, gap : twins with one setting; m
    """
    out = {}
    for number in NUMBERS:
        found = [
            error_of(number, [one], [run for run in runs if run is not one], gap)
            for one in runs
        ]
        finite = [error[0] for error in found if error is not None]
        if finite:
            out[number] = max(finite)
    return out


def sensitive(scatter: Mapping[str, float]) -> tuple[str, ...]:
    """Return the numbers that no setting could be right about in a case.

    They are those by which the reference's twins differ by more than `SENSITIVE`.

    scatter : of the reference's twins of the case, see `scatter_of`
    """
    return tuple(name for name, most in scatter.items() if most > SENSITIVE)


@dataclass(frozen=True)
class Quantile:
    """A quantile of an error over cases, with its 95 % interval.

    Attributes
    ----------
    value, low, high : the quantile and the ends of its interval, from the order of the
        cases' errors alone; `high` is infinite where there are too few cases to tell
    """

    value: float
    low: float
    high: float


def quantile_of(errors: Sequence[float], share: float) -> Quantile:
    """Return the quantile of errors over cases, the estimate of Weibull (n + 1).

    errors, share : error of each case, at least one; below which share of the cases
    """
    ordered = np.sort(np.asarray(errors, float))
    finite = np.where(np.isfinite(ordered), ordered, np.finfo(float).max)
    value = float(np.quantile(finite, share, method="weibull"))
    first, last = _ends(len(finite), share)
    low = 0.0 if math.isnan(first) else float(finite[int(first)])
    high = math.inf if math.isnan(last) else float(finite[int(last)])
    large = np.finfo(float).max
    return Quantile(*(math.inf if x >= large else x for x in (value, low, high)))


@lru_cache
def _ends(cases: int, share: float) -> tuple[float, float]:
    """Return between which places, from 0, of ordered errors a quantile lies.

    The interval has the probability `CONFIDENCE`; NaN: no end for so few cases.
    """
    test = stats.quantile_test(np.arange(cases), q=0, p=share)
    ends = test.confidence_interval(CONFIDENCE)
    return float(ends.low), float(ends.high)


@dataclass(frozen=True)
class Shift:
    """How a number of sensitive cases is distributed, against the reference.

    Attributes
    ----------
    cases : number of sensitive cases that have it
    distance, chance : statistic of Kolmogorov and Smirnov of the two samples (all
        twins of these cases, each divided by its case's mean in the reference), and
        the probability of a larger one for equal distributions of independent twins
    """

    cases: int
    distance: float
    chance: float


def shift_of(pairs: Sequence[tuple[Any, Any]]) -> Shift | None:
    """Return how far two distributions of a number lie apart; None without cases.

    pairs : values of the twins of each case with the setting and with the reference
    """
    good = [
        (a / b.mean(), b / b.mean())
        for a, b in pairs
        if np.isfinite(a).all() and np.isfinite(b).all() and b.mean() != 0.0
    ]
    if not good:
        return None
    a, b = (np.concatenate(part) for part in zip(*good, strict=True))
    test = stats.ks_2samp(a, b)
    return Shift(len(good), float(test.statistic), float(test.pvalue))


def shifts_of(
    pairs: Mapping[str, Sequence[tuple[Sequence[Run], Sequence[Run]]]],
) -> dict[str, Shift]:
    """Return {number: how its distribution differs} over sensitive cases.

    pairs : {number: twins of each sensitive case with the setting and the reference}
    """
    found = {
        number: shift_of([(_values(number, a), _values(number, b)) for a, b in of])
        for number, of in pairs.items()
    }
    return {number: shift for number, shift in found.items() if shift is not None}
