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
def book_points(rows, push, where, active, free, q, spare, mu, step, slips, gaps, row,
                before, sums, held, spectra):  # fmt: skip
    """Enter the works of a step's contact forces, and add what they change to waves.

    Also find the points' gaps at step n - 1; that of a point that was in contact at
    step n - 1, too, is 0.

    Parameters
    ----------
    rows : coefficients of the points
    push, where, active : multipliers, N, of the points where[:active]
    free, q : (m,) each, amplitudes of the waves: before any force of the step acts,
        which may be q itself; in and out: before the contact forces act, and after
    spare : (width,), its last entries are the forces, N
    mu, step : friction with the sign of the speed; number of the step
    slips : whether the points' motions along the casing are needed, see `held`
    gaps, row : clearances at step n - 1, without waves, m, from gaps[row] on
    before : (points,), out: gaps at step n - 1, m
    sums : (3,), J, in and out: twice the work of normal forces; twice that of friction;
        what contact has added to energy and damping loss together
    held : (HELD padded,), part of the state. First, for each point, its motion along
        the casing from step n - 1 to n + 1, m, when it was last in contact in a step
        with `slips`. Then three rows, for steps n, n + 1, n + 2 in turn: 2 plus the
        number of the step in which the point was in contact, so that 0 means never;
        times -1 if then coefficients or the casing's shape have changed
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
def give_all(rows, forces, half, size, free, q):
    """Add the effect of modal forces to complex amplitudes; return their work twice, J.

    The work is that on the motion from step n - 1 to n + 1, which is that of the free
    amplitudes and what all forces of the step change.

    rows : `PointRows`, of which `moves` and `gives`
    forces, size : (size,) or more, re, then im, of which those after `size` are 0
    free, q : (2 half,), re, then im, as in `book_points`
    """
    work = beside = broadcast(0.0)
    for m in range(0, half, FOUR):
        (re, im), (a, b) = load_both(q, half, m), load_both(rows.gives, half, m)
        (x, y), (c, d) = load_both(free, half, m), load_both(rows.moves, half, m)
        force = load(forces, m)
        re, im = fma(a, force, re), fma(b, force, im)
        if half + m < size:
            other = load(forces, half + m)
            re, im = fnma(b, other, re), fma(a, other, im)
            beside = fma(other, fma(d, x, fma(c, y, im - y)), beside)
        work = fma(force, fnma(d, y, fma(c, x, re - x)), work)
        store_both(q, half, m, (re, im))
    return total_of(work + beside)


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
def book_rows(rows, push, where, active, free, q, spare, mu, step, slips, gaps, row,
              before, sums, held, spectra):  # fmt: skip
    """Enter the works of contact forces in `sums`, and add what they change to waves.

    The implementation of `book_points`, with its arguments, for unequal sectors. Where
    a wave has a factor `moves`, the work of friction is that of all modal forces less
    that of normal forces, so that no row gives the motion along the casing.
    """
    points, width, modes = len(before), len(spare), len(q)
    wide, padded, half = len(gaps) // 6, len(held) // 4, len(q) // 2
    now, then = padded * (1 + step % 3), padded * (1 + (step + 1) % 3)
    apart, normal, drag = len(rows.moves) > 0, 0.0, 0.0
    size = len(rows.push) // points if apart else modes
    if apart and slips:
        times_all(rows.moves, free, half, size, spectra)
    for i in range(active):
        j = where[i]
        place, before[j] = place_of(j, points, wide), 0.0
        if held[then + j] == step:  # both gaps are closed
            opened = gaps[row + place] - gaps[step % 3 * 2 * wide + place]
            opened += turned_by(rows.turned, j, points, free, half)
        else:
            if held[then + j] != -step:
                was = tip_by_waves(rows.before, j, free, modes)
                before[j] = gaps[row + place] + was
            at = j * width
            opened = sum_four(four_sums(rows.opens, at, free, modes))
            opened += by_forces(rows.opens, at + modes, spare, modes)
        held[now + j] = step + 2
        normal += push[i] * opened
        if slips or not apart:
            at = j * (size + width - modes)
            slid = four_sums(rows.slides, at, spectra if apart else free, size)
            held[j] = sum_four(slid) + by_forces(rows.slides, at + size, spare, modes)
            drag += push[i] * held[j]
    drag = mu * drag
    if apart:
        work = push_modes(rows, push, where, active, size, free, q, spectra)
        drag = work - normal if mu != 0.0 else 0.0
    else:
        add_rows(rows.push, push, where, active, q, modes)
    sums[0] += normal
    sums[1] += drag
    sums[2] += 0.5 * (normal + drag)


@inlined
def push_modes(rows, push, where, active, size, free, q, forces):
    """Add the effect of contact forces by modal forces; return their work twice, J.

    rows, push, where, active, free, q : as in `book_points`
    size, forces : number of modal forces; (size,) or more, work space
    """
    for m in range(0, size, FOUR):
        store(forces, m, broadcast(0.0))
    add_rows(rows.push, push, where, active, forces, size)
    return give_all(rows, forces, len(q) // 2, size, free, q)
