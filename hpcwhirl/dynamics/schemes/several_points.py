"""Integrator of rotor and casing as waves, with one or several points a tip."""

from __future__ import annotations

from functools import cached_property
from typing import Any, cast

import numpy as np

from hpcwhirl.arrays import Floats, Integers
from hpcwhirl.case.profile import HeldShape
from hpcwhirl.case.speed import Interval, angle_at, law_of
from hpcwhirl.case.unbalance import (
    missing_at_start,
    share_at_start,
    steady_at,
    steady_rates,
)
from hpcwhirl.dynamics.bodies.motion import (
    Amplitudes,
    Motion,
    after_loss,
    amplitudes,
)
from hpcwhirl.dynamics.bodies.turning import added_by, included_in
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.kernels.kernel_types import CyclicState
from hpcwhirl.dynamics.kernels.loop.bounded import energies_of_points, points_space
from hpcwhirl.dynamics.kernels.loop.circulant import folded
from hpcwhirl.dynamics.kernels.loop.points import march_points
from hpcwhirl.dynamics.kernels.loop.whole import HELD
from hpcwhirl.dynamics.kernels.vectors import aligned_zeros, widths
from hpcwhirl.dynamics.schemes.integrator import (
    Balance,
    Integrator,
    at_rest,
    nothing_booked,
    unfold,
    with_space,
)
from hpcwhirl.dynamics.waves.free_motion import FreeMotion
from hpcwhirl.dynamics.waves.free_waves import free_points
from hpcwhirl.dynamics.waves.point_arrays import TurningCasing, point_arrays
from hpcwhirl.dynamics.waves.point_waves import PointWaves, point_waves
from hpcwhirl.dynamics.waves.slots import ring_turned
from hpcwhirl.dynamics.waves.whole_waves import padded_blades
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene
from hpcwhirl.structure import RingOperator


def points_apart(model: Model, scene: Scene) -> Integrator | None:
    """Return the integrator of rotor and casing as waves, or None.

    None for a ring of elements, which is not the same at every angle; for the model of
    one of several sectors; for a rotor with terms of rotation whose speed changes; and
    where two waves nearly coincide.
    """
    driven = model.rotor.spin is not None and law_of(scene) is not None
    if isinstance(model.ring, RingOperator) or model.folds > 1 or driven:
        return None
    waves = point_waves(model, scene)
    return None if waves is None else BothAsWaves(model, scene, waves)


