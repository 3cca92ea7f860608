"""A rotor whose modes are coupled by rotation, as a body of the time loop `bodies`.

Modes of one nodal diameter are contiguous, and only they are coupled: of each matrix
the diagonal blocks, one for each nodal diameter, are stored, each by columns. The
functions with `does` implement the operations of `verbs` for such a rotor.

If the speed changes, the motion is the sum of y, which contact causes, and r, the
motion without contact, in the same modes. In the state the amplitudes of y come first,
then those of r, only for nodal diameters that a force excites. Tips and centre move by
y + r. Energies, losses and the work of contact are those of y, which only contact sets
in motion.

Within an interval of steps the matrices belong to its mean speed. The force that the
change of speed adds at step n is explicit:

f = f_0 - (dOmega/dt) C q_n,

where 2 Omega C is the matrix of Coriolis forces (`bodies.varying`), and f_0, the
force of the unbalance and Euler's force on the blades, acts on r alone. The work on y,
(y_{n+1} - y_{n-1}) f / 2, is entered as work of the loading.
"""

from __future__ import annotations

from hpcwhirl.dynamics.kernels import standing, verbs
from hpcwhirl.dynamics.kernels.compiled import by_numba, does, part
from hpcwhirl.dynamics.kernels.contact import (
    BESIDE_X,
    BESIDE_Y,
    OF_WHOLE,
    PULSE,
)
from hpcwhirl.dynamics.kernels.kernel_types import CoupledBody
from hpcwhirl.dynamics.kernels.oracle import modes


@part
def apply_blocks(matrix, starts, vector, sign, out):
    """Add sign * matrix @ vector to out, for a matrix with diagonal blocks only.

    matrix : the blocks, flat, each by columns
    starts : first row of each block, and the number of rows
    vector, out : (n,), in; (n,), in and out
    """
    at = 0
    for b in range(len(starts) - 1):
        first, size = starts[b], starts[b + 1] - starts[b]
        into = out[first : first + size]
        for c in range(size):
            factor = sign * vector[first + c]
            column = matrix[at : at + size]
            for r in range(size):
                into[r] += factor * column[r]
            at += size


@part
def form(matrix, starts, left, right):
    """Return left @ matrix @ right, a number, for a matrix with diagonal blocks only.

    matrix, starts : as in `apply_blocks`
    left, right : (n,), vectors
    """
    total, at = 0.0, 0
    for b in range(len(starts) - 1):
        first, size = starts[b], starts[b + 1] - starts[b]
        for c in range(size):
            part = 0.0
            for r in range(size):
                part += left[first + r] * matrix[at + r]
            total += part * right[first + c]
            at += size
    return total


@does(verbs.predict, CoupledBody)
@part
def predict(body, motion):
    """Predict a rotor's step without contact: increments, and amplitudes after it.

    They are stored in motion.ahead and motion.following. This is `verbs.predict` for
    coupled modes.
    """
    q, d, _, ahead, following, _, _ = motion
    ahead[:] = 0.0
    apply_blocks(body.keep, body.starts, d, 1.0, ahead)
    apply_blocks(body.pull, body.starts, q, -1.0, ahead)
    for m in range(len(q)):
        following[m] = q[m] + ahead[m]


@does(verbs.read, CoupledBody)
@part
def read(body, values, out):
    """Compute the radial displacements of tips, and the centre's, from amplitudes.

    values : (m,), amplitudes of the rotor's modes
    out : (N + 2,), out: m, rotating frame, radial displacements of N tips, then x_o,
        y_o
    """
    rows = body.read
    out[:] = 0.0
    for m in range(len(values)):
        factor, row = values[m], rows[m]
        for j in range(len(out)):
            out[j] += factor * row[j]


# displacements of tips, and forces on modes, are those of uncoupled modes
does(verbs.read_tips, CoupledBody)(modes.read_tips)
does(verbs.collect, CoupledBody)(modes.collect)
does(verbs.slide, CoupledBody)(modes.slide)


@does(verbs.meet, CoupledBody)
@part
def meet(body, motion, mu):
    """Add the effect of contact forces to a rotor's increments.

    The forces, motion.normal and mu motion.drag, change motion.ahead of the first
    body.own modes, block by block. They act neither on modes that represent a circle or
    an ellipse nor on those of the motion without contact: those of these modes are set
    to 0. motion.following is used as work space.

    mu : friction with the sign of the speed
    """
    _, _, _, ahead, push, normal, drag = motion
    normal[body.own :] = 0.0
    drag[body.own :] = 0.0
    for m in range(len(push)):
        push[m] = normal[m] + mu * drag[m]
    apply_blocks(body.give, body.starts, push, 1.0, ahead)


