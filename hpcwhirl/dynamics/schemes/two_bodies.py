"""Integrator of rotor and casing with the loop `kernels.oracle.bodies`.

Schemes `paper` and `general` use it, with displacements or modal amplitudes; the casing
is in the static frame.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from hpcwhirl.arrays import Floats, Integers
from hpcwhirl.case.profile import HeldShape
from hpcwhirl.case.speed import Interval
from hpcwhirl.case.unbalance import steady_start
from hpcwhirl.dynamics.bodies.motion import (
    CentralSteps,
    Motion,
    Steps,
    after_loss,
    check_sizes,
    gaps_of,
    lowering,
    modal_steps,
)
from hpcwhirl.dynamics.bodies.operators import (
    friction_with_sign,
    ring_compliance,
    rotor_compliance,
    unworn,
)
from hpcwhirl.dynamics.bodies.turning import amplitudes_at, steps_on, whole
from hpcwhirl.dynamics.kernels.contact import PULSE
from hpcwhirl.dynamics.kernels.kernel_types import (
    Arrays,
    BodiesState,
    Body,
)
from hpcwhirl.dynamics.kernels.oracle.bodies import energies_of, march_bodies
from hpcwhirl.dynamics.schemes.integrator import Balance, Integrator, nothing_yet
from hpcwhirl.reduction.model import Model
from hpcwhirl.reduction.modes import ModalModel
from hpcwhirl.scene import Scene
from hpcwhirl.scene.contact_laws import PERMANENT

NONE = np.zeros((0, 0))


def _bodies(model: Model, scene: Scene, arrays: Arrays) -> BodiesState:
    """Return the state of the loop `kernels.oracle.bodies`, both bodies at rest."""
    rotor, casing = (int(body.starts[-1]) for body in (arrays.rotor, arrays.casing))
    gaps = model.clearances(scene.gap)
    return BodiesState(
        np.zeros(rotor), np.zeros(rotor), np.zeros(casing), np.zeros(casing),
        np.zeros(rotor), np.zeros(max(casing, 1)), gaps, gaps.copy(),
        *nothing_yet(model.contacts), unworn(scene),
    )  # fmt: skip


@dataclass(frozen=True)
class Coordinates:
    """Relation of a body's displacements x to the coordinates y in a kernel's state.

    Attributes
    ----------
    steps : conversion between velocities and increments of y
    lift : (n, m), x = lift y + still, displacements for unit y
    lower : function that returns the matrix (m, n) with y = lower (x - still)
    still : (n,), m, circle x_s of an unbalanced rotor, see `case.unbalance`; else 0
    whole : whether the state has x itself instead of y
    """

    steps: Steps
    lift: Floats
    lower: Callable[[], Floats]
    still: Floats
    whole: bool = False

    def read(self, q: Floats, d: Floats, time: float) -> tuple[Floats, Floats]:
        """Return displacements x and velocities, (n,) each, of a body from a state.

        q, d : the state's coordinates of the body, and their increments in the last
            step
        time : s, of the state
        """
        size = self.lift.shape[1]
        y = q[:size] - self.still if self.whole else q[:size]
        rate = self.steps.velocities(y, d[:size], time)
        return self.lift @ y + self.still, self.lift @ rate

    def write(
        self, x: Floats, v: Floats, q: Floats, d: Floats, time: float = 0.0
    ) -> Floats:
        """Write a body's motion into a state; return its displacements a step earlier.

        They are (n,), m.

        x, v : (n,), displacements, m, and velocities, m/s
        q, d : out: the state's coordinates of the body, and their increments in the
            last step
        time : s, of x
        """
        lower = self.lower()
        y = lower @ (x - self.still)
        rise, size = self.steps.increments(y, lower @ v, time), len(y)
        q[:size], d[:size] = y + self.still if self.whole else y, rise
        return np.asarray(x - self.lift @ rise)


def modal_coordinates(body: ModalModel | None, step: float) -> Coordinates:
    """Return how a body's state, its modal amplitudes, gives its displacements.

    The result also converts velocities into the increments that the state has.

    Parameters
    ----------
    body : modes without terms of rotation; None for a rigid casing, which has none
    step : dt, s, of the time integration
    """
    steps = modal_steps(body, step)
    if body is None:
        return Coordinates(steps, NONE, lambda: NONE, np.zeros(0))
    shapes = body.shapes
    lower = partial(lowering, body, shapes)
    return Coordinates(steps, shapes, lower, np.zeros(len(shapes)))


def dense_coordinates(body: Body, still: Floats, step: float) -> Coordinates:
    """Return the relation of a body's displacements to a state that has them itself.

    The other relation is that to modal amplitudes, `modal_coordinates`.

    body, step : the kernel's matrices of the body; dt, s
    still : (n,), m, circle x_s of an unbalanced rotor, see `case.unbalance`; else 0
    """
    size = len(still)
    keep, pull = (whole(part)[:size, :size] for part in (body.keep, body.pull))
    same = np.eye(size)
    steps = steps_on(body.stand, CentralSteps(keep, pull, step))
    return Coordinates(steps, same, lambda: same, still, whole=True)


class TwoBodies(Integrator):
    """Integrator of rotor and casing by the time loop `kernels.oracle.bodies`.

    held : how displacements of rotor and casing relate to the coordinates in the state;
        None: these are modal amplitudes
    """

    kernel = staticmethod(march_bodies)

    def __init__(
        self,
        model: Model,
        scene: Scene,
        arrays: Arrays,
        held: tuple[Coordinates, Coordinates] | None = None,
    ) -> None:
        super().__init__(model, scene, arrays, _bodies(model, scene, arrays))
        self.casing_width = int(arrays.casing.starts[-1])
        step = scene.solver.time_step
        each = (modal_coordinates(body, step) for body in (model.rotor, model.casing))
        self.held = held or (next(each), next(each))

    def friction(self, speed: float) -> float:
        """Return the friction at a speed, rad/s, as `refresh` has it."""
        return friction_with_sign(self.scene, speed)

    def balance(self, state: BodiesState) -> Balance:
        """Return energy and damping loss in a state, which complete the ledger."""
        step, (_, rotor, casing, _) = self.scene.solver.time_step, self.arrays
        energy = sum(energies_of(rotor, casing, state, step))
        return Balance(energy, float(state.loss_b.sum() + state.loss_c.sum()))

    def motion(self, state: BodiesState, steps: int) -> Motion:
        """Return displacements and velocities of rotor and casing in a given state.

        steps : number of time steps taken so far
        """
        time = steps * self.scene.solver.time_step
        casing = self.held[1].read(state.q_c, state.d_c, time)
        return Motion(*self.of_rotor(state.q_b, state.d_b, time), *casing)

    def rotors(self, kept: Floats, steps: Integers) -> tuple[Floats, Floats]:
        """Return displacements and velocities of the rotor in kept states, (n, ...).

        kept, steps : as for `Integrator.rotors`
        """
        times = (self.scene.solver.time_step * steps).tolist()
        each = zip(*np.split(kept, 2, axis=1), times, strict=True)
        x, v = zip(*(self.of_rotor(*one) for one in each), strict=True)
        return np.array(x), np.array(v)

    def of_rotor(self, q: Floats, d: Floats, time: float) -> tuple[Floats, Floats]:
        """Return displacements and velocities of the rotor, (n,) each.

        q, d, time : its coordinates in a state, and their increments; s, of the state
        """
        return self.held[0].read(q, d, time)

    def with_rotor(self, row: Floats) -> BodiesState:
        """Return a state with the rotor's part of a kept one, see `Integrator`."""
        state: BodiesState = self.state
        q, d = np.split(row, [len(state.q_b)])
        return state._replace(q_b=q, d_b=d)

    @property
    def kept_width(self) -> int:
        """Number of values of the rotor's part of a state."""
        return 2 * len(self.state.q_b)

    def begin(self, motion: Motion) -> bool:
        """Set the state to a given motion, from which the run starts; return True.

        The run starts at the rotor's angle 0. Other integrators return False if they
        cannot represent the motion.
        """
        model, scene, state, (b, c) = self.model, self.scene, self.state, self.held
        check_sizes(model, motion)
        x, v, y, w, _ = motion
        back = -scene.speed * scene.solver.time_step
        places, rate = self.aside(0.0)
        own = b.write(x - places, v - rate, state.q_b, state.d_b)
        was = own + places, c.write(y, w, state.q_c, state.d_c)
        state.gaps[:] = gaps_of(model, scene.gap, x, y, 0.0)
        state.older[:] = gaps_of(model, scene.gap, *was, back)
        state.ledger[:] = 0.0
        state.ledger[PULSE] = self.balance(state).energy
        return True

    def put_on_circle(self, own: Floats, rises: Floats) -> None:
        """Set the state so that an unbalanced rotor starts on its circle.

        The circle, the motion without contact, may have to be scaled down at the start,
        see `case.unbalance`, and in a journal bearing it is one of the linearised film.
        The energy of the motion about it is entered in the ledger as work of the
        loading.

        own, rises : (m,), the rotor's coordinates at time 0, and their increments in
            the step before. The state's further coordinates, which represent the circle
            (`dynamics.bodies.turning`), are set here, too
        """
        model, scene, state, m = self.model, self.scene, self.state, len(own)
        outward = steady_start(model, scene)[0][model.places[0]]
        state.q_b[:m], state.d_b[:m] = own, rises
        if m < len(state.q_b):
            state.q_b[m:], state.d_b[m:] = amplitudes_at(0, model, scene)
        for gaps in (state.gaps, state.older):
            gaps[:] = model.clearances(scene.gap) - outward
        state.ledger[PULSE] = self.balance(state).energy

    def carry(self, old: Integrator, steps: int) -> None:
        """Continue the motion of the rotor before it lost a blade.

        old, steps : as for `Integrator.carry`
        """
        if not isinstance(old, TwoBodies):
            raise TypeError(old)
        state, was = self.state, old.state
        whole = "q_c", "d_c", "loss_c", "gaps", "older", "last", "counter", "ledger"
        for name in (*whole, "impulse", "worn"):
            getattr(state, name)[:] = getattr(was, name)
        state.loss_b[:], state.loss_b[0] = 0.0, was.loss_b.sum()
        self.go_on(old, steps)
        state.ledger[PULSE] += self.balance(state).energy - old.balance(was).energy

    def go_on(self, old: TwoBodies, steps: int) -> None:
        """Write the rotor's motion in another integrator's state into that of this.

        old, steps : as for `Integrator.carry`
        """
        state, size = self.state, self.held[0].lift.shape[1]
        time = steps * self.scene.solver.time_step
        motion = after_loss(self.model, old.motion(old.state, steps))
        places, rate = self.aside(time)
        x, v = motion.rotor - places, motion.rotor_velocity - rate
        self.held[0].write(x, v, state.q_b, state.d_b, time)
        if size < len(state.q_b):
            circling = amplitudes_at(steps, self.model, self.scene)
            state.q_b[size:], state.d_b[size:] = circling

    def aside(self, _: float) -> tuple[Floats, Floats]:
        """Return the motion at a time, s, that further coordinates of the state have.

        It is a displacement, m, and a velocity, m/s, of the rotor, (n,) each.
        """
        none = np.zeros(len(self.model.rotor.shapes))
        return none, none

    def refresh(self, _: BodiesState | None, now: Interval) -> None:
        """Change the compliances of contact to the friction of an interval's speed.

        now : interval that begins, in which the speed is taken as constant
        """
        scene = self.scene
        if scene.friction_law == "constant" and scene.slip == PERMANENT:
            return  # the speed keeps its sign
        model, step, contact = self.model, self.scene.solver.time_step, self.arrays[3]
        mu = friction_with_sign(self.scene, now.speed)
        contact.compliance[:] = ring_compliance(model, step, mu)
        if model.rotor.spin is None:
            contact.w_rotor[:] = rotor_compliance(model, self.scene, mu)

    def release(self, state: BodiesState, shape: HeldShape, _: int) -> None:
        """Let go of a casing held in a shape: add the shape to a state's motion."""
        body, casing = self.model.casing, self.held[1]
        if body is None:
            raise TypeError(body)
        q = shape.amplitudes(body.omega, body.shapes)
        y = body.shapes @ q if casing.whole else q
        state.q_c[: len(y)] += y
        state.d_c[: len(y)] += casing.steps.increments(y, 0.0 * y)
