"""Free whirl of a shaft line on its supports: frequencies, growth, critical speeds.

Each support connects two coordinates of a shaft line, see `structure.shaft`, or one of
them to the ground, by eight coefficients: its force is -k Z - c Z' - k_d conj(Z) - c_d
conj(Z') of their difference Z, see `supports`. Motions are sums of Y e^{s t} and
conj(X e^{s t}), static frame, so that

[s^2 M + s (D_i + D_s - i Omega G) + K - i Omega D_i + K_s] Y + (K_d + s C_d) X = 0

and the same equation with conjugate matrices and Y, X exchanged: 2 n equations, whose
roots s are those of all free motions, in pairs s, conj(s). A motion is forward at Omega
> 0 where |Y| is the larger at Im s > 0. Without a difference between directions, the
critical speeds of undamped motions are the roots of K + K_s - Omega^2 (M - G).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.optimize import brentq

from hpcwhirl.arrays import Complexes, Floats, Indices
from hpcwhirl.reduction.supports import Bearing, Support, bearing_of
from hpcwhirl.structure.shaft import (
    GROUND,
    NODE,
    WHOLE,
    ShaftLine,
    line_matrices,
    row_between,
)

STILL = 1e-9  # frequency relative to the root, |Im s| / |s|, that counts as 0
ROUND_OFF = 1e-14  # frequency relative to the largest root that counts as 0
SPEEDS = 101  # speeds of a search for critical speeds


@dataclass(frozen=True, eq=False)
class Held:
    """A bearing, seal or other support of a shaft line.

    Attributes
    ----------
    at, to : coordinates that it connects, of the n of the line; `to` may be `GROUND`
    support : springs and dampers, static frame
    mass : kg, added mass, whose inertia the line's own matrices have
    part : as of `structure.shaft.LineSupport`
    """

    at: int
    to: int
    support: Support | Bearing
    mass: float = 0.0
    part: int = WHOLE


def at_node(node: int, support: Support | Bearing, pedestal: int = GROUND) -> Held:
    """Return a support of a node of a shaft that has no pedestals, on the ground.

    node, support, pedestal : node from 0; coefficients; coordinate of the pedestal on
        which the support stands, or `GROUND`
    """
    return Held(NODE * node, pedestal, support)


def held_by(line: ShaftLine) -> tuple[Held, ...]:
    """Return the supports that a shaft line has of itself.

    Of several supports at one place the first has the added mass there.
    """
    added = dict[tuple[int, int], float]()
    for one in line.added:
        added[one.at, one.to] = added.get((one.at, one.to), 0.0) + one.mass
    return tuple(
        Held(
            own.at, own.to, bearing_of(list(own.rows), 0.0),
            added.pop((own.at, own.to), 0.0), own.part,
        )
        for own in line.supports
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class WhirlMatrices:
    """The matrices of motions (Y, X) of a shaft line on its supports, (2 n, 2 n).

    [s^2 M + s D + K] (Y, X) = (F, conj F'), for forces F e^{s t} + conj(F' e^{s t}).

    Attributes
    ----------
    mass, damping, stiffness : M; D, gyroscopic terms included; K, circulatory terms
        included; static frame
    """

    mass: Floats
    damping: Complexes
    stiffness: Complexes


def whirl_matrices(
    line: ShaftLine, supports: tuple[Held, ...], speed: float
) -> WhirlMatrices:
    """Return the matrices of a shaft line on supports at a speed, rad/s."""
    own, n = line_matrices(line), line.size
    rate = own.damping - 1j * speed * own.gyro
    held = own.stiffness - 1j * speed * own.damping
    apart = np.zeros((2, n, n), complex)  # C_d and K_d
    for support in supports:
        now, row = support.support.at(speed), row_between(support.at, support.to, n)
        moved = np.outer(row, row)
        rate, held = rate + now.damping * moved, held + now.stiffness * moved
        apart += np.multiply.outer([now.damping_apart, now.stiffness_apart], moved)
    zero = np.zeros((n, n))
    return WhirlMatrices(
        np.block([[own.mass, zero], [zero, own.mass]]),
        np.block([[rate, apart[0]], [apart[0].conj(), rate.conj()]]),
        np.block([[held, apart[1]], [apart[1].conj(), held.conj()]]),
    )


@dataclass(frozen=True, eq=False)
class Whirl:
    """A free motion of a shaft line, Re(...) of Y e^{s t} and conj(X e^{s t}).

    Attributes
    ----------
    root : s, 1/s, Im s >= 0
    shape : (2, n), Y and X
    """

    root: complex
    shape: Complexes

    @property
    def frequency(self) -> float:
        """Damped frequency, rad/s, static frame."""
        return float(self.root.imag)

    @property
    def growth(self) -> float:
        """Growth rate, 1/s, < 0 if the motion decays."""
        return float(self.root.real)

    @property
    def log_decrement(self) -> float:
        """Logarithm of the ratio of two successive amplitudes."""
        return -2 * np.pi * self.growth / self.frequency

    @property
    def is_anticlockwise(self) -> bool:
        """Whether most of the line whirls anticlockwise: forward at Omega > 0."""
        y, x = np.linalg.norm(self.shape, axis=1)
        return bool(y >= x)


def whirls(line: ShaftLine, supports: tuple[Held, ...], speed: float) -> list[Whirl]:
    """Return the oscillating free motions at a speed, rad/s, by ascending frequency.

    Overdamped motions, and those of a shaft that is not held, are left out.
    """
    matrices = whirl_matrices(line, supports, speed)
    n = len(matrices.mass)
    roots, shapes = np.linalg.eig(_companion(matrices))
    chosen = _oscillating(roots)
    return [Whirl(complex(roots[i]), shapes[:n, i].reshape(2, -1)) for i in chosen]


def whirl_frequencies(
    line: ShaftLine, supports: tuple[Held, ...], speed: float
) -> Floats:
    """Return the damped frequencies of `whirls`, rad/s, ascending."""
    companion = _companion(whirl_matrices(line, supports, speed))
    roots: Complexes = np.linalg.eigvals(companion).astype(np.complex128)
    return np.asarray(roots.imag[_oscillating(roots)], dtype=np.float64)


def _companion(own: WhirlMatrices) -> Complexes:
    """Return the matrix whose eigenvalues are the roots s, (4 n, 4 n)."""
    same, scale = np.eye(len(own.mass)), _scale(own)
    low = -np.linalg.solve(own.mass, np.hstack([own.stiffness / scale, own.damping]))
    return np.vstack([np.hstack([0 * same, scale * same]), low])


def _oscillating(roots: Complexes) -> Indices:
    """Return the indices of the roots of oscillations, one of each pair, ascending."""
    size = np.abs(roots)
    chosen = np.flatnonzero(roots.imag > STILL * size + ROUND_OFF * size.max())
    return np.asarray(chosen[np.argsort(roots[chosen].imag, kind="stable")])


def _scale(own: WhirlMatrices) -> float:
    """Return a frequency, rad/s, by which displacements are scaled to velocities."""
    ratio = np.abs(np.diag(own.stiffness)) / np.diag(own.mass)
    return float(np.sqrt(ratio.max()))


def undamped_critical_speeds(
    line: ShaftLine, supports: tuple[Held, ...]
) -> tuple[Floats, Floats]:
    """Return critical speeds of forward and of backward whirl without damping, rad/s.

    At these speeds the frequency of a free motion, static frame, is that of the speed.
    The supports are those at rest, and their differences between directions are left
    out; the supports' cross coupling, too.
    """
    own = line_matrices(line)
    held = own.stiffness.copy()
    for support in supports:
        row = row_between(support.at, support.to, line.size)
        held += support.support.at(0.0).stiffness.real * np.outer(row, row)
    found = []
    for sense in (1.0, -1.0):
        share = np.linalg.eigvals(np.linalg.solve(held, own.mass - sense * own.gyro))
        real = share.real[(share.real > 0.0) & (abs(share.imag) <= STILL * share.real)]
        found.append(np.sort(1 / np.sqrt(real)))
    return found[0], found[1]


def critical_speeds(
    line: ShaftLine, supports: tuple[Held, ...], fastest: float
) -> list[tuple[float, Whirl]]:
    """Return the damped critical speeds up to a speed, and the free motion at each.

    At a critical speed, rad/s, the damped frequency of a free motion is that of the
    speed. Of two motions that meet it within 1/100 of `fastest` both are found if both
    rise or both fall past it.
    """
    speeds = np.linspace(fastest / SPEEDS * 1e-3, fastest, SPEEDS)
    faster, out = [_faster(line, supports, speed) for speed in speeds], []
    for low, high, before, after in zip(
        speeds, speeds[1:], faster, faster[1:], strict=False
    ):
        for rank in range(min(before, after), max(before, after)):
            ahead = partial(_ahead, line, supports, rank)
            speed = float(brentq(ahead, low, high, xtol=1e-9 * fastest))
            near = whirls(line, supports, speed)
            out.append((speed, min(near, key=lambda w: abs(w.frequency - speed))))
    return out


def _faster(line: ShaftLine, supports: tuple[Held, ...], speed: float) -> int:
    """Return how many free motions have a frequency above a speed, rad/s."""
    return int((whirl_frequencies(line, supports, speed) > speed).sum())


def _ahead(
    line: ShaftLine, supports: tuple[Held, ...], rank: int, speed: float
) -> float:
    """Return by how much a frequency exceeds a speed, rad/s; rank 0: the highest."""
    found = whirl_frequencies(line, supports, speed)
    return float(found[-1 - rank]) - speed if rank < len(found) else -speed
