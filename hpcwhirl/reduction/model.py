"""The model of a scene: both bodies in modal form, and how they touch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.reduction.bodies import casing_model, file_model, rotor_model
from hpcwhirl.reduction.modes import ModalModel
from hpcwhirl.reduction.numbers import representable
from hpcwhirl.scene import Scene, content_digest
from hpcwhirl.structure import FourierOperator, RingOperator

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Model:
    """Bladed disk, and the ring it may touch (None where the casing is rigid).

    Attributes
    ----------
    rotor, casing, ring, blades : the bodies, how the casing is read, N
    folds : g, where this is one of g sectors that move alike, see `sectors`; else 1
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


def whole_model_of(scene: Scene) -> Model:
    """Return the model of a scene as it is given; R_c = R_bd + gap.

    Raises
    ------
    InputError
        where the inputs do not lead to a model that double precision holds
    """
    file = scene.engine.file
    with representable("the rotor"):
        if file:
            rotor = file_model(file, content_digest(file), scene.engine.rotor)
        else:
            rotor = rotor_model(scene.engine.rotor, scene.solver.modes)
    blades = scene.engine.rotor.blades
    if scene.engine.casing.kind == "rigid":
        return Model(rotor, None, None, blades)
    radius = scene.engine.rotor.radius + scene.gap
    with representable("the casing"):
        casing, operator = casing_model(scene.engine.casing, radius)
    return Model(rotor, casing, operator, blades)
