"""The kept inverse of the Delassus matrix of the active blades, and its updates.

The Delassus matrix W, m/N, is the opening of all gaps by unit multipliers; active
blades are those in contact. The inverse of their part of W, N/m, gives their
multipliers from their gaps, and is kept from step to step.

For a few blades the inverse is computed anew. For more, a blade that leaves or enters
changes it by a product of a column and a row (bordering, Frobenius and Schur), which
takes n^2 operations where an inversion takes n^3. Every bit of the inverse follows from
the array `known` of the saved state: the present blades in order, and all changes since
the inverse was last computed anew. Each call of a time loop first undoes and repeats
these changes.
"""

from __future__ import annotations

from hpcwhirl.dynamics.kernels.compiled import inlined, rare
from hpcwhirl.dynamics.kernels.vectors import (
    FOUR,
    broadcast,
    element,
    fma,
    fnma,
    load,
    store,
)

REGULAR = 1e-8  # least ratio of a pivot to the first one; less makes gaps inaccurate
FEW = 8  # number of blades up to which inverting anew is faster than an update
CHANGES = 32  # updates after which the inverse is computed anew
# places in `known` after its N blades: number of active blades; whether the inverse is
# accurate; number of changes since an inversion; first of these changes
SIZE, SOUND, CHANGED, LOG = range(4)


def length_of_known(blades: int) -> int:
    """Return the length of the array `known`, which lists the active blades of a state.

    See `kernel_types.ConstantSpace`; blades : N
    """
    return blades + LOG + CHANGES


@rare
def invert(a, stride, size):
    """Invert a matrix (size, size) in place; return whether the inverse is accurate.

    It uses Gauss-Jordan elimination without pivoting. The inverse is accurate if all
    pivots are positive, as those of a P-matrix are, and not too small.

    a, stride : array with the matrix, flat; distance of its rows in the array
    """
    sound, least = True, REGULAR * a[0]
    for c in range(size):
        own = a[c * stride + c]
        sound = sound and own > 0.0 and own >= least
        inverse = 1.0 / own
        a[c * stride + c] = 1.0
        for s in range(0, size, FOUR):
            row = load(a, c * stride + s)
            store(a, c * stride + s, row * broadcast(inverse))
        for r in range(size):
            if r != c:
                factor = broadcast(a[r * stride + c])
                a[r * stride + c] = 0.0
                for s in range(0, size, FOUR):
                    product = factor * load(a, c * stride + s)
                    store(a, r * stride + s, load(a, r * stride + s) - product)
    return sound


@inlined
def place_of(j, blades, wide):
    """Return the index of blade j in an array of gaps in folded order.

    In that order the blades 0 .. N // 2 come first; a further blade j is in the second
    half, at index wide + N - j.

    blades, wide : N; half the length of the array
    """
    return j if 2 * j <= blades else wide + blades - j


@inlined
def blade_at(i, blades, wide):
    """Return the number of the blade at index i of an array of gaps in folded order.

    It is the inverse of `place_of`; padding counts as blade 0. See
    `loop.circulant.folded`.

    blades, wide : N; half the length of the array
    """
    half = i if i < wide else i - wide
    if 2 * half > blades or half == 0:
        return 0
    return half if i < wide else blades - half


@rare
def remember(where, size, blades, wide, known, inverse, rows, stride):
    """Compute the kept inverse anew, for the blades where[:size]; list them in `known`.

    Parameters
    ----------
    blades, wide : N; half the length of an array in folded order, see
        `loop.circulant.folded`
    known : out: the blades, their number, whether the inverse is accurate, no changes
    inverse : out: transpose of the inverse of their part of the Delassus matrix W, N/m,
        flat, in rows of length `stride`
    rows : (N, 2 wide) flat, m/N; row j is column j of W in folded order
    """
    for r in range(size):
        known[r] = where[r]
        row = where[r] * 2 * wide
        for s in range(size):  # the transpose, to be read by columns
            inverse[r * stride + s] = rows[row + place_of(where[s], blades, wide)]
    known[blades + SIZE] = size
    known[blades + SOUND] = 1 if invert(inverse, stride, size) else 0
    known[blades + CHANGED] = 0


