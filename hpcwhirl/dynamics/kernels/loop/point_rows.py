"""The operations of the time loop `points` on the waves of rotor and casing.

The loop is that of several contact points on each tip. A function with `verb` declares
an operation: the motion of a step without forces, gaps of points, works of contact
forces, effect of these on the waves. A function with `does` implements it here for
unequal sectors, in which each point has a separate row of coefficients
(`wave_types.PointRows`); for equal sectors see `sectors`.
"""

from __future__ import annotations

from hpcwhirl.dynamics.kernels.compiled import does, inlined, verb
from hpcwhirl.dynamics.kernels.keep_inverse import place_of
from hpcwhirl.dynamics.kernels.loop.wave_types import PointRows
from hpcwhirl.dynamics.kernels.loop.whole import (
    add_rows,
    four_sums,
    moved_by,
    read_all,
    read_near,
    sum_four,
    tip_by_waves,
    turn_waves,
)
from hpcwhirl.dynamics.kernels.vectors import (
    FOUR,
    broadcast,
    fma,
    fnma,
    load,
    load_both,
    store,
    store_both,
    total_of,
)


@verb
def turn_points(rows, q, ahead, near, spectra):
    """Take a step without forces: multiply the amplitudes q of all waves by factors z.

    rows : coefficients of the points, `wave_types.PointRows` or `SectorRows`
    q, ahead : (m,), re, then im: amplitudes, in and out; z - 1, z the factor of each in
        a step
    near : whether a call of `read_close` is likely; then `spectra` is prepared for it
    spectra : work space
    """


@verb
def read_every(rows, q, points, tips, spectra):
    """Compute how the waves of rotor and casing change the gaps of all points, m.

    The rest of a gap is the clearance and the casing's shape.

    rows, q : coefficients of the points; (m,), amplitudes of the waves
    points, spectra : number of contact points; work space
    tips : (2 wide,), out: these changes, in folded order, see `circulant.folded`
    """


@verb
def read_close(rows, q, points, gaps, row, known, tips, whole, near, spectra,
               where):  # fmt: skip
    """Compute the gaps of points that might touch; return the lowest, m, and a flag.

    A point might touch if the lower bound of its gap is not above 0. The flag tells
    whether the last solution had points in contact.

    Parameters
    ----------
    rows, q : coefficients of the points; (m,), amplitudes of the waves
    points : number of contact points, P
    gaps, row : m, in: gaps without the part of the waves, from index `row` on
    known : indices of the points in contact in the last solution, and at P their number
    tips, whole : (2 wide,), m, folded order, in: lower bounds of the waves' part of the
        gaps, and of the gaps; out: their values, for the points that are computed
    near : whether `turn_points` has prepared `spectra` for this call
    spectra, where : work space; the latter (P + 1,)
    """


@verb
def book_points(rows, push, where, active, q, spare, mu, step, gaps, row, before, sums,
                held, spectra):  # fmt: skip
    """Enter the works of a step's contact forces; find the points' gaps at step n - 1.

    The gap of a point that was in contact at step n - 1, too, is 0.

    Parameters
    ----------
    rows : coefficients of the points
    push, where, active : multipliers, N, of the points where[:active]
    q : (m,), amplitudes of the waves before any force of the step acts
    spare : (width,), its last entries are the forces, N, the others work space
    mu, step : friction with the sign of the speed; number of the step
    gaps, row : clearances at step n - 1, without waves, m, from gaps[row] on
    before : (points,), out: gaps at step n - 1, m
    sums : (3,), J, in and out: twice the work of normal forces; twice that of friction,
        divided by mu; what contact has added to energy and damping loss together
    held : (HELD padded,), part of the state. First, for each point, its motion along
        the casing from step n - 1 to n + 1 when it was last in contact, m. Then three
        rows, for steps n, n + 1, n + 2 in turn: 2 plus the number of the step in which
        the point was in contact, so that 0 means never; times -1 if then coefficients
        or the casing's shape have changed
    """


@verb
def push_points(rows, push, where, active, q, spectra):
    """Add the change by the contact forces of a step to the amplitudes q of waves.

    rows, q : coefficients of the points; (m,), amplitudes of the waves
    push, where, active : multipliers, N, of the points where[:active]
    spectra : in: as set by `book_points`
    """


@inlined
def begin_moves(s, q, modes):
    """Copy the amplitudes q of the waves to s[:modes] before forces act on them.

    s, modes : (width,), copied amplitudes, then forces, N; number of real amplitudes
    """
    for m in range(0, modes, FOUR):
        store(s, m, load(q, m))


@inlined
def clear_forces(s, modes):
    """Set the forces of a step, multipliers and pulse, to 0 in s[modes:].

    s, modes : (width,), amplitudes, then forces, N; number of real amplitudes
    """
    for m in range(modes, len(s), FOUR):
        store(s, m, broadcast(0.0))


@inlined
def turned_by(rows, j, points, q, half):
    """Return how the turn of the frame in two steps changes a point's gap, m.

    It is the gap at step n - 1 less what it would be where the point is at step n + 1.

    rows : `PointRows.turned`
    j, points : number of the point, and of points
    q, half : amplitudes in free motion; number of complex amplitudes
    """
    width = len(rows) // points // 2
    first = four_sums(rows, 2 * j * width, q, width)
    second = four_sums(rows, (2 * j + 1) * width, q[half:], width)
    return sum_four(first) + sum_four(second)


