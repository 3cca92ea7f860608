"""A march and its twin, a small distance apart, that continue an ended run."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.case.resolve import Case
from hpcwhirl.dynamics.blend import copy_of, distance, put_between
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.march import March
from hpcwhirl.scene import apply_settings
from hpcwhirl.scene.input_names import Value

FIRST = 1e-6  # relative change of a body's motion in the twin, before scaling to delta


class SideBySide:
    """A march and its twin, integrated with contact; see `analysis.chaos.Twins`.

    Both integrate the same scene with the same arrays. The twin begins with a slightly
    larger motion of the casing (of the rotor, if the casing is rigid), at the distance
    `delta`. Distances are those of `blend.distance`, relative to the size of the
    motion: its distance from rest, the square root of its energy.

    Parameters
    ----------
    ended : march to be continued; all its sectors must be integrated
    interval : s, time between two distances, rounded to whole intervals of evidence
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
        for moved in _moved(aside):
            moved[:] *= 1.0 + FIRST
        apart = distance(self.one, a, aside)
        if apart > 0.0:
            put_between(self.other, a, aside, delta * self.size / apart)

    @property
    def seconds(self) -> float:
        """Wall time of the two marches together, s."""
        return self.one.seconds + self.other.seconds

    @property
    def interval(self) -> float:
        """Time between two measurements of the twins' distance, s."""
        return self.rows * self.one.beat * self.one.scene.solver.time_step

    @property
    def intervals(self) -> int:
        """Largest number of intervals by which both can be continued."""
        return (self.one.total // self.one.beat - self.first_row) // self.rows

    @property
    def ended(self) -> bool:
        """Whether one of the two has stopped.

        It stops at the amplitude limit, with non-finite numbers, or for a contact
        problem without a solution.
        """
        stops = [march.counter[contact.STOP] for march in (self.one, self.other)]
        return any(stop != contact.RUNNING for stop in stops)

    def advance(self) -> float:
        """Integrate both motions by one interval; return how far they are apart.

        The distance is relative to the size of the motion; NaN if one has ended.
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
        """Multiply the difference between the twin and the march by `factor`."""
        a, b = copy_of(self.one), copy_of(self.other)
        put_between(self.other, a, b, factor)


def _longer(ended: March, seconds: float) -> Case:
    """Return the case of a march that continues for a number of seconds."""
    settings: dict[str, Value] = {"until": "end", "revolutions": 0.0}
    settings["duration"] = ended.steps * ended.scene.solver.time_step + seconds
    settings["output.traces"] = "summary"
    return replace(ended.case, given=apply_settings(ended.case.given, settings))


def _gone_on(case: Case, ended: March) -> March:
    """Return a march of a longer case that continues from the state of an ended one.

    Samples and rows of evidence of the ended march are not copied; no certificate is
    sought.
    """
    march = March(case)
    if march.lean.model.folds != ended.lean.model.folds:
        march.unfold()
    march.coast, march.watched = None, 0
    march.put(ended.state)
    march.counter[contact.JUDGED] = march.steps // march.beat
    march.counter[contact.SAMPLE] = 0
    march.counter[contact.CERTIFIED] = -1
    return march


def _moved(state: Any) -> list[NDArray[np.float64]]:
    """Return the state's arrays of the casing's motion (the rotor's, if rigid)."""
    names = ("ring", "q_c", "d_c"), ("rotor", "q_b", "d_b")
    for some in names:
        found = [getattr(state, n) for n in some if hasattr(state, n)]
        if sum(array.size for array in found):
            return found
    return []
