"""Set-valued friction of equal sectors: coefficients of `kernels.loop.slot_slides`.

In the frame of the blades the response of both bodies to forces of contact, normal and
along theta, is constant, and circulant for each pair of directions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import circulant

from hpcwhirl.arrays import Complexes, Floats, Integers
from hpcwhirl.dynamics.bodies.operators import (
    NO_SLIDES,
    coulomb_law,
    friction_with_sign,
)
from hpcwhirl.dynamics.kernels.loop.slot_slides import KINDS
from hpcwhirl.dynamics.kernels.loop.wave_types import SlotSlides
from hpcwhirl.dynamics.kernels.vectors import all_aligned
from hpcwhirl.dynamics.waves import slots
from hpcwhirl.dynamics.waves.slot_waves import (
    SlotPlaces,
    SlotWaves,
    Steps,
    packed,
    two_rows,
)
from hpcwhirl.dynamics.waves.slots import blade_waves
from hpcwhirl.dynamics.waves.turning_waves import Circle, Diameter
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene

# waves of a motion without contact: index of re, slot; (n,), slide of a step for unit
# amplitude
Aside = tuple[Integers, Integers, Complexes]


@dataclass(frozen=True)
class SlotDrag:
    """What forces along theta do to a body's waves, by slot.

    Attributes
    ----------
    rise : (rows, k), slide of a step for unit amplitude, see `coulomb`
    drag : (rows, k), change of the amplitude by a unit spectrum of forces along theta
    near, went : (k,), motion from step n - 1 to n + 1 by it: of the gap, along theta
    response : (2, 2, k), displacement, of the gap and along theta, by unit spectra of
        the multipliers without friction and of forces along theta
    """

    rise: Complexes
    drag: Complexes
    near: Complexes
    went: Complexes
    response: Complexes


def drag_of_modes(items: Floats, steps: Steps) -> SlotDrag:
    """Return it for pairs of waves of uncoupled modes.

    items, steps : (ITEMS, rows, k), coefficients of the modes; how they move
    """
    radial = items[slots.RADIAL]
    along = items[slots.SR] + 1j * items[slots.SI]
    rise, back = steps.ahead / (1 + steps.ahead), along.conj()
    both, forces = (radial, along), (radial, back)
    return SlotDrag(
        two_rows(along * rise, along * rise.conj()),
        two_rows(steps.gives * back, steps.gives.conj() * back),
        (radial * steps.moved * back).sum(axis=0),
        (along * steps.moved * back).sum(axis=0),
        np.array([
            [(row * steps.give * force).sum(axis=0) for force in forces] for row in both
        ]),
    )  # fmt: skip


def drag_of_diameters(diameters: Sequence[Diameter], rows: int, k: int) -> SlotDrag:
    """Return it for the waves of a rotor with terms of rotation.

    rows, k : number of rows of waves, with those of the steady motion; of slots
    """
    rise, drag = np.zeros((2, rows, k), dtype=complex)
    near, went = np.zeros((2, k), dtype=complex)
    response = np.zeros((2, 2, k), dtype=complex)
    for own in diameters:
        n, size, back = own.k, len(own.ahead), own.along.conj()
        more, seen = own.passed_by(back), np.stack([own.radial, own.along])
        pushes = [own.pushed_by(force) for force in (own.radial.conj(), back)]
        rise[:size, n] = (own.along @ own.shapes) * own.ahead / (1 + own.ahead)
        drag[:size, n] = pushes[1]
        near[n], went[n] = seen @ more
        response[:, :, n] = seen @ own.shapes @ np.stack(pushes, axis=1)
    return SlotDrag(rise, drag, near, went, response)


def aside_of(
    steady: Sequence[Circle], diameters: Sequence[Diameter], at: SlotPlaces
) -> Aside:
    """Return the orbits of an unbalanced rotor, which are the last rows of waves.

    A circle, which rests in the frame of the blades, is left out.
    """
    first = max((len(own.ahead) for own in diameters), default=0)
    moving = [f for f, orbit in enumerate(steady) if orbit.ahead != 0.0]
    rows = [int(at.rotor_at(first + f, 1)) for f in moving]
    z = 1 + np.array([steady[f].ahead for f in moving], dtype=complex)
    seen = np.array([diameters[1].along @ steady[f].shape for f in moving], complex)
    index, slides = np.array(rows, dtype=np.int64), np.asarray(seen * (1 - 1 / z))
    return index, 0 * index + 1, slides.astype(complex)


def no_drag(k: int) -> SlotDrag:
    """Return it for a rigid casing, with k slots."""
    none, zero = np.zeros((0, k), dtype=complex), np.zeros(k, dtype=complex)
    return SlotDrag(none, none, zero, zero, np.zeros((2, 2, k), dtype=complex))


@dataclass(frozen=True)
class Rubbed:
    """The waves of a body, and what forces along theta do to them."""

    waves: SlotWaves
    drag: SlotDrag

    def seen(self, factor: str) -> Complexes:
        """Return the motion by a unit spectrum of forces that the pass sees, (k,).

        factor : `slide`, `open` or `passing` of the waves
        """
        return np.asarray((getattr(self.waves, factor) * self.drag.drag).sum(axis=0))


@dataclass(frozen=True)
class Further:
    """Entries of `SlotSlides` that a changing speed, and an unbalance, need.

    swirls : its `swirl` and `swirls`
    aside : its last entries
    """

    swirls: tuple[Floats, Floats]
    aside: Aside


def no_slides(blades: int, step: float, aside: Aside) -> SlotSlides:
    """Return the kernel's arrays with permanent sliding."""
    at, slot, slide = aside
    places, none = np.zeros((blades, 0), np.int64), np.zeros(0)
    return SlotSlides(
        NO_SLIDES, step, places, np.zeros((blades, 0)), *(none,) * 4, at, slot,
        np.column_stack([slide.real, slide.imag]),
    )  # fmt: skip


