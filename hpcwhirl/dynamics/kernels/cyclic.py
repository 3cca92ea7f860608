"""The cyclic modal kernel: nodal diameter by nodal diameter, in the rotating frame.

At the N blades, harmonic h of the ring has the values of nodal diameter kappa = h mod
N, or N - (h mod N) if that is less (then conjugated), kappa = 0 .. N // 2. It is
computed with the rotor's modes of that nodal diameter, in the slot kappa. In the
rotating frame no coefficient depends on the position of the blades: with gamma the
radial displacement (of tips times -1) for unit amplitude y of each mode, the
sum of gamma y over the modes of each slot is a spectrum G of the gaps,

g_j = gap + Re sum_kappa G_kappa e^{2 pi i kappa j / N},

one real transform of N points for both bodies; the spectrum of the multipliers,
Lambda_kappa = sum_j lambda_j e^{-2 pi i kappa j / N}, gives every modal force as
(gamma + mu conj(sigma)) Lambda, sigma the tangential displacement; and the Delassus
matrix is constant and circulant.

Sizes follow from the arrays: one kernel of each scheme serves all sizes.
"""

from __future__ import annotations

import math

import numpy as np

from hpcwhirl.dynamics.kernels.bodies import FLUSH_EVERY, TINY
from hpcwhirl.dynamics.kernels.circulant import by_slots, circulant_space, solved
from hpcwhirl.dynamics.kernels.compiled import inlined, kernel, part, rare
from hpcwhirl.dynamics.kernels.contact import (
    COMPLEMENTARITY,
    IMPACT,
    LAST,
    NEAR,
    NEXT_LOOK,
    NEXT_TRY,
    PULSE,
    ROTATION,
    RUNNING,
    STEP,
    STOP,
    angle_at,
    book_contacts,
    gap_at,
    note_slip,
    pulse_of,
    slips_now,
    watch,
)
from hpcwhirl.dynamics.kernels.differences import CENTRAL
from hpcwhirl.dynamics.kernels.flight import fly
from hpcwhirl.dynamics.kernels.flow import EXACT
from hpcwhirl.dynamics.kernels.keep_inverse import length_of_known, place_of, recall
from hpcwhirl.dynamics.kernels.kernel_types import Arrays, CyclicState, Wanted
from hpcwhirl.dynamics.kernels.passes import (
    ITEMS,
    RING_STATE,
    ROTOR_STATE,
    copy_to,
    filled_rows,
    one_norm,
    pulse_work,
    push_pulse,
    slip_of,
    to_gaps,
    to_gaps_seldom,
)
from hpcwhirl.dynamics.kernels.samples import (
    along_of,
    aside_space,
    keep_between,
    put_aside,
    sample_rotor,
    sample_space,
)
from hpcwhirl.dynamics.kernels.shape import carried_by_shape, is_shaped, write_shape
from hpcwhirl.dynamics.kernels.skipped import (
    STEPS,
    begin_unseen,
    catch_up,
    gaps_if_near,
)
from hpcwhirl.dynamics.kernels.stepping import (
    column_sums,
    end_step,
    energies_of,
    pass_ring,
    pass_rotor,
)
from hpcwhirl.dynamics.kernels.transform import BEHIND
from hpcwhirl.dynamics.kernels.vectors import (
    FOUR,
    add_six,
    add_two,
    aligned_zeros,
    broadcast,
    fma,
    load,
    store,
    store_six,
    total_of,
)
from hpcwhirl.dynamics.kernels.wave_types import CyclicSpace, Sizes, WaveRotor
from hpcwhirl.dynamics.kernels.waves import wave_sizes
from hpcwhirl.errors import ModelError


@inlined
def turn_quarter(lam, k):
    """Set the second half of lam (4 k,) to -i times the spectrum in its first half.

    The kernels of the rotor read both. The spectrum is that of the multipliers, N, re,
    then im, at k slots (nodal diameters, padded).
    """
    for v in range(0, k, FOUR):
        store(lam, 2 * k + v, load(lam, k + v))
        store(lam, 3 * k + v, broadcast(0.0) - load(lam, v))


