"""The ends of steps of central differences: their works, losses and energy.

The velocity at step n is (d + d') / 2 dt, with the increments d = q_n - q_{n-1} and d'
= q_{n+1} - q_n; the damping loss of the step is (d + d')^2 times the coefficient `RATE`
of the mode, see `passes`.
"""

from __future__ import annotations

from typing import NamedTuple

from hpcwhirl.dynamics.kernels.compiled import does, inlined, rare, rare_kernel
from hpcwhirl.dynamics.kernels.passes import (
    ITEMS,
    OMEGA,
    RATE,
    RING_STATE,
    TURN_IM,
    TURN_RE,
    holds,
    item,
    load_both,
    push_ring,
    push_rotor,
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
from hpcwhirl.dynamics.kernels.vectors import FOUR, broadcast, element, fma, load


class Central(NamedTuple):
    """Type of the argument `way` by which the kernels end steps by central differences.

    Numba compiles a kernel anew for it; its only instance is `CENTRAL`.
    """


CENTRAL = Central()


@does(is_exact, Central)
@inlined
def is_not_exact(_way):
    """Return False: steps by central differences are not those of the exact flow."""
    return False


@does(end_rotor, Central)
@inlined
def end_rotor_central(_way, c, at, q, d, s, old, push, touched, loss, works):
    """End a step of four rotor modes by central differences: apply contact, add works.

    Return q, d, loss, works: amplitudes, their increments in the step, and sums. This
    is the implementation of `stepping.end_rotor`, which explains the arguments.
    """
    if touched:
        q, d = push_rotor(c, at, push, q, d)
    both = d + load(s, old)
    loss = fma(load(c, at + RATE * FOUR) * both, both, loss)
    if touched:
        works = work_rotor(c, at, both, works)
    return q, d, loss, works


@does(end_ring, Central)
@inlined
def end_ring_central(_way, c, at, y, d, s, size, old, push, touched, loss, works,
                     passing):  # fmt: skip
    """End a step of four ring modes by central differences: apply contact, add works.

    Return y, d, loss, works, passing: (re, im) of the amplitudes and of their
    increments in the step, and sums. This is the implementation of `stepping.end_ring`,
    which explains the arguments.
    """
    if touched:
        y, d = push_ring(c, at, push, y, d)
    er, ei = load(c, at + TURN_RE * FOUR), load(c, at + TURN_IM * FOUR)
    br, bi = turn(er, ei, load(s, old), load(s, size + old))
    br, bi = br + d[0], bi + d[1]
    part = fma(br, br, bi * bi)
    loss = fma(load(c, at + RATE * FOUR), part, loss)
    if touched:
        works = work_ring(c, at, br, bi, works)
    return y, d, loss, works, passing


@does(energy_of, Central)
@rare
def energy_of_modes(_way, s, c, place, increment, size, step):
    """Return the energy of a body's modes between steps n and n + 1, J.

    It is the sum of 1/2 v^2 + 1/2 omega^2 q_n q_{n+1} over `size` modes.

    s, c : state of the body, after the contact forces of step n; coefficients of its
        modes, packed as `passes` explains
    place, increment : first index in s of the amplitudes q_{n+1}, and of their
        increments q_{n+1} - q_n = v dt
    step : dt, s
    """
    total = 0.0
    for m in range(size):
        q, d, omega = s[place + m], s[increment + m], item(c, OMEGA, m)
        speed = d / step
        total += 0.5 * speed * speed
        total += 0.5 * omega * omega * q * (q - d)
    return total


@inlined
def energies_of_four(q, d, stiff, step):
    """Return the kinetic and the potential energies of four modes, J, as two vectors.

    q, d : four modal amplitudes q_{n+1}, and their increments in the step, q_{n+1} -
        q_n
    stiff, step : omega^2 / 2 of each mode; dt, s
    """
    half, speed = broadcast(0.5), d / broadcast(step)
    return half * speed * speed, stiff * q * (q - d)


@does(energy_of_ring, Central)
@rare
def energy_of_ring_central(_way, t, c, now, step):
    """Return the energy of the casing ring's modes between steps n and n + 1, J.

    t : (6 size,), state of the ring, after the contact forces of step n
    c : coefficients of the ring's modes, packed as `passes` explains
    now : 0 or 1, whether step n + 1 is even or odd: selects its increments in t
    step : dt, s

    The sums over real and imaginary parts are those of `energy_of_modes`, here computed
    together.
    """
    n, first, second = len(t) // RING_STATE, 0.0, 0.0
    at = 2 * n * (1 + now)
    for m in range(0, n, FOUR):
        if holds(c, m):
            q, d = load_both(t, n, m), load_both(t, n, at + m)
            omega = load(c, m * ITEMS + OMEGA * FOUR)
            stiff = broadcast(0.5) * omega * omega
            one = energies_of_four(q[0], d[0], stiff, step)
            two = energies_of_four(q[1], d[1], stiff, step)
            for i in range(FOUR):
                first += element(one[0], i)
                first += element(one[1], i)
                second += element(two[0], i)
                second += element(two[1], i)
    return first + second


@does(column_sums, Central)
@rare_kernel
def column_sums_central(_way, sums_b, sums_c, _):
    """Return four works so far, J: of rotation, impact, friction over mu, and damping.

    sums_b, sums_c : works and losses by nodal diameter, of rotor and ring: the arrays
        `sums` of `stepping.pass_modes` and `stepping.pass_ring`

    The impact loss is 0 here: `contact.book_contacts` enters it in the ledger, and
    subtracts it from the rotation's work.
    """
    normal, drag, loss = sums_of(sums_b, sums_c)
    return normal, 0.0, drag, loss
