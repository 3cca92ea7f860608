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
    """Move four waves a step ahead without contact: multiply their amplitudes by z.

    Return the new amplitudes as (re, im), which are also stored in q.

    q, ahead : (2 half,) each, re, then im: amplitudes; z - 1
    m : index of the first of the four waves
    """
    (re, im), (a, b) = load_both(q, half, m), load_both(ahead, half, m)
    re, im = fnma(b, im, fma(a, re, re)), fma(b, re, fma(a, im, im))
    store_both(q, half, m, (re, im))
    return re, im


@inlined
def turn_waves(q, ahead):
    """Move all waves a step ahead without contact: multiply their amplitudes by z.

    q, ahead : (m,) or more, amplitudes, in and out; (m,), z - 1; each re, then im
    """
    half = len(ahead) // 2
    for m in range(0, half, FOUR):
        turn_four(q, ahead, half, m)


@inlined
def lower_all(tips, drift, gaps, row, whole):
    """Lower the bounds of all gaps for another step; return the lowest, m.

    No tip is computed: the lower bounds in `tips` are lowered by `drift`.

    drift : m, bound of the motion of any tip in a step
    tips, gaps, row, whole : as in `open_whole`
    """
    for v in range(0, len(tips), FOUR):
        store(tips, v, load(tips, v) - broadcast(drift))
    return open_whole(tips, gaps, row, whole)


@inlined
def open_whole(tips, gaps, row, whole):
    """Add the rotor's part to the gaps of all blades; return the lowest gap, m.

    All arrays are in folded order, see `circulant.folded`.

    tips : (2 wide,), m, the rotor's part, or lower bounds of it
    gaps, row : m, gaps without the rotor's part, from index `row` on
    whole : (2 wide,), m, out: the sums
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
    """Return the product of a row of coefficients and q[:modes] as four partial sums.

    Each of them is a vector of four numbers: 16 numbers, whose sum is the product.

    rows, at : coefficients, and the index at which the row begins
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
    """Return products of two rows of coefficients and q[:modes], four sums each.

    The partial sums are those of `four_sums`, for the rows from rows[at] and from
    rows[on] on. Eight sums together hide the latency of the processor's units.

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
    """Return the sum of the 16 numbers in four vectors, partial sums of a product."""
    return total_of((sums[0] + sums[1]) + (sums[2] + sums[3]))


@inlined
def tip_by_waves(rows, blade, q, modes):
    """Return the rotor's part of a blade's gap, m, from the waves' amplitudes.

    rows : (N, modes) flat, the same for unit amplitudes
    q, modes : amplitudes of the waves; number of them used, a multiple of 16
    """
    return sum_four(four_sums(rows, blade * modes, q, modes))


@inlined
def put(values, blade, blades, wide, value):
    """Set all entries of a blade in an array in folded order to `value`.

    Blades 0 and N / 2 have several entries, see `circulant.folded`.

    values, wide : (2 wide,), out
    blade, blades : number of the blade; N
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
    """Compute the rotor's part of the gaps of all blades, m: set `tips`.

    Parameters
    ----------
    rows : (N, modes) flat, the same for unit amplitudes
    q : amplitudes of the waves, of which the first `modes` are used
    tips : (2 wide,), out, in folded order, see `circulant.folded`
    """
    modes, wide = len(rows) // blades, len(tips) // 2
    for j in range(blades):
        put(tips, j, blades, wide, tip_by_waves(rows, j, q, modes))


@inlined
def put_tip(tip, j, blades, gaps, row, tips, whole):
    """Store the rotor's part of a blade's gap, and the gap; return the gap, m.

    tip, j : m, the rotor's part; number of the blade
    gaps, row : as in `read_near`
    tips, whole : (2 wide,), m, out: the rotor's part, and the gaps, in folded order
    """
    wide = len(tips) // 2
    gap = gaps[row + place_of(j, blades, wide)] + tip
    put(tips, j, blades, wide, tip)
    put(whole, j, blades, wide, gap)
    return gap


