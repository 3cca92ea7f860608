"""Several contact points a tip, for equal sectors: gaps and forces by spectra.

A wave of nodal diameter n moves a point of blade j like the same point of blade 0,
times e^{i n theta_j}. So, for each of the n_c points of a tip, the waves of a slot add
up to one term of a spectrum, from which the gaps of four blades are computed at once,
and multipliers act on the waves by their spectrum, see `SectorRows`.

A mode of a body that does not turn consists of two waves that move the points with
equal coefficients. Gaps need only their sum: there such a pair counts as one wave.

A gap is computed by the same operations wherever it is needed, so that no bit depends
on which gaps are computed.
"""

from __future__ import annotations

import math

from hpcwhirl.dynamics.kernels.compiled import does, inlined, part
from hpcwhirl.dynamics.kernels.keep_inverse import blade_at, place_of
from hpcwhirl.dynamics.kernels.point_rows import (
    book_points,
    push_points,
    read_close,
    read_every,
    turn_points,
)
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
from hpcwhirl.dynamics.kernels.wave_types import SectorRows
from hpcwhirl.dynamics.kernels.whole import put, turn_four, turn_waves


@inlined
def slots_of(rows):
    """Return k, the number of slots: nodal diameters 0 .. N // 2, padded.

    rows : `wave_types.SectorRows`, from whose sizes it follows
    """
    return len(rows.move) // (2 * (rows.single + rows.pairs))


@inlined
def times(rows, at, k, re, im, total):
    """Return total + r (re + i im), for four complex coefficients r at once.

    rows, at, k : coefficients, where re of the four begin; im follow k further
    """
    a, b = load(rows, at), load(rows, at + k)
    real, imag = fma(a, re, total[0]), fma(a, im, total[1])
    return fnma(b, im, real), fma(b, re, imag)


@inlined
def layout(rows):
    """Return the places in `spectra` where the gaps' spectra and the flags begin.

    `spectra` has, in this order: the amplitudes or the motion of waves and pairs; their
    change by forces; spectra of the n_c points' gaps, then of their motions along the
    casing, then of their multipliers; a flag for each point; a mark for each point of
    each group of four blades; work space for four tips.
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
    """Return the length of `spectra`, see `layout`."""
    k = len(rows.move) // (2 * (rows.single + rows.pairs))
    groups = len(rows.lanes) // (2 * k * FOUR)
    marks = -(-rows.each * (groups + 1) // FOUR) * FOUR
    return 2 * k * (2 * (rows.single + rows.pairs) + 3 * rows.each) + marks + FOUR


@inlined
def add_alike(rows, q, spectra):
    """Write the waves' amplitudes to the start of `spectra`; add those of a pair."""
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
    """Multiply the amplitudes q of all waves by z: a step without forces.

    The implementation of `turn_points` for equal sectors; if `near`, the amplitudes are
    also written to the start of `spectra`, those of a pair added.
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
    """Set the start of `spectra` to the waves' motions over two steps, pairs added.

    A motion, from step n - 1 to n + 1, is the amplitude times `SectorRows.move`. The
    two motions of a pair are added; their factors are conjugates.

    q : amplitudes of the waves at step n + 1, without forces
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
    """Return the four `sums` plus the products a re, b im, a im, b re.

    value : (re, im); a, b : re and im of a coefficient; each is four numbers
    """
    re, im = value
    straight, across, crossed, along = sums
    straight, across = fma(a, re, straight), fma(b, im, across)
    return straight, across, fma(a, im, crossed), fma(b, re, along)