def slot_slides(
    model: Model,
    scene: Scene,
    bodies: tuple[Rubbed, Rubbed],
    places: SlotPlaces,
    further: Further,
) -> SlotSlides:
    """Return the kernel's coefficients of set-valued friction.

    Parameters
    ----------
    bodies, places : rotor and casing; where their waves lie
    further : what a changing speed and an unbalance add
    """
    mu = friction_with_sign(scene)
    rotor, ring = bodies
    response = rotor.drag.response + ring.drag.response
    own, beside = rotor.drag, ring.drag
    opened = beside.near - ring.seen("open")
    if scene.solver.flies:
        opened = opened + own.near - rotor.seen("open")
    went = own.went + beside.went
    normal = rotor.waves.slides + ring.waves.slides
    fixed = np.zeros((KINDS, own.drag.shape[1]), dtype=complex)
    fixed[:] = (
        response[1, 0] + mu * response[1, 1], normal, own.response[0, 1], opened,
        went - rotor.seen("slide") - ring.seen("slide"), -ring.seen("passing"), went,
    )  # fmt: skip
    items = packed(
        [(own.rise, beside.rise), (own.drag, beside.drag)],
        places,
    )
    flat = all_aligned([
        items, np.stack([fixed.real, fixed.imag], axis=1).ravel(), *further.swirls,
    ])  # fmt: skip
    plain = no_slides(model.blades, scene.solver.time_step, further.aside)
    law = coulomb_law(scene, _response(model.blades, response), folds=model.folds)
    rows, fixes, swirl, alone = flat
    return plain._replace(law=law, rows=rows, fixed=fixes, swirl=swirl, swirls=alone)


def _response(blades: int, response: Complexes) -> Floats:
    """Return the response (2 N, 2 N), m/N, as `kernels.kernel_types.Coulomb` has it."""
    waves: Any = blade_waves(blades)
    used = response[:, :, : waves.shape[1]]
    columns = (used @ waves.T).real
    parts = [[circulant(columns[i, j]).T for i in range(2)] for j in range(2)]
    return np.block(parts)
