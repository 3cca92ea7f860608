"""The model of a scene: both bodies in modal form, and how they touch."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.reduction.foreign import rotor_from
from hpcwhirl.reduction.harmonics import harmonic_model
from hpcwhirl.reduction.modes import (
    SUSPENSION_SHARE,
    ModalModel,
    modal_model,
    with_ratio,
)
from hpcwhirl.reduction.numbers import representable
from hpcwhirl.reduction.whole import boundary_of, named_after, whole_model
from hpcwhirl.scene import Casing, Rotor, Scene, content_digest
from hpcwhirl.structure import FourierOperator, RingOperator, bladed_disk, ring

Floats = NDArray[np.float64]
SUPPORT_SHARE = 0.5  # of a mode's strain energy in the foundation: on the support


@dataclass(frozen=True)
class Model:
    """Bladed disk, and the ring it may touch (None where the casing is rigid).

    Attributes
    ----------
    rotor, casing, ring, blades : the bodies, how the casing is read, N
    folds : g, where this is one of g sectors that move alike, see `fold`; else 1
    lifts : of rotor and casing then, (n, m) each: displacements of the whole for
        the sector's amplitudes
    """

    rotor: ModalModel
    casing: ModalModel | None
    ring: RingOperator | FourierOperator | None
    blades: int
    folds: int = 1
    lifts: tuple[Floats, Floats] | None = None

    def limits(self) -> dict[str, float]:
        """Return the largest stable step of each body, s: dt < 2 / omega_max."""
        bodies = {"rotor": self.rotor, "casing": self.casing}
        return {n: 2.0 / float(b.omega.max()) for n, b in bodies.items() if b}


@lru_cache(maxsize=8)
def rotor_model(rotor: Rotor, eta: int) -> ModalModel:
    """Return the reduced bladed disk (Eq. 1); as a whole where it is mistuned."""
    model = _undivided(rotor, eta)
    suspended = model.centre_share > SUSPENSION_SHARE
    return with_ratio(model, suspended, rotor.suspension_damping)


def _undivided(rotor: Rotor, eta: int) -> ModalModel:
    """Return the reduced bladed disk, every mode damped alike."""
    disk = bladed_disk(rotor)
    if not rotor.mistuning:
        return modal_model(disk, rotor.damping, eta)
    model = whole_model(disk, rotor.damping, eta)
    most = len(disk.mass) - len(boundary_of(disk))
    tuned = rotor.model_copy(update={"mistuning": ()})
    # one mode more: none is left unnamed where eta splits a pair of the tuned rotor
    return named_after(model, rotor_model(tuned, min(eta + 1, most)), rotor.blades)


@lru_cache(maxsize=8)
def _file_model(file: str, content: str, rotor: Rotor) -> ModalModel:
    del content  # with it in the cache's key, a changed file is read again
    return rotor_from(file, rotor.blades, rotor.damping)


@lru_cache(maxsize=32)
def casing_model(
    casing: Casing, radius: float
) -> tuple[ModalModel, RingOperator | FourierOperator]:
    """Return the ring, not reduced, and its contact operator."""
    operator: RingOperator | FourierOperator
    if casing.discretization == "fourier":
        model, operator = harmonic_model(casing, radius)
    else:
        structure, operator = ring(casing, radius)
        model = modal_model(structure, casing.damping)
    # The foundation holds omega_c1^2 / omega^2 of the strain energy of a mode.
    carried = model.omega**2 < casing.support_frequency**2 / SUPPORT_SHARE
    return with_ratio(model, carried, casing.support_damping), operator


def model_of(scene: Scene) -> Model:
    """Return the model of a scene; R_c = R_bd + gap.

    Raises
    ------
    InputError
        where the inputs do not lead to a model that double precision holds
    """
    file = scene.engine.file
    with representable("the rotor"):
        if file:
            rotor = _file_model(file, content_digest(file), scene.engine.rotor)
        else:
            rotor = rotor_model(scene.engine.rotor, scene.solver.modes)
    blades = scene.engine.rotor.blades
    if scene.engine.casing.kind == "rigid":
        return Model(rotor, None, None, blades)
    radius = scene.engine.rotor.radius + scene.gap
    with representable("the casing"):
        casing, operator = casing_model(scene.engine.casing, radius)
    return Model(rotor, casing, operator, blades)


def tip_rows(model: ModalModel, blades: int) -> tuple[Floats, Floats]:
    """Return (radial, tangential) modal tip shapes, each (N, m)."""
    return model.shapes[0 : 2 * blades : 2], model.shapes[1 : 2 * blades : 2]


def centre_rows(model: ModalModel, blades: int) -> Floats:
    """Return modal shapes of (x_o, y_o), (2, m); zeros where it is clamped."""
    count = len(model.shapes) - 2 * blades - model.kept
    if count == 0:
        return np.zeros((2, len(model.omega)))
    return model.shapes[2 * blades : 2 * blades + 2]
