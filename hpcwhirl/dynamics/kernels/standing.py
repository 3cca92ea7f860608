"""Forces of supports on the shaft's centre that no constant matrix represents.

These are forces of non-rotating supports that differ by direction, and of a squeeze
film, whose damping depends on the displacement z = x_o + i y_o of the centre.

In the rotating frame, at step n, with the centre z and its velocity v,

f = -[(k_d - i Omega c_d) conj(z) + c_d conj(v)] e^{-2 i Omega t},

k_d and c_d as in `reduction.supports`, v = (z_{n+1} - z_{n-1}) / 2 dt of the step
without contact. The contribution of f to v is included, by solving two equations; that
of contact in the same step is not.

The matrices of y, the motion that contact causes, include the damping c_0 of a squeeze
film (`reduction.supports`), and the circle z_s of an unbalanced rotor is in equilibrium
with the film. The rest of its force, at z = z_s + y, is

f = -(c_m - c_0) v - c_d (z/c)^2 conj(v) - i Omega [(c_t - c_0) z - (c_t - c_0)_s z_s],

c_m = c_t + c_d |z/c|^2, c_t = c_0 / (1 - |z/c|^2)^{3/2}, c_d = 3/2 c_0 / (...)^{5/2}.
"""

from __future__ import annotations

import math

from hpcwhirl.dynamics.kernels import verbs
from hpcwhirl.dynamics.kernels.compiled import does, inlined, kernel, part
from hpcwhirl.dynamics.kernels.kernel_types import DenseBody, ModalBody
from hpcwhirl.dynamics.kernels.vectors import (
    FOUR,
    broadcast,
    element,
    fma,
    get,
    load,
    store,
)

CLOSED = 0.99 * 0.99  # |z/c|^2 beyond which a film's damping is that at this value


@kernel
def at_centre(hub, values):
    """Return the displacement x_o + i y_o of the shaft's centre, m, rotating frame.

    hub : (2, n), x_o, y_o for unit coordinates of a body
    values : (n,), these coordinates; or their increments, for the increment of the
        centre
    """
    x, y = 0.0, 0.0
    for m in range(hub.shape[1]):
        x += hub[0, m] * values[m]
        y += hub[1, m] * values[m]
    return complex(x, y)


@kernel
def film_at(square):
    """Return c_t / c_0 - 1 and c_d / c_0 of a squeeze film at a displacement z.

    c_t and c_d are damping coefficients, c_0 that of a centred journal, see this
    module.

    square : |z/c|^2, c the radial clearance
    """
    more = 1.0 / (1.0 - min(square, CLOSED))
    across = more * math.sqrt(more)
    return across - 1.0, 1.5 * across * more


@kernel
def answer(give, held, moving, even, drift):
    """Return the supports' force f on the centre, N, complex, in a step.

    The force depends on the velocity that it changes: it is f = -held - even u - drift
    conj(u), where the velocity of the centre is u = moving + W f, m/s: two equations
    for its two components.

    held, even, drift : -f at u = 0, N, complex; damping, N s/m, real and complex
    moving : m/s, complex, velocity of the centre without f
    give : (2, 2), W, change of the centre's velocity by a unit force, m/(N s)
    """
    rest = -held - even * moving - drift * moving.conjugate()
    a, b = drift.real, drift.imag  # f -> drift conj(f) on (x, y): [[a, b], [b, -a]]
    xx = 1.0 + (even + a) * give[0, 0] + b * give[1, 0]
    xy = (even + a) * give[0, 1] + b * give[1, 1]
    yx = b * give[0, 0] + (even - a) * give[1, 0]
    yy = 1.0 + b * give[0, 1] + (even - a) * give[1, 1]
    down = 1.0 / (xx * yy - xy * yx)
    x = (yy * rest.real - xy * rest.imag) * down
    return complex(x, (xx * rest.imag - yx * rest.real) * down)


