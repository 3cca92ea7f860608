"""One pass over the waves of equal sectors: complete a step, predict the next.

A step multiplies the complex amplitude a of each wave by z. Contact forces add beta
Lambda, with Lambda the spectrum of the multipliers, N; they follow from the gaps, which
need the predictions of all waves. So a step is *pending* until the next pass completes
it: the pass applies the forces, enters their works, multiplies by z and adds up the
spectrum of the gaps. Every amplitude is read and written once a step.

Rotor and casing are the same kind: rows of waves, one for each slot (nodal diameter).
Four neighbouring slots are a group, whose rows follow one another, first those of the
rotor; a row has four amplitudes, re, then im. The coefficients of a group's rows are in
the same order, so that the pass reads all arrays from beginning to end.

The work of normal forces depends on the motion of the material from step n - 1 to n +
1. The rotor rests in the frame of the blades, so that this motion follows from the
spectra of its part of the gaps, of which the state keeps those of three steps; the
casing turns in that frame, and its waves have a coefficient for it, `OPEN_RE`.
Contact forces add to energy and damping loss together what they work.

For the exact flow (`wave_types.FlowRows`) the motion is 2 dt times the mean velocity at
the step's start, of which all waves have a coefficient; the casing's also have one of
the rate at which the radius changes at the blades, since they move past it, `PASS_RE`.
"""

from __future__ import annotations

import math

from hpcwhirl.dynamics.kernels.compiled import (
    does,
    inlined,
    part,
    rare,
    rare_kernel,
    verb,
)
from hpcwhirl.dynamics.kernels.contact import ENDED, LAST, STEP
from hpcwhirl.dynamics.kernels.loop.wave_types import FlowRows, SlotRows
from hpcwhirl.dynamics.kernels.standing import (
    add_support,
    aside_of,
    find_force,
    push_group,
    scaled,
    set_aside,
    solve_supports,
)
from hpcwhirl.dynamics.kernels.vectors import (
    FOUR,
    add_six,
    add_two,
    broadcast,
    fma,
    fnma,
    load,
    store,
    store_six,
    total_of,
)

PART = 2 * FOUR  # doubles of a row of a group: four amplitudes, re, then im
# items of a row: z - 1; change of the gap; with contact: motion along the casing, beta,
# of the casing's rows or in the exact flow the motion of the gap, and of the casing's
# in the exact flow the rate in passing, all by unit amplitude
AHEAD_RE, AHEAD_IM, RADIAL = 0, FOUR, 2 * FOUR
FREE = 3 * FOUR
SLIDE_RE, SLIDE_IM, PUSH_RE, PUSH_IM = 0, FOUR, 2 * FOUR, 3 * FOUR
OPEN_RE, OPEN_IM, PASS_RE, PASS_IM = 4 * FOUR, 5 * FOUR, 6 * FOUR, 7 * FOUR
DRIVEN = 5 * FOUR  # length of a row of `SlotDrive.free`: `FREE` items, then its force
PUSHED, CASING = 4 * FOUR, 6 * FOUR  # length of the latter: of rotor, of casing
FLOW, FLOW_CASING = 6 * FOUR, 8 * FOUR  # the same in the exact flow
# items of a group by unit Lambda: change of the gap by the rotor; motion of the gap by
# the casing, in the exact flow by both; motion along the casing
OWN_RE, OWN_IM, RING_RE, RING_IM = 0, FOUR, 2 * FOUR, 3 * FOUR
SLIDES_RE, SLIDES_IM = 4 * FOUR, 5 * FOUR
FIXED = 6 * FOUR
TURNING = 1  # entry of `sums_c`: work of a changing speed, J, see `turn_slots`
SEEN = 3  # steps whose spectra of the rotor's part of the gaps the state has


@verb
def is_flow(rows):
    """Return whether steps are those of the exact flow, by the type of the rows."""


@does(is_flow, SlotRows)
@inlined
def is_no_flow(_rows):
    """Return False: these steps are central differences."""
    return False


@does(is_flow, FlowRows)
@inlined
def is_indeed(_rows):
    """Return True: these steps are those of the exact flow."""
    return True


