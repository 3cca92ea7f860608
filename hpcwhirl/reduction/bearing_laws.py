"""Laws of journal and rolling bearings: force at rest, and its linearisation.

Z = e e^{i phi} is the displacement in the static frame, and F(Z, V) the force on the
rotor. At rest it is F(Z, 0) = (f_r + i f_t) e^{i phi}, with f_r and f_t functions of e
alone, as the bearing is the same at every angle; of a small motion about it, with d =
e^{i phi},

F - F(Z, 0) = -d [K (x, t)^T + C (x', t')^T], K = -[[f_r', -f_t/e], [f_t', f_r/e]],

x and t the parts of the motion along and across Z.

A short journal bearing (film of length L, radius R, clearance c, viscosity mu) whose
film cavitates has, with a = mu R L^3 |Omega| / c^2 and eps = e/c (F. Ocvirk, NACA TN
2808, 1952),

f_r = -a eps^2 / (1 - eps^2)^2, f_t = +-a pi eps / 4 (1 - eps^2)^{3/2},

+ where the rotor turns anticlockwise; C is that of the half of the film that carries
at rest, `dynamics.kernels.standing`, c_1 = mu R L^3 / c^3:

C_rr = c_1 pi (1 + 2 eps^2) / 2 (1 - eps^2)^{5/2}, C_tt = c_1 pi / 2 (1 - eps^2)^{3/2},
C_rt = C_tr = -+2 c_1 eps / (1 - eps^2)^2.

A rolling bearing has n balls with Hertz's law, f = K d^{3/2}, and the radial clearance
c. Its force depends on where the balls are; equilibrium and linearisation are those of
its mean over a turn of the cage,

f_r = -(n K / 2 pi) int (e cos psi - c)_+^{3/2} cos psi dpsi, f_t = 0, C = 0.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hpcwhirl.arrays import Floats
from hpcwhirl.reduction.numbers import zero_between

FULLEST = 0.95  # eps at rest up to which a journal is taken to be carried by its film
POINTS = 64  # of the integral over the balls
_X, _W = np.polynomial.legendre.leggauss(POINTS)


class AtRest(NamedTuple):
    """The force of a bearing at rest at a displacement e, by parts along and across.

    Attributes
    ----------
    force : f_r + i f_t, N
    slope : its derivative by e, N/m
    over : f / e, N/m, its limit where e = 0
    damping : ((C_rr, C_rt), (C_tr, C_tt)), N s/m
    """

    force: complex
    slope: complex
    over: complex
    damping: Floats


@dataclass(frozen=True)
class Journal:
    """A short journal bearing with a cavitated film.

    Attributes
    ----------
    film : mu R L^3 / c^3, N s/m
    clearance : c, m, radial
    """

    film: float
    clearance: float

    def at(self, e: float, speed: float) -> AtRest:
        """Return the force at rest at e, m, and a speed, rad/s."""
        eps, sense = e / self.clearance, math.copysign(1.0, speed)
        left, a = 1.0 - eps**2, self.film * abs(speed)  # a over the clearance
        across = 1j * sense * math.pi / 4
        over = a * (-eps / left**2 + across / left**1.5)
        slope = a * (
            -2 * eps * (1 + eps**2) / left**3 + across * (1 + 2 * eps**2) / left**2.5
        )
        half, swept = math.pi / 2, -2 * sense * eps / left**2
        rows = [
            [half * (1 + 2 * eps**2) / left**2.5, swept], [swept, half / left**1.5],
        ]  # fmt: skip
        return AtRest(over * e, slope, over, self.film * np.array(rows))

    def under(self, load: float, speed: float) -> float:
        """Return e, m, at which the force at rest is that of a load, N."""
        most = FULLEST * self.clearance
        if abs(self.at(most, speed).force) <= load:
            return most
        return zero_between(lambda e: abs(self.at(e, speed).force) - load, 0.0, most)

    def slowest(self, load: float) -> float:
        """Return the least speed, rad/s, at which it carries a load, N."""
        return load / abs(self.at(FULLEST * self.clearance, 1.0).force)


@dataclass(frozen=True)
class Rolling:
    """A rolling bearing.

    Attributes
    ----------
    hertz : K of a ball, N/m^1.5
    clearance : c, m, radial
    balls : n
    cage : speed of the cage over that of the rotor
    """

    hertz: float
    clearance: float
    balls: int
    cage: float

    def at(self, e: float, speed: float) -> AtRest:
        """Return the mean force over a turn of the cage at e, m; speed : not used."""
        del speed
        if e <= self.clearance:
            return AtRest(0j, 0j, 0j, np.zeros((2, 2)))
        end = math.acos(self.clearance / e)
        turn = math.pi / 2 * _X
        angle, weight = end * np.sin(turn), math.pi / 2 * end * _W * np.cos(turn)
        cosine = np.cos(angle)
        lack = np.maximum(e * cosine - self.clearance, 0.0)
        size = -self.hertz * self.balls / (2 * math.pi)
        force = size * float(weight @ (lack**1.5 * cosine))
        slope = 1.5 * size * float(weight @ (np.sqrt(lack) * cosine**2))
        return AtRest(complex(force), complex(slope), force / e + 0j, np.zeros((2, 2)))

    def under(self, load: float, speed: float) -> float:
        """Return e, m, at which the mean force is that of a load, N."""
        if load == 0.0:
            return 0.0
        far = self.clearance + (load / self.hertz) ** (2 / 3)
        while abs(self.at(far, speed).force) < load:
            far = 2.0 * far
        return zero_between(
            lambda e: abs(self.at(e, speed).force) - load, self.clearance, far
        )

    def slowest(self, load: float) -> float:
        """Return the least speed, rad/s, at which it carries a load, N: none."""
        del load
        return 0.0


Law = Journal | Rolling


def force_at(law: Law, place: complex, speed: float) -> complex:
    """Return F(Z, 0), N; place : Z, m; speed : Omega, rad/s."""
    return law.at(abs(place), speed).over * place


def place_under(law: Law, load: complex, speed: float) -> complex:
    """Return Z, m, at which the bearing at rest carries a load, N, both complex."""
    if load == 0.0:
        return 0j
    e = law.under(abs(load), speed)
    force = law.at(e, speed).force
    if force == 0.0:
        return 0j
    return -e * load / abs(load) * abs(force) / force


def linearised(law: Law, place: complex, speed: float) -> tuple[Floats, Floats]:
    """Return K, N/m, and C, N s/m, of small motions about a place, (2, 2) each, (X, Y).

    place, speed : Z, m; Omega, rad/s
    """
    here = law.at(abs(place), speed)
    inner = -np.array(
        [[here.slope.real, -here.over.imag], [here.slope.imag, here.over.real]]
    )
    way = place / abs(place) if place else 1.0 + 0j
    turn = np.array([[way.real, -way.imag], [way.imag, way.real]])
    return turn @ inner @ turn.T, turn @ here.damping @ turn.T
