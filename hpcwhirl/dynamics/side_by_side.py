"""Two motions of one scene: their distance, and states of motions between the two.

They serve the search for the motion on the edge between two words, and the measurement
of chaos, which integrates a march and a slightly different twin (`SideBySide`).

Apart from bookkeeping, the state of a march is linear in the motion: with a and b two
states at the same step of marches of one scene, a + s (b - a) is the state of the
motion in between. Only the multipliers need care: those of the last step are pending in
the state (`lam` of `CyclicState`) if its counters say that it had contact, and count as
zero in a state without contact. The forces of an unbalance and the gap are the same in
a and b, and therefore in between, since the weights add up to one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.case.resolve import Case
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.march import March
from hpcwhirl.scene import apply_settings
from hpcwhirl.scene.input_names import Value

# arrays of a state that are linear in the motion
MOTION = ("rotor", "ring", "gaps", "q_b", "d_b", "q_c", "d_c", "older")
WAITING = "lam"  # name of the array of multipliers, of a pending step


def copy_of(march: March) -> Any:
    """Return a copy of the present state of a march; its type depends on the kernel."""
    state = march.state
    return type(state)._make(array.copy() for array in state)


def put_between(march: March, a: Any, b: Any, share: float) -> None:
    """Set a march to the motion between two others: state a + share (b - a).

    Its steps, contacts and works are those of a. The change of energy is entered in the
    ledger as work of the loading, so that the ledger closes as well as that of a.

    Parameters
    ----------
    march : march of the same scene with the same number of sectors; its samples are
        kept
    a, b : states at the same step, see `copy_of`
    share : 0 gives a, 1 gives b; any number is allowed

    Raises
    ------
    ValueError
        if the states have different steps or shapes, or a run has ended
    """
    _check(march, a, b)
    march.put(a)
    left = _residual(march)
    march.put(_mixed(a, b, 1.0 - share, share))
    march.state.ledger[contact.PULSE] += _residual(march) - left


def distance(march: March, a: Any, b: Any) -> float:
    """Return the distance of two motions of a scene, sqrt(E), E the energy of b - a, J.

    E is the kinetic and strain energy of the difference, of rotor and casing and all
    sectors. With terms of rotation the ledger has Jacobi's energy, T - Omega^2 x^T M x
    / 2 + U, which may be below 0, with the kinetic energy T in the rotating frame and
    the strain energy U of displacements x. Omega^2 x^T M x / 2 of the rotor is added to
    it, so that E = T + U.

    march : a march of the scene
    a, b : states at the same step, see `copy_of`

    Raises
    ------
    ValueError
        as for `put_between`
    """
    _check(march, a, b)
    apart = march.scheme.balance(_mixed(a, b, -1.0, 1.0)).energy
    energy = march.lean.model.folds * float(apart)
    rotor = march.model.rotor
    if rotor.spin is not None:
        step = int(a.counter[contact.STEP])
        places = [march.scheme.motion(each, step).rotor for each in (a, b)]
        x = places[1] - places[0]
        energy += 0.5 * march.scene.speed**2 * float(x @ (rotor.mass @ x))
    return math.sqrt(max(energy, 0.0))


def _mixed(a: Any, b: Any, of_a: float, of_b: float) -> Any:
    """Return a state whose motion is `of_a` times that of a, plus `of_b` times b's.

    Its steps, contacts and works are those of a; it has no certificate.

    a, b : states at the same step
    """
    parts = {name: array.copy() for name, array in a._asdict().items()}
    for name in MOTION:
        if name in parts:
            parts[name] = of_a * getattr(a, name) + of_b * getattr(b, name)
    waits = [_is_pending(state.counter) for state in (a, b)]
    if WAITING in parts:
        parts[WAITING] = of_a * waits[0] * a.lam + of_b * waits[1] * b.lam
    counter = parts["counter"]
    counter[contact.CERTIFIED] = -1
    counter[contact.NEXT_LOOK] = counter[contact.STEP]
    if any(waits):
        counter[contact.LAST] = counter[contact.STEP]
        counter[contact.ENDED] = -1
    return type(a)._make(parts.values())


def _is_pending(counter: NDArray[np.int64]) -> bool:
    """Return whether contact forces of the last step have not acted yet."""
    step = counter[contact.STEP]
    return bool(counter[contact.LAST] == step and counter[contact.ENDED] != step)


def _residual(march: March) -> float:
    """Return the error of a march's energy balance, J, of the integrated sectors."""
    now, entries = march.scheme.balance(march.state), march.state.ledger
    given = entries[[contact.PULSE, contact.FRICTION, contact.ROTATION]].sum()
    lost = now.energy + now.damping + entries[contact.IMPACT] + now.impact
    return float(lost - given - now.friction - now.rotation - now.loading)


def _check(march: March, a: Any, b: Any) -> None:
    shapes = [[array.shape for array in state] for state in (march.state, a, b)]
    if not shapes[0] == shapes[1] == shapes[2]:
        msg = "states must be of one scene and of the same number of sectors"
        raise ValueError(msg)
    one, other = (int(state.counter[contact.STEP]) for state in (a, b))
    if one != other:
        raise ValueError(f"states must be at the same step, got {one} and {other}")
    if any(state.counter[contact.STOP] != contact.RUNNING for state in (a, b)):
        raise ValueError("states must be those of runs that have not ended")


