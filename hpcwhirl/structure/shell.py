"""The elastic casing as a thin cylindrical shell, simply supported at both ends.

Fluegge's equations (W. Fluegge, Stresses in Shells, 1960; with inertia: A. W. Leissa,
Vibration of Shells, NASA SP-288, 1973, chapter 2), with k = t^2 / (12 R^2), lam = p pi
R / L and the displacements of a shell on shear diaphragms,

w = W sin(p pi x / L) cos(h theta), v = V sin(p pi x / L) sin(h theta),
u = U cos(p pi x / L) cos(h theta),

radial outward, tangential with theta, axial. At both ends these have w = v = 0 and no
axial force. Each (h, p) has three modes: one mostly radial, two that stretch the shell.
"""

from __future__ import annotations

import numpy as np

from hpcwhirl.arrays import Floats
from hpcwhirl.scene import Casing


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
    """Return (m, K) of a shell's harmonic h and axial function p, on (W, V, U).

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
