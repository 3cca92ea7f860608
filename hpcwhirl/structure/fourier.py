"""The elastic casing in Fourier harmonics: a ring in closed form, or a thin shell.

Coordinates: w_0, w_1c, w_1s, ... w_Hs, then u_0, u_1c, ... u_Hs, with
w(theta) = w_0 + sum_h w_hc cos(h theta) + w_hs sin(h theta), u likewise; u tangential
with theta, w radial outward, static frame. If the casing varies along its axis, each
axial function has such coordinates: first w of all functions, one after the other, then
u of all functions, then their axial displacements, if any. With the axial place zeta, 0
in the casing's middle, w(theta, zeta) = sum_l a_l(zeta) w_l(theta).

A shell, simply supported at both ends: Fluegge's equations (W. Fluegge, Stresses in
Shells, 1960; with inertia: A. W. Leissa, Vibration of Shells, NASA SP-288, 1973,
chapter 2), with k = t^2 / (12 R^2), lam = p pi R / L and the displacements of a shell
on shear diaphragms,

w = W sin(p pi x / L) cos(h theta), v = V sin(p pi x / L) sin(h theta),
u = U cos(p pi x / L) cos(h theta),

radial outward, tangential with theta, axial. At both ends these have w = v = 0 and no
axial force. Each (h, p) has three modes: one mostly radial, two that stretch the shell.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hpcwhirl.arrays import Floats, Integers
from hpcwhirl.scene import Casing

MIDDLE = np.zeros(1)


@dataclass(frozen=True)
class Uniform:
    """Axial function 1, of a casing whose displacements are constant along its axis."""

    count = 1
    ends = (-math.inf, math.inf)

    def at(self, stations: Floats) -> Floats:
        """Return the constant function 1 at s axial positions: ones, (s, 1).

        stations : (s,), m, axial positions
        """
        return np.ones((len(stations), 1))


@dataclass(frozen=True)
class Sines:
    """Axial functions of a simply supported shell: sines of 1 .. `count` half waves.

    They are sin(p pi (zeta / L + 1/2)), zeta the axial position, 0 in the middle.

    Attributes
    ----------
    count : number of functions, p = 1 .. `count`
    length : L, m, of the shell
    """

    count: int
    length: float

    @property
    def ends(self) -> tuple[float, float]:
        """Axial places, m, of the two ends of the casing."""
        return -self.length / 2, self.length / 2

    def at(self, stations: Floats) -> Floats:
        """Return the sines at s axial positions, (s, count).

        stations : (s,), m, axial positions, 0 in the casing's middle
        """
        phase = np.pi * (np.asarray(stations) / self.length + 0.5)
        waves = np.arange(1, self.count + 1)
        return np.asarray(np.sin(np.outer(phase, waves)))


@dataclass(frozen=True)
class Stations:
    """Axial functions of a casing whose modes a file gives at s axial stations.

    Each is piecewise linear: 1 at its station, 0 at all others.

    places : (s,), m, axial positions of the stations, ascending
    """

    places: tuple[float, ...]

    @property
    def count(self) -> int:
        """Number of axial functions, one for each station."""
        return len(self.places)

    @property
    def ends(self) -> tuple[float, float]:
        """Axial places, m, of the two ends of the casing."""
        return self.places[0], self.places[-1]

    def at(self, stations: Floats) -> Floats:
        """Return the s functions at k axial positions, (k, s).

        They are constant beyond the ends of the casing.

        stations : (k,), m, axial positions, 0 in the casing's middle
        """
        hats = np.eye(self.count)
        columns = [np.interp(stations, self.places, hat) for hat in hats]
        return np.column_stack(columns)


Axial = Uniform | Sines | Stations
EVERYWHERE = Uniform()


@dataclass(frozen=True)
class FourierOperator:
    """Contact operator of a casing whose coordinates are harmonics 0 .. H.

    It gives the casing's displacements at points and, transposed, the loads on its
    coordinates of forces there.

    Attributes
    ----------
    harmonics : H
    radius : m, of the casing
    axial : functions by which displacements vary along the axis
    directions : number of directions of displacement: 2, radial w and tangential u; 3
        with axial displacements
    """

    harmonics: int
    radius: float
    axial: Axial = EVERYWHERE
    directions: int = 2

    @property
    def width(self) -> int:
        """Number of radial coordinates of one axial function: 2 H + 1."""
        return 2 * self.harmonics + 1

    @property
    def size(self) -> int:
        """Number of coordinates of the casing, radial, tangential and axial."""
        return self.directions * self.axial.count * self.width

    @property
    def radial(self) -> Integers:
        """Indices of the radial coordinates, w, among those of the casing."""
        return np.arange(self.axial.count * self.width)

    @property
    def tangential(self) -> Integers:
        """Indices of the tangential coordinates, u, in the order of the radial ones."""
        return len(self.radial) + self.radial

    def rows(self, angles: Floats, stations: Floats = MIDDLE) -> tuple[Floats, Floats]:
        """Return the matrices that give w and u at m points from the coordinates.

        They are (m, size) each; w is the radial displacement, outward, u the tangential
        one, with the angle.

        angles, stations : (m,), rad; (m,) or (1,), m, axial positions
        """
        angles = np.atleast_1d(np.asarray(angles, dtype=np.float64))
        phase = angles[:, None] * np.arange(1, self.harmonics + 1)
        waves = np.ones((len(angles), self.width))
        waves[:, 1::2], waves[:, 2::2] = np.cos(phase), np.sin(phase)
        parts = self.axial.at(stations)[:, :, None] * waves[:, None, :]
        radial, tangential = (np.zeros((len(angles), self.size)) for _ in range(2))
        radial[:, self.radial] = parts.reshape(len(angles), -1)
        tangential[:, self.tangential] = parts.reshape(len(angles), -1)
        return radial, tangential

    def turned(self, x: Floats, angle: float) -> Floats:
        """Return coordinates in axes turned by an angle, rad, (size,).

        x : (size,), those in the axes that are not turned
        """
        out = x.reshape(-1, self.width).copy()
        h = np.arange(1, out.shape[1] // 2 + 1)
        waves = (out[:, 1::2] - 1j * out[:, 2::2]) * np.exp(1j * h * angle)
        out[:, 1::2], out[:, 2::2] = waves.real, -waves.imag
        return out.ravel()

    def _in_the_middle(self, harmonic: int, *, sine: bool) -> Floats:
        """Return the row vector, (size,), that gives an amplitude of w at mid-width.

        It is multiplied by the casing's coordinates.

        harmonic : h, of the radial displacement w in the casing's middle plane
        sine : whether the amplitude is that of sin(h theta), else of cos(h theta)
        """
        place = 2 * harmonic if sine else max(2 * harmonic - 1, 0)
        row = np.zeros(self.size)
        row[self.radial[place :: self.width]] = self.axial.at(MIDDLE)[0]
        return row

    def waves(self) -> Floats:
        """Return the matrices that give cos and sin amplitudes of w from coordinates.

        w is the radial displacement; the amplitudes are those of harmonics 0 .. H.

        Returns
        -------
        (H + 1, 2, size); if the casing varies along its axis, w at its mid-width
        """
        out = np.zeros((self.harmonics + 1, 2, self.size))
        for h in range(self.harmonics + 1):
            out[h, 0] = self._in_the_middle(h, sine=False)
            if h > 0:
                out[h, 1] = self._in_the_middle(h, sine=True)
        return out

    def lobes(self, k: int) -> Floats:
        """Return the loads of a pulse of k lobes on the coordinates, (size,).

        The pulse is a radial pressure ~ cos(k theta) at mid-width; loads are scaled so
        that the generalized force on the unit shape cos(k theta) is 1.
        """
        return self._in_the_middle(k, sine=False)


def harmonic_matrices(casing: Casing, radius: float, h: int) -> tuple[float, Floats]:
    """Return mass and stiffness of a ring's harmonic h in its amplitudes (W, U).

    w = W cos(h theta), u = U sin(h theta). From the energies of the element in
    `elements.curved`, integrated over the ring:
    K = a [EA/R^2 (W + hU)^2 + EI/R^4 (h^2 W + hU)^2 + k_f (W^2 + U^2)], m = a rho A,
    a = pi R, or 2 pi R for h = 0, where U is a uniform rotation. The second phase,
    w = W sin, u = -U cos, has the same matrices.

    Returns
    -------
    m : kg, mass of either coordinate
    K : (2, 2), N/m
    """
    arc = (1.0 if h else 2.0) * np.pi * radius
    area = casing.width * casing.thickness
    second = casing.width * casing.thickness**3 / 12
    foundation = casing.density * area * casing.support_frequency**2
    stretch = np.array([1.0, h]) / radius
    bend = np.array([h * h, h]) / radius**2
    stiffness = casing.young * area * np.outer(stretch, stretch)
    stiffness += casing.young * second * np.outer(bend, bend)
    stiffness += foundation * np.eye(2)
    return arc * casing.density * area, arc * stiffness


def fluegge(h: int, lam: float, k: float, poisson: float) -> Floats:
    """Return Fluegge's matrix F (3, 3), whose eigenvalues give a shell's frequencies.

    F (W, V, U) = rho (1 - nu^2) R^2 omega^2 / E (W, V, U).

    Parameters
    ----------
    h : harmonic
    lam : p pi R / L
    k : t^2 / (12 R^2)
    poisson : nu
    """
    shear = (1.0 - poisson) / 2.0
    wave = lam**2 + h**2
    ww = 1.0 + k * (wave**2 - 2.0 * h**2 + 1.0)
    vv = h**2 + (1.0 + 3.0 * k) * shear * lam**2
    uu = lam**2 + (1.0 + k) * shear * h**2
    wv = h + k * (3.0 - poisson) / 2.0 * h * lam**2
    wu = -poisson * lam - k * (lam**3 - shear * lam * h**2)
    vu = -(1.0 + poisson) / 2.0 * lam * h
    return np.array([[ww, wv, wu], [wv, vv, vu], [wu, vu, uu]])


def shell_matrices(
    casing: Casing, radius: float, h: int, p: int
) -> tuple[float, Floats]:
    """Return mass and stiffness of a shell's harmonic h and axial function p.

    They act on the amplitudes (W, V, U) of radial, tangential and axial displacement.
    The foundation k_f = rho t omega_c1^2 acts on all three displacements. The second
    phase, w = W sin, v = -V cos, u = U sin, has the same matrices. For h = 0, V is the
    amplitude of a rotation, v = V sin(p pi x / L).

    Parameters
    ----------
    casing : inputs of the casing; `width` is the shell's length L
    radius : of the middle surface, m
    h, p : harmonic, from 0; axial half waves, from 1

    Returns
    -------
    m : kg, mass of each of the three coordinates
    K : (3, 3), N/m
    """
    arc = (1.0 if h else 2.0) * np.pi * radius
    mass = casing.density * casing.thickness * arc * casing.width / 2.0
    k = casing.thickness**2 / (12.0 * radius**2)
    lam = p * np.pi * radius / casing.width
    unit = casing.young / (casing.density * (1.0 - casing.poisson**2) * radius**2)
    squared = unit * fluegge(h, lam, k, casing.poisson)
    squared += casing.support_frequency**2 * np.eye(3)
    return mass, mass * squared
