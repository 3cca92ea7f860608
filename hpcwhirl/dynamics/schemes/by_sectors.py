"""Which rotors of equal sectors can be integrated by nodal diameter.

They are integrated as amplitudes of modes or, if rotation couples these, of waves.
"""

from __future__ import annotations

from hpcwhirl.case.speed import law_of
from hpcwhirl.dynamics.waves.turning_waves import (
    diameters_of,
    is_basis,
)
from hpcwhirl.reduction.model import Model, has_waves
from hpcwhirl.scene import Scene


def folds_well(model: Model, scene: Scene) -> bool:
    """Return whether a model, perhaps of one sector, can be integrated as it is.

    A model of all sectors always can. That of one of several equal sectors with terms
    of rotation needs waves of which no two nearly coincide, supports that are the same
    at every angle, and a constant speed; without these, all sectors must be integrated.
    """
    spin = model.rotor.spin
    if model.folds == 1 or spin is None:
        return True
    waves = has_waves(model) and spin.is_plain and law_of(scene) is None
    return waves and is_basis(diameters_of(model, scene))
