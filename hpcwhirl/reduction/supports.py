"""Supports that do not rotate: springs and dampers of the shaft in the static frame.

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
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hpcwhirl.arrays import Complexes, Floats
from hpcwhirl.reduction.numbers import zero_between

CLOSED = 0.99  # eps beyond which damping is taken as constant
OFF = 0.1  # relative increase of the damping up to which c_0 is a fair approximation


@dataclass(frozen=True)
class Support:
    """Springs and dampers of the shaft's centre, static frame, with the same values.

    Their force on the centre is F = -k Z - c Z' - k_d conj(Z) - c_d conj(Z').

    Attributes
    ----------
    stiffness : k, N/m, in addition to the springs in the rotor's own matrix
    damping : c, N s/m
    stiffness_apart, damping_apart : k_d, c_d, by which directions differ
    film, clearance : damping c_0, N s/m, of a squeeze film, which c includes, and its
        clearance, m; 0: no film
    """

    stiffness: complex = 0j
    damping: complex = 0j
    stiffness_apart: complex = 0j
    damping_apart: complex = 0j
    film: float = 0.0
    clearance: float = 0.0

    @property
    def is_round(self) -> bool:
        """Whether stiffness and damping are the same in all directions.

        Those of a squeeze film are so in small motions.
        """
        return self.stiffness_apart == 0.0 == self.damping_apart

    @property
    def is_plain(self) -> bool:
        """Whether the supports' matrices in the rotating frame are constant in time."""
        return self.is_round and self.film == 0.0

    def at(self, _: float) -> Support:
        """Return these supports, which are the same at every speed."""
        return self

    def turning(self, speed: float) -> complex:
        """Return k + i Omega c, N/m, by which the supports resist a displacement z.

        z = x_o + i y_o is that of the centre in the rotating frame, in which the force
        on it is -(k + i Omega c) z - c z'; speed : Omega, rad/s
        """
        return self.stiffness + 1j * speed * self.damping


def planar(factor: complex) -> Floats:
    """Return a complex factor as the real matrix (2, 2) that acts on (x, y).

    The matrix does to (x, y) what the factor does to x + i y.
    """
    return np.array([[factor.real, -factor.imag], [factor.imag, factor.real]])


@dataclass(frozen=True, eq=False)
class Bearing:
    """Springs and dampers of the shaft's centre that depend on the speed, from a table.

    Between the table's speeds they are interpolated by monotone cubics (PCHIP).
    Beyond the table its end values hold, but only in searches over the speed: a case at
    such a speed is refused. For a rotor that turns clockwise the supports are mirrored.

    Attributes
    ----------
    speeds : (n,), rad/s, ascending
    coefficients : (n, 4), k, c, k_d, c_d at each speed, see `Support`
    """

    speeds: Floats
    coefficients: Complexes

    @property
    def is_round(self) -> bool:
        """Whether the supports are the same in all directions, at every speed."""
        return not self.coefficients[:, 2:].any()

    @property
    def is_plain(self) -> bool:
        """Whether the supports' matrices in the rotating frame are constant in time."""
        return self.is_round

    def at(self, speed: float) -> Support:
        """Return the springs and dampers at a speed, rad/s."""
        from scipy.interpolate import PchipInterpolator  # slow to import

        inside = float(np.clip(abs(speed), self.speeds[0], self.speeds[-1]))
        found = self.coefficients[0]
        if len(self.speeds) > 1:
            parts = self.coefficients.real, self.coefficients.imag
            real, imag = (PchipInterpolator(self.speeds, p)(inside) for p in parts)
            found = real + 1j * imag
        own = found.conj() if speed < 0.0 else found
        k, c, k_d, c_d = (complex(value) for value in own)
        return Support(k, c, k_d, c_d)


def bearing_of(rows: list[tuple[float, ...]], spring: float) -> Bearing:
    """Return the supports of a bearing that is given by eight coefficients over speed.

    rows : (speed, k_xx, k_xy, k_yx, k_yy, c_xx, c_xy, c_yx, c_yy) of each line of the
        bearing's table; rad/s, N/m, N s/m
    spring : k_o, N/m, which is in the rotor's matrix and replaced by the table
    """
    table = np.array(rows)
    parts = []
    for first in (1, 5):
        xx, xy, yx, yy = table[:, first : first + 4].T
        parts.append(((xx + yy) + 1j * (yx - xy)) / 2)
        parts.append(((xx - yy) + 1j * (yx + xy)) / 2)
    k, k_d, c, c_d = parts
    return Bearing(table[:, 0], np.column_stack([k - spring, c, k_d, c_d]))


def small_damping(
    viscosity: float, length: float, radius: float, clearance: float
) -> float:
    """Return the damping c_0, N s/m, of a squeeze film in small motions.

    viscosity, length, radius, clearance : mu, Pa s; L, R and c of the film, m
    """
    return math.pi * viscosity * radius * (length / clearance) ** 3


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


ROUND = Support()  # only the springs in the rotor's matrix