@inlined
def read_tips_of(where, size, rows, q, blades, gaps, row, tips, whole):
    """Compute the gaps of blades where[:size], two at a time; return the lowest, m.

    The arguments are those of `read_near`, which calls this function.
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
    """Compute the gaps of the blades that might touch; return the lowest of them, m.

    They are the blades whose lower bound of the gap is not positive. If one of the gaps
    is below 0, those of all blades that were in contact in the last solution, `known`,
    are computed, too. Arrays (2 wide,) are in folded order, see `circulant.folded`.

    Parameters
    ----------
    rows, q : (N, modes) flat, rotor's part of each gap for unit amplitudes; amplitudes
    gaps, row : m, gaps without the rotor's part, from index `row` on
    tips, whole : (2 wide,), m, in: lower bounds of the rotor's part, and of the gaps;
        out: their values, for the blades that are computed
    where : (N + 1,), work space
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
    """Compute the gaps of blades that would be below a limit, m, with contact forces.

    Return whether any gap in `whole` has changed, because only a lower bound of it had
    been known.

    again : (2 wide,), m, gaps (or their bounds) with the contact forces
    rows, q, blades, gaps, row, tips, whole : as in `read_near`
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
    """Compute a step's contact forces, where only lower bounds of some gaps are known.

    The result is that of `circulant.solved`: the number of blades in contact, or -1 if
    there is no solution. Gaps on which the choice of these blades depends are computed
    first, so that the choice and the bits are the same as if all gaps were known.

    lowest : m, lowest of the gaps in `whole`, < 0
    space : `kernel_types.ConstantSpace`, which gets the multipliers
    rows, q, gaps, row, tips, whole, blades : as in `read_near`
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

    q, half : amplitudes: `half` real parts, then the imaginary parts
    m : index of the first of the four
    """
    re, im = load_both(q, half, m)
    re, im = magnitude(re), magnitude(im)
    return broadcast(0.5) * (higher_of(re, im) + (re + im))


@inlined
def drift_of(q, drift):
    """Return a bound of the motion of any tip in a step, m.

    It is the sum of |amplitude| times `drift` over the waves.

    q, drift : (2 half,) or more, amplitudes, re, then im; (half,), m, the bound for
        unit amplitude
    """
    half = len(drift)
    first = second = broadcast(0.0)
    for m in range(0, half, EIGHT):
        first = fma(load(drift, m), size_of(q, half, m), first)
        second = fma(load(drift, m + FOUR), size_of(q, half, m + FOUR), second)
    return total_of(first + second)


@inlined
def yield_apart(push, where, active, opening, ring, gaps, row, tips):
    """Add the effect of contact forces to `gaps`, the ring's, and `tips`, the rotor's.

    Arrays of gaps are in folded order, see `circulant.folded`.

    push, where, active : multipliers, N, of the blades in contact, where[:active]
    opening, ring : (N, 2 wide) flat, m/N: change of all gaps by a unit multiplier on
        each blade, of both bodies, and of the ring alone
    gaps, row, tips : m, in and out: gaps without the rotor's part, from index `row` on;
        (2 wide,), the rotor's part
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
    """Return the product of a row of coefficients and s, begun by `four_sums`.

    rows, at : coefficients, and the index at which the row begins
    sums : product of the first `modes` entries, as partial sums of `four_sums`
    """
    a, b = sums[0], sums[1]
    for m in range(modes, len(s), EIGHT):
        a = fma(load(rows, at + m), load(s, m), a)
        b = fma(load(rows, at + m + FOUR), load(s, m + FOUR), b)
    return sum_four((a, b, sums[2], sums[3]))


@inlined
def moved_by(rows, at, s, modes):
    """Return the motion of a tip from step n - 1 to n + 1, m: a row of factors times s.

    rows, at : `WholeRotor.opens` (radial motion) or `slides` (tangential motion), and
        the index at which the tip's row begins
    s, modes : (modes + padded,), amplitudes before contact acts, then multipliers, N;
        number of amplitudes
    """
    return with_rest(rows, at, s, modes, four_sums(rows, at, s, modes))


@inlined
def slide(rows, where, active, s, modes, held):
    """Compute how far blades in contact slide along the casing over two steps, m.

    The motion is that of tips, from step n - 1 to n + 1.

    where, active : the blades are where[:active]
    rows, s, modes : `WholeRotor.slides`, what its rows are multiplied by, and the
        number of amplitudes, as in `moved_by`
    held : (N,) or more, out: entries of these blades
    """
    for i in range(0, active, 2):
        one, other = where[i], where[min(i + 1, active - 1)]
        at, on = one * len(s), other * len(s)
        both = eight_sums(rows, at, on, s, modes)
        held[one] = with_rest(rows, at, s, modes, both[0])
        held[other] = with_rest(rows, on, s, modes, both[1])


@inlined
def add_one(rows, at, force, s, modes):
    """Add the effect of one blade's contact force to the amplitudes s[:modes].

    rows, at : change of the amplitudes by a unit force on each blade, and the index at
        which the blade's row begins; modes % 8 == 0
    force : N, multiplier of the blade
    """
    force = broadcast(force)
    for m in range(0, modes, EIGHT):
        store(s, m, fma(load(rows, at + m), force, load(s, m)))
        there = m + FOUR
        store(s, there, fma(load(rows, at + there), force, load(s, there)))


