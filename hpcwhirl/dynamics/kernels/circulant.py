"""The contact problem of blades beside a round casing, whose W is constant.

In the rotating frame the ring's part of W is circulant, and so is a cyclic rotor's.

Nearly always the penetrating blades are those in contact, and the same as in the step
before: the inverse of their part of W is kept until they change.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.dynamics.kernels.compiled import inlined, part, rare_kernel
from hpcwhirl.dynamics.kernels.contact import contact_space
from hpcwhirl.dynamics.kernels.kernel_types import ConstantSpace
from hpcwhirl.dynamics.kernels.lemke import solve_singular
from hpcwhirl.dynamics.kernels.pivoting import begin, gather, improve
from hpcwhirl.dynamics.kernels.vectors import (
    FOUR,
    all_aligned,
    broadcast,
    element,
    fma,
    fnma,
    load,
    lower_of,
    store,
)

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
MOST_KEPT = 8  # numbers of blades
REGULAR = 1e-8  # of the first pivot: an inverse of less would leave gaps open


@part
def invert(a, stride, size):
    """Invert a[:size, :size] (rows of `stride`, flat) in place; return soundness.

    Gauss-Jordan elimination without pivoting: sound where all pivots are positive, as
    those of a P-matrix are, and larger than round-off.
    """
    sound, least = True, REGULAR * a[0]
    for c in range(size):
        own = a[c * stride + c]
        sound = sound and own > 0.0 and own >= least
        inverse = 1.0 / own
        a[c * stride + c] = 1.0
        for s in range(size):
            a[c * stride + s] *= inverse
        for r in range(size):
            if r != c:
                factor = a[r * stride + c]
                a[r * stride + c] = 0.0
                for s in range(size):
                    a[r * stride + s] -= factor * a[c * stride + s]
    return sound


@inlined
def place_of(j, blades, wide):
    """Return the place of blade j in a folded row: blades 0 .. N // 2, then N - j."""
    return j if 2 * j <= blades else wide + blades - j


@part
def remember(where, size, blades, wide, known, inverse, rows, stride):
    """Invert and keep the part of W of the blades where[:size]."""
    for r in range(size):
        known[r] = where[r]
        row = where[r] * 2 * wide
        for s in range(size):  # the transpose, to be read by columns
            inverse[r * stride + s] = rows[row + place_of(where[s], blades, wide)]
    known[blades] = size
    known[blades + 1] = 1 if invert(inverse, stride, size) else 0


@lru_cache(maxsize=MOST_KEPT)
def folded(blades: int, wide: int) -> Integers:
    """Return the blades (2 wide,) of a folded row: 0 .. N // 2, then N - j.

    Each half is padded with blade 0.
    """
    i = np.arange(wide)
    half = np.where(2 * i > blades, 0, i)
    return np.concatenate([half, -half % blades])


