"""Speed and gap that change in time, and their values in intervals of time steps.

Omega(t) and theta(t), its integral, are closed forms of time, so that the blades' angle
does not drift. The time integration has constant arrays in intervals of `every` steps,
counted from step 0, so that intervals follow from the step number. In an interval the
angle is a parabola, exact at both ends, the gap is linear, and matrices are those of
the mean speed: errors are of second order in the interval, see `interval_of`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np

from hpcwhirl.arrays import Floats
from hpcwhirl.errors import InputError, shown
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene
from hpcwhirl.scene.kept_tables import kept_rows

USUAL = 1e-4  # accuracy of the intervals if `solver.accuracy` is not given
ENDLESS = 1e100  # s, longest change of the speed; beyond, a product with 0 is no number
STANDS = 1e-6  # speed, relative to the largest, that counts as standstill
MOST_STEPS = 4096  # largest number of steps of an interval
MOST_KEPT = 32  # number of cached models, as in `reduction.model`


@dataclass(frozen=True)
class SpeedLaw:
    """The speed over time, Omega(t), and its integral, the angle theta(t).

    Attributes
    ----------
    kind : linear, smooth, decay or table
    start, end : speeds, rad/s; once it has reached `end`, the speed is held
    rate : rad/s^2, dOmega/dt: of a smooth change the mean, of a decay the initial value
    times, speeds : s, rad/s, rows of a table, between which the speed is linear
    """

    kind: str
    start: float
    end: float = math.inf
    rate: float = 0.0
    times: tuple[float, ...] = ()
    speeds: tuple[float, ...] = ()

    @property
    def lasts(self) -> float:
        """Time until the speed is constant, s; of a decay its time constant."""
        if self.kind == "table":
            return self.times[-1]
        time = (self.end - self.start) / self.rate
        return min(time, ENDLESS) if time > 0.0 else math.inf

    def speed(self, time: Any) -> Any:
        """Return the speed Omega, rad/s, at times, s, of any shape."""
        t, lasts = np.asarray(time, dtype=float), self.lasts
        if self.kind == "table":
            return np.interp(t, self.times, self.speeds)
        if self.kind == "decay":
            return self.end + (self.start - self.end) * np.exp(-t / lasts)
        t = np.minimum(t, lasts)
        if self.kind == "linear":
            return self.start + self.rate * t
        half = 0.5 * (self.end - self.start)
        return self.start + half * (1.0 - np.cos(math.pi * t / lasts))

    def angle(self, time: Any) -> Any:
        """Return the angle theta, rad, the integral of Omega from 0 to times, s."""
        t, lasts = np.asarray(time, dtype=float), self.lasts
        if self.kind == "table":
            return self._angle_by_table(t)
        if self.kind == "decay":
            gone = -np.expm1(-t / lasts)
            return self.end * t + (self.start - self.end) * lasts * gone
        early = np.minimum(t, lasts)
        late = np.maximum(t - lasts, 0.0) if lasts < math.inf else 0.0
        if self.kind == "linear":
            after = self.speed(lasts) * late if lasts < math.inf else 0.0
            return self.start * early + 0.5 * self.rate * early**2 + after
        swing = lasts / math.pi * np.sin(math.pi * early / lasts)
        turned = 0.5 * (self.end - self.start) * (early - swing)
        return self.start * early + turned + self.end * late

    def _angle_by_table(self, t: Floats) -> Floats:
        times, speeds = np.array(self.times), np.array(self.speeds)
        steps, means = np.diff(times), 0.5 * (speeds[1:] + speeds[:-1])
        begun = np.concatenate([[0.0], np.cumsum(steps * means)])
        i = np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(times) - 1)
        return np.asarray(begun[i] + 0.5 * (speeds[i] + self.speed(t)) * (t - times[i]))

    def range_until(self, time: float) -> tuple[float, float]:
        """Return the least and the largest Omega, rad/s, from 0 to a time, s."""
        inside = [t for t in self.times if t < time]
        found = self.speed(np.array([0.0, *inside, time]))
        return float(found.min()), float(found.max())

    @property
    def fastest_change(self) -> float:
        """Largest |dOmega/dt| at any time, rad/s^2."""
        if self.kind == "table":
            return float(np.abs(np.diff(self.speeds) / np.diff(self.times)).max())
        return abs(self.rate) * (0.5 * math.pi if self.kind == "smooth" else 1.0)


def law_of(scene: Scene) -> SpeedLaw | None:
    """Return a scene's speed as a function of time; None where it is constant."""
    if scene.speed_table:
        times, speeds = zip(*kept_rows(scene.speed_table), strict=True)
        return SpeedLaw("table", speeds[0], times=times, speeds=speeds)
    if scene.acceleration == 0.0:
        return None
    return SpeedLaw(scene.ramp, scene.speed, scene.speed_to, scene.acceleration)


def has_gap_law(scene: Scene) -> bool:
    """Return whether the gap of a scene changes in time."""
    return scene.gap_closure != 0.0 or bool(scene.gap_table)