@inlined
def to_spectrum(push, where, size, turns, width, lam):
    """Compute the spectrum of the multipliers, N: set lam (width,), re, then im.

    push, where, size : multipliers, N, of the blades in contact, where[:size]
    turns : (N, width) flat, cos and -sin of each slot at each blade
    width : twice the number of slots, padded
    """
    whole = width - width % (6 * FOUR)
    none = broadcast(-0.0)  # x + (-0) has the bits of x, also if x is 0 or -0
    for v in range(0, whole, 6 * FOUR):
        six = none, none, none, none, none, none
        store_six(lam, v, add_six(push, where, size, turns, width, v, six))
    for v in range(whole, width, 2 * FOUR):
        two = add_two(push, where, size, turns, width, v, (none, none))
        store(lam, v, two[0])
        store(lam, v + FOUR, two[1])


@inlined
def products(c, at, re, im, sums):
    """Add complex products (a + i b) (re + i im) to four sums of their parts.

    Return the sums of a re, b im, a im and b re, kept apart for speed.

    c, at : coefficients, and the index in c of re of four of them; im follows
    re, im : four amplitudes
    """
    a, b = load(c, at), load(c, at + FOUR)
    one, two, three, last = sums
    return fma(a, re, one), fma(b, im, two), fma(a, im, three), fma(b, re, last)


@inlined
def times(c, at, re, im, total):
    """Return total + (a + i b) (re + i im) for four complex coefficients, (re, im)."""
    a, b = load(c, at), load(c, at + FOUR)
    real, imag = fma(a, re, total[0]), fma(a, im, total[1])
    return fnma(b, im, real), fma(b, re, imag)


@inlined
def none_yet():
    """Return four sums of `products` that are 0."""
    zero = broadcast(0.0)
    return zero, zero, zero, zero


@inlined
def groups_of(rows):
    """Return the number of groups of four slots."""
    return len(rows.rotor)


@inlined
def is_pending(counter):
    """Return whether the contact forces of the last step are still to be applied."""
    return counter[LAST] == counter[STEP] and counter[ENDED] != counter[STEP]


@inlined
def seen_at(rows, step, q):
    """Return where the rotor's spectra of three steps begin in its amplitudes q.

    They are those of the last step, and of the step two before, which that of the next
    step replaces.
    """
    size = 2 * FOUR * groups_of(rows)
    first = len(q) - SEEN * size  # not used in the exact flow
    return first + step % SEEN * size, first + (step + 1) % SEEN * size


@inlined
def both_of(sums):
    """Return (re, im) of a complex sum from the four sums of `products`."""
    return sums[0] - sums[1], sums[2] + sums[3]


@inlined
def seen_group(rows, g, push, q, own, older):
    """Complete the rotor's spectrum of a step; return its motion over two steps, m."""
    k, col = FOUR * groups_of(rows), FOUR * g
    real, imag = load(q, own + col), load(q, own + k + col)
    real, imag = times(rows.fixed, FIXED * g, push[0], push[1], (real, imag))
    store(q, own + col, real)
    store(q, own + k + col, imag)
    return real - load(q, older + col), imag - load(q, older + k + col)


@inlined
def book_group(rows, g, push, q, own, older, slide, opened, passed, sums, slip):
    """Enter the works of a step's contact forces at four slots; complete its spectrum.

    g, push : group; (re, im) of the multipliers' spectrum, N, at its slots
    q, own, older : state, and indices in it of the rotor's spectra, see `seen_at`
    slide, opened, passed : sums of `products` over the rows: motion along the casing;
        motion of the gap; in the exact flow, rate in passing
    sums, slip : (3 k,), twice the works of normal forces and of friction over mu, J,
        and in the exact flow the power in passing, W; (2 k,), out: motion along the
        casing over two steps, m
    """
    k, col, at = FOUR * groups_of(rows), FOUR * g, FIXED * g
    both = both_of(opened)
    if is_flow(rows):
        past = both_of(passed)
        power = fma(push[0], past[0], fma(push[1], past[1], load(sums, 2 * k + col)))
        store(sums, 2 * k + col, power)
    else:
        moved = seen_group(rows, g, push, q, own, older)
        both = moved[0] + both[0], moved[1] + both[1]
    both = times(rows.fixed, at + RING_RE, push[0], push[1], both)
    store(sums, col, fma(push[0], both[0], fma(push[1], both[1], load(sums, col))))
    along = times(rows.fixed, at + SLIDES_RE, push[0], push[1], both_of(slide))
    drag = fma(push[0], along[0], fma(push[1], along[1], load(sums, k + col)))
    store(sums, k + col, drag)
    store(slip, col, along[0])
    store(slip, k + col, along[1])


