"""Integrators of rotors by their sectors, for `modal` and `exact`.

Equal sectors are integrated with the cyclic kernel, by modes or, if rotation couples
these, by waves; unequal ones by waves of the whole rotor, in the loop of
`kernels.general`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from hpcwhirl.arrays import Complexes, Floats
from hpcwhirl.case.unbalance import share_at_start
from hpcwhirl.dynamics.casing import ready_at
from hpcwhirl.dynamics.free_waves import FreeWaves
from hpcwhirl.dynamics.kernels import contact, cyclic, passes, waves
from hpcwhirl.dynamics.kernels.contact import PULSE
from hpcwhirl.dynamics.kernels.cyclic import widths
from hpcwhirl.dynamics.kernels.flow import EXACT
from hpcwhirl.dynamics.kernels.general import general_space, march_whole
from hpcwhirl.dynamics.kernels.kernel_types import Arrays, CyclicState
from hpcwhirl.dynamics.kernels.stepping import end_step
from hpcwhirl.dynamics.kernels.wave_types import WaveRotor
from hpcwhirl.dynamics.kernels.whole import HELD, settle_whole
from hpcwhirl.dynamics.mode_waves import (
    ModeWaves,
    mode_waves,
    uncoupled_rotor,
    unequal_arrays,
)
from hpcwhirl.dynamics.motion import modal_steps
from hpcwhirl.dynamics.operators import friction_with_sign
from hpcwhirl.dynamics.schemes.integrator import Integrator, with_space
from hpcwhirl.dynamics.schemes.rotating_frame import (
    Ended,
    ModePlaces,
    RotatingFrame,
    RotorPlaces,
)
from hpcwhirl.dynamics.slots import cyclic_arrays, rotor_amplitudes, rotor_slots
from hpcwhirl.dynamics.turning_waves import (
    Diameter,
    amplitudes_of,
    circle_of,
    diameters_of,
    is_basis,
    modal_places,
    modes_of,
    wave_arrays,
)
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


def cyclic_modes(model: Model, scene: Scene, beat: int) -> Integrator:
    """Return the integrator of a cyclic model without terms of rotation.

    beat : steps between rows of evidence
    """
    arrays = cyclic_arrays(model, scene, beat)
    k, _ = cyclic.widths(model.blades)
    sizes = passes.ROTOR_STATE * arrays.rotor.hub.shape[1], 3 * 2 * k
    solver = scene.solver
    places = ModePlaces(
        modal_steps(model.rotor, solver.time_step, exact=solver.flies),
        partial(rotor_amplitudes, model),
        partial(rotor_slots, model),
    )
    return EqualSectors(model, scene, arrays, sizes, places)


class EqualSectors(RotatingFrame):
    """Integrator of a rotor of equal sectors, as modes or as waves."""

    def __init__(
        self,
        model: Model,
        scene: Scene,
        arrays: Arrays,
        sizes: tuple[int, int],
        places: RotorPlaces,
    ) -> None:
        (rotor, sums), (k, _) = sizes, widths(model.blades)
        if scene.solver.flies:
            self.way = EXACT
        super().__init__(model, scene, arrays, (rotor, 4 * k, sums), places)
        self.state.counter[contact.NEXT_TRY] = ready_at(scene)

    def _kernel(self) -> Any:
        exact = self.scene.solver.flies
        march = cyclic.march_flow if exact else cyclic.march_differences
        return with_space(march, lambda: cyclic.space_of(self.arrays, self.state))

    def _settle(self, state: CyclicState, copies: Ended) -> None:
        s_b, s_c, sums_b, sums_c = copies
        end_step(
            self.arrays.rotor, self.way, state.rotor, s_b, state.ring, s_c,
            self.arrays.casing.items, state.lam, state.counter, sums_b, sums_c,
        )  # fmt: skip


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


@dataclass(frozen=True)
class _WavePlaces:
    """Layout of a rotor's waves in a state.

    rotor : the kernel's arrays of the rotor
    seen : whether the state also holds the spectra of gaps of the last steps
    """

    model: Model
    diameters: list[Diameter]
    rotor: WaveRotor
    seen: bool

    def read(self, state: Floats, _: int) -> tuple[Floats, Floats]:
        """Return amplitudes and rates, (m,) each, of the modes at rest from a state."""
        waves_of = [amplitudes_of(state, own, self._slots) for own in self.diameters]
        pairs = list(zip(self.diameters, waves_of, strict=True))
        places = [own.shapes @ a for own, a in pairs]
        rates = [own.rates @ a for own, a in pairs]
        return self._modal(places), self._modal(rates)

    def write(self, state: Floats, q: Floats, rate: Floats) -> Floats:
        """Set a state at time 0 to a motion; return amplitudes a step earlier, (m,).

        q, rate : (m,), amplitudes of the modes at rest, and their velocities
        """
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


def _put_on_circle(whole: EqualSectors, diameters: list[Diameter]) -> None:
    """Set an integrator's state to the circle of an unbalanced rotor.

    The circle is the last row of amplitudes, see `turning_waves.Circle`. If a run
    begins on the circle scaled down, the waves begin with the difference from the full
    circle. Their energy is entered in the ledger as work of the loading, and in the
    state's sums like energy that contact has added.
    """
    steady = circle_of(whole.model, whole.scene, diameters)
    if steady is None:
        return
    share, state, own = (
        share_at_start(whole.model, whole.scene),
        whole.state,
        diameters[1],
    )
    less = (share - 1.0) * steady.amplitude * steady.shape
    rest, k = own.inverse @ np.concatenate([less, 0.0 * less]), len(state.lam) // 4
    rows = state.rotor[: whole.arrays.rotor.hub.shape[1]].reshape(-1, 2, k)
    for f, value in [*enumerate(rest), (-1, steady.amplitude)]:
        rows[f, :, own.k] = value.real, value.imag
    if share < 1.0:
        energy = whole.balance(state).energy
        state.sums_b[2 * k + own.k] = state.ledger[PULSE] = energy


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
    seen = 0 if scene.solver.flies else waves.SEEN
    rotor = arrays.rotor.hub.shape[1] + 2 * k * seen
    places = _WavePlaces(model, diameters, arrays.rotor, seen=seen > 0)
    whole = EqualSectors(model, scene, arrays, (rotor, 3 * k), places)
    _put_on_circle(whole, diameters)
    return whole


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
class _SingleModes:
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


class UnequalSectors(RotatingFrame):
    """Integrator of a rotor of unequal sectors, as waves."""

    beside = True

    def __init__(
        self, model: Model, scene: Scene, arrays: Arrays, places: RotorPlaces
    ) -> None:
        padded = padded_blades(model.blades)
        lam = HELD * padded + 4 * widths(model.blades)[0]
        sizes = len(arrays.rotor.ahead) + padded, lam, 3
        super().__init__(model, scene, arrays, sizes, places)

    def _kernel(self) -> Any:
        return with_space(march_whole, lambda: general_space(self.arrays, self.state))

    def _settle(self, state: CyclicState, copies: Ended) -> None:
        settle_whole(self.arrays.casing.items, state, copies)

    def put_on_circle(self, waves: WholeWaves) -> None:
        """Set the state to the circle of an unbalanced rotor, as `_put_on_circle` does.

        The circle is the last wave, constant in the rotating frame.
        """
        if self.places is None:
            return
        share, body, state = (
            share_at_start(self.model, self.scene),
            self.model.rotor,
            self.state,
        )
        rest = (share - 1.0) * body.shapes.T @ (body.mass @ self.places)
        state.rotor[waves.places] = waves.amplitudes(rest, 0.0 * rest)
        state.rotor[waves.half - 1] = 1.0
        if share < 1.0:
            state.sums_b[2] = state.ledger[PULSE] = self.balance(state).energy


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
    whole = UnequalSectors(model, scene, arrays, _WholePlaces(waves))
    whole.put_on_circle(waves)
    return whole


def _of_modes(model: Model, scene: Scene, waves: ModeWaves) -> Integrator:
    """Return the integrator of a rotor of unequal sectors without terms of rotation.

    waves : its modes as waves, see `dynamics.mode_waves`
    """
    arrays = unequal_arrays(model, scene, uncoupled_rotor(model, scene, waves))
    places = _SingleModes(waves, len(arrays.rotor.drift))
    return UnequalSectors(model, scene, arrays, places)
