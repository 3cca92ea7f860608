"""Coefficients of the exact scheme's jumps over steps without contact, and bounds.

A jump replaces many free steps by one; bounds of the motion tell how long it may be,
see `kernels.loop.flight`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.arrays import Complexes
from hpcwhirl.scene import Scene

LONGEST = 10  # exponent: jumps of 1, 2, 4, ... 2^LONGEST steps have coefficients


def die_out(ahead: Complexes, push: NDArray[Any]) -> bool:
    """Return whether all free motion of a body's waves decays.

    Waves that do not change (z = 1) and that contact does not excite are left out.

    ahead : (waves,), z - 1 of each wave, z the factor of its amplitude in a step
    push : (r, waves), change of each wave by contact forces
    """
    pushed = np.asarray(push.any(axis=0))
    less = 2 * ahead.real + ahead.real**2 + ahead.imag**2  # |z|^2 - 1, not cancelling
    return bool((less < 0.0).all(where=pushed | (ahead != 0.0)))


def can_fly(scene: Scene) -> bool:
    """Return whether gaps change only by free motion while no blade touches.

    Lobes of a rigid casing change the gaps, too: then there are no jumps.
    """
    casing = scene.engine.casing
    return casing.kind == "ring" or casing.amplitude == 0.0