@inlined
def ahead_row(free, at, q, m, re, im, real, imag):
    """Multiply a row's amplitudes by z and store them; add its part of the gaps."""
    re, im = times(free, at + AHEAD_RE, re, im, (re, im))
    store(q, m, re)
    store(q, m + FOUR, im)
    gamma = load(free, at + RADIAL)
    return fma(gamma, re, real), fma(gamma, im, imag)


@part
def hold_slots(support, push, q, seen, k, spectrum):
    """Apply the supports' forces to the predicted step, its waves and gaps.

    push : (room,), N, the forces, x and y
    seen, k : index in q of the rotor's spectrum of that step; number of slots
    """
    gaps, count = support.gaps, len(support.stand.film)
    size = len(support.gives) // (2 * count)
    for p in range(count):
        x, y, at = broadcast(push[2 * p]), broadcast(push[2 * p + 1]), 4 * FOUR * p
        push_group(support.gives, 2 * size * p, size, x, y, q)
        re = fma(load(gaps, at), x, load(gaps, at + FOUR) * y)
        im = fma(load(gaps, at + 2 * FOUR), x, load(gaps, at + 3 * FOUR) * y)
        store(spectrum, 0, load(spectrum, 0) + re)
        store(spectrum, k, load(spectrum, k) + im)
        store(q, seen, load(q, seen) + re)
        store(q, seen + k, load(q, seen + k) + im)


@inlined
def pass_groups(rows, q, lam, step, touched, spectrum, sums, slip, held):
    """Complete the last step of all waves, predict the next, add up their gaps.

    The arguments are those of `pass_slots`; touched : whether forces are pending. The
    supports' forces follow from the first group, and act last: they take a while.
    """
    k, m, at, c = FOUR * groups_of(rows), 0, 0, 0
    free, pushed, support = rows.free, rows.pushed, held[0]
    own, older = seen_at(rows, step, q)
    for g in range(groups_of(rows)):
        col, zero = FOUR * g, broadcast(0.0)
        push, slide, opened, passed = (zero, zero), none_yet(), none_yet(), none_yet()
        real, imag = zero, zero
        if touched:
            push = load(lam, col), load(lam, k + col)
        for _ in range(rows.rotor[g]):
            re, im = load(q, m), load(q, m + FOUR)
            if touched:
                slide = products(pushed, c + SLIDE_RE, re, im, slide)
                if is_flow(rows):
                    opened = products(pushed, c + OPEN_RE, re, im, opened)
                re, im = times(pushed, c + PUSH_RE, push[0], push[1], (re, im))
                c += FLOW if is_flow(rows) else PUSHED
            real, imag = ahead_row(free, at, q, m, re, im, real, imag)
            m += PART
            at += FREE
        first = real, imag
        for _ in range(rows.ring[g]):
            re, im = load(q, m), load(q, m + FOUR)
            if touched:
                slide = products(pushed, c + SLIDE_RE, re, im, slide)
                opened = products(pushed, c + OPEN_RE, re, im, opened)
                if is_flow(rows):
                    passed = products(pushed, c + PASS_RE, re, im, passed)
                re, im = times(pushed, c + PUSH_RE, push[0], push[1], (re, im))
                c += FLOW_CASING if is_flow(rows) else CASING
            real, imag = ahead_row(free, at, q, m, re, im, real, imag)
            m += PART
            at += FREE
        if touched:
            book_group(rows, g, push, q, own, older, slide, opened, passed, sums, slip)
        if not is_flow(rows):
            store(q, older + col, first[0])
            store(q, older + k + col, first[1])
        store(spectrum, col, real)
        store(spectrum, k + col, imag)
        if not is_flow(rows) and g == 0 and len(support.reads) > 0:
            find_force(support, q, step, held[2], held[1])
    if not is_flow(rows) and len(support.reads) > 0:
        hold_slots(support, held[1], q, older, k, spectrum)