@inlined
def note_change(change, sound, blades, known):
    """Record in `known` that a blade has entered or left the kept inverse.

    change : j if blade j enters; N (p + 1) + j if blade j leaves, at place p of `known`
    sound : whether the inverse is still accurate after it
    blades : N
    """
    known[blades + LOG + known[blades + CHANGED]] = change
    known[blades + CHANGED] += 1
    if not sound:
        known[blades + SOUND] = 0


@rare
def leave(p, blades, known, inverse, stride):
    """Remove a blade that no longer touches from the kept inverse.

    It is the blade at place p of the list `known`; the last blade of the list moves to
    its place, in the rows and columns of the inverse, too.

    known, stride : list of the active blades; length of a row of `inverse`
    """
    last = known[blades + SIZE] - 1
    pivot = inverse[p * stride + p]
    for r in range(last + 1):
        if r != p:
            factor = broadcast(inverse[r * stride + p] / pivot)
            for s in range(0, last + 1, FOUR):
                row = load(inverse, p * stride + s)
                own = load(inverse, r * stride + s)
                store(inverse, r * stride + s, fnma(factor, row, own))
    for s in range(last + 1):
        inverse[p * stride + s] = inverse[last * stride + s]
    for r in range(last):
        inverse[r * stride + p] = inverse[r * stride + last]
    note_change(blades * (p + 1) + known[p], pivot > 0.0, blades, known)
    known[p] = known[last]
    known[blades + SIZE] = last


@inlined
def border(j, size, blades, wide, known, inverse, rows, stride, work):
    """Compute what a blade j that enters the kept inverse M needs: M b and c M.

    Return c M b, m/N. b and c are the entries of the Delassus matrix W, m/N, that
    couple the blades of M to blade j: b in column j, c in row j.

    blades, wide : N; half the length of an array in folded order
    known, size : list of the blades of M; their number
    rows : (N, 2 wide) flat, m/N; row j is column j of W in folded order
    work : (4 stride,), out: b, c, M b, c M, each followed by zeros
    """
    for r in range(stride):
        inside = r < size
        i = known[r] if inside else j
        b = rows[i * 2 * wide + place_of(j, blades, wide)]
        c = rows[j * 2 * wide + place_of(i, blades, wide)]
        work[r], work[stride + r] = (b, c) if inside else (0.0, 0.0)
        work[2 * stride + r] = work[3 * stride + r] = 0.0
    both = 0.0
    for r in range(size):
        total, c = broadcast(0.0), broadcast(work[stride + r])
        for s in range(0, size, FOUR):
            row, sums = load(inverse, r * stride + s), load(work, 3 * stride + s)
            total = fma(row, load(work, s), total)
            store(work, 3 * stride + s, fma(row, c, sums))
        first, second = element(total, 0), element(total, 1)
        product = (first + second) + (element(total, 2) + element(total, 3))
        work[2 * stride + r] = product
        both += work[stride + r] * product
    return both


