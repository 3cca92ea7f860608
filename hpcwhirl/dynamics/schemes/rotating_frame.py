"""Integrators of kernels in the rotating frame, with the ring by nodal diameter."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from hpcwhirl.arrays import Floats
from hpcwhirl.case.speed import angle_at
from hpcwhirl.case.unbalance import circle
from hpcwhirl.dynamics.casing_trace import waves_of_modes
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.kernels.kernel_types import Arrays, CyclicState
from hpcwhirl.dynamics.kernels.wave_types import (
    UncoupledRotor,
    WaveRotor,
    WholeRotor,
)
from hpcwhirl.dynamics.motion import Amplitudes, Motion, amplitudes, lowering
from hpcwhirl.dynamics.operators import friction_with_sign
from hpcwhirl.dynamics.schemes.integrator import (
    Balance,
    Ended,
    Integrator,
    reader,
    unfold,
    with_space,
)
from hpcwhirl.dynamics.schemes.places import (
    RingPlaces,
    RotorPlaces,
    nothing_booked,
    write_gaps,
)
from hpcwhirl.dynamics.slots import ring_amplitudes, turn_ring
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene
from hpcwhirl.scene.schemes import SCHEMES


class Rotating(NamedTuple):
    """A kernel in the rotating frame, and the functions that read its states.

    Attributes
    ----------
    march, space : the kernel, and a function that makes its last argument
    settle : (state, copies) -> None; completes the state's pending step in copies of
        rotor, ring and their sums
    passes : module with the kernel's passes, `differences` or `flow`
    beside : whether the gaps in the state leave out the rotor's displacement
    """

    march: Any
    space: Callable[[], Any]
    settle: Callable[[CyclicState, Ended], None]
    passes: Any
    beside: bool = False

    def ended(self, state: CyclicState) -> Ended:
        """Return copies of rotor, ring and sums, with all contact forces applied."""
        copies = (
            np.zeros_like(state.rotor), np.zeros_like(state.ring),
            state.sums_b.copy(), state.sums_c.copy(),
        )  # fmt: skip
        self.settle(state, copies)
        return copies


def in_rotating_frame(
    model: Model,
    scene: Scene,
    arrays: Arrays,
    state: CyclicState,
    rotor: RotorPlaces,
    own: Rotating,
) -> Integrator:
    """Return the integrator of a kernel in the rotating frame.

    Parameters
    ----------
    model, scene : model and scene that are integrated
    arrays, state : constant arrays of the kernel; its state at rest
    rotor : layout of the rotor's motion in the state
    own : the kernel, and the functions that read its states
    """
    ring = RingPlaces(model, scene, arrays.casing.items)
    balance = _balance(arrays, scene, own)
    motion, begin = _motions(state, rotor, ring, own, balance)

    def release(state: CyclicState, places: Floats, steps: int) -> None:
        body = model.casing
        if body is None:
            raise TypeError(body)
        ring.add(state.ring, lowering(body, model.shapes[1]) @ places, steps)

    def read(copies: Floats, stride: int) -> Floats:
        steps = stride * np.arange(1.0, len(copies) + 1)
        angles = np.asarray(angle_at(scene, steps, scene.solver.time_step))
        return waves_of_modes(model, ring_amplitudes(model, copies, angles))

    return Integrator(
        kernel=with_space(own.march, own.space),
        arrays=arrays,
        state=state,
        balance=balance,
        motion=motion,
        begin=begin,
        casing_width=len(state.ring) // 3,
        casing_waves=reader(model, scene, read),
        release=release,
        ended=own.ended,
        refresh=lambda state, now: turn_ring(
            model, scene, arrays.casing.items, state, model.folds * now.turn
        ),
    )


def _balance(
    arrays: Arrays, scene: Scene, own: Rotating
) -> Callable[[CyclicState], Balance]:
    """Return a function from a kernel's state to the terms of its energy balance."""
    step, friction = scene.solver.time_step, friction_with_sign(scene)
    waves = isinstance(arrays.rotor, WaveRotor | WholeRotor | UncoupledRotor)

    def balance(state: CyclicState) -> Balance:
        s_b, s_c, sums_b, sums_c = own.ended(state)
        odd, c_c = int(state.counter[contact.STEP] & 1), arrays.casing.items
        energies = own.passes.energies_of(arrays.rotor, s_b, s_c, c_c, odd, step)
        rotation, impact, drag, loss = own.passes.column_sums(sums_b, sums_c, step)
        if waves:  # the sum is what contact has added to energy and loss
            loss -= energies[0]
        return Balance(sum(energies), loss, rotation, friction * drag, impact)

    return balance


def _motions(
    state: CyclicState,
    rotor: RotorPlaces,
    ring: RingPlaces,
    own: Rotating,
    balance: Callable[[CyclicState], Balance],
) -> tuple[Callable[[CyclicState, int], Motion], Callable[[Motion], bool]]:
    """Return functions that read a motion from a state, and set a state to one."""
    model, scene = ring.model, ring.scene
    exact, places = SCHEMES[scene.solver.scheme].flies, circle(model, scene)

    def motion(state: CyclicState, steps: int) -> Motion:
        s_b, s_c, _, _ = own.ended(state)
        now = *rotor.read(s_b, steps & 1), *ring.read(s_c, steps)
        return unfold(model, Amplitudes(*now), places)

    def begin(motion: Motion) -> bool:
        now = amplitudes(model, motion)
        if now is None:
            return False
        still = np.zeros(len(now.rotor))
        if places is not None:
            still = model.rotor.shapes.T @ (model.rotor.mass @ places)
        nothing_booked(state, exact=exact)
        before = rotor.write(state.rotor, now.rotor - still, now.rotor_rate)
        casing = ring.write(state.ring, now.casing, now.casing_rate)
        seen = [now, now._replace(rotor=before + still, casing=casing)]
        if own.beside:
            seen = [each._replace(rotor=0.0 * each.rotor) for each in seen]
        write_gaps(state, model, scene, *seen)
        begun = balance(state)
        state.ledger[contact.PULSE] = begun.energy
        # for waves: their loss is the energy given to them less the energy they have
        state.sums_b[2 * len(state.sums_b) // 3] -= begun.damping
        return True

    return motion, begin
