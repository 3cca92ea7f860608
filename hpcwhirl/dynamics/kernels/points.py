"""Time loop for one or several contact points a tip: both bodies as waves.

In the frame of the blades no coefficient depends on time: the waves of both bodies have
complex amplitudes that a step multiplies by z, and
each gap is a row of coefficients, for the angle and axial position of its point, times
the amplitudes. Contact points replace blades in all arrays; the Delassus matrix W, of
both bodies, is constant. Further forces are listed after those of the points: the
pulse on the casing, cos and sin, and the force of supports that differ by direction or
have a film on the centre, x and y, see `standing`. Contact forces and energies are
those of the motion that contact causes; the steady motion of an unbalanced rotor is
given by further waves, which open and close gaps. A lost blade has a clearance that is
never closed.

The motion of a point's material from step n - 1 to n + 1, d' + d, d' and d its last two
increments, is a row times s = (q, lambda, pulse), q the amplitudes before any force. As
a harmonic of the casing turns relative to the blades, the gap two steps before does not
follow from d' + d, the displacement of the material, on which works depend. It follows
from further coefficients, `before`.

Arrays of all points, (2 wide,), are in folded order, see `circulant.folded`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hpcwhirl.dynamics.kernels.bodies import FLUSH_EVERY
from hpcwhirl.dynamics.kernels.circulant import constant_space, guess, solved
from hpcwhirl.dynamics.kernels.compiled import inlined, kernel, part, rare, rare_kernel
from hpcwhirl.dynamics.kernels.contact import (
    COMPLEMENTARITY,
    FRICTION,
    LAST,
    NEAR,
    NEXT_LOOK,
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
    write_sample,
)
from hpcwhirl.dynamics.kernels.cyclic import angle_of, flush
from hpcwhirl.dynamics.kernels.keep_inverse import recall
from hpcwhirl.dynamics.kernels.kernel_types import Arrays, CyclicState, Wanted
from hpcwhirl.dynamics.kernels.passes import copy_to
from hpcwhirl.dynamics.kernels.point_rows import (
    begin_moves,
    book_points,
    clear_forces,
    push_points,
    read_close,
    read_every,
    turn_points,
)
from hpcwhirl.dynamics.kernels.samples import note_miss_folded
from hpcwhirl.dynamics.kernels.sectors import room_of_sectors
from hpcwhirl.dynamics.kernels.shape import faded
from hpcwhirl.dynamics.kernels.standing import answer, terms_at
from hpcwhirl.dynamics.kernels.vectors import (
    FOUR,
    all_aligned,
    broadcast,
    element,
    fma,
    get,
    load,
    store,
    total_of,
)
from hpcwhirl.dynamics.kernels.wave_types import PointRows, PointsSpace, SectorRows
from hpcwhirl.dynamics.kernels.whole import (
    EIGHT,
    add_one,
    drift_of,
    lower_all,
    moved_by,
    open_whole,
    tip_by_waves,
)
from hpcwhirl.errors import ModelError


@inlined
def write_clear(clear, gap, gaps, row, wide):
    """Set the gaps of all points in a step to those of undeformed bodies at rest, m.

    clear : (2 wide,), m, clearance of each point beyond `gap`, in folded order
    gap : m, clearance common to all points
    gaps, row, wide : out: array, and index in it where the 2 wide gaps of the step
        begin
    """
    for v in range(0, 2 * wide, FOUR):
        store(gaps, row + v, load(clear, v) + broadcast(gap))


@part
def add_shape(wall, time, speed, waves, gaps, row, wide):
    """Add the casing's departure from the circle, m, to the gaps of all points.

    wall : `kernel_types.Wall`, with the n harmonics of the shape
    time, speed : s; Omega, rad/s
    waves : (n, 2, 2 wide) flat: cos and sin of each harmonic at the points, folded
        order
    gaps, row, wide : in and out: array, and index in it where the 2 wide gaps of the
        step begin
    """
    turned = angle_at(wall, speed, time) % (2.0 * math.pi)
    for r in range(len(wall.orders)):
        a, b = faded(wall, r, time)
        c, s = math.cos(wall.orders[r] * turned), math.sin(wall.orders[r] * turned)
        even, odd = broadcast(a * c + b * s), broadcast(b * c - a * s)
        at = 4 * wide * r
        for v in range(0, 2 * wide, FOUR):
            gap = fma(load(waves, at + v), even, load(gaps, row + v))
            gap = fma(load(waves, at + 2 * wide + v), odd, gap)
            store(gaps, row + v, gap)


@part
def hold_centre(support, q, time, centre):
    """Apply the supports' force on the centre in a step to the amplitudes q of waves.

    Return its components x and y, N, rotating frame.

    support : `wave_types.PointsSupport`
    q : amplitudes, in and out: in those after the step without forces
    time : s, at the step's start, at which the supports' directions are taken
    centre : (n,), out: the amplitudes that change, as they were
    """
    zero, which, reads = broadcast(0.0), support.which, support.reads
    a, b, c, d = zero, zero, zero, zero
    for i in range(0, len(which), FOUR):
        one, two = get(q, which[i]), get(q, which[i + 1])
        three, last = get(q, which[i + 2]), get(q, which[i + 3])
        centre[i], centre[i + 1], centre[i + 2], centre[i + 3] = one, two, three, last
        a = fma(load(reads, FOUR * i), broadcast(one), a)
        b = fma(load(reads, FOUR * (i + 1)), broadcast(two), b)
        c = fma(load(reads, FOUR * (i + 2)), broadcast(three), c)
        d = fma(load(reads, FOUR * (i + 3)), broadcast(last), d)
    both = (a + b) + (c + d)
    place, moving = (
        complex(element(both, 0), element(both, 1)),
        complex(element(both, 2), element(both, 3)),
    )
    held, even, apart = terms_at(support.stand, place, time)
    push = answer(support.stand.give, held, moving, even, apart)
    x, y = push.real, push.imag
    for i in range(support.used):
        gained = get(support.gives, 2 * i) * x + get(support.gives, 2 * i + 1) * y
        q[which[i]] = centre[i] + gained
    return x, y


@inlined
def let_go(support, spare, q, centre):
    """Copy the amplitudes q to `spare` without the supports' force of the step.

    support, centre : as in `hold_centre`, which has set the latter
    spare : (m,) or more, out
    """
    begin_moves(spare, q, len(q))
    for i in range(support.used):
        spare[support.which[i]] = centre[i]


@inlined
def open_tips(push, where, active, opening, tips):
    """Add the change of all gaps by the contact forces of a step to `tips`.

    push, where, active : multipliers, N, of the points where[:active]
    opening : (P, 2 wide) flat, m/N, change of all gaps by a unit multiplier on each of
        P points
    tips : (2 wide,), m, in and out: the waves' part of the gaps, or lower bounds of it,
        in folded order
    """
    width = len(tips)
    for v in range(0, width, FOUR):
        tip = load(tips, v)
        for i in range(active):
            tip = fma(load(opening, where[i] * width + v), broadcast(push[i]), tip)
        store(tips, v, tip)


@rare
def farthest_point(limit, q, rotor, points):
    """Return the largest displacement of a contact point (radial and tangential), m.

    If an upper bound for all points is below `NEAR` times the amplitude limit, the
    bound is returned instead.

    limit, q : m, amplitude limit of the run; (m,), amplitudes of the waves
    rotor, points : `wave_types.PointsRotor`; number of points
    """
    modes, bound = len(rotor.ahead), drift_of(q, rotor.reach)
    if not bound > NEAR * limit:
        return bound
    far = 0.0
    for j in range(points):
        outward = tip_by_waves(rotor.radial, j, q, modes)
        far = max(far, math.hypot(outward, tip_by_waves(rotor.along, j, q, modes)))
    return far


@rare_kernel
def energies_of_points(rotor, q, work):
    """Return (energy of the rotor, energy of the casing), J, from waves' amplitudes.

    rotor, q : `wave_types.PointsRotor`; (m,), amplitudes of the waves of both bodies
    work : (m,) or more, work space
    """
    own, beside, at, energy = 0.0, 0.0, 0, rotor.energy
    for b in range(len(energy.starts) - 1):
        first, size = energy.starts[b], energy.starts[b + 1] - energy.starts[b]
        total = broadcast(0.0)
        for i in range(size):
            work[i] = q[energy.which[first + i]]
        for i in range(size):
            begun, row = i - i % FOUR, broadcast(0.0)
            for m in range(begun, size, FOUR):
                row = fma(load(energy.form, at + m - begun), load(work, m), row)
            total = fma(broadcast(work[i]), row, total)
            at += size - begun
        if b < energy.split:
            own += total_of(total)
        else:
            beside += total_of(total)
    return own, beside


@rare
def note_slips_of_points(held, known, last, step, counted, ledger):
    """Raise ledger[SLIP] to the largest slip of a point in contact in one step, m/s.

    held : in its first entries, the points' motions along the casing over two steps, m,
        see `point_rows.book_points`
    known, last : points in contact in the last solution; step of each point's last
        contact
    step, counted : dt, s; number of the step whose slips are checked
    """
    for s in range(known[len(last)]):
        if last[known[s]] == counted:
            note_slip(held[known[s]], step, ledger)


@rare
def sample_points(mu, gap, row, rotor, state, space, keep, judge, tracks):
    """Write the state of a step to the traces or to the evidence, for points on tips.

    At a row of evidence with contact, the gaps found with the Delassus matrix are
    compared with gaps computed from the amplitudes; the error is entered in
    ledger[MISS].

    mu, gap : friction with the sign of the speed; m, clearance of the step
    row : index in state.gaps of the clearances of the step
    rotor, state, space : `wave_types.PointsRotor`, `kernel_types.CyclicState`,
        `wave_types.PointsSpace`
    keep, judge, tracks : as in `contact.write_sample`
    """
    counter, ledger, q = state.counter, state.ledger, state.rotor
    points, tips, out, again = len(state.last), space.tips, space.out, space.again
    if judge and counter[LAST] == counter[STEP]:
        read_every(rotor.rows, q, points, out, space.spectra)
        reach = 0.0
        for i in range(len(out)):
            again[i] = state.gaps[row + i] + out[i]
            reach = max(reach, abs(out[i]))
        note_miss_folded(again, space.opened, 0, reach, gap, points, ledger)
    for axis in range(2):
        tips[points, axis] = tip_by_waves(rotor.hub, axis, q, len(q))
    if keep and len(tracks.tips) > 0:
        for j in range(points):
            tips[j, 0] = tip_by_waves(rotor.radial, j, q, len(q))
            tips[j, 1] = tip_by_waves(rotor.along, j, q, len(q))
        for m in range(len(space.casing)):
            space.casing[m] = (
                rotor.shares[m, 0] * q[rotor.casing[m, 0]]
                + rotor.shares[m, 1] * q[rotor.casing[m, 1]]
            )
    sums, whole = state.sums_b, space.ledger
    energies = energies_of_points(rotor, q, space.spare)
    copy_to(whole, ledger)
    whole[ROTATION] += 0.5 * sums[0]
    whole[FRICTION] += 0.5 * mu * sums[1]
    write_sample(
        counter, whole, state.impulse, tips, space.casing, energies,
        sums[2] - (energies[0] + energies[1]), keep, judge, tracks,
    )  # fmt: skip


def points_space(arrays: Arrays, state: CyclicState) -> PointsSpace:
    """Return the work space of the time loop `march_points`; check the arrays' sizes.

    It is no part of a saved march. Raise ModelError if an array of the rotor has a
    wrong size.
    """
    rotor, points, wide = arrays.rotor, len(state.last), len(state.gaps) // 6
    modes, width = len(rotor.ahead), len(rotor.kicked) // 2
    for name, rows, wanted in (
        ("rotor", state.rotor, modes), ("drift", rotor.drift, modes // 2),
        ("rush", rotor.rush, points),
        ("kick", rotor.kick, 2 * modes), ("hub", rotor.hub, 2 * modes),
        ("radial", rotor.radial, points * modes),
        ("along", rotor.along, points * modes),
        ("clear", arrays.contact.clear, 2 * wide),
        *sizes_of_rows(rotor.rows, points, modes, width),
    ):  # fmt: skip
        if rows.size != wanted:
            msg = f"{name} of the kernel of points: {rows.size} values, not {wanted}"
            raise ModelError(msg)
    solver = constant_space(points, wide, arrays.contact.w, state.known)
    sectors = isinstance(rotor.rows, SectorRows)
    room = room_of_sectors(rotor.rows) if sectors else modes
    sizes = width, room, *(2 * wide,) * 3
    spare, spectra, out, again, opened = all_aligned([*map(np.zeros, sizes)])
    return PointsSpace(
        spare, spectra, np.zeros(points), solver, out, again, opened,
        np.zeros((points + 1, 2)), np.zeros(len(rotor.casing)),
        np.zeros_like(state.ledger), np.zeros(len(rotor.support.which)),
    )  # fmt: skip


def sizes_of_rows(
    rows: PointRows | SectorRows, points: int, modes: int, width: int
) -> Wanted:
    """Return (name, array, required number of values) of each array of coefficients.

    rows : coefficients between contact points and amplitudes of waves
    points, modes, width : P, m and `width` of `wave_types.PointRows`
    """
    if isinstance(rows, PointRows):
        short, long = points * modes, points * width
        read = points * min(len(rows.read) // points // (2 * EIGHT) * 2 * EIGHT, modes)
        turned = points * min(
            len(rows.turned) // points // (4 * EIGHT) * 4 * EIGHT, modes
        )
        moves = len(rows.moves) > 0
        push = read if moves else short
        slides = push + points * (width - modes)
        factors = moves * modes
        wanted = [read, short, turned, push, long, slides, factors, factors]
        return list(zip(rows._fields, rows, wanted, strict=True))
    alike, waves = rows.single + rows.pairs, rows.single + 2 * rows.pairs
    slot, forces = len(rows.move) // alike, points * (width - modes)
    blades = points // rows.each
    wanted = [
        rows.each * alike * slot, rows.each * alike * slot,
        rows.each * rows.single * slot, rows.each * waves * slot, alike * slot,
        2 * rows.pairs * slot, forces, forces, blades * slot,
        -(-blades // FOUR) * FOUR * slot,
    ]  # fmt: skip
    arrays: Any = rows[: len(wanted)]  # without the numbers that follow the arrays
    return list(zip(rows._fields[: len(wanted)], arrays, wanted, strict=True))


@kernel
def march_points(
    steps, strides, limit, step, speed, mu, wall, loading, rotor, _, contact, state,
    tracks, space,
):  # fmt: skip
    """Integrate rotor and casing, both as waves, over `steps` time steps.

    Parameters
    ----------
    steps, strides, limit, step, speed, mu, wall, loading, tracks : as in
        `bodies.march_bodies`
    rotor, contact : `wave_types.PointsRotor`, `wave_types.PointsContact`
    state, space : `kernel_types.CyclicState`; result of `points_space`
    """
    s_b, gaps, counter, last, ledger = (
        state.rotor, state.gaps, state.counter, state.last, state.ledger,
    )  # fmt: skip
    sums, held, known, impulse = state.sums_b, state.lam, state.known, state.impulse
    spare, before, solver, out, whole = (
        space.spare, space.before, space.solver, space.out, space.opened,
    )  # fmt: skip
    points, wide, modes = len(last), len(gaps) // 6, len(rotor.ahead)
    push, where = solver.push, solver.where
    stands, at = len(rotor.support.which) > 0, modes + points
    recall(points, wide, solver)
    drift, fresh, active = 0.0, True, points - points
    goal = counter[STEP] + steps
    while counter[STEP] < goal and counter[STOP] == RUNNING:
        near = counter[LAST] == counter[STEP]
        near = near and not stands  # else amplitudes change after they are read
        turn_points(rotor.rows, s_b, rotor.ahead, near, space.spectra)
        if slips_now(counter):
            note_slips_of_points(held, known, last, step, counter[LAST], ledger)
        now, along, across, x, y = counter[STEP] * step, 0.0, 0.0, 0.0, 0.0
        thrust = pulse_of(now, loading.force, loading.pulse)
        counter[STEP] += 1
        time, acts = counter[STEP] * step, stands or thrust != 0.0
        if thrust != 0.0:
            begin_moves(spare, s_b, modes)
        if stands:
            x, y = hold_centre(rotor.support, s_b, now, space.centre)
        if thrust != 0.0:
            angle = angle_of(wall, speed, time)
            along, across = thrust * math.cos(angle), -thrust * math.sin(angle)
            add_one(rotor.kick, 0, along, s_b, modes)
            add_one(rotor.kick, modes, across, s_b, modes)
        row, gap = counter[STEP] % 3 * 2 * wide, gap_at(wall, time)
        write_clear(contact.clear, gap, gaps, row, wide)
        if len(wall.orders) > 0:
            add_shape(wall, time, speed, contact.waves, gaps, row, wide)
        looks = counter[STEP] >= counter[NEXT_LOOK]
        judge = counter[STEP] % strides.evidence == 0
        ready, every = False, judge or fresh or thrust != 0.0
        held_by = math.sqrt(x * x + y * y)
        moved = drift + held_by * rotor.support.nudge
        drift += held_by * rotor.support.rush
        lowest = lower_all(out, moved, gaps, row, whole)
        if not every and not lowest > 0.0:
            lowest, ready = read_close(
                rotor.rows, s_b, points, gaps, row, known, out, whole, near,
                space.spectra, where,
            )  # fmt: skip
            if lowest < 0.0 and ready:
                active = guess(whole, row - row, lowest, points, wide, solver)
                ready = active > 0
            every = lowest < 0.0 and not ready
        if every:
            read_every(rotor.rows, s_b, points, out, space.spectra)
            lowest, fresh = open_whole(out, gaps, row, whole), False
        if every or looks:
            drift = drift_of(s_b, rotor.drift)
        if looks:
            watch(farthest_point(limit, s_b, rotor, points), limit, counter)
        if lowest < 0.0:
            if not ready:
                active = solved(whole, row - row, lowest, points, wide, solver)
            if active < 0:
                counter[STOP] = COMPLEMENTARITY
                return
            clear_forces(spare, modes)
            spare[at], spare[at + 1], spare[at + 2], spare[at + 3] = along, across, x, y
            for i in range(active):
                spare[modes + where[i]] = push[i]
            older = (counter[STEP] + 1) % 3 * 2 * wide
            open_tips(push, where, active, solver.rows, out)
            if stands and thrust == 0.0:
                let_go(rotor.support, spare, s_b, space.centre)
            free = spare[:modes] if acts else s_b
            book_points(
                rotor.rows, push, where, active, free, spare, mu, counter[STEP], gaps,
                older, before, sums, held, space.spectra,
            )  # fmt: skip
            push_points(rotor.rows, push, where, active, s_b, space.spectra)
            for i in range(active):
                drift += push[i] * rotor.rush[where[i]]
            book_contacts(
                push, where, active, before, last, counter, ledger, impulse, step
            )
        if thrust != 0.0:
            if not lowest < 0.0:
                clear_forces(spare, modes)
                spare[at], spare[at + 1] = along, across
            moved = along * moved_by(rotor.kicked, 0, spare, modes)
            moved += across * moved_by(rotor.kicked, len(spare), spare, modes)
            ledger[PULSE] += 0.5 * moved
            sums[2] += 0.5 * moved
        if counter[STEP] % FLUSH_EVERY == 0:
            flush(s_b)
        keep = counter[STEP] % strides.traces == 0
        if keep or judge:
            sample_points(mu, gap, row, rotor, state, space, keep, judge, tracks)
