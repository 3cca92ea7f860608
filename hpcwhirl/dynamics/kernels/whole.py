"""A rotor of unequal sectors as waves that rotation leaves apart, in `general`'s loop.

Each wave of the whole rotor has a complex amplitude that a step turns, a' = z a. Their
real and imaginary parts are real amplitudes q (m,), re then im, of which tips are read
as of modes. The multipliers lambda act at once: q += beta lambda; they stand behind q
in the state, s = (q, lambda), so that a row times s is what a step with contact moves,
or what it adds to energy and loss, see `dynamics.whole_waves`.

Tips are read where they might touch: a sum over the waves bounds how far any moves in a
step. Where the blades of the last solution hold the gaps of those that were not read
open, by these bounds, they hold them open; else all are read. So it changes no bit
which tips are read when.

As in `waves` the rotor's loss is what contact has added to energy and loss, which is
its work (`whole_waves.WholeWaves.books` has that checked), less the energy that is
left.
"""

from __future__ import annotations

import math

from hpcwhirl.dynamics.kernels.circulant import place_of
from hpcwhirl.dynamics.kernels.compiled import inlined, kernel, rare, rare_kernel
from hpcwhirl.dynamics.kernels.contact import note_slip
from hpcwhirl.dynamics.kernels.differences import energy_of_ring, settle_ring
from hpcwhirl.dynamics.kernels.passes import (
    copy_to,
    load_both,
    store_both,
    total_of,
)
from hpcwhirl.dynamics.kernels.vectors import (
    FOUR,
    broadcast,
    element,
    fma,
    fnma,
    higher_of,
    load,
    lower_of,
    store,
)

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
def lowest_with(tips, gaps, row):
    """Return the lowest of a row of gaps with tips (2 wide,), m."""
    least = load(gaps, row) + load(tips, 0)
    for v in range(FOUR, len(tips), FOUR):
        least = lower_of(least, load(gaps, row + v) + load(tips, v))
    lowest = element(least, 0)
    for i in range(1, FOUR):
        lowest = min(lowest, element(least, i))
    return lowest


@inlined
def tip_by_waves(rows, blade, q, modes):
    """Return row `blade` of rows (N, modes) flat, times the first of q.

    modes : a multiple of 16
    """
    at, zero = blade * modes, broadcast(0.0)
    a, b, c, d = zero, zero, zero, zero
    for m in range(0, modes, 2 * EIGHT):
        a = fma(load(rows, at + m), load(q, m), a)
        b = fma(load(rows, at + m + 4), load(q, m + 4), b)
        c = fma(load(rows, at + m + 8), load(q, m + 8), c)
        d = fma(load(rows, at + m + 12), load(q, m + 12), d)
    return total_of((a + b) + (c + d))


