"""The harmonics of a casing that is not round, and the least gap that it leaves.

At rest the casing departs from its circle by w(theta) = sum over h of a_h cos h theta +
b_h sin h theta, outward, static frame. This is the sum of its table and of the offset e
of the rotor's axis towards alpha, -e cos(theta - alpha) for e much smaller than the
radius. An elastic casing moves about that shape with the stiffness of a round casing.

A casing may be held deformed and then released. Constant radial loads f hold it at the
profile w = Phi_w Lambda^-1 Phi_w^T f, with Phi_w the radial harmonics of its modes in
the plane of contact and Lambda their omega^2. When they vanish, it swings freely from
the displacement x = Phi Lambda^-1 Phi_w^T f, at rest. Before, it moves about w with its
usual stiffness, since constant loads add none.

A table over the angle, joined by straight lines, becomes `HIGHEST` harmonics. The
Fourier sums S of a steep edge overshoot it by some 8 % (Gibbs), on both sides; means
over the positive kernel of Fejer and Korovkin (P. Korovkin, Linear operators and
approximation theory, 1960), P, never leave the table's range, but round off its peaks.
The shape is S + a (P - S) + b: b >= 0 is such that it nowhere reaches farther inward
than the table does within `WITHIN` of the angle, and a in `MIXED` such that it differs
least from the table, see `Likeness`.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.arrays import Complexes, Floats
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene
from hpcwhirl.scene.kept_tables import HARMONICS, kept_rows
from hpcwhirl.structure import FourierOperator, RingOperator, Uniform

HIGHEST = 64  # highest harmonic that is kept of a table over angle
LEAST = 1e-9  # amplitude of a harmonic, relative to the largest, that counts as 0
AROUND = 1 << 14  # number of angles at which the least gap is searched
WITHIN = 4 * math.pi / HIGHEST  # rad, by which features of a table may be displaced
MIXED = tuple(i / 8 for i in range(9))  # shares of the positive kernel that are tried
MOST_MISSED = 0.1  # largest deviation from a table, relative to the room left there
WORTH_TELLING = 0.01  # such a deviation that the user is told
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
    missed : m, largest deviation of the harmonics from the user's table of the shape
        over angle, see `Likeness`; 0 for a table of harmonics
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
    for h, value in (
        _series(table, math.copysign(1.0, scale)).items() if scale != 0.0 else ()
    ):
        parts[h] = parts.get(h, 0j) + scale * value
    orders = np.array(sorted(parts), dtype=np.int64)
    values = np.array([parts[h] for h in orders.tolist()], dtype=complex)
    shape = Shape(orders, values.real.copy(), values.imag.copy(), 0.0, 0.0)
    for part in shape[:3]:
        part.flags.writeable = False
    return shape._replace(depth=_depth(shape), missed=_missed(table, scale))


@lru_cache(maxsize=MOST_KEPT)
def _series(table: str, sense: float) -> dict[int, complex]:
    """Return the Fourier coefficients {h: a + i b}, m, of a casing's profile.

    table : text of the input `profile`: a table of harmonics, or of departures over
        angle
    sense : 1.0, or -1.0 where a factor < 0 exchanges inward and outward
    """
    rows = kept_rows(table)
    if table.startswith(HARMONICS):
        return {
            int(h): complex(size * math.cos(phase), size * math.sin(phase))
            for h, size, phase in rows
        }
    if not rows:
        return {}
    values = sense * _likeness(table, sense).values
    most = np.abs(values).max()
    found = enumerate(values.tolist())
    return {h: value for h, value in found if abs(value) > LEAST * most}


class Likeness(NamedTuple):
    """Harmonics of a table over the angle, and how far they are from it.

    Attributes
    ----------
    values : (HIGHEST + 1,), a + i b of each harmonic, m
    table : (AROUND,), m, departure by the table at equally spaced angles from 0
    missed : (AROUND,), m, deviation of the shape there, inward or outward: how far it
        lies outside the values that the table has within `WITHIN`, or the table
        outside those that the shape has
    """

    values: Complexes
    table: Floats
    missed: Floats


@lru_cache(maxsize=MOST_KEPT)
def _likeness(table: str, sense: float) -> Likeness:
    """Return the harmonics that are most like a table over the angle.

    table, sense : see `_series`; the departures are times `sense`
    """
    rows = np.array(kept_rows(table)) * (1.0, sense)
    angles, values = rows.T
    around = 2 * math.pi / AROUND * np.arange(AROUND)
    with np.errstate(over="ignore", invalid="ignore"):  # huge shapes are refused
        wanted = np.interp(around, angles, values, period=2 * math.pi)
        sums = _of_lines(rows)
        means = _korovkin() * sums
        tried = [_raised(sums + share * (means - sums), wanted) for share in MIXED]
    return min(tried, key=lambda one: float(one.missed.max()))


def _raised(values: Complexes, wanted: Floats) -> Likeness:
    """Return harmonics as a `Likeness`, raised so far that they narrow no gap.

    values, wanted : (HIGHEST + 1,), a + i b, m; (AROUND,), departure by the table, m
    """
    shape = np.fft.irfft(values.conj() / 2, AROUND) * AROUND
    shape += values[0].real / 2
    least, most = _extremes_near(wanted)
    orders = np.arange(HIGHEST + 1)
    rise = max(float((least - shape).max()) + _between(orders, np.abs(values)), 0.0)
    shape += rise
    low, high = _extremes_near(shape)
    parts = shape - most, low - wanted, wanted - high
    missed = np.maximum.reduce([*parts, np.zeros(AROUND)])
    return Likeness(values + rise * (orders == 0), wanted, missed)


def _extremes_near(values: Floats) -> tuple[Floats, Floats]:
    """Return the least and the largest of values around a circle within `WITHIN`."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d  # slow to import

    size = 2 * int(WITHIN * AROUND / (2 * math.pi)) + 1
    low = minimum_filter1d(values, size, mode="wrap")
    return low, maximum_filter1d(values, size, mode="wrap")


