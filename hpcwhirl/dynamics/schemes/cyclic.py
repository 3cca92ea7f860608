"""The cyclic kernel: what `modal` and `exact` share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from hpcwhirl.dynamics.flights import can_fly
from hpcwhirl.dynamics.kernels import contact, cyclic, differences, flow, passes
from hpcwhirl.dynamics.kernels.kernel_types import Arrays, CyclicState
from hpcwhirl.dynamics.schemes.integrator import (
    Ended,
    Floats,
    Integrator,
    at_rest,
    balance_of,
    reader,
    ring_reader,
    unfold,
    with_space,
)
from hpcwhirl.dynamics.slots import cyclic_arrays, ring_displacements, rotor_amplitudes
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene
from hpcwhirl.scene.schemes import SCHEMES
from hpcwhirl.structure import RingOperator


def cyclic_modes(model: Model, scene: Scene, beat: int) -> Integrator:
    """Return the integrator of a cyclic model without terms of rotation.

    beat : steps between rows of evidence
    """
    arrays, rows, ring_rows = cyclic_arrays(model, scene, beat)
    k, _ = cyclic.widths(model.blades)
    sizes = passes.ROTOR_STATE * rows * 2 * k, 3 * 2 * k
    return cyclic_march(
        model, scene, arrays, (ring_rows, *sizes),
        lambda s_b: rotor_amplitudes(model, s_b),
    )  # fmt: skip


def cyclic_march(
    model: Model,
    scene: Scene,
    arrays: Arrays,
    sizes: tuple[int, int, int],
    amplitudes: Callable[[Floats], Floats],
) -> Integrator:
    """Return the integrator of a rotor of equal sectors, as modes or as waves.

    Parameters
    ----------
    model, scene : what is integrated
    arrays : constant arrays of the kernels `cyclic`
    sizes : rows of the ring, lengths of the rotor's state and of its sums
    amplitudes : rotor's state without a pending step -> amplitudes (m,) of its modes at
        rest
    """
    ring_rows, rotor, sums = sizes
    k, _ = cyclic.widths(model.blades)
    ring = passes.RING_STATE * ring_rows * k
    state_at_rest = at_rest(model.blades, scene.gap, (rotor, ring, 4 * k, sums))
    if not can_fly(scene):
        state_at_rest.counter[contact.NEXT_TRY] = np.iinfo(np.int64).max
    exact = SCHEMES[scene.solver.scheme].flies
    own = flow if exact else differences
    march: Any = cyclic.march_flow if exact else cyclic.march_differences

    def ended(state: CyclicState) -> Ended:
        s_b, s_c = np.zeros_like(state.rotor), np.zeros_like(state.ring)
        sums_b, sums_c = state.sums_b.copy(), state.sums_c.copy()
        own.end_step(
            arrays.rotor, state.rotor, s_b, state.ring, s_c, arrays.casing.items,
            state.lam, state.counter, sums_b, sums_c,
        )  # fmt: skip
        return s_b, s_c, sums_b, sums_c

    def displacements(state: CyclicState, steps: int) -> tuple[Floats, Floats]:
        s_b, s_c, _, _ = ended(state)
        q_c = ring_displacements(model, scene, s_c, steps)
        return unfold(model, amplitudes(s_b), q_c)

    return Integrator(
        kernel=with_space(march, lambda: cyclic.space_of(arrays, state_at_rest)),
        arrays=arrays,
        state=state_at_rest,
        balance=balance_of(own, arrays, scene, ended),
        displacements=displacements,
        casing_width=2 * ring_rows * k,
        casing_waves=reader(model, scene, ring_reader(model, scene)),
        ended=ended,
    )


def is_cyclic(model: Model) -> bool:
    """Return whether the cyclic kernel can march a model.

    With one or two blades k = 1 is a simple harmonic that has both of the centre's
    coordinates, which the kernel has no place for; one of many sectors has no centre.
    What rotation adds couples modes that it marches one by one.
    """
    plain = isinstance(model.ring, RingOperator) or not model.rotor.cyclic
    plain = plain or model.rotor.spin is not None
    return not plain and (model.blades > 2 or model.folds > 1)
