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
    load_both,
    store,
    store_both,
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
    and pairs of waves; for the n_c points of a tip, spectra of their gaps, or of their
    motions along the casing, then of their multipliers; a flag for each of the n_c
    points; a mark for each point of each group of four blades; work space for four
    tips.

    rows : `wave_types.SectorRows`
    """
    k = slots_of(rows)
    first = 2 * k * (rows.single + rows.pairs)
    return first, first + 4 * k * rows.each


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
    return 2 * k * (rows.single + rows.pairs + 2 * rows.each) + marks + FOUR


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
def moved_wave(rows, m, at, k, q):
    """Return a wave's motion from step n - 1 to n + 1 without forces, (re, im).

    It is the wave's amplitude times `SectorRows.move`.

    m, at : index of the wave's first amplitude of four; of its factor in `move`
    k, q : number of slots; amplitudes at step n + 1, before any force of the step acts
    """
    zero, re, im = broadcast(0.0), load(q, m), load(q, len(q) // 2 + m)
    return times(rows.move, at, k, re, im, (zero, zero))


@inlined
def moved_pair(rows, m, at, k, q):
    """Return the sum of the motions of a pair's two waves, as in `moved_wave`.

    Their factors are conjugates.

    m : index of the amplitudes of the first one
    """
    half, n = len(q) // 2, m + rows.pairs * k
    a, b = load(rows.move, at), load(rows.move, at + k)
    re, im = load(q, m) + load(q, n), load(q, half + m) + load(q, half + n)
    other, beside = load(q, m) - load(q, n), load(q, half + m) - load(q, half + n)
    return fnma(b, beside, a * re), fma(b, other, a * im)


@inlined
def move_alike(rows, q, spectra):
    """Compute the waves' motions over two steps, which contact forces do work on.

    They are written to the start of `spectra`; those of a pair are added.

    q : amplitudes of the waves at step n + 1, before any force of the step acts
    """
    k = slots_of(rows)
    for f in range(rows.single + rows.pairs):
        for c in range(0, k, FOUR):
            m, at = f * k + c, 2 * f * k + c
            if f < rows.single:
                moved = moved_wave(rows, m, at, k, q)
            else:
                moved = moved_pair(rows, m, at, k, q)
            store(spectra, at, moved[0])
            store(spectra, at + k, moved[1])


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
def conjugate_times(table, at, k, re, im, total):
    """Return total + conj(r) (re + i im) for four complex coefficients r at once.

    The arguments are those of `times`.
    """
    a, b = load(table, at), load(table, at + k)
    real, imag = fma(a, re, total[0]), fma(a, im, total[1])
    return fma(b, im, real), fnma(b, re, imag)


@inlined
def forces_on(rows, f, c, k, spectra):
    """Return the normal forces on a wave or pair in four slots, and friction over mu.

    They are (re, im) each, N: the spectra of the multipliers of all of a tip's points
    times the conjugates of the factors of the motions.

    f, c : number of the wave or pair in a slot; first of the four slots
    """
    zero, alike, (first, flags) = (
        broadcast(0.0),
        rows.single + rows.pairs,
        layout(rows),
    )
    normal, drag = (zero, zero), (zero, zero)
    for p in range(rows.each):
        if spectra[flags + p] != 0.0:
            at, on = (p * alike + f) * 2 * k + c, first + 2 * k * (rows.each + p) + c
            re, im = load(spectra, on), load(spectra, on + k)
            normal = conjugate_times(rows.read, at, k, re, im, normal)
            drag = conjugate_times(rows.slide, at, k, re, im, drag)
    return normal, drag


@inlined
def pushed_wave(rows, f, c, k, spectra):
    """Return the change of a wave that is no pair, in four slots, (re, im).

    The arguments are those of `forces_on`.
    """
    zero, (first, flags) = broadcast(0.0), layout(rows)
    change = zero, zero
    for p in range(rows.each):
        if spectra[flags + p] != 0.0:
            at = (p * rows.single + f) * 2 * k + c
            on = first + 2 * k * (rows.each + p) + c
            re, im = load(spectra, on), load(spectra, on + k)
            change = times(rows.push, at, k, re, im, change)
    return change


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
    """Return what all forces of a step add to a point's motion over two steps, m.

    It is the point's row of `table`, m/N, times the forces, N.

    table, at : `SectorRows.slides`; index in it where the row of the point begins
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
    lam = first + 2 * k * rows.each
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


