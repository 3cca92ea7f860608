"""The pass over all modes in a time step, for central differences and the exact flow.

Once a step, the time loop passes over the amplitudes of rotor and ring: it completes
the last step (applies its contact forces, adds its works and losses) and predicts the
next one without contact forces, see `passes`. The two schemes differ in how a step
ends, which the type of the argument `way` chooses when a kernel is compiled:
`differences.CENTRAL` or `flow.EXACT`. Functions named settle or end_step complete the
last step alone, in copies of the states: for samples, and before a jump.
"""

from __future__ import annotations

from hpcwhirl.dynamics.kernels.compiled import (
    does,
    inlined,
    kernel,
    rare_kernel,
    verb,
)
from hpcwhirl.dynamics.kernels.contact import ENDED, LAST, STEP
from hpcwhirl.dynamics.kernels.passes import (
    ITEMS,
    RADIAL,
    RING_STATE,
    ROTOR_STATE,
    ahead_ring,
    ahead_rotor,
    book_ring,
    book_rotor,
    holds,
    keep_slip,
    load_both,
    places,
    store_both,
)
from hpcwhirl.dynamics.kernels.vectors import FOUR, broadcast, fma, load, store
from hpcwhirl.dynamics.kernels.wave_types import CyclicRotor


@verb
def is_exact(way):
    """Return whether the steps of a march are those of the exact flow.

    way : `differences.CENTRAL` or `flow.EXACT`
    """


@verb
def end_rotor(way, c, at, q, d, s, old, push, touched, loss, works):
    """End a step of four rotor modes: apply contact forces, add works and losses.

    Return q, d, loss and works, after contact: the sums `loss` (damping loss, J) and
    `works` (see `passes.work_rotor`) then include these modes.

    way : `differences.CENTRAL` or `flow.EXACT`
    c, at : coefficients of all modes, packed, and the index in c at which those of the
        four begin
    q, d : amplitudes without contact, and their increments in this step
    s, old : state of the rotor, and the index in it of the increments in the step
        before
    push, touched : spectrum of the multipliers, N, as in `passes.push_rotor`; whether
        the step had contact
    """


@verb
def end_ring(way, c, at, y, d, s, size, old, push, touched, loss, works, passing):
    """End a step of four ring modes: apply contact forces, add works and losses.

    Return y, d and the sums loss, works and passing, all after contact.

    y, d : (re, im) of the amplitudes without contact, and of their increments in this
        step
    s, size, old : state of the ring; its number of modes, padded; index in s of the
        real parts of the increments in the step before
    push, touched : (re, im) of the multipliers' spectrum, N; whether the step had
        contact
    loss, works : damping loss so far, J; sums of `passes.work_ring`
    passing : (re, im), m/s, sum over the modes of a nodal diameter: rate at which the
        ring's radius changes at the blades, since they move past it; 0 for central
        differences
    """


@inlined
def book_passing(sums, k, col, push, passing):
    """Add the power of contact forces moved along the deformed ring, W, to sums[3 k:].

    The power of four nodal diameters, col .. col + 3, is added to their entries; only
    the exact flow uses it.

    sums, k : (4 k,), works and losses of the ring; number of nodal diameters, padded
    push, passing : (re, im) of the multipliers' spectrum, N; (re, im), m/s, as in
        `end_ring`
    """
    carried = fma(push[1], passing[1], load(sums, 3 * k + col))
    store(sums, 3 * k + col, fma(push[0], passing[0], carried))


@inlined
def book_ring_of(way, sums, k, col, push, works, passing):
    """Add twice a step's works of contact, J, to the ring's sums, at four diameters.

    way : of the exact flow, `book_passing` is also called
    sums, k, col : (4 k,), works and losses of the ring; number of nodal diameters,
        padded; the first of the four
    push, works, passing : (re, im) of the multipliers' spectrum, N; sums of `end_ring`
    """
    book_ring(sums, k, col, push, works)
    if is_exact(way):
        book_passing(sums, k, col, push, passing)