@inlined
def pass_slots(rows, q, lam, counter, spectrum, sums, slip, held):
    """Complete the last step of all waves; predict the next step without contact.

    Parameters
    ----------
    rows : `wave_types.SlotRows`
    q : state: amplitudes of all waves, then the rotor's spectra of three steps
    lam : (2 k,), N, re, then im, of the multipliers' spectrum of the last step
    counter : counters of the march
    spectrum : (2 k,), m, out: spectrum of the gaps
    sums, slip : as in `book_group`
    held : (`wave_types.SlotSupport`, `push` and `turned` of `SlotSpace`)
    """
    if is_pending(counter):
        pass_groups(rows, q, lam, counter[STEP], True, spectrum, sums, slip, held)
    else:
        pass_groups(rows, q, lam, counter[STEP], False, spectrum, sums, slip, held)


@rare
def settle_slots(rows, q, lam, counter, sums, slip):
    """Apply the contact forces of the last step now, not in the next pass: same bits.

    They must be pending. The arguments are those of `pass_slots`.
    """
    k, m, c, pushed = FOUR * groups_of(rows), 0, 0, rows.pushed
    own, older = seen_at(rows, counter[STEP], q)
    for g in range(groups_of(rows)):
        col, slide, opened, passed = FOUR * g, none_yet(), none_yet(), none_yet()
        push = load(lam, col), load(lam, k + col)
        for f in range(rows.rotor[g] + rows.ring[g]):
            beside = f >= rows.rotor[g]
            re, im = load(q, m), load(q, m + FOUR)
            slide = products(pushed, c + SLIDE_RE, re, im, slide)
            if is_flow(rows) or beside:
                opened = products(pushed, c + OPEN_RE, re, im, opened)
            if is_flow(rows) and beside:
                passed = products(pushed, c + PASS_RE, re, im, passed)
            re, im = times(pushed, c + PUSH_RE, push[0], push[1], (re, im))
            store(q, m, re)
            store(q, m + FOUR, im)
            m += PART
            c += CASING if beside else PUSHED
            c += FLOW - PUSHED if is_flow(rows) else 0
        book_group(rows, g, push, q, own, older, slide, opened, passed, sums, slip)


@rare
def read_slots(rows, q, radial, along):
    """Compute the spectra of the tips' displacements times -1, m, (2 k,) each.

    radial, along : out: radial, which is the rotor's part of the gaps; tangential
    """
    k, m, at, t = FOUR * groups_of(rows), 0, 0, 0
    for g in range(groups_of(rows)):
        col, zero = FOUR * g, broadcast(0.0)
        real, imag, side = zero, zero, none_yet()
        for _ in range(rows.rotor[g]):
            re, im = load(q, m), load(q, m + FOUR)
            gamma = load(rows.free, at + RADIAL)
            real, imag = fma(gamma, re, real), fma(gamma, im, imag)
            side = products(rows.along, t, re, im, side)
            m += PART
            at += FREE
            t += PART
        m += rows.ring[g] * PART
        at += rows.ring[g] * FREE
        store(radial, col, real)
        store(radial, k + col, imag)
        store(along, col, side[0] - side[1])
        store(along, k + col, side[2] + side[3])


@rare
def spectrum_of(rows, q, spectrum):
    """Compute the spectrum of the gaps of both bodies, m, (2 k,), from amplitudes."""
    k, m, at = FOUR * groups_of(rows), 0, 0
    for g in range(groups_of(rows)):
        real, imag = broadcast(0.0), broadcast(0.0)
        for _ in range(rows.rotor[g] + rows.ring[g]):
            gamma = load(rows.free, at + RADIAL)
            real = fma(gamma, load(q, m), real)
            imag = fma(gamma, load(q, m + FOUR), imag)
            m += PART
            at += FREE
        store(spectrum, FOUR * g, real)
        store(spectrum, k + FOUR * g, imag)


@rare
def form_of(rows, form, first, last, q):
    """Return a quadratic form of waves' amplitudes, J: of entries first .. last - 1.

    form : coefficients of the products of `SlotRows.pairs`, as `SlotRows.energy`
    """
    total = broadcast(0.0)
    for e in range(first, last):
        m, n, at = rows.pairs[2 * e], rows.pairs[2 * e + 1], PART * e
        other = load(q, n), load(q, n + FOUR)
        zero = broadcast(0.0)
        re, im = times(form, at, other[0], other[1], (zero, zero))
        total = fma(load(q, m), re, fma(load(q, m + FOUR), im, total))
    return total_of(total)


