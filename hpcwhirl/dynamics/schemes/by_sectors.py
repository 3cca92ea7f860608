"""Which rotors of equal sectors can be integrated by nodal diameter.

They are integrated as amplitudes of modes or, if rotation couples these, of waves.
"""

from __future__ import annotations

from hpcwhirl.dynamics.waves.turning_waves import (
    diameters_of,
    is_basis,
)
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene
from hpcwhirl.structure import RingOperator


def is_cyclic(model: Model) -> bool:
    """Return whether a model's rotor can be integrated as modes by nodal diameter.

    Each mode is two waves, so that sectors must be equal, the casing
    rigid or a ring of harmonics, and rotation must not couple modes. At least three
    blades are needed, because with fewer, nodal diameter 1 has one phase but moves both
    coordinates of the centre; the model of one of several sectors that move alike has
    no centre, and may have fewer.
    """
    plain = isinstance(model.ring, RingOperator) or not model.rotor.cyclic
    plain = plain or model.rotor.spin is not None
    return not plain and (model.blades > 2 or model.folds > 1)


def has_waves(model: Model) -> bool:
    """Return whether a model's rotor can be integrated as waves by nodal diameter.

    It can with equal sectors and terms of rotation, except with fewer than three
    blades, where nodal diameter 1 has both coordinates of the centre, and with a ring
    of elements, which is not the same at every angle.
    """
    spin, alike = model.rotor.spin, not isinstance(model.ring, RingOperator)
    return alike and spin is not None and bool(spin.waves)


def folds_well(model: Model, scene: Scene) -> bool:
    """Return whether a model, perhaps of one sector, can be integrated as it is.

    A model of all sectors always can. That of one of several equal sectors with terms
    of rotation needs waves of which no two nearly coincide, and supports that are the
    same at every angle; without these, all sectors must be integrated.
    """
    spin = model.rotor.spin
    if model.folds == 1 or spin is None:
        return True
    waves = has_waves(model) and spin.support.is_plain
    return waves and is_basis(diameters_of(model, scene))
