"""Contact forces of a step where the Delassus matrix W is constant: a round casing.

W, m/N, is the opening of all gaps by unit multipliers (normal contact forces, N). In
the rotating frame the ring's part of W is circulant, and so is a cyclic rotor's. So W
is computed once.

In nearly all steps the same blades are in contact as in the last solution, so that the
inverse of their part of W is kept, see `keep_inverse`, and tried first. If that fails,
other sets of blades are tried, and pivoting comes last.

Arrays of gaps, (2 wide,), are in folded order: the blades 0 .. N // 2 in the first
half, the blades N - j in the second, see `folded`.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from hpcwhirl.arrays import Floats, Indices, Integers
from hpcwhirl.dynamics.kernels.compiled import inlined, rare, rare_kernel
from hpcwhirl.dynamics.kernels.contact import contact_space
from hpcwhirl.dynamics.kernels.keep_inverse import (
    FEW,
    SIZE,
    SOUND,
    place_of,
    remember,
    turn_to,
)
from hpcwhirl.dynamics.kernels.kernel_types import ConstantSpace
from hpcwhirl.dynamics.kernels.loop.passes import lowest_of
from hpcwhirl.dynamics.kernels.loop.transform import (
    BEHIND,
    SPAN,
    room_of,
    to_gaps_split,
    to_slots,
)
from hpcwhirl.dynamics.kernels.pivoting import begin, gather, improve, solve_singular
from hpcwhirl.dynamics.kernels.vectors import (
    FOUR,
    add_six,
    add_two,
    aligned_zeros,
    all_aligned,
    broadcast,
    fma,
    fnma,
    get,
    load,
    lower_of,
    store,
    store_six,
)

MOST_KEPT = 8  # numbers of blades N whose index tables are cached
MANY = 48  # active blades beyond which a circulant W is applied by spectra
SMALL = 24  # N up to which the inverse is always computed anew, not updated
TRIES = 8  # corrected sets of active blades that are tried before pivoting starts
CLOSED = 1e-13  # penetration allowed in a solution, relative to the lowest gap


@lru_cache(maxsize=MOST_KEPT)
def folded(blades: int, wide: int) -> Integers:
    """Return the number of the blade at each place of an array in folded order.

    The result, and arrays of values of all N blades in this order, such as gaps, are (2
    wide,): they have blades j = 0 .. N // 2 in the first half, N - j (mod N) for the
    same j in the second; both halves are padded to the length `wide` with blade 0. So
    the transform from a spectrum computes the cosine and sine parts at j once for two
    blades.
    """
    i = np.arange(wide)
    half = np.where(2 * i > blades, 0, i)
    return np.concatenate([half, -half % blades])


def constant_space(blades: int, wide: int, w: Floats, known: Integers) -> ConstantSpace:
    """Return the work arrays of the contact problem with a constant Delassus matrix.

    The kept inverse in them is 0 until `keep_inverse.recall` computes it.

    blades, wide : N; half the length of an array of gaps in folded order
    known : array of the state that lists the blades in contact
    w : (N, N), m/N; column j is the opening of all gaps by a unit multiplier on blade j
    """
    padded = -(-blades // FOUR) * FOUR
    push, inverse, rows, work, again = aligned_zeros(
        padded, padded * padded, blades * 2 * wide, 4 * padded, 2 * wide
    )
    rows[:] = w[folded(blades, wide)].T.ravel()
    fallback = contact_space.py_func(blades, 0)
    fallback.w[:], fallback.have[:] = w.T, 1
    near, lam, opened = (np.zeros(blades) for _ in range(3))
    return ConstantSpace(
        push, known, inverse, rows, fallback.where, fallback, near, lam, opened, work,
        again, *(np.zeros(0) for _ in range(4)),
    )  # fmt: skip


def circulant_space(
    blades: int, wide: int, column: Floats, known: Integers, wave: Floats
) -> ConstantSpace:
    """Return the work arrays of the contact problem with a circulant Delassus matrix.

    If the transform from spectra to gaps has two stages, they include W's spectrum, by
    which W is applied to the multipliers of many blades.

    blades, wide : N; half the length of an array of gaps in folded order
    column : (N,), m/N, column 0 of W
    known : array of the state that lists the blades in contact
    wave : table of cos and sin of the transform from a spectrum to gaps, see
        `passes.to_gaps`
    """
    space = constant_space(blades, wide, column[_apart(blades)], known)
    span = wave[-BEHIND + SPAN]
    if span == 0.0 or span % FOUR:
        return space
    k = len(wave) // (2 * wide)
    own, spectrum, spread = all_aligned(
        [np.zeros(2 * k), np.zeros(4 * k), np.zeros(room_of(blades))]
    )
    _set_symbol(own, blades, column)
    return space._replace(symbol=own, wave=wave, spectrum=spectrum, spread=spread)


def _set_symbol(own: Floats, blades: int, column: Floats) -> None:
    """Set the spectrum of W, see `ConstantSpace.symbol`, from its column 0."""
    symbol = np.fft.rfft(column) * (2.0 / blades)
    symbol[0] /= 2.0
    if blades % 2 == 0:
        symbol[-1] /= 2.0
    parts = own.reshape(2, -1)
    parts[:, : len(symbol)] = symbol.real, symbol.imag


def renew(space: ConstantSpace, blades: int, column: Floats) -> None:
    """Change the work arrays of `circulant_space` to another matrix W.

    The kept inverse is computed anew as the time loop is called, see `recall`.
    """
    w = column[_apart(blades)]
    wide = len(space.again) // 2
    space.rows[:] = w[folded(blades, wide)].T.ravel()
    space.fallback.w[:] = w.T
    if len(space.symbol):
        _set_symbol(space.symbol, blades, column)


@lru_cache(maxsize=MOST_KEPT)
def _apart(blades: int) -> Indices:
    """Return the table (N, N) of (i - j) mod N, row i, column j, for N blades.

    By it a circulant matrix follows from its column 0.
    """
    j = np.arange(blades)
    return np.asarray(np.subtract.outer(j, j) % blades)


@inlined
def penetrating(gaps, row, blades, wide, where):
    """List the blades that penetrate (gap below 0) in `where`; return their number.

    gaps, row : m, gaps in folded order (blades 0 .. N // 2, then N - j), from gaps[row]
        on
    wide : half the length of the gaps
    """
    size = blades - blades  # 0, but no literal, which numba would specialise on
    for j in range(blades // 2 + 1):
        where[size] = j
        size += gaps[row + j] < 0.0
    for j in range(blades // 2 + 1, blades):
        where[size] = j
        size += gaps[row + wide + blades - j] < 0.0
    return size


@inlined
def multipliers(gaps, row, size, blades, wide, space):
    """Compute the multipliers, N, that close the gaps of the active blades exactly.

    The multipliers are minus the kept inverse times these gaps; they are written to
    space.push. Return the lowest of them; 0 if none is below 0.

    gaps, row : m, gaps without multipliers in folded order, from gaps[row] on
    size : number of active blades, which are space.known[:size]
    blades, wide : N; half the length of the gaps
    space : `kernel_types.ConstantSpace`
    """
    push, known, inverse, close = space.push, space.known, space.inverse, space.work
    padded, lowest = len(push), 0.0
    for s in range(size):
        close[s] = gaps[row + place_of(known[s], blades, wide)]
    for v in range(0, size - 2 * FOUR, 3 * FOUR):
        first = second = third = broadcast(0.0)
        for s in range(size):
            gap, at = broadcast(get(close, s)), s * padded + v
            first = fnma(load(inverse, at), gap, first)
            second = fnma(load(inverse, at + FOUR), gap, second)
            third = fnma(load(inverse, at + 2 * FOUR), gap, third)
        store(push, v, first)
        store(push, v + FOUR, second)
        store(push, v + 2 * FOUR, third)
    rest = -(-size // FOUR) % 3 * FOUR
    for v in range(-(-size // FOUR) * FOUR - rest, size, FOUR):
        total = broadcast(0.0)
        for s in range(size):
            gap = broadcast(get(close, s))
            total = fnma(load(inverse, s * padded + v), gap, total)
        store(push, v, total)
    for s in range(size):
        lowest = lowest if push[s] >= lowest else push[s]
    return lowest


@inlined
def by_slots(size, space):
    """Return whether to compute the gaps with `size` multipliers acting by spectra.

    That is faster if there are many, and possible if the Delassus matrix is circulant:
    it multiplies each entry of the multipliers' spectrum by a number.
    """
    return size > MANY and len(space.symbol) > 0


@rare
def openings_by_slots(gaps, row, size, wide, space):
    """Compute the gaps of all blades with the multipliers acting, m, by spectra.

    It does what `openings` does, with its arguments, for a circulant Delassus matrix:
    the gaps are written to space.again. Return four numbers: the least of them is the
    lowest gap, or 0 if no gap is below 0.
    """
    symbol, spectrum, again = space.symbol, space.spectrum, space.again
    k, least = len(symbol) // 2, broadcast(0.0)
    to_slots(space.push, space.known, size, space.wave, k, wide, space.spread, spectrum)
    for c in range(0, k, FOUR):
        a, b = load(symbol, c), load(symbol, k + c)
        re, im = load(spectrum, c), load(spectrum, k + c)
        store(spectrum, 2 * k + c, fnma(b, im, a * re))
        store(spectrum, 3 * k + c, fma(b, re, a * im))
    to_gaps_split(spectrum[2 * k :], space.wave, 0.0, k, wide, again, 0)
    for v in range(0, 2 * wide, FOUR):
        total = load(gaps, row + v) + load(again, v)
        store(again, v, total)
        least = lower_of(least, total)
    return least


@inlined
def openings(gaps, row, size, wide, space):
    """Compute the gaps of all blades with the multipliers acting, m: g + W lambda.

    They are written to space.again, (2 wide,), in folded order. Return the lowest of
    them; 0 if none is below 0.

    gaps, row : m, g, gaps without multipliers, in folded order from gaps[row] on
    size : number of active blades, space.known[:size], whose multipliers, N, are in
        space.push
    """
    if by_slots(size, space):
        return lowest_of(openings_by_slots(gaps, row, size, wide, space), 0.0)
    push, known, rows, again = space.push, space.known, space.rows, space.again
    least, whole = broadcast(0.0), 2 * wide - 2 * wide % (6 * FOUR)
    for v in range(0, whole, 6 * FOUR):
        six = (
            load(gaps, row + v), load(gaps, row + v + FOUR),
            load(gaps, row + v + 2 * FOUR), load(gaps, row + v + 3 * FOUR),
            load(gaps, row + v + 4 * FOUR), load(gaps, row + v + 5 * FOUR),
        )  # fmt: skip
        six = add_six(push, known, size, rows, 2 * wide, v, six)
        least = lower_of(least, store_six(again, v, six))
    for v in range(whole, 2 * wide, 2 * FOUR):
        two = load(gaps, row + v), load(gaps, row + v + FOUR)
        two = add_two(push, known, size, rows, 2 * wide, v, two)
        store(again, v, two[0])
        store(again, v + FOUR, two[1])
        least = lower_of(least, lower_of(two[0], two[1]))
    return lowest_of(least, 0.0)


@inlined
def settle(gaps, row, size, blades, wide, space):
    """Accept a solution of the contact problem: copy its gaps and its active blades.

    The gaps of all blades, m, are copied from space.again to `gaps`, those of the
    active blades, space.known[:size], as exactly 0. The active blades are copied to
    space.where. Return their number, `size`.

    gaps, row : out: array of gaps in folded order, and index in it of the step's first
        gap
    """
    known, where, again = space.known, space.where, space.again
    for v in range(0, 2 * wide, FOUR):
        store(gaps, row + v, load(again, v))
    for s in range(size):
        where[s] = known[s]
        gaps[row + place_of(known[s], blades, wide)] = 0.0
    return size


@inlined
def guess(gaps, row, lowest, blades, wide, space):
    """Compute a step's contact forces, assuming the active blades of the last solution.

    Set the gaps to those with contact and space.push to the multipliers, N, of the
    active blades; return the number of these. Return -1, and leave the gaps as they
    are, if the same blades as before do not give the solution, which is unique.

    gaps, row : m, in and out: gaps in folded order from gaps[row] on; in: without
        contact
    lowest : m, lowest of these gaps, < 0
    space : `kernel_types.ConstantSpace`
    """
    size = space.known[blades + SIZE]
    if not is_usable(blades, space.known):
        return -1
    if not multipliers(gaps, row, size, blades, wide, space) >= 0.0:
        return -1
    if not openings(gaps, row, size, wide, space) >= CLOSED * lowest:
        return -1
    return settle(gaps, row, size, blades, wide, space)


@inlined
def first_set(gaps, row, blades, wide, space):
    """Choose the blades that `seek` assumes first; return the number of sets to try.

    It is the set of blades assumed to be in contact. If few blades touch, or the wheel
    has at most `SMALL`, these are the penetrating blades, and no other set is tried (1
    is returned). Else they are the active blades of the last solution, which are
    corrected at each try.

    gaps, row : m, gaps without contact in folded order, from gaps[row] on
    """
    known, where = space.known, space.where
    penetrate = penetrating(gaps, row, blades, wide, where)
    few = blades <= SMALL or max(known[blades + SIZE], penetrate) <= FEW
    if few or known[blades + SOUND] == 0:
        remember(
            where, penetrate, blades, wide, known, space.inverse, space.rows,
            len(space.push),
        )  # fmt: skip
        return 1
    return TRIES + 1


@inlined
def is_usable(blades, known):
    """Return whether the kept inverse exists and is accurate enough to be used.

    It is the inverse of the part of the Delassus matrix of the blades in `known`, which
    were in contact in the last solution, see `keep_inverse`.
    """
    return known[blades + SIZE] > 0 and known[blades + SOUND] == 1


@inlined
def correct(limit, blades, wide, space):
    """Correct the assumed set of active blades, space.known, by the solution it gave.

    Blades with multipliers below 0 (space.push) leave the set; blades whose gaps with
    the multipliers acting (space.again) are below `limit`, m, enter it.
    """
    known, active = space.known, space.fallback.active
    for j in range(blades):
        active[j] = space.again[place_of(j, blades, wide)] < limit
    for s in range(known[blades + SIZE]):
        active[known[s]] = space.push[s] >= 0.0
    turn_to(active, space.where, blades, wide, space)


@rare
def seek(gaps, row, lowest, blades, wide, space):
    """Compute a step's contact forces, trying other active blades than the last.

    It is called if `guess` fails. Arguments and results are those of `guess`.
    """
    known, limit = space.known, CLOSED * lowest
    tries = first_set(gaps, row, blades, wide, space)
    for _ in range(tries):
        if not is_usable(blades, known):
            return -1
        size = known[blades + SIZE]
        pull = multipliers(gaps, row, size, blades, wide, space)
        below = openings(gaps, row, size, wide, space)
        if pull >= 0.0 and below >= limit:
            return settle(gaps, row, size, blades, wide, space)
        if tries > 1:
            correct(limit, blades, wide, space)
    return -1


@inlined
def solved(gaps, row, lowest, blades, wide, space):
    """Compute the contact forces of a step, by the first method that succeeds.

    The methods are `guess` (the active blades of the last solution), `seek` (corrected
    sets of them) and `solve_any` (pivoting). Arguments and results are those of
    `guess`, except that -1 means that no solution was found by any method.
    """
    size = guess(gaps, row, lowest, blades, wide, space)
    if size < 0:
        size = seek(gaps, row, lowest, blades, wide, space)
    if size < 0:
        size = solve_any(gaps, row, blades, wide, space)
        if by_slots(size, space):
            k = len(space.symbol) // 2
            to_slots(
                space.push, space.where, size, space.wave, k, wide, space.spread,
                space.spectrum,
            )  # fmt: skip
    return size


@inlined
def pivot(gaps, lam, opened, space):
    """Compute multipliers by pivoting, with the whole Delassus matrix in space.w.

    gaps, lam, opened : as in `contact.complementarity`, as is the result, the number of
        active blades or -1
    space : `kernel_types.ContactSpace`
    """
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
    """Compute a step's contact forces by pivoting from the penetrating blades.

    It is called if all faster ways fail. Arguments and results are those of `guess`,
    but -1 means that there is no solution. The inverse for the active blades is kept
    for the next step.
    """
    push, known, inverse, rows, where, fallback, near, lam, opened = space[:9]
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
