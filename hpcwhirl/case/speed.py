"""Speed and gap that change in time, and their values in intervals of time steps.

Omega(t) and theta(t), its integral, are closed forms of time, so that the blades' angle
does not drift. The time integration has constant arrays in intervals of time steps,
which follow from the scene, not from where a run was stopped. In an interval the angle
is a parabola, exact at both ends, the gap is linear, and matrices are those of the mean
speed: errors are of second order in the interval, see `sections_of`.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np

from hpcwhirl.arrays import Floats, Integers
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.model import Model, has_waves
from hpcwhirl.scene import Scene
from hpcwhirl.scene.contact_laws import PERMANENT
from hpcwhirl.scene.kept_tables import kept_rows

USUAL = 1e-4  # accuracy of the intervals if `solver.accuracy` is not given
ENDLESS = 1e100  # s, longest change of the speed; beyond, a product with 0 is no number
STANDS = 1e-6  # speed, relative to the largest, that counts as standstill
MOST_STEPS = 4096  # largest number of steps of an interval
PARTS = 4  # sections in the time constant of a decay, or in a smooth change
LAST = 12  # time constants after which a decay has one section
ON_STEP = 1e-6  # part of a step by which a table's row may miss the end of a step
LEAST = 1e-12  # m, gap below which an interval need not be shorter
COUPLED = 2.0  # |d omega / d Omega| of waves of the rotor by Coriolis forces, at most
LOOKS = 33  # speeds at which growth of the tips is computed for its derivatives
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

    def changes_in(self, begin: Floats, end: Floats) -> tuple[Floats, Floats]:
        """Return bounds of |dOmega/dt| and |d^2 Omega/dt^2| in n spans of time, (n,).

        No kink of the speed lies inside a span; begin, end : (n,), s
        """
        none = np.zeros(len(begin))
        if self.kind == "table":
            return np.abs(self.speed(end) - self.speed(begin)) / (end - begin), none
        rate, lasts = abs(self.rate), self.lasts
        if self.kind == "linear":
            return np.where(begin < lasts, rate, 0.0), none
        if self.kind == "decay":
            now = rate * np.exp(-begin / lasts)
            return now, now / lasts
        ends = np.minimum([begin, end], lasts)
        steepest = np.clip(0.5 * lasts, *ends)
        first = rate * 0.5 * math.pi * np.sin(math.pi * steepest / lasts)
        bent = np.where(begin < lasts, rate * math.pi**2 / (2.0 * lasts), 0.0)
        return first, bent

    def breaks(self, until: float) -> tuple[list[float], list[float]]:
        """Return the times, s, at which a run is divided, before a time: kinks, others.

        At kinks the rate of the speed jumps; at the others it has changed so far that
        intervals may have another length.
        """
        if self.kind == "table":
            return [t for t in self.times if t < until], []
        if self.kind == "linear":
            return ([self.lasts] if self.lasts < until else []), []
        if self.kind == "decay":
            return [], _fading(self.lasts, until)
        parts = self.lasts / PARTS * np.arange(1, PARTS + 1)
        return [], [float(part) for part in parts if part < until]


def _fading(constant: float, until: float) -> list[float]:
    """Return times, s, between which e^(-t / constant) does not change much."""
    parts = constant / PARTS * np.arange(1, LAST * PARTS + 1)
    return [float(part) for part in parts if part < until]


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
        the end, of all intervals that share the rotor's matrices
    rate : rad/s^2, mean dOmega/dt of these intervals
    turn : rad/s, mean rate of the rotor's angle theta in the interval
    first : rad/s, rate of theta, a parabola in time t, at the start of the interval
    since : s, start of the interval
    ahead, bend : rad, rad/s^2: theta = first t + ahead + bend (t - since)^2
    lag, hurry : rad/s, rad/s^2: lag + hurry (t - since) is what Omega has beyond the
        rate of theta, whose parabola is a line if the angle is `Schedule.straight`
    gap, opening : m, gap at the start of the interval; m/s, its rate
    """

    speed: float
    rate: float
    turn: float
    first: float
    since: float
    ahead: float
    bend: float
    lag: float
    hurry: float
    gap: float
    opening: float


class Section(NamedTuple):
    """A part of a run in which all intervals but the last have one number of steps.

    Attributes
    ----------
    first : number of the step with which it begins
    every : number of steps of an interval
    shared : number of intervals for which the rotor's matrices stay those of one speed
    """

    first: int
    every: int
    shared: int = 1


