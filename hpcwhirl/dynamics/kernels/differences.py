"""The passes of central differences: works, losses and energy of their steps.

The velocity at step n is (d + d') / 2 dt, with the increments d = q_n - q_{n-1} and d'
= q_{n+1} - q_n; the damping loss of the step is (d + d')^2 times the coefficient `RATE`
of the mode, see `passes`.
"""

from __future__ import annotations

from hpcwhirl.dynamics.kernels.compiled import (
    does,
    inlined,
    kernel,
    rare,
    rare_kernel,
    verb,
)
from hpcwhirl.dynamics.kernels.contact import LAST, STEP
from hpcwhirl.dynamics.kernels.passes import (
    ITEMS,
    OMEGA,
    RADIAL,
    RATE,
    RING_STATE,
    ROTOR_STATE,
    TURN_IM,
    TURN_RE,
    ahead_ring,
    ahead_rotor,
    book_ring,
    book_rotor,
    holds,
    item,
    keep_slip,
    load_both,
    places,
    push_ring,
    push_rotor,
    store_both,
    sums_of,
    turn,
    work_ring,
    work_rotor,
)
from hpcwhirl.dynamics.kernels.vectors import FOUR, broadcast, element, fma, load, store
from hpcwhirl.dynamics.kernels.wave_types import CyclicRotor, GeneralRotor


@inlined
def end_rotor(c, at, q, d, old, push, touched, loss, works):
    """Apply contact forces to four rotor modes after a step; return q, d, loss, works.

    The sums `loss`, J, and `works`, see `passes.work_rotor`, include these modes then.

    push, touched : as in `passes.push_rotor`; whether the step had contact
    q, d, old : amplitudes; their increments in this step, and in the step before
    c, at : coefficients of all modes, packed, and where those of these four begin
    """
    if touched:
        change = push_rotor(c, at, push)
        q, d = q + change, d + change
    both = d + old
    loss = fma(load(c, at + RATE * FOUR) * both, both, loss)
    if touched:
        works = work_rotor(c, at, both, works)
    return q, d, loss, works


@inlined
def end_ring(c, at, y, d, old, push, touched, loss, works):
    """Apply contact forces to four ring modes after a step, as `end_rotor` does.

    y, d, old : (re, im) of the amplitudes, and of their increments as in `end_rotor`
    """
    if touched:
        cr, ci = push_ring(c, at, push)
        y, d = (y[0] + cr, y[1] + ci), (d[0] + cr, d[1] + ci)
    er, ei = load(c, at + TURN_RE * FOUR), load(c, at + TURN_IM * FOUR)
    br, bi = turn(er, ei, old[0], old[1])
    br, bi = br + d[0], bi + d[1]
    part = fma(br, br, bi * bi)
    loss = fma(load(c, at + RATE * FOUR), part, loss)
    if touched:
        works = work_ring(c, at, br, bi, works)
    return y, d, loss, works


@inlined
def rotor_columns(s, c, lam, rows, width, now, then, touched, out, sums,
                  slip):  # fmt: skip
    """Predict the next step of all modes of a rotor, after contact forces, if any.

    Arguments not listed are those of `pass_modes`.

    now, then, touched : results of `places`; whether the last step had contact
    """
    for col in range(0, width, FOUR):
        zero = broadcast(0.0)
        push, loss = load_both(lam, width, col), load(sums, 2 * width + col)
        spectrum, works = zero, (zero, zero, zero)
        for f in range(rows):
            m = f * width + col
            at = m * ITEMS
            q, d, loss, works = end_rotor(
                c, at, load(s, m), load(s, now + m), load(s, then + m), push, touched,
                loss, works,
            )  # fmt: skip
            if touched:
                store(s, now + m, d)
            q, d = ahead_rotor(c, at, q, d)
            store(s, then + m, d)
            store(s, m, q)
            spectrum = fma(load(c, at + RADIAL * FOUR), q, spectrum)
        store(sums, 2 * width + col, loss)
        if touched:
            book_rotor(sums, width, col, push, works)
            keep_slip(slip, width, col, works)
        store(out, col, spectrum)


