"""Steps of the loop `points` for equal sectors with one contact point a tip.

All waves are passed over once a step, see `slots`; the gaps of all blades follow from
their spectrum by one transform, which is left out in steps in which no gap can close,
see `skipped`.
"""

from __future__ import annotations

import math

import numpy as np

from hpcwhirl.dynamics.kernels.compiled import does, inlined, part, rare, rare_kernel
from hpcwhirl.dynamics.kernels.contact import (
    BESIDE_X,
    BESIDE_Y,
    ENDED,
    FRICTION,
    IMPACT,
    JUDGED,
    LAST,
    NEAR,
    OF_WHOLE,
    PULSE,
    ROTATION,
    SAMPLE,
    STEP,
    angle_at,
    book_contacts,
    gap_at,
    note_slip,
    slides_at,
    slips_now,
    write_sample,
)
from hpcwhirl.dynamics.kernels.coulomb import constant_response
from hpcwhirl.dynamics.kernels.keep_inverse import recall
from hpcwhirl.dynamics.kernels.kernel_types import (
    Arrays,
    CyclicState,
    Wanted,
    check_places,
    check_sizes,
)
from hpcwhirl.dynamics.kernels.layer import (
    close_from,
    is_inside,
    keep_depth,
    layer_space,
    press_rods,
    wear_rods,
)
from hpcwhirl.dynamics.kernels.loop.circulant import by_slots, circulant_space, solved
from hpcwhirl.dynamics.kernels.loop.cyclic import read_before
from hpcwhirl.dynamics.kernels.loop.passes import (
    copy_to,
    one_norm,
    sum_of,
    to_gaps,
    to_gaps_seldom,
)
from hpcwhirl.dynamics.kernels.loop.point_verbs import (
    advance,
    conclude,
    farthest,
    kick,
    sample,
    set_out,
    touch,
    work_of_kick,
)
from hpcwhirl.dynamics.kernels.loop.skipped import (
    STEPS,
    begin_unseen,
    catch_up,
    gaps_if_near,
)
from hpcwhirl.dynamics.kernels.loop.slot_slides import (
    KINDS,
    NUMBER,
    PUSH,
    RUBBED,
    is_loose,
    keep_aside,
    keep_gaps,
    rub_aside,
    slide_slots,
)
from hpcwhirl.dynamics.kernels.loop.slots import (
    CASING,
    DRIVEN,
    FIXED,
    FLOW,
    FLOW_CASING,
    FREE,
    PART,
    PUSHED,
    SEEN,
    TURNING,
    add_driven,
    drive_slots,
    energies_of_slots,
    is_flow,
    is_pending,
    pass_slots,
    read_slots,
    seen_at,
    settle_slots,
    spectrum_of,
    stand_slots,
    swirl_slots,
    to_spectrum,
    turn_slots,
    turning_of_slots,
    weigh_slots,
)
from hpcwhirl.dynamics.kernels.loop.transform import BEHIND
from hpcwhirl.dynamics.kernels.loop.wave_types import FlowRows, SlotRows, SlotSpace
from hpcwhirl.dynamics.kernels.samples import at_blade, note_miss_folded
from hpcwhirl.dynamics.kernels.shape import carried_by_shape, is_shaped, write_shape
from hpcwhirl.dynamics.kernels.standing import room_of
from hpcwhirl.dynamics.kernels.vectors import (
    FOUR,
    aligned_zeros,
    load,
    store,
)


