"""Numbers of a layer on the casing that wears: depth, volume, lobes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.dynamics.kernels.layer import CUT, DEPTH
from hpcwhirl.dynamics.layer import rod_area
from hpcwhirl.scene import Scene

Floats = NDArray[np.float64]


def wear_numbers(scene: Scene, layer: Floats) -> dict[str, float | int]:
    """Return the variables `WORN` of a case, {} without a layer.

    layer : (3, M), see `dynamics.history.History`
    """
    depth = layer[DEPTH]
    if not len(depth):
        return {}
    return {
        "wear_depth": float(depth.max()),
        "wear_volume": float(depth.sum() * rod_area(scene)),
        "wear_lobes": lobes_of(depth),
        "wear_turning": float(layer[CUT].sum()),
    }


def lobes_of(depth: Floats) -> int:
    """Return the strongest harmonic, from 1 on, of depths (M,) over the angle, or 0."""
    sizes = np.abs(np.fft.rfft(depth))[1:]
    return 1 + int(sizes.argmax()) if depth.any() else 0
