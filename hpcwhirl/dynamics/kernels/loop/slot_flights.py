"""Flights of equal sectors: jumps of the exact flow over steps without contact.

A jump over n steps multiplies each wave's amplitude a by z^n. With its root s in the
frame of the blades, a ~ e^{s t}, the sum of |gamma s^2 a|, gamma the change of the gap
for unit amplitude, bounds the second derivative A of every gap, and

g_j(t) >= g_j + g_j' t - A t^2 / 2

is positive up to a time that is found for each blade. A casing that is not round adds
its harmonics c_h, which move past the blades, |y''| = (h Omega)^2 |c_h|. The sum of
|gamma a| bounds the change of every gap for all time: if it is below the least
clearance of all angles, contact cannot recur, which is the certificate.
"""

from __future__ import annotations

from hpcwhirl.dynamics.kernels.compiled import does, inlined, kernel, part, rare
from hpcwhirl.dynamics.kernels.contact import (
    CERTIFICATE,
    CERTIFIED,
    JUMPED,
    JUMPS,
    LAST,
    MISS,
    NEXT_TRY,
    PATIENCE,
    SAMPLE,
    STEP,
)
from hpcwhirl.dynamics.kernels.loop.flight import (
    LESS,
    LONGEST_PATIENCE,
    PASSES,
    SHORTEST,
    free_steps,
)
from hpcwhirl.dynamics.kernels.loop.passes import copy_to, to_gaps_seldom
from hpcwhirl.dynamics.kernels.loop.point_verbs import flew, sample
from hpcwhirl.dynamics.kernels.loop.slots import FREE, PART, RADIAL, groups_of
from hpcwhirl.dynamics.kernels.loop.wave_types import FlowRows, SlotRows
from hpcwhirl.dynamics.kernels.shape import is_shaped, write_rates, write_shape
from hpcwhirl.dynamics.kernels.vectors import (
    FOUR,
    broadcast,
    fma,
    fnma,
    load,
    root,
    store,
    total_of,
)

BOUNDS = 4 * FOUR  # items of a row: rate of the gap, re and im; of two bounds


@kernel
def bound_slots(rows, q, rate):
    """Return bounds of any gap's second derivative, m/s^2, and of its change, m.

    rate : (2 k,), m/s, out: spectrum of the gaps' rates
    """
    k, m, at, bound = FOUR * groups_of(rows), 0, 0, rows.flight.bounds
    bend, reach = broadcast(0.0), broadcast(0.0)
    for g in range(groups_of(rows)):
        real, imag = broadcast(0.0), broadcast(0.0)
        for _ in range(rows.rotor[g] + rows.ring[g]):
            re, im = load(q, m), load(q, m + FOUR)
            a, b = load(bound, at), load(bound, at + FOUR)
            real = fnma(b, im, fma(a, re, real))
            imag = fma(b, re, fma(a, im, imag))
            held = root(fma(re, re, im * im))
            bend = fma(load(bound, at + 2 * FOUR), held, bend)
            reach = fma(load(bound, at + 3 * FOUR), held, reach)
            m += PART
            at += BOUNDS
        store(rate, FOUR * g, real)
        store(rate, k + FOUR * g, imag)
    return total_of(bend), total_of(reach)


@part
def jump_slots(rows, q, begin, spectrum):
    """Multiply all amplitudes by z^n; compute the spectrum of the gaps, m.

    begin : index in the table of jumps where that of n begins
    """
    k, m, at, table = FOUR * groups_of(rows), 0, 0, rows.flight.jumps
    for g in range(groups_of(rows)):
        real, imag = broadcast(0.0), broadcast(0.0)
        for _ in range(rows.rotor[g] + rows.ring[g]):
            re, im = load(q, m), load(q, m + FOUR)
            a, b = load(table, begin + m), load(table, begin + m + FOUR)
            re, im = fnma(b, im, a * re), fma(b, re, a * im)
            store(q, m, re)
            store(q, m + FOUR, im)
            gamma = load(rows.free, at + RADIAL)
            real, imag = fma(gamma, re, real), fma(gamma, im, imag)
            m += PART
            at += FREE
        store(spectrum, FOUR * g, real)
        store(spectrum, k + FOUR * g, imag)


@part
def leap_slots(count, rows, q, counter, spectrum):
    """Move the waves over up to `count` steps without contact; return how many.

    It combines up to `PASSES` jumps of tabulated numbers of steps.
    """
    counts, left = rows.flight.counts, count
    size = len(rows.flight.jumps) // len(counts)
    for _ in range(PASSES):
        p = len(counts) - 1 if left == counts[-1] else len(counts) - 2
        while p >= 0 and counts[p] > left:
            p -= 1
        if p < 0:
            break
        jump_slots(rows, q, p * size, spectrum)
        counter[STEP] += counts[p]
        counter[JUMPED] += counts[p]
        counter[JUMPS] += 1
        left -= counts[p]
    return count - left


