"""The cyclic kernel of a rotor whose waves run forward and backward apart.

Rotation couples the modes of a nodal diameter; its waves it leaves apart (see
`dynamics.turning_waves`). Each has a complex amplitude that a step turns, a' = z a, and
the multipliers' spectrum pushes, beta Lambda. What contact adds waits until the next
pass, as in `passes`; ring, transform and contact are those of `cyclic`.

Amplitudes are sorted in rows: row f holds one wave of every slot, re then im. Behind
them the state has the gaps' spectra of the last three steps. The items of four
neighbouring waves p .. p + 3 stand together, item i at (p ITEMS + 4 i).

Free motion loses Jacobi's energy as D and S take it: the rotor's loss is what contact
has added to energy and loss, less the energy that is left.
"""

from __future__ import annotations

import math

import numpy as np

from hpcwhirl.dynamics.kernels import differences, flow
from hpcwhirl.dynamics.kernels.bodies import FLUSH_EVERY
from hpcwhirl.dynamics.kernels.circulant import circulant_space, recall, solved
from hpcwhirl.dynamics.kernels.compiled import inlined, kernel, part, rare, rare_kernel
from hpcwhirl.dynamics.kernels.contact import (
    COMPLEMENTARITY,
    FRICTION,
    IMPACT,
    LAST,
    NEAR,
    NEXT_LOOK,
    PULSE,
    ROTATION,
    RUNNING,
    STEP,
    STOP,
    book_contacts,
    carried_by_wall,
    pulse_of,
    slips_now,
    watch,
    write_sample,
)
from hpcwhirl.dynamics.kernels.cyclic import (
    angle_of,
    check_sizes,
    flush,
    note_slips,
    one_norm,
    predict,
    prepare,
    read_before,
    to_spectrum,
    widths,
)
from hpcwhirl.dynamics.kernels.flight import total_of
from hpcwhirl.dynamics.kernels.kernel_types import (
    Arrays,
    CyclicState,
    Sizes,
    Wanted,
    WaveSpace,
)
from hpcwhirl.dynamics.kernels.opening import add_ring, note_miss_folded
from hpcwhirl.dynamics.kernels.passes import (
    RING_STATE,
    copy_to,
    load_both,
    pulse_work,
    push_pulse,
    store_both,
    to_gaps,
)
from hpcwhirl.dynamics.kernels.samples import at_blade, read_centre, sample_space
from hpcwhirl.dynamics.kernels.vectors import (
    FOUR,
    all_aligned,
    broadcast,
    fma,
    fnma,
    load,
    store,
)

# items of a wave: z - 1, a gap's displacement, beta; d' + d of a tip's place along the
# casing, counted negative, after a step without forces; what Lambda adds to energy and
# loss; that place itself
AHEAD_RE, AHEAD_IM, RADIAL, PUSH_RE, PUSH_IM = range(5)
RATE_RE, RATE_IM, WORK_RE, WORK_IM, ALONG_RE, ALONG_IM = range(5, 11)
ITEMS = 11
# items of a slot: of a unit Lambda the gap, and d' + d along the casing; energy
OPENS_RE, OPENS_IM, SLIDES_RE, SLIDES_IM, ADDS = range(5)
FIXED = 5
# of the exact flow also dt (v- + v+) of the gap, of waves and of a unit Lambda
NEARS_RE, NEARS_IM = ITEMS, ITEMS + 1
FLOW_ITEMS, FLOW_FIXED = ITEMS + 2, FIXED + 2
SEEN = 3  # steps whose spectra the state has


@inlined
def times(c, at, which, re, im, total):
    """Return total + (item + i next item) (re + i im) of four waves."""
    a, b = load(c, at + which * FOUR), load(c, at + (which + 1) * FOUR)
    real = fnma(b, im, fma(a, re, total[0]))
    return real, fma(b, re, fma(a, im, total[1]))


