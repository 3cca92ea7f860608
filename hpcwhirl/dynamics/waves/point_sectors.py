"""Equal sectors with several points a tip: which waves have which nodal diameter.

A rotation by one sector maps modes of equal frequency to one another, by a matrix T:
with X_j the motion of blade j's points by the modes, X_j T = X_{j+1}. Its eigenvectors
u, with eigenvalues e^{2 pi i n / N}, are waves that travel around the rotor: X_j u =
e^{i n theta_j} X_0 u.

An eigensolver finds the modes with an error that is round-off of the highest frequency.
So, where points carry little mass, this relation between blades has errors of some
1e-9, and terms of rotation couple waves of different n by as much. Sectors that differ
by at most `EQUAL` are made equal, by the mean over all of them, see `Sectors`, so that
all works are consistent.

The nodal diameter of a wave is found from the motion that it causes at all points, and
from how forces at the points change it. If either contradicts equal sectors for a wave,
the coefficients are stored for every point of every blade instead of once for all.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import schur

from hpcwhirl.arrays import Complexes, Floats, Integers
from hpcwhirl.dynamics.kernels.loop.wave_types import SectorRows
from hpcwhirl.dynamics.kernels.vectors import FOUR, all_aligned, widths
from hpcwhirl.dynamics.waves.slots import transforms
from hpcwhirl.reduction.bodies import contact_rows
from hpcwhirl.reduction.cyclic_coordinates import runs
from hpcwhirl.reduction.model import MOST_KEPT, Model

FEWEST = 3  # least number of sectors for which waves have a direction
EQUAL = 1e-8  # relative difference of sectors that are made equal
SAME = 1e-11  # relative difference of frequencies, and of sectors, that counts as none
CLOSE = 1e-3  # relative difference of frequencies whose modes round-off may mix
ALIKE = 1e-13  # relative difference of rows of two waves that counts as none


def travelling(model: Model, lost: float = 0.0) -> dict[int, Any]:
    """Return the waves that travel around a rotor of equal sectors, by nodal diameter.

    The result is {n: (m, c), c waves of nodal diameter n as combinations of the m modes
    at rest}. Those of n = 0 and N / 2 are real. The others are complex, and their
    conjugates are the waves that travel the other way. The result is empty if sectors
    differ.

    lost : difference up to which two omega^2 are equal, relative to the highest
    """
    body, blades = model.rotor, model.blades
    size, squared = len(body.omega), body.omega**2
    found = dict[int, list[Any]]()
    lost = lost * squared.max(initial=0.0)
    if blades < FEWEST or (np.diff(body.omega) < 0.0).any():
        return {}
    moved = np.stack(contact_rows(body, blades)).reshape(2, blades, -1, size)
    tips = moved.swapaxes(0, 1).reshape(blades, -1, size)
    same = list(runs(body.omega, CLOSE * body.omega))
    alone = np.setdiff1d(np.arange(size), np.concatenate([[], *same]).astype(int))
    for group in [*same, *alone[:, None]]:
        if np.ptp(body.ratios[group]) > SAME:
            return {}
        for n, own in _turned(tips[:, :, group], blades, squared[group], lost):
            wide = np.zeros((size, own.shape[1]), own.dtype)
            wide[group] = own
            found.setdefault(n, []).append(wide)
    blocks = {n: np.hstack(found[n]) for n in sorted(found)}
    counted = sum(block.shape[1] for block in with_conjugates(blocks.values()))
    return blocks if counted == size else {}


def _turned(
    tips: Floats, blades: int, squared: Floats, lost: float
) -> list[tuple[int, Any]]:
    """Return [(n, columns (g, c))], travelling waves of g modes of close frequencies.

    The c columns are waves of nodal diameter n, as combinations of the modes. The list
    is empty if a rotation by a sector does not map the modes to one another.

    An eigensolver mixes modes of close frequencies by round-off; waves of the same n
    are separated again by their frequencies.

    tips : (N, points, g), motion of each blade's points by the modes
    squared : (g,), omega^2
    lost : difference by which equal omega^2 may differ
    """
    size = tips.shape[-1]
    rows, ahead = tips.reshape(-1, size), np.roll(tips, -1, axis=0).reshape(-1, size)
    turn = np.linalg.lstsq(rows, ahead, rcond=None)[0]
    if not tips.any():
        turn = np.eye(size)
    values, columns = schur(turn, output="complex")
    number = np.rint(np.angle(np.diag(values)) * blades / (2 * np.pi)).astype(int)
    number = np.where(2 * number == -blades, blades // 2, number)
    out = []
    for n in np.unique(number[number >= 0]).tolist():
        own: Any = columns[:, number == n]
        if 2 * n % blades == 0:
            own = np.linalg.svd(np.hstack([own.real, own.imag]))[0][:, : own.shape[1]]
        own = own @ np.linalg.eigh((own.conj().T * squared) @ own)[1]
        one = ((np.abs(own) ** 2).T * squared).sum(axis=1)
        miss = np.abs(squared[:, None] * own - one * own).max()
        if miss > SAME * squared.max() + lost:
            return []
        out.append((n, own))
    return out


@dataclass(frozen=True)
class Sectors:
    """Means over all sectors of a rotor's matrices and motions, to make sectors equal.

    Attributes
    ----------
    blocks : {n: orthonormal combinations of modes}, see `travelling`
    blades : N

    For equal sectors the rotation by a sector, T = B diag(e^{2 pi i n / N}) B^H with B
    all blocks and their conjugates, commutes with each matrix, and X_j T = X_{j+1}, X_j
    the motion of blade j. The means over all rotations have both properties.
    """

    blocks: dict[int, Any]
    blades: int

    def matrix(self, matrix: Floats) -> Floats:
        """Return the mean of a rotor's matrix over all rotations by whole sectors.

        matrix : (m, m), in the modes at rest; so is the result
        """
        out = np.zeros_like(matrix)
        for block in self.blocks.values():
            twice = 1.0 + np.iscomplexobj(block)
            re, im = twice * block.real, twice * block.imag
            own = block.conj().T @ (matrix @ block.real + 1j * (matrix @ block.imag))
            left = block @ own
            out += left.real @ re.T + left.imag @ im.T
        return out

    def rows(self, rows: Floats) -> Floats:
        """Return the mean of the points' motions over all rotations by whole sectors.

        rows : (P, m), motion of P contact points in each of m modes
        """
        out, blade = np.zeros_like(rows), np.arange(self.blades)
        for n, block in self.blocks.items():
            waves = (rows @ block).reshape(self.blades, -1, block.shape[1])
            turn = np.exp(2j * np.pi * (n * blade % self.blades) / self.blades)
            mean = np.tensordot(turn.conj(), waves, axes=1) / self.blades
            whole = (turn[:, None, None] * mean).reshape(len(rows), -1)
            twice = 1.0 + np.iscomplexobj(block)
            out += twice * (whole @ block.conj().T).real
        return out

    def even(
        self, given: Sequence[Floats], mean: Callable[[Floats], Floats]
    ) -> list[Floats] | None:
        """Return arrays' means over all sectors; None if one differs by over `EQUAL`.

        The difference between an array and its mean is relative to its largest entry.

        given, mean : the arrays; `matrix` or `rows`, which returns the mean of one
        """
        out = [mean(one) for one in given]
        apart = (
            np.abs(a - b).max(initial=0.0) for a, b in zip(out, given, strict=True)
        )
        most = (EQUAL * np.abs(one).max(initial=0.0) for one in given)
        return out if all(a <= b for a, b in zip(apart, most, strict=True)) else None


@lru_cache(maxsize=MOST_KEPT)
def nearly_equal(model: Model) -> Sectors | None:
    """Return the `Sectors` of a rotor whose sectors are nearly equal; else None."""
    found = travelling(model, EQUAL)
    if not found:
        return None
    blocks = _orthonormal(list(found.values()))
    return Sectors(dict(zip(found, blocks, strict=True)), model.blades)


def _orthonormal(blocks: Sequence[Any]) -> list[Any]:
    """Return the nearest orthonormal blocks to given blocks of waves (m, c).

    Waves of different blocks, and the conjugates of complex ones, are orthogonal, too.
    """
    left, _, right = np.linalg.svd(np.hstack(with_conjugates(blocks)))
    every, out, at = left @ right, [], 0
    for block in blocks:
        own = every[:, at : at + block.shape[1]]
        out.append(own if np.iscomplexobj(block) else own.real)
        at += block.shape[1] * (1 + np.iscomplexobj(block))
    return out


def with_conjugates(blocks: Iterable[Any]) -> list[Any]:
    """Return blocks of waves (m, c), each complex block followed by its conjugate."""
    return [c for b in blocks for c in ([b, b.conj()] if np.iscomplexobj(b) else [b])]


def diameters_of(rows: Complexes, blades: int) -> Integers:
    """Return the nodal diameter n of each wave, -N/2 < n <= N/2, from its motion.

    rows : (points, waves), motion of the contact points in each wave, blade by blade
    """
    tips = rows.reshape(blades, -1, rows.shape[1])
    product = (tips.conj() * np.roll(tips, -1, axis=0)).sum(axis=(0, 1))
    number = np.rint(np.angle(product) * blades / (2 * np.pi)).astype(int)
    return np.where(2 * number == -blades, blades // 2, number)


@dataclass(frozen=True)
class Slots:
    """Place of each wave in the kernel `points`: slot (nodal diameter) and row.

    Rows are numbered as in `kernels.loop.wave_types.SectorRows`.

    Attributes
    ----------
    blades : N
    diameter, row : (waves,), slot of each wave, and its row
    single, pairs : numbers of rows of single waves, and of pairs
    other : (waves,), the other wave of a wave's pair, or -1
    """

    blades: int
    diameter: Integers
    row: Integers
    single: int
    pairs: int
    other: Integers

    @property
    def k(self) -> int:
        """Number of slots, one for each nodal diameter 0 .. N // 2, padded."""
        return widths(self.blades)[0]

    @property
    def index(self) -> Integers:
        """Indices (waves,) of the waves among the kernel's complex amplitudes."""
        return np.asarray(self.row * self.k + self.diameter)

    @property
    def size(self) -> int:
        """Number of the kernel's complex amplitudes, before padding."""
        return (self.single + 2 * self.pairs) * self.k

    def laid(self, values: Complexes, rows: int) -> Floats:
        """Return coefficients of waves in the order of the kernel, flat.

        That order is a table for each coefficient: its columns are the k nodal
        diameters (padded), its row f has the f-th wave of each of them.

        values : (r, waves), complex; the result has re and im of each, (r, rows, 2, k)
        rows : number of rows of the table; waves that would be in further rows, such as
            the second of each pair, are left out
        """
        out = np.zeros((len(values), rows, 2, self.k))
        there = self.row < rows
        place = self.row[there], slice(None), self.diameter[there]
        parts = np.stack([values[:, there].real, values[:, there].imag], axis=-1)
        out[(slice(None), *place)] = parts.swapaxes(0, 1)
        return out.ravel()


