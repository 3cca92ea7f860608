"""Integrator of rotors of unequal sectors: waves, in the loop `kernels.general`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hpcwhirl.arrays import Floats
from hpcwhirl.case.unbalance import circle, share_at_start
from hpcwhirl.dynamics.kernels.contact import PULSE
from hpcwhirl.dynamics.kernels.cyclic import widths
from hpcwhirl.dynamics.kernels.differences import CENTRAL
from hpcwhirl.dynamics.kernels.general import general_space, march_whole
from hpcwhirl.dynamics.kernels.kernel_types import Arrays
from hpcwhirl.dynamics.kernels.passes import ITEMS, RING_STATE
from hpcwhirl.dynamics.kernels.whole import HELD, settle_whole
from hpcwhirl.dynamics.mode_waves import ModeWaves, mode_waves, uncoupled_rotor
from hpcwhirl.dynamics.operators import friction_with_sign
from hpcwhirl.dynamics.schemes.integrator import Integrator, at_rest
from hpcwhirl.dynamics.schemes.rotating_frame import (
    Rotating,
    RotorPlaces,
    in_rotating_frame,
)
from hpcwhirl.dynamics.tips import unequal_arrays
from hpcwhirl.dynamics.whole_waves import (
    WholeWaves,
    coupled_rotor,
    padded_blades,
    reads_of,
    whole_waves,
)
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene
from hpcwhirl.structure import RingOperator


@dataclass(frozen=True)
class _WholePlaces:
    """Layout of a whole rotor's waves in a state."""

    waves: WholeWaves

    def read(self, state: Floats, _: int) -> tuple[Floats, Floats]:
        """Return amplitudes and rates, (m,) each, of the modes at rest from a state."""
        waves, q = self.waves, state[self.waves.places]
        return waves.parts(waves.shapes) @ q, waves.parts(waves.rates) @ q

    def write(self, state: Floats, q: Floats, rate: Floats) -> Floats:
        """Set a state at time 0 to a motion; return amplitudes a step earlier, (m,).

        q, rate : (m,), amplitudes of the modes at rest, and their velocities
        """
        waves = self.waves
        scale = float(np.abs(waves.rates).max())
        basis = np.vstack([waves.parts(waves.shapes), waves.parts(waves.rates) / scale])
        parts = np.linalg.solve(basis, np.concatenate([q, rate / scale]))
        state[waves.places] = parts
        return np.asarray(waves.before @ parts)


@dataclass(frozen=True)
class _ModePlaces:
    """Layout of a rotor's modes as waves in a state.

    half : number of complex amplitudes, padded: re, then im
    """

    waves: ModeWaves
    half: int

    def read(self, state: Floats, _: int) -> tuple[Floats, Floats]:
        """Return amplitudes and rates (m,) of the modes from a state."""
        re, im = self._parts(state)
        rates = self.waves.rates
        return re.copy(), rates.real * re - rates.imag * im

    def write(self, state: Floats, q: Floats, rate: Floats) -> Floats:
        """Set a state at time 0 to a motion; return amplitudes a step earlier, (m,).

        q, rate : (m,), amplitudes of the modes at rest, and their velocities
        """
        waves, (re, im) = self.waves, self._parts(state)
        a = waves.amplitudes(q, rate, waves.rates)
        re[:], im[:] = a.real, a.imag
        return np.asarray((a / (1 + waves.ahead)).real)

    def _parts(self, state: Floats) -> tuple[Floats, Floats]:
        modes, half = len(self.waves.omega), self.half
        return state[:modes], state[half : half + modes]


def _circling(
    march: Integrator, model: Model, scene: Scene, waves: WholeWaves
) -> Integrator:
    """Return an integrator with its state on the circle of an unbalanced rotor.

    It is set as in `equal_sectors._circling`; the circle is the last wave, constant in
    the rotating frame.
    """
    places, share = circle(model, scene), share_at_start(model, scene)
    if places is None:
        return march
    body, state = model.rotor, march.state
    rest = (share - 1.0) * body.shapes.T @ (body.mass @ places)
    state.rotor[waves.places] = waves.amplitudes(rest, 0.0 * rest)
    state.rotor[waves.half - 1] = 1.0
    if share < 1.0:
        state.sums_b[2] = state.ledger[PULSE] = march.balance(state).energy
    return march


def whole_apart(model: Model, scene: Scene) -> Integrator | None:
    """Return the integrator of the waves of a rotor of unequal sectors.

    None if one of several equal sectors is integrated alone, if two waves nearly
    coincide, or if the waves' energy does not agree with the work of contact; also in a
    ring of elements and on supports that differ by direction or have a film, whose
    matrices are not constant in the rotating frame.
    """
    spin, elements = model.rotor.spin, isinstance(model.ring, RingOperator)
    plain = spin is None or spin.support.is_plain
    if elements or model.folds > 1 or not plain:
        return None
    if spin is None:
        modes = mode_waves(model.rotor, scene.solver.time_step)
        return _of_modes(model, scene, modes) if modes.is_basis else None
    waves, (radial, along) = whole_waves(model, scene), reads_of(model)
    forces = radial + friction_with_sign(scene) * along
    if not (waves.is_basis and waves.books(forces)):
        return None
    arrays = unequal_arrays(model, scene, coupled_rotor(model, scene, waves))
    whole = _march(model, scene, arrays, _WholePlaces(waves))
    return _circling(whole, model, scene, waves)


def _of_modes(model: Model, scene: Scene, waves: ModeWaves) -> Integrator:
    """Return the integrator of a rotor of unequal sectors without terms of rotation.

    waves : its modes as waves, see `dynamics.mode_waves`
    """
    arrays = unequal_arrays(model, scene, uncoupled_rotor(model, scene, waves))
    return _march(model, scene, arrays, _ModePlaces(waves, len(arrays.rotor.drift)))


def _march(
    model: Model, scene: Scene, arrays: Arrays, held_in: RotorPlaces
) -> Integrator:
    """Return the integrator of a rotor of unequal sectors.

    arrays, held_in : the kernel's arrays; layout of the rotor's motion in a state
    """
    c_c, blades = arrays.casing.items, model.blades
    k, padded = widths(blades)[0], padded_blades(blades)
    ring = RING_STATE * (len(c_c) // ITEMS)
    sizes = len(arrays.rotor.ahead) + padded, ring, HELD * padded + 4 * k, 3
    state_at_rest = at_rest(blades, scene.gap, sizes)
    kernel = Rotating(
        march_whole,
        lambda: general_space(arrays, state_at_rest),
        lambda state, copies: settle_whole(c_c, state, copies),
        CENTRAL,
        beside=True,
    )
    return in_rotating_frame(model, scene, arrays, state_at_rest, held_in, kernel)
