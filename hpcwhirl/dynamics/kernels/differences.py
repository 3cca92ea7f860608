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
    """The way of steps by central differences, an argument of `stepping`."""


CENTRAL = Central()


@does(is_exact, Central)
@inlined
def is_not_exact(_way):
    """Return False."""
    return False


@does(end_rotor, Central)
@inlined
def end_rotor_central(_way, c, at, q, d, s, old, push, touched, loss, works):
    """Apply contact forces to four rotor modes after a step; return q, d, loss, works.

    The implementation of `stepping.end_rotor`, which explains the arguments.
    """
    if touched:
        change = push_rotor(c, at, push)
        q, d = q + change, d + change
    both = d + load(s, old)
    loss = fma(load(c, at + RATE * FOUR) * both, both, loss)
    if touched:
        works = work_rotor(c, at, both, works)
    return q, d, loss, works


@does(end_ring, Central)
@inlined
def end_ring_central(_way, c, at, y, d, s, size, old, push, touched, loss, works,
                     passing):  # fmt: skip
    """Apply contact forces to four ring modes after a step, as `end_rotor` does.

    The implementation of `stepping.end_ring`, which explains the arguments.
    """
    if touched:
        cr, ci = push_ring(c, at, push)
        y, d = (y[0] + cr, y[1] + ci), (d[0] + cr, d[1] + ci)
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

    place, increment : first index in s of the amplitudes q_{n+1}, and of their
        increments q_{n+1} - q_n = v dt
    s, c : state of the body; coefficients of its modes, packed
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
    """Return the kinetic and the potential energies of four modes, J, four each.

    q, d : amplitudes q_{n+1}, and their increments in the step, q_{n+1} - q_n
    stiff, step : omega^2 / 2 of each mode; dt, s
    """
    half, speed = broadcast(0.5), d / broadcast(step)
    return half * speed * speed, stiff * q * (q - d)


@does(energy_of_ring, Central)
@rare
def energy_of_ring_central(_way, t, c, now, step):
    """Return the energy of the casing ring, J, from a state t without pending forces.

    now : step number mod 2
    c : coefficients of the ring's modes, packed

    The sums over re and im are those of `energy_of_modes`, here side by side.
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
    """Return works, J, so far: of rotation, impact, friction over mu, and damping.

    sums_b, sums_c : works and losses by slot, see `stepping.column_sums`

    Impact losses are 0 here: `contact.book_contacts` enters them in the ledger.
    """
    normal, drag, loss = sums_of(sums_b, sums_c)
    return normal, 0.0, drag, loss
