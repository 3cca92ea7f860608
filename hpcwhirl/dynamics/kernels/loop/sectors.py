"""Gaps and contact forces of equal sectors with several contact points on each tip.

A wave of nodal diameter n moves a point of blade j like the same point of blade 0,
times e^{i n theta_j}. So, for each of the n_c points of a tip, the waves of a slot
(nodal diameter) add up to one term of a spectrum, from which the gaps of four blades
are computed at once, and multipliers (normal contact forces, N) act on the waves by
their spectrum. The coefficients are in `wave_types.SectorRows`.

A mode of a body that does not turn consists of two waves that move the points with
equal coefficients. Gaps need only their sum: there such a pair counts as one wave.

The functions registered with `does` are the implementations, for equal sectors, of the
operations that `point_rows` declares for the time loop `points.march_points`. A gap is
computed by the same operations wherever it is needed, so that no bit depends on which
gaps are computed.
"""

from __future__ import annotations

import math

from hpcwhirl.dynamics.kernels.compiled import does, inlined, part
from hpcwhirl.dynamics.kernels.keep_inverse import blade_at, place_of
from hpcwhirl.dynamics.kernels.loop.point_rows import (
    book_points,
    push_points,
    read_close,
    read_every,
    turn_points,
)
from hpcwhirl.dynamics.kernels.loop.wave_types import SectorRows
from hpcwhirl.dynamics.kernels.loop.whole import put, turn_four, turn_waves
from hpcwhirl.dynamics.kernels.vectors import (
    FOUR,
    broadcast,
    fma,
    fnma,
    get,
    load,
    store,
    total_of,
)


@inlined
def slots_of(rows):
    """Return k, the number of slots: nodal diameters 0 .. N // 2, padded.

    rows : `wave_types.SectorRows`, from whose sizes it follows
    """
    return len(rows.move) // (2 * (rows.single + rows.pairs))


@inlined
def times(rows, at, k, re, im, total):
    """Return total + r (re + i im) for four complex coefficients r at once.

    total, and the result : (re, im), each a vector of four doubles
    rows, at, k : flat table of coefficients, and index in it of re of the four r; im
        follow k further
    """
    a, b = load(rows, at), load(rows, at + k)
    real, imag = fma(a, re, total[0]), fma(a, im, total[1])
    return fnma(b, im, real), fma(b, re, imag)


@inlined
def layout(rows):
    """Return the indices in the work array `spectra` of gaps' spectra and of flags.

    `spectra` has, in this order: the amplitudes, or the motion over two steps, of waves
    and pairs of waves; their change by contact forces; spectra of the gaps of the n_c
    points of a tip, then of their motions along the casing, then of their multipliers;
    a flag for each of the n_c points; a mark for each point of each group of four
    blades; work space for four tips.

    rows : `wave_types.SectorRows`
    """
    k = slots_of(rows)
    first = 4 * k * (rows.single + rows.pairs)
    return first, first + 6 * k * rows.each


@inlined
def groups_of(rows):
    """Return the number of groups of four neighbouring blades.

    rows : `wave_types.SectorRows`, from whose sizes it follows
    """
    return len(rows.lanes) // (2 * slots_of(rows) * FOUR)


