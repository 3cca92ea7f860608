"""What a step of the time loop `bodies` does to a body, a rotor or a casing.

A body has n coordinates: displacements (scheme `paper`), or amplitudes of modes, which
rotation may couple (`general`). Its matrices have diagonal blocks only, each stored by
columns: one block of all displacements, a block for each mode, or for the modes of each
nodal diameter.

If the speed changes, the motion is the sum of y, which contact causes, and r, the
motion without contact, in the same modes. In the state the amplitudes of y come first,
then those of r, only for nodal diameters that a force excites. Tips and centre move by
y + r. Energies, losses and the work of contact are those of y, which only contact sets
in motion.

Within an interval of steps the matrices belong to its mean speed. The force that the
change of speed adds at step n is explicit:

f = f_0 - (dOmega/dt) C q_n,

where 2 Omega C is the matrix of Coriolis forces (`bodies.varying`), and f_0, the force
of the unbalance, Euler's force on the blades and the weight, acts on r alone. The work
on y, (y_{n+1} - y_{n-1}) f / 2, is entered as work of the loading.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from hpcwhirl.arrays import Floats
from hpcwhirl.dynamics.kernels import standing
from hpcwhirl.dynamics.kernels.compiled import by_numba, inlined, part
from hpcwhirl.dynamics.kernels.contact import (
    BESIDE_X,
    BESIDE_Y,
    OF_WHOLE,
    PULSE,
    read_ring,
)


class Motion(NamedTuple):
    """A body's arrays in a step, (n,) each, for n coordinates q.

    Attributes
    ----------
    q, d, loss : arrays of the state: q_n, d_n = q_n - q_{n-1}, and damping losses so
        far, J
    ahead, following : increments d_{n+1} = q_{n+1} - q_n, and q_{n+1}
    normal, drag : generalized forces, N for displacements: normal contact forces;
        friction
    """

    q: Floats
    d: Floats
    loss: Floats
    ahead: Floats
    following: Floats
    normal: Floats
    drag: Floats


@part
def accumulate(rows, values, out):
    """Set out (r,) to the sum of rows of a table, each times a value: values @ rows.

    rows, values : (n, r), (n,); four rows are added at a time
    """
    for j in range(len(out)):
        out[j] = 0.0
    fours = len(values) // 4 * 4
    for m in range(0, fours, 4):
        a, b, c, d = values[m], values[m + 1], values[m + 2], values[m + 3]
        ra, rb, rc, rd = rows[m], rows[m + 1], rows[m + 2], rows[m + 3]
        for j in range(len(out)):
            out[j] += (a * ra[j] + b * rb[j]) + (c * rc[j] + d * rd[j])
    for m in range(fours, len(values)):
        factor, row = values[m], rows[m]
        for j in range(len(out)):
            out[j] += factor * row[j]


@inlined
def apply_block(matrix, at, size, first, vector, sign, out):
    """Add sign * block @ vector to out, four columns at a time.

    A group of columns is left out whose factors are 0, as of most forces of contact on
    displacements.

    at, size, first : index in `matrix` where the block begins; its size; its first row
    """
    into, four = out[first : first + size], first + size // 4 * 4
    for i in range(first, four, 4):
        a, b = sign * vector[i], sign * vector[i + 1]
        c, d = sign * vector[i + 2], sign * vector[i + 3]
        if abs(a) + abs(b) + abs(c) + abs(d) != 0.0:
            one, two = matrix[at : at + size], matrix[at + size : at + 2 * size]
            rest = matrix[at + 2 * size : at + 4 * size]
            for r in range(size):
                both = c * rest[r] + d * rest[size + r]
                into[r] += (a * one[r] + b * two[r]) + both
        at += 4 * size
    for i in range(four, first + size):
        factor, one = sign * vector[i], matrix[at : at + size]
        for r in range(size):
            into[r] += factor * one[r]
        at += size


@part
def apply_blocks(matrix, starts, vector, sign, out):
    """Add sign * matrix @ vector to out, for a matrix with diagonal blocks only.

    matrix : the blocks, flat, each by columns
    starts : (b + 1,), first row of each of b blocks, and the number of rows
    vector, out : (n,), in; (n,), in and out
    """
    if len(starts) == len(vector) + 1:
        for m in range(len(vector)):
            out[m] += sign * matrix[m] * vector[m]
        return
    at = 0
    for b in range(len(starts) - 1):
        first, size = starts[b], starts[b + 1] - starts[b]
        apply_block(matrix, at, size, first, vector, sign, out)
        at += size * size


@part
def form(matrix, starts, left, right, work):
    """Return left @ matrix @ right, a number, for a matrix with diagonal blocks only.

    matrix, starts : as in `apply_blocks`
    left, right, work : (n,), vectors; (n,), work space
    """
    work[:] = 0.0
    apply_blocks(matrix, starts, right, 1.0, work)
    total = 0.0
    for m in range(len(work)):
        total += left[m] * work[m]
    return total


@part
def beside(still, values, out):
    """Set out (n,) to a body's coordinates less those of its circle, in which it rests.

    Energies of an unbalanced rotor are measured from this circle, see `Body`.

    still : (n,), coordinates on the circle, or (0,) if there is none
    values : (n,), coordinates of the body
    """
    for i in range(len(out)):
        out[i] = values[i]
    for i in range(len(still)):
        out[i] -= still[i]


@part
def predict(body, motion):
    """Predict a body's step without contact: increments, and coordinates after it.

    They are stored in motion.ahead and motion.following.

    body, motion : `kernel_types.Body`; `Motion`
    """
    q, d, _, ahead, following, _, _ = motion
    ahead[:] = 0.0
    apply_blocks(body.keep, body.starts, d, 1.0, ahead)
    apply_blocks(body.pull, body.starts, q, -1.0, ahead)
    for m in range(len(q)):
        following[m] = q[m] + ahead[m]


@part
def load(body, motion, push, modal):
    """Add the effect of the pulse on the casing to its predicted step without contact.

    motion.normal and motion.drag are used as work space.

    body, motion : the casing; its `Motion`, of which ahead and following change
    push : N, force of the pulse
    modal : (n,), the casing's generalized forces of a unit force
    """
    _, _, _, ahead, following, force, change = motion
    for m in range(len(ahead)):
        force[m] = push * modal[m]
    change[:] = 0.0
    apply_blocks(body.give, body.starts, force, 1.0, change)
    for m in range(len(ahead)):
        ahead[m] += change[m]
        following[m] += change[m]


@part
def stand(body, motion, angle, force):
    """Add the effect of supports and of a changing speed to the rotor's predicted step.

    The increments that these forces cause are added to motion.ahead and .following. The
    supports are those that differ by direction or have a film. The force -(dOmega/dt) C
    q_n is part of `predict`.

    body, motion : the rotor; its `Motion`
    angle : rad, of the rotor at the present step
    force : (room,), out: N, forces of the supports on the rotor, x and y of each, if
        they exert one that no constant matrix represents; work space, see
        `standing.room_of`
    """
    if len(body.force) == 0:
        standing.stand(body, motion, angle, force)
        return
    q, _, _, ahead, following, _, _ = motion
    along, across = math.cos(angle), math.sin(angle)
    for m in range(body.own, len(q)):
        change = along * body.weight[0, m] + across * body.weight[1, m]
        change += body.force[m]
        ahead[m] += change
        following[m] += change
    standing.stand(body, motion, angle, force)


@part
def yielded(body, motion, force, ledger):
    """Enter the work in a step, J, of rotor forces that no constant matrix represents.

    `stand` has added the increments that these forces cause. The work of supports is
    subtracted from the body's loss; that of a changing speed, on the motion that
    contact causes, is added to the work of the loading in the ledger. motion.normal is
    used as work space.

    body, motion : the rotor; its `Motion`
    force : (room,), N, as `stand` has set it
    """
    standing.yielded(body, motion, force)
    if len(body.force) == 0:
        return
    q, d, _, ahead, _, swerved, _ = motion
    swerved[:] = 0.0
    apply_blocks(body.swerve, body.starts[: body.blocks + 1], q, -1.0, swerved)
    for m in range(body.own):
        ledger[PULSE] += 0.5 * swerved[m] * (d[m] + ahead[m])


@part
def read(body, values, out):
    """Compute the radial displacements of a body from its coordinates.

    values : (n,), coordinates
    out : (r,), out: m; of a rotor: those of N tips, then x_o, y_o; of a casing: its
        radial coordinates
    """
    accumulate(body.read, values, out)


@part
def read_tips(body, values, radial, tips):
    """Compute the radial and tangential displacement of each tip, and the centre's.

    values : (n,), coordinates of the rotor
    radial : (N + 2,), result of `read` for them
    tips : (N + 1, 2), out: m, rotating frame; last row x_o, y_o
    """
    tangential = body.tangential
    blades = len(tangential)
    for j in range(blades):
        total = 0.0
        for m in range(len(values)):
            total += tangential[j, m] * values[m]
        tips[j, 0], tips[j, 1] = radial[j], total
    tips[blades, 0], tips[blades, 1] = radial[blades], radial[blades + 1]


@part
def collect_on(lam, index, shape, rows, out):
    """Compute the generalized forces out (n,) of forces on all tips, lam (N,), N.

    index, shape : as in `collect`
    rows : (r, n), the r coordinates that are pushed, for unit coordinates of the body
    """
    out[:] = 0.0
    for j in range(len(lam)):
        if lam[j] != 0.0:
            for a in range(index.shape[1]):
                part = lam[j] * shape[j, a]
                row = rows[index[j, a]]
                for m in range(len(out)):
                    out[m] += part * row[m]


@part
def collect(body, motion, lam, tau, index, shape):
    """Compute the generalized forces of contact on a body.

    They are written to motion.normal and, those of friction, motion.drag.

    lam, tau : (N,), N, multipliers of the tips; friction on the casing
    index, shape : (N, w), the w radial coordinates of the body on which each tip acts,
        and their weights (-1 for the rotor, which is pushed inward)
    """
    collect_on(lam, index, shape, body.radial, motion.normal)
    collect_on(tau, index, shape, body.tangential, motion.drag)


@part
def slide(body, increments, lam, index, shape, work, out):
    """Compute how far tips slide along increasing theta by a body's increments, m.

    The body's tangential displacement is added to out (N,), for tips with lam > 0.

    increments, lam : (n,), of the body's coordinates; (N,), multipliers of the tips, N
    index, shape : as in `collect`; the rotor's weights are -1, so that the parts of
        both bodies add up to the motion of the casing relative to the tip
    work : (r,), work space, r the number of the body's radial coordinates
    """
    for r in range(len(work)):
        row, total = body.tangential[r], 0.0
        for m in range(len(increments)):
            total += row[m] * increments[m]
        work[r] = total
    for j in range(len(lam)):
        if lam[j] > 0.0:
            out[j] += read_ring(work, index, shape, j)


@part
def meet(body, motion):
    """Add the effect of contact forces to a body's increments.

    The forces, motion.normal and motion.drag, change motion.ahead of the first
    body.own coordinates. They act neither on those that represent a circle or an
    ellipse nor on those of the motion without contact. motion.following is used as work
    space.
    """
    _, _, _, ahead, push, normal, drag = motion
    push[body.own :] = 0.0
    for m in range(body.own):
        push[m] = normal[m] + drag[m]
    apply_blocks(body.give, body.starts, push, 1.0, ahead)


@part
def accept(body, motion, step):
    """End a step: set motion.q and motion.d to the new state; add the loss, J.

    The loss is b D b / (4 dt) + b S q / 2, b = q_{n+1} - q_{n-1}, by the matrix D of
    damping and S of circulatory forces; q is measured from a circle in which the body
    rests. It is added to motion.loss. motion.following and .normal are used as work
    space.

    step : dt, s
    """
    q, d, lost, ahead, apart, work, _ = motion
    for m in range(len(q)):
        d[m] += ahead[m]
    starts = body.starts[: body.blocks + 1]
    loss = form(body.damping, starts, d, d, work) / (4.0 * step)
    if len(body.push) > 0:
        beside(body.still, q, apart)
        loss += 0.5 * form(body.push, starts, d, apart, work)
    lost[0] += loss
    for m in range(len(q)):
        d[m] = ahead[m]
        q[m] += ahead[m]


@part
def energy_of(body, starts, parts, step, work):
    """Return the energy of the blocks that `starts` lists, J, see `energy`.

    parts : q_{n+1}, its increment in the step, and q_n, (n,) each
    step, work : dt, s; (n,), work space
    """
    after, rises, before = parts
    moved = form(body.mass, starts, rises, rises, work) / step**2
    return 0.5 * (moved + form(body.stiffness, starts, before, after, work))


@by_numba()
def energy(body, values, increments, step):
    """Return a body's energy (Jacobi's, of a rotor that turns) between steps, J.

    It is 1/2 v M v + 1/2 q_n K q_{n+1}, v = (q_{n+1} - q_n) / dt, with coordinates
    measured from a circle in which the body rests.

    values, increments : (n,), q_{n+1} and q_{n+1} - q_n
    step : dt, s
    """
    after, work = values.copy(), np.empty_like(values)
    beside(body.still, values, after)
    parts = after, increments, after - increments
    return energy_of(body, body.starts[: body.blocks + 1], parts, step, work)


@part
def note_beside(body, motion, step, row):
    """Record the contact-free motion of a rotor at a changing speed in the evidence.

    The contact-free motion, which the rotor would have without any contact, is
    integrated as a separate part of its state. The evidence is the table of samples by
    which a case is judged. At constant speed nothing is recorded: the contact-free
    motion is known in closed form.

    motion, step : `Motion`, of which ahead, following, normal and drag are used as work
        space; dt, s
    row : row of the evidence, set from column `contact.COLUMNS` on: x_o, y_o of the
        contact-free motion, m, and the energy of the rotor's actual motion, J
    """
    if len(body.force) == 0:
        return
    q, d, _, values, rises, before, work = motion
    for m in range(len(q)):
        values[m], rises[m] = q[m], d[m]
    row[BESIDE_X], row[BESIDE_Y] = 0.0, 0.0
    centre = body.read.shape[1] - 2
    for s in range(len(body.alike)):
        m, own = body.own + s, body.alike[s]
        row[BESIDE_X] += body.read[m, centre] * q[m]
        row[BESIDE_Y] += body.read[m, centre + 1] * q[m]
        values[own] += q[m]
        rises[own] += d[m]
    for m in range(len(q)):
        before[m] = values[m] - rises[m]
    row[OF_WHOLE] = energy_of(
        body, body.starts[: body.blocks + 1], (values, rises, before), step, work
    )
