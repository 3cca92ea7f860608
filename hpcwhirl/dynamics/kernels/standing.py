"""Supports that stand and differ by direction: a force at the rotor's centre.

In the rotating frame, of the centre z with velocity v, at step n,

f = -[(k_d - i Omega c_d) conj(z) + c_d conj(v)] e^{-2 i Omega t},

with v = (z_{n+1} - z_{n-1}) / 2 dt as the step leads there without contact: what f adds
to it counts, by two equations. Of what contact adds, c_d knows nothing in that step.
"""

from __future__ import annotations

import cmath

from numba import njit

from hpcwhirl.dynamics.kernels import verbs
from hpcwhirl.dynamics.kernels.kernel_types import CoupledBody, DenseBody, ModalBody
from hpcwhirl.dynamics.kernels.verbs import does


@njit(cache=True)
def at_centre(hub, values):
    """Return x_o + i y_o of a body's coordinates."""
    x, y = 0.0, 0.0
    for m in range(hub.shape[1]):
        x += hub[0, m] * values[m]
        y += hub[1, m] * values[m]
    return complex(x, y)


@njit(cache=True)
def answer(give, held, moving, drift):
    """Return f = -held - drift conj(moving + W f), W : give (2, 2), over 2 dt."""
    rest = -held - drift * moving.conjugate()
    a, b = drift.real, drift.imag  # f -> drift conj(f) on (x, y): [[a, b], [b, -a]]
    xx = 1.0 + a * give[0, 0] + b * give[1, 0]
    xy = a * give[0, 1] + b * give[1, 1]
    yx = b * give[0, 0] - a * give[1, 0]
    yy = 1.0 + b * give[0, 1] - a * give[1, 1]
    down = xx * yy - xy * yx
    x = (yy * rest.real - xy * rest.imag) / down
    return complex(x, (xx * rest.imag - yx * rest.real) / down)


@njit(cache=True)
def stand(body, motion, time, force):
    """Do `verbs.stand`."""
    own = body.stand
    if len(own.hub) == 0:
        return
    q, d, _, ahead, following, _, _ = motion
    turned = cmath.exp(-2j * (own.speed * time))
    place = at_centre(own.hub, q)
    twice = 2.0 * own.step
    moving = (at_centre(own.hub, d) + at_centre(own.hub, ahead)) / twice
    spring = own.stiffness - 1j * own.speed * own.damping
    push = answer(
        own.give, turned * spring * place.conjugate(), moving, turned * own.damping
    )
    force[0], force[1] = push.real, push.imag
    for m in range(own.hub.shape[1]):
        change = own.moved[0, m] * push.real + own.moved[1, m] * push.imag
        ahead[m] += change
        following[m] += change


@njit(cache=True)
def yielded(body, motion, force):
    """Do `verbs.yielded`."""
    own = body.stand
    if len(own.hub) == 0:
        return
    both = at_centre(own.hub, motion.d) + at_centre(own.hub, motion.ahead)
    motion.loss[0] -= 0.5 * (force[0] * both.real + force[1] * both.imag)


for _kind in (CoupledBody, DenseBody):
    does(verbs.stand, _kind)(stand.py_func)
    does(verbs.yielded, _kind)(yielded.py_func)


@does(verbs.stand, ModalBody)
def stand_alike(body, motion, time, force):
    """Do nothing: modes without coupling have equal supports in both directions."""


@does(verbs.yielded, ModalBody)
def yielded_alike(body, motion, force):
    """Supports that are alike take no energy here."""
