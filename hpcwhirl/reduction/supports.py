"""What holds the shaft's centre: supports that do not rotate, and the shaft itself.

Any bearing with eight coefficients, X, Y being the rotor's centre in the static frame,

F_x = -(k_xx X + k_xy Y) - (c_xx X' + c_xy Y'), F_y = -(k_yx X + k_yy Y) - ...,

is given, in Z = X + i Y, by four complex numbers, F = -k Z - c Z' - k_d conj(Z) - c_d
conj(Z'):

    2 k = k_xx + k_yy + i (k_yx - k_xy), 2 k_d = k_xx - k_yy + i (k_yx + k_xy)

and c correspondingly. k and c are the same in all directions; k_d and c_d are not. In
the rotating frame, Z = z e^{i Omega t},

f = -(k + i Omega c) z - c z'
    - [(k_d - i Omega c_d) conj(z) + c_d conj(z')] e^{-2 i Omega t},

so that the second part depends on time. A squeeze film adds its c_0 to c; its
additional damping away from the middle is treated separately in the time integration.

In a squeeze film, a ring of radius R and length L, which does not rotate, moves by e =
eps c in a film of viscosity mu and clearance c. Reynolds' equation for a short film (L
much shorter than the radius, open ends, no inertia, no cavitation, full film) gives

p = 6 mu (z^2 - L^2/4) h' / h^3, h = c - e cos theta,

and, integrated over the film, a damper that depends on eps (J. Vance, F. Zeidan,
B. Murphy, Machinery Vibration and Rotordynamics, 2010, ch. 6; L. San Andres, Modern
Lubrication Theory, notes 13):

F_r = -c_0 (1 + 2 eps^2) / (1 - eps^2)^{5/2} e',
F_t = -c_0 / (1 - eps^2)^{3/2} e phi', c_0 = pi mu R (L / c)^3.

It has no stiffness. In terms of the velocity V of Z in the static frame, this is F =
-c_m V - c_d (Z / c)^2 conj(V); c_0 is the damping of small motions about the middle.

A shaft on which the disk tilts gives the reduced matrices of its rotor further
coordinates, the last ones: the slopes phi_x, phi_y of the shaft at the disk or, in
nodal diameter 1, conj(phi), as for the centre; then those of a shaft with mass. See
`structure.mount`.

If a rotor from file is held only by equal springs k_o at its centre, its response to a
steady unit force at the centre is a rigid translation by 1 / k_o, which strains only
the springs. So the steady response of tips and centre gives k_o and, since the motion
of each tip in a translation is known, a check of the tips and the centre that the file
names.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from hpcwhirl.arrays import Complexes, Floats, Indices
from hpcwhirl.reduction.bearing_laws import (
    Journal,
    Law,
    Rolling,
    force_at,
    linearised,
)
from hpcwhirl.reduction.numbers import zero_between
from hpcwhirl.structure import LineSupport, Mount
from hpcwhirl.structure.shaft import STOP

NONE, NO_COLUMNS = np.zeros(1), np.zeros((1, 8))  # a table of speeds without numbers
CLOSED = 0.99  # eps beyond which damping is taken as constant
OFF = 0.1  # relative increase of the damping up to which c_0 is a fair approximation
RIGID = 0.01  # largest relative deviation from a translation; left-out modes cause it


@dataclass(frozen=True)
class Support:
    """Springs and dampers of the shaft's centre, static frame, with the same values.

    Their force on the centre is F = -k Z - c Z' - k_d conj(Z) - c_d conj(Z').

    For a rotor that turns clockwise they are mirrored, so that a cross-coupled
    stiffness drives the same whirl, forward or backward, in both senses of rotation.

    Attributes
    ----------
    stiffness : k, N/m, in addition to the springs in the rotor's own matrix
    damping : c, N s/m
    stiffness_apart, damping_apart : k_d, c_d, by which directions differ
    film, clearance : damping c_0, N s/m, of a squeeze film, which c includes, and its
        clearance, m; 0: no film
    bearing, spring, speed, place : law of a journal or rolling bearing, of which the
        others are the linearisation; stiffness that the rotor's own matrix has in its
        place; rad/s, and displacement in equilibrium, m, static frame, of the
        linearisation
    stop, rub : clearance, m, of a ring that stops the rotor there, 0: none; its
        coefficient of friction
    """

    stiffness: complex = 0j
    damping: complex = 0j
    stiffness_apart: complex = 0j
    damping_apart: complex = 0j
    film: float = 0.0
    clearance: float = 0.0
    bearing: Law | None = None
    spring: float = 0.0
    speed: float = 0.0
    place: complex = 0j
    stop: float = 0.0
    rub: float = 0.0

    @property
    def is_round(self) -> bool:
        """Whether stiffness and damping are the same in all directions.

        Those of a squeeze film are so in small motions.
        """
        return self.stiffness_apart == 0.0 == self.damping_apart

    @property
    def is_plain(self) -> bool:
        """Whether the supports' matrices in the rotating frame are constant in time."""
        return self.is_linear and self.stop == 0.0

    @property
    def is_linear(self) -> bool:
        """Whether the matrices have all its force but that of a stop."""
        return self.is_round and self.film == 0.0 and self.bearing is None

    def at(self, speed: float) -> Support:
        """Return the supports at a speed, rad/s: mirrored if it is clockwise."""
        return _mirrored(self) if speed < 0.0 else self

    def turning(self, speed: float) -> complex:
        """Return k + i Omega c, N/m, by which the supports resist a displacement z.

        z = x_o + i y_o is that of the centre in the rotating frame, in which the force
        on it is -(k + i Omega c) z - c z'; speed : Omega, rad/s
        """
        return self.stiffness + 1j * speed * self.damping

    def drawn_at(self, place: complex) -> complex:
        """Return F_0 = F(Z, 0) + k Z of a bearing, N, static frame; else 0.

        It is what the bearing's force at rest has beyond that of its mean stiffness.

        place : Z, m, static frame
        """
        if self.bearing is None:
            return 0j
        held = self.stiffness + self.spring
        return force_at(self.bearing, place, self.speed) + held * place

    def force(self, place: complex, rate: complex) -> complex:
        """Return the force on the rotor, F_x + i F_y, N, static frame.

        place, rate : Z and Z' of the rotor there, m, m/s, static frame
        """
        force = -self.stiffness * place - self.damping * rate
        force -= self.stiffness_apart * place.conjugate()
        force -= self.damping_apart * rate.conjugate()
        size = abs(place)
        if self.film == 0.0 or size == 0.0:
            return force
        along, across = film_shares(size / self.clearance)
        way = place / size
        outward = (rate * way.conjugate()).real * way
        more = (along - 1.0) * outward + (across - 1.0) * (rate - outward)
        return force - self.film * more

    def stiffest(self, speed: float) -> float:
        """Return the stiffness against z in the direction in which it is largest, N/m.

        speed : Omega, rad/s
        """
        apart = abs(self.stiffness_apart) + abs(speed * self.damping_apart)
        return self.turning(speed).real + apart