def _korovkin() -> Floats:
    """Return the factor of each harmonic in the kernel of Fejer and Korovkin."""
    h, n = np.arange(HIGHEST + 1), HIGHEST + 2
    after = (n - h + 1) * np.sin((h + 1) * math.pi / n)
    before = (n - h - 1) * np.sin((h - 1) * math.pi / n)
    return np.asarray((after - before) / (2 * n * math.sin(math.pi / n)))


def _of_lines(rows: Floats) -> Complexes:
    """Return the Fourier coefficients a + i b of a piecewise linear profile, m.

    They are (HIGHEST + 1,), of harmonics from 0. The second derivative is a kink s_i,
    the change of slope, at each angle theta_i: for a harmonic h > 0 the coefficient of
    e^{ih theta}, half of a - i b, is -sum s_i e^{-ih theta_i} / (2 pi h^2).

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
    return np.concatenate([[mean], own])


def _depth(shape: Shape) -> float:
    """Return an upper bound of the largest inward departure of a shape, m.

    It follows from values of the departure w at many angles, and a bound of |w''|.
    """
    spacing = 2 * math.pi / AROUND
    lowest = float(departure(shape, spacing * np.arange(float(AROUND))).min())
    sizes = np.hypot(shape.cosine, shape.sine)
    return max(0.0, _between(shape.orders, sizes) - lowest)


def _between(orders: Any, sizes: Floats) -> float:
    """Return by how much a shape may be lower between `AROUND` angles than at them, m.

    It follows from a bound of |w''|; orders, sizes : (n,), h; m, amplitudes
    """
    with np.errstate(over="ignore"):  # a huge shape is refused by its depth
        bent = float((np.asarray(orders, dtype=float) ** 2 * sizes).sum())
    return bent * (2 * math.pi / AROUND) ** 2 / 8


def _missed(table: str, scale: float) -> float:
    """Return the largest deviation, m, of a profile from its table over the angle.

    It is 0 for a table of harmonics.

    table, scale : text of the input `profile`; factor on the departures in it
    """
    if not table or table.startswith(HARMONICS):
        return 0.0
    return abs(scale) * float(_likeness(table, math.copysign(1.0, scale)).missed.max())


def missed_share(scene: Scene) -> float:
    """Return the largest deviation of a profile from its table, relative to the room.

    The room is that between blades and casing at the same angle by the table; where
    the casing is nearer than its circle, the gap. Without a gap it is relative to the
    table's range.
    """
    table, scale = scene.engine.casing.profile, scene.engine.casing.profile_scale
    if _missed(table, scale) == 0.0:
        return 0.0
    found, size = _likeness(table, math.copysign(1.0, scale)), abs(scale)
    with np.errstate(over="ignore", invalid="ignore"):
        least = scene.gap or size * float(np.ptp(found.table))
        room = least + size * np.maximum(found.table, 0.0)
        share = float((size * found.missed / room).max())
    return share if math.isfinite(share) else math.inf


def told_of_profile(scene: Scene) -> str:
    """Return a remark on a profile whose deviation from its table counts, else ""."""
    share = missed_share(scene)
    if share <= WORTH_TELLING:
        return ""
    missed = profile_of(scene).missed
    return (
        f"profile: its {HIGHEST} harmonics deviate from its table by up to "
        f"{1e3 * missed:.3g} mm within {WITHIN:.2g} rad, {share:.1%} of the gap there"
    )


def release_step(scene: Scene) -> int:
    """Return the time step at whose end a casing is released; `NEVER` if it is not."""
    casing = scene.engine.casing
    if casing.profile_release == 0.0 or not len(profile_of(scene).orders):
        return NEVER
    return max(1, round(casing.profile_release / scene.solver.time_step))


class HeldShape(NamedTuple):
    """Shape in which radial loads in the casing's plane of contact hold it.

    Attributes
    ----------
    rows : (n, c), give n amplitudes of harmonics of the radial displacement from the
        casing's c coordinates
    values : (n,), m, what these amplitudes are in the shape
    """

    rows: Floats
    values: Floats

    def amplitudes(self, omega: Floats, shapes: Floats) -> Floats:
        """Return the modal amplitudes, (m,), from which a released casing swings.

        They are Lambda^-1 Phi_w^T f, with loads f such that the shape is w.

        omega, shapes : (m,), rad/s; (c, m), of its modes
        """
        outward = self.rows @ shapes
        soft = outward / omega**2
        load = np.linalg.solve(soft @ outward.T, self.values)
        return np.asarray(soft.T @ load)


def held_shape(model: Model, scene: Scene) -> HeldShape:
    """Return the shape in which a casing is held until it is released.

    model : model of all sectors
    """
    ring, shape = model.ring, profile_of(scene)
    if ring is None:
        raise TypeError(ring)
    waves = ring.waves()
    found = [
        (waves[h, part], value)
        for h, *values in zip(*(part.tolist() for part in shape[:3]), strict=True)
        for part, value in enumerate(values)
        if value != 0.0
    ]
    rows, values = zip(*found, strict=True)
    return HeldShape(np.array(rows), np.array(values))


def check_release(model: Model, scene: Scene) -> None:
    """Raise InputError if a released casing cannot swing from its profile.

    Its modes must form the profile, and do so at all places that the blades touch.
    """
    if release_step(scene) == NEVER or model.ring is None:
        return
    ring, time = model.ring, scene.engine.casing.profile_release
    highest, most = int(profile_of(scene).orders.max()), highest_wave(ring)
    if highest > most:
        raise InputError(
            "profile_release must be 0 where the profile has a harmonic in which the "
            f"casing cannot swing: {highest}, of a casing with harmonics up to {most}; "
            f"got {time:.6g} s"
        )
    if isinstance(ring, FourierOperator) and not isinstance(ring.axial, Uniform):
        raise InputError(
            "profile_release must be 0 where blades with several contact points touch "
            "a casing that varies along its axis, since it is held at one place along "
            f"it; got {time:.6g} s"
        )


def highest_wave(ring: RingOperator | FourierOperator) -> int:
    """Return the highest harmonic of radial displacement that a casing has in full."""
    if isinstance(ring, FourierOperator):
        return ring.harmonics
    return (ring.elements - 1) // 2


def told_of_release(scene: Scene) -> tuple[float, ...]:
    """Return the numbers of a casing's release, which must agree with a saved state's.

    They are the step of the release, then a and b of the profile's harmonics, m.
    """
    shape = profile_of(scene)
    return release_step(scene), *shape.cosine.tolist(), *shape.sine.tolist()