@inlined
def put(values, blade, blades, wide, value):
    """Set the places of a blade among folded values (2 wide,), see `folded`."""
    values[place_of(blade, blades, wide)] = value
    if 2 * blade == blades:
        values[wide + blade] = value
    if blade == 0:
        values[wide] = value
        for i in range(blades // 2 + 1, wide):
            values[i] = value
            values[wide + i] = value


@inlined
def read_all(rows, q, blades, tips):
    """Set tips (2 wide,), folded, counted negative."""
    modes, wide = len(rows) // blades, len(tips) // 2
    for j in range(blades):
        put(tips, j, blades, wide, tip_by_waves(rows, j, q, modes))


@inlined
def open_whole(tips, gaps, row, whole):
    """Set whole (2 wide,) to a row of gaps with tips; return the lowest, m."""
    for v in range(0, len(tips), FOUR):
        store(whole, v, load(gaps, row + v) + load(tips, v))
    return lowest_with(tips, gaps, row)


@inlined
def read_near(rows, q, blades, gaps, row, away, known, tips, whole):
    """Read the tips that might touch; return (lowest of their gaps, whether, number).

    Parameters
    ----------
    gaps, row : without the rotor's part
    away : bound of how far tips have moved since they were read, m
    tips : (2 wide,), those that are read are set
    whole : (2 wide,), out: gaps, or lower bounds of those of other blades, > 0

    The second value tells whether all blades of the last solution, `known`, are read.
    """
    modes, wide, least = len(rows) // blades, len(tips) // 2, math.inf
    for v in range(0, len(tips), FOUR):
        store(whole, v, load(gaps, row + v) + load(tips, v) - broadcast(away))
    ready, count = known[blades] > 0, blades - blades
    for s in range(known[blades]):
        ready = ready and not whole[place_of(known[s], blades, wide)] > 0.0
    for j in range(blades):
        at = place_of(j, blades, wide)
        if not whole[at] > 0.0:
            tip = tip_by_waves(rows, j, q, modes)
            put(tips, j, blades, wide, tip)
            put(whole, j, blades, wide, gaps[row + at] + tip)
            least = min(least, whole[at])
            count += 1
    return least, ready, count


@inlined
def drift_of(q, drift):
    """Return a bound of how far a tip moves in each of the next steps, m.

    |a| <= max(|re|, |im|) + min(|re|, |im|) / 2
    """
    half, zero, total = len(drift), broadcast(0.0), broadcast(0.0)
    for m in range(0, half, FOUR):
        re, im = load_both(q, half, m)
        re, im = higher_of(re, zero - re), higher_of(im, zero - im)
        size = fma(broadcast(0.5), lower_of(re, im), higher_of(re, im))
        total = fma(load(drift, m), size, total)
    return total_of(total)


@inlined
def yield_apart(push, where, active, opening, ring, gaps, row, tips):
    """Add what the multipliers open by the ring to a row of gaps, the rest to tips.

    opening, ring : (N, 2 wide) flat, folded, by rotor and ring, and by the ring alone
    """
    width = len(tips)
    for v in range(0, width, FOUR):
        beside, tip = load(gaps, row + v), load(tips, v)
        for i in range(active):
            at, force = where[i] * width + v, broadcast(push[i])
            both, alone = load(opening, at), load(ring, at)
            beside, tip = fma(alone, force, beside), fma(both - alone, force, tip)
        store(gaps, row + v, beside)
        store(tips, v, tip)


@inlined
def works_of(rotor, s, at, first, last):
    """Return rows of `opens` and `slides`, begun at `at`, times s[first:last].

    last - first : a multiple of 8
    """
    zero = broadcast(0.0)
    a, b, c, d = zero, zero, zero, zero
    for m in range(first, last, EIGHT):
        x, y = load(s, m), load(s, m + FOUR)
        a = fma(load(rotor.opens, at + m), x, a)
        b = fma(load(rotor.opens, at + m + FOUR), y, b)
        c = fma(load(rotor.slides, at + m), x, c)
        d = fma(load(rotor.slides, at + m + FOUR), y, d)
    return total_of(a + b), total_of(c + d)


@inlined
def add_one(rows, at, force, s, modes):
    """Add a row, begun at `at`, times a force to the first of s; modes : of 8."""
    force = broadcast(force)
    for m in range(0, modes, EIGHT):
        store(s, m, fma(load(rows, at + m), force, load(s, m)))
        there = m + FOUR
        store(s, there, fma(load(rows, at + there), force, load(s, there)))


@inlined
def add_two(rows, at, force, other, beside, s, modes):
    """Add two rows, each times a force, to the first of s; as `add_one` twice."""
    force, beside = broadcast(force), broadcast(beside)
    for m in range(0, modes, FOUR):
        one = fma(load(rows, at + m), force, load(s, m))
        store(s, m, fma(load(rows, other + m), beside, one))


@inlined
def push_waves(push, where, active, rotor, s, mu, tips, before, sums, slip):
    """Add what the multipliers do to the amplitudes, and book their works.

    Parameters
    ----------
    push, where : of `circulant.solved`
    s : (m + padded,), state: amplitudes, multipliers of the last step with contact
    tips : (2 wide,), folded, of the amplitudes, counted negative
    before : (N,), of the active blades: gaps of step n - 1 but for the rotor's part,
        which is added: tips are not read in all steps
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
        j, at = where[i], where[i] * width
        alone = works_of(rotor, s, at, 0, modes)
        pushed = works_of(rotor, s, at, modes, width)
        tip = tips[place_of(j, len(before), len(tips) // 2)]
        before[j] += tip - alone[0]
        slip[j] = alone[1] + pushed[1]
        opened = alone[0] + pushed[0]
        sums[0] += push[i] * opened
        sums[1] += push[i] * slip[j]
        sums[2] += 0.5 * push[i] * (opened + mu * slip[j])
    for i in range(0, active - 1, 2):
        add_two(
            rotor.push,
            where[i] * modes,
            push[i],
            where[i + 1] * modes,
            push[i + 1],
            s,
            modes,
        )
    if active % 2 == 1:
        add_one(rotor.push, where[active - 1] * modes, push[active - 1], s, modes)


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
