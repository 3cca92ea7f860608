"""A rotor of unequal sectors as waves, in `general`'s loop.

Each wave of the whole rotor has a complex amplitude a that a step turns into z a. Their
real and imaginary parts are real amplitudes q (m,), re then im, from which tips follow
as from modes. The multipliers lambda act at once: q += beta lambda. They follow q in
the state, s = (q, lambda), so that the change of a tip's displacement from step n - 1
to n + 1, d' + d, is a row of coefficients times s, see `dynamics.whole_waves`.

Without rotation a wave is a mode, whose displacement is its real part: rows for tips
and forces have half the length (`dynamics.mode_waves`). Only `push_waves` and
`energies_of` differ.

Only tips that might touch are computed. A sum over the waves bounds the motion of any
tip in a step, which gives a lower bound of each gap until its tip is computed again.
If, by these bounds, a solution on some blades leaves all other gaps open, it is the
solution; where a bound is not open, the tip is computed before a conclusion is drawn.
So the choice of tips changes no bit.

As in `waves`, the rotor's loss is what contact has added to energy and loss together
(its work, as `whole_waves.WholeWaves.books` checks), less the present energy.
"""

from __future__ import annotations

import math

from hpcwhirl.dynamics.kernels.circulant import (
    CLOSED,
    correct,
    first_set,
    is_usable,
    multipliers,
    openings,
    settle,
    solve_any,
)
from hpcwhirl.dynamics.kernels.compiled import (
    does,
    inlined,
    kernel,
    part,
    rare,
    rare_kernel,
    verb,
)
from hpcwhirl.dynamics.kernels.contact import note_slip
from hpcwhirl.dynamics.kernels.differences import CENTRAL
from hpcwhirl.dynamics.kernels.keep_inverse import SIZE, place_of
from hpcwhirl.dynamics.kernels.passes import copy_to, load_both, store_both
from hpcwhirl.dynamics.kernels.stepping import (
    energies_of,
    energy_of_ring,
    settle_ring,
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
    magnitude,
    store,
    total_of,
)
from hpcwhirl.dynamics.kernels.wave_types import UncoupledRotor, WholeRotor

EIGHT = 2 * FOUR  # modes and folded blades are padded to a multiple of this
HELD = 4  # rows of the state's array `held`, see `push_waves`


@inlined
def turn_four(q, ahead, half, m):
    """Multiply four amplitudes by z, as a free step does; return their new re and im.

    ahead : (2 half,), z - 1, re, then im, like q; m : the first of the four
    """
    (re, im), (a, b) = load_both(q, half, m), load_both(ahead, half, m)
    re, im = fnma(b, im, fma(a, re, re)), fma(b, re, fma(a, im, im))
    store_both(q, half, m, (re, im))
    return re, im


@inlined
def turn_waves(q, ahead):
    """Take a step without forces, which multiplies amplitudes by z.

    q, ahead : (m,) or more, amplitudes; (m,), z - 1; each re, then im
    """
    half = len(ahead) // 2
    for m in range(0, half, FOUR):
        turn_four(q, ahead, half, m)


@inlined
def lower_all(tips, drift, gaps, row, whole):
    """Lower the bounds of the rotor's part of all gaps; return the lowest gap, m.

    drift : m, by which they are lowered: bound of the motion of any tip in a step
    Other arguments are those of `open_whole`.
    """
    for v in range(0, len(tips), FOUR):
        store(tips, v, load(tips, v) - broadcast(drift))
    return open_whole(tips, gaps, row, whole)


@inlined
def open_whole(tips, gaps, row, whole):
    """Set whole (2 wide,) to the gaps of both bodies, m; return the lowest.

    Folded arrays, (2 wide,), list all blades in the order of `circulant.folded`.

    tips : (2 wide,), m, the rotor's part of the gaps

    gaps, row : gaps without the rotor's part, from index `row` on; all are folded
    """
    least = broadcast(math.inf)
    for v in range(0, len(tips), FOUR):
        gap = load(gaps, row + v) + load(tips, v)
        store(whole, v, gap)
        least = lower_of(least, gap)
    lowest = element(least, 0)
    for i in range(1, FOUR):
        lowest = min(lowest, element(least, i))
    return lowest


@inlined
def four_sums(rows, at, q, modes):
    """Return the product of a row and q[:modes] as four sums of a quarter of the terms.

    rows, at : array, and index at which the row begins
    """
    zero = broadcast(0.0)
    a, b, c, d = zero, zero, zero, zero
    for m in range(0, modes, 2 * EIGHT):
        a = fma(load(rows, at + m), load(q, m), a)
        b = fma(load(rows, at + m + 4), load(q, m + 4), b)
        c = fma(load(rows, at + m + 8), load(q, m + 8), c)
        d = fma(load(rows, at + m + 12), load(q, m + 12), d)
    return a, b, c, d