def room_of_sectors(rows: SectorRows) -> int:
    """Return the length of the work array `spectra` that `layout` describes."""
    k = len(rows.move) // (2 * (rows.single + rows.pairs))
    groups = len(rows.lanes) // (2 * k * FOUR)
    marks = -(-rows.each * (groups + 1) // FOUR) * FOUR
    return 2 * k * (2 * (rows.single + rows.pairs) + 3 * rows.each) + marks + FOUR


@inlined
def add_alike(rows, q, spectra):
    """Write the amplitudes that all points read alike to the start of `spectra`.

    They are the amplitudes of the waves. Of two waves that move all points alike, a
    pair, the sum of both amplitudes is written in the place of the first.

    rows, q : `wave_types.SectorRows`; amplitudes, re, then im, of all waves
    spectra : out: one row, re then im, for each single wave and each pair, by slot
    """
    k, half, pairs = slots_of(rows), len(q) // 2, rows.pairs
    for f in range(rows.single):
        for c in range(0, k, FOUR):
            store(spectra, 2 * f * k + c, load(q, f * k + c))
            store(spectra, 2 * f * k + k + c, load(q, half + f * k + c))
    for f in range(rows.single, rows.single + pairs):
        for c in range(0, k, FOUR):
            one, two = f * k + c, (f + pairs) * k + c
            store(spectra, 2 * f * k + c, load(q, one) + load(q, two))
            im = load(q, half + one) + load(q, half + two)
            store(spectra, 2 * f * k + k + c, im)


@does(turn_points, SectorRows)
@inlined
def turn_sectors(rows, q, ahead, near, spectra):
    """Take a step without forces: multiply the amplitudes q of all waves by factors z.

    The implementation of `point_rows.turn_points` for equal sectors; if `near`, the new
    amplitudes are also written to the start of `spectra`, the two of a pair added.
    """
    if not near:
        turn_waves(q, ahead)
        return
    k, half, pairs = slots_of(rows), len(q) // 2, rows.pairs
    for f in range(rows.single):
        for c in range(0, k, FOUR):
            re, im = turn_four(q, ahead, half, f * k + c)
            store(spectra, 2 * f * k + c, re)
            store(spectra, 2 * f * k + k + c, im)
    for f in range(rows.single, rows.single + pairs):
        for c in range(0, k, FOUR):
            re, im = turn_four(q, ahead, half, f * k + c)
            other, beside = turn_four(q, ahead, half, (f + pairs) * k + c)
            store(spectra, 2 * f * k + c, re + other)
            store(spectra, 2 * f * k + k + c, im + beside)


@inlined
def move_alike(rows, q, spectra):
    """Compute the waves' motions over two steps, which contact forces do work on.

    A wave's motion from step n - 1 to n + 1 without forces is its amplitude times
    `SectorRows.move`. It is written to the start of `spectra`; the two motions of a
    pair, whose factors are conjugates, are added.

    q : amplitudes of the waves at step n + 1, before any force of the step acts
    """
    k, half, pairs, zero = slots_of(rows), len(q) // 2, rows.pairs, broadcast(0.0)
    for f in range(rows.single):
        for c in range(0, k, FOUR):
            m, at = f * k + c, 2 * f * k + c
            re, im = load(q, m), load(q, half + m)
            total = times(rows.move, at, k, re, im, (zero, zero))
            store(spectra, at, total[0])
            store(spectra, at + k, total[1])
    for f in range(rows.single, rows.single + pairs):
        for c in range(0, k, FOUR):
            m, at = f * k + c, 2 * f * k + c
            a, b = load(rows.move, at), load(rows.move, at + k)
            re, other = load(q, m), load(q, m + pairs * k)
            im, beside = load(q, half + m), load(q, half + m + pairs * k)
            store(spectra, at, fnma(b, im - beside, a * (re + other)))
            store(spectra, at + k, fma(b, re - other, a * (im + beside)))


@inlined
def products(a, b, value, sums):
    """Add a complex product (a + i b) (re + i im) to four sums of its real parts.

    Return the sums of a re, b im, a im and b re, kept apart.

    a, b, value : four doubles each: coefficient a + i b; (re, im)
    """
    re, im = value
    straight, across, crossed, along = sums
    straight, across = fma(a, re, straight), fma(b, im, across)
    return straight, across, fma(a, im, crossed), fma(b, re, along)


@inlined
def spectrum_of(table, p, alike, k, spectra, to):
    """Compute the spectrum of the gaps of one of a tip's points: sum over the waves.

    It is written to spectra[to : to + 2 k], re, then im of the k slots, m; the
    amplitudes are at the start of `spectra`.

    table, p : `SectorRows.read`, factors of the waves in the gaps; number of the point
        on its tip
    alike : number of waves and pairs of waves in a slot
    """
    zero = broadcast(0.0)
    for c in range(0, k, FOUR):
        one = zero, zero, zero, zero
        at, there = p * alike * 2 * k + c, c
        for _ in range(alike):
            value = load(spectra, there), load(spectra, there + k)
            one = products(load(table, at), load(table, at + k), value, one)
            at, there = at + 2 * k, there + 2 * k
        store(spectra, to + c, one[0] - one[1])
        store(spectra, to + k + c, one[2] + one[3])


@inlined
def begin_or_add(fresh, spectra, at, k):
    """Return the four complex sums so far to which the next term is to be added.

    They are read from `spectra`, re from index `at`, im k further; they are 0 if the
    sums are `fresh`, begun by this term.
    """
    zero = broadcast(0.0)
    if fresh:
        return zero, zero
    return load(spectra, at), load(spectra, at + k)


@inlined
def act_on(rows, p, fresh, mu, spectra, to, along, lam):
    """Compute the motion of one of a tip's points, and how its forces change the waves.

    The spectra of the point's motion from step n - 1 to n + 1, radially and along the
    casing, m, follow from that of the waves. The change of the waves' amplitudes by the
    multipliers at the point, and by their friction, is added in `spectra`. For pairs,
    coefficients of forces are the conjugates of those of the motion.

    Parameters
    ----------
    rows, p : `wave_types.SectorRows`; number of the point on its tip
    fresh : whether the change of waves by other points is still 0
    mu : friction with the sign of the speed
    spectra : in and out, see `layout`
    to, along, lam : indices in `spectra` where the spectra of the radial motion, of the
        motion along the casing and of the multipliers begin
    """
    k, single, zero, rub = slots_of(rows), rows.single, broadcast(0.0), broadcast(mu)
    alike = single + rows.pairs
    for c in range(0, k, FOUR):
        one = two = zero, zero, zero, zero
        force = load(spectra, lam + c), load(spectra, lam + k + c)
        for f in range(alike):
            here, row = 2 * f * k + c, (p * alike + f) * 2 * k + c
            moved = load(spectra, here), load(spectra, here + k)
            a, b = load(rows.read, row), load(rows.read, row + k)
            one = products(a, b, moved, one)
            r, t = load(rows.slide, row), load(rows.slide, row + k)
            two = products(r, t, moved, two)
            there = here + 2 * alike * k
            change = begin_or_add(fresh, spectra, there, k)
            if f < single:
                row = (p * single + f) * 2 * k + c
                change = times(rows.push, row, k, force[0], force[1], change)
            else:
                a, b = fma(rub, r, a), fma(rub, t, b)
                real, imag = fma(a, force[0], change[0]), fma(a, force[1], change[1])
                change = fma(b, force[1], real), fnma(b, force[0], imag)
            store(spectra, there, change[0])
            store(spectra, there + k, change[1])
        store(spectra, to + c, one[0] - one[1])
        store(spectra, to + k + c, one[2] + one[3])
        store(spectra, along + c, two[0] - two[1])
        store(spectra, along + k + c, two[2] + two[3])


@inlined
def four_tips(lanes, g, k, spectra, at):
    """Evaluate a spectrum at four blades, 4 g .. 4 g + 3; return four values.

    lanes : `SectorRows.lanes`, cos and -sin of each slot at groups of four blades
    spectra, at : array, and index in it where the spectrum (2 k,) begins
    """
    zero = broadcast(0.0)
    one, two, three, last, place = zero, zero, zero, zero, g * 2 * k * FOUR
    for c in range(0, 2 * k, FOUR):
        this = place + c * FOUR
        one = fma(load(lanes, this), broadcast(get(spectra, at + c)), one)
        two = fma(load(lanes, this + 4), broadcast(get(spectra, at + c + 1)), two)
        three = fma(load(lanes, this + 8), broadcast(get(spectra, at + c + 2)), three)
        last = fma(load(lanes, this + 12), broadcast(get(spectra, at + c + 3)), last)
    return (one + two) + (three + last)


@inlined
def at_blade(turns, blade, k, spectra, at):
    """Evaluate a spectrum of gaps or motions at one blade; return the value there.

    turns : `SectorRows.turns`, cos and -sin of each slot at each blade
    spectra, at : array, and index in it where the spectrum (2 k,) begins
    """
    even, odd, row = broadcast(0.0), broadcast(0.0), blade * 2 * k
    for c in range(0, k, FOUR):
        even = fma(load(turns, row + c), load(spectra, at + c), even)
        odd = fma(load(turns, row + k + c), load(spectra, at + k + c), odd)
    return total_of(even + odd)


@inlined
def put_four(rows, p, g, k, spectra, at, blades, wide, tips):
    """Write the part of the gaps due to waves, m, at one point of up to four blades.

    rows, p : `wave_types.SectorRows`; number of the point on each of these tips
    g : group of four blades, 4 g .. 4 g + 3
    spectra, at : array, and index in it where the spectrum of the point's gaps begins;
        the last four entries are work space
    tips : (2 wide,), out: all points in folded order, see `circulant.folded`
    """
    each, behind = rows.each, len(spectra) - FOUR
    store(spectra, behind, four_tips(rows.lanes, g, k, spectra, at))
    for i in range(min(FOUR, blades - FOUR * g)):
        j = (FOUR * g + i) * each + p
        put(tips, j, blades * each, wide, spectra[behind + i])


@does(read_every, SectorRows)
@part
def read_every_sector(rows, q, points, tips, spectra):
    """Compute the part of the gaps of all points that is due to waves: set tips, m.

    The implementation of `point_rows.read_every` for equal sectors.

    tips : (2 wide,), out: all points in folded order, see `circulant.folded`
    """
    k, each, wide = slots_of(rows), rows.each, len(tips) // 2
    alike, blades, (to, _) = rows.single + rows.pairs, points // each, layout(rows)
    add_alike(rows, q, spectra)
    for p in range(each):
        spectrum_of(rows.read, p, alike, k, spectra, to)
        for g in range(groups_of(rows)):
            put_four(rows, p, g, k, spectra, to, blades, wide, tips)


@inlined
def read_group(rows, j, points, gaps, row, tips, whole, spectra):
    """Compute the gaps at point j and at the same point of neighbouring blades.

    The blades are those of the group of four that has point j. Return the lowest of
    these gaps, m; infinity if they have already been computed in this step.

    gaps, row : gaps without waves, m, from gaps[row] on
    tips, whole : (2 wide,), out: part of the gaps due to waves; gaps, m; both in folded
        order, see `circulant.folded`
    j, points : number of the contact point; number of all contact points
    """
    k, each, wide, least = slots_of(rows), rows.each, len(tips) // 2, math.inf
    first, flags = layout(rows)
    alike, blades, groups = rows.single + rows.pairs, points // each, groups_of(rows)
    p, g, behind = j % each, j // each // FOUR, len(spectra) - FOUR
    mark, at = flags + each + p * groups + g, first + 2 * k * p
    if spectra[mark] == 1.0:
        return least
    spectra[mark] = 1.0
    if spectra[flags + p] == 0.0:
        spectrum_of(rows.read, p, alike, k, spectra, at)
        spectra[flags + p] = 1.0
    store(spectra, behind, four_tips(rows.lanes, g, k, spectra, at))
    for i in range(min(FOUR, blades - FOUR * g)):
        other = (FOUR * g + i) * each + p
        place, tip = place_of(other, points, wide), spectra[behind + i]
        gap = gaps[row + place] + tip
        tips[place], whole[place], least = tip, gap, min(least, gap)
        if other == 0 or 2 * other == points:  # folded rows repeat these
            put(tips, other, points, wide, tip)
            put(whole, other, points, wide, gap)
    return least


@does(read_close, SectorRows)
@part
def read_close_sector(rows, q, points, gaps, row, known, tips, whole, near, spectra,
                      _):  # fmt: skip
    """Compute the gaps of points that might touch; return the lowest, m, and a flag.

    The implementation of `point_rows.read_close`, with its arguments, for equal
    sectors. The flag tells whether the last solution had points in contact.
    """
    wide, least, (_, flags) = len(tips) // 2, math.inf, layout(rows)
    for i in range(flags, len(spectra) - FOUR):
        spectra[i] = 0.0
    if not near:
        add_alike(rows, q, spectra)
    for i in range(2 * wide):
        if not whole[i] > 0.0:
            j = blade_at(i, points, wide)
            gap = read_group(rows, j, points, gaps, row, tips, whole, spectra)
            least = min(least, gap)
    if least < 0.0:
        for s in range(known[points]):
            if whole[place_of(known[s], points, wide)] > 0.0:
                read_group(rows, known[s], points, gaps, row, tips, whole, spectra)
    return least, known[points] > 0


@inlined
def gap_before(rows, p, blade, k, q):
    """Return the waves' part of the gap at a blade's point p two steps before, m.

    rows, k : `wave_types.SectorRows`; number of slots
    q : amplitudes of the waves before any force of the present step acts
    """
    half, waves, total = len(q) // 2, rows.single + 2 * rows.pairs, broadcast(0.0)
    for c in range(0, k, FOUR):
        term = broadcast(0.0), broadcast(0.0)
        for f in range(waves):
            m, at = f * k + c, (p * waves + f) * 2 * k + c
            term = times(rows.before, at, k, load(q, m), load(q, half + m), term)
        row = blade * 2 * k + c
        total = fma(load(rows.turns, row), term[0], total)
        total = fma(load(rows.turns, row + k), term[1], total)
    return total_of(total)


@inlined
def by_forces(table, at, push, where, active, spare, modes, points):
    """Return what all forces of a step add to the motion of a point over two steps, m.

    It is the point's row of `table`, m/N, times the forces, N.

    table, at : `SectorRows.opens` for the radial motion of the point, `slides` for its
        motion along the casing; index in it where the row of the point begins
    push, where, active : multipliers of the points where[:active]
    spare : work array with the forces that are no multipliers, from entry modes +
        points on
    """
    total = 0.0
    for i in range(points, len(spare) - modes):
        total += table[at + i] * spare[modes + i]
    for i in range(active):
        total += table[at + where[i]] * push[i]
    return total


@inlined
def turn_back(rows, push, where, active, k, spectra):
    """Compute the spectra of the multipliers: the contact forces of a step by slot.

    They are written to `spectra`, where the flag of each of a tip's points is also set
    to 1 if it is in contact on some blade, else 0; see `layout`.

    push, where, active : multipliers, N, of the points where[:active]
    k : number of slots
    """
    first, flags = layout(rows)
    lam = first + 4 * k * rows.each
    for m in range(lam, flags, FOUR):
        store(spectra, m, broadcast(0.0))
    for p in range(rows.each):
        spectra[flags + p] = 0.0
    for i in range(active):
        blade = where[i] // rows.each
        p, force = where[i] - blade * rows.each, broadcast(push[i])
        at, spectra[flags + p] = lam + 2 * k * p, 1.0
        for c in range(0, 2 * k, FOUR):
            turn = load(rows.turns, blade * 2 * k + c)
            store(spectra, at + c, fma(turn, force, load(spectra, at + c)))


@inlined
def act_on_all(rows, push, where, active, mu, spectra):
    """Compute the motion of points in contact, and how their forces change waves.

    It calls `act_on` for each of a tip's points that is in contact on some blade;
    results are spectra in `spectra`, see `layout`.

    push, where, active : multipliers, N, of the points where[:active]
    mu : friction with the sign of the speed
    """
    k, (first, flags) = slots_of(rows), layout(rows)
    turn_back(rows, push, where, active, k, spectra)
    fresh, apart = True, 2 * k * rows.each
    for p in range(rows.each):
        if spectra[flags + p] != 0.0:
            at = first + 2 * k * p
            act_on(rows, p, fresh, mu, spectra, at, at + apart, at + 2 * apart)
            fresh = False


@does(book_points, SectorRows)
@inlined
def book_sectors(rows, push, where, active, q, spare, mu, step, gaps, row, before, sums,
                 held, spectra):  # fmt: skip
    """Enter the works of contact forces in `sums`; set the points' earlier gaps.

    The implementation of `point_rows.book_points`, with its arguments, for equal
    sectors.
    """
    points, modes, each = len(before), len(q), rows.each
    wide, padded, k = len(gaps) // 6, len(held) // 4, slots_of(rows)
    now, then = padded * (1 + step % 3), padded * (1 + (step + 1) % 3)
    width, (first, _) = len(rows.opens) // points, layout(rows)
    move_alike(rows, q, spectra)
    act_on_all(rows, push, where, active, mu, spectra)
    for i in range(active):
        j = where[i]
        blade = j // each
        p = j - blade * each
        at, along = first + 2 * k * p, first + 2 * k * (each + p)
        before[j] = 0.0
        if abs(held[then + j]) != step:
            was = gap_before(rows, p, blade, k, q)
            before[j] = gaps[row + place_of(j, points, wide)] + was
        held[now + j] = step + 2
        opened = at_blade(rows.turns, blade, k, spectra, at)
        held[j] = at_blade(rows.turns, blade, k, spectra, along)
        forces, begun = (push, where, active, spare, modes, points), j * width
        opened += by_forces(rows.opens, begun, *forces)
        held[j] += by_forces(rows.slides, begun, *forces)
        sums[0] += push[i] * opened
        sums[1] += push[i] * held[j]
        sums[2] += 0.5 * push[i] * (opened + mu * held[j])


@inlined
def add_wave(q, half, m, change):
    """Add a change to the complex amplitudes of waves m .. m + 3 in q.

    half, change : number of complex amplitudes in q, re, then im; (re, im), each a
        vector of four doubles
    """
    store(q, m, load(q, m) + change[0])
    store(q, half + m, load(q, half + m) + change[1])


@does(push_points, SectorRows)
@inlined
def push_sectors(rows, _push, _where, _active, q, spectra):
    """Add the change that the contact forces cause to the amplitudes q of the waves.

    The implementation of `point_rows.push_points` for equal sectors.

    spectra : in: as set by `book_sectors`, with the change in it
    """
    k, half, pairs, zero = slots_of(rows), len(q) // 2, rows.pairs, broadcast(0.0)
    alike = rows.single + pairs
    for f in range(rows.single):
        for c in range(0, k, FOUR):
            here = 2 * (alike + f) * k + c
            change = load(spectra, here), load(spectra, here + k)
            add_wave(q, half, f * k + c, change)
    for f in range(rows.single, alike):
        for c in range(0, k, FOUR):
            here, at = 2 * (alike + f) * k + c, 2 * (f - rows.single) * k + c
            re, im = load(spectra, here), load(spectra, here + k)
            first = times(rows.give, at, k, re, im, (zero, zero))
            add_wave(q, half, f * k + c, first)
            second = times(rows.give, at + 2 * pairs * k, k, re, im, (zero, zero))
            add_wave(q, half, (f + pairs) * k + c, second)
