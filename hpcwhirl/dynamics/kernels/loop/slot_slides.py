"""Set-valued friction of equal sectors, a term of the loop `points`; see `coulomb`.

A step is solved with permanent sliding first. The slides y of a step, m, follow from
the amplitudes and the multipliers; where all tips in contact slide with the rotation,
the solution stands, with the same bits. Else normal forces and friction tau are found
together, from the constant response of both bodies. The waves still have friction mu
lambda, which is pending like the multipliers; the rest, tau - mu lambda, is a further
force along theta, which acts on the predicted step like the pulse does.

Works of a step are those of forces on the motion of the material over two steps. The
pass over all waves sees that motion as a free one of the new amplitudes, so that what
it does not see of the rest's is entered here, for multipliers and for the rest.
"""

from __future__ import annotations

import math

from hpcwhirl.dynamics.kernels.compiled import inlined, part
from hpcwhirl.dynamics.kernels.contact import FRICTION, STEP, book_work
from hpcwhirl.dynamics.kernels.coulomb import (
    CLEAR,
    STICKS,
    book_rub,
    dragged,
)
from hpcwhirl.dynamics.kernels.keep_inverse import place_of
from hpcwhirl.dynamics.kernels.layer import choose_on, rub_on
from hpcwhirl.dynamics.kernels.loop.sectors import at_blade
from hpcwhirl.dynamics.kernels.loop.slots import (
    CASING,
    FLOW,
    FLOW_CASING,
    PART,
    PUSHED,
    SLIDE_RE,
    both_of,
    groups_of,
    is_flow,
    none_yet,
    products,
    seen_at,
    swirl_slots,
    times,
    to_spectrum,
)
from hpcwhirl.dynamics.kernels.vectors import FOUR, broadcast, fma, fnma, load, store

# items of a row: slide of a step for unit amplitude; change by a unit force along theta
RISE_RE, DRAG_RE = 0, 2 * FOUR
RUBBED = 4 * FOUR  # their number
# rows of `SlotSlides.fixed`, of unit multipliers with the friction of permanent
# sliding: slides, motion along theta over two steps; of unit forces along theta:
# change of the rotor's part of the gaps; what the pass does not see of the motions of
# gaps, along theta, and of the rate in passing; whole motion along theta
SLID, WENT, OWN, OPENED, ALONG, PASSED, MOVED = range(7)
KINDS = 7
PUSH, NUMBER = 1, 2  # places in `SlotSpace.rubbed`, in units of 2 k


@inlined
def is_loose(slides):
    """Return whether friction is set-valued."""
    return len(slides.rows) > 0


@inlined
def add_by(fixed, kind, k, force, out):
    """Add to a spectrum (2 k,) what a spectrum of forces, (2 k,), N, changes of it.

    fixed, kind : `wave_types.SlotSlides.fixed`, and the row of it
    """
    at = 2 * k * kind
    for c in range(0, k, FOUR):
        a, b = load(fixed, at + c), load(fixed, at + k + c)
        re, im = load(force, c), load(force, k + c)
        real, imag = fma(a, re, load(out, c)), fma(a, im, load(out, k + c))
        store(out, c, fnma(b, im, real))
        store(out, k + c, fma(b, re, imag))


@inlined
def book_by(fixed, kind, k, force, lam, sums, first):
    """Enter works of multipliers on motions that forces along theta cause.

    fixed, kind, k, force : as in `add_by`
    lam : (2 k,), N, spectrum of the multipliers
    sums, first : in and out, twice the works by slot, J, from `first` on
    """
    at = 2 * k * kind
    for c in range(0, k, FOUR):
        a, b = load(fixed, at + c), load(fixed, at + k + c)
        re, im = load(force, c), load(force, k + c)
        real, imag = fnma(b, im, a * re), fma(b, re, a * im)
        total = fma(load(lam, c), real, load(sums, first + c))
        store(sums, first + c, fma(load(lam, k + c), imag, total))


@part
def read_slides(rows, items, q, out):
    """Compute the spectrum (2 k,) of the slides of a step, m, from amplitudes q."""
    k, m, at = FOUR * groups_of(rows), 0, 0
    for g in range(groups_of(rows)):
        sums = none_yet()
        for _ in range(rows.rotor[g] + rows.ring[g]):
            sums = products(items, at + RISE_RE, load(q, m), load(q, m + FOUR), sums)
            m += PART
            at += RUBBED
        both = both_of(sums)
        store(out, FOUR * g, both[0])
        store(out, k + FOUR * g, both[1])


@part
def add_aside(slides, q, k, out):
    """Add slides of a step by the motion without contact to a spectrum.

    They are those of `wave_types.SlotSlides.aside`.

    out : (2 k,), m, in and out
    """
    for i in range(len(slides.at)):
        re, im, own = q[slides.at[i]], q[slides.at[i] + FOUR], slides.aside[i]
        out[slides.slot[i]] += own[0] * re - own[1] * im
        out[k + slides.slot[i]] += own[1] * re + own[0] * im


