"""Supports at the centre as a term of the kernel `points`, for both bodies as waves.

They are the supports that differ by direction or have a squeeze film, whose force on
the centre no constant matrix gives, see `kernels.standing`. In a step their force acts
on the waves that move the centre: with equal sectors those of nodal diameter 1 alone.
"""

from __future__ import annotations

import numpy as np

from hpcwhirl.arrays import Floats
from hpcwhirl.dynamics.bodies.turning import ALIKE, standing
from hpcwhirl.dynamics.kernels.loop.wave_types import PointsSupport
from hpcwhirl.dynamics.kernels.vectors import FOUR, all_aligned
from hpcwhirl.dynamics.waves.point_waves import PointWaves, real_rows
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene

LEAST = 1e-13  # share of the largest coefficient below which others are round-off
NONE = np.zeros(0)
NOTHING = PointsSupport(np.zeros(0, np.int64), 0, NONE, NONE, 0.0, 0.0, ALIKE)


def support_arrays(
    model: Model, scene: Scene, waves: PointWaves, hub: Floats, bounds: Floats
) -> PointsSupport:
    """Return the kernel's arrays of the supports' force on the centre.

    They are empty for supports without such a force.

    Parameters
    ----------
    waves : waves of both bodies
    hub : (2, m), x_o, y_o for unit modes of the rotor
    bounds : (2, 2), m/N, for unit forces in x and y: bounds of the motion of any point
        in the step in which they act, and of what they add to that in a later step
    """
    spin, body = model.rotor.spin, waves.rotor
    if spin is None or spin.support.is_plain:
        return NOTHING
    stand = standing(model, scene, body.give, hub)
    place, moving = hub @ (body.shapes - body.rises), hub @ body.moves
    own, _, _ = waves.apart
    gives = (body.gives @ hub.T).T.conj()
    rows = place, moving / (2 * scene.solver.time_step), gives
    both = np.concatenate([own, waves.half + own])
    parts = [real_rows(row) for row in rows]
    sizes = [np.abs(part).max(axis=0) for part in parts]
    felt = [size > LEAST * size.max(initial=0.0) for size in sizes]
    used = np.flatnonzero(np.any(felt, axis=0))
    extra = -len(used) % FOUR
    which = np.pad(both[used], (0, extra)).astype(np.int64)
    reads = np.pad(np.vstack(parts[:2])[:, used], ((0, 0), (0, extra)))
    arrays = all_aligned([which, reads.T.ravel(), parts[2][:, used].T.ravel()])
    nudge, rush = np.hypot(*bounds.T).tolist()
    first, *others = arrays
    return PointsSupport._make([first, len(used), *others, nudge, rush, stand])