@does(book_points, SectorRows)
@inlined
def book_sectors(rows, push, where, active, free, q, spare, mu, step, slips, gaps, row,
                 before, sums, held, spectra):  # fmt: skip
    """Enter the works of contact forces in `sums`, and add what they change to waves.

    The implementation of `point_rows.book_points`, with its arguments, for equal
    sectors.
    """
    points, modes, each = len(before), len(q), rows.each
    wide, padded, k = len(gaps) // 6, len(held) // 4, slots_of(rows)
    now, then = padded * (1 + step % 3), padded * (1 + (step + 1) % 3)
    width, (first, flags) = len(rows.slides) // points, layout(rows)
    turn_back(rows, push, where, active, k, spectra)
    if slips:
        move_alike(rows, free, spectra)
        for p in range(each):
            if spectra[flags + p] != 0.0:
                alike, at = rows.single + rows.pairs, first + 2 * k * p
                spectrum_of(rows.slide, p, alike, k, spectra, at)
    for i in range(active):
        j = where[i]
        blade = j // each
        p = j - blade * each
        before[j] = 0.0
        if abs(held[then + j]) != step:
            was = gap_before(rows, p, blade, k, free)
            before[j] = gaps[row + place_of(j, points, wide)] + was
        held[now + j] = step + 2
        if slips:
            forces, begun = (push, where, active, spare, modes, points), j * width
            held[j] = at_blade(rows.turns, blade, k, spectra, first + 2 * k * p)
            held[j] += by_forces(rows.slides, begun, *forces)
    normal, drag = push_sectors(rows, mu, free, q, spectra)
    sums[0] += normal
    sums[1] += mu * drag
    sums[2] += 0.5 * (normal + mu * drag)


@inlined
def change_pair(rows, m, at, k, force, q):
    """Add the change by a force to the amplitudes q of a pair's two waves.

    m, at : indices of the first wave's amplitudes of four slots, and of `give` for it
    force : (re, im), N, on the pair
    """
    zero, half, apart = broadcast(0.0), len(q) // 2, rows.pairs * k
    for _ in range(2):
        change = times(rows.give, at, k, force[0], force[1], (zero, zero))
        store(q, m, load(q, m) + change[0])
        store(q, half + m, load(q, half + m) + change[1])
        m, at = m + apart, at + 2 * apart


@inlined
def sum_of_pair(rows, m, k, q):
    """Return the sum of the amplitudes of a pair's two waves, (re, im)."""
    half, n = len(q) // 2, m + rows.pairs * k
    return load(q, m) + load(q, n), load(q, half + m) + load(q, half + n)


@inlined
def push_sectors(rows, mu, free, q, spectra):
    """Add the change by the contact forces of a step to the amplitudes q of waves.

    Return twice the works of normal forces, and of friction over mu, J. They are the
    products of the forces on waves and pairs with the motions from step n - 1 to n + 1,
    of the free amplitudes and of what all forces of the step change.

    mu, free, q : as in `book_points`
    spectra : in: spectra of the multipliers and flags, see `layout`
    """
    k, half, single, rub = slots_of(rows), len(q) // 2, rows.single, broadcast(mu)
    work = rubbed = broadcast(0.0)
    for f in range(single):
        for c in range(0, k, FOUR):
            m, at = f * k + c, 2 * f * k + c
            normal, drag = forces_on(rows, f, c, k, spectra)
            moved, was = moved_wave(rows, m, at, k, free), load_both(free, half, m)
            change, re_im = pushed_wave(rows, f, c, k, spectra), load_both(q, half, m)
            now = re_im[0] + change[0], re_im[1] + change[1]
            store_both(q, half, m, now)
            x, y = moved[0] + (now[0] - was[0]), moved[1] + (now[1] - was[1])
            work = fma(normal[0], x, fma(normal[1], y, work))
            rubbed = fma(drag[0], x, fma(drag[1], y, rubbed))
    for f in range(single, single + rows.pairs):
        for c in range(0, k, FOUR):
            m, at = f * k + c, 2 * f * k + c
            normal, drag = forces_on(rows, f, c, k, spectra)
            moved, was = moved_pair(rows, m, at, k, free), sum_of_pair(rows, m, k, free)
            force = fma(rub, drag[0], normal[0]), fma(rub, drag[1], normal[1])
            change_pair(rows, m, at - 2 * single * k, k, force, q)
            now = sum_of_pair(rows, m, k, q)
            x, y = moved[0] + (now[0] - was[0]), moved[1] + (now[1] - was[1])
            work = fma(normal[0], x, fma(normal[1], y, work))
            rubbed = fma(drag[0], x, fma(drag[1], y, rubbed))
    return total_of(work), total_of(rubbed)
