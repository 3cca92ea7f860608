"""The cyclic kernel: what `modal` and `exact` share."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from hpcwhirl.dynamics.flights import can_fly
from hpcwhirl.dynamics.kernels import contact, cyclic, differences, flow, passes
from hpcwhirl.dynamics.kernels.kernel_types import CyclicSpace, CyclicState
from hpcwhirl.dynamics.schemes.integrator import (
    Ended,
    Floats,
    Integrator,
    at_rest,
    balance_of,
    reader,
    ring_reader,
    unfold,
)
from hpcwhirl.dynamics.slots import cyclic_arrays, modal_amplitudes
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene
from hpcwhirl.scene.schemes import SCHEMES
from hpcwhirl.structure import RingOperator


def _at_rest(model: Model, scene: Scene, rows: int, ring_rows: int) -> CyclicState:
    """Return a state at rest of the cyclic kernel."""
    k, _ = cyclic.widths(model.blades)
    rotor, ring = passes.ROTOR_STATE * rows * 2 * k, passes.RING_STATE * ring_rows * k
    state = at_rest(model.blades, scene.gap, (rotor, ring, 4 * k, 3 * 2 * k))
    if not can_fly(scene):
        state.counter[contact.NEXT_TRY] = np.iinfo(np.int64).max
    return state


def cyclic_modes(model: Model, scene: Scene, beat: int) -> Integrator:
    """Return the march of a cyclic model; `beat`: steps between rows of evidence."""
    arrays, rows, ring_rows = cyclic_arrays(model, scene, beat)
    c_b, c_c = arrays.rotor.items, arrays.casing.items
    exact = SCHEMES[scene.solver.scheme].flies
    own = flow if exact else differences
    march: Any = cyclic.march_flow if exact else cyclic.march_differences
    state_at_rest = _at_rest(model, scene, rows, ring_rows)

    @cache
    def space() -> CyclicSpace:
        return cyclic.space_of(arrays, state_at_rest)

    def kernel(*given: Any) -> None:
        march(*given, space())

    def ended(state: CyclicState) -> Ended:
        s_b, s_c = np.zeros_like(state.rotor), np.zeros_like(state.ring)
        sums_b, sums_c = state.sums_b.copy(), state.sums_c.copy()
        own.end_step(
            state.rotor, s_b, c_b, state.ring, s_c, c_c, state.lam, state.counter,
            sums_b, sums_c,
        )  # fmt: skip
        return s_b, s_c, sums_b, sums_c

    def displacements(state: CyclicState, steps: int) -> tuple[Floats, Floats]:
        s_b, s_c, _, _ = ended(state)
        q_b, q_c = modal_amplitudes(model, scene, (s_b, s_c), steps)
        return unfold(model, q_b, q_c)

    return Integrator(
        kernel=kernel,
        arrays=arrays,
        state=state_at_rest,
        balance=balance_of(own, arrays, scene, ended),
        displacements=displacements,
        casing_width=2 * ring_rows * cyclic.widths(model.blades)[0],
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
