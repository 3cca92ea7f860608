"""The ends of steps of the exact flow: their works, losses and energy.

Works and losses of a step are quadratic in the increments d = q_n - q_{n-1} and d' =
q_{n+1} - q_n and in q' = q_{n+1}, see `timestep.exact_flow`. A jump over steps without
contact (`flight`) leaves no step to be ended. The ring's array of works has a fourth
part, the power of the contact forces that the rotation moves along the deformed ring:
the normal forces times `passing`, the rate at which the ring's radius changes at the
blades, since they move past it.
"""

from __future__ import annotations

from typing import NamedTuple

from hpcwhirl.dynamics.kernels.compiled import does, inlined, rare, rare_kernel
from hpcwhirl.dynamics.kernels.passes import (
    LOSS_DD,
    LOSS_DQ,
    LOSS_QQ,
    MEAN_NEW,
    MEAN_OLD,
    MEAN_PLACE,
    OMEGA,
    RADIAL,
    RING_STATE,
    SPEED_D,
    SPEED_Q,
    SPIN,
    TURN_IM,
    TURN_RE,
    item,
    load_both,
    push_ring,
    push_rotor,
    sum_of,
    sums_of,
    turn,
    work_ring,
    work_rotor,
)
from hpcwhirl.dynamics.kernels.stepping import (
    column_sums,
    end_ring,
    end_rotor,
    energy_of,
    energy_of_ring,
    is_exact,
)
from hpcwhirl.dynamics.kernels.vectors import FOUR, broadcast, fma, fnma, load


class Exact(NamedTuple):
    """Type of the argument `way` by which the kernels end steps by the exact flow.

    Numba compiles a kernel anew for it; its only instance is `EXACT`.
    """


EXACT = Exact()


@does(is_exact, Exact)
@inlined
def is_indeed(_way):
    """Return True: `stepping.is_exact` for a kernel that completes steps exactly."""
    return True


@inlined
def lose_rotor(c, at, q, d, loss):
    """Return `loss` plus the damping loss, J, of a step of four rotor modes.

    c, at : coefficients of all modes, packed, and the index in c at which those of the
        four begin
    q, d : amplitudes at the end of the step, and their increments in it
    """
    part = load(c, at + LOSS_DQ * FOUR) * q
    part = fma(load(c, at + LOSS_DD * FOUR), d, part)
    loss = fma(part, d, loss)
    return fma(load(c, at + LOSS_QQ * FOUR) * q, q, loss)


@inlined
def lose_ring(c, at, y, d, loss):
    """Return `loss` plus the damping loss, J, of a step of four modes of the ring.

    c, at : coefficients of all modes, packed, and the index in c at which those of the
        four begin
    y, d : (re, im) of the amplitudes at the end of the step, and of their increments in
        it
    """
    part = fma(d[0], d[0], d[1] * d[1])
    loss = fma(load(c, at + LOSS_DD * FOUR), part, loss)
    part = fma(d[0], y[0], d[1] * y[1])
    loss = fma(load(c, at + LOSS_DQ * FOUR), part, loss)
    part = fma(y[0], y[0], y[1] * y[1])
    return fma(load(c, at + LOSS_QQ * FOUR), part, loss)


@does(end_rotor, Exact)
@inlined
def end_rotor_exact(_way, c, at, q, d, s, old, push, touched, loss, works):
    """End a step of four rotor modes by the exact flow: apply contact, add works.

    Return q, d, loss, works: amplitudes, their increments in the step, and sums. This
    is the implementation of `stepping.end_rotor`, which explains the arguments.
    """
    if touched:
        q, d = push_rotor(c, at, push, q, d)
    loss = lose_rotor(c, at, q, d, loss)
    if touched:
        both = load(c, at + MEAN_OLD * FOUR) * load(s, old)
        both = fma(load(c, at + MEAN_NEW * FOUR), d, both)
        both = fma(load(c, at + MEAN_PLACE * FOUR), q, both)
        works = work_rotor(c, at, both, works)
    return q, d, loss, works


