"""The operations that the time loop `oracle.bodies` applies to a body in a step.

A body is a rotor or a casing, in physical coordinates or as modes. A verb is the name
of an operation; `compiled.does` registers its implementation for a kind of body in the
file of that kind (`dense`, `modes`, `coupled`, `standing`), and chosen by the type of
the first argument when the loop is compiled. Texts here have the arguments of all
implementations.
"""

from __future__ import annotations

from typing import NamedTuple

from hpcwhirl.arrays import Floats
from hpcwhirl.dynamics.kernels.compiled import verb


class Motion(NamedTuple):
    """A body's arrays in a step, (n,) each, for n coordinates or modal amplitudes q.

    Attributes
    ----------
    q, d, loss : arrays of the state: q_n, d_n = q_n - q_{n-1}, and damping losses so
        far, J
    ahead, following : increments d_{n+1} = q_{n+1} - q_n, and q_{n+1}
    normal, drag : generalized forces, N for coordinates: normal contact forces;
        friction over mu
    """

    q: Floats
    d: Floats
    loss: Floats
    ahead: Floats
    following: Floats
    normal: Floats
    drag: Floats


@verb
def predict(body, motion):
    """Predict a body's step without contact: increments, and amplitudes after it.

    They are stored in motion.ahead and motion.following.

    body, motion : a type of `kernel_types`, such as `ModalBody`; `Motion`
    """
    raise NotImplementedError


@verb
def load(body, motion, push, modal):
    """Add the effect of the pulse on the casing to its predicted step without contact.

    body, motion : the casing; its `Motion`, of which ahead and following change
    push : N, force of the pulse
    modal : (n,), the casing's generalized forces of a unit force
    """
    raise NotImplementedError


@verb
def stand(body, motion, time, force):
    """Add the effect of supports or of a changing speed to the rotor's predicted step.

    body, motion : the rotor; its `Motion`, of which ahead and following change
    time : s, of the present step
    force : (room,), out: N, forces of the supports on the rotor, x and y of each, if
        they exert one that no constant matrix represents; work space
    """
    raise NotImplementedError


@verb
def room(body):
    """Return the size of the array `force` that `stand` needs for a rotor."""
    raise NotImplementedError


@verb
def yielded(body, motion, force, ledger):
    """Enter the work in a step, J, of rotor forces that no constant matrix represents.

    The verb `stand` has added the increments that these forces cause.

    For forces of supports the work is subtracted from the body's loss; for forces of a
    changing speed it is added to the work of the loading in the ledger. A body without
    such forces has nothing to enter.

    body, motion : the rotor; its `Motion`
    force : (room,), N, as `stand` has set it
    """
    raise NotImplementedError


@verb
def read(body, values, out):
    """Compute the radial displacements of a body from its amplitudes or coordinates.

    values : (n,), amplitudes or coordinates
    out : (r,), out: m; of a rotor: those of N tips, then x_o, y_o; of a casing: its
        radial coordinates
    """
    raise NotImplementedError


@verb
def read_tips(body, values, radial, tips):
    """Compute the radial and tangential displacement of each tip, and the centre's.

    values : (n,), amplitudes or coordinates of the rotor
    radial : result of `read` for them
    tips : (N + 1, 2), out: m, rotating frame; last row x_o, y_o
    """
    raise NotImplementedError


@verb
def collect(body, motion, lam, index, shape):
    """Compute the generalized forces of the multipliers of all tips on a body.

    They are written to motion.normal and, those of friction divided by mu, motion.drag.

    lam : (N,), multipliers of the tips, N
    index, shape : (N, w), the w radial coordinates of the body on which each tip acts,
        and their weights (-1 for the rotor, which is pushed inward)
    """
    raise NotImplementedError


@verb
def slide(body, motion, lam, index, shape, out):
    """Compute how far tips in contact have slid along the rotation over two steps, m.

    The body's tangential displacement at step n + 1 less that at n - 1 is added to out
    (N,), for tips with lam > 0.

    lam : (N,), multipliers of the tips, N
    index, shape : as in `collect`; the rotor's weights are -1, so that the parts of
        both bodies add up to the motion of the casing relative to the tip
    """
    raise NotImplementedError


@verb
def meet(body, motion, mu):
    """Add the effect of contact forces to a body's increments.

    The forces, motion.normal and mu motion.drag, change motion.ahead. Forces that do
    not act on the body are set to 0.

    mu : friction with the sign of the speed
    """
    raise NotImplementedError


@verb
def accept(body, motion, step):
    """End a step: set motion.q and motion.d to the new state; add the damping loss.

    motion.loss grows by b^T D b / (4 dt), J, b = q_{n+1} - q_{n-1}, D the damping
    matrix.

    step : dt, s
    """
    raise NotImplementedError


@verb
def note_beside(body, motion, step, row):
    """Record the contact-free motion of a rotor at a changing speed in the evidence.

    The contact-free motion, which the rotor would have without any contact, is
    integrated as a separate part of its state. The evidence is the table of samples by
    which a case is judged.

    row : row of the evidence, set from column `contact.COLUMNS` on: x_o, y_o of the
        contact-free motion, m, and the energy of the rotor's actual motion, J
    motion, step : `Motion`, of which ahead and following are used as work space; dt, s
    """
    raise NotImplementedError


@verb
def energy(body, values, increments, step):
    """Return a body's energy between steps n and n + 1, J.

    It is 1/2 v^T M v + 1/2 q_n^T K q_{n+1}, v its velocity.

    values, increments : (n,), q_{n+1} and q_{n+1} - q_n = v dt
    step : dt, s
    """
    raise NotImplementedError