def _mirrored(own: Support) -> Support:
    """Return the mirror image, Y -> -Y, of supports."""
    return replace(
        own,
        stiffness=own.stiffness.conjugate(),
        damping=own.damping.conjugate(),
        stiffness_apart=own.stiffness_apart.conjugate(),
        damping_apart=own.damping_apart.conjugate(),
    )


def planar(factor: complex) -> Floats:
    """Return a complex factor as the real matrix (2, 2) that acts on (x, y).

    The matrix does to (x, y) what the factor does to x + i y.
    """
    return np.array([[factor.real, -factor.imag], [factor.imag, factor.real]])


@dataclass(frozen=True, eq=False)
class Bearing:
    """Springs and dampers of the shaft's centre that depend on the speed, from a table.

    Each of the eight coefficients is interpolated by itself between the table's speeds,
    by a monotone cubic (PCHIP): it stays between the values of the two rows. Beyond the
    table its end values hold, but only in searches over the speed: a case at such a
    speed is refused. A table of one row holds at all speeds. For a rotor that turns
    clockwise the supports are mirrored.

    Attributes
    ----------
    speeds : (n,), rad/s, ascending
    columns : (n, 8), k_xx, k_xy, k_yx, k_yy, N/m, and c_xx, ..., N s/m, at each speed
    spring : k_o, N/m, which is in the rotor's matrix and replaced by the table
    """

    speeds: Floats
    columns: Floats
    spring: float = 0.0

    @property
    def range(self) -> tuple[float, float]:
        """The least and the largest magnitude of the speed that the table covers."""
        if len(self.speeds) == 1:
            return 0.0, math.inf
        return float(self.speeds[0]), float(self.speeds[-1])

    @cached_property
    def is_round(self) -> bool:
        """Whether the supports are the same in all directions, at every speed."""
        xx, xy, yx, yy = np.moveaxis(self.columns.reshape(-1, 2, 4), 2, 0)
        return bool((xx == yy).all() and (xy == -yx).all())

    @property
    def is_plain(self) -> bool:
        """Whether the supports' matrices in the rotating frame are constant in time."""
        return self.is_round

    def coefficients(self, speed: float) -> Floats:
        """Return the eight coefficients at the magnitude of a speed, rad/s, (8,)."""
        if len(self.speeds) == 1:
            return np.asarray(self.columns[0])
        inside = float(np.clip(abs(speed), self.speeds[0], self.speeds[-1]))
        after = int(np.clip(np.searchsorted(self.speeds, inside), 1, None))
        rows = self.columns[after - 1 : after + 1]
        between = self._over_speed(inside)
        return np.asarray(np.clip(between, rows.min(axis=0), rows.max(axis=0)))

    @cached_property
    def _over_speed(self) -> Any:
        from scipy.interpolate import PchipInterpolator  # slow to import

        return PchipInterpolator(self.speeds, self.columns)

    def at(self, speed: float) -> Support:
        """Return the springs and dampers at a speed, rad/s."""
        (k, k_d), (c, c_d) = map(_by_direction, self.coefficients(speed).reshape(2, 4))
        if self.is_round:
            k_d = c_d = 0j
        return Support(k - self.spring, c, k_d, c_d).at(speed)


