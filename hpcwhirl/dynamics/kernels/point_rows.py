"""Operations of the kernel `points` on waves, implemented for unequal sectors.

Each point has a separate row of coefficients; for equal sectors see `sectors`.
"""

from __future__ import annotations

from hpcwhirl.dynamics.kernels.compiled import does, inlined, verb
from hpcwhirl.dynamics.kernels.keep_inverse import place_of
from hpcwhirl.dynamics.kernels.vectors import FOUR, broadcast, load, store
from hpcwhirl.dynamics.kernels.wave_types import PointRows
from hpcwhirl.dynamics.kernels.whole import (
    add_rows,
    moved_by,
    read_all,
    read_near,
    tip_by_waves,
    turn_waves,
)


@verb
def turn_points(rows, q, ahead, near, spectra):
    """Take a step without forces: multiply the amplitudes q of all waves by z.

    q, ahead : (m,), re, then im: amplitudes; z - 1, z the factor of each in a step
    near : whether a call of `read_close` is likely; then `spectra` is prepared for it
    """


@verb
def read_every(rows, q, points, tips, spectra):
    """Set tips (2 wide,), folded, to the part of all gaps that is due to waves, m.

    Folded arrays, (2 wide,), list all points in the order of `circulant.folded`.

    rows, q : coefficients of the points; (m,), amplitudes of the waves
    points, spectra : number of contact points; work space
    """


@verb
def read_close(rows, q, points, gaps, row, known, tips, whole, near, spectra,
               where):  # fmt: skip
    """Compute the gaps of points that might touch; return the lowest, m, and a flag.

    The flag tells whether the last solution had active points. Arguments are those of
    `whole.read_near`; near, spectra : as in `turn_points`
    """


@verb
def book_points(rows, push, where, active, q, spare, mu, step, gaps, row, before, sums,
                held, spectra):  # fmt: skip
    """Enter the works of contact forces; set the active points' gaps at step n - 1.

    The gap of a point that was in contact at step n - 1, too, is 0.

    Parameters
    ----------
    q : (m,), amplitudes before any force
    spare : (width,), its last entries are the forces, the others work space
    gaps, row : clearances at step n - 1, without waves
    before : (points,), out: gaps at step n - 1, m
    sums, held : as in `whole.push_waves`
    """


@verb
def push_points(rows, push, where, active, q, spectra):
    """Add to amplitudes q their change by multipliers push of points where[:active].

    rows, q : coefficients of the points; (m,), amplitudes of the waves
    spectra : in: as set by `book_points`
    """


@inlined
def begin_moves(s, q, modes):
    """Copy amplitudes q[:modes] to s[:modes] before any force of the step acts.

    s : (width,), the copied amplitudes, then the forces
    """
    for m in range(0, modes, FOUR):
        store(s, m, load(q, m))


@inlined
def clear_forces(s, modes):
    """Set the forces in s to 0: its entries from number `modes` on."""
    for m in range(modes, len(s), FOUR):
        store(s, m, broadcast(0.0))


@does(turn_points, PointRows)
@inlined
def turn_rows(_rows, q, ahead, _near, _spectra):
    """Multiply the amplitudes q of all waves by z: a step without forces.

    The implementation of `turn_points` for unequal sectors.

    Arguments are those of `turn_points`.
    """
    turn_waves(q, ahead)


@does(read_every, PointRows)
@inlined
def read_every_row(rows, q, points, tips, _):
    """Set tips (2 wide,), folded, to the part of all gaps that is due to waves, m.

    The implementation of `read_every` for unequal sectors. Folded arrays, (2 wide,),
    list all points in the order of `circulant.folded`.
    """
    read_all(rows.read, q, points, tips)


@does(read_close, PointRows)
@inlined
def read_close_rows(rows, q, points, gaps, row, known, tips, whole, _near, _,
                    where):  # fmt: skip
    """Compute the gaps of points that might touch; return the lowest, m, and a flag.

    The implementation of `read_close`, which explains both, for unequal sectors.
    """
    lowest = read_near(rows.read, q, points, gaps, row, known, tips, whole, where)
    return lowest, known[points] > 0


@does(book_points, PointRows)
@inlined
def book_rows(rows, push, where, active, q, spare, mu, step, gaps, row, before, sums,
              held, _):  # fmt: skip
    """Add the works of contact forces to `sums`; set the active points' earlier gaps.

    The implementation of `book_points`, which has the arguments, for unequal sectors.
    """
    points, width, modes = len(before), len(spare), len(q)
    wide, padded = len(gaps) // 6, len(held) // 4
    now, then = padded * (1 + step % 3), padded * (1 + (step + 1) % 3)
    begin_moves(spare, q, modes)
    for i in range(active):
        j = where[i]
        before[j] = 0.0
        if held[then + j] != step:
            was = tip_by_waves(rows.before, j, spare, modes)
            before[j] = gaps[row + place_of(j, points, wide)] + was
        held[now + j] = step + 2
        opened = moved_by(rows.opens, j * width, spare, modes)
        held[j] = moved_by(rows.slides, j * width, spare, modes)
        sums[0] += push[i] * opened
        sums[1] += push[i] * held[j]
        sums[2] += 0.5 * push[i] * (opened + mu * held[j])


@does(push_points, PointRows)
@inlined
def push_rows(rows, push, where, active, q, _):
    """Add to amplitudes q their change by multipliers push of points where[:active].

    The implementation of `push_points` for unequal sectors.
    """
    add_rows(rows.push, push, where, active, q, len(q))