@inlined
def columns(s, c, fixed, lam, rows, k, seen, touched, exact, out, sums, slip):
    """Do `pass_waves`, with or without contact.

    seen : places in s of the spectra of the steps that end, of two before, and of the
        one predicted, which may be the same
    """
    own, older, next_one = seen
    items, zero = FLOW_ITEMS if exact else ITEMS, broadcast(0.0)
    for col in range(0, k, FOUR):
        push = load_both(lam, k, col)
        real, imag, rate, work = zero, zero, (zero, zero), (zero, zero)
        near = zero, zero
        for f in range(rows):
            m = 2 * k * f + col
            at = (k * f + col) * items
            re, im = load(s, m), load(s, k + m)
            if touched:
                if exact:
                    near = times(c, at, NEARS_RE, re, im, near)
                rate = times(c, at, RATE_RE, re, im, rate)
                work = times(c, at, WORK_RE, re, im, work)
                re, im = times(c, at, PUSH_RE, push[0], push[1], (re, im))
            re, im = times(c, at, AHEAD_RE, re, im, (re, im))
            store(s, m, re)
            store(s, k + m, im)
            gamma = load(c, at + RADIAL * FOUR)
            real, imag = fma(gamma, re, real), fma(gamma, im, imag)
        if touched:
            book(
                s, fixed, push, k, col, own, older, rate, work, near, exact, sums, slip
            )
        store_both(out, k, col, (real, imag))
        store_both(s, k, next_one + col, (real, imag))


@inlined
def book(s, fixed, push, k, col, own, older, rate, work, near, exact, sums,
         slip):  # fmt: skip
    """Enter the works of a column; complete the spectrum of the step that ends."""
    pr, pi = push
    a, b = load_both(fixed, k, OPENS_RE * k + col)
    real, imag = load_both(s, k, own + col)
    real, imag = fnma(b, pi, fma(a, pr, real)), fma(b, pr, fma(a, pi, imag))
    store_both(s, k, own + col, (real, imag))
    if exact:
        a, b = load_both(fixed, k, FIXED * k + col)
        real, imag = fnma(b, pi, fma(a, pr, near[0])), fma(b, pr, fma(a, pi, near[1]))
    else:
        was = load_both(s, k, older + col)
        real, imag = real - was[0], imag - was[1]
    normal = fma(pi, imag, load(sums, col))
    store(sums, col, fma(pr, real, normal))
    a, b = load_both(fixed, k, SLIDES_RE * k + col)
    real, imag = fnma(b, pi, fma(a, pr, rate[0])), fma(b, pr, fma(a, pi, rate[1]))
    store_both(slip, k, col, (real, imag))
    drag = fma(pi, imag, load(sums, k + col))
    store(sums, k + col, fma(pr, real, drag))
    given = fma(pi, work[1], fma(pr, work[0], load(sums, 2 * k + col)))
    square = fma(pr, pr, pi * pi)
    given = fma(load(fixed, ADDS * k + col), square, given)
    store(sums, 2 * k + col, given)


@inlined
def seen_at(step, rows, k):
    """Return where a state has the spectra of a step, of two before, of the next."""
    first = 2 * k * rows
    own, older = step % SEEN * 2 * k, (step + 1) % SEEN * 2 * k
    return first + own, first + older, first + older


@inlined
def pass_waves(s, c, fixed, lam, rows, k, counter, exact, out, sums, slip):
    """End a step of the rotor and predict the next.

    Parameters
    ----------
    s : (2 k (rows + SEEN),), state: amplitudes, spectra of three steps
    c, fixed : items of the waves, (ITEMS rows k,), and of the slots, (FIXED k,)
    lam : re and im of the multipliers' spectrum in its first 2 k
    counter : whose step waits to be ended
    exact : whether by the exact flow
    out : (2 k,), out: spectrum of the gaps
    sums : (3 k,): works of normal forces and of drag (twice, over mu), and what contact
        has added to energy and loss
    slip : (4 k,), out after a step with contact, see `passes.slip_of`
    """
    seen = seen_at(counter[STEP], rows, k)
    if counter[LAST] == counter[STEP]:
        columns(s, c, fixed, lam, rows, k, seen, True, exact, out, sums, slip)
    else:
        columns(s, c, fixed, lam, rows, k, seen, False, exact, out, sums, slip)


