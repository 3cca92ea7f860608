"""Integrator of tips with several contact points each: waves of rotor and casing."""

from __future__ import annotations

from typing import Any, cast

import numpy as np

from hpcwhirl.arrays import Floats
from hpcwhirl.case.profile import NEVER, release_step
from hpcwhirl.case.speed import angle_at, law_of
from hpcwhirl.case.unbalance import circle
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.kernels.circulant import folded
from hpcwhirl.dynamics.kernels.cyclic import widths
from hpcwhirl.dynamics.kernels.kernel_types import CyclicState
from hpcwhirl.dynamics.kernels.points import (
    energies_of_points,
    march_points,
    points_space,
)
from hpcwhirl.dynamics.kernels.whole import HELD
from hpcwhirl.dynamics.motion import Amplitudes, Motion, amplitudes
from hpcwhirl.dynamics.operators import friction_with_sign
from hpcwhirl.dynamics.point_arrays import point_arrays
from hpcwhirl.dynamics.point_waves import PointWaves, point_waves, real_rows
from hpcwhirl.dynamics.schemes.integrator import (
    Balance,
    Integrator,
    at_rest,
    unfold,
    with_space,
)
from hpcwhirl.dynamics.schemes.rotating_frame import nothing_booked
from hpcwhirl.dynamics.slots import ring_turned
from hpcwhirl.dynamics.whole_waves import padded_blades
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene
from hpcwhirl.structure import RingOperator


def points_apart(model: Model, scene: Scene) -> Integrator | None:
    """Return the integrator of tips with several contact points, or None.

    It integrates waves of rotor and casing, which need matrices that are constant in
    the rotating frame: None for a ring of elements, supports that differ by direction
    or have a film, or a speed that changes. None also for an unbalance, for a casing
    that is let go, and where two waves nearly coincide.
    """
    spin = model.rotor.spin
    plain = spin is None or spin.support.is_plain
    steady = law_of(scene) is None and circle(model, scene) is None
    let_go = release_step(scene) != NEVER
    if isinstance(model.ring, RingOperator) or not plain or not steady or let_go:
        return None
    waves = point_waves(model, scene)
    return None if waves is None else _SeveralPoints(model, scene, waves)


class _SeveralPoints(Integrator):
    """Integrator of waves of rotor and casing, for several contact points a tip.

    The state has the amplitudes of both bodies' waves in the rotating frame.

    waves : waves of both bodies, with their indices among the state's amplitudes
    """

    def __init__(self, model: Model, scene: Scene, waves: PointWaves) -> None:
        arrays, self.waves = point_arrays(model, scene, waves)
        points = model.contacts
        sizes = 2 * self.waves.half, 0, HELD * padded_blades(points), 3
        state = at_rest(points, scene.gap, sizes)
        chosen = folded(points, widths(points)[1])
        state.gaps.reshape(3, -1)[:] = model.clearances(scene.gap)[chosen]
        super().__init__(model, scene, arrays, state)
        march = cast(Any, march_points)
        self.kernel = with_space(march, lambda: points_space(arrays, state))
        self.casing_width = len(arrays.rotor.casing)

    def balance(self, state: CyclicState) -> Balance:
        """Return energies, losses and works in a state, which complete the ledger."""
        energy = sum(energies_of_points(self.arrays.rotor, state.rotor))
        normal, drag, given = state.sums_b
        friction = friction_with_sign(self.scene)
        return Balance(energy, given - energy, normal / 2, friction * drag / 2)

    def motion(self, state: CyclicState, steps: int) -> Motion:
        """Return displacements and velocities of rotor and casing in a given state.

        steps : number of time steps taken so far, from which the angle of the rotor
            follows
        """
        q, bodies = state.rotor, (self.waves.rotor, self.waves.casing)
        rotor, casing = (
            (real_rows(body.shapes) @ q[place], real_rows(body.rates) @ q[place])
            for body, place in zip(bodies, self.waves.places(), strict=True)
        )
        angle = -float(angle_at(self.scene, steps, self.scene.solver.time_step))
        still = (ring_turned(self.model, part, angle) for part in casing)
        return unfold(self.model, Amplitudes(*rotor, *still))

    def begin(self, motion: Motion) -> bool:
        """Start from a given motion; return whether the state can represent it."""
        now, state = amplitudes(self.model, motion), self.state
        if now is None:
            return False
        nothing_booked(state, exact=False)
        own, beside = self.waves.places()
        state.rotor[own] = self.waves.rotor.write(now.rotor, now.rotor_rate)
        if len(beside):
            state.rotor[beside] = self.waves.casing.write(now.casing, now.casing_rate)
        energy = self.balance(state).energy
        state.ledger[contact.PULSE] = state.sums_b[2] = energy
        return True

    def _static(self, copies: Floats, stride: int) -> Floats:
        steps = stride * np.arange(1.0, len(copies) + 1)
        angles = -np.asarray(angle_at(self.scene, steps, self.scene.solver.time_step))
        return ring_turned(self.model, copies, angles)