@does(set_out, FlowRows)
@does(set_out, SlotRows)
@inlined
def set_out_slots(_rows, state, space):
    """Prepare the work space: no bound of any gap is known yet.

    The implementation of `point_verbs.set_out`, with its arguments, for slots.
    """
    recall(len(state.last), len(space.out) // 2, space.solver)
    begin_unseen(len(state.lam) // 2, space.seen, space.skipped)


@rare
def note_slips(rows, state, space, step):
    """Raise ledger[SLIP] to the largest slip of a blade in contact in one step, m/s.

    The motion along the casing is completed by that of a pulse, and of a force of the
    supports, in the same step.
    """
    last, slip, rubbed = state.last, space.slip, space.rubbed
    k = len(slip) // 2
    if len(rubbed) > 0 and rubbed[2 * k * NUMBER] == state.counter[STEP]:
        for c in range(2 * k):
            slip[c] += rubbed[c]
    for more in (space.kicked, space.held):
        if more[2] == state.counter[STEP]:
            slot = int(more[3])
            slip[slot] += more[0]
            slip[k + slot] += more[1]
    for j in range(len(last)):
        if last[j] == state.counter[LAST]:
            note_slip(at_blade(slip, rows.turns, j, 2 * k), step, state.ledger)


@does(advance, FlowRows)
@does(advance, SlotRows)
@inlined
def advance_slots(rows, rotor, contact, wall, step, speed, state, space):
    """Take a step without contact forces, after those of the last step.

    The implementation of `point_verbs.advance`, with its arguments, for slots.
    """
    drive, pending = rotor.drive, is_pending(state.counter)
    if len(contact.slides.at) > 0:
        keep_aside(contact.slides, state.rotor, space.past)
    pass_slots(
        rows, state.rotor, state.lam, state.counter, space.spectrum, state.sums_b,
        space.slip, (rotor.support, space.push, space.turned),
    )  # fmt: skip
    if len(drive.turning) > 0:
        turn_slots(rows, drive, state.rotor, state.sums_c)
        drive_slots(drive, state.rotor, len(space.spectrum) // 2, space.spectrum)
        if drive.weight.shape[1] + len(drive.held.gaps) > 0:
            hold_driven(rows, drive, wall, step, speed, state, space)
    if pending and slips_now(state.counter):
        note_slips(rows, state, space, step)


@part
def hold_driven(rows, drive, wall, step, speed, state, space):
    """Add the weight's and the supports' effect in a step at a changing speed.

    drive : `wave_types.SlotDrive`; others as in `point_verbs`
    """
    number, k = state.counter[STEP], len(space.spectrum) // 2
    angle, (_, older) = (
        angle_at(wall, speed, number * step),
        seen_at(rows, number, state.rotor),
    )
    weigh_slots(drive, state.rotor, angle, k, space.spectrum)
    if len(drive.held.gaps) > 0:
        stand_slots(
            drive.held, state.rotor, angle, older, k, space.push, space.spectrum,
            state.sums_c,
        )  # fmt: skip


@part
def book_held(slides, slot, state, space):
    """Enter the work of a step's contact forces on what the supports' forces move.

    The pass does not see its motion along the casing.

    slides, slot : as in `wave_types.SlotSupport`
    """
    lam, sums, held = state.lam, state.sums_b, space.held
    k, re, im = len(lam) // 2, 0.0, 0.0
    for p in range(0, len(slides), 2):  # times conj(x + i y)
        a, b = slides[p], slides[p + 1]
        x, y = space.push[p], space.push[p + 1]
        re += a * x + b * y
        im += b * x - a * y
    sums[k + slot] += lam[slot] * re + lam[k + slot] * im
    held[0], held[1], held[2], held[3] = re, im, state.counter[STEP], slot


@part
def book_swing(support, state):
    """Remove the work of a step's contact forces on the orbit of an unbalanced rotor.

    The pass sees that orbit, which the rotor has without contact, and which has no part
    in the works.

    support : `wave_types.SlotSupport`
    """
    lam, sums, q = state.lam, state.sums_b, state.rotor
    k, slot = len(lam) // 2, support.slot
    if support.orbit >= 0:
        a, b = q[support.orbit], q[support.orbit + FOUR]
        c, d = support.swing[0], support.swing[1]
        sums[slot] -= lam[slot] * (c * a - d * b) + lam[k + slot] * (d * a + c * b)


@rare
def settle(rows, step, state, space):
    """Apply the contact forces of the last step, if they are pending."""
    if is_pending(state.counter):
        settle_slots(
            rows, state.rotor, state.lam, state.counter, state.sums_b, space.slip
        )
        if slips_now(state.counter):
            note_slips(rows, state, space, step)
        state.counter[ENDED] = state.counter[STEP]


@does(farthest, FlowRows)
@does(farthest, SlotRows)
@rare
def farthest_slot(rows, rotor, limit, state, space):
    """Return the largest displacement of a tip (radial and tangential), m.

    The implementation of `point_verbs.farthest`, with its arguments, for slots.
    """
    radial, along, outward, beside = space.radial, space.along, space.out, space.again
    read_slots(rows, state.rotor, radial, along)
    add_driven(rotor.drive, state.rotor, radial, along)
    k, wide = len(radial) // 2, len(outward) // 2
    bound = math.hypot(one_norm(radial, 2 * k), one_norm(along, 2 * k))
    if not bound > NEAR * limit:
        return bound
    to_gaps_seldom(radial, rows.wave, 0.0, k, wide, outward, 0)
    to_gaps_seldom(along, rows.wave, 0.0, k, wide, beside, 0)
    most = 0.0
    for i in range(2 * wide):
        most = max(most, math.hypot(outward[i], beside[i]))
    return most


@does(kick, FlowRows)
@does(kick, SlotRows)
@rare
def kick_slots(_rows, rotor, thrust, angle, state, space):
    """Add the effect of the pulse to the casing's waves and to the gaps' spectrum.

    The implementation of `point_verbs.kick`, with its arguments, for slots.
    """
    pulse, q, spectrum = rotor.pulse, state.rotor, space.spectrum
    k, real, imag = len(spectrum) // 2, 0.0, 0.0
    c, s = math.cos(angle), pulse.sign * math.sin(angle)
    for p in range(len(pulse.at)):
        m, a, b = pulse.at[p], pulse.move[p, 0], pulse.move[p, 1]
        re, im = q[m], q[m + FOUR]
        real += a * re - b * im
        imag += b * re + a * im
        a, b = thrust * pulse.push[p, 0], thrust * pulse.push[p, 1]
        q[m] += a * c - b * s
        q[m + FOUR] += a * s + b * c
    spectrum[pulse.slot] += pulse.numbers[0] * thrust * c
    spectrum[k + pulse.slot] += pulse.numbers[0] * thrust * s
    return real * c + imag * s


@does(work_of_kick, FlowRows)
@does(work_of_kick, SlotRows)
@rare
def work_of_slots(_rows, rotor, thrust, angle, moved, state, space):
    """Return the work of the pulse in a step, J.

    The implementation of `point_verbs.work_of_kick`, with its arguments, for slots.
    """
    pulse, lam, sums = rotor.pulse, state.lam, state.sums_b
    k, slot, numbers = len(lam) // 2, pulse.slot, pulse.numbers
    both, c, s = moved + numbers[1] * thrust, math.cos(angle), math.sin(angle)
    if state.counter[LAST] == state.counter[STEP]:
        re, im = lam[slot], lam[k + slot]
        a, b = numbers[2], numbers[3]
        real, imag = a * re - b * im, b * re + a * im
        both += real * c + imag * pulse.sign * s
        both += moved_by_rub(pulse, c, pulse.sign * s, state, space)
        # contact works on the motion by the pulse, too, which the pass does not see
        here, beside = thrust * c, thrust * pulse.sign * s
        sums[slot] += numbers[4] * (re * here + im * beside)
        a, b = numbers[5], numbers[6]
        real, imag = a * here - b * beside, b * here + a * beside
        sums[k + slot] += re * real + im * imag
        space.kicked[0], space.kicked[1] = real, imag
        space.kicked[2], space.kicked[3] = state.counter[STEP], slot
        a, b = numbers[7], numbers[8]
        real, imag = a * here - b * beside, b * here + a * beside
        sums[2 * k + slot] += re * real + im * imag
    state.sums_c[0] += 0.5 * thrust * both
    return 0.5 * thrust * both


@part
def moved_by_rub(pulse, c, s, state, space):
    """Return the motion, m, on which the pulse works, by the rest of friction.

    That is set-valued friction beyond that of permanent sliding, see `slot_slides`.

    c, s : cos and sin of the pulse's angle, in the frame of its slot
    """
    rubbed, k = space.rubbed, len(state.lam) // 2
    if len(rubbed) == 0 or rubbed[2 * k * NUMBER] != state.counter[STEP]:
        return 0.0
    at = 2 * k * PUSH + pulse.slot
    re, im, a, b = rubbed[at], rubbed[k + at], pulse.numbers[9], pulse.numbers[10]
    return (a * re - b * im) * c + (b * re + a * im) * s


@does(touch, FlowRows)
@does(touch, SlotRows)
@inlined
def touch_slots(rows, rotor, contact, wall, mu, step, speed, thrust, angle, _every,
                _looks, state, space):  # fmt: skip
    """Find the contact forces of a step, which stay pending until the next one.

    The implementation of `point_verbs.touch`, with its arguments, for slots.
    """
    counter, gaps, spectrum, solver = (
        state.counter, state.gaps, space.spectrum, space.solver,
    )  # fmt: skip
    time, blades = counter[STEP] * step, len(state.last)
    k, wide, now = len(spectrum) // 2, len(gaps) // 6, counter[STEP] % 3
    if is_shaped(wall):
        write_shape(wall, time, speed, spectrum)
    gap = gap_at(wall, time)
    if is_flow(rows):
        lowest = to_gaps(spectrum, rows.wave, gap, k, wide, gaps, now * 2 * wide)
    else:
        lowest = gaps_if_near(
            spectrum, rows.wave, gap, k, wide, gaps, now, space.seen, space.skipped
        )
    if not lowest < 0.0 and not is_inside(state.entered):
        return 0
    if is_loose(contact.slides):
        keep_gaps(gaps, now * 2 * wide, space.again)
    if len(state.entered) > 0:
        turned = angle_at(wall, speed, time) % (2.0 * math.pi)
        started = angle_at(wall, speed, (counter[STEP] - 1) * step)
        active = press_rods(
            contact.rods, turned, started, speed, gaps, now * 2 * wide, lowest, state,
            solver, space.layer,
        )  # fmt: skip
    else:
        active = solved(gaps, now * 2 * wide, lowest, blades, wide, solver)
    if active > 0:
        write_forces(rows, active, state, space)
    if active != 0 and is_loose(contact.slides):
        moves = slides_at(wall, speed, contact.slides.law.radius, time, step)
        active = slide_slots(
            rows, rotor, contact, mu, speed, moves, thrust, angle, active, state, space
        )  # fmt: skip
    if len(state.entered) > 0 and active >= 0:
        wear_rods(contact.rods, active, state, solver, space.layer)
    if active > 0 and len(contact.slides.at) > 0:
        rub_aside(contact.slides, mu, state, space)
    if active > 0:
        if is_flow(rows) and is_shaped(wall):
            carried = carried_by_shape(
                solver.push, solver.where, active, blades, wall, speed, time, step
            )  # this work is missing in the sums by slot
            state.ledger[ROTATION] += carried
            state.ledger[IMPACT] += carried
        keep_forces(rows, active, step, state, space)
        if not is_flow(rows) and len(rotor.support.reads) > 0:
            book_held(rotor.support.slides, rotor.support.slot, state, space)
            book_swing(rotor.support, state)
        if not is_flow(rows) and len(rotor.drive.held.gaps) > 0:
            book_held(rotor.drive.held.slides, rotor.drive.held.slot, state, space)
        if not is_flow(rows) and len(rotor.drive.turning) > 0:
            drive = rotor.drive
            swirl_slots(
                rows, drive.swirl, drive.swirls, state.rotor, state.lam, state.sums_c
            )
    return active


@inlined
def write_forces(rows, active, state, space):
    """Compute the spectrum of a step's contact forces, with permanent sliding.

    active : number of blades in contact, the first ones of the solver's
    """
    solver, lam = space.solver, state.lam
    if by_slots(active, solver) and len(state.entered) == 0:
        for c in range(0, len(lam), FOUR):
            store(lam, c, load(solver.spectrum, c))
    else:
        push, where = solver.push, solver.where
        to_spectrum(push, where, active, rows.turns, len(lam), lam)


@inlined
def keep_forces(rows, active, step, state, space):
    """Enter the impulses of a step's contact forces, with the gaps two steps before.

    active : number of blades in contact, the first ones of the solver's
    """
    counter, gaps, solver = state.counter, state.gaps, space.solver
    k, wide, older = len(state.lam) // 2, len(gaps) // 6, (counter[STEP] + 1) % 3
    push, where, before = solver.push, solver.where, space.before
    if not is_flow(rows):
        catch_up(rows.wave, k, wide, gaps, older, space.seen, space.skipped)
        row = older * 2 * wide
        read_before(gaps, row, where, active, len(state.last), wide, before)
        close_from(state.entered, where, active, before)
    book_contacts(
        push, where, active, before, state.last, counter, state.ledger, state.impulse,
        step,
    )  # fmt: skip


@rare
def note_miss_of_slots(rows, drive, wall, step, speed, state, space):
    """Raise ledger[MISS] to the largest error of a step's solved gaps, if larger.

    The gaps of the contact problem are compared with those of the amplitudes.
    """
    again, spectrum, counter = space.again, space.spectrum, state.counter
    time, k, wide = counter[STEP] * step, len(spectrum) // 2, len(again) // 2
    gap, reach = gap_at(wall, time), one_norm(space.radial, 2 * k)
    spectrum_of(rows, state.rotor, spectrum)
    add_driven(drive, state.rotor, spectrum, space.along)
    if is_shaped(wall):
        write_shape(wall, time, speed, spectrum)
    to_gaps_seldom(spectrum, rows.wave, gap, k, wide, again, 0)
    row = counter[STEP] % 3 * 2 * wide
    note_miss_folded(again, state.gaps, row, reach, gap, len(state.last), state.ledger)


@part
def read_hub(rotor, q, tips):
    """Compute the displacement of the shaft's centre: set the last row of tips, m."""
    for axis in range(2):
        total = 0.0
        for h in range(len(rotor.centre)):
            m = rotor.centre[h]
            total += rotor.hub[axis, h, 0] * q[m] + rotor.hub[axis, h, 1] * q[m + FOUR]
        tips[-1, axis] = total


@rare_kernel
def works_of_slots(rows, sums, step):
    """Return three works so far, J: of rotation, impact loss, friction over mu.

    In the exact flow the rotation's work is that of contact forces moved along the
    deformed casing, and the impact loss the remaining work of normal forces; else
    `contact.book_contacts` enters the impact loss and subtracts it from the rotation's.

    sums : (3 k,), see `slots.book_group`
    """
    k = len(sums) // 3
    normal, drag = 0.5 * sum_of(sums, k - k, k), 0.5 * sum_of(sums, k, 2 * k)
    if is_flow(rows):
        carried = -step * sum_of(sums, 2 * k, 3 * k)
        return carried, carried - normal, drag
    return normal, 0.0, drag


@part
def note_driven(rows, drive, state, space, tracks):
    """Record the motion without contact at a changing speed in a row of evidence.

    They are the centre's displacements x_o, y_o, m, in it, and the energy of the
    rotor's whole motion, J.
    """
    row, q, both = tracks.evidence[state.counter[JUDGED]], state.rotor, space.aside
    row[BESIDE_X], row[BESIDE_Y] = 0.0, 0.0
    copy_to(both.rotor, q)
    for i in range(len(drive.at)):
        m, own, hub = drive.at[i], drive.own[i], drive.hub
        row[BESIDE_X] += hub[0, i, 0] * q[m] + hub[0, i, 1] * q[m + FOUR]
        row[BESIDE_Y] += hub[1, i, 0] * q[m] + hub[1, i, 1] * q[m + FOUR]
        both.rotor[own] += q[m]
        both.rotor[own + FOUR] += q[m + FOUR]
    row[OF_WHOLE] = energies_of_slots(rows, both.rotor)[0]


@does(sample, FlowRows)
@does(sample, SlotRows)
@rare
def sample_slots(rows, rotor, wall, mu, step, speed, state, space, keep, judge,
                 tracks):  # fmt: skip
    """Write the state of a step to the traces or to the evidence.

    The implementation of `point_verbs.sample`, with its arguments, for slots. Pending
    contact forces are applied first, which changes no bit of the later motion.
    """
    counter, ledger, q, tips = state.counter, state.ledger, state.rotor, space.tips
    sums, radial, along, whole = state.sums_b, space.radial, space.along, space.ledger
    settle(rows, step, state, space)
    if judge and len(rotor.drive.turning) > 0:
        note_driven(rows, rotor.drive, state, space, tracks)
    if keep:
        keep_depth(state.worn, counter[SAMPLE], tracks.worn)
    width = len(radial)
    traced = keep and len(tracks.tips) > 0
    if judge or traced:
        read_slots(rows, q, radial, along)
        add_driven(rotor.drive, q, radial, along)
    read_hub(rotor, q, tips)
    if traced:
        for j in range(len(state.last)):
            tips[j, 0] = -at_blade(radial, rows.turns, j, width)
            tips[j, 1] = -at_blade(along, rows.turns, j, width)
    if judge and counter[LAST] == counter[STEP]:
        note_miss_of_slots(rows, rotor.drive, wall, step, speed, state, space)
    if keep and len(tracks.casing) > 0:
        for c in range(len(rotor.modes)):
            one, two = rotor.modes[c, 0], rotor.modes[c, 1]
            space.casing[2 * c] = q[one] + q[two]
            space.casing[2 * c + 1] = q[one + FOUR] + q[two + FOUR]
    energies = energies_of_slots(rows, q)
    copy_to(whole, ledger)
    rotation, impact, drag = works_of_slots(rows, sums, step)
    whole[ROTATION] += rotation
    whole[IMPACT] += impact
    whole[FRICTION] += mu * drag
    given = state.sums_c[0]
    if len(rotor.drive.turning) > 0:
        turned = state.sums_c[TURNING] + turning_of_slots(rows, rotor.drive, q)
        whole[PULSE] += turned
        given += turned
    lost = rotation - impact + mu * drag + given - (energies[0] + energies[1])
    write_sample(
        counter, whole, state.impulse, tips, space.casing, energies, lost, keep, judge,
        tracks,
    )  # fmt: skip


@does(conclude, FlowRows)
@does(conclude, SlotRows)
@rare
def conclude_slots(rows, _rotor, _wall, step, _speed, state, space):
    """Complete the state: apply pending contact forces, compute gaps left out.

    The implementation of `point_verbs.conclude`, with its arguments, for slots.
    """
    k, wide = len(state.lam) // 2, len(state.gaps) // 6
    settle(rows, step, state, space)
    state.counter[ENDED] = state.counter[STEP]  # the same however a run is divided
    for older in range(3):
        catch_up(rows.wave, k, wide, state.gaps, older, space.seen, space.skipped)


def slot_space(arrays: Arrays, state: CyclicState) -> SlotSpace:
    """Return the work space of the loop `points` for slots; check the arrays' sizes.

    Raise ModelError if an array or an index is wrong.
    """
    rotor, blades, wide = arrays.rotor, len(state.last), len(state.gaps) // 6
    width, loose = len(state.lam), len(arrays.contact.slides.rows) > 0
    check_sizes("slots", sizes_of_slots(arrays, state))
    check_places("slots", len(state.rotor) - FOUR, {
        "pairs": rotor.rows.pairs, "pulse": rotor.pulse.at, "centre": rotor.centre,
        "modes": rotor.modes, "drive": rotor.drive.at, "driven": rotor.drive.own,
        "held": rotor.drive.held.own, "beside": rotor.drive.held.beside,
    })  # fmt: skip
    sizes = *(width,) * 4, (STEPS + 1) * width + 2 * FOUR, 2 * wide, 2 * wide
    spectrum, slip, radial, along, seen, out, again, past = aligned_zeros(
        *sizes, width * (len(arrays.contact.slides.at) > 0)
    )
    solver = circulant_space(
        blades, wide, arrays.contact.column, state.known, rotor.rows.wave
    )
    stands = rotor.support.stand, rotor.drive.held.stand
    return SlotSpace(
        spectrum, slip, radial, along, seen, np.zeros(STEPS, np.int64),
        np.zeros(blades), solver, out, again, np.zeros((blades + 1, 2)),
        np.zeros(2 * len(rotor.modes)), np.zeros_like(state.ledger),
        np.zeros(4), np.zeros(4), np.zeros(max(map(room_of.py_func, stands))),
        np.full(3, -1.0),
        state._replace(rotor=state.rotor.copy(), counter=state.counter.copy()),
        layer_space.py_func(len(state.entered)),
        constant_response(
            blades, arrays.contact.slides.law, springs=len(state.entered) > 0
        ),
        np.zeros((2 * width + FOUR) * loose), past,
    )  # fmt: skip


def sizes_of_slots(arrays: Arrays, state: CyclicState) -> Wanted:
    """Return (name, array, required number of values) of each array of the loop."""
    rotor, blades, wide = arrays.rotor, len(state.last), len(state.gaps) // 6
    rows, support, width = rotor.rows, rotor.support, len(state.lam)
    own, flows = int(rows.rotor.sum()), isinstance(rows, FlowRows)
    waves = own + int(rows.ring.sum())
    sizes = (FLOW, FLOW_CASING, 0) if flows else (PUSHED, CASING, SEEN)
    groups, lobes, drive = len(rows.rotor), 2 * len(rotor.pulse.at), rotor.drive
    beside, driven = len(drive.free) // DRIVEN * PART, bool(len(drive.turning))
    held, supports = drive.held, len(drive.held.stand.film)
    moved = supports * len(held.own)
    wanted = [
        ("rotor", state.rotor, waves * PART + beside + sizes[2] * width),
        ("lam", state.lam, 2 * FOUR * groups), ("ring", rows.ring, groups),
        ("sums", state.sums_b, 3 * width // 2), ("free", rows.free, waves * FREE),
        ("pushed", rows.pushed, own * sizes[0] + (waves - own) * sizes[1]),
        ("turning", drive.turning, len(rows.energy) * driven),
        ("free of r", drive.free, drive.filled[:, 1].sum() * DRIVEN),
        ("spin", drive.spin, own * FOUR * driven),
        ("swirl", drive.swirl, own * PART * driven),
        ("swirls", drive.swirls, groups * FOUR * driven),
        ("places", held.places, moved), ("moves", held.moves, moved),
        ("gives of supports", held.gives, moved), ("swirl of supports", held.swirl,
        moved), ("nudge", held.nudge, 3 * supports), ("slides", held.slides,
        2 * supports), ("swirls of supports", held.swirls, supports**2),
        ("weight", drive.weight, 2 * len(drive.at) * bool(drive.weight.size)),
        ("fixed", rows.fixed, groups * FIXED), ("along", rows.along, own * PART),
        ("energy", rows.energy, len(rows.pairs) // 2 * PART),
        ("turns", rows.turns, blades * width),
        ("wave", rows.wave, width * wide + BEHIND),
        ("column", arrays.contact.column, blades), ("gaps", state.gaps, 6 * wide),
        ("impulse", state.impulse, blades), ("hub", rotor.hub, 4 * len(rotor.centre)),
        ("push", rotor.pulse.push, lobes), ("move", rotor.pulse.move, lobes),
        ("gives", support.gives, 2 * support.reads.size),
        ("gaps of supports", support.gaps, 4 * FOUR * len(support.stand.film)),
    ]  # fmt: skip
    slides, loose = arrays.contact.slides, len(arrays.contact.slides.rows) > 0
    wanted += [
        ("rows of slides", slides.rows, waves * RUBBED * loose),
        ("fixed of slides", slides.fixed, KINDS * width * loose),
        ("law of slides", slides.law.rotor, 4 * blades**2 * loose),
    ]
    if isinstance(rows, FlowRows):
        jumps = rows.flight.jumps, len(rows.flight.counts) * waves * PART
        wanted += [("jumps", *jumps), ("bounds", rows.flight.bounds, 2 * waves * PART)]
    return wanted
