"""The bodies of scheme `paper`: its Algorithm 1, with dense reduced matrices."""

from __future__ import annotations

import numpy as np
from numba import njit

from hpcwhirl.dynamics.kernels import verbs
from hpcwhirl.dynamics.kernels.contact import FRICTION, ROTATION
from hpcwhirl.dynamics.kernels.kernel_types import DenseBody
from hpcwhirl.dynamics.kernels.verbs import does


@njit(cache=True)
def apply_dense(matrix_t, vector, sign, out):
    """Add sign * matrix @ vector to out; `matrix_t` is stored by columns."""
    for c in range(len(vector)):
        factor = sign * vector[c]
        column = matrix_t[c]
        for r in range(len(out)):
            out[r] += factor * column[r]


@njit(cache=True)
def beside(still, values, out):
    """Set out (n,) to a body's coordinates less those on its circle, see `DenseBody`.

    still, values : (n,), coordinates on the circle, or (0,); coordinates
    """
    out[:] = values
    for i in range(len(still)):
        out[i] -= still[i]


@does(verbs.predict, DenseBody)
def predict(body, motion):
    """Predict a body's step without contact: increments, and coordinates after it.

    They are stored in motion.ahead and motion.following.
    """
    q, d, _, ahead, following, _, _ = motion
    ahead[:] = 0.0
    apply_dense(body.keep, d, 1.0, ahead)
    apply_dense(body.pull, q, -1.0, ahead)
    for i in range(len(q)):
        following[i] = q[i] + ahead[i]


@does(verbs.load, DenseBody)
def load(body, motion, push, modal):
    """Add the increments due to the pulse to a predicted step of a body.

    push, modal : force, N; modal forces (n,) of a unit force
    """
    q, ahead, following = motion.q, motion.ahead, motion.following
    apply_dense(body.inverse, modal, push, ahead)
    for i in range(len(q)):
        following[i] = q[i] + ahead[i]


@does(verbs.read, DenseBody)
def read(body, values, out):
    """Set out (r,), m, to a body's r radial displacements.

    values : (n,), its coordinates, from which the radial ones are taken
    """
    places = body.radial
    for r in range(len(places)):
        out[r] = values[places[r]]


@does(verbs.read_tips, DenseBody)
def read_tips(body, values, radial, tips):
    """Set tips (N + 1, 2), m, to radial and tangential displacements; last row: centre.

    values, radial : (n,), coordinates of the body; (N + 2,), result of `read`
    """
    along, centre = body.tangential, body.centre
    for j in range(len(along)):
        tips[j, 0], tips[j, 1] = radial[j], values[along[j]]
    for axis in range(len(centre)):
        tips[len(along), axis] = values[centre[axis]]


@does(verbs.collect, DenseBody)
def collect(body, motion, lam, index, shape):
    """Set motion.normal and motion.drag (n,), N, to the multipliers' forces.

    `normal` are the normal forces on all coordinates, `drag` is friction over mu.

    lam : (N,), multipliers of the tips, N
    index, shape : (N, w), the w coordinates on which each tip acts, and their weights
    """
    radial, tangential = body.radial, body.tangential
    normal, drag = motion.normal, motion.drag
    normal[:] = 0.0
    drag[:] = 0.0
    for j in range(len(lam)):
        if lam[j] > 0.0:
            for a in range(index.shape[1]):
                normal[radial[index[j, a]]] += lam[j] * shape[j, a]
                drag[tangential[index[j, a]]] += lam[j] * shape[j, a]


@does(verbs.slide, DenseBody)
def slide(body, motion, lam, index, shape, out):
    """Add to out (N,) the tangential motion, m, of tips in contact over two steps.

    It is the displacement along the rotation at step n + 1 less that at n - 1.

    lam : (N,), multipliers, N; tips with lam > 0 are in contact
    index, shape : (N, w), the w coordinates on which each tip acts, and their weights
    """
    along, d, ahead = body.tangential, motion.d, motion.ahead
    for j in range(len(lam)):
        if lam[j] > 0.0:
            for a in range(index.shape[1]):
                m = along[index[j, a]]
                out[j] += shape[j, a] * (ahead[m] + d[m])


@does(verbs.meet, DenseBody)
def meet(body, motion, mu, ledger):
    """Correct increments motion.ahead by contact forces; enter their work in ledger.

    The forces are motion.normal and mu motion.drag, mu with the sign of the speed.
    """
    inverse = body.inverse
    _, d, _, ahead, _, normal, drag = motion
    for c in range(len(ahead)):
        force = normal[c] + mu * drag[c]
        if force != 0.0:
            for r in range(len(ahead)):
                ahead[r] += inverse[c, r] * force
    for i in range(len(ahead)):
        mean = 0.5 * (ahead[i] + d[i])
        ledger[ROTATION] += normal[i] * mean
        ledger[FRICTION] += mu * drag[i] * mean


@does(verbs.accept, DenseBody)
def accept(body, motion, step):
    """Set coordinates and increments to those after the step; add the loss, J.

    The loss of damping and circulatory forces is added to motion.loss. motion.following
    and motion.normal are used as work space.
    """
    q, d, lost, ahead, work, apart, _ = motion
    for i in range(len(q)):
        d[i] += ahead[i]
    work[:] = 0.0
    apply_dense(body.damping, d, 1.0, work)
    loss, given = 0.0, 0.0
    for i in range(len(q)):
        loss += d[i] * work[i]
    if len(body.push) > 0:
        work[:] = 0.0
        beside(body.still, q, apart)
        apply_dense(body.push, apart, 1.0, work)
        for i in range(len(q)):
            given += d[i] * work[i]
    for i in range(len(q)):
        d[i] = ahead[i]
        q[i] += ahead[i]
    lost[0] += loss / (4.0 * step) + 0.5 * given


@does(verbs.energy, DenseBody)
def energy(body, values, increments, step):
    """Return a body's energy between steps n and n + 1, J.

    It is 1/2 v M v + 1/2 q_n K q_{n+1}.

    values, increments : q_{n+1}, q_{n+1} - q_n = v dt
    """
    work = np.zeros_like(values)
    apply_dense(body.mass, increments, 0.5 / step**2, work)
    total = 0.0
    for i in range(len(values)):
        total += work[i] * increments[i]
    apart, work[:] = np.empty_like(values), 0.0
    beside(body.still, values, apart)
    apply_dense(body.stiffness, apart, 0.5, work)
    for i in range(len(values)):
        total += work[i] * (apart[i] - increments[i])
    return total
