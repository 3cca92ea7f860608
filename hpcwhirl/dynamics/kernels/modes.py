"""A body as modes in the loop of `bodies`, for a casing of elements."""

from __future__ import annotations

from numba import njit

from hpcwhirl.dynamics.kernels import verbs
from hpcwhirl.dynamics.kernels.contact import FRICTION, ROTATION
from hpcwhirl.dynamics.kernels.kernel_types import ModalBody
from hpcwhirl.dynamics.kernels.verbs import does


@njit(cache=True)
def accumulate(rows, values, out):
    """Set out = values @ rows, four rows at a time; rows is (m, n), m % 4 == 0."""
    for j in range(len(out)):
        out[j] = 0.0
    for m in range(0, len(values), 4):
        a, b, c, d = values[m], values[m + 1], values[m + 2], values[m + 3]
        ra, rb, rc, rd = rows[m], rows[m + 1], rows[m + 2], rows[m + 3]
        for j in range(len(out)):
            out[j] += (a * ra[j] + b * rb[j]) + (c * rc[j] + d * rd[j])


@njit(cache=True)
def modal_energy(values, increments, omega, step):
    """Return the energy of modes between steps n and n + 1, J.

    It is the sum of 1/2 v^2 + 1/2 omega^2 q_n q_{n+1} over the modes.

    values, increments : q_{n+1} and q_{n+1} - q_n = v dt of the modes' amplitudes q
    """
    total = 0.0
    for m in range(len(values)):
        speed = increments[m] / step
        total += 0.5 * speed * speed
        total += 0.5 * omega[m] * omega[m] * values[m] * (values[m] - increments[m])
    return total


@njit(cache=True)
def collect_modes(lam, index, shape, rows, out):
    """Set out (m,) to the modal forces of the multipliers lam (N,).

    index, shape : (N, w), the w coordinates on which each tip acts, and their weights
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
def predict(body, motion):
    """Predict a body's step without contact: increments, and amplitudes after it.

    They are stored in motion.ahead and motion.following.
    """
    keep, pull = body.keep, body.pull
    q, d, _, ahead, following, _, _ = motion
    for m in range(len(q)):
        step = keep[m] * d[m] - pull[m] * q[m]
        ahead[m] = step
        following[m] = q[m] + step


@does(verbs.load, ModalBody)
def load(body, motion, push, modal):
    """Add the increments due to the pulse to a predicted step of a body.

    push, modal : force, N; modal forces (m,) of a unit force
    """
    give, ahead, following = body.give, motion.ahead, motion.following
    for m in range(len(ahead)):
        change = give[m] * push * modal[m]
        ahead[m] += change
        following[m] += change


@does(verbs.read, ModalBody)
def read(body, values, out):
    """Set out (r,), m, to a body's r radial displacements.

    values : (m,), amplitudes of its modes, over which the displacements are summed
    """
    accumulate(body.read, values, out)


@does(verbs.read_tips, ModalBody)
def read_tips(body, values, radial, tips):
    """Set tips (N + 1, 2), m, to radial, tangential displacements; last row: centre.

    values, radial : (m,), amplitudes of the modes; (N + 2,), result of `read`
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
def collect(body, motion, lam, index, shape):
    """Set motion.normal and motion.drag (m,) to the modal forces of the multipliers.

    `normal` are those of normal forces, `drag` those of friction over mu.

    lam : (N,), multipliers of the tips, N
    index, shape : (N, w), the w coordinates on which each tip acts, and their weights
    """
    collect_modes(lam, index, shape, body.radial, motion.normal)
    collect_modes(lam, index, shape, body.tangential, motion.drag)


@does(verbs.slide, ModalBody)
def slide(body, motion, lam, index, shape, out):
    """Add to out (N,) the tangential motion, m, of tips in contact over two steps.

    It is the displacement along the rotation at step n + 1 less that at n - 1.

    lam : (N,), multipliers, N; tips with lam > 0 are in contact
    index, shape : (N, w), the w coordinates on which each tip acts, and their weights
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
def meet(body, motion, mu, ledger):
    """Correct increments motion.ahead by contact forces; enter their work in ledger.

    The forces are motion.normal and mu motion.drag, mu with the sign of the speed.
    """
    give = body.give
    _, d, _, ahead, _, normal, drag = motion
    for m in range(len(ahead)):
        ahead[m] += give[m] * (normal[m] + mu * drag[m])
    for m in range(len(ahead)):
        mean = 0.5 * (ahead[m] + d[m])
        ledger[ROTATION] += normal[m] * mean
        ledger[FRICTION] += mu * drag[m] * mean


@does(verbs.accept, ModalBody)
def accept(body, motion, _):
    """Set amplitudes and increments to those after the step; add the damping loss, J.

    The loss is 2 xi omega (q_{n+1} - q_{n-1})^2 / (4 dt), xi the damping ratio.
    """
    rate = body.rate
    q, d, loss, ahead, _, _, _ = motion
    for m in range(len(q)):
        both = ahead[m] + d[m]
        loss[m] += rate[m] * both * both
        q[m] += ahead[m]
        d[m] = ahead[m]


@does(verbs.energy, ModalBody)
def energy(body, values, increments, step):
    """Return the energy of a body's modes between steps n and n + 1, J.

    values, increments : q_{n+1} and q_{n+1} - q_n, as in `modal_energy`
    """
    return modal_energy(values, increments, body.omega, step)