@inlined
def rotor_columns(way, s, c, lam, rows, width, now, then, waits, touched, out, sums,
                  slip):  # fmt: skip
    """Complete the last step of all rotor modes, predict the next, compute their gaps.

    Arguments not listed are those of `pass_modes`.

    now, then : first indices in s of the last step's increments, and of the increments
        before these, which the next step's replace
    waits, touched : whether the last step is still to be completed; whether it had
        contact
    """
    for col in range(0, width, FOUR):
        zero = broadcast(0.0)
        push, loss = load_both(lam, width, col), load(sums, 2 * width + col)
        spectrum, works = zero, (zero, zero, zero)
        for f in range(rows):
            m = f * width + col
            at = m * ITEMS
            q, d = load(s, m), load(s, now + m)
            if waits:
                q, d, loss, works = end_rotor(
                    way, c, at, q, d, s, then + m, push, touched, loss, works
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
def ring_columns(way, s, c, lam, filled, k, now, then, waits, touched, out, sums,
                 slip):  # fmt: skip
    """Complete the last step of all ring modes, predict the next, compute their gaps.

    Arguments not listed are those of `pass_ring`.

    now, then : first indices in s of the last step's increments, and of the increments
        before these, which the next step's replace
    waits, touched : whether the last step is still to be completed; whether it had
        contact
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
            if waits:
                y, d, loss, works, passing = end_ring(
                    way, c, at, y, d, s, size, then + m, push, touched, loss, works,
                    passing,
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
            book_ring_of(way, sums, k, col, push, works, passing)
            keep_slip(slip, k, col, works)
        store_both(out, k, col, (real, imag))


@inlined
def is_ended(way, counter):
    """Return whether the last step is complete: contact applied, losses entered.

    That is so after a jump of the exact flow, else not.

    counter : counters of the march, see `contact`
    """
    return is_exact(way) and counter[ENDED] == counter[STEP]


@verb
def pass_rotor(rotor, way, s, lam, rows, k, counter, out, sums, slip):
    """Complete the last step of a rotor, and predict its next step without contact.

    way : `differences.CENTRAL` or `flow.EXACT`
    s, out : state, in and out; (2 k,), m, out: spectrum of the rotor's part of the gaps
    rows, k : number of modes or waves of a nodal diameter; of nodal diameters, padded
    lam, counter, sums, slip : as in `pass_modes`
    """


@inlined
def pass_modes(way, s, c, lam, rows, width, counter, out, sums, slip):
    """Complete the last step of a rotor's modes; predict the next one without contact.

    Parameters
    ----------
    way : `differences.CENTRAL` or `flow.EXACT`
    s : (3 rows width,), state: amplitudes q, their increments in the last even step,
        and those in the last odd step
    c : coefficients of the modes, packed as `passes` explains
    lam : (2 width,), N, spectrum of the last step's multipliers as (re, im), then as
        (im, -re)
    counter : counters of the march: number of the last step, and of the last with
        contact
    rows, width : the state has `rows` rows of `width` real numbers: re, then im, of one
        mode of each nodal diameter
    out : (width,), m, out: spectrum of the rotor's part of the gaps, for each nodal
        diameter the sum over its modes of q times the gap for unit q
    sums : (3 width,), in and out, J, for re and im of each nodal diameter: twice the
        work of normal forces, twice that of friction over mu, damping loss
    slip : (2 width,), m, out after a step with contact: factors of the multipliers in
        the work of friction, from which `passes.slip_of` computes the slip
    """
    now, then = places(counter, rows * width)
    if is_ended(way, counter):
        rotor_columns(
            way, s, c, lam, rows, width, now, then, False, False, out, sums, slip
        )
    elif counter[LAST] == counter[STEP]:
        rotor_columns(
            way, s, c, lam, rows, width, now, then, True, True, out, sums, slip
        )
    else:
        rotor_columns(
            way, s, c, lam, rows, width, now, then, True, False, out, sums, slip
        )


@does(pass_rotor, CyclicRotor)
@inlined
def pass_cyclic(rotor, way, s, lam, rows, k, counter, out, sums, slip):
    """Complete the last step of a rotor's modes; predict the next one without contact.

    The implementation of `pass_rotor` for equal sectors, with modes by nodal diameter.
    Arguments are those of `pass_modes`, with k = width / 2.
    """
    pass_modes(way, s, rotor.items, lam, rows, 2 * k, counter, out, sums, slip)


@inlined
def pass_ring(way, s, c, lam, filled, k, counter, out, sums, slip):
    """Complete the last step of the ring's modes; predict the next without contact.

    way : `differences.CENTRAL` or `flow.EXACT`
    s : (6 size,), state: re and im of the amplitudes, then of their increments in the
        last even step, and in the last odd step
    c : coefficients of the modes, packed as `passes` explains
    lam : (2 k,) or longer, N: re, then im, of the spectrum of the last step's
        multipliers
    filled, k : (k/4,), number of rows that have modes, for each group of four nodal
        diameters; number of nodal diameters, padded
    out : (2 k,), m, out: re and im of the spectrum of the ring's part of the gaps
    sums, slip : (4 k,), (2 k,), as in `pass_modes`; the fourth part of sums is that of
        `book_passing`
    """
    now, then = places(counter, len(s) // RING_STATE * 2)
    if is_ended(way, counter):
        ring_columns(
            way, s, c, lam, filled, k, now, then, False, False, out, sums, slip
        )
    elif counter[LAST] == counter[STEP]:
        ring_columns(way, s, c, lam, filled, k, now, then, True, True, out, sums, slip)
    else:
        ring_columns(way, s, c, lam, filled, k, now, then, True, False, out, sums, slip)


@inlined
def waiting(way, counter):
    """Return two flags: the last step is still to be completed; it also had contact.

    Both are False if the step has been completed already, as by a jump.
    """
    waits = not is_ended(way, counter)
    return waits, waits and counter[LAST] == counter[STEP]


@inlined
def settle_rotor(way, s, t, c, lam, counter, sums):
    """Copy the rotor's state s to t; apply the last step's contact forces to t.

    The works and the damping loss of this step are added to sums (3 width,), J.

    way, c, lam, counter : as in `pass_modes`
    """
    waits, touched = waiting(way, counter)
    size, width, zero = len(s) // ROTOR_STATE, len(sums) // 3, broadcast(0.0)
    now, then = places(counter, size)
    for col in range(0, width, FOUR):
        push, loss = load_both(lam, width, col), load(sums, 2 * width + col)
        works = zero, zero, zero
        for m in range(col, size, width):
            q, d = load(s, m), load(s, now + m)
            if waits:
                q, d, loss, works = end_rotor(
                    way, c, m * ITEMS, q, d, s, then + m, push, touched, loss, works
                )
            store(t, m, q)
            store(t, now + m, d)
        store(sums, 2 * width + col, loss)
        if touched:
            book_rotor(sums, width, col, push, works)


@inlined
def settle_ring(way, s, t, c, lam, counter, sums):
    """Copy the casing ring's state s to t; apply the last step's contact forces to t.

    The works and the damping loss of this step are added to sums (4 k,), J.

    t : must be 0 at places without modes, which are not copied
    way, c, lam, counter : as in `pass_ring`
    """
    waits, touched = waiting(way, counter)
    size, k, zero = len(s) // RING_STATE, len(sums) // 4, broadcast(0.0)
    now, then = places(counter, 2 * size)
    for col in range(0, k, FOUR):
        push, loss = load_both(lam, k, col), load(sums, 2 * k + col)
        works, passing = (zero, zero, zero, zero), (zero, zero)
        for m in range(col, size, k):
            if holds(c, m):
                y, d = load_both(s, size, m), load_both(s, size, now + m)
                if waits:
                    y, d, loss, works, passing = end_ring(
                        way, c, m * ITEMS, y, d, s, size, then + m, push, touched, loss,
                        works, passing,
                    )  # fmt: skip
                store_both(t, size, m, y)
                store_both(t, size, now + m, d)
        store(sums, 2 * k + col, loss)
        if touched:
            book_ring_of(way, sums, k, col, push, works, passing)


@verb
def end_step(rotor, way, s_b, t_b, s_c, t_c, c_c, lam, counter, sums_b, sums_c):
    """Copy the states of rotor and ring; complete the last step in the copies.

    The last step's contact forces are applied to the copies, and its works and losses
    are added to sums_b, sums_c, J, unless the step has been completed before.

    way : `differences.CENTRAL` or `flow.EXACT`
    s_b, t_b : state of the rotor, and its copy, which may be the same array
    s_c, t_c : state of the casing ring, and its copy, likewise
    c_c, lam : coefficients of the ring's modes, packed; N, spectrum of the multipliers
    counter : counters of the march, see `contact`
    """


@does(end_step, CyclicRotor)
@kernel
def end_cyclic(rotor, way, s_b, t_b, s_c, t_c, c_c, lam, counter, sums_b, sums_c):
    """Copy the states of rotor and ring; complete the last step in the copies.

    The implementation of `end_step`, which explains the arguments, for equal sectors,
    with modes by nodal diameter.
    """
    settle_rotor(way, s_b, t_b, rotor.items, lam, counter, sums_b)
    settle_ring(way, s_c, t_c, c_c, lam, counter, sums_c)


@verb
def energy_of(way, s, c, place, increment, size, step):
    """Return the energy of `size` modes of a body, J, after a step.

    s, c : state of the body, after the step's contact forces; coefficients of its
        modes, packed
    place, increment : first index in s of the amplitudes, and of their increments in
        the step that has ended
    step : dt, s
    """


@verb
def energy_of_ring(way, t, c, now, step):
    """Return the energy of the casing ring's modes, J, after a step.

    t : (6 size,), state of the ring, after the step's contact forces
    c : coefficients of the ring's modes, packed
    now : 0 or 1, whether the step's number is even or odd: selects its increments in t
    step : dt, s
    """


@verb
def energies_of(rotor, way, t_b, t_c, c_c, now, step):
    """Return the energies of rotor and casing ring, J, after a step: two numbers.

    t_b, t_c : states of rotor and ring, after the step's contact forces
    c_c : coefficients of the ring's modes, packed
    now : 0 or 1, whether the step's number is even or odd: selects its increments in
        the states
    step : dt, s
    """


@does(energies_of, CyclicRotor)
@rare_kernel
def energies_of_modes(rotor, way, t_b, t_c, c_c, now, step):
    """Return the energies of a rotor's modes and of the casing ring, J, after a step.

    The implementation of `energies_of`, which explains the arguments.
    """
    m, ring = len(t_b) // ROTOR_STATE, energy_of_ring(way, t_c, c_c, now, step)
    return energy_of(way, t_b, rotor.items, m - m, (1 + now) * m, m, step), ring


@verb
def column_sums(way, sums_b, sums_c, step):
    """Return four works so far, J: of rotation, impact, friction over mu, and damping.

    sums_b, sums_c : works and losses by nodal diameter, of rotor and ring: the arrays
        `sums` of `pass_modes` and `pass_ring`
    step : dt, s
    """
