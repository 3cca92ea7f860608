"""A rotor of unequal sectors as waves that rotation leaves apart, in `general`'s loop.

Each wave of the whole rotor has a complex amplitude that a step turns, a' = z a. Their
real and imaginary parts are real amplitudes q (m,), re then im, of which tips are read
as of modes. The multipliers lambda act at once: q += beta lambda; they stand behind q
in the state, s = (q, lambda), so that a row times s is what a step with contact moves,
or what it adds to energy and loss, see `dynamics.whole_waves`.

As in `waves` the rotor's loss is what contact has added to energy and loss, less the
energy that is left.
"""

from __future__ import annotations

from hpcwhirl.dynamics.kernels.compiled import inlined, kernel, rare, rare_kernel
from hpcwhirl.dynamics.kernels.contact import note_slip
from hpcwhirl.dynamics.kernels.differences import energy_of_ring, settle_ring
from hpcwhirl.dynamics.kernels.passes import (
    copy_to,
    load_both,
    store_both,
    total_of,
)
from hpcwhirl.dynamics.kernels.vectors import FOUR, broadcast, fma, fnma, load, store

EIGHT = 2 * FOUR  # modes and folded blades are padded to this


@inlined
def turn_waves(q, ahead):
    """Take a step without forces; q : (m,) or more, ahead : (m,), z - 1."""
    half = len(ahead) // 2
    for m in range(0, half, FOUR):
        re, im = load_both(q, half, m)
        a, b = load_both(ahead, half, m)
        real, imag = fnma(b, im, fma(a, re, re)), fma(b, re, fma(a, im, im))
        store_both(q, half, m, (real, imag))


@inlined
def push_waves(push, where, active, rotor, s, sums, slip):
    """Add what the multipliers do to the amplitudes, and book their works.

    Parameters
    ----------
    push, where : of `circulant.solved`
    s : (m + padded,), state: amplitudes, multipliers of the last step with contact
    sums : (3,): works of normal forces and of drag (twice, over mu), and what contact
        has added to energy and loss, J
    slip : (N,), out, of the active blades: d' + d of a tip's place along the casing
    """
    modes, width = len(rotor.ahead), len(s)
    for i in range(modes, width):
        s[i] = 0.0
    for i in range(active):
        s[modes + where[i]] = push[i]
    for i in range(active):
        at, zero = where[i] * width, broadcast(0.0)
        a, b, c, d, e, f = zero, zero, zero, zero, zero, zero
        for m in range(0, width, EIGHT):
            x, y = load(s, m), load(s, m + FOUR)
            a = fma(load(rotor.opens, at + m), x, a)
            b = fma(load(rotor.opens, at + m + FOUR), y, b)
            c = fma(load(rotor.slides, at + m), x, c)
            d = fma(load(rotor.slides, at + m + FOUR), y, d)
            e = fma(load(rotor.adds, at + m), x, e)
            f = fma(load(rotor.adds, at + m + FOUR), y, f)
        slip[where[i]] = total_of(c + d)
        sums[0] += push[i] * total_of(a + b)
        sums[1] += push[i] * slip[where[i]]
        sums[2] += push[i] * total_of(e + f)
    for m in range(0, modes, EIGHT):
        x, y = load(s, m), load(s, m + FOUR)
        for i in range(active):
            at, force = where[i] * modes + m, broadcast(push[i])
            x = fma(load(rotor.push, at), force, x)
            y = fma(load(rotor.push, at + FOUR), force, y)
        store(s, m, x)
        store(s, m + FOUR, y)


@rare
def note_slips_of_waves(slip_b, slip_c, turns, known, last, step, counted, ledger):
    """Note the slip of each blade in contact in the step `counted`, which has ended.

    slip_b : (N,), of `push_waves`; slip_c : (2 k,), see `passes.slip_of`
    """
    width = len(slip_c)
    for s in range(known[len(last)]):
        j = known[s]
        if last[j] == counted:
            ring = broadcast(0.0)
            for c in range(0, width, FOUR):
                ring = fma(load(turns, j * width + c), load(slip_c, c), ring)
            note_slip(slip_b[j] + total_of(ring), step, ledger)


@kernel
def settle_whole(c_c, state, copies):
    """Set copies of bodies and sums, as `general.settle_general`: the ring waits."""
    t_b, t_c, end_b, end_c = copies
    copy_to(t_b, state.rotor)
    copy_to(end_b, state.sums_b)
    copy_to(end_c, state.sums_c)
    k = len(end_c) // 4
    lam = state.lam[len(state.lam) - 4 * k :]
    settle_ring(state.ring, t_c, c_c, lam, k, state.counter, end_c)


@rare_kernel
def energies_of_whole(t_b, rotor, t_c, c_c, now, step):
    """Return the energies of rotor and ring from ended states, J; now : 0 or 1."""
    modes, at, own = len(rotor.ahead), 0, broadcast(0.0)
    for i in range(modes):
        first, row = i - i % FOUR, broadcast(0.0)
        for m in range(first, modes, FOUR):
            row = fma(load(rotor.form, at + m - first), load(t_b, m), row)
        own = fma(broadcast(t_b[i]), row, own)
        at += modes - first
    return total_of(own), energy_of_ring(t_c, c_c, now, step)
