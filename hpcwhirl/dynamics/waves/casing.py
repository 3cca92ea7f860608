"""What kernels need of the casing besides its elastic motion, and its stored trace.

The wall (`kernels.kernel_types.Wall`) is the clearance and the shape of a casing
without elastic motion. The trace has, for each sample, the harmonics of the radial
displacement in the static frame. Kernels store the casing's coordinates unchanged; they
are converted to harmonics once per case, when its history is read.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from hpcwhirl.arrays import Floats
from hpcwhirl.case.profile import is_round, offset_of, shape_of
from hpcwhirl.dynamics.kernels.kernel_types import Wall
from hpcwhirl.dynamics.kernels.shape import trace_shape
from hpcwhirl.dynamics.waves.flights import can_fly
from hpcwhirl.dynamics.waves.slots import fold
from hpcwhirl.reduction.model import MOST_KEPT, Model
from hpcwhirl.reduction.modes import ModalModel
from hpcwhirl.scene import Scene
from hpcwhirl.structure import FourierOperator, RingOperator


def wall_of(model: Model, scene: Scene, *, released: bool = False) -> Wall:
    """Return the clearance, and the harmonics of a casing's departure from the circle.

    The k lobes of a rigid casing, -A0 e^{sigma t} cos k theta with amplitude A0, come
    first.

    model, scene : of all sectors, or of one of g sectors, for which the orders of
        harmonics are divided by g
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
    gap, lobes = scene.gap, scene.nodal_diameter
    wall = _shaped(tuple(rows), model.blades)
    return wall._replace(gap=gap, lobes=lobes, room=gap - shape.depth)


@lru_cache(maxsize=MOST_KEPT)
def _shaped(rows: tuple[tuple[float, ...], ...], blades: int) -> Wall:
    """Return harmonics of a casing's shape as a `Wall` without clearance; cached.

    rows : order, cosine part, sine part, growth and rise of each harmonic
    """
    folded = [fold(int(row[0]), blades) for row in rows]
    orders, slots = (
        np.array(part, dtype=np.int64)
        for part in ([row[0] for row in rows], [slot for slot, _ in folded])
    )
    numbers = np.array([row[1:] for row in rows], dtype=float).reshape(-1, 4)
    signs = np.array([sign for _, sign in folded], dtype=float)
    cosine, sine, growth, rise = (part.copy() for part in numbers.T)
    return Wall(0.0, 0, orders, slots, signs, cosine, sine, growth, rise, 0.0)


def ready_at(scene: Scene) -> int:
    """Return the first step from which the exact flow may jump: the shape has faded in.

    The casing's shape has then been constant for two steps. It is the largest int64
    (never) if a rigid casing has lobes.
    """
    if not can_fly(scene):
        return int(np.iinfo(np.int64).max)
    if is_round(scene):
        return 0
    rise = scene.engine.casing.profile_rise
    return math.ceil(rise / scene.solver.time_step) + 3


def waves_of_ring(model: Model, values: Floats, *, of_modes: bool) -> Floats:
    """Return the harmonics of a casing's radial displacement at n samples.

    They are (n, H + 1, 2), m: cosine and sine part of harmonics 0 .. H.

    values, of_modes : (n, ...), amplitudes of the casing's modes, or displacements of
        its coordinates, m; which of the two
    """
    if model.casing is None or model.ring is None:
        raise TypeError(model)
    rows = _rows(model.casing, model.ring) if of_modes else model.ring.waves()
    # for a ring of harmonics most entries of `rows` are 0; BLAS is avoided, since its
    # sums may depend on the number of samples
    out = np.zeros((len(values), *rows.shape[:2]))
    if not len(values):
        return out
    for h, p in np.ndindex(*rows.shape[:2]):
        nonzero = np.flatnonzero(rows[h, p])
        out[:, h, p] = (values[:, nonzero] * rows[h, p, nonzero]).sum(axis=1)
    return out


@lru_cache(maxsize=MOST_KEPT)
def _rows(body: ModalModel, ring: RingOperator | FourierOperator) -> Floats:
    """Return the harmonics of the casing's radial displacement in each of its m modes.

    They are (H + 1, 2, m), for unit amplitude of each mode: cosine and sine part of
    harmonics 0 .. H.

    body, ring : modes of the casing; its contact operator
    """
    return np.asarray(ring.waves() @ body.shapes)


def waves_of_rigid(model: Model, scene: Scene, count: int, stride: int) -> Floats:
    """Return the harmonics of a rigid casing's shape at `count` samples.

    They are (count, H + 1, 2), m: cosine and sine part of harmonics 0 .. H. H is that
    of an elastic ring with these inputs, or the highest one of the shape if larger.

    stride : steps between samples
    """
    out = np.zeros((count, _highest(scene) + 1, 2))
    times = stride * np.arange(1, count + 1) * scene.solver.time_step
    trace_shape(wall_of(model, scene), times, out)
    return out


def unfolded(waves: Floats, folds: int, scene: Scene) -> Floats:
    """Return harmonics (n, H + 1, 2), m, of the whole casing from those of one sector.

    Parameters
    ----------
    waves : (n, H' + 1, 2), m, cosine and sine parts of n samples: harmonics 0 .. H' in
        the angle g theta. H is the highest one of the whole casing
    folds : g, number of sectors
    scene : scene of all sectors, not of one
    """
    out = np.zeros((len(waves), _highest(scene) + 1, 2))
    multiples = out[:, ::folds]
    multiples[:] = waves[:, : multiples.shape[1]]
    return out


def _highest(scene: Scene) -> int:
    casing = scene.engine.casing
    ring = casing.harmonics
    if casing.discretization == "elements":
        ring = casing.elements // 2
    highest: int = shape_of(scene).orders.max(initial=0)
    return int(max(ring, scene.nodal_diameter, highest))