class BothAsWaves(Integrator):
    """Integrator of waves of rotor and casing, for one or several points a tip.

    The state has the amplitudes of both bodies' waves in the rotating frame, and those
    of the steady motion of an unbalanced rotor.

    Attributes
    ----------
    reads : how the waves move the contact points, and forces the waves
    waves : waves of both bodies, with their indices among the state's amplitudes
    """

    def __init__(self, model: Model, scene: Scene, waves: PointWaves) -> None:
        arrays, self.reads = point_arrays(model, scene, waves)
        self.waves, points = self.reads.waves, model.contacts
        sizes = 2 * self.waves.half, 0, HELD * padded_blades(points), 3
        state = at_rest(points, scene, sizes)
        chosen = folded(points, widths(points)[1])
        state.gaps.reshape(3, -1)[:] = model.clearances(scene.gap)[chosen]
        super().__init__(model, scene, arrays, state)
        march = cast(Any, march_points)
        self.kernel = with_space(march, lambda: points_space(arrays, state))
        self.casing_width = len(arrays.rotor.casing)
        state.rotor[self.waves.apart[2]] = 1.0
        if len(self.waves.apart[2]):
            self._put_on_circle()

    def _put_on_circle(self) -> None:
        """Set the state so that an unbalanced rotor starts on its circle.

        If the run must start on a smaller circle, the other waves begin with the
        difference, at rest, and their energy is entered in the ledger as work of the
        loading.
        """
        share, state = share_at_start(self.model, self.scene), self.state
        lower = self.model.rotor.shapes.T @ self.model.rotor.mass
        places, rates = missing_at_start(self.model, self.scene)
        self._write(lower @ places, lower @ rates)
        if share < 1.0:
            state.sums_b[2] = state.ledger[contact.PULSE] = self.balance(state).energy

    def _steady(self) -> tuple[Floats, Floats]:
        """Return the steady motion at time 0, in modes at rest, (m,) each.

        It is 0 for a balanced rotor.
        """
        model, scene = self.model, self.scene
        if not len(self.waves.apart[2]):
            none = np.zeros(len(model.rotor.omega))
            return none, none
        lower = model.rotor.shapes.T @ model.rotor.mass
        places = steady_at(model, scene, 0.0)
        return lower @ places, lower @ steady_rates(model, scene, 0.0)

    def _write(self, q: Floats, rate: Floats, time: float = 0.0) -> None:
        """Write the motion that contact causes of the rotor into the state.

        q, rate : (m,), amplitudes of the modes at rest, and their velocities
        time : s, at which the directions of the supports are taken
        """
        stand = self.arrays.rotor.support.stand
        if len(stand.hub):
            rate = rate - included_in(stand, q, rate, self.scene.speed * time)
        self.state.rotor[self.waves.places()[0]] = self.waves.rotor.motion.write(
            q, rate
        )

    def _of_rotor(self, state: CyclicState, steps: int) -> tuple[Floats, Floats]:
        """Return the rotor's modal amplitudes and velocities, (m,) each, in a state.

        steps : number of time steps taken so far
        """
        q, rate = self._modes_of_rotor(state.rotor[None], np.array([steps]))
        return q[0], rate[0]

    def _modes_of_rotor(self, rows: Floats, steps: Integers) -> tuple[Floats, Floats]:
        """Return the rotor's modal amplitudes and velocities, (n, m), in n states.

        rows, steps : (n, 2 half), amplitudes of the waves; (n,), steps taken until each
        """
        body, steady, turned = self.waves.rotor, self.waves.steady, self.waves.apart[2]
        own = np.ascontiguousarray(rows[:, self.waves.places()[0]])  # else other bits
        q, rate = body.motion.read(own)
        stand, angles = self.arrays.rotor.support.stand, self.scene.speed * body.step
        if len(stand.hub):
            each = zip(q, rate, (angles * steps).tolist(), strict=True)
            rate = rate + np.array([added_by(stand, *one) for one in each])
        a = rows[:, turned] + 1j * rows[:, self.waves.half + turned]
        a = np.ascontiguousarray(a)[..., None]
        moved = ((part @ a)[..., 0].real for part in (steady.shapes, steady.rates))
        return q + next(moved), rate + next(moved)

    def rotors(self, kept: Floats, steps: Integers) -> tuple[Floats, Floats]:
        """Return displacements and velocities of the rotor in kept states, (n, ...).

        kept, steps : as for `Integrator.rotors`
        """
        q, rate = self._modes_of_rotor(kept, steps)
        lift = self.model.shapes[0]
        return (lift @ q[..., None])[..., 0], (lift @ rate[..., None])[..., 0]

    def balance(self, state: CyclicState) -> Balance:
        """Return energies, losses and works in a state, which complete the ledger."""
        work = aligned_zeros(len(state.rotor))[0]
        energy = sum(energies_of_points(self.arrays.rotor, state.rotor, work))
        normal, drag, given = state.sums_b
        return Balance(energy, given - energy, normal / 2, drag / 2)

    def motion(self, state: CyclicState, steps: int) -> Motion:
        """Return displacements and velocities of rotor and casing in a given state.

        steps : number of time steps taken so far, from which the angle of the rotor
            follows
        """
        casing = self.waves.casing.motion.read(state.rotor[self.waves.places()[1]])
        angle = -self._angle(steps)
        still = (ring_turned(self.model, part, angle) for part in casing)
        rotor = self._of_rotor(state, steps)
        return unfold(self.model, Amplitudes(*rotor, *still))

    def _angle(self, steps: int) -> float:
        return float(angle_at(self.scene, steps, self.scene.solver.time_step))

    def begin(self, motion: Motion) -> bool:
        """Start from a given motion; return whether the state can represent it."""
        now, state = amplitudes(self.model, motion), self.state
        if now is None:
            return False
        nothing_booked(state, exact=False)
        beside = self.waves.places()[1]
        still, rate = self._steady()
        self._write(now.rotor - still, now.rotor_rate - rate)
        if len(beside):
            given = now.casing, now.casing_rate
            state.rotor[beside] = self.waves.casing.motion.write(*given)
        energy = self.balance(state).energy
        state.ledger[contact.PULSE] = state.sums_b[2] = energy
        return True

    def free(self) -> FreeMotion | None:
        """Return the waves in free motion; None if supports exert forces at the centre.

        Such supports differ by direction or have a film: waves of the rotor without
        them do not move by factors.
        """
        if len(self.arrays.rotor.support.which):
            return None
        return free_points(self.reads)

    def carry(self, old: Integrator, steps: int) -> None:
        """Continue the motion of the rotor before it lost a blade.

        old, steps : as for `Integrator.carry`
        """
        if not isinstance(old, BothAsWaves):
            raise TypeError(old)
        state, was = self.state, old.state
        whole = "lam", "gaps", "sums_b", "last", "counter", "ledger", "impulse"
        for name in (*whole, "worn", "entered"):
            getattr(state, name)[:] = getattr(was, name)
        beside, before = self.waves.places()[1], old.waves.places()[1]
        if len(beside):
            parts = old.waves.casing.motion.read(was.rotor[before])
            state.rotor[beside] = self.waves.casing.motion.write(*parts)
        self._go_on(after_loss(self.model, old.motion(was, steps)), steps)
        gained = self.balance(state).energy - old.balance(was).energy
        state.sums_b[2] += gained
        state.ledger[contact.PULSE] += gained
        self._change_gaps(state)

    def _go_on(self, motion: Motion, steps: int) -> None:
        """Write a motion of the rotor into the state, with the steady one at a step."""
        model, scene, state = self.model, self.scene, self.state
        step, turned = scene.solver.time_step, self.waves.apart[2]
        lower, time = model.rotor.shapes.T @ model.rotor.mass, steps * step
        phase = np.exp(1j * steps * np.angle(1.0 + self.waves.steady.ahead))
        state.rotor[turned] = phase.real
        state.rotor[self.waves.half + turned] = phase.imag
        q = lower @ (motion.rotor - steady_at(model, scene, time))
        rate = lower @ (motion.rotor_velocity - steady_rates(model, scene, time))
        self._write(q, rate, time)

    @cached_property
    def _turning(self) -> TurningCasing:
        return TurningCasing(self.arrays.rotor, self.arrays.contact.slides, self.reads)

    def refresh(self, state: CyclicState | None, now: Interval) -> None:
        """Change the casing's coefficients to those of a new interval of the speed.

        The meaning of the amplitudes stays.

        state, now : as for `Integrator.refresh`
        """
        if law_of(self.scene) is None:
            return
        self._turning.set(now.turn * self.scene.solver.time_step)
        if state is not None:
            self._change_gaps(state)

    @staticmethod
    def _change_gaps(state: CyclicState) -> None:
        """Mark the contacts of the last steps: gaps before follow from no coefficient.

        See `held` of `book_points`.
        """
        padded = len(state.lam) // HELD
        state.lam[padded:] = -np.abs(state.lam[padded:])

    def release(self, state: CyclicState, shape: HeldShape, steps: int) -> None:
        """Let go of a casing held in a shape: add the shape to a state's motion.

        The gaps of the last two steps, which include the shape, are those of an
        undeformed casing afterwards, since the amplitudes have it.

        state, shape, steps : as for `Integrator.release`
        """
        body, model = self.model.casing, self.model
        if body is None:
            raise TypeError(body)
        q = shape.amplitudes(body.omega, model.shapes[1])
        before = self.balance(state).energy
        turned = ring_turned(model, q, self._angle(steps))
        gained = self.waves.casing.motion.write(turned, 0.0 * q)
        state.rotor[self.waves.places()[1]] += gained
        state.sums_b[2] += self.balance(state).energy - before
        self._change_gaps(state)
        chosen = folded(model.contacts, widths(model.contacts)[1])
        rows = state.gaps.reshape(3, -1)
        for step in (steps - 1, steps):
            angle = self._angle(step)
            outward = self.reads.w @ ring_turned(model, q, angle)
            rows[step % 3] -= outward[chosen]

    def _static(self, copies: Floats, stride: int) -> Floats:
        steps = stride * np.arange(1.0, len(copies) + 1)
        angles = -np.asarray(angle_at(self.scene, steps, self.scene.solver.time_step))
        return ring_turned(self.model, copies, angles)
