"""A rotor whose speed changes: modes coupled by rotation, and forces of the change.

The motion is the sum of y, which contact causes, and r, the motion without contact, in
the same modes. In the state the amplitudes of y come first, then those of r, only for
nodal diameters that a force excites. Tips and centre move by y + r. Energies,
losses and the work of contact are those of y, which only contact sets in motion.

Within an interval of steps the matrices of `coupled` belong to its mean speed. The
force that the change of speed adds at step n is explicit:

f = f_0 - (dOmega/dt) C q_n,

where 2 Omega C is the matrix of Coriolis forces (`dynamics.varying`), and f_0, the
force of the unbalance and Euler's force on the blades, acts on r alone. The work on y,
(y_{n+1} - y_{n-1}) f / 2, is entered as work of the loading.
"""

from __future__ import annotations

from hpcwhirl.dynamics.kernels import standing, verbs
from hpcwhirl.dynamics.kernels.body_types import CoupledBody
from hpcwhirl.dynamics.kernels.contact import (
    BESIDE_X,
    BESIDE_Y,
    OF_WHOLE,
    PULSE,
)
from hpcwhirl.dynamics.kernels.coupled import apply_blocks, form
from hpcwhirl.dynamics.kernels.verbs import does


@does(verbs.stand, CoupledBody)
def stand(body, motion, time, force):
    """Add to motion.ahead and .following the increments by forces of changing speed.

    At constant speed the forces are those of the supports.

    motion.normal is used as work space; `collect` sets it later.
    """
    if len(body.force) == 0:
        standing.stand(body, motion, time, force)
        return
    q, _, _, ahead, following, change, _ = motion
    body.work[:] = body.force
    apply_blocks(body.swerve, body.starts, q, -1.0, body.work)
    change[:] = 0.0
    apply_blocks(body.give, body.starts, body.work, 1.0, change)
    for m in range(len(q)):
        ahead[m] += change[m]
        following[m] += change[m]


@does(verbs.yielded, CoupledBody)
def yielded(body, motion, force, ledger):
    """Enter the work, J, of the forces of `stand` on the motion that contact causes."""
    if len(body.force) == 0:
        standing.yielded(body, motion, force, ledger)
        return
    for m in range(body.own):
        both = motion.d[m] + motion.ahead[m]
        ledger[PULSE] += 0.5 * body.work[m] * both


@does(verbs.note_beside, CoupledBody)
def note_beside(body, motion, step, row):
    """Write the centre's motion without contact, and the whole energy, to evidence.

    These are x_o, y_o, m, and the energy of the motion with and without contact, J. At
    constant speed nothing is written: that motion is known in closed form.
    """
    if len(body.force) == 0:
        return
    q, d, _, values, before, _, _ = motion
    values[:], before[:] = q, d
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
