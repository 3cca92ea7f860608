"""Solution of the contact problem if more blades penetrate than the rank of W.

W is the Delassus matrix. Principal pivoting requires every principal part of W to be
regular. A rigid disk has two modes for all its blades: in a casing of harmonics 0 and 1
the rank of W is 3, and the gaps of all penetrating blades cannot be closed exactly; few
blades carry the load, the others are clear of the casing. Lemke's method finds which:
starting from a variable that opens all gaps at once, it passes from one regular part of
W to the next. It ends with a solution if there is one and x . W x >= 0 (Cottle, Pang
and Stone, The Linear Complementarity Problem, 4.4), as for equal blades with friction.
Multipliers may not be unique; then those found act on few blades. The gaps are unique.

Ties occur if several gaps close at once. So the gaps that govern the exchanges are
perturbed by up to `APART` times the largest one; the solution is that of the true gaps.
"""

from __future__ import annotations

from hpcwhirl.dynamics.kernels.compiled import rare
from hpcwhirl.dynamics.kernels.pivoting import solve_active

APART = 1e-12  # perturbation over the largest gap: above round-off, without effect
GOLDEN = 0.6180339887498949
LEAST = 1e-11  # least pivot, relative to the largest entry of W
CLOSED = 1e-10  # tolerance of closed gaps, relative to the largest gap


@rare
def set_out(gaps, w, chosen, size, unit, space):
    """Set up Lemke's table w = q + W z + z_0 for the blades chosen[:size].

    w are the gaps, z the multipliers; gaps are divided by the largest one, W by `unit`.
    The table is in these arrays of `space`:

    small : (size, size + 1), set to the coefficients of z and, in the last column, of
        z_0
    right : set to q, perturbed
    held, left : set to the variable of each row and column: w_i is i, z_i is size + i,
        z_0 is 2 size
    """
    small, right, held, left = space.small, space.right, space.held, space.left
    largest = 0.0
    for r in range(size):
        largest = max(largest, abs(gaps[chosen[r]]))
    for r in range(size):
        part = GOLDEN * (r + 1)
        right[r] = gaps[chosen[r]] / largest + APART * (part - int(part))
        held[r], left[r] = r, size + r
        for s in range(size):
            small[r, s] = w[chosen[s], chosen[r]] / unit
        small[r, size] = 1.0
    left[size] = 2 * size


@rare
def swap(size, row, column, space):
    """Exchange the variables of a row and a column of Lemke's table, see `set_out`."""
    small, right, held, left = space.small, space.right, space.held, space.left
    inverse = 1.0 / small[row, column]
    for s in range(size + 1):
        small[row, s] *= -inverse
    small[row, column] = inverse
    right[row] *= -inverse
    for r in range(size):
        if r != row:
            factor = small[r, column]
            small[r, column] = 0.0
            for s in range(size + 1):
                small[r, s] += factor * small[row, s]
            right[r] += factor * right[row]
    held[row], left[column] = left[column], held[row]


@rare
def first_at_zero(size, column, space):
    """Return the row of Lemke's table whose variable reaches 0 first; -1: none.

    The variable of the given column grows, see `set_out`.
    """
    found, least = -1, 0.0
    for r in range(size):
        slope = -space.small[r, column]
        if slope > LEAST:
            ratio = space.right[r] / slope
            if found < 0 or ratio < least:
                found, least = r, ratio
    return found


@rare
def carriers(size, space):
    """Pivot Lemke's table, see `set_out`, until z_0 is 0; return whether it is."""
    row, column = 0, size
    for r in range(size):
        if space.right[r] < space.right[row]:
            row = r
    for _ in range(50 + 20 * size):
        swap(size, row, column, space)
        left = space.left[column]
        if left == 2 * size:
            return True
        entering = left + size if left < size else left - size
        for s in range(size + 1):
            if space.left[s] == entering:
                column = s
        row = first_at_zero(size, column, space)
        if row < 0:
            return False
    return False


@rare
def settle(gaps, lam, opened, space):
    """Close the gaps of the active blades, except those with negative multipliers.

    Set `lam`, N, and `opened`, m, (N,) each; return the number of blades that stay
    active, or -1 if their part of the Delassus matrix is singular.
    """
    active, where, right = space.active, space.where, space.right
    for _ in range(len(gaps) + 1):
        size, pulls = 0, 0
        for j in range(len(gaps)):
            if active[j] == 1:
                where[size] = j
                size += 1
        if not solve_active(gaps, space.w, where, size, opened, space.small, right):
            return -1
        for s in range(size):
            if right[s] < 0.0:
                active[where[s]] = 0
                pulls += 1
        if pulls == 0:
            lam[:] = 0.0
            for s in range(size):
                lam[where[s]] = right[s]
            return size
    return -1


@rare
def widen(gaps, opened, chosen, size, largest):
    """Append blades that still penetrate to chosen[:size]; return the new length.

    Return -1 if one of the blades already chosen still penetrates.
    """
    more = size
    for j in range(len(gaps)):
        if opened[j] < -CLOSED * largest:
            chosen[more] = j
            more += 1
    for s in range(size):
        if opened[chosen[s]] < -CLOSED * largest:
            return -1
    return more


@rare
def solve_singular(gaps, lam, opened, space):
    """Solve the contact problem for a Delassus matrix of any rank, given in `space`.

    Arguments are those of `contact.complementarity`. Blades that penetrate only when
    the multipliers of the others act are included, too.
    """
    chosen, active, w = space.chosen, space.active, space.w
    unit, largest, size = 0.0, 0.0, 0
    for j in range(len(gaps)):
        unit, largest = max(unit, w[j, j]), max(largest, abs(gaps[j]))
        if gaps[j] < 0.0:
            chosen[size] = j
            size += 1
    for _ in range(len(gaps)):
        set_out(gaps, w, chosen, size, unit, space)
        if unit == 0.0 or not carriers(size, space):
            return -1
        active[:] = 0
        for r in range(size):
            if size <= space.held[r] < 2 * size:
                active[chosen[space.held[r] - size]] = 1
        found = settle(gaps, lam, opened, space)
        more = widen(gaps, opened, chosen, size, largest) if found >= 0 else -1
        if more <= size:
            return found if more == size else -1
        size = more
    return -1