@inlined
def spectrum_of(table, p, alike, k, spectra, to):
    """Set the spectrum of point p, from spectra[to] on, to a sum over the waves.

    table : rows as `SectorRows.read`; alike : number of rows
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
    """Return the four complex numbers in `spectra` to which a sum is to be added.

    They are those from `at` on, re and k further im; zeros if the sum is `fresh`.
    """
    zero = broadcast(0.0)
    if fresh:
        return zero, zero
    return load(spectra, at), load(spectra, at + k)


@inlined
def act_on(rows, p, fresh, mu, spectra, to, along, lam):
    """Set spectra of the motions of point p; add the change of waves by its forces.

    The motion is that by the waves, from step n - 1 to n + 1. For pairs, coefficients
    of forces are the conjugates of those of the motion.

    Parameters
    ----------
    p, mu : number of the point on its tip; friction with the sign of the speed
    fresh : whether the change of waves by other points is still 0
    to, along, lam : where spectra of gaps, of motion along the casing and of
        multipliers begin
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
    """Return a spectrum's values at blades 4 g .. 4 g + 3; it begins at `at`.

    lanes : `SectorRows.lanes`, cos and -sin at four blades each
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
    """Return the value at a blade of the spectrum that begins at `at` in `spectra`.

    turns : `SectorRows.turns`, cos and -sin of each slot at each blade
    """
    even, odd, row = broadcast(0.0), broadcast(0.0), blade * 2 * k
    for c in range(0, k, FOUR):
        even = fma(load(turns, row + c), load(spectra, at + c), even)
        odd = fma(load(turns, row + k + c), load(spectra, at + k + c), odd)
    return total_of(even + odd)


@inlined
def put_four(rows, p, g, k, spectra, at, blades, wide, tips):
    """Write the waves' part of four gaps, m, to `tips`: of blades 4 g .. 4 g + 3.

    p : number of the contact point on each of these tips
    at : where the spectrum of its gaps begins in `spectra`; its last four entries are
        work space
    """
    each, behind = rows.each, len(spectra) - FOUR
    store(spectra, behind, four_tips(rows.lanes, g, k, spectra, at))
    for i in range(min(FOUR, blades - FOUR * g)):
        j = (FOUR * g + i) * each + p
        put(tips, j, blades * each, wide, spectra[behind + i])


@does(read_every, SectorRows)
@part
def read_every_sector(rows, q, points, tips, spectra):
    """Set tips (2 wide,), folded, to the part of all gaps that is due to waves, m.

    The implementation of `read_every` for equal sectors. Folded arrays, (2 wide,), list
    all points in the order of `circulant.folded`.
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
    """Set tips and gaps of point j, and of the same point of neighbouring blades.

    These are the blades of its group of four. Return the lowest of these gaps, m;
    infinity if they were set before.

    gaps, row, tips, whole : as in `whole.read_near`; points : number of points
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

    The implementation of `point_rows.read_close`, which explains both, for equal
    sectors.
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
    """Return the waves' part of the gap of a blade's point p two steps before, m.

    q : amplitudes of the waves before any force of the step acts
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

    It is the point's row of `table` times the forces.

    table : `SectorRows.opens` for the gap of the point, `slides` for its sliding
    at : index at which the row of the point begins
    push, where, active : multipliers, the points that they act on, and their number
    spare : from entry modes + points on, the cos and sin forces of the pulse
    """
    total = table[at + points] * spare[modes + points]
    total += table[at + points + 1] * spare[modes + points + 1]
    for i in range(active):
        total += table[at + where[i]] * push[i]
    return total


@inlined
def turn_back(rows, push, where, active, k, spectra):
    """Set the multipliers' spectra in `spectra`, and the flags of points in contact.

    push, where : multipliers of the points where[:active]; for the places see `layout`
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
    """Set the motions of contact points, and the change of waves by their forces.

    It calls `act_on` for each of a tip's points that is in contact on some blade.

    push, where : multipliers of the points where[:active]
    spectra : see `layout`
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
    """Add the works of contact forces to `sums`; set the active points' earlier gaps.

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
        if held[then + j] != step:
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
    """Add change (re, im), four complex numbers, to the amplitudes m .. m + 3 in q.

    half : number of complex amplitudes in q, re, then im
    """
    store(q, m, load(q, m) + change[0])
    store(q, half + m, load(q, half + m) + change[1])


@does(push_points, SectorRows)
@inlined
def push_sectors(rows, _push, _where, _active, q, spectra):
    """Add the change by contact forces to the amplitudes q of the waves.

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
