"""Integrator for several contact points a tip: waves of both bodies."""

from __future__ import annotations

from typing import Any, cast

import numpy as np

from hpcwhirl.arrays import Floats
from hpcwhirl.case.profile import NEVER, release_step
from hpcwhirl.case.speed import angle_at, law_of
from hpcwhirl.case.unbalance import circle
from hpcwhirl.dynamics.casing import waves_of_modes
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
    reader,
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
    """Return the integrator of the waves of both bodies, for several points a tip.

    None for a ring of elements, supports that differ by direction or have a film, or a
    speed that changes, since matrices are not constant in the rotating frame then; for
    an unbalance or a casing that is let go; and where two waves nearly coincide.
    """
    spin = model.rotor.spin
    plain = spin is None or spin.support.is_plain
    steady = law_of(scene) is None and circle(model, scene) is None
    let_go = release_step(scene) != NEVER
    if isinstance(model.ring, RingOperator) or not plain or not steady or let_go:
        return None
    waves = point_waves(model, scene)
    return None if waves is None else _march(model, scene, waves)


def _march(model: Model, scene: Scene, waves: PointWaves) -> Integrator:
    arrays, waves = point_arrays(model, scene, waves)
    step = scene.solver.time_step
    points, kernel = model.contacts, cast(Any, march_points)
    padded = padded_blades(points)
    sizes = 2 * waves.half, 0, HELD * padded, 3
    state_at_rest = at_rest(points, scene.gap, sizes)
    chosen = folded(points, widths(points)[1])
    state_at_rest.gaps.reshape(3, -1)[:] = model.clearances(scene.gap)[chosen]
    friction, (own, beside) = friction_with_sign(scene), waves.places()

    def balance(state: CyclicState) -> Balance:
        energy = sum(energies_of_points(arrays.rotor, state.rotor))
        normal, drag, given = state.sums_b
        return Balance(energy, given - energy, normal / 2, friction * drag / 2)

    def motion(state: CyclicState, steps: int) -> Motion:
        q = state.rotor
        rotor, casing = (
            (real_rows(body.shapes) @ q[place], real_rows(body.rates) @ q[place])
            for body, place in ((waves.rotor, own), (waves.casing, beside))
        )
        angle = -float(angle_at(scene, steps, step))
        still = (ring_turned(model, part, angle) for part in casing)
        return unfold(model, Amplitudes(*rotor, *still))

    def begin(motion: Motion) -> bool:
        now = amplitudes(model, motion)
        if now is None:
            return False
        nothing_booked(state_at_rest, exact=False)
        q = state_at_rest.rotor
        q[own] = waves.rotor.write(now.rotor, now.rotor_rate)
        if len(beside):
            q[beside] = waves.casing.write(now.casing, now.casing_rate)
        energy = balance(state_at_rest).energy
        state_at_rest.ledger[contact.PULSE] = state_at_rest.sums_b[2] = energy
        return True

    def read(copies: Floats, stride: int) -> Floats:
        steps = stride * np.arange(1.0, len(copies) + 1)
        angles = -np.asarray(angle_at(scene, steps, step))
        return waves_of_modes(model, ring_turned(model, copies, angles))

    return Integrator(
        kernel=with_space(kernel, lambda: points_space(arrays, state_at_rest)),
        arrays=arrays,
        state=state_at_rest,
        balance=balance,
        motion=motion,
        begin=begin,
        casing_width=len(arrays.rotor.casing),
        casing_waves=reader(model, scene, read),
    )