@dataclass(frozen=True)
class BladeRows:
    """Motion of blade 0's n_c contact points by waves, and change of waves by forces.

    Attributes
    ----------
    read, slide, before : (n_c, waves), for unit amplitudes: gaps, motion of the casing
        relative to the tip along the rotation, gaps two steps before
    push : (n_c, waves), change of the amplitudes by unit multipliers with friction
    move : (waves,), ratio of the material's motion from step n - 1 to n + 1 to its
        displacement at step n + 1
    friction : mu, with the sign of the speed
    """

    read: Complexes
    slide: Complexes
    before: Complexes
    push: Complexes
    move: Complexes
    friction: float

    def gives(self) -> Complexes:
        """Return the change of each wave's amplitude by a unit modal force, (waves,).

        A unit multiplier at a point changes the amplitude by `push`; its modal force,
        friction included, is conj(read + mu slide). The result is the ratio of both, at
        the point where the modal force is largest.
        """
        force = (self.read + self.friction * self.slide).conj()
        most = np.abs(force).argmax(axis=0), np.arange(force.shape[1])
        there = np.abs(force[most]) > 0.0
        return np.where(there, self.push[most] / np.where(there, force[most], 1.0), 0.0)

    def by_rows(self) -> NDArray[np.bool_]:
        """Return whether each wave's ratio `gives` is the same at all points, (waves,).

        If so, its change by forces follows from its modal force alone; else the kernel
        needs its row `push`.
        """
        told = self.gives() * (self.read + self.friction * self.slide).conj()
        miss = np.abs(self.push - told).max(axis=0)
        return np.asarray(miss <= ALIKE * np.abs(self.push).max(axis=0))

    def twin(self, i: int, others: Integers) -> int:
        """Return the index of the wave that forms a pair with wave i, or -1.

        Both waves of a pair move the points with equal coefficients, and their factors
        `move` and `gives` are conjugates.

        others : indices of the waves to compare with wave i
        """
        told = np.vstack([self.read, self.slide])
        factors = np.vstack([self.move, self.gives()])
        rows = np.abs(told[:, others] - told[:, [i]]).max(axis=0)
        apart = np.abs(factors[:, others] - factors[:, [i]].conj())
        rows, apart = rows / np.abs(told[:, i]).max(), apart / np.abs(factors[:, [i]])
        worst = np.maximum(rows, apart.max(axis=0))
        return int(others[worst.argmin()]) if worst.min() <= ALIKE else -1


