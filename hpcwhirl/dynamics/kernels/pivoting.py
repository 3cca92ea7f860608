"""Contact forces by pivoting: which blades touch, and with which normal forces.

The contact problem of a step is 0 <= lam, 0 <= g + W lam, lam . (g + W lam) = 0: lam
are the multipliers, N, normal forces between tips and casing; g are the gaps without
contact, m; W is the Delassus matrix, m/N, the opening of all gaps by unit multipliers.
Blades with lam > 0, which touch, are called active.

Principal pivoting requires every principal part of W to be regular. A rigid disk has
two modes for all its blades: in a casing of harmonics 0 and 1 the rank of W is 3, and
the gaps of all penetrating blades cannot be closed exactly; few blades carry the load,
the others are clear of the casing. Lemke's method finds which: starting from a variable
that opens all gaps at once, it passes from one regular part of W to the next. It ends
with a solution if there is one and x . W x >= 0 (Cottle, Pang and Stone, The Linear
Complementarity Problem, 4.4), as for equal blades with friction. Multipliers may not be
unique; then those found act on few blades. The gaps are unique.

Ties occur if several gaps close at once. So the gaps that govern the exchanges are
perturbed by up to `APART` times the largest one; the solution is that of the true gaps.
"""

from __future__ import annotations

from hpcwhirl.dynamics.kernels.compiled import inlined, part, rare

SINGULAR = 1e-12  # ratio to the first pivot below which a pivot counts as round-off


@part
def solve_dense(matrix, right, size):
    """Solve the equations matrix x = right by Gaussian elimination, in place.

    Return whether the matrix is regular. The solution x replaces `right`.

    matrix, right : (n, n) or larger; (n,); only the first `size` rows and columns are
        used
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
    """Compute the multipliers that close the gaps of the given blades: g + W lam = 0.

    Return whether the part of the Delassus matrix W of these blades is regular.

    Parameters
    ----------
    gaps : (N,), m, g, without multipliers
    w, small : (N, N), W transposed, m/N; (N, N + 1), work space
    where, size : the blades are where[:size]
    right : (N,), out: their multipliers lam, N, in the order of `where`
    opened : (N,), out: gaps of all N blades with these multipliers, m
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
    """Correct the set of blades assumed to touch; return how many blades were wrong.

    An active blade is wrong if its multiplier is below 0, another one if its gap is
    below -tolerance. All of them are switched in `active` if `all_of_them` (block
    pivoting), else the last one only (Murty's rule).

    active : (N,), in and out: 1 for blades assumed to touch, else 0
    where, size : the active blades are where[:size]
    right, opened : (N,), N, their multipliers; (N,), m, gaps of all blades with these
    tolerance : m, penetration allowed
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
    """Make the penetrating blades (gap below 0) active: pivoting begins with them.

    Return the largest |gap|, m. The multipliers lam are set to 0.

    gaps, lam : (N,), m; (N,), N, out
    active : (N,), out: 1 for active blades, else 0
    """
    largest = 0.0
    for i in range(len(gaps)):
        active[i] = 1 if gaps[i] < 0.0 else 0
        lam[i] = 0.0
        largest = max(largest, abs(gaps[i]))
    return largest


@part
def gather(active, where):
    """List the blades that are marked in `active`; return their number.

    active, where : (N,), 1 for blades assumed to touch, else 0; (N + 1,), out: their
        numbers
    """
    size = 0
    for i in range(len(active)):
        if active[i] == 1:
            where[size] = i
            size += 1
    return size


@inlined
def improve(gaps, size, lam, opened, attempt, largest, space):
    """Compute the forces if the blades space.where[:size] touch; correct this set.

    Return 0 if the forces solve the contact problem, and set `lam`; -1 if the blades'
    part of the Delassus matrix is singular; else exchange blades in space.active, and
    return how many had a negative multiplier or a negative gap.

    gaps, lam, opened : as in `contact.complementarity`
    attempt : number of sets of blades tried before
    largest : m, largest |gap| without contact
    space : `kernel_types.ContactSpace`
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


APART = 1e-12  # perturbation over the largest gap: above round-off, without effect
GOLDEN = 0.6180339887498949  # its multiples mod 1 are the perturbations
LEAST = 1e-11  # least pivot, relative to the largest entry of W
CLOSED = 1e-10  # tolerance of closed gaps, relative to the largest gap


@rare
def set_out(gaps, w, chosen, size, unit, space):
    """Set up Lemke's table of linear equations, w = q + W z + z_0, for some blades.

    w are the gaps of the blades chosen[:size], q these gaps without contact, both
    divided by the largest |q|; z are their multipliers, scaled accordingly, W is their
    part of the Delassus matrix divided by `unit`, m/N; z_0 >= 0 opens all gaps at once.
    The table is in these arrays of `space`:

    small : (size, size + 1), set to the coefficients of z and, in the last column, of
        z_0
    right : (size,), set to q, perturbed so that no two gaps close at once
    held, left : the variable that each row gives, and that each column multiplies: w_i
        is numbered i, z_i size + i, z_0 2 size

    gaps, w : (N,), m, without contact; (N, N), m/N, Delassus matrix of all blades,
        transposed
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
    """Solve one equation of Lemke's table for another variable, and insert it.

    It is inserted in all other equations. So the variables of row `row` and column
    `column` change places. The table is in `space`, see `set_out`; size : number of its
    rows
    """
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
    """Return which variable of Lemke's table becomes 0 first while another one grows.

    It is the row of that variable; -1 if none decreases to 0. The one that grows is
    that of column `column`; the table is in `space`, see `set_out`.

    size : number of rows of the table
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
    """Find the blades that carry the contact forces: Lemke's pivots, until z_0 is 0.

    Return whether z_0 becomes 0; then the multipliers z among the variables in
    space.held are those of the blades that carry load. The table is explained in
    `set_out`.

    size : number of rows of the table
    """
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
    """Compute the multipliers that close the gaps of the active blades.

    A blade whose multiplier would be below 0 becomes inactive, and the others are
    solved again. Return the number of blades that stay active, or -1 if their part of
    the Delassus matrix is singular.

    gaps, lam : (N,), m, gaps without contact; (N,), N, out: multipliers
    opened : (N,), m, out: gaps with the multipliers acting
    space : `kernel_types.ContactSpace`; its `active` has 1 for active blades, else 0
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
    """Append the blades that still penetrate to chosen[:size]; return the new number.

    Return -1 if one of the blades already chosen still penetrates. `solve_singular`
    applies Lemke's method again to the chosen blades.

    gaps, opened : (N,), m, without multipliers; with those of the blades chosen so far
    largest : m, largest |gap| without multipliers
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
    """Compute the contact forces of a step for a Delassus matrix of any rank (Lemke).

    It is called if a part of the matrix, in space.w, is singular. Lemke's method is
    applied to the penetrating blades; blades that penetrate only when the multipliers
    of these act are then included, too, and the method is repeated.

    gaps, lam, opened, space : as in `contact.complementarity`, as is the result, the
        number of active blades or -1
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