@inlined
def ring_columns(s, c, lam, filled, k, now, then, touched, out, sums,
                 slip):  # fmt: skip
    """Predict the next step of all modes of the ring, after contact forces, if any.

    Arguments not listed are those of `pass_ring`.

    now, then, touched : as in `rotor_columns`
    """
    size = len(s) // RING_STATE
    for col in range(0, k, FOUR):
        zero = broadcast(0.0)
        push, loss = load_both(lam, k, col), load(sums, 2 * k + col)
        real, imag, works = zero, zero, (zero, zero, zero, zero)
        for r in range(filled[col // FOUR]):
            m = r * k + col
            at = m * ITEMS
            y, d, loss, works = end_ring(
                c, at, load_both(s, size, m), load_both(s, size, now + m),
                load_both(s, size, then + m), push, touched, loss, works,
            )  # fmt: skip
            if touched:
                store_both(s, size, now + m, d)
            y, d = ahead_ring(c, at, y, d)
            store_both(s, size, then + m, d)
            store_both(s, size, m, y)
            psi = load(c, at + RADIAL * FOUR)
            real, imag = fma(psi, y[0], real), fma(psi, y[1], imag)
        store(sums, 2 * k + col, loss)
        if touched:
            book_ring(sums, k, col, push, works)
            keep_slip(slip, k, col, works)
        store_both(out, k, col, (real, imag))


@verb
def pass_rotor(rotor, s, lam, rows, k, counter, out, sums, slip):
    """Apply the last step's contact forces to a rotor; predict its next step.

    Arguments are those of `pass_modes`.
    """


@inlined
def pass_modes(s, c, lam, rows, width, counter, out, sums, slip):
    """Apply the last step's contact forces to a rotor's modes; predict the next step.

    Parameters
    ----------
    s : (3 rows width,), state: amplitudes q, their increments in the last even step,
        and those in the last odd step
    c : packed coefficients of the modes, see `passes`
    lam : (2 width,), spectrum of the multipliers as (re, im), then as (im, -re)
    counter : counters of the pending step
    rows, width : the state has `rows` rows of `width` real numbers, re and im by slot
    out : (width,), out: spectrum of the gaps, the sum over the modes of each slot of q
        times the gap for unit q
    sums : (3 width,), in and out, J, for re and im of each slot: twice the work of
        normal forces, twice that of drag over mu, damping loss
    slip : (2 width,), out after a step with contact: factors of the drag, see `slip_of`
    """
    now, then = places(counter, rows * width)
    if counter[LAST] == counter[STEP]:
        rotor_columns(s, c, lam, rows, width, now, then, True, out, sums, slip)
    else:
        rotor_columns(s, c, lam, rows, width, now, then, False, out, sums, slip)


@does(pass_rotor, CyclicRotor)
@inlined
def pass_cyclic(rotor, s, lam, rows, k, counter, out, sums, slip):
    """Apply the last contact forces to the rotor's modes; predict their next step.

    The implementation of `pass_rotor` for equal sectors, with modes by nodal diameter.
    Arguments are those of `pass_modes`.
    """
    pass_modes(s, rotor.items, lam, rows, 2 * k, counter, out, sums, slip)


@inlined
def pass_ring(s, c, lam, filled, k, counter, out, sums, slip):
    """Apply the last step's contact forces to the casing ring; predict the next step.

    s : (6 size,): re and im of the amplitudes, then of their increments in the last
        even step, and in the last odd step
    lam, filled : re, im of the multipliers in its first 2 k; see `passes.filled_rows`
    out : (2 k,), re and im of the spectrum of the ring's part of the gaps, m
    sums, slip : (4 k,), (2 k,), as in `pass_modes`
    """
    now, then = places(counter, len(s) // RING_STATE * 2)
    if counter[LAST] == counter[STEP]:
        ring_columns(s, c, lam, filled, k, now, then, True, out, sums, slip)
    else:
        ring_columns(s, c, lam, filled, k, now, then, False, out, sums, slip)


@inlined
def settle_rotor(s, t, c, lam, width, counter, sums):
    """Copy the rotor's state s to t; apply the last step's contact forces to t.

    The works and the loss of this step are added to sums, J.

    c, lam, width : as in `pass_modes`
    """
    touched, zero = counter[LAST] == counter[STEP], broadcast(0.0)
    size = len(s) // ROTOR_STATE
    now, then = places(counter, size)
    for col in range(0, width, FOUR):
        push, loss = load_both(lam, width, col), load(sums, 2 * width + col)
        works = zero, zero, zero
        for m in range(col, size, width):
            q, d, loss, works = end_rotor(
                c, m * ITEMS, load(s, m), load(s, now + m), load(s, then + m), push,
                touched, loss, works,
            )  # fmt: skip
            store(t, m, q)
            store(t, now + m, d)
        store(sums, 2 * width + col, loss)
        if touched:
            book_rotor(sums, width, col, push, works)


@inlined
def settle_ring(s, t, c, lam, k, counter, sums):
    """Copy the casing ring's state s to t; apply the last step's contact forces to t.

    t : must be 0 at slots without modes, which are not copied
    c, lam, sums : as in `pass_ring`
    """
    touched, zero = counter[LAST] == counter[STEP], broadcast(0.0)
    size = len(s) // RING_STATE
    now, then = places(counter, 2 * size)
    for col in range(0, k, FOUR):
        push, loss = load_both(lam, k, col), load(sums, 2 * k + col)
        works = zero, zero, zero, zero
        for m in range(col, size, k):
            if holds(c, m):
                y, d, loss, works = end_ring(
                    c, m * ITEMS, load_both(s, size, m), load_both(s, size, now + m),
                    load_both(s, size, then + m), push, touched, loss, works,
                )  # fmt: skip
                store_both(t, size, m, y)
                store_both(t, size, now + m, d)
        store(sums, 2 * k + col, loss)
        if touched:
            book_ring(sums, k, col, push, works)


@verb
def end_step(rotor, s_b, t_b, s_c, t_c, c_c, lam, counter, sums_b, sums_c):
    """Copy the states of rotor and ring; apply the last contact forces to the copies.

    States s_b of the rotor, s_c of the casing ring are copied to t_b, t_c; works and
    losses of the last step are added to sums_b and sums_c, J.

    c_c, lam : coefficients of the ring's modes; spectrum of the multipliers
    """


@does(end_step, CyclicRotor)
@kernel
def end_cyclic(rotor, s_b, t_b, s_c, t_c, c_c, lam, counter, sums_b, sums_c):
    """Copy the states of both bodies; apply the last contact forces to the copies.

    The implementation of `end_step`, which explains the arguments, for equal sectors,
    with modes by nodal diameter.
    """
    k = len(sums_c) // 4
    settle_rotor(s_b, t_b, rotor.items, lam, 2 * k, counter, sums_b)
    settle_ring(s_c, t_c, c_c, lam, k, counter, sums_c)


@rare
def energy_of(s, c, place, increment, size, step):
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


@rare
def energy_of_ring(t, c, now, step):
    """Return the energy of the casing ring, J, from a state t without pending forces.

    now : step number mod 2
    c : coefficients of the ring's modes, packed

    The sums over re and im are those of `energy_of`, computed side by side for speed.
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


@verb
def energies_of(rotor, t_b, t_c, c_c, now, step):
    """Return energies of rotor and casing ring, J, from states without pending forces.

    now : step number mod 2, by which the state has the increments of this step
    t_b, t_c : states of rotor and ring; c_c : coefficients of the ring's modes
    """


@does(energies_of, GeneralRotor)
@does(energies_of, CyclicRotor)
@rare_kernel
def energies_of_modes(rotor, t_b, t_c, c_c, now, step):
    """Return the energies of a rotor's modes and of the ring, J, from their states.

    Arguments are those of `energies_of`, of which this is one implementation.
    """
    m, ring = len(t_b) // ROTOR_STATE, energy_of_ring(t_c, c_c, now, step)
    return energy_of(t_b, rotor.items, m - m, (1 + now) * m, m, step), ring


@rare_kernel
def column_sums(sums_b, sums_c, _):
    """Return works, J, so far: of rotation, impact, friction over mu, and damping.

    sums_b, sums_c : works and losses by slot, see `pass_modes` and `pass_ring`

    Impact losses are 0 here: `contact.book_contacts` enters them in the ledger.
    """
    normal, drag, loss = sums_of(sums_b, sums_c)
    return normal, 0.0, drag, loss
