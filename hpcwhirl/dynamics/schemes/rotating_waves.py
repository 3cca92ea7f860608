"""Integrator of waves: equal sectors whose modes are coupled by rotation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hpcwhirl.arrays import Complexes, Floats
from hpcwhirl.case.unbalance import circle, share_at_start
from hpcwhirl.dynamics.free_waves import FreeWaves
from hpcwhirl.dynamics.kernels import waves
from hpcwhirl.dynamics.kernels.contact import PULSE
from hpcwhirl.dynamics.kernels.cyclic import widths
from hpcwhirl.dynamics.kernels.wave_types import WaveRotor
from hpcwhirl.dynamics.schemes.cyclic import cyclic_march
from hpcwhirl.dynamics.schemes.integrator import Integrator
from hpcwhirl.dynamics.turning_waves import (
    Diameter,
    amplitudes_of,
    circle_of,
    diameters_of,
    is_basis,
    is_exact,
    modal_places,
    modes_of,
    wave_arrays,
)
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene
from hpcwhirl.structure import RingOperator


@dataclass(frozen=True)
class _WavePlaces:
    """Layout of a rotor's waves in a state.

    rotor : the kernel's arrays
    seen : whether the state also holds the spectra of gaps of the last steps
    """

    model: Model
    diameters: list[Diameter]
    rotor: WaveRotor
    seen: bool

    def read(self, state: Floats, _: int) -> tuple[Floats, Floats]:
        """Return amplitudes and rates of the modes at rest from a state."""
        waves_of = [amplitudes_of(state, own, self._slots) for own in self.diameters]
        pairs = list(zip(self.diameters, waves_of, strict=True))
        places = [own.shapes @ a for own, a in pairs]
        rates = [own.rates @ a for own, a in pairs]
        return self._modal(places), self._modal(rates)

    def write(self, state: Floats, q: Floats, rate: Floats) -> Floats:
        """Set a state at time 0 to modal amplitudes, rates; return q a step earlier."""
        before, rows = [], state.reshape(-1, 2, self._slots)
        for own in self.diameters:
            a = own.amplitudes(*(modes_of(self.model, own.k, x) for x in (q, rate)))
            rows[: len(a), 0, own.k], rows[: len(a), 1, own.k] = a.real, a.imag
            before.append(own.shapes @ (a * own.before))
        if self.seen:
            FreeWaves(self.rotor, self._slots).motion(state, 0).leave(state, 0, 0)
        return self._modal(before)

    @property
    def _slots(self) -> int:
        return widths(self.model.blades)[0]

    def _modal(self, places: list[Complexes]) -> Floats:
        return modal_places(self.model, self.diameters, places)


def _circling(
    whole: Integrator, model: Model, scene: Scene, diameters: list[Diameter]
) -> Integrator:
    """Return an integrator with its state on the circle of an unbalanced rotor.

    The circle is the last row of amplitudes, see `turning_waves.Circle`. If a run
    begins on the circle scaled down, the waves begin with the difference from the full
    circle. Their energy is entered in the ledger as work of the loading, and in the
    state's sums like energy that contact has added.

    whole : integrator at rest; returned unchanged for a balanced rotor
    """
    places, steady = circle(model, scene), circle_of(model, scene, diameters)
    if places is None or steady is None:
        return whole
    share, state, own = share_at_start(model, scene), whole.state, diameters[1]
    less = (share - 1.0) * steady.amplitude * steady.shape
    rest, k = own.inverse @ np.concatenate([less, 0.0 * less]), len(state.lam) // 4
    rows = state.rotor[: whole.arrays.rotor.hub.shape[1]].reshape(-1, 2, k)
    for f, value in [*enumerate(rest), (-1, steady.amplitude)]:
        rows[f, :, own.k] = value.real, value.imag
    if share < 1.0:
        energy = whole.balance(state).energy
        state.sums_b[2 * k + own.k] = state.ledger[PULSE] = energy
    return whole


def has_waves(model: Model) -> bool:
    """Return whether waves describe a rotor: equal sectors with terms of rotation.

    They do not for fewer than three blades, where nodal diameter 1 has both coordinates
    of the centre; nor with a ring of elements or supports that differ by direction,
    which are not the same at every angle; nor with a squeeze film.
    """
    spin, alike = model.rotor.spin, not isinstance(model.ring, RingOperator)
    return alike and spin is not None and bool(spin.waves) and spin.support.is_plain


def folds_well(model: Model, scene: Scene) -> bool:
    """Return whether one of several equal sectors can be integrated alone.

    With terms of rotation this requires waves of which no two nearly coincide; else all
    sectors must be integrated.
    """
    if model.folds == 1 or model.rotor.spin is None:
        return True
    return has_waves(model) and is_basis(diameters_of(model, scene))


def waves_apart(model: Model, scene: Scene, beat: int) -> Integrator | None:
    """Return the integrator of a rotor's waves.

    None if the rotor has no waves (`has_waves`), or if two of them nearly coincide, so
    that a motion does not determine the amplitudes.

    beat : steps between rows of evidence
    """
    diameters = diameters_of(model, scene) if has_waves(model) else []
    if not is_basis(diameters):
        return None
    arrays = wave_arrays(model, scene, diameters, beat)
    k, _ = widths(model.blades)
    seen = 0 if is_exact(scene) else waves.SEEN
    rotor = arrays.rotor.hub.shape[1] + 2 * k * seen
    places = _WavePlaces(model, diameters, arrays.rotor, seen=seen > 0)
    whole = cyclic_march(model, scene, arrays, (rotor, 3 * k), places)
    return _circling(whole, model, scene, diameters)