@inlined
def eight_sums(rows, at, on, q, modes):
    """Return the results of `four_sums` for two rows, from rows[at] and rows[on] on.

    Eight sums at a time hide their latency.

    q, modes : amplitudes, of which the first `modes` are used
    """
    zero = broadcast(0.0)
    a, b, c, d, e, f, g, h = zero, zero, zero, zero, zero, zero, zero, zero
    for m in range(0, modes, 2 * EIGHT):
        i, j, k = m + 4, m + 8, m + 12
        first, second, third, last = load(q, m), load(q, i), load(q, j), load(q, k)
        a, e = fma(load(rows, at + m), first, a), fma(load(rows, on + m), first, e)
        b, f = fma(load(rows, at + i), second, b), fma(load(rows, on + i), second, f)
        c, g = fma(load(rows, at + j), third, c), fma(load(rows, on + j), third, g)
        d, h = fma(load(rows, at + k), last, d), fma(load(rows, on + k), last, h)
    return (a, b, c, d), (e, f, g, h)


@inlined
def sum_four(sums):
    """Return the sum of all 16 numbers in four vectors."""
    return total_of((sums[0] + sums[1]) + (sums[2] + sums[3]))


@inlined
def tip_by_waves(rows, blade, q, modes):
    """Return a blade's displacement, m: its row of rows (N, modes) times amplitudes q.

    modes : a multiple of 16
    """
    return sum_four(four_sums(rows, blade * modes, q, modes))