@rare_kernel
def energies_of_slots(rows, q):
    """Return (energy of the rotor, energy of the casing), J, from waves' amplitudes."""
    rotor = form_of(rows, rows.energy, rows.split - rows.split, rows.split, q)
    return rotor, form_of(rows, rows.energy, rows.split, len(rows.pairs) // 2, q)


@rare_kernel
def turning_of_slots(rows, drive, q):
    """Return the form `turning` of `SlotDrive`, J, of waves' amplitudes q."""
    return form_of(rows, drive.turning, rows.split - rows.split, rows.split, q)


@part
def turn_slots(rows, drive, q, sums):
    """Add the first part of the work of the force -(dOmega/dt) C y in a step, J.

    In the step that ends at n it is -(dOmega/dt) (y_n - y_{n-2}) C y_{n-1} / 2, and the
    sum of B_n = y_n C y_{n-1} and B_{n-1}, since C is skew. B is a Hermitian form H of
    the amplitudes a. Of its sum over steps, products conj(a_f) a_g of different waves
    telescope: they are the difference of the form G_fg = H_fg / (1 - conj(z_f) z_g)
    between begin and end, apart from what contact forces change G
    (`swirl_slots`). `wave_types.SlotDrive.turning` is that difference at the end, with
    half of B. The rest, H_ff |a_f|^2, is added here in every step.

    q : amplitudes after the free step
    sums : `sums_c` of the state
    """
    m, t, total = 0, 0, broadcast(0.0)
    for g in range(groups_of(rows)):
        for _ in range(rows.rotor[g]):
            re, im = load(q, m), load(q, m + FOUR)
            total = fma(load(drive.spin, t), fma(re, re, im * im), total)
            m += PART
            t += FOUR
        m += rows.ring[g] * PART
    sums[TURNING] += total_of(total)


@part
def swirl_slots(rows, swirl, swirls, q, lam, sums):
    """Add the second part of the work, see `turn_slots`, by a step's contact forces.

    swirl, swirls : factors, see `wave_types.SlotDrive`
    q, lam : amplitudes before these act; (2 k,), N, their spectrum
    """
    k, m, t, total = FOUR * groups_of(rows), 0, 0, broadcast(0.0)
    for g in range(groups_of(rows)):
        real, imag, moved = load(lam, FOUR * g), load(lam, k + FOUR * g), none_yet()
        for _ in range(rows.rotor[g]):
            moved = products(swirl, t, load(q, m), load(q, m + FOUR), moved)
            m += PART
            t += PART
        m += rows.ring[g] * PART
        both, size = both_of(moved), fma(real, real, imag * imag)
        total = fma(real, both[0], fma(imag, both[1], total))
        total = fma(load(swirls, FOUR * g), size, total)
    sums[TURNING] += total_of(total)


@part
def drive_slots(drive, q, k, spectrum):
    """Take a step of the motion without contact at a changing speed; add its gaps.

    k : number of slots
    """
    m, c, free = drive.first, 0, drive.free
    for s in range(len(drive.filled)):
        slot, real, imag = drive.filled[s, 0], broadcast(0.0), broadcast(0.0)
        for _ in range(drive.filled[s, 1]):
            re, im = load(q, m), load(q, m + FOUR)
            pushed = re + load(free, c + FREE), im + load(free, c + FREE + FOUR)
            re, im = times(free, c + AHEAD_RE, re, im, pushed)
            store(q, m, re)
            store(q, m + FOUR, im)
            gamma = load(free, c + RADIAL)
            real, imag = fma(gamma, re, real), fma(gamma, im, imag)
            m += PART
            c += DRIVEN
        spectrum[slot] += total_of(real)
        spectrum[k + slot] += total_of(imag)


@part
def weigh_slots(drive, q, angle, k, spectrum):
    """Add the effect of the rotor's weight in a step to the motion without contact.

    angle, k : rad, of the rotor at the step's start; number of slots
    """
    c, s = math.cos(angle), math.sin(angle)
    for i in range(drive.weight.shape[1]):
        m, slot, gamma = drive.at[i], drive.slot[i], drive.radial[i]
        more = scaled(drive.weight[0, i], c) + scaled(drive.weight[1, i], s)
        q[m] += more.real
        q[m + FOUR] += more.imag
        spectrum[slot] += gamma * more.real
        spectrum[k + slot] += gamma * more.imag


@inlined
def carried(held, which, p, q):
    """Return displacement and velocity of support p by waves, m, m/s, complex.

    held, which : `wave_types.SlotHeld`; its `own` or `beside`
    """
    place, moving = complex(0.0, 0.0), complex(0.0, 0.0)
    for i in range(len(which)):
        back = complex(q[which[i]], -q[which[i] + FOUR])
        place += held.places[p, i] * back
        moving += held.moves[p, i] * back
    return place, moving


@inlined
def nudged(held, p, c, s):
    """Return what the forces on r in a step add to the velocity of support p, m/s.

    c, s : cos and sin of the rotor's angle
    """
    weight = scaled(held.nudge[p, 1], c) + scaled(held.nudge[p, 2], s)
    return held.nudge[p, 0] + weight


@inlined
def push_waves(held, which, p, f, q):
    """Add the change by the force f of support p, N, to the waves of its slot."""
    for i in range(len(which)):
        more = held.gives[p, i] * f.conjugate()
        q[which[i]] += more.real
        q[which[i] + FOUR] += more.imag


@part
def stand_slots(held, q, angle, seen, k, push, spectrum, sums):
    """Add the supports' forces in a step at a changing speed to waves and gaps.

    Those on the motion without contact, r, are the forces on r alone; those on y
    complete them to the forces on y + r. Their part of the work of -(dOmega/dt) C y is
    added, see `turn_slots`.

    held : `wave_types.SlotHeld`
    q, sums : amplitudes after the free step; `sums_c` of the state
    angle : rad, of the rotor at the step's start
    seen, k : index in q of the spectrum of y in that step; number of slots
    push : (room,), N, out: the forces on y, see `standing.add_support`
    """
    own, c, s = held.stand, math.cos(angle), math.sin(angle)
    when, slot, work = (complex(c, -s), angle), held.slot, 0.0
    for p in range(len(held.gaps) * (len(held.beside) > 0)):
        place, moving = carried(held, held.beside, p, q)
        add_support(own, p, place, moving + nudged(held, p, c, s), when, push)
    if len(held.beside) > 0:
        solve_supports(own, push)
        set_aside(own, push)
    for p in range(len(held.gaps)):
        place, moving = carried(held, held.own, p, q)
        if len(held.beside) > 0:
            more, rise = carried(held, held.beside, p, q)
            place, moving = place + more, moving + (rise + nudged(held, p, c, s))
        add_support(own, p, place, moving, when, push)
    solve_supports(own, push)
    for p in range(len(held.gaps)):
        f, beside = complex(push[2 * p], push[2 * p + 1]), complex(0.0, 0.0)
        if len(held.beside) > 0:
            x = aside_of(own, push, 2 * p)
            beside = complex(x, aside_of(own, push, 2 * p + 1))
            push_waves(held, held.beside, p, beside, q)
        opened = held.gaps[p] * f.conjugate()
        spectrum[slot] += opened.real
        spectrum[k + slot] += opened.imag
        f = f - beside
        push[2 * p], push[2 * p + 1] = f.real, f.imag
    for p in range(len(held.gaps)):
        f = complex(push[2 * p], push[2 * p + 1])
        for i in range(len(held.own)):
            a = complex(q[held.own[i]], q[held.own[i] + FOUR])
            work += (f * (held.swirl[p, i] * a)).real
        for n in range(len(held.gaps)):
            back = complex(push[2 * n], -push[2 * n + 1])
            work += (f * (held.swirls[p, n] * back)).real
    for p in range(len(held.gaps)):
        f = complex(push[2 * p], push[2 * p + 1])
        push_waves(held, held.own, p, f, q)
        opened = held.gaps[p] * f.conjugate()
        q[seen + slot] += opened.real
        q[seen + k + slot] += opened.imag
    sums[TURNING] += work


@rare
def add_driven(drive, q, radial, along):
    """Add the motion without contact at a changing speed to the spectra of the tips.

    radial, along : m, in and out, as of `read_slots`
    """
    k = len(radial) // 2
    for i in range(len(drive.at)):
        re, im, slot = q[drive.at[i]], q[drive.at[i] + FOUR], drive.slot[i]
        a, b = drive.along[i, 0], drive.along[i, 1]
        gamma = drive.radial[i]
        radial[slot] += gamma * re
        radial[k + slot] += gamma * im
        along[slot] += a * re - b * im
        along[k + slot] += b * re + a * im
