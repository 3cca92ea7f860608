"""What contact points read of the waves, and what their multipliers do, row by row.

The verbs of `points` for a row of each point, and what they do for unequal sectors;
for equal ones see `sectors`.
"""

from __future__ import annotations

from hpcwhirl.dynamics.kernels.compiled import does, inlined, verb
from hpcwhirl.dynamics.kernels.keep_inverse import place_of
from hpcwhirl.dynamics.kernels.point_types import PointRows
from hpcwhirl.dynamics.kernels.vectors import FOUR, broadcast, load, store
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
    """Take a step without forces, as `whole.turn_waves`.

    near : whether `read_close` probably follows; what that needs is set in spectra
    """


@verb
def read_every(rows, q, points, tips, spectra):
    """Set tips (2 wide,), folded, of all points; spectra : work space."""


@verb
def read_close(rows, q, points, gaps, row, known, tips, whole, near, spectra):
    """Compute the points that might touch, as `whole.read_near` does blades.

    near, spectra : as of `turn_points`
    """


@verb
def book_points(rows, push, where, active, q, spare, mu, step, gaps, row, before, sums,
                held, spectra):  # fmt: skip
    """Book the works of the multipliers, and set gaps of the active points before.

    Those that were also in contact two steps before were closed.

    Parameters
    ----------
    q : (m,), amplitudes before any force
    spare : (width,), whose last are the forces; its first may be set
    gaps, row : clearances of step n - 1
    before : (points,), out
    sums, held : as of `whole.push_waves`
    """


@verb
def push_points(rows, push, where, active, q, spectra):
    """Add what the multipliers do to the amplitudes; spectra as `book_points` left."""


@inlined
def begin_moves(s, q, modes):
    """Set the first of s (width,) to the amplitudes q before any force."""
    for m in range(0, modes, FOUR):
        store(s, m, load(q, m))


@inlined
def clear_forces(s, modes):
    """Set the last of s (width,), forces, to 0."""
    for m in range(modes, len(s), FOUR):
        store(s, m, broadcast(0.0))


@does(turn_points, PointRows)
@inlined
def turn_rows(_rows, q, ahead, _near, _spectra):
    """Apply `turn_points` to rows."""
    turn_waves(q, ahead)


@does(read_every, PointRows)
@inlined
def read_every_row(rows, q, points, tips, _):
    """Apply `read_every` to rows."""
    read_all(rows.read, q, points, tips)


@does(read_close, PointRows)
@inlined
def read_close_rows(rows, q, points, gaps, row, known, tips, whole, _near, _):
    """Apply `read_close` to rows."""
    return read_near(rows.read, q, points, gaps, row, known, tips, whole)


@does(book_points, PointRows)
@inlined
def book_rows(rows, push, where, active, q, spare, mu, step, gaps, row, before, sums,
              held, _):  # fmt: skip
    """Apply `book_points` to rows."""
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
    """Apply `push_points` to rows."""
    add_rows(rows.push, push, where, active, q, len(q))