@inlined
def put(values, blade, blades, wide, value):
    """Set all entries of a blade in the folded array `values` (2 wide,) to `value`.

    Folded arrays, (2 wide,), list all blades in the order of `circulant.folded`.
    """
    values[place_of(blade, blades, wide)] = value
    if 2 * blade == blades:
        values[wide + blade] = value
    if blade == 0:
        values[wide] = value
        for i in range(blades // 2 + 1, wide):
            values[i] = value
            values[wide + i] = value


@part
def read_all(rows, q, blades, tips):
    """Set tips to the rotor's part of the gaps of all blades, m.

    Folded arrays, (2 wide,), list all blades in the order of `circulant.folded`.

    Parameters
    ----------
    rows : (N, modes) flat, gap of each blade per unit amplitude
    q : amplitudes of the waves, of which the first `modes` are used
    tips : (2 wide,), out, folded
    """
    modes, wide = len(rows) // blades, len(tips) // 2
    for j in range(blades):
        put(tips, j, blades, wide, tip_by_waves(rows, j, q, modes))


@inlined
def put_tip(tip, j, blades, gaps, row, tips, whole):
    """Store a blade's displacement and its gap in folded arrays; return the gap, m.

    Folded arrays, (2 wide,), list all blades in the order of `circulant.folded`.

    tip, j : m, radial displacement times -1; number of the blade
    tips, whole : out, (2 wide,): displacements; gaps. gaps, row : as in `read_near`
    """
    wide = len(tips) // 2
    gap = gaps[row + place_of(j, blades, wide)] + tip
    put(tips, j, blades, wide, tip)
    put(whole, j, blades, wide, gap)
    return gap


@inlined
def read_tips_of(where, size, rows, q, blades, gaps, row, tips, whole):
    """Compute tips and gaps of blades where[:size], two at once; return the lowest gap.

    Arguments are those of `read_near`.
    """
    modes, least = len(rows) // blades, math.inf
    for i in range(0, size, 2):
        one, other = where[i], where[min(i + 1, size - 1)]
        both = eight_sums(rows, one * modes, other * modes, q, modes)
        gap = put_tip(sum_four(both[0]), one, blades, gaps, row, tips, whole)
        least = min(least, gap)
        gap = put_tip(sum_four(both[1]), other, blades, gaps, row, tips, whole)
        least = min(least, gap)
    return least


@part
def read_near(rows, q, blades, gaps, row, known, tips, whole, where):
    """Compute the tips that might touch; return the lowest of their gaps, m.

    Folded arrays, (2 wide,), list all blades in the order of `circulant.folded`.

    Parameters
    ----------
    rows, q : (N, modes) flat, gap of each blade per unit amplitude; amplitudes
    gaps, row : gaps without the rotor's part, from index `row` on
    tips, whole : (2 wide,), in: lower bounds of tips and of gaps; out: those computed
    where : (N + 1,), work space

    If a gap is below 0, the tips of all blades in `known`, which were in contact in
    the last solution, are computed, too.
    """
    wide, size = len(tips) // 2, blades - blades
    for j in range(blades):
        where[size] = j
        size += not whole[place_of(j, blades, wide)] > 0.0
    least = read_tips_of(where, size, rows, q, blades, gaps, row, tips, whole)
    if least < 0.0:
        size = blades - blades
        for s in range(known[blades]):
            where[size] = known[s]
            size += whole[place_of(known[s], blades, wide)] > 0.0
        read_tips_of(where, size, rows, q, blades, gaps, row, tips, whole)
    return least


@inlined
def read_below(limit, rows, q, blades, gaps, row, again, tips, whole):
    """Compute tips and gaps of blades whose gaps in `again` are below a limit, m.

    Return whether any gap in `whole` has changed, because it was only a lower bound.

    Other arguments are those of `read_near`.
    """
    modes, wide, changed = len(rows) // blades, len(tips) // 2, False
    for j in range(blades):
        place = place_of(j, blades, wide)
        if again[place] < limit:
            before, tip = whole[place], tip_by_waves(rows, j, q, modes)
            gap = put_tip(tip, j, blades, gaps, row, tips, whole)
            changed = changed or gap != before
    return changed


@rare
def seek_near(rows, q, gaps, row, tips, whole, lowest, blades, space):
    """Solve the contact problem where tips may be known by lower bounds only.

    The result is that of `circulant.solved`. Tips on which the choice of active blades
    depends are computed first: choices and bits are the same as if all tips were
    computed, see `read_near`.

    lowest : lowest of the gaps in `whole`, < 0
    Other arguments are those of `read_near`.
    """
    wide, known, limit = len(tips) // 2, space.known, CLOSED * lowest
    first = row - row  # 0, but no literal, which numba would specialise on
    left = -1  # sets of active blades still to be tried; -1: `first_set` not yet called
    while left != 0:
        usable, size = is_usable(blades, known), known[blades + SIZE]
        pull = below = -1.0
        if usable:
            pull = multipliers(whole, first, size, blades, wide, space)
        more = usable and (pull >= 0.0 or left > 1)
        while more:
            below = openings(whole, first, size, wide, space)
            more = below < limit and read_below(
                limit, rows, q, blades, gaps, row, space.again, tips, whole
            )
        if pull >= 0.0 and below >= limit:
            return settle(whole, first, size, blades, wide, space)
        if left < 0:
            left = first_set(whole, first, blades, wide, space)
        elif usable:
            left -= 1
            if left > 0:
                correct(limit, blades, wide, space)
        else:
            left = 0
    read_all(rows, q, blades, tips)
    open_whole(tips, gaps, row, whole)
    return solve_any(whole, first, blades, wide, space)


@inlined
def size_of(q, half, m):
    """Return upper bounds of four magnitudes: max(|re|, |im|) + min(|re|, |im|) / 2.

    re, im are those of the amplitudes m .. m + 3 in q, re from m, im from half + m on.
    """
    re, im = load_both(q, half, m)
    re, im = magnitude(re), magnitude(im)
    return broadcast(0.5) * (higher_of(re, im) + (re + im))


@inlined
def drift_of(q, drift):
    """Return a bound of any tip's motion in a step, m, by amplitudes q.

    It is the sum over the waves of `drift` times the amplitude's magnitude.
    """
    half = len(drift)
    first = second = broadcast(0.0)
    for m in range(0, half, EIGHT):
        first = fma(load(drift, m), size_of(q, half, m), first)
        second = fma(load(drift, m + FOUR), size_of(q, half, m + FOUR), second)
    return total_of(first + second)


@inlined
def yield_apart(push, where, active, opening, ring, gaps, row, tips):
    """Add the change of gaps by multipliers: the ring's to gaps, the rotor's to tips.

    Folded arrays, (2 wide,), list all blades in the order of `circulant.folded`.

    opening, ring : (N, 2 wide) flat, folded, m/N, of both bodies, and of the ring alone
    push, where : multipliers of the blades where[:active]
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
def with_rest(rows, at, s, modes, sums):
    """Return the product of a row of coefficients and s, of which a part is given.

    sums : product of the first `modes` entries, by `four_sums`
    """
    a, b = sums[0], sums[1]
    for m in range(modes, len(s), EIGHT):
        a = fma(load(rows, at + m), load(s, m), a)
        b = fma(load(rows, at + m + FOUR), load(s, m + FOUR), b)
    return sum_four((a, b, sums[2], sums[3]))


@inlined
def moved_by(rows, at, s, modes):
    """Return a tip's motion from step n - 1 to n + 1, m: a row times s.

    rows, at : `WholeRotor.opens` or `slides`, and where the row begins
    s : (modes + padded,), amplitudes before contact acts, then multipliers, N
    """
    return with_rest(rows, at, s, modes, four_sums(rows, at, s, modes))


@inlined
def slide(rows, where, active, s, modes, held):
    """Set `held` of the active blades to their motion along the casing over two steps.

    rows, s : factors, and what they multiply, as in `moved_by`
    """
    for i in range(0, active, 2):
        one, other = where[i], where[min(i + 1, active - 1)]
        at, on = one * len(s), other * len(s)
        both = eight_sums(rows, at, on, s, modes)
        held[one] = with_rest(rows, at, s, modes, both[0])
        held[other] = with_rest(rows, on, s, modes, both[1])


@inlined
def add_one(rows, at, force, s, modes):
    """Add to s[:modes] a row of coefficients times a force; modes % 8 == 0.

    rows, at : coefficients, and index at which the row begins
    """
    force = broadcast(force)
    for m in range(0, modes, EIGHT):
        store(s, m, fma(load(rows, at + m), force, load(s, m)))
        there = m + FOUR
        store(s, there, fma(load(rows, at + there), force, load(s, there)))


@inlined
def add_four(rows, where, push, i, s, modes):
    """Add to s[:modes] the rows of four blades, each times its multiplier.

    rows : (N, modes) flat; push, where : multipliers, and blades, from index i on
    """
    a, b = where[i] * modes, where[i + 1] * modes
    c, d = where[i + 2] * modes, where[i + 3] * modes
    first, second = broadcast(push[i]), broadcast(push[i + 1])
    third, last = broadcast(push[i + 2]), broadcast(push[i + 3])
    for m in range(0, modes, FOUR):
        two = fma(load(rows, b + m), second, fma(load(rows, a + m), first, load(s, m)))
        three = fma(load(rows, c + m), third, two)
        store(s, m, fma(load(rows, d + m), last, three))


@inlined
def add_rows(rows, push, where, active, s, modes):
    """Add the active blades' rows, times their multipliers, to s[:modes].

    rows, modes : (N, modes) flat; a multiple of 8
    push, where : multipliers of the blades where[:active]
    """
    fours = active - active % 4
    for i in range(0, fours, 4):
        add_four(rows, where, push, i, s, modes)
    for i in range(fours, active):
        add_one(rows, where[i] * modes, push[i], s, modes)


@inlined
def book_pushes(rotor, push, where, active, s, modes, mu, step, tips, gaps, row, before,
                sums, held):  # fmt: skip
    """Enter works of a step's contact forces in `sums`; complete the gaps in `before`.

    A blade that was also in contact two steps before, as nearly all are, has moved like
    the casing: its gap is closed at both steps. For other blades the motion follows
    from the waves.

    Parameters
    ----------
    push, where : results of `circulant.solved`
    s : (modes + padded,), by which `opens` and `slides` are multiplied: amplitudes, and
        multipliers, which are set here
    step : number of this step
    tips, gaps, row, before, sums, held : as in `push_waves`
    """
    width, blades = len(s), len(before)
    padded = width - modes
    now, then = padded * (1 + step % 3), padded * (1 + (step + 1) % 3)
    for i in range(modes, width):
        s[i] = 0.0
    for i in range(active):
        s[modes + where[i]] = push[i]
    slide(rotor.slides, where, active, s, modes, held)
    for i in range(active):
        j = where[i]
        place = place_of(j, blades, len(tips) // 2)
        if held[then + j] == step:
            opened = before[j] - gaps[row + place]
            before[j] = 0.0
        else:
            opened = moved_by(rotor.opens, j * width, s, modes)
            before[j] += tips[place] - opened
        held[now + j] = step + 2
        sums[0] += push[i] * opened
        sums[1] += push[i] * held[j]
        sums[2] += 0.5 * push[i] * (opened + mu * held[j])


@verb
def push_waves(rotor, push, where, active, s, spare, mu, step, tips, gaps, row, before,
               sums, held):  # fmt: skip
    """Add the multipliers' effect to the amplitudes; enter their works in `sums`.

    Folded arrays, (2 wide,), list all blades in the order of `circulant.folded`.

    Parameters
    ----------
    push, where : results of `circulant.solved`
    s : state: amplitudes, multipliers of the last step with contact
    spare : work space, as long as a row of `opens`
    step : number of this step
    tips : (2 wide,), folded displacements of tips after contact, times -1, m
    gaps, row : gaps of this step after contact, without the rotor's part
    before : (N,), gaps of the active blades at step n - 1; in: without the rotor's
        part, out: with it, since tips are not computed in all steps
    sums : (3,): twice the work of normal forces, twice that of drag over mu, and what
        contact has added to energy and loss, J
    held : (HELD padded,), state, by blade: motion along the casing over two steps in
        its last contact, m; then three rows, used by the steps in turn: 2 plus the
        number of a step in which the blade had contact
    """


@does(push_waves, WholeRotor)
@inlined
def push_whole(rotor, push, where, active, s, _, mu, step, tips, gaps, row, before,
               sums, held):  # fmt: skip
    """Add the effect of multipliers to the amplitudes of waves; enter their works.

    The implementation of `push_waves`, with its arguments, for a rotor whose modes
    rotation couples.
    """
    modes = len(rotor.ahead)
    book_pushes(
        rotor, push, where, active, s, modes, mu, step, tips, gaps, row, before, sums,
        held,
    )  # fmt: skip
    add_rows(rotor.push, push, where, active, s, modes)


@does(push_waves, UncoupledRotor)
@inlined
def push_modes(rotor, push, where, active, s, spare, mu, step, tips, gaps, row, before,
               sums, held):  # fmt: skip
    """Add the effect of multipliers to the amplitudes of waves; enter their works.

    The implementation of `push_waves`, with its arguments, for a rotor without
    rotation, each mode of which is a wave.

    spare : work space: change of the modes over two steps, later modal forces
    """
    half = len(rotor.drift)
    for m in range(0, half, FOUR):
        (re, im), (a, b) = load_both(s, half, m), load_both(rotor.moves, half, m)
        store(spare, m, fma(b, im, a * re))
    book_pushes(
        rotor, push, where, active, spare, half, mu, step, tips, gaps, row, before,
        sums, held,
    )  # fmt: skip
    for m in range(0, half, FOUR):
        store(spare, m, broadcast(0.0))
    add_rows(rotor.push, push, where, active, spare, half)
    for m in range(0, half, FOUR):
        (re, im), (a, b) = load_both(s, half, m), load_both(rotor.gives, half, m)
        force = load(spare, m)
        store_both(s, half, m, (fma(a, force, re), fma(b, force, im)))


@rare
def note_slips_of_waves(slip_b, slip_c, turns, known, last, step, counted, ledger):
    """Raise ledger[SLIP], m/s, to the slip of blades in contact in step `counted`.

    There are k slots, one for each nodal diameter, padded.

    slip_b : (N,), of `push_waves`; slip_c : (2 k,), see `passes.slip_of`
    known, last : active blades; step of each blade's last contact
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
    """Copy the state to `copies`; apply the last contact forces to the ring's copy.

    c_c : coefficients of the ring's modes, packed
    """
    t_b, t_c, end_b, end_c = copies
    copy_to(t_b, state.rotor)
    copy_to(end_b, state.sums_b)
    copy_to(end_c, state.sums_c)
    k = len(end_c) // 4
    lam = state.lam[len(state.lam) - 4 * k :]
    settle_ring(CENTRAL, state.ring, t_c, c_c, lam, state.counter, end_c)


@does(energies_of, WholeRotor)
@rare_kernel
def energies_of_whole(rotor, way, t_b, t_c, c_c, now, step):
    """Return the energies of a rotor whose modes rotation couples, and of the ring, J.

    Arguments are those of `stepping.energies_of`, of which this is an
    implementation.
    """
    modes, at, own = len(rotor.ahead), 0, broadcast(0.0)
    for i in range(modes):
        first, row = i - i % FOUR, broadcast(0.0)
        for m in range(first, modes, FOUR):
            row = fma(load(rotor.form, at + m - first), load(t_b, m), row)
        own = fma(broadcast(t_b[i]), row, own)
        at += modes - first
    return total_of(own), energy_of_ring(way, t_c, c_c, now, step)


@does(energies_of, UncoupledRotor)
@rare_kernel
def energies_of_uncoupled(rotor, way, t_b, t_c, c_c, now, step):
    """Return the energies of a rotor's modes, integrated as waves, and of the ring, J.

    Arguments are those of `stepping.energies_of`, of which this is an
    implementation.
    """
    half, own, form = len(rotor.drift), broadcast(0.0), rotor.form
    for m in range(0, half, FOUR):
        re, im = load_both(t_b, half, m)
        first = fma(load(form, m), re, load(form, half + m) * im * broadcast(2.0))
        own = fma(re, first, fma(load(form, 2 * half + m), im * im, own))
    return total_of(own), energy_of_ring(way, t_c, c_c, now, step)