@dataclass(frozen=True)
class Schedule:
    """The intervals into which a run with a changing speed or gap is divided.

    Attributes
    ----------
    scene, model : scene and model as integrated; scene.gap is the gap at time 0
    straight : whether the angle is linear in an interval, as is required for a ring
        that is integrated in the rotor's frame
    """

    scene: Scene
    model: Model
    straight: bool

    @cached_property
    def sections(self) -> tuple[Section, ...]:
        """The sections of the run, in which intervals have different lengths."""
        return sections_of(self.scene, self.model, self.gaps)

    def span(self, steps: int, *, shared: bool = False) -> tuple[int, int]:
        """Return the first step of the interval that has a step, and that after it.

        shared : whether to return those of all intervals that share the matrices
        """
        place = bisect_right(self.sections, steps, key=lambda part: part.first) - 1
        first, every, count = self.sections[place]
        every *= count if shared else 1
        since = first + (steps - first) // every * every
        after = self.sections[place + 1 : place + 2]
        return since, min([since + every, *(part.first for part in after)])

    @cached_property
    def law(self) -> SpeedLaw | None:
        """The speed as a function of time; None: it is constant."""
        return law_of(self.scene)

    def gaps(self, times: Floats) -> Floats:
        """Return the gap, m, at times, s, (n,), with closure and growth of the tips."""
        scene = self.scene
        gaps = scene.gap - closure_at(scene, times)
        if self.law is not None and scene.gap_at == "rest":
            growth, speeds = growth_of(self.model), self.law.speed(times).tolist()
            gaps = gaps + growth(self.law.start) - np.array([*map(growth, speeds)])
        return np.asarray(gaps)

    def gap(self, time: float) -> float:
        """Return the gap, m, at a time, s, with closure and growth of the tips."""
        return float(self.gaps(np.array([time]))[0])

    def interval(self, steps: int) -> Interval:
        """Return the constants of the interval that has a step of this number."""
        step = self.scene.solver.time_step
        since, until = (at * step for at in self.span(steps))
        lasts = until - since
        opens = self.gap(since), self.gap(until)
        opening = (opens[1] - opens[0]) / lasts
        if self.law is None:
            still = self.scene.speed
            own = still, 0.0, still, still, since, 0.0, 0.0, 0.0, 0.0
            return Interval(*own, opens[0], opening)
        ends = np.array([since, until])
        (before, after), (begun, ended) = self.law.angle(ends), self.law.speed(ends)
        turn, rate = (after - before) / lasts, (ended - begun) / lasts
        bend = 0.0 if self.straight else 0.5 * rate
        first, hurry = turn - bend * lasts, rate - 2.0 * bend
        mean, rate = self._matrices(steps)
        angle = before - first * since, bend, -0.5 * hurry * lasts, hurry
        parts = mean, rate, turn, first, since, *angle, opens[0], opening
        return Interval._make(map(float, parts))

    def _matrices(self, steps: int) -> tuple[float, float]:
        """Return Omega, rad/s, and its rate, rad/s^2, of the matrices at a step."""
        if self.law is None:
            return self.scene.speed, 0.0
        step = self.scene.solver.time_step
        ends = step * np.array(self.span(steps, shared=True))
        lasts = ends[1] - ends[0]
        begun, ended = self.law.speed(ends)
        back, on = self.law.angle(ends - 0.5 * step)  # of steps from the first on
        return float((on - back) / lasts), float((ended - begun) / lasts)

    @cached_property
    def _ahead(self) -> tuple[Integers, Floats]:
        """The first step of each interval, and the least gap from there on, m, (n,)."""
        step = self.scene.solver.time_step
        count = math.ceil(self.scene.end_times[-1] / step)
        ends = [*(part.first for part in self.sections[1:]), count]
        parts = zip(self.sections, ends, strict=True)
        pieces = [np.arange(one.first, end, one.every) for one, end in parts]
        starts = np.concatenate([*pieces, [self.span(max(count - 1, 0))[1]]])
        gaps = self.gaps(starts * step)
        return starts, np.minimum.accumulate(gaps[::-1])[::-1]

    def least_gap(self, steps: int) -> float:
        """Return the least gap, m, from time step number `steps` to the run's end."""
        starts, gaps = self._ahead
        place = int(np.searchsorted(starts, steps, side="right")) - 1
        return float(gaps[place])


def schedule_of(scene: Scene, model: Model) -> Schedule | None:
    """Return the intervals of a run; None if its speed and gap are constant.

    scene, model : scene and model as integrated
    """
    if not changes(scene):
        return None
    return Schedule(scene, model, rides(scene, model))


def rides(scene: Scene, model: Model) -> bool:
    """Return whether a run with intervals integrates the casing in the rotor's frame.

    It is unless it consists of elements, the scheme is `paper`, or the rotor has terms
    of rotation and its coupled modes are integrated, see `dynamics.schemes.modal`.
    """
    scheme, apart = scene.solver.scheme, False
    if model.rotor.spin is not None:
        equal = has_waves(model) and model.rotor.points is None
        apart = scheme == "general" or not equal
    apart = apart or scheme == "paper"
    return not (apart or scene.engine.casing.discretization == "elements")


