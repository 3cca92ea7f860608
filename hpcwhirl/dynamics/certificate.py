"""The certificate that contact cannot recur, and the closed form of later motion.

The recursion d' = keep d - pull q, q' = q + d' of central differences has the roots
z = r e^{+-i phi}, r^2 = keep and cos phi = (1 + keep - pull) / (2 r). Without forces, n
steps later,

q_n = r^n (A cos n phi + B sin n phi) = alpha z^n + beta conj(z)^n,
A = q,  B = (q (cos phi - r) + r d) / sin phi,

and |q_n| <= (|A|^2 + |B|^2)^{1/2} for all n >= 0, also for complex amplitudes, and for
those of the ring, which turn in the rotating frame. The sum of these bounds over all
modes, weighted with the radial amplitudes at a blade, bounds the change of every gap:
if it is below the clearance, no blade can touch again. This holds for the motion of the
scheme, with its rounded coefficients, not for that of the continuous modes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.dynamics.kernels import passes

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
LESS = 1.0 - 1e-9  # factor on the clearance, for the rounding of the bound itself


@dataclass(frozen=True)
class Roots:
    """The roots of the recursion, for the modes of one body.

    Attributes
    ----------
    own : (modes,), indices of the modes among the kernel's complex amplitudes
    weight : (modes,), |radial amplitude| at a blade's tip or on the ring
    radius, sine : (modes,), r and sin phi
    log : (modes,), log z
    back : (modes,), cos phi - r
    pull : (modes,), coefficient of the recursion
    decays : whether all modes have stiffness and damping and oscillate, as the bound
        requires
    """

    own: NDArray[np.intp]
    weight: Floats
    radius: Floats
    sine: Floats
    log: Complexes
    back: Floats
    pull: Floats
    decays: bool

    def waves(self, q: Complexes, d: Complexes) -> tuple[Complexes, Complexes]:
        """Return (A, B), (modes,) each, of the motion q_n from q and increments d."""
        return q, (q * self.back + self.radius * d) / self.sine

    def increments(self, q: Complexes, d: Complexes) -> tuple[Complexes, Complexes]:
        """Return (A, B) of the increments d_n, which follow the recursion of q_n."""
        # d_1 = keep d - pull q = r (A cos phi + B sin phi)
        return d, -(self.back * d + self.pull / self.radius * q) / self.sine


def roots_of(items: Floats) -> Roots:
    """Return the roots of a body's modes; items (ITEMS, n) : see `kernels.passes`."""
    modes = np.flatnonzero(items[passes.KEEP] != 0.0)
    keep, pull = items[passes.KEEP][modes], items[passes.PULL][modes]
    radius = np.sqrt(np.maximum(keep, 0.0))
    lost = (1.0 - keep) / (1.0 + radius)  # 1 - r, without loss of digits
    with np.errstate(divide="ignore", invalid="ignore"):
        away = (pull - lost**2) / (2.0 * radius)  # 1 - cos phi
        sine = np.sqrt(np.maximum(away * (2.0 - away), 0.0))
        back = (1.0 - keep - pull) / (2.0 * radius)
        log = 0.5 * np.log1p(keep - 1.0) + 1j * np.arctan2(sine, 1.0 - away)
    decays = bool(((keep > 0.0) & (keep < 1.0) & (sine > 0.0)).all())
    weight = np.abs(items[passes.RADIAL][modes])
    return Roots(modes, weight, radius, sine, log, back, pull, decays)