def constant_space(blades: int, wide: int, w: Floats, known: Integers) -> ConstantSpace:
    """Return the work space of `guess` and `solve_any`; `recall` completes it.

    w : (N, N), m/N; column j is the opening of all gaps by a unit multiplier on blade j
    """
    padded = -(-blades // FOUR) * FOUR
    push, inverse, rows = all_aligned([
        np.zeros(padded), np.zeros(padded * padded),
        w[folded(blades, wide)].T.ravel(),
    ])  # fmt: skip
    fallback = contact_space.py_func(blades, 0)
    fallback.w[:], fallback.have[:] = w.T, 1
    work = [np.zeros(blades) for _ in range(3)]
    return ConstantSpace(
        push, known, inverse, rows, fallback.where, fallback, *work,
    )  # fmt: skip


def circulant_space(
    blades: int, wide: int, column: Floats, known: Integers
) -> ConstantSpace:
    """Return the work space of a circulant W; column : (N,), m/N, its column 0."""
    return constant_space(blades, wide, column[_apart(blades)], known)


@lru_cache(maxsize=MOST_KEPT)
def _apart(blades: int) -> NDArray[np.intp]:
    """Return (i - j) mod N, (N, N)."""
    j = np.arange(blades)
    return np.asarray(np.subtract.outer(j, j) % blades)


@inlined
def recall(blades, wide, space):
    """Invert the part of W of the last solution's blades, which the state holds."""
    known, inverse, padded = space.known, space.inverse, len(space.push)
    if known[blades] > 0:
        remember(known, known[blades], blades, wide, known, inverse, space.rows, padded)


@inlined
def penetrating(gaps, row, blades, wide, where):
    """Set `where` to the penetrating blades of a folded row; return their number."""
    size = blades - blades  # a literal 0 would be compiled for by itself
    for j in range(blades // 2 + 1):
        where[size] = j
        size += gaps[row + j] < 0.0
    for j in range(blades // 2 + 1, blades):
        where[size] = j
        size += gaps[row + wide + blades - j] < 0.0
    return size


@inlined
def guess(gaps, row, lowest, blades, wide, padded, push, known, inverse, rows, where,
          tries):  # fmt: skip
    """Solve the contact problem of a folded row for a likely set of active blades.

    Sets the corrected gaps, and the multipliers in `push`; returns the number of
    active blades. Returns -1, and leaves the row as it is, if neither the set of the
    last solution nor the penetrating blades give the solution, which is unique.
    lowest : lowest of the gaps, < 0; tries : 2, or 1 for the first set alone
    """
    sound = False
    size = known[blades]
    for attempt in range(tries):
        if attempt == 1:
            size = penetrating(gaps, row, blades, wide, where)
            remember(where, size, blades, wide, known, inverse, rows, padded)
        sound = size > 0 and known[blades + 1] == 1
        for v in range(0, size, FOUR):
            total = broadcast(0.0)
            for s in range(size):
                gap = gaps[row + place_of(known[s], blades, wide)]
                total = fnma(load(inverse, s * padded + v), broadcast(gap), total)
            store(push, v, total)
        for s in range(size):
            sound = sound and push[s] >= 0.0
        if sound:
            least = broadcast(0.0)
            for v in range(0, 2 * wide, FOUR):
                total = load(gaps, row + v)
                for s in range(size):
                    opening = load(rows, known[s] * 2 * wide + v)
                    total = fma(opening, broadcast(push[s]), total)
                least = lower_of(least, total)
            for i in range(FOUR):
                sound = sound and element(least, i) >= 1e-13 * lowest
        if sound:
            break
    if not sound:
        return -1
    for v in range(0, 2 * wide, FOUR):
        total = load(gaps, row + v)
        for s in range(size):
            opening = load(rows, known[s] * 2 * wide + v)
            total = fma(opening, broadcast(push[s]), total)
        store(gaps, row + v, total)
    for s in range(size):
        where[s] = known[s]
        gaps[row + place_of(known[s], blades, wide)] = 0.0
    return size


@inlined
def solved(gaps, row, lowest, blades, wide, push, known, inverse, rows, where,
           space):  # fmt: skip
    """Solve the contact problem of a folded row by `guess`, else by `solve_any`.

    Returns as `guess`; space : of all of push .. where
    """
    size = guess(
        gaps, row, lowest, blades, wide, len(push), push, known, inverse, rows, where, 2
    )
    if size < 0:
        size = solve_any(gaps, row, blades, wide, space)
    return size


@inlined
def pivot(gaps, lam, opened, space):
    """Solve as `contact.complementarity`, with all rows of W known."""
    largest = begin(gaps, lam, space.active)
    for attempt in range(3 * len(gaps) + 200):
        size = gather(space.active, space.where)
        wrong = improve(gaps, size, lam, opened, attempt, largest, space)
        if wrong == 0:
            return size
        if wrong < 0:
            break
    return solve_singular(gaps, lam, opened, space)


@rare_kernel
def solve_any(gaps, row, blades, wide, space):
    """Solve as `guess`, by pivoting; return the number of active blades, or -1."""
    push, known, inverse, rows, where, fallback, near, lam, opened = space
    for j in range(blades):
        near[j] = gaps[row + place_of(j, blades, wide)]
    size = pivot(near, lam, opened, fallback)
    for j in range(blades):
        gaps[row + place_of(j, blades, wide)] = opened[j]
    for s in range(size):
        push[s] = lam[where[s]]
    if size > 0:
        remember(where, size, blades, wide, known, inverse, rows, len(push))
    return size
