"""The march: the time integration of one case, in slices of about 10 ms of wall time.

Times and angles follow from the step number, so that any division into slices gives the
same bits.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from hpcwhirl.arrays import Floats, Integers
from hpcwhirl.case.bounds import TOUCHDOWNS
from hpcwhirl.case.limits import beat_of, step_counts
from hpcwhirl.case.plan import Marched
from hpcwhirl.case.profile import NEVER, held_shape, release_step
from hpcwhirl.case.resolve import Case
from hpcwhirl.case.speed import angle_at, law_of, schedule_of, speed_at
from hpcwhirl.case.unbalance import loss_step
from hpcwhirl.dynamics.bodies.motion import Motion, check_continuable, turned
from hpcwhirl.dynamics.bodies.operators import friction_with_sign, rods_of
from hpcwhirl.dynamics.bodies.shaft_loads import COLUMNS as MORE
from hpcwhirl.dynamics.bodies.shaft_loads import ShaftLoads, shaft_loads
from hpcwhirl.dynamics.history import History
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.kernels.kernel_types import Strides, Tracks
from hpcwhirl.dynamics.kernels.loop.flight import LESS
from hpcwhirl.dynamics.schemes import before_and_after, scheme_of
from hpcwhirl.dynamics.schemes.by_sectors import folds_well
from hpcwhirl.dynamics.start import start_of
from hpcwhirl.dynamics.tracks import CERTAIN, empty_tracks, history_of
from hpcwhirl.dynamics.waves.casing import wall_of
from hpcwhirl.dynamics.waves.free_motion import FreeMotion
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.numbers import representable
from hpcwhirl.scene.contact_laws import PERMANENT

IMPULSES = contact.IMPULSE, contact.TANGENTIAL  # in the ledger, of which friction is
KEPT_STATES = 64  # samples whose states the kernel keeps until they are read
SLICE_SECONDS = 0.01  # wall time that a slice should take
FIRST_SLICE = 256  # steps of the first slice, before the time of a step is known
LEAST_SLICE = 16  # least number of steps of a slice
TELLING = 0.1  # share of `SLICE_SECONDS` below which a shortened slice tells no time
LEAST_SECONDS = 1e-6  # least wall time of a slice, to divide by
_slices: dict[tuple[str | int, ...], int] = {}  # {`March.kind`: steps of last slice}
LOOKS = 50  # rows of evidence between two searches for a certificate
PATIENCE = 16  # largest multiple of `LOOKS` between two searches
CLEAR = 2.0  # time of the first search for a certificate, in durations of the pulse
MOST_TRACES = 4e9  # bytes of one case's samples in memory


class March:
    """The time integration of a case: advance it in slices, then read its history.

    If load and engine repeat around the circumference, only one sector is integrated,
    see `fold`. A certificate is the proof that no blade can touch again, after which
    the run is completed in closed form.

    Parameters
    ----------
    case : the case to integrate
    start : the initial motion: the final one of another march; None: the motion given
        by `start_energy` of the case, else rest, or the circle of an unbalanced rotor

    Attributes
    ----------
    scene, model : scene and model of the case, of all sectors
    lean : scene and model that are integrated, of all sectors or of one
    scheme : the integrator, with the kernel's constant arrays
    later : integrator of the rotor without the blade that is lost later; None: no blade
        is lost, or it is already
    every : number of steps between samples, at which stress and loads are read
    loads : (samples + 1, 2 s + 3), loads of the shaft, see `_empty_loads`
    jump : (1,), N m s, change of the angular momentum as a blade leaves
    state : motion, ledger and counters at the present step, which the kernel changes
    tracks : samples and rows of evidence written so far

    Raises
    ------
    InputError
        if the step is at or above a body's stability limit or too long for the pulse or
        the speed, if the samples would not fit in memory, or if `start` cannot be
        continued
    """

    def __init__(self, case: Case, start: Motion | None = None) -> None:
        case.check()
        if start is not None:
            check_continuable(case.model, case.scene)
            start = turned(case.model, start)
        self.start = start_of(case) if start is None else start
        self.case, self.scene, self.model = case, case.scene, case.model
        scene = self.scene
        self.total, self.every = step_counts(scene)
        self.stride = self.every
        self.beat = beat_of(self.model, scene)
        self.interval = self.stride * scene.solver.time_step
        if scene.output.traces == "summary":  # no sample before the end
            self.stride = (self.total // self.beat + 1) * self.beat
        self.seconds = 0.0
        self._free: FreeMotion | None = None
        self._shaft: ShaftLoads | None = None
        self.schedule = schedule_of(scene, self.model)
        self.let_go, self.lost_at = release_step(scene), loss_step(scene)
        self.fold()

    def _begin(self, lean: Marched) -> None:
        """Make the integrator and set its state to the start of the run.

        The start is rest or the initial motion.

        lean : scene and model to integrate; if they cannot represent the initial
            motion, those of all sectors are taken instead
        """
        before, self.lean, self.later = self.case.before, lean, None
        with representable("the step"):
            if before is None:
                self.scheme = scheme_of(lean.model, lean.scene, self.beat)
            else:
                self.lean = before
                both = before_and_after(before, lean, self.beat)
                self.scheme, self.later = both
        self.schemes = [own for own in (self.scheme, self.later) if own]
        self.state = self.scheme.state
        if self.start is not None and not self._started(self.start):
            self._begin(self.case.whole)
            return
        self._refresh(self.state)
        self._free, self._shaft = None, None
        self.stresses, self.loads = self._empty_stresses(), self._empty_loads()
        self.tracks = self._empty_tracks()
        self.jump = np.zeros(1)
        self._read(0)
        self.coast = self._coast()
        self.watched = LOOKS * self.beat if lean.model.folds > 1 else 0

    def _started(self, start: Motion) -> bool:
        """Start from an initial motion; return whether the model can represent it.

        It cannot if one sector is integrated and the motion differs between sectors.
        """
        self._refresh(None)
        return self.scheme.begin(start)

    def _refresh(self, state: Any) -> None:
        """Compute speed, casing shape and the kernel's arrays for the present step.

        They change from one interval to the next if the speed is a function of time,
        and when a casing that was held in a shape is let go.

        state : the kernel's state, to be adapted to a new interval of speed, or None
        """
        scene = self.lean.scene
        free = NEVER < self.let_go <= self.steps
        self.wall = wall_of(self.lean.model, scene, released=free)
        self.speed, self.friction = scene.speed, friction_with_sign(scene)
        if self.schedule is None:
            return
        now = self.schedule.interval(self.steps)
        folds = self.lean.model.folds
        self.speed, self.friction = folds * now.first, self.scheme.friction(now.speed)
        self.wall = self.wall._replace(
            gap=now.gap, opening=now.opening, since=now.since,
            ahead=folds * now.ahead, bend=folds * now.bend,
            lag=folds * now.lag, hurry=folds * now.hurry,
        )  # fmt: skip
        self.scheme.refresh(state, now)

    @contextmanager
    def at_start(self) -> Iterator[None]:
        """Give the kernel's arrays their values of step 0 within a `with` statement.

        With a changing speed they differ later. The fingerprint of a snapshot, which
        must not depend on the step, is computed from them.
        """
        steps = self.steps
        self.counter[contact.STEP] = 0
        self._refresh(None)
        for other in self.schemes:  # of the rotor before or after the loss of a blade
            if other is not self.scheme and self.schedule is not None:
                other.refresh(None, self.schedule.interval(0))
        try:
            yield
        finally:
            self.counter[contact.STEP] = steps
            self._refresh(None)

    def recall(self) -> None:
        """Compute speed, casing shape and the kernel's arrays for a loaded state."""
        self._refresh(None)

    def enter(self, steps: int) -> None:
        """Replace the rotor by that without the lost blade, if it is at a step.

        The state is that of the new rotor, without motion.

        steps : number of time steps taken
        """
        if self.later is None or steps < self.lost_at:
            return
        self.lean, self.scheme, self.later = self.case.whole, self.later, None
        self._free, self._shaft = None, None
        self.state = self.scheme.state
        self.counter[contact.STEP] = steps
        self._refresh(None)
        self.coast = self._coast()

    def _lose(self) -> None:
        """Continue with the rotor that has lost a blade, from its present motion."""
        old, steps, was = self.scheme, self.steps, self._angular_momentum()
        self.enter(steps)
        search = int(self.counter[contact.NEXT_TRY])
        self.scheme.carry(old, steps)
        self.counter[contact.NEXT_TRY] = search
        self.jump[0] = self._angular_momentum() - was

    def _angular_momentum(self) -> float:
        """Return that of the rotor about its axis, N m s; 0 if no loads are stored."""
        if not self.loads.size:
            return 0.0
        now, time = self.motion(), self.steps * self.scene.solver.time_step
        speed = np.asarray([speed_at(self.scene, time)], dtype=float)
        both = now.rotor[None], now.rotor_velocity[None]
        return float(self.shaft.angular_momenta(*both, speed)[0])

    def put(self, state: Iterable[Floats]) -> None:
        """Replace the march's state by one of the same scene, perhaps at another step.

        state : arrays of the state, in the order of its fields
        """
        arrays = list(state)
        self.enter(int(arrays[self.state._fields.index("counter")][contact.STEP]))
        for target, array in zip(self.state, arrays, strict=True):
            target[...] = array
        self.recall()

    def _coast(self) -> FreeMotion | None:
        """Return the motion without contact, which finds certificates, or None.

        None if the plan of the case seeks no certificate, or if there is no closed form
        for this scheme or for a changing speed.
        """
        scene = self.lean.scene
        if not self.case.plan.settles or self.later:
            return None
        if law_of(scene) is not None:  # its closed form is that of a constant speed
            return None
        free = self.scheme.free()
        if free is None:
            return None
        first = math.ceil(CLEAR * scene.pulse / scene.solver.time_step) + 1
        self._look_after(max(first if scene.is_loaded else 1, self.let_go + 1))
        return free if free.possible else None

    def _watch(self) -> None:
        """Restart the run with all sectors if the one integrated had too much contact.

        Round-off grows from contact to contact, and a motion that differs between
        sectors may grow from it: one sector represents all only while this is
        negligible.
        """
        if not self.watched or self.steps % self.watched:
            return
        model, counter = self.lean.model, self.counter
        touching = float(counter[contact.TOUCHED]) * self.scene.solver.time_step
        many = counter[contact.TOUCHDOWNS] > TOUCHDOWNS * model.blades
        if many or touching * float(model.rotor.omega.min()) > 2.0 * math.pi:
            self.unfold()

    def unfold(self) -> None:
        """Restart the run with all sectors integrated, instead of one."""
        self._begin(self.case.whole)

    def fold(self) -> None:
        """Restart the run with the model that the plan chose, of one sector or of all.

        One sector represents all if they move alike. If two of its waves nearly
        coincide, all are integrated.
        """
        lean = self.case.lean
        self._begin(lean if folds_well(lean.model, lean.scene) else self.case.whole)

    def _slice(self, size: int) -> int:
        """Return how many steps, at most `size`, can be taken before the next check.

        A check is the search for a certificate (`_look`), or that of the contact of one
        sector, if it represents all (`_watch`).
        """
        if self.coast is not None:
            left = int(self.counter[contact.NEXT_TRY]) - self.steps
            size = min(size, max(left, 1))
        if self.watched:
            size = min(size, self.watched - self.steps % self.watched)
        return size

    def _look_after(self, steps: int) -> None:
        """Postpone the next search for a certificate by at least `steps` steps.

        It takes place at a step with a row of evidence.
        """
        at = self.steps + steps
        self.counter[contact.NEXT_TRY] = -(-at // self.beat) * self.beat

    def _look(self) -> None:
        """Search for a certificate, if one is due; if found, end or complete the run.

        It is found if a bound of all later motion of tips and ring is below the gap.
        Then a run until "certain" ends, and another is completed in closed form.
        """
        if self.coast is None or self.steps < int(self.counter[contact.NEXT_TRY]):
            return
        sizes, decays = self.coast.bound(self.state)
        reach, room = float(sizes.sum(axis=1).max()), self.wall.room
        if self.schedule is not None:
            room += self.schedule.least_gap(self.steps) - self.scene.gap
        near = reach < LESS * room
        if not (near and self.coast.farthest(self.state) < LESS * self._limit):
            pause = LOOKS * self.beat
            self._look_after(next_look(sizes, decays, room, pause, PATIENCE * pause))
            return
        self.counter[contact.CERTIFIED] = self.steps
        self.state.ledger[contact.CERTIFICATE] = reach
        if self.scene.solver.until == "certain":
            self.counter[contact.STOP] = CERTAIN
        elif self.steps < self.total:
            strides = self._strides
            self._read_samples(self.steps, self.total)
            sample = int(self.counter[contact.SAMPLE])
            self.coast.finish(self.state, self.tracks, self.total, strides)
            self.tracks.worn[sample:] = self.state.worn[0]  # no tip wears it again

    def _timed_look(self) -> None:
        start = time.perf_counter()
        self._look()
        self.seconds += time.perf_counter() - start

    @property
    def _limit(self) -> float:
        """Magnitude of a tip's displacement at which a run ends as too large, m."""
        return self.scene.solver.amplitude_limit * self.scene.engine.rotor.radius

    def _empty_tracks(self) -> Tracks:
        blades, kept = self.lean.model.contacts, self.scene.output.traces
        samples, rods = self.total // self.stride, rods_of(self.scene)
        tips, casing = kept in {"blades", "full"}, kept == "full"
        width = self.scheme.casing_width
        more = width + rods + self._stress_shape[0] * self._stress_shape[1]
        size = 8.0 * samples * (7 + 3 * blades * tips + more * casing)
        rows = self.total // self.beat
        if 8.0 * self.evidence_columns * rows > MOST_TRACES:
            raise InputError(
                f"duration asks for {rows} rows of evidence, allowed "
                f"{MOST_TRACES / (8 * self.evidence_columns):.0f}: shorten duration"
            )
        if size > MOST_TRACES:
            raise InputError(
                f"output interval asks for {samples} samples of {size / samples:.0f} "
                f"bytes, allowed {MOST_TRACES / 1e9:g} GB: raise interval"
            )
        kept_samples = samples, samples * tips, samples * casing
        states = KEPT_STATES if self._reads and not self.scheme.jumps else 0
        wide = max(own.kept_width for own in self.schemes) + len(IMPULSES)
        return empty_tracks(
            kept_samples, (rows, self.evidence_columns), blades, width, rods,
            (states, wide),
        )  # fmt: skip

    @property
    def _strides(self) -> Strides:
        return Strides(self.stride, self.beat, self.every)

    @property
    def _stress_shape(self) -> tuple[int, int]:
        """Numbers (N, P) of blades, and of points on each whose stress is stored.

        P is 0 unless traces are "full".
        """
        stress, whole = self.model.rotor.stress, self.scene.output.traces == "full"
        return self.model.blades, len(stress.names) if stress and whole else 0

    def _empty_stresses(self) -> Floats:
        return np.zeros((self.total // self.stride, *self._stress_shape))

    def _empty_loads(self) -> Floats:
        """Return an array for the loads of the shaft at step 0 and at each sample.

        They are those of `ShaftLoads.of_motions`, and the impulse of contact, on which
        the torque of friction depends, N s. It is empty if they are not asked for.
        """
        width = len(self.shaft.names) * 2 + MORE if self.case.reads_loads else 0
        return np.zeros((self.total // self.every + 1 if width else 0, width))

    @property
    def shaft(self) -> ShaftLoads:
        """How loads of the shaft follow from the motion of the present rotor."""
        if self._shaft is None:
            before = self.case.before if self.later else None
            model, scene = before[::-1] if before else (self.model, self.scene)
            self._shaft = shaft_loads(model, scene)
        return self._shaft

    @property
    def _reads(self) -> bool:
        return bool(self.stresses.size or self.loads.size)

    def _sample_after(self, step: int) -> int:
        """Return the step of the first sample after a step."""
        return step - step % self.every + self.every

    def _read_samples(self, step: int, end: int) -> None:
        """Read the motion at each sample after a step, up to another step.

        Scheme `exact` may have jumped over samples, and after a certificate no blade
        can touch again: there the motion is free.
        """
        if self._reads:
            for at in range(self._sample_after(step), end + 1, self.every):
                self._read(at)

    def _read(self, step: int) -> None:
        """Store stress at the named points, Pa, and loads of the shaft, at a sample.

        step : of the sample, or 0: the present one, or one between which and the
            present one the motion is free
        """
        if not self._reads:
            return
        now, entries = self._motion_at(step), self.state.ledger[list(IMPULSES)]
        both = now.rotor[None], now.rotor_velocity[None]
        self._store(np.array([step]), both, entries[None])

    def _read_kept(self, since: int) -> None:
        """Read the motion at each sample after a step, but not at the present step.

        There the kernel kept the states; see `_next_read` for how many.
        """
        kept, step = self.tracks.states, self._sample_after(since)
        steps = np.arange(step, self.steps, self.every)
        if not (len(kept) and len(steps)):
            return
        rows, width = kept[steps // self.every % len(kept)], self.scheme.kept_width
        both = self.scheme.rotors(rows[:, :width], steps)
        self._store(steps, both, rows[:, -len(IMPULSES) :])

    def _store(
        self, steps: Integers, motions: tuple[Floats, Floats], impulses: Floats
    ) -> None:
        """Store stress at the named points and loads of the shaft at samples.

        steps : (k,), of the samples
        motions : (k, n) each, displacements and velocities of the rotor
        impulses : (k, 2), N s, entries `IMPULSES` of the ledger
        """
        (x, v), rows, stress = motions, steps // self.every, self.model.rotor.stress
        if self.stresses.size and stress is not None:
            for row, places in zip(rows.tolist(), x, strict=True):
                if row:
                    self.stresses[row - 1] = stress.at(places)
        if not self.loads.size:
            return
        times, slips = steps * self.scene.solver.time_step, self.scene.slip != PERMANENT
        speeds, angles = (
            np.array([float(f(self.scene, time)) for time in times.tolist()])
            for f in (speed_at, angle_at)
        )
        with np.errstate(all="ignore"):  # a motion that diverges may not be finite
            self.loads[rows, :-1] = self.shaft.of_motions(x, v, speeds, angles)
            self.loads[rows, -1] = self.lean.model.folds * impulses[:, int(slips)]

    def _motion_at(self, step: int) -> Motion:
        """Return the motion at the present step, or at another one of a free motion."""
        if step == self.steps:
            return self.scheme.motion(self.state, step)
        free = self._free or self.scheme.free()
        self._free = free
        if free is None:
            raise TypeError(self.scheme)
        rotor, counter = self.state.rotor.copy(), self.counter.copy()
        other = self.state._replace(rotor=rotor, counter=counter)
        counter[contact.STEP] = step
        turned = np.exp((step - self.steps) * free.log)
        free.put(other, free.amplitudes(self.state) * turned)
        return self.scheme.motion(other, step)

    @property
    def evidence_columns(self) -> int:
        """Number of values in each row of evidence.

        It is larger for a rotor with terms of rotation at a changing speed.
        """
        return contact.OF_WHOLE + 1 if self.scheme.drives else contact.COLUMNS

    @property
    def counter(self) -> Any:
        """Integer counters of the state: steps, contacts, samples and others.

        Their indices are named in `kernels.contact`.
        """
        return self.state.counter

    @property
    def steps(self) -> int:
        """Number of time steps taken so far."""
        return int(self.counter[contact.STEP])

    @property
    def marched(self) -> int:
        """Number of steps that the kernel computed one by one, not in closed form."""
        certified = int(self.counter[contact.CERTIFIED])
        if self.coast is not None and certified >= 0:
            return certified
        return self.steps - int(self.counter[contact.JUMPED])

    @property
    def last_row(self) -> int:
        """Step of the last row of evidence, to which a longer run has the same bits.

        After it, jumps of scheme `exact` depend on the end of the run.
        """
        return self.total // self.beat * self.beat

    @property
    def done(self) -> bool:
        """Whether the run has taken its last step, or has been stopped before."""
        return self.steps >= self.total or self.counter[contact.STOP] != 0

    def displacements(self) -> tuple[Floats, Floats]:
        """Return the present displacements, m, of rotor, (n,), and casing, (c,).

        They are those of all n and c coordinates of the model: of the rotor in the
        rotating frame, of the casing in the static frame.
        """
        now = self.scheme.motion(self.state, self.steps)
        return now.rotor, now.casing

    def motion(self) -> Motion:
        """Return displacements and velocities of rotor and casing at the present step.

        The result includes the angle of the rotor, 0 .. 2 pi.
        """
        now = self.scheme.motion(self.state, self.steps)
        time = self.steps * self.scene.solver.time_step
        angle = float(angle_at(self.scene, time))
        return now._replace(angle=angle % (2.0 * math.pi))

    def advance(self, steps: int) -> None:
        """Integrate at most `steps` further steps.

        A run gives the same bits however it is divided into such calls.
        """
        start = time.perf_counter()
        self._through_samples(min(self.steps + steps, self.total))
        self.seconds += time.perf_counter() - start

    def _through_samples(self, goal: int) -> None:
        """Integrate up to step `goal`; read the motion, if asked for, at samples."""
        while self.steps < goal and self.counter[contact.STOP] == 0:
            before = self.steps
            self._march_to(self._next_read(goal))
            if not len(self.tracks.states):
                self._read_samples(before, self.steps)

    def _next_read(self, goal: int) -> int:
        """Return the next step, at most `goal`, at which the motion is to be read.

        It is `goal` if neither stress nor loads are stored, and else that of the next
        sample or, if the kernel keeps states, of so many samples later.
        """
        if not self._reads:
            return goal
        more = max(len(self.tracks.states) - 1, 0)
        return min(goal, self._sample_after(self.steps) + more * self.every)

    def _march_to(self, goal: int) -> None:
        """Integrate up to step `goal`, or until the run stops.

        On the way, the kernel's arrays are computed anew where an interval of speed
        ends, and a casing held in a shape is let go, and a blade lost, when its time
        comes.
        """
        while self.steps < goal and self.counter[contact.STOP] == 0:
            cut, before = self._next_cut(), self.steps
            self._call(min(goal, cut) - before)
            self._read_kept(before)
            if self.steps >= cut:
                self._refresh(self.state)
                if cut == self.let_go:
                    self._release()
                if cut == self.lost_at and self.later:
                    self._lose()
            if len(self.tracks.states):
                self._read_samples(self.steps - 1, self.steps)

    def _next_cut(self) -> int:
        """Return the next step at which the kernel's arrays must be computed anew.

        There an interval of speed ends, a casing held in a shape is let go, or a blade
        is lost. If none of these is to come, it is the last step of the run.
        """
        steps, cuts = self.steps, []
        if self.schedule is not None:
            cuts.append(self.schedule.span(steps)[1])
        cuts += [at for at in (self.let_go, self.lost_at) if steps < at]
        return min(cuts, default=self.total)

    def _release(self) -> None:
        """Let go of a casing held in a shape: the shape becomes its displacement.

        The energy that this adds is entered in the ledger as work of the loading.
        """
        state, shape = self.state, held_shape(self.model, self.scene)
        before = self.scheme.balance(state).energy
        self.scheme.release(state, shape, self.steps)
        state.ledger[contact.PULSE] += self.scheme.balance(state).energy - before

    def _call(self, steps: int) -> None:
        """Take `steps` time steps with the compiled kernel of the scheme."""
        scene = self.lean.scene
        self.scheme.kernel(
            steps,
            self._strides,
            self._limit,
            scene.solver.time_step,
            self.speed,
            self.friction,
            self.wall,
            *self.scheme.arrays,
            self.state,
            self.tracks,
        )

    @property
    def kind(self) -> tuple[str | int, ...]:
        """Key that is equal for marches with the same kernel and similar time per step.

        It is (types of the kernel's arrays, scheme, numbers of blades, of rotor modes,
        of casing modes). A march begins with the size of slice with which the last
        march of the same key ended.
        """
        lean = self.lean
        kinds = (type(array).__name__ for array in [self.scheme, *self.scheme.arrays])
        scheme, ring = lean.scene.solver.scheme, lean.model.casing
        modes = len(lean.model.rotor.omega), len(ring.omega) if ring else 0
        return *kinds, scheme, lean.model.blades, *modes

    def warm(self) -> None:
        """Compile the kernels of a run without taking a step, unless a run has.

        The wall time of compilation is not added to `seconds`.
        """
        if self.kind not in _slices:
            self._call(0)
            self.scheme.balance(self.state)

    def run(self, between_slices: Callable[[], None] | None = None) -> History:
        """Integrate to the end in slices of about 10 ms, and return the history.

        between_slices : function that is called after each slice
        """
        self.reach(self.total, between_slices)
        return self.history()

    def reach(
        self, goal: int, between_slices: Callable[[], None] | None = None
    ) -> None:
        """Integrate in slices of about 10 ms up to step `goal`, or to the end.

        between_slices : function that is called after each slice
        """
        kind = self.kind
        size = _slices.get(kind, FIRST_SLICE)
        while not self.done and self.steps < goal:
            before = time.perf_counter()
            steps = self._slice(min(size, goal - self.steps))
            self.advance(steps)
            size = next_slice(size, steps, time.perf_counter() - before)
            self._watch()
            self._timed_look()
            _slices[kind] = size
            if between_slices:
                between_slices()

    def history(self) -> History:
        """Return the history of the run so far: samples, totals and present ledger."""
        return history_of(self)


def next_slice(size: int, made: int, seconds: float) -> int:
    """Return the number of steps of the next slice, so that it takes about 10 ms.

    size, made : numbers of steps of the last slice, planned and taken. If fewer were
        taken, the last slice is ignored if it was very short, when most of its time was
        that of the call itself
    seconds : wall time of the last slice
    """
    if made < size and seconds < TELLING * SLICE_SECONDS:
        return size
    wanted = made * SLICE_SECONDS / max(seconds, LEAST_SECONDS)
    return int(min(max(wanted, LEAST_SLICE), 2 * size))


def next_look(
    sizes: Floats, decays: Floats, gap: float, shortest: int, longest: int
) -> int:
    """Return after how many steps to search for a certificate again.

    It is the number of steps after which the bound of the tips' motion will be below
    the gap, if no contact occurs before. Only `shortest`, twice, four times it, ... are
    tried.

    Parameters
    ----------
    sizes, decays : results of `FreeMotion.bound`, at all contact points
    gap : m
    shortest, longest : least and largest result, numbers of steps
    """
    for _ in range(40):
        if shortest >= longest or (sizes @ decays**shortest).max() < LESS * gap:
            break
        shortest *= 2
    return min(shortest, longest)