def sections_of(
    scene: Scene, model: Model, gaps: Callable[[Floats], Floats]
) -> tuple[Section, ...]:
    """Return the sections of a run whose intervals meet the scene's `accuracy`.

    In an interval T, the phase of a wave of frequency omega, integrated at the mean
    speed, errs by at most h |dOmega/dt| T^2 / 8 rad; at the interval's end, the
    error is of third order. h = |d omega / d Omega| is at most 2 by Coriolis forces, or
    the highest harmonic of a ring integrated in the rotor's frame; then several
    intervals may share the matrices of the rotor. The gap g, linear in
    an interval, errs by at most |d^2 g / dt^2| T^2 / 8, of which the share in g counts.
    Sections begin at the rows of tables, so that what is linear between rows is exact;
    a row inside a step has this step as a section.

    gaps : function from times, s, to the gap, m, (n,) each
    """
    accuracy = scene.solver.accuracy or USUAL
    step, law = scene.solver.time_step, law_of(scene)
    firsts = _first_steps(scene, law)
    last = max(math.ceil(scene.end_times[-1] / step), firsts[-1] + 1)
    begin, end = (step * np.array(part) for part in (firsts, [*firsts[1:], last]))
    rate, bent = law.changes_in(begin, end) if law else (0.0 * begin, 0.0 * begin)
    waves = COUPLED
    if rides(scene, model):
        waves = max(float(scene.engine.casing.harmonics), COUPLED)
    curve = _closing(scene, begin)
    if law is not None and scene.gap_at == "rest":
        slope, curved = _growing(model, law.range_until(scene.end_times[-1]))
        curve = curve + curved * rate**2 + slope * bent
    room = np.minimum(gaps(begin), gaps(end))
    room[room <= 0.0] = scene.gap  # such a run is refused
    with np.errstate(divide="ignore", over="ignore"):
        worst = np.maximum(waves * rate, curve / np.maximum(room, LEAST))
        every, longest = (
            np.clip(np.sqrt(8.0 * accuracy / most) / step, 1.0, MOST_STEPS).astype(int)
            for most in (worst, COUPLED * rate)
        )
    shared = np.maximum(longest // every, 1) if model.rotor.spin is not None else 1
    return tuple(map(Section, firsts, every.tolist(), (shared + 0 * every).tolist()))


def _first_steps(scene: Scene, law: SpeedLaw | None) -> list[int]:
    """Return the numbers of the steps with which sections begin, ascending from 0."""
    until, step = scene.end_times[-1], scene.solver.time_step
    kinks, others = law.breaks(until) if law else ([], [])
    if scene.gap_table:
        kinks = [*kinks, *(t for t, _ in kept_rows(scene.gap_table) if t < until)]
    if scene.gap_closure:
        others = [*others, *_fading(scene.gap_time, until)]
    firsts = {0, *(round(t / step) for t in others)}
    for t in kinks:
        at = t / step
        near = round(at)
        firsts |= {near} if abs(at - near) < ON_STEP else {int(at), int(at) + 1}
    return sorted(firsts)


def _closing(scene: Scene, begin: Floats) -> Floats:
    """Return |d^2 g / dt^2| by the closure of the gap from times on, s, (n,), m/s^2."""
    if not scene.gap_closure:
        return np.zeros(len(begin))
    rate = abs(scene.gap_closure) / scene.gap_time  # by gap_time^2 it may overflow
    bent = max(rate / scene.gap_time, math.ulp(0.0))
    return np.asarray(bent * np.exp(-begin / scene.gap_time))


def _growing(model: Model, speeds: tuple[float, float]) -> tuple[float, float]:
    """Return the largest first and second derivative of the tips' growth by speed.

    speeds : rad/s, the least and the largest of the run
    """
    places = np.linspace(*speeds, LOOKS)
    spacing = float(places[1] - places[0])
    if spacing == 0.0:
        return 0.0, 0.0
    grown = np.array([growth_of(model)(speed) for speed in places.tolist()])
    first, second = (np.abs(np.diff(grown, n)).max() / spacing**n for n in (1, 2))
    return float(first), float(second)


def check_change(scene: Scene, model: Model) -> None:
    """Raise InputError if speed or gap change in time in a way that is not allowed."""
    if not changes(scene):
        return
    law = law_of(scene)
    if law is not None:
        _check_law(scene, law)
    schedule = schedule_of(scene, model)
    least = schedule.least_gap(0) if schedule else scene.gap
    if not least >= 0.0:
        raise InputError(
            f"gap must be >= {scene.gap - least:.6g} m, by which closure and growth of "
            "the tips reduce it (the tips would press on the casing all around without "
            f"any motion), got {scene.gap:.6g}"
        )


def _check_law(scene: Scene, law: SpeedLaw) -> None:
    slowest, fastest = extremes(scene)
    keeps = slowest * fastest > STANDS * fastest**2
    if scene.slip == PERMANENT and not keeps:
        raise InputError(
            "speed must keep its sign and not reach 0, where friction reverses, unless "
            "slip is set-valued: acceleration, speed_to and duration lead from "
            f"{law.start:.6g} to {float(law.speed(scene.end_times[-1])):.6g} rad/s"
        )
    step = scene.solver.time_step
    if law.kind == "decay" and law.lasts < step:
        raise InputError(
            f"acceleration must be within +-{abs(law.end - law.start) / step:.6g} "
            "rad/s^2 where ramp is decay (a time constant of one time step), got "
            f"{law.rate:.6g}"
        )