@inlined
def add_four(rows, where, push, i, s, modes):
    """Add the effect of four blades' contact forces to the amplitudes s[:modes].

    rows : (N, modes) flat, change of the amplitudes by a unit force on each blade
    where, push, i : blades where[i : i + 4], and their multipliers push[i : i + 4], N
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
    """Add the effect of all contact forces of a step to the amplitudes s[:modes].

    rows : (N, modes) flat, change of the amplitudes by a unit force on each blade;
        modes is a multiple of 8
    push, where, active : multipliers, N, of the blades in contact, where[:active]
    """
    fours = active - active % 4
    for i in range(0, fours, 4):
        add_four(rows, where, push, i, s, modes)
    for i in range(fours, active):
        add_one(rows, where[i] * modes, push[i], s, modes)


@inlined
def book_pushes(rotor, push, where, active, s, modes, mu, step, tips, gaps, row, before,
                sums, held):  # fmt: skip
    """Add the works of contact forces to `sums`; add the rotor's part to `before`.

    `before` has the gaps of step n - 1, if the forces act at step n. A blade that was
    also in contact two steps before, as nearly all are, has moved like the casing: its
    gap is closed at both steps. For other blades the motion follows from the waves.

    Parameters
    ----------
    push, where, active : multipliers, N, of the blades in contact, where[:active]
    s : (modes + padded,), by which `opens` and `slides` are multiplied: amplitudes, and
        multipliers, which are set here
    mu, step : friction with the sign of the speed; number of this step
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
    """Apply a step's contact forces to a rotor's waves; add their works to `sums`.

    Arrays (2 wide,) are in folded order, see `circulant.folded`.

    Parameters
    ----------
    push, where, active : multipliers, N, of the blades in contact, where[:active]
    s : state: amplitudes, re, then im, then multipliers of the last step with contact
    spare : work space, one value for each amplitude
    mu, step : friction with the sign of the speed; number n of this step
    tips : (2 wide,), m, the rotor's part of the gaps after contact
    gaps, row : m, buffer of gaps without the rotor's part; index where those of this
        step, after contact, begin
    before : (N,), m, gaps of the blades in contact at step n - 1; in: without the
        rotor's part, out: with it, since tips are not computed in all steps
    sums : (3,), J: twice the work of normal forces; twice that of friction, divided by
        mu; what contact has added to the rotor's energy and its damping loss together
    held : (HELD padded,), part of the state. First, for each blade, its tip's motion
        along the casing from step n - 1 to n + 1 when it was last in contact, m. Then
        three rows, for steps n, n + 1, n + 2 in turn: 2 plus the number of the step in
        which the blade was in contact, so that 0 means never
    """


@does(push_waves, WholeRotor)
@inlined
def push_whole(rotor, push, where, active, s, _, mu, step, tips, gaps, row, before,
               sums, held):  # fmt: skip
    """Apply a step's contact forces to a rotor's waves; add their works to `sums`.

    The implementation of `push_waves`, with its arguments, for a rotor whose modes are
    coupled by rotation.
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
    """Apply a step's contact forces to a rotor's waves; add their works to `sums`.

    The implementation of `push_waves`, with its arguments, for a rotor without terms of
    rotation: each mode is a wave, displaced by the real part of its amplitude.

    spare : work space: motion of the modes over two steps, later modal forces
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
    """Raise ledger[SLIP], m/s, to the largest slip of blades in contact in a step.

    The step is number `counted`; see `contact.note_slip`.

    slip_b : (N,), m, each tip's motion along the casing over two steps, from `held` of
        `push_waves`
    slip_c : (2 k,), m, that of the casing, a spectrum of k nodal diameters, padded
    turns : (N, 2 k) flat, cos and -sin of each nodal diameter at each blade
    known, last : blades in contact in the last solution, see `ConstantSpace`; (N,),
        number of the step of each blade's last contact
    step : dt, s
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
    """Copy the states of rotor and ring; complete the ring's last step in its copy.

    The rotor's waves already have the last contact forces. Samples are computed from
    the copies.

    c_c : coefficients of the ring's modes, packed
    copies : out: arrays like rotor, ring, sums_b, sums_c of the state
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
    """Return the energies of a rotor as waves and of the casing ring, J, after a step.

    The implementation of `stepping.energies_of`, which explains the arguments, for a
    rotor whose modes are coupled by rotation.
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
    """Return the energies of a rotor as waves and of the casing ring, J, after a step.

    The implementation of `stepping.energies_of`, which explains the arguments, for a
    rotor without terms of rotation, each mode of which is a wave.
    """
    half, own, form = len(rotor.drift), broadcast(0.0), rotor.form
    for m in range(0, half, FOUR):
        re, im = load_both(t_b, half, m)
        first = fma(load(form, m), re, load(form, half + m) * im * broadcast(2.0))
        own = fma(re, first, fma(load(form, 2 * half + m), im * im, own))
    return total_of(own), energy_of_ring(way, t_c, c_c, now, step)
