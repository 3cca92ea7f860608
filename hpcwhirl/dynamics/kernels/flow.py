"""The passes of the exact flow: works, losses and energy of their steps.

Works and losses of a step are quadratic in the increments d = q_n - q_{n-1} and d' =
q_{n+1} - q_n and in q' = q_{n+1}, see `timestep.exact_flow`. After a jump no step is
pending. The sums of the ring have a fourth part: the normal forces times `passing`, the
rate at which the ring's deformed shape passes the blades.
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
from hpcwhirl.dynamics.kernels.contact import ENDED, LAST, STEP
from hpcwhirl.dynamics.kernels.passes import (
    ITEMS,
    LOSS_DD,
    LOSS_DQ,
    LOSS_QQ,
    MEAN_NEW,
    MEAN_OLD,
    MEAN_PLACE,
    OMEGA,
    RADIAL,
    RING_STATE,
    ROTOR_STATE,
    SPEED_D,
    SPEED_Q,
    SPIN,
    TURN_IM,
    TURN_RE,
    ahead_ring,
    ahead_rotor,
    book_ring,
    book_rotor,
    item,
    keep_slip,
    load_both,
    places,
    push_ring,
    push_rotor,
    store_both,
    sum_of,
    sums_of,
    turn,
    work_ring,
    work_rotor,
)
from hpcwhirl.dynamics.kernels.vectors import FOUR, broadcast, fma, fnma, load, store
from hpcwhirl.dynamics.kernels.wave_types import CyclicRotor


@inlined
def lose_rotor(c, at, q, d, loss):
    """Return `loss` plus the damping loss, J, of a step of four modes.

    c, at : coefficients of all modes, packed, and where those of the four begin
    q, d : amplitudes at the end of the step, and their increments in it
    """
    part = load(c, at + LOSS_DQ * FOUR) * q
    part = fma(load(c, at + LOSS_DD * FOUR), d, part)
    loss = fma(part, d, loss)
    return fma(load(c, at + LOSS_QQ * FOUR) * q, q, loss)


@inlined
def lose_ring(c, at, y, d, loss):
    """Return `loss` plus the damping loss, J, of a step of four modes of the ring.

    c, at : coefficients of all modes, packed, and where those of the four begin
    y, d : (re, im) of the amplitudes at the end of the step, and of their increments in
        it
    """
    part = fma(d[0], d[0], d[1] * d[1])
    loss = fma(load(c, at + LOSS_DD * FOUR), part, loss)
    part = fma(d[0], y[0], d[1] * y[1])
    loss = fma(load(c, at + LOSS_DQ * FOUR), part, loss)
    part = fma(y[0], y[0], y[1] * y[1])
    return fma(load(c, at + LOSS_QQ * FOUR), part, loss)


@inlined
def end_rotor(c, at, q, d, s, old, push, touched, loss, works):
    """Apply contact forces to four rotor modes after a step; return q, d, loss, works.

    The sums `loss`, J, and `works`, see `passes.work_rotor`, include these modes then.

    c, at : coefficients of all modes, packed, and where those of the four begin
    q, d : amplitudes, and their increments in this step
    push, touched : as in `passes.push_rotor`; whether the step had contact
    s, old : state, and index in it of their increments in the step before
    """
    if touched:
        change = push_rotor(c, at, push)
        q, d = q + change, d + change
    loss = lose_rotor(c, at, q, d, loss)
    if touched:
        both = load(c, at + MEAN_OLD * FOUR) * load(s, old)
        both = fma(load(c, at + MEAN_NEW * FOUR), d, both)
        both = fma(load(c, at + MEAN_PLACE * FOUR), q, both)
        works = work_rotor(c, at, both, works)
    return q, d, loss, works


@inlined
def mean_ring(c, at, y, d, old):
    """Return (re, im) of dt (v- + v+) of four modes of the ring, see `work_rotor`.

    v- and v+ are the velocities before and after the step's impulse.

    c, at : coefficients of all modes, packed, and where those of the four begin
    y, d, old : (re, im) of the amplitudes; of their increments in this step, and in the
        step before
    """
    er, ei = load(c, at + TURN_RE * FOUR), load(c, at + TURN_IM * FOUR)
    br, bi = turn(er, ei, old[0], old[1])
    was, new = load(c, at + MEAN_OLD * FOUR), load(c, at + MEAN_NEW * FOUR)
    place = load(c, at + MEAN_PLACE * FOUR)
    br = fma(was, br, fma(new, d[0], place * y[0]))
    return br, fma(was, bi, fma(new, d[1], place * y[1]))


@inlined
def end_ring(c, at, y, d, s, size, old, push, touched, loss, works, passing):
    """Apply contact forces to four ring modes after a step, as `end_rotor` does.

    Return y, d and the sums loss, works and passing.

    In the time of `works`, from step n - 1 to n + 1, a blade goes past the shape of
    step n - 1 from its place at that step to its place at n + 1, and so, at second
    order, by twice the way that `passing` gives at its place at step n.

    c, at : coefficients of all modes, packed, and where those of the four begin
    y, d : (re, im) of the amplitudes, and of their increments in this step
    passing : (re, im), rate at which the deformed ring passes the blades
    s, size, old : as s, old of `end_rotor`; number of modes, padded
    push, touched : as in `passes.push_ring`; whether the step had contact
    """
    if touched:
        cr, ci = push_ring(c, at, push)
        y, d = (y[0] + cr, y[1] + ci), (d[0] + cr, d[1] + ci)
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


@inlined
def book_passing(sums, k, col, push, passing):
    """Add the power of contact forces moved along the deformed ring, W, to sums[3 k:].

    The entries are those of four nodal diameters, col .. col + 3.

    push, passing : (re, im) of the multipliers' spectrum; see `end_ring`
    """
    carried = fma(push[1], passing[1], load(sums, 3 * k + col))
    store(sums, 3 * k + col, fma(push[0], passing[0], carried))


@inlined
def rotor_columns(s, c, lam, rows, width, now, then, ended, touched, out, sums,
                  slip):  # fmt: skip
    """Predict the next step of all modes of a rotor, after contact forces, if any.

    Arguments not listed are those of `differences.rotor_columns`.

    ended, touched : whether the last step is still to be completed; had contact
    """
    for col in range(0, width, FOUR):
        zero = broadcast(0.0)
        push, loss = load_both(lam, width, col), load(sums, 2 * width + col)
        spectrum, works = zero, (zero, zero, zero)
        for f in range(rows):
            m = f * width + col
            at = m * ITEMS
            q, d = load(s, m), load(s, now + m)
            if ended:
                q, d, loss, works = end_rotor(
                    c, at, q, d, s, then + m, push, touched, loss, works
                )
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
def ring_columns(s, c, lam, filled, k, now, then, ended, touched, out, sums,
                 slip):  # fmt: skip
    """Predict the next step of all modes of the ring, after contact forces, if any.

    Arguments not listed are those of `differences.ring_columns`.

    ended, touched : as in `rotor_columns`
    """
    size = len(s) // RING_STATE
    for col in range(0, k, FOUR):
        zero = broadcast(0.0)
        push, loss = load_both(lam, k, col), load(sums, 2 * k + col)
        real, imag, works, passing = zero, zero, (zero, zero, zero, zero), (zero, zero)
        for r in range(filled[col // FOUR]):
            m = r * k + col
            at = m * ITEMS
            y, d = load_both(s, size, m), load_both(s, size, now + m)
            if ended:
                y, d, loss, works, passing = end_ring(
                    c, at, y, d, s, size, then + m, push, touched, loss, works, passing
                )
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
            book_passing(sums, k, col, push, passing)
            keep_slip(slip, k, col, works)
        store_both(out, k, col, (real, imag))


@verb
def pass_rotor(rotor, s, lam, rows, k, counter, out, sums, slip):
    """Apply contact forces of the last step, if any, to a rotor; predict its next step.

    Arguments are those of `differences.pass_modes`.
    """


@does(pass_rotor, CyclicRotor)
@inlined
def pass_cyclic(rotor, s, lam, rows, k, counter, out, sums, slip):
    """Apply the last contact forces to the rotor's modes; predict their next step.

    The implementation of `pass_rotor` for equal sectors, with modes by nodal diameter.
    Arguments are those of `differences.pass_modes`.
    """
    c, width = rotor.items, 2 * k
    now, then = places(counter, rows * width)
    if counter[ENDED] == counter[STEP]:
        rotor_columns(s, c, lam, rows, width, now, then, False, False, out, sums, slip)
    elif counter[LAST] == counter[STEP]:
        rotor_columns(s, c, lam, rows, width, now, then, True, True, out, sums, slip)
    else:
        rotor_columns(s, c, lam, rows, width, now, then, True, False, out, sums, slip)


@inlined
def pass_ring(s, c, lam, filled, k, counter, out, sums, slip):
    """Apply the last step's contact forces, if any, to the ring; predict the next step.

    See `differences.pass_ring`; the fourth part of sums (4 k,) is that of
    `book_passing`. There are k slots, one for each nodal diameter, padded.
    """
    now, then = places(counter, len(s) // RING_STATE * 2)
    if counter[ENDED] == counter[STEP]:
        ring_columns(s, c, lam, filled, k, now, then, False, False, out, sums, slip)
    elif counter[LAST] == counter[STEP]:
        ring_columns(s, c, lam, filled, k, now, then, True, True, out, sums, slip)
    else:
        ring_columns(s, c, lam, filled, k, now, then, True, False, out, sums, slip)


@verb
def end_step(rotor, s_b, t_b, s_c, t_c, c_c, lam, counter, sums_b, sums_c):
    """Copy the states of rotor and ring; apply the last contact forces to the copies.

    States s_b of the rotor, s_c of the casing ring are copied to t_b, t_c. If the last
    step is not yet completed, its works and losses are added to sums_b, sums_c, J.

    c_c, lam : coefficients of the ring's modes; spectrum of the multipliers
    """


@does(end_step, CyclicRotor)
@kernel
def end_cyclic(rotor, s_b, t_b, s_c, t_c, c_c, lam, counter, sums_b, sums_c):
    """Copy the states of both bodies; apply the last contact forces to the copies.

    The implementation of `end_step`, which explains the arguments, for equal sectors,
    with modes by nodal diameter.
    """
    settle_rotor(s_b, t_b, rotor.items, lam, counter, sums_b)
    settle_ring(s_c, t_c, c_c, lam, counter, sums_c)


@inlined
def waiting(counter):
    """Return two flags: the last step is still to be completed; it had contact."""
    ended, touched = counter[ENDED] != counter[STEP], counter[LAST] == counter[STEP]
    return ended, touched and ended


@inlined
def settle_rotor(s, t, c, lam, counter, sums):
    """Copy the rotor's state s to t; apply the last contact forces to t.

    Works and losses of that step are added to sums, J.

    c, lam : coefficients of the modes, packed; spectrum of the multipliers
    """
    ended, touched = waiting(counter)
    size, width, zero = len(s) // ROTOR_STATE, len(sums) // 3, broadcast(0.0)
    now, then = places(counter, size)
    for col in range(0, width, FOUR):
        push, loss = load_both(lam, width, col), load(sums, 2 * width + col)
        works = zero, zero, zero
        for m in range(col, size, width):
            q, d = load(s, m), load(s, now + m)
            if ended:
                q, d, loss, works = end_rotor(
                    c, m * ITEMS, q, d, s, then + m, push, touched, loss, works
                )
            store(t, m, q)
            store(t, now + m, d)
        store(sums, 2 * width + col, loss)
        if touched:
            book_rotor(sums, width, col, push, works)


@inlined
def settle_ring(s, t, c, lam, counter, sums):
    """Copy the casing ring's state s to t; apply the last contact forces to t.

    Works and losses of that step are added to sums, J.

    c, lam : coefficients of the modes, packed; spectrum of the multipliers
    """
    ended, touched = waiting(counter)
    size, k, zero = len(s) // RING_STATE, len(sums) // 4, broadcast(0.0)
    now, then = places(counter, 2 * size)
    for col in range(0, k, FOUR):
        push, loss = load_both(lam, k, col), load(sums, 2 * k + col)
        works, passing = (zero, zero, zero, zero), (zero, zero)
        for m in range(col, size, k):
            y, d = load_both(s, size, m), load_both(s, size, now + m)
            if ended:
                y, d, loss, works, passing = end_ring(
                    c, m * ITEMS, y, d, s, size, then + m, push, touched, loss, works,
                    passing,
                )  # fmt: skip
            store_both(t, size, m, y)
            store_both(t, size, now + m, d)
        store(sums, 2 * k + col, loss)
        if touched:
            book_ring(sums, k, col, push, works)
            book_passing(sums, k, col, push, passing)


@rare
def energy_of(s, c, place, increment, size):
    """Return the energy of `size` modes of a body, J, at the end of a step.

    s, c : state of the body; coefficients of its modes, packed
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


