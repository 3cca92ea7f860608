"""Integrator of rotors of unequal sectors: waves, in the loop `kernels.general`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from hpcwhirl.arrays import Floats
from hpcwhirl.case.unbalance import circle, share_at_start
from hpcwhirl.dynamics.kernels.contact import PULSE, STEP
from hpcwhirl.dynamics.kernels.cyclic import widths
from hpcwhirl.dynamics.kernels.differences import column_sums, energies_of
from hpcwhirl.dynamics.kernels.general import general_space, march_whole
from hpcwhirl.dynamics.kernels.kernel_types import Arrays, CyclicState
from hpcwhirl.dynamics.kernels.passes import ITEMS, RING_STATE
from hpcwhirl.dynamics.kernels.whole import HELD, settle_whole
from hpcwhirl.dynamics.mode_waves import ModeWaves, mode_waves, uncoupled_rotor
from hpcwhirl.dynamics.operators import friction_with_sign
from hpcwhirl.dynamics.schemes.integrator import (
    Balance,
    Integrator,
    at_rest,
    ended_by,
    motions_in_slots,
    reader,
    releaser,
    ring_reader,
    with_space,
)
from hpcwhirl.dynamics.schemes.places import Held, RingPlaces, RotorPlaces
from hpcwhirl.dynamics.slots import turn_ring
from hpcwhirl.dynamics.whole_waves import (
    WholeWaves,
    coupled_rotor,
    padded_blades,
    reads_of,
    whole_arrays,
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
        """Return amplitudes and rates of the modes at rest from a completed state."""
        waves, q = self.waves, state[self.waves.places]
        return waves.parts(waves.shapes) @ q, waves.parts(waves.rates) @ q

    def write(self, state: Floats, q: Floats, rate: Floats) -> Floats:
        """Set a state at time 0 to q, rate of the modes; return q a step earlier."""
        waves = self.waves
        scale = float(np.abs(waves.rates).max())
        basis = np.vstack([waves.parts(waves.shapes), waves.parts(waves.rates) / scale])
        parts = np.linalg.solve(basis, np.concatenate([q, rate / scale]))
        state[waves.places] = parts
        return np.asarray(waves.before @ parts)


@dataclass(frozen=True)
class _ModePlaces:
    """Layout of a rotor's modes as waves in a state; half : amplitudes, padded."""

    waves: ModeWaves
    half: int

    def read(self, state: Floats, _: int) -> tuple[Floats, Floats]:
        """Return amplitudes and rates (m,) of the modes from a completed state."""
        re, im = self._parts(state)
        rates = self.waves.rates
        return re.copy(), rates.real * re - rates.imag * im

    def write(self, state: Floats, q: Floats, rate: Floats) -> Floats:
        """Set a state at time 0 to q, rate of the modes; return q a step earlier."""
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

    It is set as in `rotating_waves._circling`; the circle is the last wave, constant in
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
    arrays = whole_arrays(model, scene, coupled_rotor(model, scene, waves))
    whole = _march(model, scene, arrays, _WholePlaces(waves))
    return _circling(whole, model, scene, waves)


def _of_modes(model: Model, scene: Scene, waves: ModeWaves) -> Integrator:
    """Return the integrator of a rotor without terms of rotation."""
    arrays = whole_arrays(model, scene, uncoupled_rotor(model, scene, waves))
    return _march(model, scene, arrays, _ModePlaces(waves, len(arrays.rotor.drift)))


def _march(
    model: Model, scene: Scene, arrays: Arrays, held_in: RotorPlaces
) -> Integrator:
    """Return the integrator of a rotor of unequal sectors.

    arrays, held_in : the kernel's arrays; layout of the rotor's motion in a state
    """
    step, rotor, c_c = scene.solver.time_step, arrays.rotor, arrays.casing.items
    blades = model.blades
    k, _ = widths(blades)
    padded, march = padded_blades(blades), cast(Any, march_whole)
    ring = RING_STATE * (len(c_c) // ITEMS)
    sizes = len(rotor.ahead) + padded, ring, HELD * padded + 4 * k, 3
    state_at_rest = at_rest(blades, scene.gap, sizes)
    friction = friction_with_sign(scene)

    ended = ended_by(lambda state, copies: settle_whole(c_c, state, copies))

    def balance(state: CyclicState) -> Balance:
        s_b, s_c, sums_b, sums_c = ended(state)
        now = int(state.counter[STEP] & 1)
        own, beside = energies_of(rotor, s_b, s_c, c_c, now, step)
        rotation, impact, drag, given = column_sums(sums_b, sums_c, step)
        return Balance(own + beside, given - own, rotation, friction * drag, impact)

    ring_places, places = RingPlaces(model, scene, c_c), circle(model, scene)
    held = Held(held_in, ring_places, places, beside=True)
    motion, begin = motions_in_slots(model, scene, state_at_rest, held, ended, balance)

    return Integrator(
        kernel=with_space(march, lambda: general_space(arrays, state_at_rest)),
        arrays=arrays,
        state=state_at_rest,
        balance=balance,
        motion=motion,
        begin=begin,
        casing_width=2 * len(c_c) // ITEMS,
        casing_waves=reader(model, scene, ring_reader(model, scene)),
        release=releaser(model, ring_places),
        ended=ended,
        refresh=lambda state, now: turn_ring(model, scene, c_c, state, now.turn),
    )