@inlined
def mean_ring(c, at, y, d, old):
    """Return dt (v- + v+) of four ring modes, (re, im), for the works of contact.

    v- and v+ are the modes' velocities before and after the step's contact impulse.

    c, at : coefficients of all modes, packed, and the index in c at which those of the
        four begin
    y, d, old : (re, im) of the amplitudes; of their increments in this step, and in the
        step before
    """
    er, ei = load(c, at + TURN_RE * FOUR), load(c, at + TURN_IM * FOUR)
    br, bi = turn(er, ei, old[0], old[1])
    was, new = load(c, at + MEAN_OLD * FOUR), load(c, at + MEAN_NEW * FOUR)
    place = load(c, at + MEAN_PLACE * FOUR)
    br = fma(was, br, fma(new, d[0], place * y[0]))
    return br, fma(was, bi, fma(new, d[1], place * y[1]))


@does(end_ring, Exact)
@inlined
def end_ring_exact(_way, c, at, y, d, s, size, old, push, touched, loss, works,
                   passing):  # fmt: skip
    """End a step of four ring modes by the exact flow: apply contact, add works.

    Return y, d, loss, works, passing: (re, im) of the amplitudes and of their
    increments in the step, and sums. This is the implementation of `stepping.end_ring`,
    which explains the arguments.

    In the time of `works`, from step n - 1 to n + 1, a blade moves past the ring's
    deformed shape of step n - 1. The change of the radius on that way is, at second
    order, 2 dt times `passing` at the blade's place at step n.
    """
    if touched:
        y, d = push_ring(c, at, push, y, d)
    loss = lose_ring(c, at, y, d, loss)
    if touched:
        spin = load(c, at + SPIN * FOUR) * load(c, at + RADIAL * FOUR)
        before = load_both(s, size, old)
        er, ei = load(c, at + TURN_RE * FOUR), load(c, at + TURN_IM * FOUR)
        zr, zi = turn(er, broadcast(0.0) - ei, y[0] - d[0], y[1] - d[1])
        zr, zi = zr - before[0], zi - before[1]
        passing = fnma(spin, zi, passing[0]), fma(spin, zr, passing[1])
        br, bi = mean_ring(c, at, y, d, before)
        works = work_ring(c, at, br, bi, works)
    return y, d, loss, works, passing


@does(energy_of, Exact)
@rare
def energy_of_modes(_way, s, c, place, increment, size, _step):
    """Return the energy of `size` modes of a body, J, at the end of a step.

    s, c : state of the body, after the step's contact forces; coefficients of its
        modes, packed as `passes` explains
    place, increment : first index in s of the amplitudes, and of their increments in
        the step that has ended
    """
    total = 0.0
    for m in range(size):
        q, d = s[place + m], s[increment + m]
        speed = item(c, SPEED_D, m) * d + item(c, SPEED_Q, m) * q
        stretch = item(c, OMEGA, m) * q
        total += 0.5 * (speed * speed + stretch * stretch)
    return total


@does(energy_of_ring, Exact)
@rare
def energy_of_ring_exact(way, t, c, now, step):
    """Return the energy of the casing ring's modes, J, at the end of a step.

    t : (6 size,), state of the ring, after the step's contact forces
    c : coefficients of the ring's modes, packed as `passes` explains
    now : 0 or 1, whether the step's number is even or odd: selects its increments in t
    step : dt, s
    """
    n = len(t) // RING_STATE
    at = 2 * n * (1 + now)
    real = energy_of(way, t, c, n - n, at, n, step)
    return real + energy_of(way, t, c, n, at + n, n, step)


@does(column_sums, Exact)
@rare_kernel
def column_sums_exact(_way, sums_b, sums_c, step):
    """Return four works so far, J: of rotation, impact, friction over mu, and damping.

    The rotation's work is that of contact forces moved along the deformed ring; the
    impact loss is the remaining work of the normal forces.

    sums_b, sums_c : works and losses by nodal diameter, of rotor and ring: the arrays
        `sums` of `stepping.pass_modes` and `stepping.pass_ring`
    step : dt, s
    """
    n = len(sums_c) // 4
    normal, drag, loss = sums_of(sums_b, sums_c)
    carried = -step * sum_of(sums_c, 3 * n, 4 * n)
    return carried, carried - normal, drag, loss