@kernel
def turned_at(own, time):
    """Return e^{-2 i Omega t}, of the supports' directions in the rotating frame.

    own, time : `kernel_types.Stand`; t, s
    """
    angle = 2.0 * (own.speed * time)
    return complex(math.cos(angle), -math.sin(angle))


@kernel
def terms_at(own, place, turned):
    """Return the terms of the supports' force on the centre.

    They are held, N, even and drift, N s/m: the force is f = -held - even v - drift
    conj(v), v being the centre's velocity.

    own : `kernel_types.Stand`
    place : m, complex displacement of the centre, from the circle of an unbalanced
        rotor
    turned : e^{-2 i Omega t} at the time at which the supports' directions are taken
    """
    spring = own.stiffness - 1j * own.speed * own.damping
    held, drift = turned * spring * place.conjugate(), turned * own.damping
    even = 0.0
    if own.film > 0.0:
        whole = own.circle + place
        near = whole * (1.0 / own.clearance)
        square = near.real**2 + near.imag**2
        across, apart = film_at(square)
        held += 1j * (own.speed * own.film) * (across * whole) - own.balance
        if square > CLOSED:
            near *= math.sqrt(CLOSED / square)
        even = own.film * (across + apart * (near.real**2 + near.imag**2))
        drift += own.film * apart * near**2
    return held, even, drift


@inlined
def force_at(own, place, moving, turned):
    """Return the supports' force x + i y on the centre in a step, N, rotating frame.

    own, turned : as in `terms_at`
    place, moving : m, m/s, displacement of the centre at the step's start, and its
        velocity without this force, complex; in the motion that contact causes
    """
    held, even, apart = terms_at(own, place, turned)
    return answer(own.give, held, moving, even, apart)


@inlined
def turned_by_steps(support, number, turned):
    """Return e^{-2 i Omega t} at a step, by a table of the steps after every 64th.

    support, number : `loop.wave_types.SlotSupport`; number of the step
    turned : (3,), in and out: re and im at such a step; its number
    """
    size = len(support.turns) // 2
    after = number % size
    if turned[2] != number - after:
        stand = support.stand
        whole = turned_at(stand, (number - after) * stand.step)
        turned[0], turned[1], turned[2] = whole.real, whole.imag, number - after
    return complex(turned[0], turned[1]) * complex(
        support.turns[2 * after], support.turns[2 * after + 1]
    )


@part
def find_force(support, q, number, turned, push):
    """Compute the supports' force in a step from the waves of equal sectors.

    support : `loop.wave_types.SlotSupport`; its slot is in the first group of four
    q : amplitudes after the step without forces
    number, turned : as in `turned_by_steps`, at the step's start
    push : (2,), N, out: the force, x and y
    """
    zero, reads, slot = broadcast(0.0), support.reads, support.slot
    a, b, c, d = zero, zero, zero, zero
    for i in range(0, len(reads), 4 * FOUR):
        m = i + slot
        a = fma(load(reads, i), broadcast(get(q, m)), a)
        b = fma(load(reads, i + FOUR), broadcast(get(q, m + FOUR)), b)
        c = fma(load(reads, i + 2 * FOUR), broadcast(get(q, m + 2 * FOUR)), c)
        d = fma(load(reads, i + 3 * FOUR), broadcast(get(q, m + 3 * FOUR)), d)
    both = (a + b) + (c + d)
    place = complex(element(both, 0), element(both, 1))
    moving = complex(element(both, 2), element(both, 3))
    now = turned_by_steps(support, number, turned)
    force = force_at(support.stand, place, moving, now)
    push[0], push[1] = force.real, force.imag


