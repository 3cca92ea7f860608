"""Base of the integrators in the rotating frame, with the ring by nodal diameter.

A kernel leaves the contact forces of each step pending in the state until it begins the
next step. So a motion is read from copies in which these forces have been applied. A
motion is written to a state at time 0, where nothing may be pending: the increment
before the last is set to the opposite of the last one, since dissipation and works of a
step depend on their sum.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from hpcwhirl.arrays import Floats
from hpcwhirl.case.speed import Interval, angle_at
from hpcwhirl.case.unbalance import circle
from hpcwhirl.dynamics.kernels import contact, passes
from hpcwhirl.dynamics.kernels.circulant import folded
from hpcwhirl.dynamics.kernels.cyclic import widths
from hpcwhirl.dynamics.kernels.differences import CENTRAL, Central
from hpcwhirl.dynamics.kernels.flow import Exact
from hpcwhirl.dynamics.kernels.kernel_types import Arrays, CyclicState
from hpcwhirl.dynamics.kernels.stepping import column_sums, energies_of
from hpcwhirl.dynamics.kernels.wave_types import WaveRotor
from hpcwhirl.dynamics.motion import (
    Amplitudes,
    Motion,
    Steps,
    amplitudes,
    gaps_of,
    lowering,
    modal_steps,
)
from hpcwhirl.dynamics.operators import friction_with_sign
from hpcwhirl.dynamics.schemes.integrator import Balance, Integrator, at_rest, unfold
from hpcwhirl.dynamics.slots import ring_amplitudes, ring_slots, ring_turned, turn_ring
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene

Ended = tuple[Floats, Floats, Floats, Floats]  # see `RotatingFrame.ended`


class RotorPlaces(Protocol):
    """Conversion of a rotor's motion between a kernel's state and modal amplitudes.

    The m modes are those at Omega = 0, whatever coordinates the state has.
    """

    def read(self, state: Floats, odd: int) -> tuple[Floats, Floats]:
        """Return the rotor's modal amplitudes and velocities, (m,) each, from a state.

        The modes are those at Omega = 0.

        state : the rotor's part of the kernel's state, with no contact forces pending
        odd : 1 if the number of steps so far is odd, else 0
        """

    def write(self, state: Floats, q: Floats, rate: Floats) -> Floats:
        """Write a motion of the rotor at time 0 into a state.

        Return the modal amplitudes a step earlier, (m,), from which the earlier gaps
        follow.

        state : out, the rotor's part of the kernel's state
        q, rate : (m,), amplitudes of the modes at Omega = 0, and their velocities
        """


@dataclass(frozen=True)
class ModePlaces:
    """Conversion between modal amplitudes in a kernel's state and a rotor's motion.

    The rotor's part of the state is three arrays: amplitudes, then increments of the
    last even and of the last odd step.

    steps : conversion between velocities and increments of the modes
    apart, joined : functions from one of these arrays to the m modes, (m,), and back
    """

    steps: Steps
    apart: Callable[[Floats], Floats]
    joined: Callable[[Floats], Floats]

    def read(self, state: Floats, odd: int) -> tuple[Floats, Floats]:
        """Return the rotor's modal amplitudes and velocities, (m,) each, from a state.

        The modes are those at Omega = 0.

        state : the rotor's part of the kernel's state, with no contact forces pending
        odd : 1 if the number of steps so far is odd, else 0
        """
        q, d = map(self.apart, _held(state, passes.ROTOR_STATE, odd))
        return q, self.steps.velocities(q, d)

    def write(self, state: Floats, q: Floats, rate: Floats) -> Floats:
        """Write a motion of the rotor at time 0 into a state.

        Return the modal amplitudes a step earlier, (m,), from which the earlier gaps
        follow.

        state : out, the rotor's part of the kernel's state
        q, rate : (m,), amplitudes of the modes at Omega = 0, and their velocities
        """
        d = self.steps.increments(q, rate)
        new = self.joined(d)
        state[:] = np.concatenate([self.joined(q), new, -new])
        return q - d


@dataclass(frozen=True)
class RingPlaces:
    """Conversion of a ring's motion between a kernel's state and modal amplitudes.

    The state has complex amplitudes of the ring's harmonics in the rotating frame, in
    slots, one for each nodal diameter; the modal amplitudes are in the static frame.

    items : coefficients of the ring's modes in a step, packed, see `kernels.passes`
    """

    model: Model
    scene: Scene
    items: Floats

    @property
    def steps(self) -> Steps:
        """Conversion between velocities and increments of the ring's modes."""
        solver = self.scene.solver
        return modal_steps(self.model.casing, solver.time_step, exact=solver.flies)

    def read(self, state: Floats, count: int) -> tuple[Floats, Floats]:
        """Return the ring's modal amplitudes and velocities, (n,) each, from a state.

        They are in the static frame.

        state : the ring's part of the kernel's state, with no contact forces pending
        count : number of steps so far
        """
        if self.model.casing is None:
            return np.zeros(0), np.zeros(0)
        held = np.stack(_held(state, passes.RING_STATE // 2, count & 1))
        angle = float(angle_at(self.scene, count, self.scene.solver.time_step))
        q, d = ring_amplitudes(self.model, held, np.array([angle, angle]))
        return q, self.steps.velocities(q, d)

    def write(self, state: Floats, q: Floats, rate: Floats) -> Floats:
        """Write a motion of the ring at time 0 into a state.

        Return the modal amplitudes a step earlier, (n,), from which the earlier gaps
        follow.

        state : out, the ring's part of the kernel's state
        q, rate : (n,), modal amplitudes and their velocities, static frame
        """
        if self.model.casing is None:
            return q
        d = self.steps.increments(q, rate)
        k, size = widths(self.model.blades)[0], len(state) // passes.RING_STATE
        now, new = (ring_slots(self.model, part, size // k) for part in (q, d))
        items = passes.unpacked(self.items)
        turn = items[passes.TURN_RE] + 1j * items[passes.TURN_IM]
        there = turn != 0.0
        old = -(new[:size] + 1j * new[size:]) / np.where(there, turn, 1.0)
        state[:] = np.concatenate([now, new, old.real, old.imag])
        return q - d

    def add(self, state: Floats, q: Floats, count: int) -> None:
        """Add a displacement of the ring, without velocity, to a kernel's state.

        The previous increments are changed oppositely, so that the works of the pending
        step, which depend on the sum of both, stay the same.

        state : in and out, the ring's part of the kernel's state
        q, count : (n,), modal amplitudes to add, static frame; number of steps so far
        """
        step, other = self.scene.solver.time_step, np.zeros_like(state)
        angle = float(angle_at(self.scene, count, step))
        self.write(other, ring_turned(self.model, q, angle), np.zeros_like(q))
        parts = other.reshape(3, -1)
        state += parts[[0, 2, 1] if count & 1 else [0, 1, 2]].ravel()


def _held(state: Floats, parts: int, odd: int) -> tuple[Floats, Floats]:
    """Return a body's amplitudes, and their increments in the last step, from a state.

    parts : number of equal arrays in the body's part of the state: amplitudes, then
        increments of the last even and of the last odd step
    odd : 1 if the last step's number is odd, else 0
    """
    size = len(state) // parts
    return state[:size], state[(1 + odd) * size : (2 + odd) * size]


def write_gaps(
    state: CyclicState, model: Model, scene: Scene, now: Amplitudes, before: Amplitudes
) -> None:
    """Compute the gaps at time 0 and a step earlier, and write them into a state.

    now, before : modal amplitudes of both bodies at time 0 and at time -dt, for the
        model of all sectors or of one
    """
    rows = state.gaps.reshape(3, -1)
    chosen = folded(model.blades, widths(model.blades)[1])
    back = -scene.speed * scene.solver.time_step
    rows[:] = scene.gap
    for row, found, angle in ((0, now, 0.0), (2, before, back)):
        rotor, casing = model.rotor.shapes @ found.rotor, found.casing
        if model.casing is not None:
            casing = model.casing.shapes @ casing
        rows[row] = gaps_of(model, scene.gap, rotor, casing, angle)[chosen]


def nothing_booked(state: CyclicState, *, exact: bool) -> None:
    """Set multipliers, works, losses and impulses in a state to 0, for a new start.

    exact : whether the kernel is that of the exact flow: its state is then marked as
        one without pending step
    """
    for part in (state.lam, state.sums_b, state.sums_c, state.ledger, state.impulse):
        part[:] = 0.0
    if exact:
        state.counter[contact.ENDED] = 0


class RotatingFrame(Integrator):
    """Integrator of a kernel in the rotating frame, with the ring by nodal diameter.

    Attributes
    ----------
    rotor, ring : conversions of the two bodies' motions between state and modal
        amplitudes
    way : how the kernel completes a step: by central differences or the exact flow
    places : (n,), m, displacement of an unbalanced rotor on its circle; None if
        balanced
    """

    way: Central | Exact = CENTRAL

    def __init__(
        self,
        model: Model,
        scene: Scene,
        arrays: Arrays,
        sizes: tuple[int, int, int],
        rotor: RotorPlaces,
    ) -> None:
        ring = passes.RING_STATE * (len(arrays.casing.items) // passes.ITEMS)
        of_rotor, lam, sums = sizes  # lengths of the state's arrays
        state = at_rest(model.blades, scene.gap, (of_rotor, ring, lam, sums))
        super().__init__(model, scene, arrays, state)
        self.kernel, self.casing_width = self._kernel(), ring // 3
        self.rotor, self.ring = rotor, RingPlaces(model, scene, arrays.casing.items)
        self.places = circle(model, scene)

    @abstractmethod
    def _kernel(self) -> Any:
        """Return the compiled time loop, bound to work arrays of its own."""

    @abstractmethod
    def _settle(self, state: CyclicState, copies: Ended) -> None:
        """Apply a state's pending contact forces, and write the result to copies.

        copies : out: motion of rotor and ring; in and out: their sums of works and
            losses
        """

    def ended(self, state: CyclicState) -> Ended:
        """Return a state's motion and sums after its pending contact forces.

        Returns
        -------
        copies of the state's arrays (rotor, ring, sums_b, sums_c) with these forces
        applied
        """
        copies = (
            np.zeros_like(state.rotor), np.zeros_like(state.ring),
            state.sums_b.copy(), state.sums_c.copy(),
        )  # fmt: skip
        self._settle(state, copies)
        return copies

    def balance(self, state: CyclicState) -> Balance:
        """Return energies, losses and works in a state, which complete the ledger."""
        s_b, s_c, sums_b, sums_c = self.ended(state)
        step, rotor = self.scene.solver.time_step, self.arrays.rotor
        odd, c_c = int(state.counter[contact.STEP] & 1), self.arrays.casing.items
        energies = energies_of(rotor, self.way, s_b, s_c, c_c, odd, step)
        rotation, impact, drag, loss = column_sums(self.way, sums_b, sums_c, step)
        if isinstance(rotor, WaveRotor):
            loss -= energies[0]  # the sum is what contact has added to energy and loss
        friction = friction_with_sign(self.scene)
        return Balance(sum(energies), loss, rotation, friction * drag, impact)

    def motion(self, state: CyclicState, steps: int) -> Motion:
        """Return displacements and velocities of rotor and casing in a given state.

        They are those of all sectors, with the circle of an unbalanced rotor.

        steps : number of time steps taken so far, from which the angle of the rotor
            follows
        """
        s_b, s_c, _, _ = self.ended(state)
        now = *self.rotor.read(s_b, steps & 1), *self.ring.read(s_c, steps)
        return unfold(self.model, Amplitudes(*now), self.places)

    def begin(self, motion: Motion) -> bool:
        """Start from a given motion; return whether the state can represent it."""
        model, scene, state = self.model, self.scene, self.state
        now = amplitudes(model, motion)
        if now is None:
            return False
        still = np.zeros(len(now.rotor))
        if self.places is not None:
            still = model.rotor.shapes.T @ (model.rotor.mass @ self.places)
        nothing_booked(state, exact=scene.solver.flies)
        before = self.rotor.write(state.rotor, now.rotor - still, now.rotor_rate)
        casing = self.ring.write(state.ring, now.casing, now.casing_rate)
        seen = [now, now._replace(rotor=before + still, casing=casing)]
        write_gaps(state, model, scene, *seen)
        begun = self.balance(state)
        state.ledger[contact.PULSE] = begun.energy
        # for waves: their loss is the energy given to them less the energy they have
        state.sums_b[2 * len(state.sums_b) // 3] -= begun.damping
        return True

    def release(self, state: CyclicState, places: Floats, steps: int) -> None:
        """Let go of a casing held in a shape: add the shape to a state's motion.

        state, places, steps : as for `Integrator.release`
        """
        body = self.model.casing
        if body is None:
            raise TypeError(body)
        lower = lowering(body, self.model.shapes[1])
        self.ring.add(state.ring, lower @ places, steps)

    def refresh(self, state: CyclicState | None, now: Interval) -> None:
        """Change the kernel's coefficients of the ring to those of a new speed.

        state : state of the run, adapted to the new speed; None: only coefficients are
            changed
        now : interval that begins, in which the speed is taken as constant
        """
        items, turn = self.arrays.casing.items, self.model.folds * now.turn
        turn_ring(self.model, self.scene, items, state, turn)

    def _static(self, copies: Floats, stride: int) -> Floats:
        if not len(copies):
            return copies
        steps = stride * np.arange(1.0, len(copies) + 1)
        angles = np.asarray(angle_at(self.scene, steps, self.scene.solver.time_step))
        return ring_amplitudes(self.model, copies, angles)
