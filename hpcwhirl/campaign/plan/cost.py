"""Predict the computing time of cases from finished cases with similar inputs.

The time of a step depends on the regime, and a case that diverges ends early: both are
learned as one factor on a nominal time. Predictions decide the order of cases and the
time left that is printed, never a result.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from contextlib import suppress
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.arrays import Floats
from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.campaign.plan.learned import step_seconds
from hpcwhirl.errors import WhirlError
from hpcwhirl.planner.planner import Planner
from hpcwhirl.refinement.growth import Address
from hpcwhirl.scene.batch_validation import Columns, Many, end_times
from hpcwhirl.scene.input_names import MISTUNING
from hpcwhirl.scene.rules import NO_BLADE
from hpcwhirl.scene.schemes import SCHEMES, USUAL, marched_by
from hpcwhirl.scene.table import Column, Values, listed
from hpcwhirl.store.models.engine_file import points_named

NEAREST = 4  # number of finished cases from which a prediction is taken
MOST_KNOWN = 4096  # largest number of finished cases considered
# distance between two cases of which one input is a different word, such as the
# scheme; numeric inputs are scaled to 0 .. 1
APART = 10.0
CLOSE = 1e-4  # squared distance below which finished cases have equal weight
AT_ONCE = 1 << 16  # number of cases whose neighbours are searched together
FEW = 64  # up to so many finished cases are compared without a tree: a slow import
MOST_MODELS = 512  # largest number of models built to get their time step
# inputs on which the time step does not depend, or only if they are extreme
STEPLESS = frozenset({
    "start_energy", "start_modes", "start_draw", "start_as",
    "direction", "duration", "revolutions", "solver.scheme", "solver.plan",
    "solver.until", "solver.longest", "solver.amplitude_limit",
})  # fmt: skip
# inputs that change the time step less than model and friction do, see `time_steps`
OF_LIMITS = frozenset({"speed", "gap", "force", "pulse"})


class Costs:
    """Predicted kernel time of each case of a campaign, improved by finished cases.

    Parameters
    ----------
    nominal : (n,), s, assumed time of each of n cases before any has finished
    places : (n, d), the d swept inputs of each case, scaled to 0 .. 1; or `Places`
    steps : (n,), number of time steps of each case without an early end
    """

    def __init__(
        self,
        nominal: Floats,
        places: Floats | Places,
        steps: Sequence[float] | Floats = (),
    ) -> None:
        self.nominal, self.places, self.steps = nominal, places, steps
        self.factor = np.full(len(nominal), np.nan)  # time / nominal; NaN: unfinished

    @classmethod
    def unknown(cls) -> Costs:
        """Return an object without cases, for ranks that do not hand out cases."""
        return cls(np.zeros(0), np.zeros((0, 1)))

    def learn(self, case: int, seconds: float) -> None:
        """Record the computing time of a finished case, to improve predictions.

        Parameters
        ----------
        case : number of the case
        seconds : its computing time, s
        """
        nominal = float(self.nominal[case])
        if nominal > 0.0 and math.isfinite(seconds):
            self.factor[case] = seconds / nominal

    def learn_all(self, seconds: Floats) -> None:
        """Record the computing times of all finished cases, to improve predictions.

        seconds : (n,), s, computing time of each case; NaN: not finished
        """
        known = np.isfinite(seconds) & (self.nominal > 0.0)
        self.factor[known] = seconds[known] / self.nominal[known]

    def cover(self, planner: Planner) -> None:
        """Do nothing; `RefinedCosts` adds the times of the planner's new cases here."""

    def predict(self, cases: Sequence[int] | NDArray[np.intp]) -> Floats:
        """Return the predicted kernel times of some cases, s, (m,).

        cases : (m,), numbers of the cases
        """
        chosen = np.asarray(cases, dtype=np.intp)
        known = np.flatnonzero(np.isfinite(self.factor))
        if not len(known) or not len(chosen):
            return self.nominal[chosen]
        known = known[:: -(-len(known) // MOST_KNOWN)]
        finished, factor = self.places[known], self.factor[known]
        out = np.empty(len(chosen))
        for start in range(0, len(chosen), AT_ONCE):
            part = slice(start, start + AT_ONCE)
            away, which = neighbours_of(self.places[chosen[part]], finished)
            weight = 1.0 / (away**2 + CLOSE)
            mean = (weight * factor[which]).sum(axis=1) / weight.sum(axis=1)
            out[part] = self.nominal[chosen[part]] * mean
        return out


def neighbours_of(places: Floats, of: Floats) -> tuple[Floats, NDArray[np.intp]]:
    """Return distances and indices of the nearest points, (m, k) each, in any order.

    k is `NEAREST`, or n if that is less.

    places, of : (m, d), points; (n, d), those among which the nearest are searched
    """
    count = min(NEAREST, len(of))
    if len(of) > FEW:
        from scipy.spatial import cKDTree

        away, which = cKDTree(of).query(places, np.arange(1, 1 + count))
        return away, which
    squares = np.zeros((len(places), len(of)))
    for own, other in zip(places.T, of.T, strict=True):
        squares += np.subtract.outer(own, other) ** 2
    which = np.argpartition(squares, count - 1, axis=1)[:, :count]
    return np.sqrt(np.take_along_axis(squares, which, axis=1)), which


class RefinedCosts(Costs):
    """Predicted kernel times of a refined campaign's cases, in its planner's order.

    Refined cases are appended when the planner adds them. Their nominal time is that of
    the nearest coarse case (case of [sweep]); for the second fidelity (the preset
    `confirm`) it is multiplied by the ratio of times computed for the panel's first
    case of that fidelity.

    Parameters
    ----------
    design : the campaign's cases
    coarse : predicted times of its coarse cases
    """

    def __init__(self, design: Design, coarse: Costs) -> None:
        own = coarse.places[np.arange(len(coarse.places))]
        more = np.zeros((len(own), 1))  # a further coordinate separates the fidelities
        super().__init__(coarse.nominal, np.hstack([own, more]), coarse.steps)
        self.factor = coarse.factor
        self.design = design
        self._ratio: dict[int, float] = {}

    def cover(self, planner: Planner) -> None:
        """Append predicted times of the cases that the planner has added."""
        rows = range(len(self.nominal), len(planner))
        if not rows:
            return
        added = [self._added(self.design.family.address(planner.number(row)))
                 for row in rows]  # fmt: skip
        self.nominal = np.append(self.nominal, [nominal for nominal, _ in added])
        known = self.places[np.arange(len(self.places))]
        self.places = np.vstack([known, *(place for _, place in added)])
        self.factor = np.append(self.factor, np.full(len(added), np.nan))

    def _added(self, address: Address) -> tuple[float, Floats]:
        """Return a refined case's nominal kernel time, s, and its swept inputs, scaled.

        The inputs are scaled to 0 .. 1, (d,), as `Costs` needs them.
        """
        near = self._near(address)
        place = self.places[np.array([near])][0].copy()
        both = zip(self.design.family.lattice.sides, address.point, strict=True)
        for side, x in both:
            column = self.design.swept.index(side.name)
            place[column] = side.position(x) / max(len(side.depths), 1)
        place[-1] = APART * address.fidelity
        return float(self.nominal[near]) * self._dearer(address, near), place

    def _near(self, address: Address) -> int:
        """Return the number of the coarse case nearest to a refined case."""
        sides = zip(self.design.family.lattice.sides, address.point, strict=True)
        point = tuple(round(side.position(x)) << side.depth for side, x in sides)
        return self.design.family.row_of[Address(0, 0, address.panel, point)]

    def _dearer(self, address: Address, near: int) -> float:
        if not address.fidelity:
            return 1.0
        if address.panel not in self._ratio:
            coarse = self.design.family.coarse[near]._replace(fidelity=1)
            number = self.design.family.number(coarse)
            cost, first = self.design.predicted(number)[1], self.nominal[near]
            self._ratio[address.panel] = cost / first if cost and first else 1.0
        return self._ratio[address.panel]


class Places:
    """The swept inputs of all cases, scaled to 0 .. 1: distances tell similar cases.

    They are computed from case numbers when indexed. The distinct numbers of an input
    are spread evenly over 0 .. 1. Different words or lists have the distance `APART`,
    so that cases of another scheme, for example, are used only if no others have
    finished.

    Parameters
    ----------
    design : the campaign's cases
    """

    def __init__(self, design: Design) -> None:
        self._design, self._cases = design, len(design.settings)

    @cached_property
    def _known(self) -> list[tuple[Column, Floats]]:
        columns = self._design.columns.columns
        return [(columns[n], _to_unit(columns[n].values)) for n in self._design.swept]

    def __len__(self) -> int:
        """Return the number of cases of the campaign."""
        return self._cases

    def __getitem__(self, cases: NDArray[np.intp]) -> Floats:
        """Return the scaled inputs of m cases, (m, number of swept inputs).

        cases : (m,), numbers of the cases
        """
        if not self._known:
            return np.zeros((len(cases), 1))
        return np.column_stack(
            [column.of(cases, units) for column, units in self._known]
        )


def _to_unit(values: Values) -> Floats:
    known = values if isinstance(values, np.ndarray) else listed(values)
    is_array = isinstance(known, np.ndarray) and known.ndim == 1
    if is_array or all(isinstance(value, int | float) for value in known):
        distinct, place = np.unique(np.asarray(known, float), return_inverse=True)
        return np.asarray(place / max(len(distinct) - 1, 1), dtype=np.float64)
    texts = [json.dumps(value) for value in listed(known)]
    number = {text: i for i, text in enumerate(dict.fromkeys(texts))}
    return np.array([APART * number[text] for text in texts])


def costs_of(
    design: Design, step: Floats | None = None, share: float = USUAL[0]
) -> Costs:
    """Return predicted kernel times of a campaign's cases before any has finished.

    Parameters
    ----------
    design : the campaign's cases
    step : (cases,), s, time step of each case, see `time_steps`; None: computed here
    share : assumed share of time steps in contact, the same for every case
    """
    many, count = design.columns, len(design.settings)
    steps, seconds = np.zeros(count), np.zeros(count)
    step = time_steps(design) if step is None else step
    for cases in many.chunks():
        get = many.all(cases)
        steps[cases] = end_times(get) / step[cases]
        seconds[cases] = steps[cases] * _nominal(get, share)
    steps[np.isnan(step)] = seconds[np.isnan(step)] = 0.0  # these cases will fail
    return Costs(seconds, Places(design), steps)


def _nominal(get: Columns, share: float) -> Any:
    """Return the predicted kernel time of a time step, s: one for all, or (cases,).

    It is nominal, or measured on this machine, see `learned`.

    Parameters
    ----------
    get : function from an input's name to its value: one for all cases, or (cases,)
    share : share of time steps in contact
    """
    rotations, blades, changes, lost = (
        np.asarray(get(name))
        for name in (
            "engine.rotation", "engine.rotor.blades", MISTUNING,
            "engine.rotor.lost_blade",
        )
    )  # fmt: skip
    points = points_a_tip(get)
    uneven = (changes > 0) | (lost != NO_BLADE)
    schemes = marched_by(get, uneven | (points > 1))
    kinds = product(np.unique(schemes), np.unique(rotations), (False, True))
    return sum(
        ((schemes == scheme) & (rotations == rotation) & (uneven == apart))
        * step_seconds(
            SCHEMES[scheme], rotation, blades, share, uneven=apart, points=points
        )
        for scheme, rotation, apart in kinds
    )


def points_a_tip(get: Columns) -> Any:
    """Return the number of contact points per tip: one for all cases, or (cases,).

    get : function from an input's name to its value: one for all cases, or (cases,)
    """
    files, place = np.unique(
        np.asarray(get("engine.file"), dtype=str), return_inverse=True
    )
    return np.array([points_named(str(file)) for file in files])[place]


def most_points(design: Design) -> int:
    """Return the largest number of contact points per tip of a campaign's engines."""
    many = design.columns
    return int(max(np.max(points_a_tip(many.all(c))) for c in many.chunks()))


def time_steps(design: Design) -> Floats:
    """Return the time step of each case, s, (cases,); NaN for cases without a model.

    If `accuracy` sets the step, it is determined for one case of each kind: cases of a
    kind have equal model, friction, speed, gap and load. If there are more than
    `MOST_MODELS` kinds, cases with equal model and friction form a kind; if there are
    still more, `MOST_MODELS` cases are chosen evenly, and the others have the step of
    the nearest chosen one.
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
    with suppress(WhirlError):  # this case will fail
        return float(design.resolved(case).step)
    return math.nan


def _kinds(many: Many) -> NDArray[np.int64]:
    """Return a label for each case, (cases,), equal for cases with the same time step.

    many : the inputs of all cases
    """
    names = [n for n in many.columns if n not in STEPLESS and "output." not in n]
    kind = many.labels(names)
    ends = MOST_MODELS + 1, len(kind)  # the first cases mostly suffice
    if any(len(np.unique(kind[:end])) > MOST_MODELS for end in ends):
        kind = many.labels(n for n in names if n not in OF_LIMITS)
    return kind