def changes(scene: Scene) -> bool:
    """Return whether speed or gap of a scene change in time."""
    return law_of(scene) is not None or has_gap_law(scene)


def angle_at(scene: Scene, time: Any, step: float = 1.0) -> Any:
    """Return the angle by which the rotor has turned since time 0, rad.

    time, step : time in units of `step`, of any shape; this unit, s
    """
    law = law_of(scene)
    return scene.speed * time * step if law is None else law.angle(time * step)


def speed_at(scene: Scene, time: Any) -> Any:
    """Return the speed of rotation, rad/s, at times, s, of any shape."""
    law = law_of(scene)
    return scene.speed + 0.0 * time if law is None else law.speed(time)


def extremes(scene: Scene) -> tuple[float, float]:
    """Return a run's speeds of least and of largest magnitude, with sign, rad/s."""
    law = law_of(scene)
    if law is None:
        return scene.speed, scene.speed
    low, high = law.range_until(scene.end_times[-1])
    return (low, high) if abs(low) <= abs(high) else (high, low)


def closure_at(scene: Scene, time: Any) -> Any:
    """Return how far the input gap has closed since time 0, m, apart from tip growth.

    time : s, of any shape
    """
    if scene.gap_table:
        times, gaps = np.array(kept_rows(scene.gap_table)).T
        return gaps[0] - np.interp(time, times, gaps)
    return scene.gap_closure * -np.expm1(-np.asarray(time) / scene.gap_time)


def laws_of(scene: Scene) -> tuple[Any, ...]:
    """Return a scene's law of the speed, and each input that sets its gap over time.

    A saved state must agree with them.
    """
    gap = scene.gap, scene.gap_at, scene.gap_closure, scene.gap_time, scene.gap_table
    return law_of(scene), *gap


@lru_cache(maxsize=MOST_KEPT)
def growth_of(model: Model) -> Callable[[float], float]:
    """Return a function from a speed, rad/s, to the growth of the tip that grows most.

    The growth is radial, m, by rotation, as in `reduction.waves.tip_growth`; what does
    not depend on the speed is computed once.
    """
    body, spin = model.rotor, model.rotor.terms
    own = np.flatnonzero(body.diameter == 0) if body.cyclic else slice(None)
    shapes, load = body.shapes[:, own], (body.shapes.T @ spin.load)[own]
    rest = np.diag(body.omega[own] ** 2)
    first, quartic = shapes.T @ spin.stiffening @ shapes, np.zeros(1)
    if spin.quartic is not None:
        quartic = shapes.T @ spin.quartic @ shapes
    tips = shapes[0 : 2 * model.blades : 2]

    def growth(speed: float) -> float:
        stiffness = rest + speed**2 * first + speed**4 * quartic
        return float((tips @ np.linalg.solve(stiffness, speed**2 * load)).max())

    return growth


class Interval(NamedTuple):
    """Constants of speed, rotor angle and gap in an interval of the time integration.

    Attributes
    ----------
    speed : rad/s, mean Omega from half a step before the start to half a step before
        the end
    rate : rad/s^2, mean dOmega/dt
    turn : rad/s, mean rate of the rotor's angle theta in the interval
    first : rad/s, rate of theta, a parabola in time t, at the start of the interval
    since : s, start of the interval
    ahead, bend : rad, rad/s^2: theta = first t + ahead + bend (t - since)^2
    gap, opening : m, gap at the start of the interval; m/s, its rate
    """

    speed: float
    rate: float
    turn: float
    first: float
    since: float
    ahead: float
    bend: float
    gap: float
    opening: float


