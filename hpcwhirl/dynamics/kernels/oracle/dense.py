"""A body as dense matrices in the time loop `bodies`: the paper's Algorithm 1.

Rotor and casing of scheme `paper` have reduced coordinates q (n,), and dense matrices
M, D, K. The functions with `does` implement the operations of `verbs` for them.
"""

from __future__ import annotations

import numpy as np

from hpcwhirl.dynamics.kernels import verbs
from hpcwhirl.dynamics.kernels.compiled import by_numba, does, part
from hpcwhirl.dynamics.kernels.kernel_types import DenseBody


@part
def apply_dense(matrix_t, vector, sign, out):
    """Add sign * matrix @ vector to out, for a matrix that is stored transposed.

    matrix_t : (c, r), transposed; vector : (c,)
    out : (r,), in and out
    """
    for c in range(len(vector)):
        factor = sign * vector[c]
        column = matrix_t[c]
        for r in range(len(out)):
            out[r] += factor * column[r]


@part
def beside(still, values, out):
    """Set out (n,) to a body's coordinates less those of its circle, in which it rests.

    Energies of an unbalanced rotor are measured from this circle, see `DenseBody`.

    still : (n,), coordinates on the circle, or (0,) if there is none
    values : (n,), coordinates of the body
    """
    for i in range(len(out)):
        out[i] = values[i]
    for i in range(len(still)):
        out[i] -= still[i]


@does(verbs.predict, DenseBody)
@part
def predict(body, motion):
    """Predict a body's step without contact: increments, and coordinates after it.

    They are stored in motion.ahead and motion.following, (n,). This is `verbs.predict`
    for dense matrices.
    """
    q, d, _, ahead, following, _, _ = motion
    ahead[:] = 0.0
    apply_dense(body.keep, d, 1.0, ahead)
    apply_dense(body.pull, q, -1.0, ahead)
    for i in range(len(q)):
        following[i] = q[i] + ahead[i]


@does(verbs.load, DenseBody)
@part
def load(body, motion, push, modal):
    """Add the effect of the pulse on the casing to its predicted step without contact.

    motion.ahead and motion.following change.

    push, modal : N, force of the pulse; (n,), generalized forces of a unit force
    """
    q, ahead, following = motion.q, motion.ahead, motion.following
    apply_dense(body.inverse, modal, push, ahead)
    for i in range(len(q)):
        following[i] = q[i] + ahead[i]


@does(verbs.read, DenseBody)
@part
def read(body, values, out):
    """Take the radial displacements, m, of a body from its coordinates: set out (r,).

    values : (n,), coordinates of the body, of which those listed in body.radial are
        taken
    """
    places = body.radial
    for r in range(len(places)):
        out[r] = values[places[r]]


@does(verbs.read_tips, DenseBody)
@part
def read_tips(body, values, radial, tips):
    """Take the radial and tangential displacement of each tip, and the centre's, m.

    values, radial : (n,), coordinates of the rotor; result of `read`
    tips : (N + 1, 2), out: m, rotating frame; last row x_o, y_o
    """
    along, centre = body.tangential, body.centre
    for j in range(len(along)):
        tips[j, 0], tips[j, 1] = radial[j], values[along[j]]
    for axis in range(len(centre)):
        tips[len(along), axis] = values[centre[axis]]


@does(verbs.collect, DenseBody)
@part
def collect(body, motion, lam, index, shape):
    """Compute the generalized forces of the multipliers of all tips on a body.

    motion.normal has the normal forces on all coordinates, N, motion.drag those of
    friction over mu.

    lam : (N,), multipliers of the tips, N
    index, shape : (N, w), the w radial coordinates of the body on which each tip acts,
        and their weights
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
@part
def slide(body, motion, lam, index, shape, out):
    """Compute how far tips in contact have slid along the rotation over two steps, m.

    The body's tangential displacement at step n + 1 less that at n - 1 is added to out
    (N,).

    lam : (N,), multipliers, N; tips with lam > 0 are in contact
    index, shape : (N, w), the w coordinates of the body that move each tip, and their
        weights
    """
    along, d, ahead = body.tangential, motion.d, motion.ahead
    for j in range(len(lam)):
        if lam[j] > 0.0:
            for a in range(index.shape[1]):
                m = along[index[j, a]]
                out[j] += shape[j, a] * (ahead[m] + d[m])


@does(verbs.meet, DenseBody)
@part
def meet(body, motion, mu):
    """Add the effect of contact forces to a body's increments.

    The forces, motion.normal and mu motion.drag, N, change motion.ahead.

    mu : friction with the sign of the speed
    """
    inverse = body.inverse
    _, _, _, ahead, _, normal, drag = motion
    for c in range(len(ahead)):
        force = normal[c] + mu * drag[c]
        if force != 0.0:
            for r in range(len(ahead)):
                ahead[r] += inverse[c, r] * force


@does(verbs.accept, DenseBody)
@part
def accept(body, motion, step):
    """End a step: update the body's coordinates and increments; add the loss, J.

    The loss of damping and circulatory forces is added to motion.loss. motion.following
    and motion.normal are used as work space.

    step : dt, s
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
@by_numba()
def energy(body, values, increments, step):
    """Return a body's energy between steps n and n + 1, J, from dense matrices.

    It is 1/2 v M v + 1/2 q_n K q_{n+1}, v the velocity, q the coordinates.

    values, increments : (n,), q_{n+1} and q_{n+1} - q_n = v dt
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
