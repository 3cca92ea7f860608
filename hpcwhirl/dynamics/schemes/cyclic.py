"""Integrators with the cyclic kernel, for the schemes `modal` and `exact`."""

from __future__ import annotations

from functools import partial
from typing import Any

from hpcwhirl.dynamics.kernels import contact, cyclic, differences, flow, passes
from hpcwhirl.dynamics.kernels.kernel_types import Arrays, CyclicState
from hpcwhirl.dynamics.motion import modal_steps
from hpcwhirl.dynamics.schemes.integrator import Ended, Integrator, at_rest
from hpcwhirl.dynamics.schemes.places import ModePlaces, RotorPlaces
from hpcwhirl.dynamics.schemes.rotating_frame import Rotating, in_rotating_frame
from hpcwhirl.dynamics.slots import cyclic_arrays, rotor_amplitudes, rotor_slots
from hpcwhirl.dynamics.walls import ready_at
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene
from hpcwhirl.scene.schemes import SCHEMES
from hpcwhirl.structure import RingOperator


def cyclic_modes(model: Model, scene: Scene, beat: int) -> Integrator:
    """Return the integrator of a cyclic model without terms of rotation.

    beat : steps between rows of evidence
    """
    arrays = cyclic_arrays(model, scene, beat)
    k, _ = cyclic.widths(model.blades)
    sizes = passes.ROTOR_STATE * arrays.rotor.hub.shape[1], 3 * 2 * k
    exact = SCHEMES[scene.solver.scheme].flies
    places = ModePlaces(
        modal_steps(model.rotor, scene.solver.time_step, exact=exact),
        partial(rotor_amplitudes, model),
        partial(rotor_slots, model),
    )
    return cyclic_march(model, scene, arrays, sizes, places)


def cyclic_march(
    model: Model,
    scene: Scene,
    arrays: Arrays,
    sizes: tuple[int, int],
    rotor_places: RotorPlaces,
) -> Integrator:
    """Return the integrator of a rotor of equal sectors, as modes or as waves.

    Parameters
    ----------
    model, scene : model and scene to integrate
    arrays : constant arrays of the kernels `cyclic`
    sizes : lengths of the rotor's state and of its sums
    rotor_places : layout of the rotor's motion in its state
    """
    (rotor, sums), (k, _) = sizes, cyclic.widths(model.blades)
    ring = passes.RING_STATE * (len(arrays.casing.items) // passes.ITEMS)
    state_at_rest = at_rest(model.blades, scene.gap, (rotor, ring, 4 * k, sums))
    state_at_rest.counter[contact.NEXT_TRY] = ready_at(scene)
    exact = SCHEMES[scene.solver.scheme].flies
    passes_of: Any = flow if exact else differences
    march = cyclic.march_flow if exact else cyclic.march_differences

    def settle(state: CyclicState, copies: Ended) -> None:
        s_b, s_c, sums_b, sums_c = copies
        passes_of.end_step(
            arrays.rotor, state.rotor, s_b, state.ring, s_c, arrays.casing.items,
            state.lam, state.counter, sums_b, sums_c,
        )  # fmt: skip

    own = Rotating(
        march, lambda: cyclic.space_of(arrays, state_at_rest), settle, passes_of
    )
    return in_rotating_frame(model, scene, arrays, state_at_rest, rotor_places, own)


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