@rare
def settle_waves(s, t, c, fixed, lam, rows, k, counter, exact, sums, slip):
    """Write the rotor to t with its last step ended and booked in sums."""
    copy_to(t, s)
    if counter[LAST] != counter[STEP]:
        return
    own, older, _ = seen_at(counter[STEP], rows, k)
    items = FLOW_ITEMS if exact else ITEMS
    for col in range(0, k, FOUR):
        zero = broadcast(0.0)
        push, rate, work = load_both(lam, k, col), (zero, zero), (zero, zero)
        near = zero, zero
        for f in range(rows):
            m = 2 * k * f + col
            at = (k * f + col) * items
            re, im = load_both(s, k, m)
            if exact:
                near = times(c, at, NEARS_RE, re, im, near)
            rate = times(c, at, RATE_RE, re, im, rate)
            work = times(c, at, WORK_RE, re, im, work)
            store_both(t, k, m, times(c, at, PUSH_RE, push[0], push[1], (re, im)))
        book(t, fixed, push, k, col, own, older, rate, work, near, exact, sums, slip)


@rare_kernel
def end_waves(
    s_b, t_b, rotor, s_c, t_c, c_c, lam, counter, exact, sums_b, sums_c, slip
):
    """Write both bodies to t_b, t_c with their last step ended and booked in sums."""
    k = len(sums_c) // 4
    c, fixed, _, _ = rotor
    rows = len(s_b) // (2 * k) - SEEN
    settle_waves(s_b, t_b, c, fixed, lam, rows, k, counter, exact, sums_b, slip)
    if exact:
        size, touched = len(s_c) // RING_STATE, counter[LAST] == counter[STEP]
        flow.settle_ring(s_c, t_c, c_c, lam, size, counter, True, touched, sums_c)
    else:
        differences.settle_ring(s_c, t_c, c_c, lam, k, counter, sums_c)


@rare_kernel
def sums_of_waves(sums_b, sums_c, exact, step):
    """Return work of the rotation, impact loss, work of drag over mu, J.

    And the ring's damping loss with what contact has added to the rotor.
    """
    if exact:
        return flow.column_sums(sums_b, sums_c, step)
    return differences.column_sums(sums_b, sums_c, step)


@rare_kernel
def energies_of_waves(t_b, rotor, t_c, c_c, now, exact, step):
    """Return the energies of rotor and ring from ended states, J; now : 0 or 1."""
    _, _, hub, form = rotor
    k = (len(t_b) - hub.shape[1]) // (2 * SEEN)
    rows, at, total = len(t_b) // (2 * k) - SEEN, 0, broadcast(0.0)
    for f in range(rows):
        for col in range(0, k, FOUR):
            real, imag, place = broadcast(0.0), broadcast(0.0), at + col
            for g in range(f, rows):
                re, im = load_both(t_b, k, 2 * k * g + col)
                a, b = load_both(form, k, place)
                real = fnma(b, im, fma(a, re, real))
                imag = fma(b, re, fma(a, im, imag))
                place += 2 * k
            re, im = load_both(t_b, k, 2 * k * f + col)
            total = fma(re, real, fma(im, imag, total))
        at += 2 * k * (rows - f)
    size = len(t_c) // RING_STATE
    first, d = size - size, 2 * size * (1 + now)
    if exact:
        ring = flow.energy_of(t_c, c_c, first, d, size)
        ring += flow.energy_of(t_c, c_c, size, d + size, size)
    else:
        ring = differences.energy_of(t_c, c_c, first, d, size, step)
        ring += differences.energy_of(t_c, c_c, size, d + size, size, step)
    return total_of(total), ring


@inlined
def spectrum_of(q, c, which, rows, k, out):
    """Set out (2 k,) to a spectrum of the tips' places; which : item of its factors."""
    items = len(c) // (rows * k)
    for col in range(0, k, FOUR):
        total = broadcast(0.0), broadcast(0.0)
        for f in range(rows):
            re, im = load_both(q, k, 2 * k * f + col)
            at = (k * f + col) * items
            if which == RADIAL:
                gamma = load(c, at + RADIAL * FOUR)
                total = fma(gamma, re, total[0]), fma(gamma, im, total[1])
            else:
                total = times(c, at, ALONG_RE, re, im, total)
        store_both(out, k, col, total)


@rare
def farthest(limit, q, c, out, wave, sizes, work):
    """Return the largest displacement of a tip, as `cyclic.farthest`."""
    _, rows, _, k, wide = sizes
    spectrum, outward, along = work
    spectrum_of(q, c, ALONG_RE, rows, k, spectrum)
    bound = math.hypot(one_norm(out, 2 * k), one_norm(spectrum, 2 * k))
    if not bound > NEAR * limit:
        return bound
    to_gaps(out, wave, 0.0, k, wide, outward, 0)
    to_gaps(spectrum, wave, 0.0, k, wide, along, 0)
    most = 0.0
    for i in range(2 * wide):
        most = max(most, math.hypot(outward[i], along[i]))
    return most


