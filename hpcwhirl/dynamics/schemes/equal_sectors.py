"""Integrators of equal sectors with the cyclic kernel, for `modal` and `exact`.

The rotor is integrated by modes or, if rotation couples these, by waves.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from hpcwhirl.arrays import Complexes, Floats
from hpcwhirl.case.unbalance import circle, share_at_start
from hpcwhirl.dynamics.casing import ready_at
from hpcwhirl.dynamics.free_waves import FreeWaves
from hpcwhirl.dynamics.kernels import contact, cyclic, passes, waves
from hpcwhirl.dynamics.kernels.contact import PULSE
from hpcwhirl.dynamics.kernels.cyclic import widths
from hpcwhirl.dynamics.kernels.differences import CENTRAL
from hpcwhirl.dynamics.kernels.flow import EXACT
from hpcwhirl.dynamics.kernels.kernel_types import Arrays, CyclicState
from hpcwhirl.dynamics.kernels.stepping import end_step
from hpcwhirl.dynamics.kernels.wave_types import WaveRotor
from hpcwhirl.dynamics.motion import modal_steps
from hpcwhirl.dynamics.schemes.integrator import Ended, Integrator, at_rest
from hpcwhirl.dynamics.schemes.rotating_frame import (
    ModePlaces,
    Rotating,
    RotorPlaces,
    in_rotating_frame,
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
    exact = scene.solver.flies
    way = EXACT if exact else CENTRAL
    march = cyclic.march_flow if exact else cyclic.march_differences

    def settle(state: CyclicState, copies: Ended) -> None:
        s_b, s_c, sums_b, sums_c = copies
        end_step(
            arrays.rotor, way, state.rotor, s_b, state.ring, s_c, arrays.casing.items,
            state.lam, state.counter, sums_b, sums_c,
        )  # fmt: skip

    own = Rotating(march, lambda: cyclic.space_of(arrays, state_at_rest), settle, way)
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
    seen = 0 if scene.solver.flies else waves.SEEN
    rotor = arrays.rotor.hub.shape[1] + 2 * k * seen
    places = _WavePlaces(model, diameters, arrays.rotor, seen=seen > 0)
    whole = cyclic_march(model, scene, arrays, (rotor, 3 * k), places)
    return _circling(whole, model, scene, diameters)