@rare
def enter(j, blades, wide, known, inverse, rows, stride, work):
    """Add blade j, which now touches, to the kept inverse, as its last row and column.

    blades, wide : N; half the length of an array in folded order, see
        `loop.circulant.folded`
    known, stride : list of the active blades; length of a row of `inverse`
    rows : (N, 2 wide) flat, m/N; row j is column j of the Delassus matrix W in folded
        order
    work : (4 stride,), work space
    """
    size, own = known[blades + SIZE], rows[j * 2 * wide + place_of(j, blades, wide)]
    for r in range(size):  # the vectors' lanes beyond the last blade must be 0
        for s in range(size, -(-size // FOUR) * FOUR):
            inverse[r * stride + s] = 0.0
    left = own - border(j, size, blades, wide, known, inverse, rows, stride, work)
    for r in range(size):
        factor = broadcast(work[2 * stride + r] / left)
        for s in range(0, size, FOUR):
            value = load(inverse, r * stride + s)
            value = fma(factor, load(work, 3 * stride + s), value)
            store(inverse, r * stride + s, value)
        inverse[r * stride + size] = -work[2 * stride + r] / left
        inverse[size * stride + r] = -work[3 * stride + r] / left
    inverse[size * stride + size] = 1.0 / left
    note_change(j, left > 0.0 and left >= REGULAR * own, blades, known)
    known[size] = j
    known[blades + SIZE] = size + 1


@inlined
def undo(blades, known):
    """Restore in `known` the list of active blades at the last full inversion.

    Return their number. It is the first half of `recall`, which repeats the changes.

    known : list of the present active blades, and of all changes since that inversion
    blades : N
    """
    size = known[blades + SIZE]
    for i in range(known[blades + CHANGED] - 1, -1, -1):
        change = known[blades + LOG + i]
        if change < blades:
            size -= 1
        else:
            p = change // blades - 1
            known[size] = known[p]
            known[p] = change % blades
            size += 1
    return size


@rare
def recall(blades, wide, space):
    """Recompute the kept inverse at the start of a time loop, with the same bits.

    The list `known` of the saved state has the active blades, and how they have changed
    since the last full inversion; that inversion and the changes are repeated.

    blades, wide : N; half the length of an array in folded order, see
        `loop.circulant.folded`
    space : `kernel_types.ConstantSpace`; its `inverse` is set
    """
    known, inverse, rows, stride = (
        space.known, space.inverse, space.rows, len(space.push),
    )  # fmt: skip
    if known[blades + SIZE] == 0:
        return
    changes, sound = known[blades + CHANGED], known[blades + SOUND]
    size = undo(blades, known)
    remember(known, size, blades, wide, known, inverse, rows, stride)
    for i in range(changes):
        change = known[blades + LOG + i]
        if change < blades:
            enter(change, blades, wide, known, inverse, rows, stride, space.work)
        else:
            leave(change // blades - 1, blades, known, inverse, stride)
    known[blades + SOUND] = sound


@inlined
def missing(active, blades, known):
    """Return how many blades must leave the kept inverse, and how many must enter it.

    active : (N,), 1 for the blades that it shall have, 0 for the others
    blades, known : N; list of the blades that it has now
    """
    leaving, staying, wanted = 0, 0, 0
    for p in range(known[blades + SIZE]):
        staying += active[known[p]]
    leaving = known[blades + SIZE] - staying
    for j in range(blades):
        wanted += active[j]
    return leaving, wanted - staying


@rare
def turn_to(active, where, blades, wide, space):
    """Change the kept inverse to that of the given active blades.

    Blades enter and leave one by one if they are few; else the inverse is computed
    anew.

    active : (N,), in: 1 for the blades that it shall have, else 0; overwritten
    where : (N + 1,), out: these blades, if the inverse is computed anew
    blades, wide : N; half the length of an array in folded order, see
        `loop.circulant.folded`
    space : `kernel_types.ConstantSpace`, with the inverse and the list `known`
    """
    known, inverse, rows, stride = (
        space.known, space.inverse, space.rows, len(space.push),
    )  # fmt: skip
    leaving, entering = missing(active, blades, known)
    size, changes = known[blades + SIZE] - leaving + entering, leaving + entering
    full = known[blades + CHANGED] + changes > CHANGES
    if known[blades + SOUND] == 0 or size <= FEW or full or 2 * changes > size:
        size = 0
        for j in range(blades):
            where[size] = j
            size += active[j]
        remember(where, size, blades, wide, known, inverse, rows, stride)
        return
    for p in range(known[blades + SIZE] - 1, -1, -1):
        if active[known[p]] == 0:
            leave(p, blades, known, inverse, stride)
    for p in range(known[blades + SIZE]):
        active[known[p]] = 0
    for j in range(blades):
        if active[j] == 1:
            enter(j, blades, wide, known, inverse, rows, stride, space.work)