def _by_direction(four: Floats) -> tuple[complex, complex]:
    """Return (k, k_d) of four coefficients k_xx, k_xy, k_yx, k_yy, see the module."""
    xx, xy, yx, yy = map(float, four)
    return complex(xx + yy, yx - xy) / 2, complex(xx - yy, yx + xy) / 2


def bearing_of(rows: list[tuple[float, ...]], spring: float) -> Bearing:
    """Return the supports of a bearing that is given by eight coefficients over speed.

    rows : (speed, k_xx, k_xy, k_yx, k_yy, c_xx, c_xy, c_yx, c_yy) of each line of the
        bearing's table; rad/s, N/m, N s/m
    spring : k_o, N/m, which is in the rotor's matrix and replaced by the table
    """
    table = np.array(rows)
    return Bearing(table[:, 0], table[:, 1:], spring)


@dataclass(frozen=True, eq=False)
class LoadedBearing(Bearing):
    """A journal or rolling bearing, by its linearisation about the rotor's equilibrium.

    Attributes
    ----------
    law : its force
    sag : function from a speed, rad/s, to the displacement in equilibrium, m, complex,
        static frame; None: the middle
    least : rad/s, below which the linearisation is that at this speed: weight presses a
        journal through its film
    """

    law: Law = field(kw_only=True)
    sag: Callable[[float], complex] | None = None
    least: float = 0.0

    @property
    def is_round(self) -> bool:
        """Whether its linearisation is the same in all directions: not in general."""
        return False

    def at(self, speed: float) -> Support:
        """Return the springs and dampers of small motions at a speed, rad/s."""
        turned = math.copysign(max(abs(speed), self.least), speed)
        place = self.sag(turned) if self.sag else 0j
        each = linearised(self.law, place, turned)
        (k, k_d), (c, c_d) = (_by_direction(one.ravel()) for one in each)
        linear = Support(k - self.spring, c, k_d, c_d)
        return replace(
            linear, bearing=self.law, spring=self.spring, speed=speed, place=place
        )

    def is_carried(self, speed: float) -> bool:
        """Return whether a film carries the journal at a speed, rad/s."""
        return abs(speed) >= self.least


def film_shares(eccentricity: float) -> tuple[float, float]:
    """Return how much more than c_0 a squeeze film damps an eccentric motion.

    Returns the ratios to c_0 of the damping along and across the eccentricity
    c_0 is the damping of small motions; the eccentricity, relative to the clearance, is
    taken as at most `CLOSED`.
    """
    square = min(eccentricity, CLOSED) ** 2
    left = 1.0 - square
    return (1.0 + 2.0 * square) / left**2.5, left**-1.5