def slots_of(blades: int, diameter: Integers, blade: BladeRows) -> Slots:
    """Return the place of each wave in the kernel `points`: slot and row.

    diameter, blade : (waves,), nodal diameter of each wave; motion of blade 0's points
    """
    other, plain = np.full(len(diameter), -1), blade.by_rows()
    moving = (np.abs(blade.read).max(axis=0) > 0.0) & (blade.gives() != 0.0)
    for i in np.flatnonzero(plain & moving).tolist():
        free = plain & moving & (diameter == diameter[i]) & (other < 0)
        others = np.flatnonzero(free)
        others = others[others > i]
        if other[i] < 0 and len(others):
            found = blade.twin(i, others)
            if found >= 0:
                other[i], other[found] = found, i
    lower, row = other > np.arange(len(other)), np.zeros_like(diameter)
    each = [
        (
            np.flatnonzero((diameter == n) & lower),
            np.flatnonzero((diameter == n) & (other < 0) & plain),
            np.flatnonzero((diameter == n) & (other < 0) & ~plain),
        )
        for n in range(blades // 2 + 1)
    ]
    pairs = max(len(own) + len(alone) for own, alone, _ in each)
    single = max(len(others) for *_, others in each)
    for own, alone, others in each:
        row[others] = np.arange(len(others))
        row[own] = single + np.arange(len(own))
        row[other[own]] = row[own] + pairs
        row[alone] = single + len(own) + np.arange(len(alone))
    return Slots(blades, diameter, row, single, pairs, other)


def sector_rows(slots: Slots, blade: BladeRows, numbers: Floats) -> SectorRows:
    """Return the coefficients of the kernel `points` for a rotor of equal sectors.

    slots, blade : place of each wave; motion of the points of blade 0 by the waves
    numbers : (points, padded), m/N, motions along the casing over two steps by unit
        forces
    """
    single, pairs, k, blades = slots.single, slots.pairs, slots.k, slots.blades
    alike, groups = single + pairs, -(-blades // FOUR)
    gives = slots.laid(blade.gives()[None], alike + pairs).reshape(alike + pairs, -1)
    turns, _ = transforms(blades)
    lanes = np.zeros((groups * FOUR, 2 * k))
    lanes[:blades] = turns.reshape(blades, 2 * k)
    arrays = (
        slots.laid(blade.read, alike), slots.laid(blade.slide, alike),
        slots.laid(blade.push, single), slots.laid(blade.before, alike + pairs),
        slots.laid(blade.move[None], alike), gives[single:], numbers, turns,
        lanes.reshape(groups, FOUR, 2 * k).swapaxes(1, 2),
    )  # fmt: skip
    flat = all_aligned([np.ravel(array) for array in arrays])
    return SectorRows._make([*flat, len(blade.read), single, pairs])