@part
def push_group(gives, x, y, q):
    """Add the change by the supports' force to the amplitudes q of the first group.

    gives : `loop.wave_types.SlotSupport.gives`
    x, y : N, the force, in all four lanes
    """
    for m in range(0, len(gives) // 2, FOUR):
        gained = fma(load(gives, 2 * m + FOUR), y, load(q, m))
        store(q, m, fma(load(gives, 2 * m), x, gained))


@part
def hold_centre(support, q, time, centre):
    """Apply the supports' force on the centre in a step to the amplitudes q of waves.

    Return its components x and y, N, rotating frame.

    support : `loop.wave_types.PointsSupport`
    q : amplitudes, in and out: in those after the step without forces
    time : s, at the step's start, at which the supports' directions are taken
    centre : (n,), out: the amplitudes that change, as they were
    """
    zero, which, reads = broadcast(0.0), support.which, support.reads
    a, b, c, d = zero, zero, zero, zero
    for i in range(0, len(which), FOUR):
        one, two = get(q, which[i]), get(q, which[i + 1])
        three, last = get(q, which[i + 2]), get(q, which[i + 3])
        centre[i], centre[i + 1], centre[i + 2], centre[i + 3] = one, two, three, last
        a = fma(load(reads, FOUR * i), broadcast(one), a)
        b = fma(load(reads, FOUR * (i + 1)), broadcast(two), b)
        c = fma(load(reads, FOUR * (i + 2)), broadcast(three), c)
        d = fma(load(reads, FOUR * (i + 3)), broadcast(last), d)
    both = (a + b) + (c + d)
    place, moving = (
        complex(element(both, 0), element(both, 1)),
        complex(element(both, 2), element(both, 3)),
    )
    push = force_at(support.stand, place, moving, turned_at(support.stand, time))
    x, y = push.real, push.imag
    for i in range(support.used):
        gained = get(support.gives, 2 * i) * x + get(support.gives, 2 * i + 1) * y
        q[which[i]] = centre[i] + gained
    return x, y


@part
def stand(body, motion, time, force):
    """Compute the force of supports on the shaft's centre; add its effect to a step.

    The increments due to it are added to motion.ahead and motion.following, the
    predicted step without contact. This is `verbs.stand` for a body with such supports.

    body, motion : `DenseBody` or `CoupledBody`; `verbs.Motion`
    time : s, at which the supports' directions are taken
    force : (2,), N, out, rotating frame
    """
    own = body.stand
    if len(own.hub) == 0:
        return
    q, d, _, ahead, following, _, _ = motion
    held, even, drift = terms_at(own, at_centre(own.hub, q), turned_at(own, time))
    twice = 2.0 * own.step
    moving = (at_centre(own.hub, d) + at_centre(own.hub, ahead)) / twice
    push = answer(own.give, held, moving, even, drift)
    force[0], force[1] = push.real, push.imag
    for m in range(own.hub.shape[1]):
        change = own.moved[0, m] * push.real + own.moved[1, m] * push.imag
        ahead[m] += change
        following[m] += change


@part
def yielded(body, motion, force, _):
    """Subtract the work of the supports' force in a step, J, from the damping loss.

    This is `verbs.yielded` for a body with such supports.

    force : (2,), N, on the shaft's centre, as `stand` has set it
    """
    own = body.stand
    if len(own.hub) == 0:
        return
    both = at_centre(own.hub, motion.d) + at_centre(own.hub, motion.ahead)
    motion.loss[0] -= 0.5 * (force[0] * both.real + force[1] * both.imag)


@part
def note_beside(body, motion, step, row):
    """Do nothing: motion without contact at constant speed is known in closed form.

    This is `verbs.note_beside` for bodies whose evidence needs no further columns.
    """


does(verbs.stand, DenseBody)(stand)
does(verbs.yielded, DenseBody)(yielded)
does(verbs.note_beside, DenseBody)(note_beside)
does(verbs.note_beside, ModalBody)(note_beside)


@does(verbs.stand, ModalBody)
@part
def stand_alike(body, motion, time, force):
    """Do nothing: a body of uncoupled modes has no forces of supports to add.

    Supports that differ by direction or have a film require `rotation = "full"`.
    """


@does(verbs.yielded, ModalBody)
@part
def yielded_alike(body, motion, force, ledger):
    """Enter no work: no further forces act on a body of uncoupled modes.

    The implementation of `verbs.yielded` for such a body, which has neither supports
    that differ by direction nor a changing speed.
    """
