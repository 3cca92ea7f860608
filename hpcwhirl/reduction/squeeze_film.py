"""A squeeze-film damper at the centre: a short oil film around a whirling ring.

A ring of radius R and length L, which does not rotate, moves by e = eps c in a film of
viscosity mu and clearance c. Reynolds' equation for a short film (L much shorter than
the radius, open ends, no inertia, no cavitation, full film) gives

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

from hpcwhirl.reduction.numbers import zero_between

CLOSED = 0.99  # eps beyond which damping is taken as constant
OFF = 0.1  # relative increase of the damping up to which c_0 is a fair approximation


def small_damping(
    viscosity: float, length: float, radius: float, clearance: float
) -> float:
    """Return c_0, N s/m, from mu, Pa s, and L, R, c, m."""
    return math.pi * viscosity * radius * (length / clearance) ** 3


def film_shares(eccentricity: float) -> tuple[float, float]:
    """Return damping / c_0 along e and across it; eps is at most `CLOSED` in it."""
    square = min(eccentricity, CLOSED) ** 2
    left = 1.0 - square
    return (1.0 + 2.0 * square) / left**2.5, left**-1.5


def valid_up_to() -> tuple[float, float]:
    """Return the two eps at which the damping along or across e is (1 + `OFF`) c_0."""
    along = zero_between(lambda eps: film_shares(eps)[0] - 1.0 - OFF, 0.0, 0.5)
    return along, math.sqrt(1.0 - (1.0 + OFF) ** (-2.0 / 3.0))