@part
def keep_aside(slides, q, past):
    """Write these slides of the last step to a spectrum, before the next one is taken.

    past : (2 k,), m, out
    """
    for c in range(0, len(past), FOUR):
        store(past, c, broadcast(0.0))
    add_aside(slides, q, len(past) // 2, past)


@part
def rub_aside(slides, mu, state, space):
    """Enter the work of a step's friction on the motion without contact.

    space.radial is used as work space.
    """
    slid, lam, work = space.radial, state.lam, 0.0
    k, rubbed = len(slid) // 2, space.rubbed
    for c in range(0, 2 * k, FOUR):
        store(slid, c, load(space.past, c))
    add_aside(slides, state.rotor, k, slid)
    for c in range(2 * k):
        work += mu * lam[c] * slid[c]
    if len(rubbed) > 0 and rubbed[2 * k * NUMBER] == state.counter[STEP]:
        for c in range(2 * k):
            work += rubbed[2 * k * PUSH + c] * slid[c]
    book_work(FRICTION, 0.5 * work, -0.5 * work, state.ledger)


@part
def read_moves(rows, q, out):
    """Compute the spectrum of the free motion along theta over two steps, m."""
    k, m, c = FOUR * groups_of(rows), 0, 0
    for g in range(groups_of(rows)):
        sums = none_yet()
        for f in range(rows.rotor[g] + rows.ring[g]):
            re, im = load(q, m), load(q, m + FOUR)
            sums = products(rows.pushed, c + SLIDE_RE, re, im, sums)
            m += PART
            beside = f >= rows.rotor[g]
            c += CASING if beside else PUSHED
            if is_flow(rows):
                c += FLOW_CASING - CASING if beside else FLOW - PUSHED
        both = both_of(sums)
        store(out, FOUR * g, both[0])
        store(out, k + FOUR * g, both[1])


@inlined
def add_held(slides, slot, push, k, out):
    """Add the motion along theta that supports cause beyond waves to a spectrum.

    slides, slot : as in `wave_types.SlotSupport`
    push : N, forces of the supports, x and y
    """
    for p in range(0, len(slides), 2):  # times conj(x + i y)
        a, b, x, y = slides[p], slides[p + 1], push[p], push[p + 1]
        out[slot] += a * x + b * y
        out[k + slot] += b * x - a * y


@part
def add_unseen(rotor, thrust, angle, push, k, out):
    """Complete the motion along theta by what pulse and supports cause beyond waves.

    thrust, angle : N; rad, as in `point_verbs.kick`
    push : N, forces of the supports, x and y
    out : (2 k,), m, in and out
    """
    pulse, held = rotor.pulse, rotor.drive.held
    if thrust != 0.0:
        here, beside = (
            thrust * math.cos(angle), thrust * pulse.sign * math.sin(angle),
        )  # fmt: skip
        a, b = pulse.numbers[5], pulse.numbers[6]
        out[pulse.slot] += a * here - b * beside
        out[k + pulse.slot] += b * here + a * beside
    add_held(rotor.support.slides, rotor.support.slot, push, k, out)
    add_held(held.slides, held.slot, push, k, out)


@inlined
def keep_gaps(gaps, row, again):
    """Copy the gaps without contact forces, for `rub_slots`.

    gaps, row : m, in folded order from index `row` on
    again : (2 wide,), m, out
    """
    for c in range(0, len(again), FOUR):
        store(again, c, load(gaps, row + c))


@part
def slide_on(rows, slides, mu, moved, active, state, space):
    """Return whether all tips in contact slide with the rotation, which mu drags back.

    The spectrum of the slides without contact forces is written to space.radial, that
    with those of permanent sliding to space.along; friction.state becomes the states of
    all tips, as by `coulomb.obeyed`.

    moved : m, Omega R dt
    active : number of tips in contact, the first ones of the solver's
    """
    radial, along, k = space.radial, space.along, len(space.radial) // 2
    read_slides(rows, slides.rows, state.rotor, radial)
    add_aside(slides, state.rotor, k, radial)
    for c in range(0, 2 * k, FOUR):
        store(along, c, load(radial, c))
    add_by(slides.fixed, SLID, k, state.lam, along)
    states, obeys = space.friction.state, not slides.law.always
    states[:] = CLEAR
    for s in range(active):
        j = space.solver.where[s]
        if space.solver.push[s] > 0.0 and slides.law.friction > 0.0:
            slid = at_blade(rows.turns, j, k, along, 0) - moved
            states[j] = dragged(slid, mu)
            obeys = obeys and states[j] != STICKS
    return obeys


@part
def set_slides(rows, slides, first, last, moves, space):
    """Set slides of the tips friction.chosen[first:last], see `coulomb.rub`.

    moves : as in `rub_slots`
    """
    friction, k = space.friction, len(space.radial) // 2
    for s in range(first, last):
        j = friction.chosen[s]
        friction.slides[j] = at_blade(rows.turns, j, k, space.radial, 0) - moves[0]
        if slides.law.always:
            before = at_blade(rows.turns, j, k, space.slip, 0)
            friction.before[j] = before - moves[1]


@part
def read_past(slides, q, space):
    """Compute the spectrum of the slides of the step before: set space.slip, m."""
    along, radial, slip = space.along, space.radial, space.slip
    for c in range(len(slip)):
        slip[c] = along[c] - radial[c]
    if len(slides.at) > 0:
        for c in range(len(slip)):
            slip[c] += space.past[c]
        add_aside(slides, q, len(slip) // 2, slip)


@part
def rub_slots(rows, rotor, contact, mu, moves, thrust, angle, state, space):
    """Solve a step's normal forces and friction together; apply the rest of friction.

    Return the number of tips in contact, -1 without a solution.

    moves : m, Omega R dt of this step and of the step before
    thrust, angle : as in `add_unseen`
    """
    friction, solver, along = space.friction, space.solver, space.along
    slides, rods = contact.slides, contact.rods
    k, wide, blades = len(along) // 2, len(space.again) // 2, len(state.last)
    read_moves(rows, state.rotor, along)
    add_unseen(rotor, thrust, angle, space.push, k, along)
    if slides.law.always:
        read_past(slides, state.rotor, space)
    for j in range(blades):
        solver.near[j] = space.again[place_of(j, blades, wide)]
    size, more, active = 0, choose_on(rods, solver.near, slides.law, friction), 0
    while size < more:
        set_slides(rows, slides, size, more, moves, space)
        size = more
        active, more = rub_on(
            rods, size, slides, state.worn, solver, friction, space.layer
        )
    row = state.counter[STEP] % 3 * 2 * wide
    for j in range(blades):
        state.gaps[row + place_of(j, blades, wide)] = solver.opened[j]
    for s in range(active):
        j = solver.where[s]
        solver.push[s] = solver.lam[j]
        solver.near[s] = friction.after[j] - mu * solver.lam[j]
    if active > 0:
        to_spectrum(solver.push, solver.where, active, rows.turns, 2 * k, state.lam)
        to_spectrum(solver.near, solver.where, active, rows.turns, 2 * k, space.slip)
        drag_slots(rows, slides, state, space)
    return active


@part
def drag_slots(rows, slides, state, space):
    """Apply further forces along theta, of spectrum space.slip, and enter their works.

    space.along : (2 k,), m, motion along theta over two steps without contact forces
    """
    more, along, lam, fixed = space.slip, space.along, state.lam, slides.fixed
    k, sums, work, rubbed = len(more) // 2, state.sums_b, 0.0, space.rubbed
    add_by(fixed, WENT, k, lam, along)
    add_by(fixed, MOVED, k, more, along)
    for c in range(2 * k):
        work += 0.5 * more[c] * along[c]
        rubbed[c], rubbed[2 * k * PUSH + c] = 0.0, more[c]
    state.ledger[FRICTION] += work
    state.sums_c[0] += work
    book_by(fixed, OPENED, k, more, lam, sums, 0)
    book_by(fixed, ALONG, k, more, lam, sums, k)
    book_by(fixed, PASSED, k, more, lam, sums, 2 * k)
    add_by(fixed, ALONG, k, more, rubbed)
    rubbed[2 * k * NUMBER] = state.counter[STEP]
    if len(slides.swirl) > 0:
        swirl_slots(rows, slides.swirl, slides.swirls, state.rotor, more, state.sums_c)
    push_along(rows, slides, state.rotor, more, state.counter[STEP])


@part
def push_along(rows, slides, q, more, step):
    """Add what a spectrum of forces along theta changes to the amplitudes q.

    more, step : (2 k,), N; number of the step
    """
    k, m, at = FOUR * groups_of(rows), 0, 0
    for g in range(groups_of(rows)):
        push = load(more, FOUR * g), load(more, k + FOUR * g)
        for _ in range(rows.rotor[g] + rows.ring[g]):
            now = load(q, m), load(q, m + FOUR)
            re, im = times(slides.rows, at + DRAG_RE, push[0], push[1], now)
            store(q, m, re)
            store(q, m + FOUR, im)
            m += PART
            at += RUBBED
    if not is_flow(rows):
        own, _ = seen_at(rows, step, q)
        add_by(slides.fixed, OWN, k, more, q[own : own + 2 * k])


@inlined
def slide_slots(rows, rotor, contact, mu, speed, moves, thrust, angle, active, state,
                space):  # fmt: skip
    """Return the number of tips in contact by Coulomb's law; enter their friction.

    moves : m, Omega R dt of this step and of the step before; other arguments are those
        of `rub_slots`
    """
    slides, solver = contact.slides, space.solver
    loose = not slide_on(rows, slides, mu, moves[0], active, state, space) or active < 0
    if loose:
        active = rub_slots(rows, rotor, contact, mu, moves, thrust, angle, state, space)
    book_rub(
        mu, solver.push, solver.where, active, speed, slides.step, moves, loose, state,
        space.friction,
    )  # fmt: skip
    return active
