"""Scheme `general`: the integrator of any rotor, in its modal amplitudes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import hpcwhirl.dynamics.kernels.coupled
import hpcwhirl.dynamics.kernels.modes
import hpcwhirl.dynamics.kernels.standing  # noqa: F401 - registers their verbs
from hpcwhirl.case.speed import Interval, law_of
from hpcwhirl.case.unbalance import circle, share_at_start, steady_at
from hpcwhirl.dynamics.kernels import passes
from hpcwhirl.dynamics.kernels.contact import PULSE, STEP
from hpcwhirl.dynamics.kernels.cyclic import widths
from hpcwhirl.dynamics.kernels.differences import CENTRAL
from hpcwhirl.dynamics.kernels.general import (
    general_space,
    march_general,
    settle_general,
)
from hpcwhirl.dynamics.kernels.kernel_types import Arrays, BodiesState
from hpcwhirl.dynamics.layer import wears
from hpcwhirl.dynamics.motion import FreeSteps, Motion, modal_steps
from hpcwhirl.dynamics.operators import friction_with_sign, modal_arrays
from hpcwhirl.dynamics.schemes.integrator import Integrator, at_rest
from hpcwhirl.dynamics.schemes.rotating_frame import (
    ModePlaces,
    Rotating,
    in_rotating_frame,
)
from hpcwhirl.dynamics.schemes.two_bodies import (
    Coordinates,
    modal_coordinates,
    started,
    two_bodies,
)
from hpcwhirl.dynamics.tips import general_rotor, unequal_arrays
from hpcwhirl.dynamics.turning import by_diameter, turning
from hpcwhirl.dynamics.varying import DrivenRotor, DrivenSteps, driven
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene
from hpcwhirl.structure import RingOperator


def build(model: Model, scene: Scene, _: int) -> Integrator:
    """Return the integrator of a scene by the scheme general.

    The casing is integrated in the static frame if it is a ring of elements, if
    rotation couples the modes of the rotor, if tips have several contact points or if a
    layer wears; otherwise in the rotating frame.
    """
    if model.rotor.spin is not None:
        return (_driven if law_of(scene) else _spinning)(model, scene)
    apart = isinstance(model.ring, RingOperator) or model.rotor.points is not None
    if apart or wears(scene):
        return two_bodies(model, scene, modal_arrays(model, scene))
    rotor = general_rotor(model, scene)
    return _turning(model, scene, unequal_arrays(model, scene, rotor))


def _spinning(model: Model, scene: Scene) -> Integrator:
    """Return the integrator of a rotor whose modes are coupled by rotation.

    With an unbalance, the amplitudes are those of the displacement less x_s, that of
    the circle without contact, see `case.unbalance`.
    """
    body, order = model.rotor, by_diameter(model.rotor)[0]
    step, shapes = scene.solver.time_step, model.rotor.shapes[:, order]
    own, still = turning(model, scene, shapes), circle(model, scene)
    held = Coordinates(
        FreeSteps(own.keep, own.pull, step), shapes, lambda: shapes.T @ body.mass,
        np.zeros(len(shapes)) if still is None else still,
    )  # fmt: skip
    whole = two_bodies(
        model, scene, modal_arrays(model, scene),
        (held, modal_coordinates(model.casing, step)),
    )  # fmt: skip
    if still is None:
        return whole

    def motion(state: BodiesState, steps: int) -> Motion:
        swung = steady_at(model, scene, steps * step) - still
        now = whole.motion(state, steps)
        return now._replace(rotor=now.rotor + swung)

    less = share_at_start(model, scene) - 1.0
    lift = less * held.lower()
    now, before = (lift @ steady_at(model, scene, time) for time in (0.0, -step))
    return replace(started(whole, model, scene, now, now - before), motion=motion)


def _driven(model: Model, scene: Scene) -> Integrator:
    """Return the integrator of a rotor whose speed changes, see `dynamics.varying`."""
    step, own = scene.solver.time_step, DrivenRotor(model, scene)
    plain, mass = modal_arrays(model, scene), model.rotor.mass
    body = driven(plain.rotor, own)
    arrays, mu = plain._replace(rotor=body), friction_with_sign(scene)
    steps, none = DrivenSteps(own, body, step), np.zeros(len(own.shapes))
    held = Coordinates(steps, own.shapes, lambda: own.shapes.T @ mass, none)
    whole = two_bodies(
        model, scene, arrays, (held, modal_coordinates(model.casing, step))
    )
    steady = circle(model, scene)

    def begin(motion: Motion) -> bool:
        state = whole.state
        whole.begin(motion)
        steps.set_out(state, held.lower() @ motion.rotor_velocity)
        state.ledger[PULSE] = whole.balance(state).energy
        return True

    def refresh(state: BodiesState | None, now: Interval) -> None:
        before = whole.balance(state).energy if state else 0.0
        own.set(body, now)
        arrays.contact.w_rotor[:] = own.compliance(body, mu)
        if not state:
            return
        if state.counter[STEP] == 0 and steady is not None:  # at rest, see `started`
            steps.set_out(state, np.zeros(len(own.order)))
        state.ledger[PULSE] += whole.balance(state).energy - before

    def motion(state: BodiesState, steps: int) -> Motion:
        now = state._replace(q_b=own.whole(state.q_b), d_b=own.whole(state.d_b))
        return whole.motion(now, steps)

    if steady is not None:
        still = held.lower() @ steady
        less = (share_at_start(model, scene) - 1.0) * still
        first = np.concatenate([less, still[own.alike]])
        whole = started(whole, model, scene, first, 0.0 * first)
    return replace(whole, refresh=refresh, motion=motion, begin=begin)


def _turning(model: Model, scene: Scene, arrays: Arrays) -> Integrator:
    """Return the integrator of real modes in the rotating frame.

    The casing is a ring of harmonics, or rigid.

    arrays : constant arrays of the kernel `general`
    """
    c_b, c_c, own = arrays.rotor.items, arrays.casing.items, len(model.rotor.omega)
    k, modes = widths(model.blades)[0], len(c_b) // passes.ITEMS
    ring = passes.RING_STATE * (len(c_c) // passes.ITEMS)
    sizes = passes.ROTOR_STATE * modes, ring, 2 * modes + 4 * k, 3 * modes
    state_at_rest = at_rest(model.blades, scene.gap, sizes)
    places = ModePlaces(
        modal_steps(model.rotor, scene.solver.time_step, exact=False),
        lambda part: part[:own].copy(),
        lambda q: np.pad(q, (0, modes - own)),
    )
    kernel = Rotating(
        march_general,
        lambda: general_space(arrays, state_at_rest),
        lambda state, copies: settle_general(c_b, c_c, state, copies),
        CENTRAL,
    )
    return in_rotating_frame(model, scene, arrays, state_at_rest, places, kernel)
