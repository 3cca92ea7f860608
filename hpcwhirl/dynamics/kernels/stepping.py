"""A pass over rotor and ring, for central differences and for the exact flow.

Both complete the last step, with works and losses, and predict the next, see `passes`.
They differ in how a step ends, which is chosen by the type of the argument `way` when a
kernel is compiled: `differences.CENTRAL` or `flow.EXACT`. With the exact flow no step
is pending after a jump, and the ring's sums have a fourth part.
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
from hpcwhirl.dynamics.kernels.wave_types import CyclicRotor, GeneralRotor


@verb
def is_exact(way):
    """Return whether steps are those of the exact flow."""


@verb
def end_rotor(way, c, at, q, d, s, old, push, touched, loss, works):
    """Apply contact forces to four rotor modes after a step; return q, d, loss, works.

    The sums `loss`, J, and `works`, see `passes.work_rotor`, include these modes then.

    c, at : coefficients of all modes, packed, and where those of these four begin
    q, d : amplitudes, and their increments in this step
    s, old : state, and index in it of their increments in the step before
    push, touched : as in `passes.push_rotor`; whether the step had contact
    """


@verb
def end_ring(way, c, at, y, d, s, size, old, push, touched, loss, works, passing):
    """Apply contact forces to four ring modes after a step, as `end_rotor` does.

    Return y, d and the sums loss, works and passing.

    y, d : (re, im) of the amplitudes, and of their increments in this step
    s, size, old : as s, old of `end_rotor`; number of modes, padded
    push, touched : as in `passes.push_ring`; whether the step had contact
    passing : (re, im), rate at which the deformed ring passes the blades; 0 for central
        differences
    """


@inlined
def book_passing(sums, k, col, push, passing):
    """Add the power of contact forces moved along the deformed ring, W, to sums[3 k:].

    The entries are those of four nodal diameters, col .. col + 3.

    push, passing : (re, im) of the multipliers' spectrum; see `end_ring`
    """
    carried = fma(push[1], passing[1], load(sums, 3 * k + col))
    store(sums, 3 * k + col, fma(push[0], passing[0], carried))


@inlined
def book_ring_of(way, sums, k, col, push, works, passing):
    """Add twice the works of contact at four nodal diameters to the ring's sums, J.

    way, passing : of the exact flow also the power in `passing` is added
    """
    book_ring(sums, k, col, push, works)
    if is_exact(way):
        book_passing(sums, k, col, push, passing)


@inlined
def rotor_columns(way, s, c, lam, rows, width, now, then, waits, touched, out, sums,
                  slip):  # fmt: skip
    """Predict the next step of all modes of a rotor, after contact forces, if any.

    Arguments not listed are those of `pass_modes`.

    now, then : results of `passes.places`
    waits, touched : whether the last step is still to be completed; had contact
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
    """Predict the next step of all modes of the ring, after contact forces, if any.

    Arguments not listed are those of `pass_ring`.

    now, then, waits, touched : as in `rotor_columns`
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
    """Return whether the last step has been completed already, as by a jump."""
    return is_exact(way) and counter[ENDED] == counter[STEP]


@verb
def pass_rotor(rotor, way, s, lam, rows, k, counter, out, sums, slip):
    """Apply contact forces of the last step, if any, to a rotor; predict its next step.

    Arguments are those of `pass_modes`.
    """


@inlined
def pass_modes(way, s, c, lam, rows, width, counter, out, sums, slip):
    """Apply the last step's contact forces to a rotor's modes; predict the next step.

    Parameters
    ----------
    way : `differences.CENTRAL` or `flow.EXACT`
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
    """Apply the last contact forces to the rotor's modes; predict their next step.

    The implementation of `pass_rotor` for equal sectors, with modes by nodal diameter.
    Arguments are those of `pass_modes`.
    """
    pass_modes(way, s, rotor.items, lam, rows, 2 * k, counter, out, sums, slip)


@inlined
def pass_ring(way, s, c, lam, filled, k, counter, out, sums, slip):
    """Apply the last step's contact forces to the casing ring; predict the next step.

    way : `differences.CENTRAL` or `flow.EXACT`
    s : (6 size,): re and im of the amplitudes, then of their increments in the last
        even step, and in the last odd step
    lam, filled : re, im of the multipliers in its first 2 k; see `passes.filled_rows`
    out : (2 k,), re and im of the spectrum of the ring's part of the gaps, m
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
    """Return two flags: the last step is still to be completed; it had contact."""
    waits = not is_ended(way, counter)
    return waits, waits and counter[LAST] == counter[STEP]


@inlined
def settle_rotor(way, s, t, c, lam, counter, sums):
    """Copy the rotor's state s to t; apply the last step's contact forces to t.

    The works and the loss of this step are added to sums, J.

    way, c, lam : as in `pass_modes`
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

    The works and the loss of this step are added to sums, J.

    t : must be 0 at slots without modes, which are not copied
    way, c, lam : as in `pass_ring`
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
    """Copy the states of rotor and ring; apply the last contact forces to the copies.

    States s_b of the rotor, s_c of the casing ring are copied to t_b, t_c. If the last
    step is not yet completed, its works and losses are added to sums_b, sums_c, J.

    way : `differences.CENTRAL` or `flow.EXACT`
    c_c, lam : coefficients of the ring's modes; spectrum of the multipliers
    """


@does(end_step, CyclicRotor)
@kernel
def end_cyclic(rotor, way, s_b, t_b, s_c, t_c, c_c, lam, counter, sums_b, sums_c):
    """Copy the states of both bodies; apply the last contact forces to the copies.

    The implementation of `end_step`, which explains the arguments, for equal sectors,
    with modes by nodal diameter.
    """
    settle_rotor(way, s_b, t_b, rotor.items, lam, counter, sums_b)
    settle_ring(way, s_c, t_c, c_c, lam, counter, sums_c)


@verb
def energy_of(way, s, c, place, increment, size, step):
    """Return the energy of `size` modes of a body, J, after a step.

    s, c : state of the body; coefficients of its modes, packed
    place, increment : first index in s of the amplitudes, and of their increments in
        the step that has ended
    """


@verb
def energy_of_ring(way, t, c, now, step):
    """Return the energy of the casing ring, J, from a state t without pending forces.

    now : step number mod 2
    c : coefficients of the ring's modes, packed
    """


@verb
def energies_of(rotor, way, t_b, t_c, c_c, now, step):
    """Return energies of rotor and casing ring, J, from states without pending forces.

    now : step number mod 2, by which the state has the increments of this step
    t_b, t_c : states of rotor and ring; c_c : coefficients of the ring's modes
    """


@does(energies_of, GeneralRotor)
@does(energies_of, CyclicRotor)
@rare_kernel
def energies_of_modes(rotor, way, t_b, t_c, c_c, now, step):
    """Return the energies of a rotor's modes and of the ring, J, from their states.

    Arguments are those of `energies_of`, of which this is one implementation.
    """
    m, ring = len(t_b) // ROTOR_STATE, energy_of_ring(way, t_c, c_c, now, step)
    return energy_of(way, t_b, rotor.items, m - m, (1 + now) * m, m, step), ring


@verb
def column_sums(way, sums_b, sums_c, step):
    """Return works, J, so far: of rotation, impact, friction over mu, and damping.

    sums_b, sums_c : works and losses by slot of rotor and ring, see `pass_modes` and
        `pass_ring`
    """