@rare
def energy_of_ring(t, c, now):
    """Return the energy of the casing ring, J, from a state t without pending forces.

    now : step number mod 2
    c : coefficients of the ring's modes, packed
    """
    n = len(t) // RING_STATE
    at = 2 * n * (1 + now)
    return energy_of(t, c, n - n, at, n) + energy_of(t, c, n, at + n, n)


@verb
def energies_of(rotor, t_b, t_c, c_c, now, step):
    """Return energies of rotor and casing ring, J, from states without pending forces.

    now : step number mod 2, by which the state has the increments of this step
    t_b, t_c : states of rotor and ring; c_c : coefficients of the ring's modes
    """


@does(energies_of, CyclicRotor)
@rare_kernel
def energies_of_modes(rotor, t_b, t_c, c_c, now, _):
    """Return the energies of a rotor's modes and of the ring, J, from their states.

    Arguments are those of `energies_of`, of which this is one implementation.
    """
    m, ring = len(t_b) // ROTOR_STATE, energy_of_ring(t_c, c_c, now)
    return energy_of(t_b, rotor.items, m - m, (1 + now) * m, m), ring


@rare_kernel
def column_sums(sums_b, sums_c, step):
    """Return works, J, so far: of rotation, impact, friction over mu, and damping.

    The rotation's work is that of contact forces moved along the deformed ring; the
    impact loss is the remaining work of the normal forces.

    sums_b, sums_c : works and losses by slot of rotor and ring, see `pass_ring`
    """
    n = len(sums_c) // 4
    normal, drag, loss = sums_of(sums_b, sums_c)
    carried = -step * sum_of(sums_c, 3 * n, 4 * n)
    return carried, carried - normal, drag, loss
