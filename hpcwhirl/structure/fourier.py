"""The elastic casing in Fourier harmonics: closed form, no interpolation.

Coordinates: w_0, w_1c, w_1s, ... w_Hs, then u_0, u_1c, ... u_Hs, with
w(theta) = w_0 + sum_h w_hc cos(h theta) + w_hs sin(h theta), u alike; u tangential
with theta, w radial outward, static frame.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.scene import Casing

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class FourierOperator:
    """Contact operator of a ring of harmonics 0 .. H.

    It gives the ring's displacements at angles and, transposed, the loads of forces
    there.
    """

    harmonics: int  # H
    radius: float  # m

    @property
    def width(self) -> int:
        """Number of radial coordinates, 2 H + 1."""
        return 2 * self.harmonics + 1

    @property
    def radial(self) -> Integers:
        """Indices of the coordinates of w."""
        return np.arange(self.width)

    @property
    def tangential(self) -> Integers:
        """Indices of the coordinates of u, in the order of `radial`."""
        return self.width + np.arange(self.width)

    def rows(self, angles: Floats) -> tuple[Floats, Floats]:
        """Return the matrices from the coordinates to w and u at angles (m,), rad.

        Returns
        -------
        (m, 2 width) each
        """
        angles = np.atleast_1d(np.asarray(angles, dtype=np.float64))
        phase = angles[:, None] * np.arange(1, self.harmonics + 1)
        waves = np.ones((len(angles), self.width))
        waves[:, 1::2], waves[:, 2::2] = np.cos(phase), np.sin(phase)
        nothing = np.zeros_like(waves)
        return np.hstack([waves, nothing]), np.hstack([nothing, waves])

    def waves(self) -> Floats:
        """Return the matrices to the cos and sin parts of w, (H + 1, 2, 2 width)."""
        out = np.zeros((self.harmonics + 1, 2, 2 * self.width))
        for h in range(self.harmonics + 1):
            out[h, 0, max(2 * h - 1, 0)] = 1.0
            if h > 0:
                out[h, 1, 2 * h] = 1.0
        return out

    def lobes(self, k: int) -> Floats:
        """Return the generalized forces (2 width,) of a radial load p ~ cos(k theta).

        They are scaled so that the generalized force on the unit shape cos(k theta) is
        1.
        """
        load = np.zeros(2 * self.width)
        load[max(2 * k - 1, 0)] = 1.0
        return load


def harmonic_matrices(casing: Casing, radius: float, h: int) -> tuple[float, Floats]:
    """Return (m, K) of harmonic h on (W, U): w = W cos(h theta), u = U sin(h theta).

    From the energies of the curved element (reference §1), integrated over the ring:
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