def valid_up_to() -> tuple[float, float]:
    """Return up to which eccentricities c_0 is a fair damping of a squeeze film.

    Beyond, the film's damping exceeds c_0 by more than `OFF`: the first value is that
    for damping along the eccentricity, the second across it; both are relative to the
    clearance.
    """
    along = zero_between(lambda eps: film_shares(eps)[0] - 1.0 - OFF, 0.0, 0.5)
    return along, math.sqrt(1.0 - (1.0 + OFF) ** (-2.0 / 3.0))


@dataclass(frozen=True, eq=False)
class Station:
    """A support of the shaft at some place, at the centre or at another station.

    Attributes
    ----------
    rows : (2, n), its displacements x, y for unit coordinates of the rotor, or (m,)
        those of waves, see `modes.unlike_waves`
    support : springs, dampers, squeeze film and stop
    """

    rows: Any
    support: Support | Bearing

    @property
    def is_constant(self) -> bool:
        """Whether its coefficients are the same at all speeds."""
        own = self.support
        if isinstance(own, Support):
            return True
        return not isinstance(own, LoadedBearing) and len(own.speeds) == 1


def of_line(own: LineSupport) -> Support | Bearing:
    """Return the springs and dampers of a support of a shaft line.

    Its stiffness at the first speed, which is part of the line's, is left out.
    """
    if own.law and own.law[0] != STOP:
        return LoadedBearing(NONE, NO_COLUMNS, own.springs, law=law_of(own.law))
    return at_rest(own) or bearing_of(list(own.rows), own.springs)


def at_rest(own: LineSupport) -> Support | None:
    """Return a film or a stop of a shaft line; None: it is another support."""
    if own.law and own.law[0] == STOP:
        _, clearance, rub = own.law
        return Support(stop=float(clearance), rub=float(rub))
    if own.film:
        return Support(damping=own.film + 0j, film=own.film, clearance=own.clearance)
    return None


def law_of(numbers: tuple[str | float, ...]) -> Law:
    """Return the law of a bearing of a shaft line; numbers : `LineSupport.law`."""
    kind, *rest = numbers
    if kind == "journal":
        viscosity, length, radius, c = map(float, rest)
        return Journal(viscosity * radius * (length / c) ** 3, c)
    hertz, c, balls, cage = map(float, rest)
    return Rolling(hertz, c, int(balls), cage)


def apart_of(stations: tuple[Station, ...]) -> tuple[Station, ...]:
    """Return the supports whose force no constant matrix gives; stops come last.

    Each stop is a support by itself.
    """
    forces = tuple(one for one in stations if not _is_linear(one.support))
    stops = tuple(
        Station(one.rows, Support(stop=one.support.stop, rub=one.support.rub))
        for one in stations
        if isinstance(one.support, Support) and one.support.stop > 0.0
    )
    return *forces, *stops


def _is_linear(own: Support | Bearing) -> bool:
    """Return whether constant matrices give all forces but that of a stop."""
    return own.is_linear if isinstance(own, Support) else own.is_plain


ROUND = Support()  # only the springs in the rotor's matrix


class MisplacedError(ValueError):
    """A rotor translates rigidly, but tips or centre are not where the file says."""


def shaft_stiffness(
    shapes: Floats, hub: Floats, omega: Floats, first: float = 0.0
) -> float | None:
    """Identify the stiffness k_o of a rotor's shaft, N/m, from its modes.

    None where the modes do not determine it.

    Parameters
    ----------
    shapes : (N, 2, m), radial and tangential motion of N tips in m modes of unit mass
    hub : (2, m), motion of the centre x_o and y_o in the modes
    omega : (m,), rad/s, natural frequencies
    first : rad, angle of the tip of blade 0

    Raises
    ------
    MisplacedError
        if the motion is a translation in other axes, or with blades numbered in the
        opposite sense: forward and backward whirl would be exchanged
    """
    if not hub.any() or not omega.min() > 0.0:
        return None
    steady = hub.T / omega[:, None] ** 2
    compliance = hub @ steady
    give = float(np.trace(compliance)) / 2
    if np.abs(compliance - give * np.eye(2)).max() > RIGID * give:
        return None
    answer = shapes @ steady / give  # (N, 2, 2): tips if x_o or y_o is 1
    moved = answer @ np.array([1.0, 1j])
    angle = first + 2 * np.pi * np.arange(len(shapes)) / len(shapes)
    expected = np.exp(1j * angle)[:, None] * np.array([1.0, 1j])
    miss = float(np.abs(moved - expected).max())
    if miss <= RIGID:
        return 1.0 / give
    _check_places(moved, angle)
    return None