@inlined
def to_spectrum(push, where, size, turns, width, lam):
    """Compute the spectrum of the multipliers: set lam (2 width,), N.

    Its first half is (re, im), its second half (im, -re).

    push, where, size : multipliers, N, of the blades in contact, where[:size]
    turns : (N, width) flat, cos and -sin of each nodal diameter at each blade
    width : twice the number of nodal diameters, padded
    """
    half, whole = width // 2, width - width % (6 * FOUR)
    none = broadcast(-0.0)  # x + (-0) has the bits of x, also if x is 0 or -0
    for v in range(0, whole, 6 * FOUR):
        six = none, none, none, none, none, none
        store_six(lam, v, add_six(push, where, size, turns, width, v, six))
    for v in range(whole, width, 2 * FOUR):
        two = add_two(push, where, size, turns, width, v, (none, none))
        store(lam, v, two[0])
        store(lam, v + FOUR, two[1])
    turn_quarter(lam, half)


@part
def flush(s):
    """Set numbers below 1e-150 in a body's state s to 0, since denormals are slow."""
    for m in range(len(s)):
        if abs(s[m]) < TINY:
            s[m] = 0.0


def widths(blades: int) -> tuple[int, int]:
    """Return (k, wide): padded lengths of a spectrum's real part, and of half the gaps.

    Both are N // 2 + 1, rounded up to a multiple of four: a spectrum has k nodal
    diameters, and an array of all gaps in folded order is (2 wide,), see
    `circulant.folded`.
    """
    slots = -(-(blades // 2 + 1) // FOUR) * FOUR
    return slots, slots


def check_sizes(kernel: str, arrays: Arrays, state: CyclicState, own: Wanted) -> None:
    """Raise ModelError unless arrays have the sizes that a state implies.

    A kernel loads vectors unchecked: it would read beyond the end of an array that is
    too short.

    Parameters
    ----------
    kernel : name of the kernel, for the message
    arrays, state : constant arrays of the kernel; the march's state
    own : (name, array, number of values required) of the arrays of the kernel's rotor;
        those of the ring and of the contact are added here
    """
    blades, ring = len(state.impulse), len(state.ring) // RING_STATE
    k, wide = widths(blades)
    casing, contact = arrays.casing, arrays.contact
    shared: Wanted = [
        ("ring", state.ring, ring // k * k * RING_STATE),
        ("gaps", state.gaps, 6 * wide), ("sums_c", state.sums_c, 4 * k),
        ("known", state.known, length_of_known(blades)), ("last", state.last, blades),
        ("casing items", casing.items, ITEMS * ring), ("load", arrays.load.modal, ring),
        ("turns", contact.turns, blades * 2 * k),
        ("wave", contact.wave, 2 * k * wide + BEHIND),
    ]  # fmt: skip
    for name, array, wanted in [*own, *shared]:
        if array.size != wanted:
            msg = f"{name} of the {kernel} kernel: {array.size} values, not {wanted}"
            raise ModelError(msg)


def own_sizes(arrays: Arrays, state: CyclicState) -> Wanted:
    """Return (name, array, required number of values) of the arrays of the rotor.

    They are checked by `check_sizes` before the first step.
    """
    blades, rotor = len(state.impulse), arrays.rotor
    k, _ = widths(blades)
    size = rotor.hub.shape[1] // (2 * k) * 2 * k
    shared: Wanted = [
        ("lam", state.lam, 4 * k), ("hub", rotor.hub, 2 * size),
        ("column", arrays.contact.column, blades),
    ]  # fmt: skip
    if isinstance(rotor, WaveRotor):
        exact = bool(arrays.contact.flight)
        return [*wave_sizes(rotor, state, size // 2, k, exact=exact), *shared]
    return [
        ("rotor", state.rotor, size * ROTOR_STATE), ("sums_b", state.sums_b, 6 * k),
        ("rotor items", rotor.items, ITEMS * size), *shared,
    ]  # fmt: skip


def space_of(arrays: Arrays, state: CyclicState) -> CyclicSpace:
    """Return the work space of the cyclic kernel, which is not saved with the state.

    arrays, state : constant arrays of the kernel; the march's state
    """
    check_sizes("cyclic", arrays, state, own_sizes(arrays, state))
    blades = len(state.impulse)
    k, wide = widths(blades)
    one, two, three, four, five, rates, slip_b, slip_c, seen = aligned_zeros(
        *[2 * k] * 5, 2 * wide, 4 * k, 2 * k, (STEPS + 1) * 2 * k + 2 * FOUR
    )
    return CyclicSpace(
        one, two, three, rates, (slip_b, slip_c), (four, five), np.zeros(blades),
        sample_space(state, blades, 2 * k),
        circulant_space(
            blades, wide, arrays.contact.column, state.known, arrays.contact.wave
        ),
        aside_space(state), seen, np.zeros(STEPS, np.int64),
        filled_rows(arrays.casing.items, k),
    )  # fmt: skip


@inlined
def sizes_of(rotor, state):
    """Return the numbers of blades, modes and nodal diameters as `wave_types.Sizes`.

    They follow from the lengths of the arrays.

    rotor, state : coefficients of the rotor; state of the cyclic kernel
    """
    k, blades = len(state.lam) // 4, len(state.impulse)
    rows, ring_rows = rotor.hub.shape[1] // (2 * k), len(state.ring) // k
    return Sizes(blades, rows, ring_rows // RING_STATE, k, len(state.gaps) // 6)


@inlined
def angle_of(wall, speed, time):
    """Return the rotor's angle at a time, s, times the number of lobes, rad.

    wall, speed : `kernel_types.Wall`; Omega, rad/s
    """
    return wall.lobes * (angle_at(wall, speed, time) % (2.0 * math.pi))


@inlined
def predict(out_b, out_c, wall, time, speed, spectrum, sizes):
    """Set the spectrum (2 k,) of all gaps without the clearance, m, for a step.

    It is the sum of those of rotor, ring and the casing's departure from the circle.
    There are k slots, one for each nodal diameter, padded.

    out_b, out_c : (2 k,), m, rotor's and ring's parts, re, then im
    wall, time, speed : `kernel_types.Wall`; s; Omega, rad/s
    sizes : `wave_types.Sizes`
    """
    for c in range(0, 2 * sizes.k, FOUR):
        store(spectrum, c, load(out_b, c) + load(out_c, c))
    if is_shaped(wall):
        write_shape(wall, time, speed, spectrum)


@rare
def farthest(rotor, limit, q, out_b, wave, sizes, work):
    """Return the largest magnitude of a tip's displacement (radial, tangential), m.

    It is compared with the limit at which a march stops. If a bound for all tips is
    below `NEAR` times the limit, the bound is returned instead.

    limit : m
    q, out_b : predicted amplitudes of the rotor; (2 k,), m, spectrum of the tips'
        radial displacements times -1
    wave, sizes : see `passes.to_gaps`; `wave_types.Sizes`
    work : work space: (2 k,) for k nodal diameters, and two of (2 wide,), for all
        blades in folded order
    """
    _, rows, _, k, wide = sizes
    spectrum, outward, along = work
    along_of(rotor, q, rows, k, spectrum)
    bound = math.hypot(one_norm(out_b, 2 * k), one_norm(spectrum, 2 * k))
    if not bound > NEAR * limit:
        return bound
    to_gaps_seldom(out_b, wave, 0.0, k, wide, outward, 0)
    to_gaps_seldom(spectrum, wave, 0.0, k, wide, along, 0)
    most = 0.0
    for i in range(2 * wide):
        most = max(most, math.hypot(outward[i], along[i]))
    return most


@rare
def note_slips(slips, turns, known, last, step, k, work, counter, ledger):
    """Raise ledger[SLIP], m/s, to the largest slip of blades in contact in a step.

    The step is that before the present one, number counter[LAST]; the slip is the
    tangential velocity of a tip relative to the casing, see `contact.note_slip`.

    slips : (slip_b, slip_c), m, motions of rotor and ring along the rotation over two
        steps, as spectra of k nodal diameters, padded, see `passes.slip_of`
    turns : (N, 2 k) flat, cos and -sin of each slot at each blade
    known, last : blades in contact in the last solution, see `ConstantSpace`; (N,),
        number of the step of each blade's last contact
    work : (2 k,), work space
    """
    slip_of(slips[0], slips[1], k, work)
    for s in range(known[len(last)]):
        j = known[s]
        if last[j] == counter[LAST]:
            total = broadcast(0.0)
            for c in range(0, 2 * k, FOUR):
                total = fma(load(turns, j * 2 * k + c), load(work, c), total)
            note_slip(total_of(total), step, ledger)


@inlined
def read_before(gaps, row, where, active, blades, wide, before):
    """Copy the gaps, m, that blades in contact had two steps before to `before` (N,).

    gaps, row : gaps in folded order, and the index at which those of that step begin
    where, active : the blades in contact are where[:active]
    """
    for s in range(active):
        before[where[s]] = gaps[row + place_of(where[s], blades, wide)]


@inlined
def prepare(step, speed, wall, state, sample):
    """Prepare a sample: copy the works of the state, compute the casing's spectrum.

    The works, J, are sample.sums_b and sample.sums_c; sample.wall, m, is the spectrum
    of the casing's departure from the circle at the present step.
    """
    copy_to(sample.sums_b, state.sums_b)
    copy_to(sample.sums_c, state.sums_c)
    for c in range(len(sample.wall)):
        sample.wall[c] = 0.0
    if is_shaped(wall):
        write_shape(wall, state.counter[STEP] * step, speed, sample.wall)


@rare
def sample_step(way, step, speed, mu, wall, rotor, casing, turns, wave, state, sample,
                keep, judge, tracks):  # fmt: skip
    """Write a sample of the traces, a row of evidence, or both, for the present step.

    They are computed from a copy of the state in which the last step is completed, so
    that the motion does not depend on them.

    way : `differences.CENTRAL` or `flow.EXACT`
    keep, judge : whether to write a sample of the traces; a row of the evidence
    sample, tracks : `wave_types.SampleSpace`, work space; `kernel_types.Tracks`
    """
    c_c, _ = casing
    counter, wide = state.counter, len(state.gaps) // 6
    t_b, t_c, sums_b, sums_c = (
        sample.rotor, sample.ring, sample.sums_b, sample.sums_c,
    )  # fmt: skip
    prepare(step, speed, wall, state, sample)
    end_step(
        rotor, way, state.rotor, t_b, state.ring, t_c, c_c, state.lam, counter, sums_b,
        sums_c,
    )  # fmt: skip
    sample_rotor(
        rotor, mu, gap_at(wall, counter[STEP] * step), counter[STEP] % 3 * 2 * wide,
        c_c, turns, wave, state,
        energies_of(rotor, way, t_b, t_c, c_c, counter[STEP] & 1, step),
        column_sums(way, sums_b, sums_c, step), sample, keep, judge, tracks,
    )  # fmt: skip


@inlined
def flew(between, strides, step, speed, mu, wall, loading, rotor, c_c, turns, wave,
         flight, state, outs, space, tracks, sizes):  # fmt: skip
    """Jump over steps if no blade can touch for a while; return whether it did.

    between : whether the traces have samples within the jump, which are then written
    strides : `kernel_types.Strides`
    outs : work space for spectra, see `flight.fly`, which explains the other arguments
    """
    counter = state.counter
    begun = counter[STEP]
    if begun < counter[NEXT_TRY] or counter[LAST] == begun:
        return False
    if between:
        put_aside(state, space.aside)
    jumped = fly(
        strides.evidence, step, speed, wall, loading, rotor, c_c, wave, flight, state,
        outs, sizes,
    )  # fmt: skip
    if jumped and between:
        keep_between(
            begun, strides.traces, step, mu, wall.gap, rotor, c_c, turns, wave,
            flight, state, space, tracks, sizes,
        )  # fmt: skip
    return jumped


def marching(way):
    """Return the time loop of the cyclic kernel, to be compiled.

    way : `differences.CENTRAL` or `flow.EXACT`, how its steps end
    """
    exact = way is EXACT

    def march(
        steps, strides, limit, step, speed, mu, wall, loading, rotor, casing, contact,
        state, tracks, space,
    ):  # fmt: skip
        """Integrate rotor and ring over `steps` steps, or until the march has to stop.

        `bodies.march_bodies` explains the arguments; space : result of `space_of`

        The exact flow jumps over steps while no blade can touch, see `flight`.
        """
        force, pulse, lobe = loading
        (c_c, sign), (_, turns, wave, flight) = casing, contact
        s_b, s_c, lam, gaps, sums_b, sums_c, _, last, counter, ledger, impulse = state
        out_b, out_c, spectrum, rates, slips, _, before, sample, solver = space[:9]
        seen, skipped = space.seen, space.skipped
        outs, looking = (out_b, out_c, spectrum, rates), (spectrum, rates, sample.again)
        between = strides.traces % strides.evidence != 0  # else jumps end at samples
        push, known, where = solver.push, solver.known, solver.where
        sizes = sizes_of(rotor, state)
        blades, rows, ring_rows, k, wide = sizes
        ring_size = ring_rows * k
        recall(blades, wide, solver)
        begin_unseen(k, seen, skipped)
        goal = counter[STEP] + steps
        while counter[STEP] < goal and counter[STOP] == RUNNING:
            jumped = False
            if exact:
                jumped = flew(
                    between, strides, step, speed, mu, wall, loading, rotor, c_c, turns,
                    wave, flight, state, outs, space, tracks, sizes,
                )  # fmt: skip
            if not jumped:
                pass_rotor(
                    rotor, way, s_b, lam, rows, k, counter, out_b, sums_b, slips[0]
                )
                pass_ring(
                    way, s_c, c_c, lam, space.filled, k, counter, out_c, sums_c,
                    slips[1],
                )  # fmt: skip
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
                predict(out_b, out_c, wall, time, speed, spectrum, sizes)
                gap = gap_at(wall, time)
                if exact:
                    lowest = to_gaps(spectrum, wave, gap, k, wide, gaps, row)
                else:
                    lowest = gaps_if_near(
                        spectrum, wave, gap, k, wide, gaps, counter[STEP] % 3, seen,
                        skipped,
                    )  # fmt: skip
                if lowest < 0.0:
                    active = solved(gaps, row, lowest, blades, wide, solver)
                    if active < 0:
                        counter[STOP] = COMPLEMENTARITY
                        break
                    if not exact:
                        older = (counter[STEP] + 1) % 3
                        catch_up(wave, k, wide, gaps, older, seen, skipped)
                        read_before(
                            gaps, older * 2 * wide, where, active, blades, wide, before
                        )
                    elif is_shaped(wall):
                        carried = carried_by_shape(
                            push, where, active, blades, wall, speed, time, step
                        )  # this work is missing in the sums by column
                        ledger[ROTATION] += carried
                        ledger[IMPACT] += carried
                    if by_slots(active, solver):
                        for c in range(0, 2 * k, FOUR):
                            store(lam, c, load(solver.spectrum, c))
                        turn_quarter(lam, k)
                    else:
                        to_spectrum(push, where, active, turns, 2 * k, lam)
                    book_contacts(
                        push, where, active, before, last, counter, ledger, impulse,
                        step,
                    )  # fmt: skip
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
                far = farthest(rotor, limit, s_b, out_b, wave, sizes, looking)
                watch(far, limit, counter)
            if keep or judge:
                sample_step(
                    way, step, speed, mu, wall, rotor, casing, turns, wave, state,
                    sample, keep, judge, tracks,
                )  # fmt: skip
        if not exact:
            for older in range(3):
                catch_up(wave, k, wide, gaps, older, seen, skipped)

    return march


march_differences = kernel(marching(CENTRAL))
march_flow = kernel(marching(EXACT))