@inlined
def by_forces(rows, at, spare, modes):
    """Return what all forces of a step add to a point's motion over two steps, m.

    rows, at : m/N, `PointRows.slides`; index at which the point's entries of the forces
        begin
    spare, modes : (width,), the forces are its entries from index `modes` on
    """
    total = broadcast(0.0)
    for m in range(0, len(spare) - modes, FOUR):
        total = fma(load(rows, at + m), load(spare, modes + m), total)
    return total_of(total)


@inlined
def times_all(factors, q, half, size, out):
    """Multiply complex amplitudes by complex factors: set out[:size].

    factors, q : (2 half,), re, then im
    size : number of results needed, of re, then of im, >= half
    """
    for m in range(0, half, FOUR):
        (re, im), (a, b) = load_both(q, half, m), load_both(factors, half, m)
        store(out, m, fnma(b, im, a * re))
        if half + m < size:
            store(out, half + m, fma(b, re, a * im))


@inlined
def give_all(factors, forces, half, size, q):
    """Add to complex amplitudes q the modal forces times complex factors.

    factors, q : (2 half,), re, then im
    forces, size : (size,) or more, re, then im, of which those after `size` are 0
    """
    for m in range(0, half, FOUR):
        (re, im), (a, b) = load_both(q, half, m), load_both(factors, half, m)
        force = load(forces, m)
        re, im = fma(a, force, re), fma(b, force, im)
        if half + m < size:
            beside = load(forces, half + m)
            re, im = fnma(b, beside, re), fma(a, beside, im)
        store_both(q, half, m, (re, im))


@does(turn_points, PointRows)
@inlined
def turn_rows(_rows, q, ahead, _near, _spectra):
    """Take a step without forces: multiply the amplitudes q of all waves by factors z.

    The implementation of `turn_points`, with its arguments, for unequal sectors.
    """
    turn_waves(q, ahead)


@does(read_every, PointRows)
@inlined
def read_every_row(rows, q, points, tips, _):
    """Compute how the waves of rotor and casing change the gaps of all points, m.

    The implementation of `read_every`, with its arguments, for a rotor of unequal
    sectors, whose waves belong to the whole rotor. The changes are written to `tips`.
    """
    read_all(rows.read, q, points, tips)


@does(read_close, PointRows)
@inlined
def read_close_rows(rows, q, points, gaps, row, known, tips, whole, _near, _,
                    where):  # fmt: skip
    """Compute the gaps of points that might touch; return the lowest, m, and a flag.

    The implementation of `read_close`, with its arguments, for unequal sectors. The
    flag tells whether the last solution had points in contact.
    """
    lowest = read_near(rows.read, q, points, gaps, row, known, tips, whole, where)
    return lowest, known[points] > 0


@does(book_points, PointRows)
@inlined
def book_rows(rows, push, where, active, q, spare, mu, step, gaps, row, before, sums,
              held, spectra):  # fmt: skip
    """Enter the works of contact forces in `sums`; set the points' gaps at step n - 1.

    The implementation of `book_points`, with its arguments, for unequal sectors.
    """
    points, width, modes = len(before), len(spare), len(q)
    wide, padded = len(gaps) // 6, len(held) // 4
    now, then = padded * (1 + step % 3), padded * (1 + (step + 1) % 3)
    begin_moves(spare, q, modes)
    apart = len(rows.moves) > 0
    size = len(rows.push) // points if apart else modes
    if apart:
        times_all(rows.moves, q, modes // 2, size, spectra)
    for i in range(active):
        j = where[i]
        place, before[j] = place_of(j, points, wide), 0.0
        if held[then + j] == step:  # both gaps are closed
            opened = gaps[row + place] - gaps[step % 3 * 2 * wide + place]
            opened += turned_by(rows.turned, j, points, spare, modes // 2)
        else:
            if held[then + j] != -step:
                was = tip_by_waves(rows.before, j, spare, modes)
                before[j] = gaps[row + place] + was
            opened = moved_by(rows.opens, j * width, spare, modes)
        held[now + j] = step + 2
        at = j * (size + width - modes)
        slid = four_sums(rows.slides, at, spectra if apart else spare, size)
        held[j] = sum_four(slid) + by_forces(rows.slides, at + size, spare, modes)
        sums[0] += push[i] * opened
        sums[1] += push[i] * held[j]
        sums[2] += 0.5 * push[i] * (opened + mu * held[j])


@does(push_points, PointRows)
@inlined
def push_rows(rows, push, where, active, q, spectra):
    """Add the change by the contact forces of a step to the amplitudes q of waves.

    The implementation of `push_points`, with its arguments, for unequal sectors.
    """
    if len(rows.gives) == 0:
        add_rows(rows.push, push, where, active, q, len(q))
        return
    size = len(rows.push) // (len(where) - 1)
    for m in range(0, size, FOUR):
        store(spectra, m, broadcast(0.0))
    add_rows(rows.push, push, where, active, spectra, size)
    give_all(rows.gives, spectra, len(q) // 2, size, q)