def _check_places(moved: Complexes, angle: Floats) -> None:
    """Raise MisplacedError if tips translate in other axes, or in another blade order.

    moved : (N, 2), radial and tangential motion of the tips if the centre moves by 1 in
        a rigid translation
    angle : (N,), rad, angles of the tips according to the file
    """
    radial, tangential = moved.T
    for way, order in ((1.0, "anticlockwise"), (-1.0, "clockwise")):
        wave = np.exp(-1j * way * angle)
        out, along = (wave * radial).mean(), (wave * tangential).mean()
        rest = [radial - out / wave, tangential - along / wave]
        whole = abs(abs(out) - 1.0) < RIGID and abs(abs(along) - 1.0) < RIGID
        if whole and np.abs(rest).max() < RIGID:
            first = round(float(np.degrees(np.angle(out)))) % 360
            sense = "with" if (along / out).imag > 0.0 else "against"
            raise MisplacedError(
                f"counted {order}, blade 0 at {first} degrees from x_o, tangential "
                f"motion positive {sense} the angle"
            )


def with_mount(
    mount: Mount, centre: Indices, turn: Any, mass: Any, stiffness: Any
) -> tuple[Any, Any]:
    """Return a rotor's M and K with those of its shaft, whose coordinates are added.

    From (n, n) they become (n + r w, n + r w), r = len(turn): each of the shaft's w
    further complex coordinates is one complex or two real ones.

    Parameters
    ----------
    mount : shaft of the disk
    centre : (r,), indices of the centre's coordinates
    turn : (r, r), anticlockwise rotation by 90 degrees in these coordinates
    """
    same = np.eye(len(turn))
    held = _joined(stiffness, mount.stiffness, centre, same)
    return _joined(mass, mount.mass, centre, same), held


def turning_mount(
    mount: Mount, centre: Indices, turn: Any, coriolis: Any, stiffening: Any, load: Any
) -> tuple[Any, Any, Any]:
    """Return a rotor's terms of rotation with those of its shaft.

    They are C and K_1, (n + r w, n + r w), and F_c, (n + r w,), see `Spin` and
    `with_mount`; parameters are those of `with_mount`.
    """
    own = mount.mass - mount.gyro / 2, mount.gyro - mount.mass
    turns = _joined(coriolis, own[0], centre, turn)
    stiffens = _joined(stiffening, own[1], centre, np.eye(len(turn)))
    return turns, stiffens, np.append(load, np.zeros(len(turns) - len(load)))


def coordinates_of(mount: Mount, centre: Indices, size: int) -> Indices:
    """Return the indices of the shaft's coordinates among those of the rotor.

    They are (r (1 + w),): the centre's, then the last ones of the rotor.

    mount, centre : the shaft; (r,), indices of the centre's coordinates
    size : number of the rotor's coordinates, those of the shaft included
    """
    last = np.arange(size - len(centre) * mount.more, size)
    return np.concatenate([centre, last], dtype=np.intp)


def _joined(matrix: Any, own: Floats, centre: Indices, each: Any) -> Any:
    """Return a rotor's matrix with one of its shaft added, see `with_mount`.

    own, each : (1 + w, 1 + w) of the shaft; (r, r), its factor in the r coordinates
    """
    more = len(each) * (len(own) - 1)
    out = np.pad(matrix, (0, more))
    places = np.r_[centre, np.arange(len(matrix), len(out))]
    out[np.ix_(places, places)] += np.kron(own, each)
    return out


def energy_in_shaft(mount: Mount | None, spring: float, moved: Any) -> Any:
    """Return twice the shaft's strain energy in each of m modes, (m,), J.

    Parameters
    ----------
    mount, spring : shaft of a tilting disk; k_o, N/m, of springs without one
    moved : (r (1 + w), m), coordinates of the shaft in each mode of unit amplitude, or
        those of the centre on springs
    """
    if mount is None:
        return spring * (np.abs(moved) ** 2).sum(axis=0)
    width = len(moved) // len(mount.stiffness)
    strained = np.kron(mount.factor, np.eye(width)) @ moved
    return (np.abs(strained) ** 2).sum(axis=0)