@dataclass(frozen=True)
class Schedule:
    """The intervals into which a run with a changing speed or gap is divided.

    Attributes
    ----------
    scene, model : scene and model as integrated; scene.gap is the gap at time 0
    every : number of steps of an interval
    straight : whether the angle is linear in an interval, as is required for a ring
        that is integrated in the rotor's frame
    """

    scene: Scene
    model: Model
    every: int
    straight: bool

    @cached_property
    def law(self) -> SpeedLaw | None:
        """The speed as a function of time; None: it is constant."""
        return law_of(self.scene)

    def gap(self, time: float) -> float:
        """Return the gap, m, at a time, s, with its closure and growth of the tips."""
        scene = self.scene
        gap = scene.gap - float(closure_at(scene, time))
        if self.law is not None and scene.gap_at == "rest":
            growth = growth_of(self.model)
            gap += growth(self.law.start) - growth(float(self.law.speed(time)))
        return gap

    def interval(self, number: int) -> Interval:
        """Return the constants of the interval that begins with step number * every."""
        step = self.scene.solver.time_step
        since, until = number * self.every * step, (number + 1) * self.every * step
        lasts = until - since
        opens = self.gap(since), self.gap(until)
        opening = (opens[1] - opens[0]) / lasts
        if self.law is None:
            still = self.scene.speed
            own = still, 0.0, still, still, since, 0.0, 0.0
            return Interval(*own, opens[0], opening)
        ends = np.array([since, until])
        (before, after), (begun, ended) = self.law.angle(ends), self.law.speed(ends)
        turn, rate = (after - before) / lasts, (ended - begun) / lasts
        back, on = self.law.angle(ends - 0.5 * step)  # for steps since .. until - step
        bend = 0.0 if self.straight else 0.5 * rate
        first = turn - bend * lasts
        mean, ahead = (on - back) / lasts, before - first * since
        parts = mean, rate, turn, first, since, ahead, bend, opens[0], opening
        return Interval._make(map(float, parts))

    @cached_property
    def _ahead(self) -> Floats:
        """The least gap from the start of each interval to the run's end, m, (n,)."""
        count = math.ceil(self.scene.end_times[-1] / self.scene.solver.time_step)
        times = np.arange(count // self.every + 2) * self.every
        gaps = [self.gap(t * self.scene.solver.time_step) for t in times.tolist()]
        return np.minimum.accumulate(gaps[::-1])[::-1]

    def least_gap(self, steps: int) -> float:
        """Return the least gap, m, from time step number `steps` to the run's end."""
        return float(self._ahead[min(steps // self.every, len(self._ahead) - 1)])


def schedule_of(scene: Scene, model: Model) -> Schedule | None:
    """Return the intervals of a run; None if its speed and gap are constant.

    scene, model : scene and model as integrated
    """
    if not changes(scene):
        return None
    return Schedule(scene, model, interval_of(scene, model), rides(scene, model))


def rides(scene: Scene, model: Model) -> bool:
    """Return whether a run with intervals integrates the casing in the rotor's frame.

    It is unless it consists of elements, the rotor has terms of rotation, or the scheme
    is `paper`.
    """
    apart = model.rotor.spin is not None or scene.solver.scheme == "paper"
    return not (apart or scene.engine.casing.discretization == "elements")


def interval_of(scene: Scene, model: Model) -> int:
    """Return the number of steps of an interval that meets the scene's `accuracy`.

    In an interval T, the phase of a wave of frequency omega, integrated at the mean
    speed, errs by at most h |dOmega/dt| T^2 / 8 rad; at the interval's end, the
    error is of third order. h = |d omega / d Omega| is at most 2 by Coriolis forces, or
    the highest harmonic of a ring integrated in the rotor's frame. The gap, linear in
    an interval, errs by at most Delta / tau^2 T^2 / 8 by the curvature of its closure,
    Delta (1 - e^{-t / tau}), see `closure_at`.
    """
    accuracy = scene.solver.accuracy or USUAL
    law, curved = law_of(scene), []
    if law is not None:
        ring = scene.engine.casing.harmonics
        waves = float(ring) if rides(scene, model) else 2.0
        curved.append(waves * law.fastest_change)
    if scene.gap_closure:
        rate = abs(scene.gap_closure) / scene.gap_time  # by gap_time^2 it may overflow
        bent = rate / scene.gap_time / max(scene.gap, 1e-12)
        curved.append(max(bent, math.ulp(0.0)))
    longest = math.sqrt(8.0 * accuracy / max(curved, default=math.inf))
    if scene.gap_table or scene.speed_table:  # kinks of a table may lie in an interval
        longest = min(longest, accuracy**0.5 * _shortest(scene))
    return max(1, int(min(longest / scene.solver.time_step, MOST_STEPS)))


def _shortest(scene: Scene) -> float:
    tables = [text for text in (scene.gap_table, scene.speed_table) if text]
    times = [np.array(kept_rows(text))[:, 0] for text in tables]
    return float(min(np.diff(each).min() for each in times))


def check_change(scene: Scene, model: Model) -> None:
    """Raise InputError if speed or gap change in time in a way that is not allowed."""
    if not changes(scene):
        return
    law = law_of(scene)
    if law is not None:
        _check_law(scene, model, law)
    schedule = schedule_of(scene, model)
    least = schedule.least_gap(0) if schedule else scene.gap
    if not least > 0.0:
        raise InputError(
            "gap must stay open: closure and growth of the tips would leave "
            f"{least:.6g} m of it, got gap {scene.gap:.6g} m at the start"
        )


def _check_law(scene: Scene, model: Model, law: SpeedLaw) -> None:
    slowest, fastest = extremes(scene)
    if not slowest * fastest > STANDS * fastest**2:
        raise InputError(
            "speed must keep its sign and not reach 0, where friction reverses: "
            f"acceleration, speed_to and duration lead from {law.start:.6g} to "
            f"{float(law.speed(scene.end_times[-1])):.6g} rad/s"
        )
    step = scene.solver.time_step
    if law.kind == "decay" and law.lasts < step:
        raise InputError(
            f"acceleration must be within +-{abs(law.end - law.start) / step:.6g} "
            "rad/s^2 where ramp is decay (a time constant of one time step), got "
            f"{law.rate:.6g}"
        )
    spin = model.rotor.spin
    if spin is not None and (spin.released is not None or not spin.support.is_plain):
        table = scene.speed_table
        got = shown(table) if table else f"{scene.acceleration:.6g}"
        raise InputError(
            "acceleration must be 0, and speed_table empty, where a blade is lost, or "
            f"supports differ by direction or have a film, got {got}"
        )
