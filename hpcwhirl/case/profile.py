"""The harmonics of a casing that is not round, and the least gap that it leaves.

At rest the casing departs from its circle by w(theta) = sum over h of a_h cos h theta +
b_h sin h theta, outward, static frame. This is the sum of its table and of the offset e
of the rotor's axis towards alpha, -e cos(theta - alpha) for e much smaller than the
radius. An elastic casing moves about that shape with the stiffness of a round casing.

A casing may be held deformed and then released. Constant radial loads f hold it at the
profile w = Phi_w Lambda^-1 Phi_w^T f, with Phi_w the radial coordinates of its modes
and Lambda their omega^2. When they vanish, it swings freely from the displacement
x = Phi Lambda^-1 Phi_w^T f, at rest. Before, it moves about w with its usual stiffness,
since constant loads add none.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.arrays import Floats
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene
from hpcwhirl.scene.kept_tables import HARMONICS, kept_rows
from hpcwhirl.structure import FourierOperator

HIGHEST = 64  # highest harmonic that is kept of a table over angle
LEAST = 1e-9  # amplitude of a harmonic, relative to the largest, that counts as 0
AROUND = 1 << 14  # number of angles at which the least gap is searched
MOST_KEPT = 64  # number of cached shapes
NEVER = 0  # step of the release of a casing that is not let go


class Shape(NamedTuple):
    """A casing's departure from a circle, sum of a cos h theta + b sin h theta, m.

    It is > 0 outward; the arrays are read-only.

    Attributes
    ----------
    orders : (n,), orders h of its n harmonics, ascending
    cosine, sine : (n,), a and b, m
    depth : m, largest departure inward at any angle; 0 if there is none
    missed : m, largest difference between the harmonics and the user's table of the
        shape over angle, at its angles; 0 for a table of harmonics
    """

    orders: NDArray[np.int64]
    cosine: Floats
    sine: Floats
    depth: float
    missed: float


def is_round(scene: Scene) -> bool:
    """Return whether a scene's casing is round and its axis is that of the rotor."""
    casing = scene.engine.casing
    shaped = casing.profile != "" and casing.profile_scale != 0.0
    return not shaped and casing.offset == 0.0


def shape_of(scene: Scene) -> Shape:
    """Return the shape of a scene's casing by profile and offset, both at full size."""
    casing = scene.engine.casing
    shift = casing.offset, casing.offset_angle
    return _shape(casing.profile, casing.profile_scale, *shift)


def profile_of(scene: Scene) -> Shape:
    """Return the shape of a scene's casing by its input `profile`, without offset."""
    casing = scene.engine.casing
    return _shape(casing.profile, casing.profile_scale, 0.0, 0.0)


def offset_of(scene: Scene) -> Shape:
    """Return the shape of a scene's casing by its offset alone.

    It stays when the casing is released from its profile.
    """
    casing = scene.engine.casing
    return _shape("", 1.0, casing.offset, casing.offset_angle)


def room_of(scene: Scene) -> float:
    """Return the least gap of tips and casing over all angles, m, at the start.

    Casing and tips are undeflected, the casing's shape has full size.
    """
    return scene.gap - shape_of(scene).depth


def departure(shape: Shape, angles: Floats) -> Floats:
    """Return the departure of a casing's shape from a circle at n angles, (n,), m.

    It is > 0 outward.

    angles : (n,), rad, static frame
    """
    waves = np.multiply.outer(angles, shape.orders)
    return np.asarray(np.cos(waves) @ shape.cosine + np.sin(waves) @ shape.sine)


def departure_at_start(scene: Scene, angles: Floats) -> Floats:
    """Return the casing's departure from a circle at time 0 at n angles, (n,), m.

    It is > 0 outward, and includes the lobes of a rigid casing.

    angles : (n,), rad, static frame
    """
    casing, out = scene.engine.casing, np.zeros(len(angles))
    if casing.profile_rise == 0.0 and not is_round(scene):
        out += departure(shape_of(scene), angles)
    if casing.kind == "rigid" and casing.rise == 0.0:
        out -= casing.amplitude * np.cos(scene.nodal_diameter * angles)
    return out


