"""Kernel of any rotor in a round casing: real rotor modes, the ring in slots.

In the frame of the blades the ring is the same at every angle, for any rotor: its
harmonics are in slots (nodal diameters of the blades) as in `cyclic`, and the Delassus
matrix W = W_rotor + W_ring is constant. The m modes of the rotor are real and not in
slots; with gamma and sigma (N, m) the radial and tangential displacements of the tips
times -1,

g_j = gap + Re sum_kappa G_kappa e^{2 pi i kappa j / N} + sum_m gamma_jm q_m,

and the multipliers give the modal forces lambda gamma, and mu lambda sigma by friction.
Modal forces are summed only over the blades in contact and, like those on the ring, act
in the next pass. `stepping.pass_modes` has one mode of the rotor where the cyclic
kernel has those of a slot, and modal forces for the spectrum of the multipliers.
"""

from __future__ import annotations

import math

import numpy as np

from hpcwhirl.dynamics.kernels.bodies import FLUSH_EVERY
from hpcwhirl.dynamics.kernels.circulant import constant_space, guess, solved
from hpcwhirl.dynamics.kernels.compiled import inlined, kernel, rare
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
    gap_at,
    note_slip,
    pulse_of,
    slips_now,
    watch,
    write_sample,
)
from hpcwhirl.dynamics.kernels.cyclic import (
    angle_of,
    check_sizes,
    flush,
    read_before,
    to_spectrum,
    widths,
)
from hpcwhirl.dynamics.kernels.differences import CENTRAL
from hpcwhirl.dynamics.kernels.keep_inverse import recall
from hpcwhirl.dynamics.kernels.kernel_types import Arrays, CyclicState, Wanted
from hpcwhirl.dynamics.kernels.passes import (
    ITEMS,
    RING_STATE,
    ROTOR_STATE,
    copy_to,
    filled_rows,
    pulse_work,
    push_pulse,
    to_gaps,
)
from hpcwhirl.dynamics.kernels.samples import add_ring, note_miss_folded
from hpcwhirl.dynamics.kernels.shape import is_shaped, write_shape
from hpcwhirl.dynamics.kernels.stepping import (
    column_sums,
    energies_of,
    pass_modes,
    pass_ring,
    settle_ring,
    settle_rotor,
)
from hpcwhirl.dynamics.kernels.vectors import (
    FOUR,
    all_aligned,
    broadcast,
    element,
    fma,
    get,
    higher_of,
    load,
    lower_of,
    magnitude,
    store,
    total_of,
)
from hpcwhirl.dynamics.kernels.wave_types import (
    GeneralRotor,
    GeneralSpace,
    UncoupledRotor,
    WholeRotor,
)
from hpcwhirl.dynamics.kernels.whole import (
    EIGHT,
    HELD,
    drift_of,
    lower_all,
    note_slips_of_waves,
    open_whole,
    push_waves,
    read_all,
    read_near,
    seek_near,
    settle_whole,
    turn_waves,
    yield_apart,
)


@inlined
def read_tips(q, gamma, out):
    """Compute the rotor's part of the gaps of all blades: set out (2 wide,), m.

    It is the radial displacement of each tip times -1, in folded order (see
    `circulant.folded`).

    q : (m,) or more, amplitudes of the rotor's modes, m % 8 == 0
    gamma : (2 wide / 8, m, 8) flat, m: the same for unit amplitudes, in groups of eight
        blades, which are read one after the other
    """
    modes = len(gamma) // len(out)
    for v in range(0, len(out), EIGHT):
        a, b, c, d = broadcast(0.0), broadcast(0.0), broadcast(0.0), broadcast(0.0)
        e, f, g, h = broadcast(0.0), broadcast(0.0), broadcast(0.0), broadcast(0.0)
        for m in range(0, modes, FOUR):
            at = v * modes + m * EIGHT
            x, y = broadcast(get(q, m)), broadcast(get(q, m + 1))
            a, b = fma(load(gamma, at), x, a), fma(load(gamma, at + 4), x, b)
            c, d = fma(load(gamma, at + 8), y, c), fma(load(gamma, at + 12), y, d)
            x, y = broadcast(get(q, m + 2)), broadcast(get(q, m + 3))
            e, f = fma(load(gamma, at + 16), x, e), fma(load(gamma, at + 20), x, f)
            g, h = fma(load(gamma, at + 24), y, g), fma(load(gamma, at + 28), y, h)
        store(out, v, (a + c) + (e + g))
        store(out, v + FOUR, (b + d) + (f + h))


