"""Scheme `general`: any rotor, mode by mode."""

from __future__ import annotations

from functools import cache
from typing import Any, cast

import numpy as np

import hpcwhirl.dynamics.kernels.modes  # noqa: F401 - what modes do
from hpcwhirl.dynamics.kernels import contact, passes
from hpcwhirl.dynamics.kernels.cyclic import widths
from hpcwhirl.dynamics.kernels.differences import column_sums, energies_of
from hpcwhirl.dynamics.kernels.general import (
    general_space,
    march_general,
    settle_general,
)
from hpcwhirl.dynamics.kernels.named import Arrays, CyclicState, GeneralSpace
from hpcwhirl.dynamics.kernels.vectors import aligned
from hpcwhirl.dynamics.operators import friction_with_sign, modal_arrays
from hpcwhirl.dynamics.schemes.bodies import two_bodies
from hpcwhirl.dynamics.schemes.integrator import (
    Balance,
    Ended,
    Floats,
    Integrator,
    nothing_yet,
    reader,
    ring_reader,
    unfold,
)
from hpcwhirl.dynamics.slots import ring_displacements
from hpcwhirl.dynamics.tips import general_arrays
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene
from hpcwhirl.structure import RingOperator


def build(model: Model, scene: Scene, _: int) -> Integrator:
    """Return what marches a scene: in the static frame where the ring is elements."""
    if isinstance(model.ring, RingOperator):
        return two_bodies(model, scene, modal_arrays(model, scene))
    return _turning(model, scene, general_arrays(model, scene))


def _at_rest(model: Model, scene: Scene, arrays: Arrays) -> CyclicState:
    k, wide = widths(model.blades)
    modes = len(arrays.rotor.items) // passes.ITEMS
    ring = len(arrays.casing.items) // passes.ITEMS
    own = (
        np.zeros(passes.ROTOR_STATE * modes), np.zeros(passes.RING_STATE * ring),
        np.zeros(2 * modes + 4 * k), np.full(3 * 2 * wide, scene.gap),
        np.zeros(3 * modes), np.zeros(4 * k),
        np.zeros(model.blades + 2, dtype=np.int64), *nothing_yet(model.blades),
    )  # fmt: skip
    return CyclicState(*map(aligned, own))


def _turning(model: Model, scene: Scene, arrays: Arrays) -> Integrator:
    """Return the march beside a round casing, in the frame that turns."""
    c_b, c_c = arrays.rotor.items, arrays.casing.items
    step, modes = scene.solver.time_step, len(model.rotor.omega)
    at_rest, march = _at_rest(model, scene, arrays), cast(Any, march_general)

    @cache
    def space() -> GeneralSpace:
        return general_space(arrays, at_rest)

    def kernel(*given: Any) -> None:
        march(*given, space())

    def ended(state: CyclicState) -> Ended:
        parts = state.rotor, state.ring, state.sums_b, state.sums_c
        s_b, s_c, sums_b, sums_c = (np.zeros_like(part) for part in parts)
        settle_general(c_b, c_c, state, (s_b, s_c, sums_b, sums_c))
        return s_b, s_c, sums_b, sums_c

    def balance(state: CyclicState) -> Balance:
        s_b, s_c, sums_b, sums_c = ended(state)
        odd = int(state.counter[contact.STEP] & 1)
        energy = sum(energies_of(s_b, c_b, s_c, c_c, odd, step))
        rotation, impact, drag, loss = column_sums(sums_b, sums_c, step)
        friction = friction_with_sign(scene) * drag
        return Balance(energy, loss, rotation, friction, impact)

    def displacements(state: CyclicState, steps: int) -> tuple[Floats, Floats]:
        s_b, s_c, _, _ = ended(state)
        return unfold(model, s_b[:modes], ring_displacements(model, scene, s_c, steps))

    return Integrator(
        kernel=kernel,
        arrays=arrays,
        state=at_rest,
        balance=balance,
        displacements=displacements,
        casing_width=2 * len(c_c) // passes.ITEMS,
        casing_waves=reader(model, scene, ring_reader(model, scene)),
        ended=ended,
    )
