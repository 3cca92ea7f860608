"""The operations on a body in a step of `bodies.march_bodies`, for any kind of body.

A verb is the name of an operation. Its implementation for a kind of body is registered
with `does` in the file of that kind, and chosen by the type of the first argument when
the loop is compiled.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from numba import njit
from numba.extending import overload

from hpcwhirl.arrays import Floats

Function = Callable[..., Any]


class Motion(NamedTuple):
    """A body's arrays in a step, (n,) each.

    Attributes
    ----------
    q, d, loss : arrays of the state: q_n, d_n = q_n - q_{n-1}, damping losses so far, J
    ahead, following : increments d_{n+1} = q_{n+1} - q_n, and q_{n+1}
    normal, drag : forces of the multipliers: normal; of friction, over mu
    """

    q: Floats
    d: Floats
    loss: Floats
    ahead: Floats
    following: Floats
    normal: Floats
    drag: Floats


def does(verb: Function, kind: type) -> Callable[[Function], Function]:
    """Register the decorated function as the implementation of a verb for a type.

    verb, kind : function without body; a NamedTuple, the type of the first argument
    """

    def register(function: Function) -> Function:
        @overload(verb, strict=False)
        def choose(body: Any, *_: Any) -> Function | None:
            return function if getattr(body, "instance_class", None) is kind else None

        return njit(cache=True)(function)

    return register


def predict(body, motion):
    """Predict a body's step without contact: increments, and amplitudes after it.

    They are stored in motion.ahead and motion.following.
    """
    raise NotImplementedError


def load(body, motion, push, modal):
    """Add the increments due to the pulse to a predicted step of a body.

    push, modal : force, N; modal forces (n,) of a unit force
    """
    raise NotImplementedError


def stand(body, motion, time, force):
    """Add to a predicted step the increments by supports or a changing speed.

    force : (2,), out: N, that of the supports at the centre, if they have one
    time : s, of the present step
    """
    raise NotImplementedError


def yielded(body, motion, force, ledger):
    """Enter the work in a step, J, of forces that no constant matrix represents.

    The verb `stand` has added the increments that these forces cause.

    For forces of supports it is subtracted from the body's loss; for forces of a
    changing speed it is added to the work of the loading in the ledger. A body without
    such forces has nothing to enter.

    force : (2,), N, as `stand` has set it
    """
    raise NotImplementedError


def read(body, values, out):
    """Set out (r,), m, to a body's r radial displacements.

    values : (n,), its amplitudes or coordinates, from which they follow
    """
    raise NotImplementedError


def read_tips(body, values, radial, tips):
    """Set tips (N + 1, 2), m, to radial, tangential displacements; last row x_o, y_o.

    values, radial : (n,), amplitudes or coordinates of the body; result of `read`
    """
    raise NotImplementedError


def collect(body, motion, lam, index, shape):
    """Set motion.normal and motion.drag from the multipliers lam (N,), N, of all tips.

    index, shape : (N, w), the w coordinates on which each tip acts, and their weights
    """
    raise NotImplementedError


def slide(body, motion, lam, index, shape, out):
    """Add to out (N,) the tangential motion, m, of tips with lam > 0 over two steps.

    It is the displacement along the rotation at step n + 1 less that at n - 1.

    lam : (N,), multipliers, N; index, shape : as in `collect`
    """
    raise NotImplementedError


def meet(body, motion, mu, ledger):
    """Correct increments motion.ahead by contact forces; enter their work in ledger.

    The forces are motion.normal and mu motion.drag, mu with the sign of the speed.
    """
    raise NotImplementedError


def accept(body, motion, step):
    """Set motion.q and motion.d to those after the step; add the damping loss.

    motion.loss grows by b^T D b / (4 dt), J, b = q_{n+1} - q_{n-1}, D of damping.
    """
    raise NotImplementedError


def note_beside(body, motion, step, row):
    """Write a body's motion without contact to a row of evidence.

    row : set from column `contact.COLUMNS` on: x_o, y_o of that motion, m, and the
        energy of the whole motion, J

    Of `motion`, `ahead` and `following` are used as work space.
    """
    raise NotImplementedError


def energy(body, values, increments, step):
    """Return a body's energy between steps n and n + 1, J.

    It is 1/2 v^T M v + 1/2 q_n^T K q_{n+1}.

    values, increments : (n,), q_{n+1} and q_{n+1} - q_n = v dt
    """
    raise NotImplementedError