@kernel
def steps_ahead(rows, wall, step, speed, state, space):
    """Return how many steps a jump may have, in which no blade can touch.

    If contact cannot recur at all, this certificate is entered in counter and ledger.
    """
    counter, rate, flight, wide = (
        state.counter, space.spectrum, rows.flight, len(space.out) // 2,
    )  # fmt: skip
    bend, reach = bound_slots(rows, state.rotor, rate)
    if is_shaped(wall):
        bend += write_rates(wall, counter[STEP] * step, speed, rate)
    if flight.certifiable and reach < LESS * wall.room:
        counter[CERTIFIED] = counter[STEP]
        state.ledger[CERTIFICATE] = reach
    to_gaps_seldom(rate, rows.wave, 0.0, len(rate) // 2, wide, space.out, 0)
    row, longest = counter[STEP] % 3 * 2 * wide, flight.counts[-2]
    return free_steps(state.gaps, row, space.out, 2 * wide, bend, step, longest) - 1


@part
def land(rows, wall, step, speed, state, space):
    """Compute the gaps of all blades at the end of a jump; note a penetration.

    Bounds exclude a penetration; it would be entered in ledger[MISS].
    """
    counter, spectrum, wide = state.counter, space.spectrum, len(space.out) // 2
    if is_shaped(wall):
        write_shape(wall, counter[STEP] * step, speed, spectrum)
    row, k = counter[STEP] % 3 * 2 * wide, len(spectrum) // 2
    lowest = to_gaps_seldom(spectrum, rows.wave, wall.gap, k, wide, state.gaps, row)
    if lowest < -state.ledger[MISS] * wall.gap:
        state.ledger[MISS] = -lowest / wall.gap


@rare
def sample_between(rows, rotor, wall, mu, step, speed, stride, state, space, tracks):
    """Write the samples of the traces within a jump, from copies of the state.

    The copies, in space.aside, are moved from the jump's start to each sample. Samples
    of the traces do not end a jump, so that the motion is the same whichever are kept.
    """
    aside, counter, own = space.aside, state.counter, space.aside.counter
    first = (own[STEP] // stride + 1) * stride
    for goal in range(first, counter[STEP], stride):
        while own[STEP] < goal:
            leap_slots(goal - own[STEP], rows, aside.rotor, own, space.spectrum)
        own[SAMPLE] = counter[SAMPLE]
        sample(rows, rotor, wall, mu, step, speed, aside, space, True, False, tracks)
        counter[SAMPLE] = own[SAMPLE]


@part
def fly(rows, wall, beat, step, speed, loading, state, space):
    """Jump over steps if no blade can touch for a while; return whether it did.

    A jump ends at the next row of evidence at the latest, and one step before a blade
    might touch, since contact requires the gaps of the two steps before it.
    """
    counter, flight, q = state.counter, rows.flight, state.rotor
    if loading.force != 0.0 and counter[STEP] * step < loading.pulse:
        counter[NEXT_TRY] = int(loading.pulse / step) + 1
        return False
    left = min(beat - counter[STEP] % beat, flight.total - counter[STEP])
    if left < 1:
        return False
    free = left
    if counter[CERTIFIED] < 0:
        free = steps_ahead(rows, wall, step, speed, state, space)
    if counter[CERTIFIED] >= 0:
        leap_slots(left, rows, q, counter, space.spectrum)
        return True
    if free < SHORTEST:
        counter[PATIENCE] = min(max(2 * counter[PATIENCE], 2), LONGEST_PATIENCE)
        counter[NEXT_TRY] = counter[STEP] + counter[PATIENCE]
        return False
    counter[PATIENCE] = 0
    done = leap_slots(min(free, left), rows, q, counter, space.spectrum)
    counter[NEXT_TRY] = counter[STEP] + (done == free)
    land(rows, wall, step, speed, state, space)
    return True


@does(flew, FlowRows)
@inlined
def flew_slots(rows, rotor, wall, strides, mu, step, speed, loading, state, space,
               tracks):  # fmt: skip
    """Jump over steps if no blade can touch for a while; return whether it did.

    The implementation of `point_verbs.flew`, with its arguments, for the exact flow.
    """
    counter = state.counter
    if counter[STEP] < counter[NEXT_TRY] or counter[LAST] == counter[STEP]:
        return False
    between = strides.traces % strides.evidence != 0  # else jumps end at samples
    if between:
        copy_to(space.aside.rotor, state.rotor)
        for entry in range(len(counter)):
            space.aside.counter[entry] = counter[entry]
    jumped = fly(rows, wall, strides.evidence, step, speed, loading, state, space)
    if jumped and between:
        sample_between(
            rows, rotor, wall, mu, step, speed, strides.traces, state, space, tracks
        )
    return jumped


@does(flew, SlotRows)
@inlined
def flew_never(_rows, _rotor, _wall, _strides, _mu, _step, _speed, _loading, _state,
               _space, _tracks):  # fmt: skip
    """Return False: steps of central differences are taken one by one."""
    return False