@inlined
def close_gaps(tips, gaps, row):
    """Add the rotor's part to the gaps; return the lowest gap and the largest |tip|, m.

    tips : (2 wide,), m, radial displacements of all tips times -1, in folded order (see
        `circulant.folded`)
    gaps, row : m, in and out: gaps in folded order, and the index at which those of the
        step begin; in: without the rotor's part
    """
    least, most = load(gaps, row) + load(tips, 0), broadcast(0.0)
    for v in range(0, len(tips), FOUR):
        tip = load(tips, v)
        gap = load(gaps, row + v) + tip
        store(gaps, row + v, gap)
        least = lower_of(least, gap)
        most = higher_of(most, higher_of(tip, broadcast(0.0) - tip))
    lowest, far = element(least, 0), element(most, 0)
    for i in range(1, FOUR):
        lowest, far = min(lowest, element(least, i)), max(far, element(most, i))
    return lowest, far


@inlined
def to_modes(push, where, active, radial, tangential, lam):
    """Compute the modal forces of the multipliers on a rotor: set lam (2 m,).

    The first m are those of normal forces, the others those of friction over mu.

    push, where, active : multipliers, N, of the blades in contact, where[:active]
    radial, tangential : (N, m) flat, displacements of tips for unit amplitudes, times
        -1
    """
    modes = len(lam) // 2
    for v in range(0, modes, EIGHT):
        a, b, c, d = broadcast(0.0), broadcast(0.0), broadcast(0.0), broadcast(0.0)
        for s in range(active):
            at, x = where[s] * modes + v, broadcast(push[s])
            a, b = fma(load(radial, at), x, a), fma(load(radial, at + FOUR), x, b)
            c = fma(load(tangential, at), x, c)
            d = fma(load(tangential, at + FOUR), x, d)
        store(lam, v, a)
        store(lam, v + FOUR, b)
        store(lam, modes + v, c)
        store(lam, modes + v + FOUR, d)


@kernel
def settle_general(c_b, c_c, state, copies):
    """Copy the states of rotor and ring; complete the last step in the copies.

    That is, the last step's contact forces are applied, and its works and losses added.
    Samples are computed from the copies.

    c_b, c_c : coefficients of the modes of rotor and ring, packed
    copies : out: arrays like rotor, ring, sums_b, sums_c of the state
    """
    t_b, t_c, end_b, end_c = copies
    copy_to(end_b, state.sums_b)
    copy_to(end_c, state.sums_c)
    lam, width = state.lam, len(t_b) // ROTOR_STATE
    counter = state.counter
    settle_rotor(CENTRAL, state.rotor, t_b, c_b, lam, counter, end_b)
    settle_ring(CENTRAL, state.ring, t_c, c_c, lam[2 * width :], counter, end_c)


@inlined
def tip_of(rows, blade, q, modes):
    """Return the displacement of one blade's tip, m, from a rotor's amplitudes.

    rows : (N, modes) flat, displacement of each blade's tip for unit amplitudes
    blade, q : number of the blade, whose row is taken; (modes,), amplitudes
    """
    at, even, odd = blade * modes, broadcast(0.0), broadcast(0.0)
    for m in range(0, modes, EIGHT):
        even = fma(load(rows, at + m), load(q, m), even)
        odd = fma(load(rows, at + m + FOUR), load(q, m + FOUR), odd)
    return total_of(even + odd)


