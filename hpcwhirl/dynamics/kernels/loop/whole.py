"""Waves with a row of coefficients for each contact point, as `points` needs them.

The real and imaginary parts of the waves' complex amplitudes are real amplitudes q
(m,), re then im. A step without contact multiplies the complex amplitudes by z; gaps
are rows of coefficients times q, forces change q by such rows. Without rotation a wave
of the rotor is a mode, whose displacement is its real part, so that rows that give gaps
are shorter than q.

Only points that might touch are computed. A sum over the waves bounds the motion of any
point in a step, which gives a lower bound of each gap until its point is computed
again. If, by these bounds, a solution on some points leaves all other gaps open, it is
the solution; where a bound is not open, the point is computed before a conclusion is
drawn. So the choice of points changes no bit.
"""

from __future__ import annotations

import math

from hpcwhirl.dynamics.kernels.compiled import inlined, part
from hpcwhirl.dynamics.kernels.keep_inverse import place_of
from hpcwhirl.dynamics.kernels.vectors import (
    EIGHT,
    FOUR,
    broadcast,
    element,
    fma,
    fnma,
    higher_of,
    load,
    load_both,
    lower_of,
    magnitude,
    store,
    store_both,
    total_of,
)

HELD = 4  # rows of the state's array `held`, see `point_rows.book_points`


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

    rows, at : `wave_types.PointRows.opens` (radial motion) or `slides` (tangential
        motion), and the index at which the tip's row begins
    s, modes : (modes + padded,), amplitudes before contact acts, then multipliers, N;
        number of amplitudes
    """
    return with_rest(rows, at, s, modes, four_sums(rows, at, s, modes))


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
