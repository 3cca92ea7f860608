"""Overhung shafts, on which the disk tilts as its centre moves: conical whirl.

In the rotating frame, of the centre z and the slope phi of the shaft at the disk,

m z'' + ... + k_11 z + k_12 phi = F
I_d phi'' + i Omega (2 I_d - I_p) phi' + Omega^2 (I_p - I_d) phi + k_12 z + k_22 phi = 0

for a flat disk, whose blades are affected by the tilt only through the centre. The disk
is held by a massless shaft with bending stiffness E I: a cantilever of length L,

k_11 = 12 E I / L^3, k_12 = -6 E I / L^2, k_22 = 4 E I / L,

or a shaft that overhangs two bearings, L_1 apart, by L_2, with the compliance

a_11 = L_2^2 (L_1 + L_2) / 3 E I, a_12 = L_2 (2 L_1 + 3 L_2) / 6 E I,
a_22 = (L_1 + 3 L_2) / 3 E I

(Genta, Dynamics of Rotating Systems, 2005; Den Hartog, Mechanical Vibrations, 1956).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hpcwhirl.arrays import Floats
from hpcwhirl.scene import Rotor


@dataclass(frozen=True)
class Tilt:
    """An overhung shaft and the inertia of the disk that tilts on it.

    Attributes
    ----------
    stiffness : (k_11, k_12, k_22), N/m, N, N m, of displacement and slope at the disk
    about_diameter, polar : I_d, I_p, kg m^2, of the disk
    """

    stiffness: tuple[float, float, float]
    about_diameter: float
    polar: float


def shaft_stiffness(rotor: Rotor) -> tuple[float, float, float]:
    """Return the stiffness of a rotor's overhung, round shaft at the disk.

    It is (k_11, k_12, k_22), N/m, N, N m, from displacement and slope of the shaft at
    the disk to force and moment there.
    """
    bending = rotor.shaft_young * np.pi * rotor.shaft_diameter**4 / 64
    span, out = rotor.shaft_length, rotor.shaft_overhang
    if rotor.shaft == "cantilever":
        found = np.array([12 / span**3, -6 / span**2, 4 / span]) * bending
    else:
        cross = out * (2 * span + 3 * out) / 6
        centre, slope = out**2 * (span + out) / 3, (span + 3 * out) / 3
        down = centre * slope - cross**2
        found = np.array([slope, -cross, centre]) * bending / down
    k_11, k_12, k_22 = found.tolist()
    return k_11, k_12, k_22


def tilt_of(rotor: Rotor, mass: Floats, radii: Floats) -> Tilt | None:
    """Return shaft and inertia of a disk that tilts; None for a rotor on shaft springs.

    Parameters
    ----------
    rotor : inputs of the rotor
    mass : (n, n), mass matrix of all sectors; for each sector in turn, the radial,
        tangential and rotational DoF of its nodes, then the centre's
    radii : m, radial positions of the nodes of a sector
    """
    if rotor.shaft == "springs":
        return None
    polar = rotor.polar_inertia
    if polar == 0.0:
        turned = np.zeros((len(radii), 3))
        turned[:, 1], turned[:, 2] = radii, 1.0
        shape = np.zeros(len(mass))
        shape[: turned.size * rotor.blades] = np.tile(turned.ravel(), rotor.blades)
        polar = float(shape @ mass @ shape)
    return Tilt(shaft_stiffness(rotor), rotor.tilt_inertia or polar / 2, polar)
