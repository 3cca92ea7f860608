"""The pulse on the casing as a load on its coordinates."""

from __future__ import annotations

import numpy as np

from hpcwhirl.arrays import Floats
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene
from hpcwhirl.structure import FourierOperator, RingOperator


def lobe_load(
    ring: RingOperator | FourierOperator, lobes: int, direction: str
) -> Floats:
    """Return a ring's load vector (n,), dimensionless, of a unit force on k lobes.

    ring, lobes : contact operator of the ring; k
    direction : "squeeze", inward where cos k theta = 1, or "stretch"
    """
    sign = -1.0 if direction == "squeeze" else 1.0
    return sign * ring.lobes(lobes)


def pulse_load(model: Model, scene: Scene) -> Floats:
    """Return the casing's load vector (n,), dimensionless, of a pulse of unit force."""
    if model.ring is None:
        return np.zeros(0)
    return lobe_load(model.ring, scene.nodal_diameter, scene.direction)
