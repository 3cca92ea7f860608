"""A casing that is held deformed and then released: its displacement at the release.

Constant radial loads f hold it at the profile w = Phi_w Lambda^-1 Phi_w^T f, with Phi_w
the radial coordinates of its modes and Lambda their omega^2. When they vanish, it
swings freely from the displacement x = Phi Lambda^-1 Phi_w^T f, at rest. Before, it
moves about w with its usual stiffness, since constant loads add none.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.case.profile import profile_of
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene
from hpcwhirl.structure import FourierOperator

Floats = NDArray[np.float64]
NEVER = 0  # step of the release of a casing that is not let go


def release_step(scene: Scene) -> int:
    """Return the step at whose end a casing is released; `NEVER` if it is not."""
    casing = scene.engine.casing
    if casing.profile_release == 0.0 or not len(profile_of(scene).orders):
        return NEVER
    return max(1, round(casing.profile_release / scene.solver.time_step))


def held_displacement(model: Model, scene: Scene) -> Floats:
    """Return x (n,), m, static frame, of a released casing; model : of all sectors."""
    ring, casing, shape = model.ring, model.casing, profile_of(scene)
    if not isinstance(ring, FourierOperator) or casing is None:
        raise TypeError(ring)
    wanted = np.zeros(ring.width)
    for h, a, b in zip(*(part.tolist() for part in shape[:3]), strict=True):
        wanted[2 * h - 1 if h else 0] = a
        if h:
            wanted[2 * h] = b
    rows = np.flatnonzero(wanted)
    outward = casing.shapes[ring.radial[rows]]
    soft = outward / casing.omega**2
    load = np.linalg.solve(soft @ outward.T, wanted[rows])
    return np.asarray(casing.shapes @ (soft.T @ load))


def check_release(model: Model, scene: Scene) -> None:
    """Raise InputError if the modes of a released casing cannot form its profile."""
    if release_step(scene) == NEVER:
        return
    highest = int(profile_of(scene).orders.max())
    ring = model.ring
    if isinstance(ring, FourierOperator) and highest <= ring.harmonics:
        return
    most = ring.harmonics if isinstance(ring, FourierOperator) else 0
    msg = (
        "profile_release must be 0 where the profile has a harmonic in which the "
        f"casing cannot swing: {highest}, of a casing with harmonics up to {most}; "
        f"got {scene.engine.casing.profile_release:.6g} s"
    )
    raise InputError(msg)


def told_of_release(scene: Scene) -> tuple[float, ...]:
    """Return step and shape of a release, by which a saved march is identified."""
    shape = profile_of(scene)
    return release_step(scene), *shape.cosine.tolist(), *shape.sine.tolist()