@rare
def farthest(limit, q, rotor):
    """Return the largest magnitude of a tip's displacement (radial, tangential), m.

    It is compared with the limit at which a march stops. If a bound for all tips is
    below `NEAR` times the limit, the bound is returned instead.

    limit, q : m; predicted amplitudes of the rotor
    """
    reach, modes = broadcast(0.0), len(rotor.reach)
    for m in range(0, modes, FOUR):
        reach = fma(load(rotor.reach, m), magnitude(load(q, m)), reach)
    bound = total_of(reach)
    if not bound > NEAR * limit:
        return bound
    far = 0.0
    for j in range(len(rotor.radial) // modes):
        outward = tip_of(rotor.radial, j, q, modes)
        far = max(far, math.hypot(outward, tip_of(rotor.tangential, j, q, modes)))
    return far


@rare
def note_slips(slip_b, slip_c, tangential, turns, known, last, step, counter,
               ledger):  # fmt: skip
    """Raise ledger[SLIP], m/s, to the largest slip of blades in contact in a step.

    The step is the last one; see `contact.note_slip`.

    slip_b : (2 m,), its second half has q_{n+1} - q_{n-1} of the rotor's amplitudes
    slip_c : (2 k,), m, tangential motion of the casing over the same two steps, a
        spectrum of k nodal diameters, padded
    tangential, turns : (N, m) flat, tangential displacements of the tips for unit
        amplitudes, times -1; (N, 2 k) flat, cos and -sin of each nodal diameter at each
        blade
    known, last : blades in contact in the last solution, see `ConstantSpace`; (N,),
        number of the step of each blade's last contact
    step : dt, s
    """
    modes, width = len(slip_b) // 2, len(slip_c)
    own = slip_b[modes:]
    for s in range(known[len(last)]):
        j = known[s]
        if last[j] == counter[LAST]:
            ring = broadcast(0.0)
            for c in range(0, width, FOUR):
                ring = fma(load(turns, j * width + c), load(slip_c, c), ring)
            tip = tip_of(tangential, j, own, modes)
            note_slip(tip + total_of(ring), step, ledger)


@rare
def write_tips(rotor, q, whole, tips):
    """Compute the displacement of the centre and, if `whole`, of all tips: set `tips`.

    tips : (N + 1, 2), m, out: radial and tangential of each tip; in the last row x_o,
        y_o
    q : amplitudes of the rotor
    """
    blades, modes = len(tips) - 1, len(q)
    for axis in range(2):
        tips[blades, axis] = tip_of(rotor.hub, axis, q, modes)
    if whole:
        for j in range(blades):
            tips[j, 0] = -tip_of(rotor.radial, j, q, modes)
            tips[j, 1] = -tip_of(rotor.tangential, j, q, modes)


@rare
def sample_general(step, mu, gap, gaps, row, rotor, c_c, wave, state, space, energies,
                   less, keep, judge, tracks):  # fmt: skip
    """Write a sample of the traces, a row of evidence, or both, for the present step.

    They are computed from copies of the state, in which the last step is completed. At
    a row of evidence with contact, the gaps between the bodies are compared with those
    of the contact problem (see `samples`), which are in `gaps` from `row` on.

    Parameters
    ----------
    mu, gap : friction with the sign of the speed; m, clearance at this step
    space : `GeneralSpace` with the copies, the spectrum of the casing's shape in
        `wall`, and after a step with contact the tips of the copies in `out`
    energies : (2,), energies of rotor and ring in the copies, J
    less : J, subtracted from the summed loss: for waves the rotor's energy, else 0
    keep, judge : whether to write a sample of the traces; a row of the evidence
    """
    counter, ledger = state.counter, state.ledger
    _, _, _, _, _, _, t_b, t_c, end_b, end_c, wall, out, again, tips, whole, _, _ = (
        space
    )
    m, n = len(rotor.hub) // 2, len(t_c) // RING_STATE
    q = t_b[:m]
    if judge and counter[LAST] == counter[STEP]:
        k = len(wall) // 2
        add_ring(t_c, c_c, k, wall)
        to_gaps(wall, wave, gap, k, len(out) // 2, again, 0)
        _, reach = close_gaps(out, again, 0)
        blades = len(state.last)
        note_miss_folded(again, gaps, row, reach, gap, blades, ledger)
    write_tips(rotor, q, keep and len(tracks.tips) > 0, tips)
    rotation, impact, drag, loss = column_sums(CENTRAL, end_b, end_c, step)
    copy_to(whole, ledger)
    whole[ROTATION] += rotation
    whole[IMPACT] += impact
    whole[FRICTION] += mu * drag
    write_sample(
        counter, whole, state.impulse, tips, t_c[: 2 * n], energies, loss - less, keep,
        judge, tracks,
    )  # fmt: skip


def general_space(arrays: Arrays, state: CyclicState) -> GeneralSpace:
    """Return the work space of the general kernel, which is not saved with the state.

    arrays, state : constant arrays of the kernel; the march's state
    """
    check_sizes("general", arrays, state, own_sizes(arrays, state))
    blades, wide = len(state.last), len(state.gaps) // 6
    modes, width = len(arrays.rotor.hub) // 2, len(state.sums_c) // 2
    bodies = state.rotor, state.ring, state.sums_b, state.sums_c
    longest = modes + -(-blades // EIGHT) * EIGHT  # columns of `WholeRotor.opens`
    own = [longest, width, 2 * modes, width, blades]
    sizes = [*own, *map(len, bodies), width, 2 * wide, 2 * wide, 2 * wide]
    (spare, spectrum, slip_b, slip_c, before, *sample, opened) = all_aligned(
        [*map(np.zeros, sizes)]
    )
    solver = constant_space(blades, wide, arrays.contact.w, state.known)
    tips, ledger = np.zeros((blades + 1, 2)), np.zeros_like(state.ledger)
    step = spare, spectrum, slip_b, slip_c, before
    filled = filled_rows(arrays.casing.items, width // 2)
    return GeneralSpace._make([*step, solver, *sample, tips, ledger, opened, filled])


def own_sizes(arrays: Arrays, state: CyclicState) -> Wanted:
    """Return (name, array, required number of values) of the rotor's arrays.

    They are checked by `cyclic.check_sizes` before the first step.
    """
    blades, rotor = len(state.impulse), arrays.rotor
    modes, (k, _) = len(rotor.hub) // 2, widths(blades)
    modes = modes // EIGHT * EIGHT
    waves = isinstance(rotor, WholeRotor | UncoupledRotor)
    own = _of_waves if waves else _of_modes
    return [
        *own(rotor, state, modes, k), ("hub", rotor.hub, 2 * modes),
        ("radial", rotor.radial, blades * modes),
        ("tangential", rotor.tangential, blades * modes),
        ("reach", rotor.reach, modes),
        ("w", arrays.contact.w, blades * blades),
    ]  # fmt: skip


def _of_modes(rotor: GeneralRotor, state: CyclicState, modes: int, k: int) -> Wanted:
    return [
        ("rotor", state.rotor, modes * ROTOR_STATE),
        ("lam", state.lam, 2 * modes + 4 * k), ("sums_b", state.sums_b, 3 * modes),
        ("rotor items", rotor.items, ITEMS * modes),
        ("read", rotor.read, 2 * widths(len(state.impulse))[1] * modes),
    ]  # fmt: skip


def _of_waves(
    rotor: WholeRotor | UncoupledRotor, state: CyclicState, modes: int, k: int
) -> Wanted:
    blades = len(state.impulse)
    padded = -(-blades // EIGHT) * EIGHT
    rows, drift = blades * (modes + padded), len(rotor.drift)
    each = [
        ("form", rotor.form, modes * (modes + FOUR) // 2),
        ("drift", rotor.drift, modes // 2),
    ]
    if isinstance(rotor, UncoupledRotor):
        each = [
            ("form", rotor.form, 3 * modes), ("drift", rotor.drift, modes),
            ("gives", rotor.gives, 2 * modes), ("moves", rotor.moves, 2 * modes),
        ]  # fmt: skip
    return [
        *each, ("rotor", state.rotor, 2 * drift + padded),
        ("ahead", rotor.ahead, 2 * drift), ("read", rotor.read, blades * modes),
        ("ring", rotor.ring, len(state.gaps) // 3 * blades),
        ("lam", state.lam, HELD * padded + 4 * k), ("sums_b", state.sums_b, 3),
        ("push", rotor.push, blades * modes), ("opens", rotor.opens, rows),
        ("slides", rotor.slides, rows),
    ]  # fmt: skip


def marching(waves):
    """Return the time loop of the general kernel, to be compiled.

    waves : whether the rotor is represented by waves (`whole`) instead of real modes
    """

    def march(
        steps, strides, limit, step, speed, mu, wall, loading, rotor, casing, contact,
        state, tracks, space,
    ):  # fmt: skip
        """Integrate rotor and ring over `steps` steps, or until the march has to stop.

        `bodies.march_bodies` explains the arguments; space : result of `general_space`
        """
        force, pulse, lobe = loading
        gamma = rotor.read
        c_c, sign = casing
        _, turns, wave = contact
        s_b, s_c, lam, gaps, sums_b, sums_c, _, last, counter, ledger, impulse = state
        spare, spectrum, slip_b, slip_c, before, solver = space[:6]
        spectrum_of_wall, out = space.wall, space.out
        push, known, where = solver.push, solver.known, solver.where
        opening = solver.rows
        blades, wide, k = len(last), len(gaps) // 6, len(sums_c) // 4
        ring_size = len(s_c) // RING_STATE
        driven = is_shaped(wall)
        lam_b, lam_c = lam[: len(lam) - 4 * k], lam[len(lam) - 4 * k :]
        recall(blades, wide, solver)
        drift, fresh, active = 0.0, True, blades - blades
        whole = space.opened if waves else gaps
        goal = counter[STEP] + steps
        while counter[STEP] < goal and counter[STOP] == RUNNING:
            if waves:
                turn_waves(s_b, rotor.ahead)
            else:
                size = len(s_b) // ROTOR_STATE
                pass_modes(
                    CENTRAL, s_b, rotor.items, lam_b, 1, size, counter, spare, sums_b,
                    slip_b,
                )  # fmt: skip
            pass_ring(
                CENTRAL, s_c, c_c, lam_c, space.filled, k, counter, spectrum, sums_c,
                slip_c,
            )  # fmt: skip
            if slips_now(counter):
                if waves:
                    note_slips_of_waves(
                        lam_b, slip_c, turns, known, last, step, counter[LAST], ledger
                    )
                else:
                    note_slips(
                        slip_b, slip_c, rotor.tangential, turns, known, last, step,
                        counter, ledger,
                    )  # fmt: skip
            thrust = pulse_of(counter[STEP] * step, force, pulse)
            counter[STEP] += 1
            time, angle = counter[STEP] * step, 0.0
            if thrust != 0.0:
                angle = angle_of(wall, speed, time)
                push_pulse(
                    s_c, c_c, ring_size, thrust, lobe, sign, angle, counter, spectrum, k
                )
            if driven:
                write_shape(wall, time, speed, spectrum)
            row = counter[STEP] % 3 * 2 * wide
            place = row - row if waves else row
            gap = gap_at(wall, time)
            to_gaps(spectrum, wave, gap, k, wide, gaps, row)
            looks = counter[STEP] >= counter[NEXT_LOOK]
            judge = counter[STEP] % strides.evidence == 0
            if waves:
                every = judge or fresh
                lowest = lower_all(out, drift, gaps, row, whole)
                if not every and not lowest > 0.0:
                    lowest = read_near(
                        gamma, s_b, blades, gaps, row, known, out, whole, where
                    )
                if every:
                    read_all(gamma, s_b, blades, out)
                    lowest = open_whole(out, gaps, row, whole)
                    fresh = False
                if every or looks:
                    drift = drift_of(s_b, rotor.drift)
            else:
                read_tips(s_b, gamma, out)
                lowest, _ = close_gaps(out, gaps, row)
            if looks:
                watch(farthest(limit, s_b, rotor), limit, counter)
            if lowest < 0.0:
                if waves:
                    active = guess(whole, place, lowest, blades, wide, solver)
                    if active < 0:
                        active = seek_near(
                            gamma, s_b, gaps, row, out, whole, lowest, blades, solver
                        )
                else:
                    active = solved(whole, place, lowest, blades, wide, solver)
                if active < 0:
                    counter[STOP] = COMPLEMENTARITY
                    return
                older = (counter[STEP] + 1) % 3 * 2 * wide
                read_before(gaps, older, where, active, blades, wide, before)
                if waves:
                    yield_apart(
                        push, where, active, opening, rotor.ring, gaps, row, out
                    )
                    push_waves(
                        rotor, push, where, active, s_b, spare, mu, counter[STEP], out,
                        gaps, row, before, sums_b, lam_b,
                    )  # fmt: skip
                    drift = drift_of(s_b, rotor.drift)
                else:
                    to_modes(push, where, active, rotor.radial, rotor.tangential, lam_b)
                to_spectrum(push, where, active, turns, 2 * k, lam_c)
                book_contacts(
                    push, where, active, before, last, counter, ledger, impulse, step
                )
            if thrust != 0.0:
                ledger[PULSE] += pulse_work(
                    s_c, c_c, lam_c, ring_size, k, thrust, lobe, sign, angle, counter
                )  # fmt: skip
            if counter[STEP] % FLUSH_EVERY == 0:
                flush(s_b)
                flush(s_c)
            keep = counter[STEP] % strides.traces == 0
            if keep or judge:
                for c in range(2 * k):
                    spectrum_of_wall[c] = 0.0
                if driven:
                    write_shape(wall, time, speed, spectrum_of_wall)
                copies, now, less = space[6:10], counter[STEP] & 1, 0.0
                touched = counter[LAST] == counter[STEP]
                if waves:
                    settle_whole(c_c, state, copies)
                    if touched:
                        read_all(gamma, space.rotor, blades, out)
                else:
                    settle_general(rotor.items, c_c, state, copies)
                    if touched:
                        read_tips(space.rotor, gamma, out)
                energies = energies_of(
                    rotor, CENTRAL, space.rotor, space.ring, c_c, now, step
                )
                if waves:
                    less = energies[0]
                sample_general(
                    step, mu, gap, whole, place, rotor, c_c, wave, state, space,
                    energies, less, keep, judge, tracks,
                )  # fmt: skip

    return march


march_general = kernel(marching(False))
march_whole = kernel(marching(True))