FIRST = 1e-6  # relative change of a body's motion in the twin, before scaling to delta


class SideBySide:
    """A march and its twin, integrated to measure how fast they separate (chaos).

    Both integrate the same scene with the same arrays, with contact; see
    `analysis.chaos.Twins`. The twin begins with a slightly larger motion from the start
    of the run on, at the distance `delta`: of the casing where its state is apart, of
    the rotor if the casing is rigid, else of both. Distances are those
    of `distance`, relative to the size of the motion: its distance from rest, the
    square root of its energy.

    Parameters
    ----------
    ended : march to be continued; all its sectors must be integrated
    interval : s, time between two measurements of the distance, rounded to whole
        intervals of evidence
    seconds : s, longest time by which the march can be continued
    delta : initial distance, relative to the size of the motion
    between : function that is called between slices
    """

    def __init__(
        self,
        ended: March,
        interval: float,
        seconds: float,
        delta: float,
        between: Callable[[], None] | None = None,
    ) -> None:
        self.between, case = between, _longer(ended, seconds)
        self.one, self.other = _gone_on(case, ended), _gone_on(case, ended)
        row = self.one.beat * self.one.scene.solver.time_step
        self.rows = max(round(interval / row), 1)
        self.first_row = int(self.one.counter[contact.JUDGED])
        a = copy_of(self.one)
        energy = self.one.scheme.balance(a).energy * self.one.lean.model.folds
        self.size = math.sqrt(abs(float(energy)))
        aside = copy_of(self.one)
        begun = _begun(case, ended).state
        for moved, start in zip(_moved(aside), _moved(begun), strict=True):
            moved[:] += FIRST * (moved - start)
        apart = distance(self.one, a, aside)
        if apart > 0.0:
            put_between(self.other, a, aside, delta * self.size / apart)

    @property
    def seconds(self) -> float:
        """Wall time of the march and its twin together, s."""
        return self.one.seconds + self.other.seconds

    @property
    def interval(self) -> float:
        """Time between two measurements of the distance of march and twin, s."""
        return self.rows * self.one.beat * self.one.scene.solver.time_step

    @property
    def intervals(self) -> int:
        """Largest number of intervals by which march and twin can be continued."""
        return (self.one.total // self.one.beat - self.first_row) // self.rows

    @property
    def ended(self) -> bool:
        """Whether the march or its twin has stopped.

        Either stops at the amplitude limit, with non-finite numbers, or for a contact
        problem without a solution.
        """
        stops = [march.counter[contact.STOP] for march in (self.one, self.other)]
        return any(stop != contact.RUNNING for stop in stops)

    def advance(self) -> float:
        """Integrate march and twin by one interval; return their distance.

        The distance is relative to the size of the motion; NaN if one of them has
        ended.
        """
        beat = self.one.beat
        goal = (self.one.steps // beat + self.rows) * beat
        for march in (self.one, self.other):
            march.reach(goal, self.between)
        if self.ended or not self.size > 0.0:
            return math.nan
        apart = distance(self.one, copy_of(self.one), copy_of(self.other))
        return apart / self.size

    def draw(self, factor: float) -> None:
        """Multiply the difference of the twin's motion from the march's by `factor`.

        factor : initial distance over the present one, which restores the initial
            distance
        """
        a, b = copy_of(self.one), copy_of(self.other)
        put_between(self.other, a, b, factor)


def _longer(ended: March, seconds: float) -> Case:
    """Return the case of an ended march, with a duration longer by `seconds`, s.

    It stores no traces, and runs to its end even if it is proved before that no blade
    can touch again.
    """
    settings: dict[str, Value] = {"until": "end", "revolutions": 0.0}
    settings["duration"] = ended.steps * ended.scene.solver.time_step + seconds
    settings["output.traces"] = "summary"
    return replace(ended.case, given=apply_settings(ended.case.given, settings))


def _gone_on(case: Case, ended: March) -> March:
    """Return a march of a longer case that continues an ended march from its end.

    It has none of that march's samples and rows of evidence, and seeks no certificate.
    """
    march = _begun(case, ended)
    march.coast, march.watched = None, 0
    march.put(ended.state)
    march.counter[contact.JUDGED] = march.steps // march.beat
    march.counter[contact.SAMPLE] = 0
    march.counter[contact.CERTIFIED] = -1
    return march


def _begun(case: Case, ended: March) -> March:
    """Return a march of a case at its start, of as many sectors as an ended march.

    The circle of an unbalance is a part of its state that no motion changes.
    """
    march = March(case)
    if march.lean.model.folds != ended.lean.model.folds:
        march.unfold()
    return march


def _moved(state: Any) -> list[NDArray[np.float64]]:
    """Return those arrays of a state in which the twin's motion is made different.

    They are those of the casing's motion or, if the casing is rigid, of the rotor's.
    """
    names = ("ring", "q_c", "d_c"), ("rotor", "q_b", "d_b")
    for some in names:
        found = [getattr(state, n) for n in some if hasattr(state, n)]
        if sum(array.size for array in found):
            return found
    return []
