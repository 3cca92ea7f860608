"""The kernel `waves`: where rotation couples the modes of equal sectors."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any, cast

import numpy as np

from hpcwhirl.case.unbalance import circle, share_at_start
from hpcwhirl.dynamics.kernels import waves
from hpcwhirl.dynamics.kernels.contact import PULSE, STEP
from hpcwhirl.dynamics.kernels.cyclic import widths
from hpcwhirl.dynamics.kernels.kernel_types import CyclicState, WaveSpace
from hpcwhirl.dynamics.kernels.passes import RING_STATE
from hpcwhirl.dynamics.operators import friction_with_sign
from hpcwhirl.dynamics.schemes.integrator import (
    Balance,
    Ended,
    Floats,
    Integrator,
    at_rest,
    reader,
    ring_reader,
    unfold,
)
from hpcwhirl.dynamics.slots import ring_displacements
from hpcwhirl.dynamics.turning_waves import (
    Diameter,
    circle_of,
    diameters_of,
    is_basis,
    is_exact,
    modal_places,
    wave_arrays,
)
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene
from hpcwhirl.structure import RingOperator


def _circling(
    whole: Integrator, model: Model, scene: Scene, diameters: list[Diameter]
) -> Integrator:
    """Return the march of a rotor from its circle, if it is unbalanced.

    The circle is the last row of amplitudes, see `turning_waves.Circle`. Where a run
    begins on a share of it, the waves have what is missing, at rest; its energy is
    booked as in `bodies.started`, and counts as given by contact.
    """
    places, steady = circle(model, scene), circle_of(model, scene, diameters)
    if places is None or steady is None:
        return whole
    share, state, own = share_at_start(model, scene), whole.state, diameters[1]
    less = (share - 1.0) * steady.amplitude * steady.shape
    rest, k = own.inverse @ np.concatenate([less, 0.0 * less]), len(state.lam) // 4
    rows = state.rotor[: -2 * k * waves.SEEN].reshape(-1, 2, k)
    for f, value in [*enumerate(rest), (-1, steady.amplitude)]:
        rows[f, :, own.k] = value.real, value.imag
    if share < 1.0:
        energy = whole.balance(state).energy
        state.sums_b[2 * k + own.k] = state.ledger[PULSE] = energy

    def displacements(now: CyclicState, steps: int) -> tuple[Floats, Floats]:
        rotor, casing = whole.displacements(now, steps)
        return rotor + places, casing

    return replace(whole, displacements=displacements)


def has_waves(model: Model) -> bool:
    """Return whether a rotor's motion is of waves: rotation couples equal sectors.

    With fewer than three blades k = 1 has both of the centre's coordinates, and a ring
    of elements is not the same at every angle, nor are supports of two stiffnesses.
    """
    spin, alike = model.rotor.spin, not isinstance(model.ring, RingOperator)
    return alike and spin is not None and bool(spin.waves) and spin.support.is_round


def folds_well(model: Model, scene: Scene) -> bool:
    """Return whether a model of one sector can be marched: all that couples is waves.

    Where two waves nearly coincide, only all sectors together are.
    """
    if model.folds == 1 or model.rotor.spin is None:
        return True
    return has_waves(model) and is_basis(diameters_of(model, scene))


def waves_apart(model: Model, scene: Scene) -> Integrator | None:
    """Return the march of a rotor's waves; None where they are not told apart.

    That is where there are none, or where two of them nearly coincide.
    """
    diameters = diameters_of(model, scene) if has_waves(model) else []
    if not is_basis(diameters):
        return None
    arrays, ring_rows = wave_arrays(model, scene, diameters)
    k, _ = widths(model.blades)
    c_b, c_c, exact = arrays.rotor, arrays.casing.items, is_exact(scene)
    rows = c_b.hub.shape[1] // (2 * k)
    sizes = 2 * k * (rows + waves.SEEN), RING_STATE * ring_rows * k, 4 * k, 3 * k
    state_at_rest = at_rest(model.blades, scene.gap, sizes)
    step, friction = scene.solver.time_step, friction_with_sign(scene)
    march = cast(Any, waves.march_flowing_waves if exact else waves.march_waves)

    @cache
    def space() -> WaveSpace:
        return waves.space_of(arrays, state_at_rest, exact=exact)

    def kernel(*given: Any) -> None:
        march(*given, space())

    def ended(state: CyclicState) -> Ended:
        s_b, s_c = np.zeros_like(state.rotor), np.zeros_like(state.ring)
        sums_b, sums_c = state.sums_b.copy(), state.sums_c.copy()
        waves.end_waves(
            state.rotor, s_b, c_b, state.ring, s_c, c_c, state.lam, state.counter,
            exact, sums_b, sums_c, np.zeros_like(state.lam),
        )  # fmt: skip
        return s_b, s_c, sums_b, sums_c

    def balance(state: CyclicState) -> Balance:
        s_b, s_c, sums_b, sums_c = ended(state)
        now = int(state.counter[STEP] & 1)
        own, ring = waves.energies_of_waves(s_b, c_b, s_c, c_c, now, exact, step)
        rotation, impact, drag, given = waves.sums_of_waves(sums_b, sums_c, exact, step)
        return Balance(own + ring, given - own, rotation, friction * drag, impact)

    def displacements(state: CyclicState, steps: int) -> tuple[Floats, Floats]:
        s_b, s_c, _, _ = ended(state)
        q_c = ring_displacements(model, scene, s_c, steps)
        return unfold(model, modal_places(model, s_b, diameters), q_c)

    whole = Integrator(
        kernel=kernel,
        arrays=arrays,
        state=state_at_rest,
        balance=balance,
        displacements=displacements,
        casing_width=2 * ring_rows * k,
        casing_waves=reader(model, scene, ring_reader(model, scene)),
        ended=None if exact else ended,
    )
    return _circling(whole, model, scene, diameters)
