"""Scheme `general`: any rotor in any casing, by modes in the time loop `bodies`."""

from __future__ import annotations

import numpy as np

from hpcwhirl.arrays import Floats
from hpcwhirl.case.speed import Interval, law_of
from hpcwhirl.case.unbalance import (
    circle,
    has_steady,
    missing_at_start,
    steady_at,
    steady_rates,
)
from hpcwhirl.dynamics.bodies.motion import CentralSteps, Motion, after_loss
from hpcwhirl.dynamics.bodies.operators import friction_with_sign, modal_arrays
from hpcwhirl.dynamics.bodies.turning import by_diameter, steps_on, turning
from hpcwhirl.dynamics.bodies.varying import DrivenRotor, DrivenSteps, driven
from hpcwhirl.dynamics.kernels.contact import PULSE, STEP
from hpcwhirl.dynamics.kernels.kernel_types import BodiesState
from hpcwhirl.dynamics.schemes.integrator import Integrator
from hpcwhirl.dynamics.schemes.two_bodies import (
    Coordinates,
    TwoBodies,
    modal_coordinates,
)
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene


def build(model: Model, scene: Scene, _: int) -> Integrator:
    """Return the integrator of a scene by scheme `general`.

    The casing is integrated in the static frame.
    """
    if model.rotor.spin is not None:
        return (_Driven if law_of(scene) else _Spinning)(model, scene)
    return TwoBodies(model, scene, modal_arrays(model, scene))


class _Spinning(TwoBodies):
    """Integrator of a rotor whose modes are coupled by rotation at constant speed.

    With an unbalance, the state has the displacement from the circle, x_s, the rotor's
    motion without contact (`case.unbalance`).
    """

    def __init__(self, model: Model, scene: Scene) -> None:
        body, order = model.rotor, by_diameter(model.rotor)[0]
        step, shapes = scene.solver.time_step, model.rotor.shapes[:, order]
        own, still = turning(model, scene, shapes), circle(model, scene)
        self.still, arrays = still, modal_arrays(model, scene)
        steps = steps_on(arrays.rotor.stand, CentralSteps(own.keep, own.pull, step))
        held = Coordinates(
            steps, shapes, lambda: shapes.T @ body.mass,
            np.zeros(len(shapes)) if still is None else still,
        )  # fmt: skip
        both = held, modal_coordinates(model.casing, step)
        super().__init__(model, scene, arrays, both)
        if still is not None:
            lower = held.lower()
            now, rate = (lower @ part for part in missing_at_start(model, scene))
            self.put_on_circle(now, held.steps.increments(now, rate))

    def of_rotor(self, q: Floats, d: Floats, time: float) -> tuple[Floats, Floats]:
        """Return displacements and velocities of the rotor, see `TwoBodies.of_rotor`.

        Those of an unbalanced rotor include its orbit without contact.
        """
        x, v = super().of_rotor(q, d, time)
        if self.still is None:
            return x, v
        places, rate = self._steady(time)
        return x + (places - self.still), v + rate

    def _steady(self, time: float) -> tuple[Floats, Floats]:
        """Return the motion by unbalance without contact at a time, s, (n,) each.

        It is a displacement, m, and a velocity, m/s, by central differences.
        """
        model, scene = self.model, self.scene
        return steady_at(model, scene, time), steady_rates(model, scene, time)

    def aside(self, time: float) -> tuple[Floats, Floats]:
        """Return the ellipse at a time, s, without its circle, see `Coordinates`."""
        if self.still is None:
            return super().aside(time)
        places, rate = self._steady(time)
        return places - self.still, rate


class _Driven(TwoBodies):
    """Integrator of a rotor with terms of rotation whose speed changes.

    Its state has two motions of the rotor, that due to contact and that due to
    unbalance and changing speed, see `dynamics.bodies.varying`.

    moves : whether the run starts from a motion, not at rest in the rotating frame
    still : (n,), (n,), displacement and velocity of the motion without contact at the
        start
    """

    drives = True

    def __init__(self, model: Model, scene: Scene) -> None:
        step, own = scene.solver.time_step, DrivenRotor(model, scene)
        plain, mass = modal_arrays(model, scene), model.rotor.mass
        body = driven(plain.rotor, own)
        self.own, self.steps, self.moves = own, DrivenSteps(own, body, step), False
        none = np.zeros(len(own.shapes))
        held = Coordinates(self.steps, own.shapes, lambda: own.shapes.T @ mass, none)
        both = held, modal_coordinates(model.casing, step)
        super().__init__(model, scene, plain._replace(rotor=body), both)
        self.still = steady_at(model, scene, 0.0), steady_rates(model, scene, 0.0)
        if has_steady(scene):
            still = held.lower() @ self.still[0]
            less = held.lower() @ missing_at_start(model, scene)[0]
            first = np.concatenate([less, still[own.alike]])
            self.put_on_circle(first, 0.0 * first)

    def aside(self, _: float) -> tuple[Floats, Floats]:
        """Return the motion without contact at the start, see `TwoBodies.aside`."""
        return self.still

    def begin(self, motion: Motion) -> bool:
        """Start from a given motion, written into the state at angle 0; return True."""
        state, lower = self.state, self.held[0].lower()
        super().begin(motion)
        rate = lower @ self.still[1]
        self.steps.set_out(state, lower @ motion.rotor_velocity - rate, rate)
        self.moves = True
        state.ledger[PULSE] = self.balance(state).energy
        return True

    def refresh(self, state: BodiesState | None, now: Interval) -> None:
        """Compute the rotor's arrays for a new interval of the changing speed.

        The energy of the motion in the state changes with them; the change is entered
        in the ledger as work of the loading.

        state : state of the run; None: only the arrays are computed
        now : interval that begins, in which the speed is taken as constant
        """
        super().refresh(state, now)
        before = self.balance(state).energy if state else 0.0
        body, contact = self.arrays.rotor, self.arrays.contact
        self.own.set(body, now)
        mu = friction_with_sign(self.scene, now.speed)
        contact.w_rotor[:] = self.own.compliance(body, mu)
        if len(contact.coulomb.rotor):
            contact.coulomb.rotor[:] = self.own.responses(body)
        if not state:
            return
        if state.counter[STEP] == 0 and not self.moves:  # at rest
            lower, less = self.held[0].lower(), missing_at_start(self.model, self.scene)
            self.steps.set_out(state, lower @ less[1], lower @ self.still[1])
        state.ledger[PULSE] += self.balance(state).energy - before

    def go_on(self, old: TwoBodies, steps: int) -> None:
        """Write the rotor's motions by contact and without it into this state.

        old, steps : as for `Integrator.carry`
        """
        if not isinstance(old, _Driven):
            raise TypeError(old)
        motion, time = old.motion(old.state, steps), steps * old.steps.step
        y, rate = old.steps.by_contact(old.state, time)
        by_contact = motion._replace(
            rotor=old.own.shapes @ y, rotor_velocity=old.own.shapes @ rate
        )
        x, v, *_ = after_loss(self.model, motion)
        own, rise, *_ = after_loss(self.model, by_contact)
        self.steps.carry(self.state, (own, x - own, rise, v), time)

    def of_rotor(self, q: Floats, d: Floats, time: float) -> tuple[Floats, Floats]:
        """Return displacements and velocities of the rotor, see `TwoBodies.of_rotor`.

        They are those due to contact plus those due to unbalance and changing speed.
        """
        return super().of_rotor(self.own.whole(q), self.own.whole(d), time)
