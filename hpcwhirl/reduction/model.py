"""The model of a scene: both bodies in modal form, and how they touch."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.reduction.bodies import casing_model, file_model, rotor_model
from hpcwhirl.reduction.modes import ModalModel
from hpcwhirl.reduction.numbers import representable
from hpcwhirl.reduction.round_casing import check_lobes
from hpcwhirl.scene import Casing, Rotor, Scene, content_digest
from hpcwhirl.structure import FourierOperator, RingOperator

Floats = NDArray[np.float64]
MOST_KEPT = 32  # models: some 100 kB to some MB each


@dataclass(frozen=True, eq=False)  # one object an engine and reduction: see `model_of`
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


def model_of(scene: Scene) -> Model:
    """Return the model of a scene as it is given; R_c = R_bd + gap.

    One object for all scenes of a process that ask for the same, as long as it is one
    of the `MOST_KEPT` last; an engine's file whose content has changed is another.

    Raises
    ------
    InputError
        where the inputs do not lead to a model that double precision holds
    """
    rotor, casing, file = scene.engine.rotor, scene.engine.casing, scene.engine.file
    content, ring = content_digest(file), None
    if casing.kind != "rigid":
        source = (file, content) if casing.discretization == "file" else ("", "")
        if source[0]:
            check_lobes(*source, scene.nodal_diameter)
        ring = casing, rotor.radius + scene.gap, source
    modes = _modes_of_file(scene) if file else scene.solver.modes
    return _model(rotor, modes, file, content, ring)


def _modes_of_file(scene: Scene) -> int | None:
    """Return the fixed-interface modes of a rotor from file; None: as it comes."""
    if scene.solver.truncation == 0.0 or not has_families(scene):
        return None
    return scene.solver.modes


def has_families(scene: Scene) -> bool:
    """Whether the sectors are equal and the casing is round: no elements.

    Both bodies' modes come in families and harmonics then.
    """
    engine = scene.engine
    if not scene.has_harmonics or engine.rotor.mistuning:
        return False
    if not engine.file:
        return True
    with representable("the rotor"):
        return file_model(engine.file, content_digest(engine.file), engine.rotor).cyclic


@lru_cache(maxsize=MOST_KEPT)
def _model(
    rotor: Rotor,
    modes: int | None,
    file: str,
    content: str,
    ring: tuple[Casing, float, tuple[str, str]] | None,
) -> Model:
    """Return the model of all that it depends on; rigid casings are no part of it."""
    with representable("the rotor"):
        if file:
            body = file_model(file, content, rotor, modes)
        else:
            body = rotor_model(rotor, modes or 0)
    if ring is None:
        return Model(body, None, None, rotor.blades)
    with representable("the casing"):
        casing, operator = casing_model(*ring)
    return Model(body, casing, operator, rotor.blades)
