"""What cases cost: seconds learned from finished cases that lie near by.

Regimes differ in seconds a step, and a case that diverges ends early: both are learned
as one factor on a nominal cost. Costs decide what is handed out first and when a
campaign ends, never a result.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.errors import WhirlError
from hpcwhirl.scene.many import Many, end_times
from hpcwhirl.scene.schemes import SCHEMES
from hpcwhirl.scene.table import Values, listed

Floats = NDArray[np.float64]
NEAREST = 4  # finished cases that a prediction is taken from
MOST_KNOWN = 4096  # finished cases that are looked at
APART = 10.0  # between two words, where the whole range of a number is 1
CLOSE = 1e-4  # squared distance below which neighbours count alike
AT_ONCE = 1 << 16  # cases whose neighbours are looked for together
MOST_MODELS = 512  # that are asked for their time step
# inputs that no step depends on, and those that it does where they are extreme alone
STEPLESS = frozenset({
    "direction", "duration", "revolutions", "solver.scheme", "solver.plan",
    "solver.until", "solver.longest", "solver.amplitude_limit",
})  # fmt: skip
OF_LIMITS = frozenset({"speed", "gap", "force", "pulse"})


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
    places : (n, d), where each case lies among the swept inputs, or `Places`
    steps : (n,), of each case that runs to its end
    """

    def __init__(
        self,
        nominal: Floats,
        places: Floats | Places,
        steps: Sequence[float] | Floats = (),
    ) -> None:
        self.nominal, self.places, self.steps = nominal, places, steps
        self.factor = np.full(len(nominal), np.nan)  # seconds over nominal, if known

    @classmethod
    def unknown(cls) -> Costs:
        """Return the costs of no case: what a rank that hands nothing out has."""
        return cls(np.zeros(0), np.zeros((0, 1)))

    def learn(self, cases: Sequence[int], seconds: float) -> None:
        """Take in that cases together took some seconds."""
        if len(cases) == 1:  # nearly always, and rank 0 hears of all
            alone = float(self.nominal[cases[0]])
            if alone > 0.0 and math.isfinite(seconds):
                self.factor[cases[0]] = seconds / alone
            return
        chosen = np.asarray(cases, dtype=np.intp)
        expected = float(self.nominal[chosen].sum())
        if expected > 0.0 and np.isfinite(seconds):
            self.factor[chosen] = seconds / expected

    def learn_all(self, seconds: Floats) -> None:
        """Take in the seconds of all cases, (n,); NaN where they are not known."""
        known = np.isfinite(seconds) & (self.nominal > 0.0)
        self.factor[known] = seconds[known] / self.nominal[known]

    def add(self, nominal: float, place: Floats) -> int:
        """Add a case; return its number here."""
        self.nominal = np.append(self.nominal, nominal)
        self.places = np.vstack([self.places[np.arange(len(self.places))], place])
        self.factor = np.append(self.factor, np.nan)
        return len(self.nominal) - 1

    def predict(self, cases: Sequence[int] | NDArray[np.intp]) -> Floats:
        """Return the seconds that each of the cases is expected to take, (m,)."""
        chosen = np.asarray(cases, dtype=np.intp)
        known = np.flatnonzero(np.isfinite(self.factor))
        if not len(known) or not len(chosen):
            return self.nominal[chosen]
        from scipy.spatial import cKDTree  # on rank 0 alone

        known = known[:: -(-len(known) // MOST_KNOWN)]
        nearest = np.arange(1, 1 + min(NEAREST, len(known)))
        tree, factor = cKDTree(self.places[known]), self.factor[known]
        out = np.empty(len(chosen))
        for start in range(0, len(chosen), AT_ONCE):
            part = slice(start, start + AT_ONCE)
            away, which = tree.query(self.places[chosen[part]], nearest)
            weight = 1.0 / (away**2 + CLOSE)
            mean = (weight * factor[which]).sum(axis=1) / weight.sum(axis=1)
            out[part] = self.nominal[chosen[part]] * mean
        return out


class Places:
    """Where cases lie among the swept inputs, worked out from their numbers.

    The distinct numbers of an input are spread evenly over 0 .. 1; words and lists are
    `APART`, so that another scheme's cases are asked only where no others are known.

    Parameters
    ----------
    design : of the cases
    """

    def __init__(self, design: Design) -> None:
        columns = design.columns.columns
        self._known = [(columns[n], _to_unit(columns[n].values)) for n in design.swept]
        self._cases = len(design.settings)

    def __len__(self) -> int:
        """Return the number of cases."""
        return self._cases

    def __getitem__(self, cases: NDArray[np.intp]) -> Floats:
        """Return the places of some cases, (m, swept inputs)."""
        if not self._known:
            return np.zeros((len(cases), 1))
        return np.column_stack(
            [column.of(cases, units) for column, units in self._known]
        )


def _to_unit(values: Values) -> Floats:
    known = listed(values)
    if all(isinstance(value, int | float) for value in known):
        distinct, place = np.unique(np.asarray(known, float), return_inverse=True)
        return np.asarray(place / max(len(distinct) - 1, 1), dtype=np.float64)
    texts = [json.dumps(value) for value in known]
    number = {text: i for i, text in enumerate(dict.fromkeys(texts))}
    return np.array([APART * number[text] for text in texts])


def costs_of(design: Design, step: Floats | None = None) -> Costs:
    """Return the costs of a design of which nothing is known yet.

    step : (cases,), where `time_steps` are known already
    """
    many, count = design.columns, len(design.settings)
    steps, seconds = np.zeros(count), np.zeros(count)
    step = time_steps(design) if step is None else step
    for cases in many.chunks():
        get = many.all(cases)
        steps[cases] = end_times(get) / step[cases]
        seconds[cases] = steps[cases] * _nominal(get("solver.scheme"))
    steps[np.isnan(step)] = seconds[np.isnan(step)] = 0.0  # they will fail as rows
    return Costs(seconds, Places(design), steps)


def _nominal(schemes: Any) -> Any:
    """Return the seconds of a step by schemes, before anything is known."""
    if isinstance(schemes, str):
        return SCHEMES[schemes].nominal
    return np.array([SCHEMES[name].nominal for name in schemes])


def time_steps(design: Design) -> Floats:
    """Return the time step of each case, s; NaN where there is no model to ask.

    Where an accuracy asks for steps, one case is asked for all that have the same
    model, friction, speed, gap and load; of more than `MOST_MODELS` such kinds, one for
    all of a model and friction; of more of these so many, evenly, and the others are
    taken for the nearest of them.
    """
    many = design.columns
    steps = many.values("solver.time_step").astype(float)
    asked = many.values("solver.accuracy") != 0.0
    if not asked.any():
        return steps
    _, first, kind = np.unique(
        _kinds(many)[asked], return_index=True, return_inverse=True
    )
    cases = np.flatnonzero(asked)[first]
    chosen = np.arange(0, len(cases), -(-len(cases) // MOST_MODELS))
    found = np.array([_asked_step(design, int(case)) for case in cases[chosen]])
    known = np.isfinite(found) | (len(chosen) == len(cases))
    if known.any():
        chosen, found = chosen[known], found[known]
    nearest = np.searchsorted((chosen[1:] + chosen[:-1]) / 2, np.arange(len(cases)))
    steps[asked] = found[nearest][kind]
    return steps


def _asked_step(design: Design, case: int) -> float:
    with suppress(WhirlError):  # it will fail as a row
        return float(design.resolved(case).step)
    return math.nan


def _kinds(many: Many) -> NDArray[np.int64]:
    """Return numbers of cases, the same where their steps are thought to be."""
    names = [n for n in many.columns if n not in STEPLESS and "output." not in n]
    kind = many.labels(names)
    ends = MOST_MODELS + 1, len(kind)  # mostly the first ones are enough to tell
    if any(len(np.unique(kind[:end])) > MOST_MODELS for end in ends):
        kind = many.labels(n for n in names if n not in OF_LIMITS)
    return kind
