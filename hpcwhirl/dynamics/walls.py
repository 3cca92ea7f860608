"""The `Wall` of the kernels: gap and shape of a casing without elastic motion."""

from __future__ import annotations

import math

import numpy as np

from hpcwhirl.case.profile import is_round, offset_of, shape_of
from hpcwhirl.dynamics.flights import can_fly
from hpcwhirl.dynamics.kernels.kernel_types import Wall
from hpcwhirl.dynamics.slots import fold
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene


def wall_of(model: Model, scene: Scene, *, released: bool = False) -> Wall:
    """Return the gap, and the harmonics of a casing's departure from the circle.

    The k lobes of a rigid casing, -A0 e^{sigma t} cos k theta with amplitude A0, come
    first.

    model, scene : of all sectors, or of one of g sectors, for which harmonics are
        divided by g
    released : whether the casing has been let go, so that its profile is a displacement
    """
    casing = scene.engine.casing
    shape = offset_of(scene) if released else shape_of(scene)
    rows = [
        (h // model.folds, a, b, 0.0, casing.profile_rise)
        for h, a, b in zip(*(part.tolist() for part in shape[:3]), strict=True)
    ]
    if casing.kind == "rigid" and casing.amplitude != 0.0:
        own = -casing.amplitude, 0.0, casing.growth, casing.rise
        rows.insert(0, (scene.nodal_diameter, *own))
    folded = [fold(row[0], model.blades) for row in rows]
    orders, slots = (
        np.array(part, dtype=np.int64)
        for part in ([row[0] for row in rows], [slot for slot, _ in folded])
    )
    numbers = np.array([row[1:] for row in rows], dtype=float).reshape(-1, 4)
    signs = np.array([sign for _, sign in folded], dtype=float)
    cosine, sine, growth, rise = (part.copy() for part in numbers.T)
    shaped = orders, slots, signs, cosine, sine, growth, rise
    return Wall(scene.gap, scene.nodal_diameter, *shaped, scene.gap - shape.depth)


def ready_at(scene: Scene) -> int:
    """Return a step at which the casing's shape has been faded in for two steps.

    It is the largest int64 (never) if a rigid casing has lobes.
    """
    if not can_fly(scene):
        return int(np.iinfo(np.int64).max)
    if is_round(scene):
        return 0
    rise = scene.engine.casing.profile_rise
    return math.ceil(rise / scene.solver.time_step) + 3
