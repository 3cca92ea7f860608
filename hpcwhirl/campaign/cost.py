"""What cases cost: seconds learned from finished cases that lie near by.

Regimes differ in seconds a step, and a case that diverges ends early: both are learned
as one factor on a nominal cost. Costs decide what is handed out first and when a
campaign ends, never a result.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from hpcwhirl.campaign.design import Design
from hpcwhirl.errors import WhirlError
from hpcwhirl.scene import flatten

Floats = NDArray[np.float64]
NEAREST = 4  # finished cases that a prediction is taken from
MOST_KNOWN = 4096  # finished cases that are looked at
APART = 10.0  # between two words, where the whole range of a number is 1
CLOSE = 1e-4  # squared distance below which neighbours count alike


def predicted(design: Design, case: int) -> tuple[float, float]:
    """Return steps and seconds of a case that runs to its end; 0 without a model."""
    try:
        resolved = design.resolved(case)
        known = resolved.steps, resolved.cost
    except WhirlError:  # it will fail as a row
        return 0.0, 0.0
    return known


class Costs:
    """Predicted seconds of every case, better with every case that finishes.

    Parameters
    ----------
    nominal : (n,), s, of each case before anything is known
    places : (n, d), where each case lies among the swept inputs, see `places_of`
    steps : (n,), of each case that runs to its end
    """

    def __init__(
        self, nominal: Floats, places: Floats, steps: Sequence[float] = ()
    ) -> None:
        self.nominal, self.places, self.steps = nominal, places, steps
        self.factor = np.full(len(nominal), np.nan)  # seconds over nominal, if known

    @classmethod
    def unknown(cls) -> Costs:
        """Return the costs of no case: what a rank that hands nothing out has."""
        return cls(np.zeros(0), np.zeros((0, 1)))

    def learn(self, cases: Sequence[int], seconds: float) -> None:
        """Take in that cases together took some seconds."""
        chosen = np.asarray(cases, dtype=np.intp)
        expected = float(self.nominal[chosen].sum())
        if expected > 0.0 and np.isfinite(seconds):
            self.factor[chosen] = seconds / expected

    def add(self, nominal: float, place: Floats) -> int:
        """Add a case; return its number here."""
        self.nominal = np.append(self.nominal, nominal)
        self.places = np.vstack([self.places, place])
        self.factor = np.append(self.factor, np.nan)
        return len(self.nominal) - 1

    def predict(self, cases: Sequence[int] | NDArray[np.intp]) -> Floats:
        """Return the seconds that each of the cases is expected to take, (m,)."""
        chosen = np.asarray(cases, dtype=np.intp)
        known = np.flatnonzero(np.isfinite(self.factor))
        if not len(known) or not len(chosen):
            return self.nominal[chosen]
        known = known[:: -(-len(known) // MOST_KNOWN)]
        nearest = np.arange(1, 1 + min(NEAREST, len(known)))
        away, which = cKDTree(self.places[known]).query(self.places[chosen], nearest)
        weight = 1.0 / (away**2 + CLOSE)
        factors = self.factor[known][which]
        return np.asarray(
            self.nominal[chosen] * (weight * factors).sum(axis=1) / weight.sum(axis=1)
        )


def places_of(design: Design) -> Floats:
    """Return where the cases lie among the swept inputs, (cases, swept inputs).

    The distinct numbers of an input are spread evenly over 0 .. 1; words and lists are
    `APART`, so that another scheme's cases are asked only where no others are known.
    """
    base = flatten(design.base)
    columns = [
        _to_unit([row.get(name, base[name]) for row in design.settings])
        for name in design.swept
    ]
    return np.column_stack(columns) if columns else np.zeros((len(design.scenes), 1))


def _to_unit(values: Sequence[Any]) -> Floats:
    if all(isinstance(value, int | float) for value in values):
        distinct, place = np.unique(np.asarray(values, float), return_inverse=True)
        return np.asarray(place / max(len(distinct) - 1, 1), dtype=np.float64)
    texts = [json.dumps(value) for value in values]
    number = {text: i for i, text in enumerate(dict.fromkeys(texts))}
    return np.array([APART * number[text] for text in texts])


def costs_of(design: Design) -> Costs:
    """Return the costs of a design of which nothing is known yet."""
    known = [predicted(design, case) for case in range(len(design.scenes))]
    steps, seconds = zip(*known, strict=True)
    return Costs(np.array(seconds), places_of(design), steps)
