"""What cases cost: seconds learned from finished cases that lie near by.

Regimes differ in seconds a step, and a case that diverges ends early: both are learned
as one factor on a nominal cost. Costs decide what is handed out first and when a
campaign ends, never a result.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from hpcwhirl.campaign.design import Design
from hpcwhirl.case.model import model_of
from hpcwhirl.dynamics.timestep import with_step
from hpcwhirl.errors import WhirlError
from hpcwhirl.scene import Scene, flatten
from hpcwhirl.scene.schemes import SCHEMES
from hpcwhirl.store.journal import Record, scan

Floats = NDArray[np.float64]
NEAREST = 4  # finished cases that a prediction is taken from
MOST_KNOWN = 4096  # finished cases that are looked at
APART = 10.0  # between two words, where the whole range of a number is 1
CLOSE = 1e-4  # squared distance below which neighbours count alike


def stepped(scene: Scene) -> Scene | None:
    """Return the scene with the step that it is marched with, None without a model."""
    if scene.solver.accuracy == 0.0:
        return scene
    try:
        return with_step(scene, model_of(scene))
    except WhirlError:  # it will fail as a row
        return None


def predicted_steps(scene: Scene) -> float:
    """Return the steps of a case that runs to its end; 0 of one without a model."""
    known = stepped(scene)
    return known.end_time / known.solver.time_step if known else 0.0


class Costs:
    """Predicted seconds of every case, better with every case that finishes.

    Parameters
    ----------
    nominal : (n,), s, of each case before anything is known
    places : (n, d), where each case lies among the swept inputs, see `places_of`
    """

    def __init__(self, nominal: Floats, places: Floats) -> None:
        self.nominal, self.places = nominal, places
        self.factor = np.full(len(nominal), np.nan)  # seconds over nominal, if known

    def learn(self, cases: Sequence[int], seconds: float) -> None:
        """Take in that cases together took some seconds."""
        chosen = np.asarray(cases, dtype=np.intp)
        expected = float(self.nominal[chosen].sum())
        if expected > 0.0 and np.isfinite(seconds):
            self.factor[chosen] = seconds / expected

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
    columns = []
    base = flatten(design.base)
    for name in design.swept:
        values = [row.get(name, base[name]) for row in design.settings]
        columns.append(_to_unit(values))
    return np.column_stack(columns) if columns else np.zeros((len(design.cases), 1))


def _to_unit(values: Sequence[Any]) -> Floats:
    if all(isinstance(value, int | float) for value in values):
        distinct, place = np.unique(np.asarray(values, float), return_inverse=True)
        return np.asarray(place / max(len(distinct) - 1, 1), dtype=np.float64)
    texts = [json.dumps(value) for value in values]
    number = {text: i for i, text in enumerate(dict.fromkeys(texts))}
    return np.array([APART * number[text] for text in texts])


def costs_of(design: Design) -> Costs:
    """Return the costs of a design of which nothing is known yet."""
    nominal = [
        predicted_steps(scene) * SCHEMES[scene.solver.scheme].nominal
        for scene in design.cases
    ]
    return Costs(np.array(nominal, dtype=np.float64), places_of(design))


def learn_from(folder: Path, design: Design, costs: Costs) -> list[int]:
    """Let costs learn from a directory; return the cases that have no result there."""

    def brief(record: Record) -> tuple[bool, float]:
        return record["status"] == "ok", record["performance"].get("seconds", np.nan)

    kept, left = scan(folder, brief), []
    for case, name in enumerate(design.digests):
        found = kept.get(name)
        if found is None:
            left.append(case)
        elif found[0]:
            costs.learn([case], found[1])
    return left


def nothing_known() -> Costs:
    """Return the costs of no case: what a rank that hands nothing out has."""
    return Costs(np.zeros(0), np.zeros((0, 1)))
