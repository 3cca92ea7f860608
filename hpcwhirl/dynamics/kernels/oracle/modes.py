"""A rotor or casing as uncoupled modes in the time loop `bodies`, see there.

The body's motion is a sum of modes with real amplitudes q (m,), normalised to unit
modal mass. The functions with `does` implement the operations of `verbs` for it.
"""

from __future__ import annotations

from hpcwhirl.dynamics.kernels import verbs
from hpcwhirl.dynamics.kernels.compiled import does, part
from hpcwhirl.dynamics.kernels.kernel_types import ModalBody


@part
def accumulate(rows, values, out):
    """Set out (n,) to the sum of rows of a table, each times a value: values @ rows.

    rows, values : (m, n), (m,), m a multiple of 4: four rows are added at a time
    """
    for j in range(len(out)):
        out[j] = 0.0
    for m in range(0, len(values), 4):
        a, b, c, d = values[m], values[m + 1], values[m + 2], values[m + 3]
        ra, rb, rc, rd = rows[m], rows[m + 1], rows[m + 2], rows[m + 3]
        for j in range(len(out)):
            out[j] += (a * ra[j] + b * rb[j]) + (c * rc[j] + d * rd[j])


@part
def modal_energy(values, increments, omega, step):
    """Return the energy of uncoupled modes between steps n and n + 1, J.

    It is the sum of 1/2 v^2 + 1/2 omega^2 q_n q_{n+1} over the modes, v their velocity.

    values, increments : (m,), q_{n+1} and q_{n+1} - q_n = v dt of the modes' amplitudes
        q
    omega, step : (m,), rad/s; dt, s
    """
    total = 0.0
    for m in range(len(values)):
        speed = increments[m] / step
        total += 0.5 * speed * speed
        total += 0.5 * omega[m] * omega[m] * values[m] * (values[m] - increments[m])
    return total


@part
def collect_modes(lam, index, shape, rows, out):
    """Compute the modal forces out (m,) of the multipliers of all tips, lam (N,), N.

    index, shape : (N, w), the w coordinates of the body on which each tip acts, and
        their weights
    rows : (r, m), the r coordinates for unit amplitudes of m modes
    """
    out[:] = 0.0
    for j in range(len(lam)):
        if lam[j] > 0.0:
            for a in range(index.shape[1]):
                part = lam[j] * shape[j, a]
                row = rows[index[j, a]]
                for m in range(len(out)):
                    out[m] += part * row[m]


@does(verbs.predict, ModalBody)
@part
def predict(body, motion):
    """Predict a body's step without contact: increments, and amplitudes after it.

    They are stored in motion.ahead and motion.following, (m,). This is `verbs.predict`
    for uncoupled modes.
    """
    keep, pull = body.keep, body.pull
    q, d, _, ahead, following, _, _ = motion
    for m in range(len(q)):
        step = keep[m] * d[m] - pull[m] * q[m]
        ahead[m] = step
        following[m] = q[m] + step


@does(verbs.load, ModalBody)
@part
def load(body, motion, push, modal):
    """Add the effect of the pulse on the casing to its predicted step without contact.

    motion.ahead and motion.following, of the casing's modes, change.

    push, modal : N, force of the pulse; (m,), modal forces of a unit force
    """
    give, ahead, following = body.give, motion.ahead, motion.following
    for m in range(len(ahead)):
        change = give[m] * push * modal[m]
        ahead[m] += change
        following[m] += change


@does(verbs.read, ModalBody)
@part
def read(body, values, out):
    """Compute the radial displacements, m, of a body from its modes: set out (r,).

    values : (m,), amplitudes of the modes
    """
    accumulate(body.read, values, out)


@does(verbs.read_tips, ModalBody)
@part
def read_tips(body, values, radial, tips):
    """Compute the radial and tangential displacement of each tip, and the centre's, m.

    values, radial : (m,), amplitudes of the rotor's modes; (N + 2,), result of `read`
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


@does(verbs.collect, ModalBody)
@part
def collect(body, motion, lam, index, shape):
    """Compute the modal forces of the multipliers of all tips on a body.

    motion.normal has those of normal forces, (m,), motion.drag those of friction over
    mu.

    lam : (N,), multipliers of the tips, N
    index, shape : (N, w), the w coordinates of the body on which each tip acts, and
        their weights
    """
    collect_modes(lam, index, shape, body.radial, motion.normal)
    collect_modes(lam, index, shape, body.tangential, motion.drag)


@does(verbs.slide, ModalBody)
@part
def slide(body, motion, lam, index, shape, out):
    """Compute how far tips in contact have slid along the rotation over two steps, m.

    The body's tangential displacement at step n + 1 less that at n - 1 is added to out
    (N,).

    lam : (N,), multipliers, N; tips with lam > 0 are in contact
    index, shape : (N, w), the w coordinates of the body that move each tip, and their
        weights
    """
    d, ahead = motion.d, motion.ahead
    for j in range(len(lam)):
        if lam[j] > 0.0:
            for a in range(index.shape[1]):
                row, total = body.tangential[index[j, a]], 0.0
                for m in range(len(d)):
                    total += row[m] * (ahead[m] + d[m])
                out[j] += shape[j, a] * total


@does(verbs.meet, ModalBody)
@part
def meet(body, motion, mu):
    """Add the effect of contact forces to the modes' increments.

    The modal forces, motion.normal and mu motion.drag, change motion.ahead.

    mu : friction with the sign of the speed
    """
    give = body.give
    _, _, _, ahead, _, normal, drag = motion
    for m in range(len(ahead)):
        ahead[m] += give[m] * (normal[m] + mu * drag[m])


@does(verbs.accept, ModalBody)
@part
def accept(body, motion, _):
    """End a step: update the modes' amplitudes and increments; add the damping loss, J.

    The loss is 2 xi omega (q_{n+1} - q_{n-1})^2 / (4 dt), xi the damping ratio; it is
    added to motion.loss.
    """
    rate = body.rate
    q, d, loss, ahead, _, _, _ = motion
    for m in range(len(q)):
        both = ahead[m] + d[m]
        loss[m] += rate[m] * both * both
        q[m] += ahead[m]
        d[m] = ahead[m]


@does(verbs.energy, ModalBody)
@part
def energy(body, values, increments, step):
    """Return the energy of a body's modes between steps n and n + 1, J.

    values, increments : (m,), q_{n+1} and q_{n+1} - q_n of the modes' amplitudes
    step : dt, s
    """
    return modal_energy(values, increments, body.omega, step)
