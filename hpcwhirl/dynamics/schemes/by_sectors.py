"""Integrators of schemes `modal` and `exact`, for tips with one contact point each.

They are for rotors of equal sectors, with the kernel `cyclic`, by nodal diameter: as
amplitudes of modes or, if rotation couples these, of waves. The casing is rigid or a
ring of harmonics. A function that returns None leaves the scene to another integrator.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

from hpcwhirl.arrays import Complexes, Floats
from hpcwhirl.case.unbalance import share_at_start
from hpcwhirl.dynamics.casing import ready_at
from hpcwhirl.dynamics.free_waves import FreeWaves
from hpcwhirl.dynamics.kernels import contact, cyclic, passes, waves
from hpcwhirl.dynamics.kernels.contact import PULSE
from hpcwhirl.dynamics.kernels.cyclic import widths
from hpcwhirl.dynamics.kernels.flow import EXACT
from hpcwhirl.dynamics.kernels.kernel_types import Arrays, CyclicState
from hpcwhirl.dynamics.kernels.stepping import end_step
from hpcwhirl.dynamics.kernels.wave_types import WaveRotor
from hpcwhirl.dynamics.motion import modal_steps
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
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene
from hpcwhirl.structure import RingOperator


def cyclic_modes(model: Model, scene: Scene, beat: int) -> Integrator:
    """Return the integrator of a rotor of equal sectors as modes.

    Terms of rotation, which couple modes, must be left out, see `is_cyclic`.

    beat : number of time steps between two rows of evidence
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
    """Integrator of a rotor of equal sectors by the kernel `cyclic`.

    arrays : the kernel's constant arrays, whose type selects modes or waves
    sizes : lengths of the state's arrays `rotor` and `sums_b`
    places : conversion of the rotor's motion between state and modal amplitudes
    """

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

    def put_on_circle(self, diameters: list[Diameter]) -> None:
        """Set the state so that an unbalanced rotor starts on its circle.

        The circle, the rotor's motion without contact, is stored as one more wave, of
        constant amplitude, in the last row, see `turning_waves.Circle`. If the run must
        start on a smaller circle, the other waves begin with the difference, at rest.
        Their energy is entered in the ledger as work of the loading, and in the state's
        `sums_b`, which count the energy that waves receive.

        diameters : the rotor's waves of each nodal diameter
        """
        steady = circle_of(self.model, self.scene, diameters)
        if steady is None:
            return
        share, state, own = (
            share_at_start(self.model, self.scene), self.state, diameters[1]
        )  # fmt: skip
        less = (share - 1.0) * steady.amplitude * steady.shape
        rest, k = own.amplitudes(less, 0.0 * less), len(state.lam) // 4
        rows = state.rotor[: self.arrays.rotor.hub.shape[1]].reshape(-1, 2, k)
        for f, value in [*enumerate(rest), (-1, steady.amplitude)]:
            rows[f, :, own.k] = value.real, value.imag
        if share < 1.0:
            energy = self.balance(state).energy
            state.sums_b[2 * k + own.k] = state.ledger[PULSE] = energy


def is_cyclic(model: Model) -> bool:
    """Return whether the kernel `cyclic` can integrate a model's rotor as modes.

    The kernel integrates modes one by one, so that sectors must be equal, the casing
    rigid or a ring of harmonics, and rotation must not couple modes. At least three
    blades are needed, because with fewer, nodal diameter 1 has one phase but moves both
    coordinates of the centre; the model of one of several sectors that move alike has
    no centre, and may have fewer.
    """
    plain = isinstance(model.ring, RingOperator) or not model.rotor.cyclic
    plain = plain or model.rotor.spin is not None
    return not plain and (model.blades > 2 or model.folds > 1)


@dataclass(frozen=True)
class _WavePlaces:
    """Conversion between a state's waves, by nodal diameter, and modal amplitudes.

    The rotor has equal sectors; the kernel's state has complex amplitudes of forward
    and backward waves, in slots, one for each nodal diameter (`turning_waves`).

    diameters : the waves of each nodal diameter
    rotor : the kernel's constant arrays of the rotor
    seen : whether the state also has the spectra of gaps of the last steps, as central
        differences need
    """

    model: Model
    diameters: list[Diameter]
    rotor: WaveRotor
    seen: bool

    def read(self, state: Floats, _: int) -> tuple[Floats, Floats]:
        """Return the rotor's modal amplitudes and velocities, (m,) each, from a state.

        The modes are those at Omega = 0.

        state : the rotor's part of the kernel's state, with no contact forces pending
        """
        waves_of = [amplitudes_of(state, own, self._slots) for own in self.diameters]
        pairs = list(zip(self.diameters, waves_of, strict=True))
        places = [own.shapes @ a for own, a in pairs]
        rates = [own.rates @ a for own, a in pairs]
        return self._modal(places), self._modal(rates)

    def write(self, state: Floats, q: Floats, rate: Floats) -> Floats:
        """Write a motion of the rotor at time 0 into a state.

        Return the modal amplitudes a step earlier, (m,), from which the earlier gaps
        follow.

        state : out, the rotor's part of the kernel's state
        q, rate : (m,), amplitudes of the modes at Omega = 0, and their velocities
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
    """Return whether a model's rotor can be integrated as waves by nodal diameter.

    It can with equal sectors and terms of rotation, except with fewer than three
    blades, where nodal diameter 1 has both coordinates of the centre; with a ring of
    elements or supports that differ by direction, which are not the same at every
    angle; and with a squeeze film.
    """
    spin, alike = model.rotor.spin, not isinstance(model.ring, RingOperator)
    return alike and spin is not None and bool(spin.waves) and spin.support.is_plain


def folds_well(model: Model, scene: Scene) -> bool:
    """Return whether a model, perhaps of one sector, can be integrated as it is.

    A model of all sectors always can. That of one of several equal sectors with terms
    of rotation needs waves of which no two nearly coincide; without these, all sectors
    must be integrated.
    """
    if model.folds == 1 or model.rotor.spin is None:
        return True
    return has_waves(model) and is_basis(diameters_of(model, scene))


def waves_apart(model: Model, scene: Scene, beat: int) -> Integrator | None:
    """Return the integrator of a rotor of equal sectors as waves, or None.

    The waves are those of each nodal diameter. None if the rotor has no such waves
    (`has_waves`), or if two of them nearly coincide, so that a motion does not
    determine their amplitudes.

    beat : number of time steps between two rows of evidence
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
    whole.put_on_circle(diameters)
    return whole
