"""Principal pivoting of 0 <= lam, 0 <= g + W lam, lam . (g + W lam) = 0.

lam are the multipliers, g the gaps without contact, W the Delassus matrix.
"""

from __future__ import annotations

from hpcwhirl.dynamics.kernels.compiled import inlined, part

SINGULAR = 1e-12  # ratio to the first pivot below which a pivot counts as round-off


@part
def solve_dense(matrix, right, size):
    """Solve matrix x = right by Gaussian elimination; return whether it is regular.

    matrix, right : only the first `size` rows and columns are used; right becomes x
    """
    least = 0.0
    for c in range(size):
        p = c
        for r in range(c + 1, size):
            if abs(matrix[r, c]) > abs(matrix[p, c]):
                p = r
        if p != c:
            for s in range(c, size):
                matrix[c, s], matrix[p, s] = matrix[p, s], matrix[c, s]
            right[c], right[p] = right[p], right[c]
        if c == 0:
            least = SINGULAR * abs(matrix[0, 0])
        if not abs(matrix[c, c]) > least:
            return False
        inverse = 1.0 / matrix[c, c]
        matrix[c, c] = inverse
        for r in range(c + 1, size):
            factor = matrix[r, c] * inverse
            for s in range(c + 1, size):
                matrix[r, s] -= factor * matrix[c, s]
            right[r] -= factor * right[c]
    for c in range(size - 1, -1, -1):
        total = right[c]
        for s in range(c + 1, size):
            total -= matrix[c, s] * right[s]
        right[c] = total * matrix[c, c]
    return True


@part
def solve_active(gaps, w, where, size, opened, small, right):
    """Solve g + W lam = 0 on blades where[:size]; return whether W is regular.

    Only the part of W of these blades counts.

    w, small : (N, N), W transposed, m/N; (N, N + 1), work space
    right : (N,), out: multipliers of these blades, N, in the order of `where`
    opened : (N,), out: corrected gaps of all blades, m
    """
    for r in range(size):
        right[r] = -gaps[where[r]]
        for s in range(size):
            small[r, s] = w[where[s], where[r]]
    if not solve_dense(small, right, size):
        return False
    for i in range(len(gaps)):
        opened[i] = gaps[i]
    for s in range(size):
        column, factor = w[where[s]], right[s]
        for i in range(len(gaps)):
            opened[i] += column[i] * factor
    for s in range(size):
        opened[where[s]] = 0.0
    return True


@part
def exchange(active, size, where, right, opened, tolerance, all_of_them):
    """Exchange `active` of blades that violate complementarity; return their number.

    All of them are exchanged (block pivoting), or only the last one (Murty's rule).

    right, tolerance : N, multipliers of where[:size]; m, penetration allowed
    """
    wrong, last = 0, -1
    for s in range(size):
        if right[s] < 0.0:
            wrong += 1
            last = where[s]
            if all_of_them:
                active[last] = 0
    for i in range(len(opened)):
        if opened[i] < -tolerance:
            wrong += 1
            last = max(last, i)
            if all_of_them:
                active[i] = 1
    if wrong > 0 and not all_of_them:
        active[last] = 1 - active[last]
    return wrong


@inlined
def begin(gaps, lam, active):
    """Make the penetrating blades active, set lam to 0; return the largest |gap|, m."""
    largest = 0.0
    for i in range(len(gaps)):
        active[i] = 1 if gaps[i] < 0.0 else 0
        lam[i] = 0.0
        largest = max(largest, abs(gaps[i]))
    return largest


@part
def gather(active, where):
    """Set the first entries of `where` to the active blades; return their number."""
    size = 0
    for i in range(len(active)):
        if active[i] == 1:
            where[size] = i
            size += 1
    return size


@inlined
def improve(gaps, size, lam, opened, attempt, largest, space):
    """Try the first `size` blades of `where` as the active ones.

    Return 0 if this solves the problem, and set `lam`; -1 if their part of the Delassus
    matrix is singular; else exchange blades, and return how many violate
    complementarity.
    """
    _, w, _, small, right, active, where, _, _, _ = space
    if not solve_active(gaps, w, where, size, opened, small, right):
        return -1
    whole = attempt < 3 * len(gaps)
    wrong = exchange(active, size, where, right, opened, 1e-13 * largest, whole)
    if wrong == 0:
        for s in range(size):
            lam[where[s]] = right[s]
    return wrong
