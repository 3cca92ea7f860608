"""Integrators with the cyclic kernel, for the schemes `modal` and `exact`."""

from __future__ import annotations

from typing import Any

import numpy as np

from hpcwhirl.case.unbalance import circle
from hpcwhirl.dynamics.kernels import contact, cyclic, differences, flow, passes
from hpcwhirl.dynamics.kernels.kernel_types import Arrays, CyclicState
from hpcwhirl.dynamics.motion import modal_steps
from hpcwhirl.dynamics.schemes.integrator import (
    Ended,
    Integrator,
    at_rest,
    balance_of,
    motions_in_slots,
    reader,
    releaser,
    ring_reader,
    with_space,
)
from hpcwhirl.dynamics.schemes.places import Held, RingPlaces, RotorPlaces, Slots
from hpcwhirl.dynamics.slots import cyclic_arrays, turn_ring
from hpcwhirl.dynamics.walls import ready_at
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
    exact = SCHEMES[scene.solver.scheme].flies
    steps = modal_steps(model.rotor, scene.solver.time_step, exact=exact)
    return cyclic_march(model, scene, arrays, (ring_rows, *sizes), Slots(model, steps))


def cyclic_march(
    model: Model,
    scene: Scene,
    arrays: Arrays,
    sizes: tuple[int, int, int],
    rotor_places: RotorPlaces,
) -> Integrator:
    """Return the integrator of a rotor of equal sectors, as modes or as waves.

    Parameters
    ----------
    model, scene : model and scene to integrate
    arrays : constant arrays of the kernels `cyclic`
    sizes : rows of modes of the ring, lengths of the rotor's state and of its sums
    rotor_places : layout of the rotor's motion in its state
    """
    ring_rows, rotor, sums = sizes
    k, _ = cyclic.widths(model.blades)
    ring = passes.RING_STATE * ring_rows * k
    state_at_rest = at_rest(model.blades, scene.gap, (rotor, ring, 4 * k, sums))
    state_at_rest.counter[contact.NEXT_TRY] = ready_at(scene)
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

    balance = balance_of(own, arrays, scene, ended)
    ring_places = RingPlaces(model, scene, arrays.casing.items)
    held = Held(rotor_places, ring_places, circle(model, scene))
    motion, begin = motions_in_slots(model, scene, state_at_rest, held, ended, balance)

    return Integrator(
        kernel=with_space(march, lambda: cyclic.space_of(arrays, state_at_rest)),
        arrays=arrays,
        state=state_at_rest,
        balance=balance,
        motion=motion,
        begin=begin,
        casing_width=2 * ring_rows * k,
        casing_waves=reader(model, scene, ring_reader(model, scene)),
        release=releaser(model, ring_places),
        ended=ended,
        refresh=lambda state, now: turn_ring(
            model, scene, arrays.casing.items, state, model.folds * now.turn
        ),
    )


def is_cyclic(model: Model) -> bool:
    """Return whether the cyclic kernel can integrate a model.

    It cannot with one or two blades, where nodal diameter 1 has one phase but moves
    both coordinates of the centre; it can, though, if one of several sectors is
    integrated, which has no centre. It cannot with terms of rotation, since these
    couple modes, which the kernel integrates one by one.
    """
    plain = isinstance(model.ring, RingOperator) or not model.rotor.cyclic
    plain = plain or model.rotor.spin is not None
    return not plain and (model.blades > 2 or model.folds > 1)
