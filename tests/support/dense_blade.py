"""A blade that rubs in a rigid casing, by full matrices: an oracle for the kernels.

Central differences of M x'' + D x' + K x = f in velocities at half steps, which is the
same scheme with less round-off. All contact points are solved for at once after each
step without contact: forces lambda >= 0 that push inward, gaps g >= 0 and no force
where there is a gap, with friction mu lambda against the rotation. Nothing of hpcwhirl
is used.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import scipy.linalg

MOST_AT_ONCE, MOST = 20, 2000  # changes of the contacts
CLOSED = 1e-15  # m, of a gap that counts as none


class Blade(NamedTuple):
    """Matrices of a clamped blade with n_c contact points.

    mass, stiffness : (n, n)
    radial, along : (n_c, n), of displacements of points outward and along the rotation
    angle : (n_c,), rad, of the points
    ratio : of modal damping
    """

    mass: np.ndarray
    stiffness: np.ndarray
    radial: np.ndarray
    along: np.ndarray
    angle: np.ndarray
    ratio: float

    def damping(self) -> np.ndarray:
        """Return M Phi diag(2 xi omega) Phi^T M."""
        squared, shapes = scipy.linalg.eigh(self.stiffness, self.mass)
        moved = self.mass @ shapes
        return (moved * (2 * self.ratio * np.sqrt(squared))) @ moved.T


def compliance(blade: Blade, friction: float, step: float) -> tuple[np.ndarray, ...]:
    """Return the factor of M + h D / 2, push (n, n_c) and W (n_c, n_c) of unit forces.

    push : velocity by a force of one step
    """
    factor = scipy.linalg.cho_factor(blade.mass + step / 2 * blade.damping())
    loads = (blade.radial + friction * blade.along).T
    push = -step * scipy.linalg.cho_solve(factor, loads)
    return factor, push, -step * blade.radial @ push


class Turning(NamedTuple):
    """Speed, rad/s; friction; step, s; number of steps; every how many are kept."""

    speed: float
    friction: float
    step: float
    steps: int
    every: int


class Rub(NamedTuple):
    """Points' displacements (s, n_c, 2), m, at samples; and what contact did.

    impulse : (n_c,), N s, normal, of all steps
    lowest : m, least gap after a step; 0 where no point is in the casing
    touchdowns : points that are in contact after a step and were not before it
    """

    points: np.ndarray
    impulse: np.ndarray
    lowest: float
    touchdowns: int


def multipliers(gaps: np.ndarray, gives: np.ndarray) -> np.ndarray:
    """Return lambda of 0 <= lambda, 0 <= g + W lambda, lambda . (g + W lambda) = 0.

    By principal pivoting: all wrong contacts are changed at once; if that does not end,
    the first of them alone, which does for a matrix of positive principal minors.
    """
    shut = gaps < 0.0
    for turn in range(MOST):
        lam = np.zeros(len(gaps))
        lam[shut] = np.linalg.solve(gives[np.ix_(shut, shut)], -gaps[shut])
        wrong = np.where(shut, lam < 0.0, gaps + gives @ lam < -CLOSED)
        if not wrong.any():
            return lam
        if turn >= MOST_AT_ONCE:
            wrong[np.argmax(wrong) + 1 :] = False
        shut = shut ^ wrong
    raise ArithmeticError(f"no contacts in {MOST} changes")


def march(
    blade: Blade,
    clearance: Callable[[np.ndarray], np.ndarray],
    turning: Turning,
) -> Rub:
    """March from rest and keep the samples.

    clearance : of the casing, (n_c,), m, at angles, (n_c,), rad, static frame
    """
    mass, stiffness, radial, along = blade[:4]
    speed, friction, step, steps, every = turning
    damping = blade.damping()
    factor, push, gives = compliance(blade, friction, step)
    x, v = np.zeros(len(mass)), np.zeros(len(mass))
    seen, impulse, lowest, touchdowns = [], np.zeros(len(gives)), 0.0, 0
    held = np.zeros(len(gives), dtype=bool)
    for n in range(1, steps + 1):
        pull = stiffness @ x + damping @ v
        v = v - step * scipy.linalg.cho_solve(factor, pull, check_finite=False)
        new = x + step * v
        gaps = clearance(speed * n * step + blade.angle) - radial @ new
        lam = np.zeros(len(gaps))
        if gaps.min() < 0.0:
            lam = multipliers(gaps, gives)
            v = v + push @ lam
            new = x + step * v
            impulse += lam * step
            lowest = min(lowest, float((gaps + gives @ lam).min()))
        touchdowns += int((lam > 0.0)[~held].sum())
        held = lam > 0.0
        x = new
        if n % every == 0:
            seen.append(np.column_stack([radial @ x, along @ x]))
    return Rub(np.array(seen), impulse, lowest, touchdowns)