@part
def read_tips(spectrum, turns, direction, tips):
    """Set a column of tips (N + 1, 2) from its spectrum, which counts it negative."""
    for j in range(len(tips) - 1):
        tips[j, direction] = -at_blade(spectrum, turns, j, len(spectrum))


@rare
def sample_waves(step, speed, mu, wall, rotor, casing, turns, wave, state, space, exact,
                 keep, judge, tracks):  # fmt: skip
    """End the step in copies and write a sample of them, as `samples.sample_cyclic`."""
    c_c, slot, sign = casing
    sample, counter, ledger = space.sample, state.counter, state.ledger
    t_b, t_c, whole, radial = sample.rotor, sample.ring, sample.ledger, sample.columns
    sizes = sizes_of(state)
    blades, rows, _, k, wide = sizes
    prepare(step, speed, wall, slot, sign, state, sample)
    end_waves(
        state.rotor, t_b, rotor, state.ring, t_c, c_c, state.lam, counter,
        exact, sample.sums_b, sample.sums_c, space.spare,
    )  # fmt: skip
    spectrum_of(t_b, rotor.items, RADIAL, rows, k, radial)
    if judge and counter[LAST] == counter[STEP]:
        reach = one_norm(radial, 2 * k)
        for col in range(2 * k):
            sample.wall[col] += radial[col]
        add_ring(t_c, c_c, k, sample.wall)
        to_gaps(sample.wall, wave, wall.gap, k, wide, sample.again, 0)
        row = counter[STEP] % 3 * 2 * wide
        note_miss_folded(
            sample.again, state.gaps, row, reach, wall.gap, blades, ledger
        )  # fmt: skip
    if keep and len(tracks.tips) > 0:
        read_tips(radial, turns, 0, sample.tips)
        spectrum_of(t_b, rotor.items, ALONG_RE, rows, k, radial)
        read_tips(radial, turns, 1, sample.tips)
    read_centre(t_b, rotor.hub, sample.tips)
    energies = energies_of_waves(t_b, rotor, t_c, c_c, counter[STEP] & 1, exact, step)
    rotation, impact, drag, given = sums_of_waves(
        sample.sums_b, sample.sums_c, exact, step
    )
    copy_to(whole, ledger)
    whole[ROTATION] += rotation
    whole[IMPACT] += impact
    whole[FRICTION] += mu * drag
    write_sample(
        counter, whole, state.impulse, sample.tips, t_c, energies, given - energies[0],
        keep, judge, tracks,
    )  # fmt: skip


def own_sizes(arrays: Arrays, state: CyclicState, *, exact: bool) -> Wanted:
    """Return the sizes of the arrays of waves, see `cyclic.check_sizes`."""
    k, _ = widths(len(state.impulse))
    rotor, rows = arrays.rotor, len(state.rotor) // (2 * k) - SEEN
    return [
        ("rotor", state.rotor, 2 * k * (rows + SEEN)),
        ("lam", state.lam, 4 * k), ("sums_b", state.sums_b, 3 * k),
        ("rotor items", rotor.items, (FLOW_ITEMS if exact else ITEMS) * rows * k),
        ("fixed", rotor.fixed, (FLOW_FIXED if exact else FIXED) * k),
        ("hub", rotor.hub, 4 * k * rows), ("form", rotor.form, k * rows * (rows + 1)),
        ("column", arrays.contact.column, len(state.impulse)),
    ]  # fmt: skip


def space_of(arrays: Arrays, state: CyclicState, *, exact: bool) -> WaveSpace:
    """Return the work space of a march: nothing of it is needed to resume."""
    check_sizes("waves", arrays, state, own_sizes(arrays, state, exact=exact))
    blades = len(state.impulse)
    k, wide = widths(blades)
    sizes = [2 * k, 2 * k, 2 * k, 2 * wide, 4 * k, 2 * k, 4 * k, blades]
    solver = circulant_space(blades, wide, arrays.contact.column, state.known)
    own = all_aligned([*map(np.zeros, sizes)])
    return WaveSpace._make([*own, sample_space(state, blades, 2 * k), solver])