@does(verbs.accept, CoupledBody)
@part
def accept(body, motion, step):
    """End a step: update the rotor's amplitudes and increments; add the loss.

    The loss, J, is b D b / (4 dt) + b S q / 2, b = q_{n+1} - q_{n-1}, by the matrix D
    of damping and S of circulatory forces. It is added to motion.loss.
    """
    q, d, lost, ahead, _, _, _ = motion
    for m in range(len(q)):
        d[m] += ahead[m]
    loss = form(body.damping, body.starts, d, d) / (4.0 * step)
    lost[0] += loss + 0.5 * form(body.push, body.starts, d, q)
    for m in range(len(q)):
        d[m] = ahead[m]
        q[m] += ahead[m]


@does(verbs.energy, CoupledBody)
@by_numba()
def energy(body, values, increments, step):
    """Return the rotor's energy (Jacobi's) between steps n and n + 1, J.

    It is 1/2 v^2 + 1/2 q_n K(Omega) q_{n+1}, q the modal amplitudes, v their velocity.

    values, increments : (m,), q_{n+1} and q_{n+1} - q_n = v dt
    """
    before = values - increments
    total = 0.5 * form(body.stiffness, body.starts, values, before)
    for m in range(body.own):
        speed = increments[m] / step
        total += 0.5 * speed * speed
    return total


@does(verbs.stand, CoupledBody)
@part
def stand(body, motion, time, force):
    """Add the effect of a changing speed, or of supports, to a rotor's predicted step.

    The increments that these forces cause are added to motion.ahead and .following. At
    constant speed the forces are those of supports that differ by direction or have a
    film, at `time`, s; they are stored in force (room,), N. motion.normal is used as
    work space; `collect` sets it later.
    """
    if len(body.force) == 0:
        standing.stand(body, motion, time, force)
        return
    q, _, _, ahead, following, change, _ = motion
    for m in range(len(q)):
        body.work[m] = body.force[m]
    apply_blocks(body.swerve, body.starts, q, -1.0, body.work)
    change[:] = 0.0
    apply_blocks(body.give, body.starts, body.work, 1.0, change)
    for m in range(len(q)):
        ahead[m] += change[m]
        following[m] += change[m]


@does(verbs.yielded, CoupledBody)
@part
def yielded(body, motion, force, ledger):
    """Enter the work, J, of forces of changing speed on the motion that contact causes.

    The body's `stand` has added the increments due to these forces. At constant speed
    the work is that of the supports' `force` (room,), N, see `standing.yielded`.
    """
    if len(body.force) == 0:
        standing.yielded(body, motion, force, ledger)
        return
    for m in range(body.own):
        both = motion.d[m] + motion.ahead[m]
        ledger[PULSE] += 0.5 * body.work[m] * both


@does(verbs.note_beside, CoupledBody)
@part
def note_beside(body, motion, step, row):
    """Record the contact-free motion of a rotor at a changing speed in the evidence.

    These are the centre's displacements x_o, y_o, m, of the motion that the rotor would
    have without contact, and the energy of its actual motion, J. At constant speed
    nothing is recorded: the contact-free motion is known in closed form.

    motion, step : `verbs.Motion` of the rotor; dt, s
    row : one row of the samples by which a case is judged, see `verbs.note_beside`
    """
    if len(body.force) == 0:
        return
    q, d, _, values, before, _, _ = motion
    for m in range(len(q)):
        values[m], before[m] = q[m], d[m]
    row[BESIDE_X], row[BESIDE_Y] = 0.0, 0.0
    centre = body.read.shape[1] - 2
    for s in range(len(body.alike)):
        m, own = body.own + s, body.alike[s]
        row[BESIDE_X] += body.read[m, centre] * q[m]
        row[BESIDE_Y] += body.read[m, centre + 1] * q[m]
        values[own] += q[m]
        before[own] += d[m]
    total = 0.0
    for m in range(body.own):
        speed = before[m] / step
        total += 0.5 * speed * speed
    for m in range(len(q)):
        before[m] = values[m] - before[m]
    starts = body.starts[: body.blocks + 1]
    row[OF_WHOLE] = total + 0.5 * form(body.stiffness, starts, values, before)