@lru_cache(maxsize=MOST_KEPT)
def _shape(table: str, scale: float, offset: float, angle: float) -> Shape:
    parts = {1: complex(offset * math.cos(angle), offset * math.sin(angle)) * -1.0}
    parts = parts if offset > 0.0 else {}
    for h, value in _series(table).items() if scale != 0.0 else ():
        parts[h] = parts.get(h, 0j) + scale * value
    orders = np.array(sorted(parts), dtype=np.int64)
    values = np.array([parts[h] for h in orders.tolist()], dtype=complex)
    shape = Shape(orders, values.real.copy(), values.imag.copy(), 0.0, 0.0)
    for part in shape[:3]:
        part.flags.writeable = False
    return shape._replace(depth=_depth(shape), missed=_missed(table, scale))


@lru_cache(maxsize=MOST_KEPT)
def _series(table: str) -> dict[int, complex]:
    """Return the Fourier coefficients {h: a + i b}, m, of a casing's profile.

    table : text of the input `profile`: a table of harmonics, or of departures over
        angle
    """
    rows = kept_rows(table)
    if table.startswith(HARMONICS):
        return {
            int(h): complex(size * math.cos(phase), size * math.sin(phase))
            for h, size, phase in rows
        }
    return _of_lines(np.array(rows)) if rows else {}


def _of_lines(rows: Floats) -> dict[int, complex]:
    """Return the Fourier coefficients {h: a + i b}, m, of a piecewise linear profile.

    The second derivative is a kink s_i, the change of slope, at each angle theta_i: for
    a harmonic h > 0 the coefficient of e^{ih theta}, half of a - i b, is -sum s_i
    e^{-ih theta_i} / (2 pi h^2).

    rows : (p, 2), angle, rad, and departure, m, of p points joined by straight lines
    """
    angles, values = rows.T
    widths = np.diff(angles, append=angles[0] + 2 * math.pi)
    after = np.roll(values, -1)
    slopes = (after - values) / widths
    kinks = slopes - np.roll(slopes, 1)
    orders = np.arange(1, HIGHEST + 1)
    turns = np.exp(1j * np.multiply.outer(orders, angles))
    own = -(turns @ kinks) / (math.pi * orders**2)
    mean = float((widths * (values + after)).sum() / (4 * math.pi))
    found = {0: complex(mean), **dict(zip(orders.tolist(), own.tolist(), strict=True))}
    most = max(map(abs, found.values()))
    return {h: value for h, value in found.items() if abs(value) > LEAST * most}


def _depth(shape: Shape) -> float:
    """Return an upper bound of the largest inward departure of a shape, m.

    It follows from values of the departure w at many angles, and a bound of |w''|.
    """
    spacing = 2 * math.pi / AROUND
    lowest = float(departure(shape, spacing * np.arange(float(AROUND))).min())
    sizes = np.hypot(shape.cosine, shape.sine)
    with np.errstate(over="ignore"):  # a huge shape is refused by its depth
        bent = float((shape.orders.astype(float) ** 2 * sizes).sum())
    return max(0.0, bent * spacing**2 / 8 - lowest)


def _missed(table: str, scale: float) -> float:
    """Return the largest difference, m, between a profile's table and its harmonics.

    It is 0 for a table of harmonics.

    table, scale : text of the input `profile`; factor on the departures in it
    """
    if not table or table.startswith(HARMONICS):
        return 0.0
    angles, values = np.array(kept_rows(table)).T
    series = _series(table)
    orders, parts = np.array(list(series)), np.array(list(series.values()))
    waves = np.exp(-1j * np.multiply.outer(angles, orders))
    return abs(scale) * float(np.abs((waves * parts).real.sum(axis=1) - values).max())


def release_step(scene: Scene) -> int:
    """Return the time step at whose end a casing is released; `NEVER` if it is not."""
    casing = scene.engine.casing
    if casing.profile_release == 0.0 or not len(profile_of(scene).orders):
        return NEVER
    return max(1, round(casing.profile_release / scene.solver.time_step))


def held_displacement(model: Model, scene: Scene) -> Floats:
    """Return the displacement of a casing, (n,), m, from which it swings when released.

    It is that of the n coordinates of the casing's model, static frame.

    model : model of all sectors
    """
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
    raise InputError(
        "profile_release must be 0 where the profile has a harmonic in which the "
        f"casing cannot swing: {highest}, of a casing with harmonics up to {most}; "
        f"got {scene.engine.casing.profile_release:.6g} s"
    )


def told_of_release(scene: Scene) -> tuple[float, ...]:
    """Return the numbers of a casing's release, which must agree with a saved state's.

    They are the step of the release, then a and b of the profile's harmonics, m.
    """
    shape = profile_of(scene)
    return release_step(scene), *shape.cosine.tolist(), *shape.sine.tolist()