@inlined
def sizes_of(state):
    """Return the sizes of a state's arrays."""
    k, blades = len(state.lam) // 4, len(state.impulse)
    rows, ring_rows = len(state.rotor) // (2 * k) - SEEN, len(state.ring) // k
    return Sizes(blades, rows, ring_rows // RING_STATE, k, len(state.gaps) // 6)


def marching(exact):
    """Return the loop by central differences or by the exact flow, to be compiled."""

    def march(
        steps, strides, limit, step, speed, mu, wall, loading, rotor, casing, contact,
        state, tracks, space,
    ):  # fmt: skip
        """March `steps` steps; see `bodies.march_bodies`; space : of `space_of`."""
        force, pulse, lobe = loading
        (c_b, fixed, _, _), (c_c, slot, sign), (_, turns, wave, _) = (
            rotor,
            casing,
            contact,
        )
        s_b, s_c, lam, gaps, sums_b, sums_c, _, last, counter, ledger, impulse = state
        out_b, out_c, spectrum, rates, slip_b, slip_c, _, before, sample, solver = space
        looking, slips = (spectrum, rates, sample.again), (slip_b, slip_c)
        push, known, inverse, opening, where, _, _, _, _ = solver
        sizes = sizes_of(state)
        blades, rows, ring_rows, k, wide = sizes
        ring_size = ring_rows * k
        recall(blades, wide, solver)
        goal = counter[STEP] + steps
        while counter[STEP] < goal and counter[STOP] == RUNNING:
            pass_waves(
                s_b, c_b, fixed, lam, rows, k, counter, exact, out_b, sums_b, slip_b
            )
            if exact:
                flow.pass_ring(
                    s_c, c_c, lam, ring_rows, k, counter, out_c, sums_c, slip_c
                )
            else:
                differences.pass_ring(
                    s_c, c_c, lam, ring_rows, k, counter, out_c, sums_c, slip_c
                )
            if slips_now(counter):
                note_slips(
                    slips, turns, known, last, step, k, spectrum, counter, ledger
                )
            thrust = pulse_of(counter[STEP] * step, force, pulse)
            counter[STEP] += 1
            time, row = counter[STEP] * step, counter[STEP] % 3 * 2 * wide
            if thrust != 0.0:
                push_pulse(
                    s_c, c_c, ring_size, thrust, lobe, sign,
                    angle_of(wall, speed, time), counter, out_c, k,
                )  # fmt: skip
            lowest = predict(
                out_b, out_c, wave, wall, time, speed, slot, sign, spectrum, gaps, row,
                sizes,
            )  # fmt: skip
            if lowest < 0.0:
                active = solved(
                    gaps, row, lowest, blades, wide, push, known, inverse, opening,
                    where, solver,
                )  # fmt: skip
                if active < 0:
                    counter[STOP] = COMPLEMENTARITY
                    return
                if not exact:
                    older = (counter[STEP] + 1) % 3 * 2 * wide
                    read_before(gaps, older, where, active, blades, wide, before)
                elif ring_size == 0 and wall.amplitude != 0.0:
                    carried = carried_by_wall(
                        push, where, active, blades, wall, speed, time, step
                    )  # what the columns take for impact
                    ledger[ROTATION] += carried
                    ledger[IMPACT] += carried
                to_spectrum(push, where, active, turns, 2 * k, lam)
                book_contacts(
                    push, where, active, before, last, counter, ledger, impulse, step
                )
            if thrust != 0.0:
                ledger[PULSE] += pulse_work(
                    s_c, c_c, lam, ring_size, k, thrust, lobe, sign,
                    angle_of(wall, speed, time), counter,
                )  # fmt: skip
            if counter[STEP] % FLUSH_EVERY == 0:
                flush(s_b)
                flush(s_c)
            keep = counter[STEP] % strides.traces == 0
            judge = counter[STEP] % strides.evidence == 0
            if counter[STEP] >= counter[NEXT_LOOK]:
                far = farthest(limit, s_b, c_b, out_b, wave, sizes, looking)
                watch(far, limit, counter)
            if keep or judge:
                sample_waves(
                    step, speed, mu, wall, rotor, casing, turns, wave, state, space,
                    exact, keep, judge, tracks,
                )  # fmt: skip

    return march


march_waves = kernel(marching(False))
march_flowing_waves = kernel(marching(True))
