"""Steps of the loop `points` for rows of points, whose gaps are bounded.

Rows are those of unequal sectors (`point_rows`), or of equal sectors with several
points a tip (`sectors`). The amplitudes of all waves are q; forces act on them at once.

The motion of a point's material from step n - 1 to n + 1, d' + d, d' and d its last two
increments, is a row times s = (q, lambda, pulse), q the amplitudes before any force. As
a harmonic of the casing turns relative to the blades, the gap two steps before does not
follow from d' + d, the displacement of the material, on which works depend. It follows
from further coefficients, `before`.

Only points that might touch are computed: a sum over the waves bounds the motion of any
point in a step, which gives a lower bound of each gap. Arrays of all points, (2 wide,),
are in folded order, see `circulant.folded`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hpcwhirl.dynamics.kernels.compiled import does, inlined, part, rare, rare_kernel
from hpcwhirl.dynamics.kernels.contact import (
    FRICTION,
    LAST,
    NEAR,
    ROTATION,
    SAMPLE,
    STEP,
    angle_at,
    book_contacts,
    gap_at,
    note_slip,
    slides_at,
    slips_next,
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
from hpcwhirl.dynamics.kernels.loop.circulant import constant_space, guess, solved
from hpcwhirl.dynamics.kernels.loop.passes import copy_to
from hpcwhirl.dynamics.kernels.loop.point_rows import (
    begin_moves,
    book_points,
    clear_forces,
    read_close,
    read_every,
    turn_points,
)
from hpcwhirl.dynamics.kernels.loop.point_slides import (
    book_rest,
    is_loose,
    put_rest,
    rub_aside,
    slide_points,
)
from hpcwhirl.dynamics.kernels.loop.point_verbs import (
    advance,
    conclude,
    farthest,
    flew,
    kick,
    sample,
    set_out,
    touch,
    work_of_kick,
)
from hpcwhirl.dynamics.kernels.loop.sectors import room_of_sectors
from hpcwhirl.dynamics.kernels.loop.wave_types import PointRows, PointsSpace, SectorRows
from hpcwhirl.dynamics.kernels.loop.whole import (
    add_one,
    drift_of,
    lower_all,
    moved_by,
    open_whole,
    tip_by_waves,
)
from hpcwhirl.dynamics.kernels.samples import note_miss_folded
from hpcwhirl.dynamics.kernels.shape import faded
from hpcwhirl.dynamics.kernels.standing import give_shaft, hold_shaft, room_of
from hpcwhirl.dynamics.kernels.vectors import (
    EIGHT,
    FOUR,
    add_six,
    add_two,
    all_aligned,
    broadcast,
    fma,
    load,
    store,
    store_six,
    total_of,
)

DRIFT, FRESH = range(2)  # entries of `PointsSpace.bounds`


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
    whole = width - width % (6 * FOUR)
    for v in range(0, whole, 6 * FOUR):
        six = (
            load(tips, v), load(tips, v + FOUR),
            load(tips, v + 2 * FOUR), load(tips, v + 3 * FOUR),
            load(tips, v + 4 * FOUR), load(tips, v + 5 * FOUR),
        )  # fmt: skip
        store_six(tips, v, add_six(push, where, active, opening, width, v, six))
    for v in range(whole, width, 2 * FOUR):
        two = load(tips, v), load(tips, v + FOUR)
        two = add_two(push, where, active, opening, width, v, two)
        store(tips, v, two[0])
        store(tips, v + FOUR, two[1])


@does(farthest, SectorRows)
@does(farthest, PointRows)
@rare
def farthest_point(_rows, rotor, limit, state, _space):
    """Return the largest displacement of a contact point (radial and tangential), m.

    The implementation of `point_verbs.farthest`, with its arguments, for rows of
    points.
    """
    q, points = state.rotor, len(state.last)
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
def note_slips_of_points(state, step):
    """Raise ledger[SLIP] to the largest slip of a point in contact in one step, m/s.

    The points' motions along the casing are the first entries of state.lam.
    """
    last = state.last
    for j in range(len(last)):
        if last[j] == state.counter[LAST]:
            note_slip(state.lam[j], step, state.ledger)


@does(sample, SectorRows)
@does(sample, PointRows)
@rare
def sample_points(rows, rotor, wall, _mu, step, _speed, state, space, keep, judge,
                  tracks):  # fmt: skip
    """Write the state of a step to the traces or to the evidence, for points on tips.

    At a row of evidence with contact, the gaps found with the Delassus matrix are
    compared with gaps computed from the amplitudes; the error is entered in
    ledger[MISS].

    The implementation of `point_verbs.sample`, with its arguments, for rows of points.
    """
    counter, ledger, q = state.counter, state.ledger, state.rotor
    row = counter[STEP] % 3 * len(space.out)
    gap = gap_at(wall, counter[STEP] * step)
    points, tips, out, again = len(state.last), space.tips, space.out, space.again
    if judge and counter[LAST] == counter[STEP]:
        read_every(rows, q, points, out, space.spectra)
        reach = 0.0
        for i in range(len(out)):
            again[i] = state.gaps[row + i] + out[i]
            reach = max(reach, abs(out[i]))
        note_miss_folded(again, space.opened, 0, reach, gap, points, ledger)
    for axis in range(2):
        tips[points, axis] = tip_by_waves(rotor.hub, axis, q, len(q))
    if keep:
        keep_depth(state.worn, counter[SAMPLE], tracks.worn)
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
    whole[FRICTION] += 0.5 * sums[1]
    write_sample(
        counter, whole, state.impulse, tips, space.casing, energies,
        sums[2] - (energies[0] + energies[1]), keep, judge, tracks,
    )  # fmt: skip


@does(set_out, SectorRows)
@does(set_out, PointRows)
@inlined
def set_out_points(_rows, state, space):
    """Prepare the work space: no bound of any gap is known yet.

    The implementation of `point_verbs.set_out`, with its arguments, for rows of points.
    """
    recall(len(state.last), len(space.out) // 2, space.solver)
    bounds = space.bounds
    bounds[DRIFT], bounds[FRESH] = 0.0, 1.0


@does(flew, SectorRows)
@does(flew, PointRows)
@inlined
def flew_never(_rows, _rotor, _wall, _strides, _mu, _step, _speed, _loading, _state,
               _space, _tracks):  # fmt: skip
    """Return False: steps of central differences are taken one by one."""
    return False


@does(advance, SectorRows)
@does(advance, PointRows)
@inlined
def advance_points(rows, rotor, _contact, _wall, step, _speed, state, space):
    """Take a step without forces: multiply the amplitudes of all waves by factors z.

    The implementation of `point_verbs.advance`, with its arguments, for rows of points.
    """
    counter, q = state.counter, state.rotor
    stands = len(rotor.support.which) > 0
    near = counter[LAST] == counter[STEP] and not stands  # else q changes after reading
    turn_points(rows, q, rotor.ahead, near, space.spectra)
    if slips_now(counter):
        note_slips_of_points(state, step)
    if stands:
        hold_shaft(rotor.support, q, counter[STEP], space.turned, space.push)


@inlined
def begin_free(rotor, q, space):
    """Copy the amplitudes to space.spare as they are before any force of the step."""
    spare, modes = space.spare, len(rotor.ahead)
    begin_moves(spare, q, modes)
    if len(rotor.support.which) > 0:
        give_shaft(rotor.support, space.push, -1.0, spare, modes // 2)


@does(kick, SectorRows)
@does(kick, PointRows)
@inlined
def kick_points(_rows, rotor, thrust, angle, state, space):
    """Add the effect of the pulse on the casing to the waves; keep the motion before.

    The implementation of `point_verbs.kick`, with its arguments, for rows of points.
    The motion without forces is kept in space.spare; 0 is returned.
    """
    q, modes = state.rotor, len(rotor.ahead)
    along, across = thrust * math.cos(angle), -thrust * math.sin(angle)
    begin_free(rotor, q, space)
    add_one(rotor.kick, 0, along, q, modes)
    add_one(rotor.kick, modes, across, q, modes)
    return 0.0


@does(work_of_kick, SectorRows)
@does(work_of_kick, PointRows)
@inlined
def work_of_kicked(_rows, rotor, thrust, angle, _moved, state, space):
    """Return the work of the pulse in a step, J.

    The implementation of `point_verbs.work_of_kick`, with its arguments, for rows of
    points.
    """
    spare, modes, points = space.spare, len(rotor.ahead), len(state.last)
    along, across = thrust * math.cos(angle), -thrust * math.sin(angle)
    if state.counter[LAST] != state.counter[STEP]:
        clear_forces(spare, modes)
        spare[modes + points], spare[modes + points + 1] = along, across
    moved = along * moved_by(rotor.kicked, 0, spare, modes)
    moved += across * moved_by(rotor.kicked, len(spare), spare, modes)
    state.sums_b[2] += 0.5 * moved
    return 0.5 * moved


@does(conclude, SectorRows)
@does(conclude, PointRows)
@inlined
def conclude_points(_rows, _rotor, _wall, _step, _speed, _state, _space):
    """Do nothing: the state is complete after each step.

    The implementation of `point_verbs.conclude` for rows of points.
    """


@does(touch, SectorRows)
@does(touch, PointRows)
@inlined
def touch_points(rows, rotor, contact, wall, mu, step, speed, thrust, angle, every,
                 looks, state, space):  # fmt: skip
    """Find the contact forces of a step, enter their works, apply them to the waves.

    The implementation of `point_verbs.touch`, with its arguments, for rows of points.
    """
    q, gaps, counter = state.rotor, state.gaps, state.counter
    out, whole, solver, bounds = space.out, space.opened, space.solver, space.bounds
    points, wide, active = len(state.last), len(gaps) // 6, 0
    time, row = counter[STEP] * step, counter[STEP] % 3 * 2 * wide
    near = counter[LAST] == counter[STEP] - 1 and len(rotor.support.which) == 0
    write_clear(contact.clear, gap_at(wall, time), gaps, row, wide)
    if len(wall.orders) > 0:
        add_shape(wall, time, speed, contact.waves, gaps, row, wide)
    ready, every = False, every or bounds[FRESH] > 0.0
    moved, pushed = bounds[DRIFT], space.push
    for p in range(len(rotor.support.nudge)):
        size = math.sqrt(pushed[2 * p] ** 2 + pushed[2 * p + 1] ** 2)
        moved += size * rotor.support.nudge[p]
        bounds[DRIFT] += size * rotor.support.rush[p]
    lowest = lower_all(out, moved, gaps, row, whole)
    layered = len(state.entered) > 0
    every = every or (layered and not lowest > 0.0)
    if not every and not lowest > 0.0:
        lowest, ready = read_close(
            rows, q, points, gaps, row, state.known, out, whole, near, space.spectra,
            solver.where,
        )  # fmt: skip
        if lowest < 0.0 and ready:
            active = guess(whole, row - row, lowest, points, wide, solver)
            ready = active > 0
        every = lowest < 0.0 and not ready
    if every:
        read_every(rows, q, points, out, space.spectra)
        lowest, bounds[FRESH] = open_whole(out, gaps, row, whole), 0.0
    if every or looks:
        bounds[DRIFT] = drift_of(q, rotor.drift)
    if not lowest < 0.0 and not is_inside(state.entered):
        return 0
    if layered:
        turned = angle_at(wall, speed, time) % (2.0 * math.pi)
        started = angle_at(wall, speed, (counter[STEP] - 1) * step)
        active = press_rods(
            contact.rods, turned, started, speed, whole, row - row, lowest, state,
            solver, space.layer,
        )  # fmt: skip
    elif not ready:
        active = solved(whole, row - row, lowest, points, wide, solver)
    loose = False
    if active != 0 and is_loose(contact.slides):
        apart = keep_free(rotor, thrust, False, q, space)
        free = space.spare[: len(rotor.ahead)] if apart else q
        moves = slides_at(wall, speed, contact.slides.law.radius, time, step)
        active, loose = slide_points(
            rows, contact, mu, speed, moves, free, row, active, state, space
        )
    if layered and active >= 0:
        wear_rods(contact.rods, active, state, solver, space.layer)
    if active > 0 and len(contact.slides.aside) > 0:
        rub_aside(contact.slides, mu, active, loose, state, space)
    if active > 0:
        act_points(
            rows, rotor, contact.slides, mu, step, thrust, angle, active, loose, state,
            space,
        )  # fmt: skip
    return active


@inlined
def keep_free(rotor, thrust, apart, q, space):
    """Return whether amplitudes without any force of the step are in space.spare.

    Else pulse and supports exert none, and they are q.

    apart : whether a copy is needed in any case
    """
    apart = apart or len(rotor.support.which) > 0
    if apart and thrust == 0.0:
        begin_free(rotor, q, space)
    return apart or thrust != 0.0


@inlined
def act_points(rows, rotor, slides, mu, step, thrust, angle, active, loose, state,
               space):  # fmt: skip
    """Enter the works of a step's contact forces; apply these to the waves.

    slides, loose : `wave_types.PointSlides`; whether friction is not that of permanent
        sliding
    active : number of points in contact, the first ones of the solver's
    """
    q, gaps, counter = state.rotor, state.gaps, state.counter
    spare, solver, before = space.spare, space.solver, space.before
    push, where = solver.push, solver.where
    points, wide, modes = len(state.last), len(gaps) // 6, len(rotor.ahead)
    clear_forces(spare, modes)
    at = modes + points
    spare[at], spare[at + 1] = thrust * math.cos(angle), -thrust * math.sin(angle)
    for i in range(2 * len(rotor.support.nudge)):
        spare[at + 2 + i] = space.push[i]
    for i in range(active):
        spare[modes + where[i]] = push[i]
    older = (counter[STEP] + 1) % 3 * 2 * wide
    open_tips(push, where, active, solver.rows, space.out)
    free = spare[:modes] if keep_free(rotor, thrust, loose, q, space) else q
    if loose:
        put_rest(slides, active, at + 2 + 2 * len(rotor.support.nudge), q, space)
    book_points(
        rows, push, where, active, free, q, spare, mu, counter[STEP],
        loose or slips_next(counter), gaps, older, before, state.sums_b, state.lam,
        space.spectra,
    )  # fmt: skip
    stay_open(state, where, active)
    close_from(state.entered, where, active, before)
    if loose:
        book_rest(active, state, space)
    for i in range(active):
        space.bounds[DRIFT] += push[i] * rotor.rush[where[i]]
    book_contacts(
        push, where, active, before, state.last, counter, state.ledger, state.impulse,
        step,
    )  # fmt: skip


@inlined
def stay_open(state, where, active):
    """Mark the contacts of a step, where[:active], as those of gaps that stay open.

    That is so on a layer, in which tips sink. See `held` of `book_points`.
    """
    if len(state.entered) > 0:
        now = len(state.lam) // 4 * (1 + state.counter[STEP] % 3)
        for s in range(active):
            state.lam[now + where[s]] = 0.0


def points_space(arrays: Arrays, state: CyclicState) -> PointsSpace:
    """Return the work space of the time loop `march_points`; check the arrays' sizes.

    It is no part of a saved march. Raise ModelError if an array of the rotor has a
    wrong size.
    """
    rotor, points, wide = arrays.rotor, len(state.last), len(state.gaps) // 6
    modes, width = len(rotor.ahead), len(rotor.kicked) // 2
    stand = rotor.support.stand
    supports = len(stand.film)
    check_sizes("points", [
        ("rotor", state.rotor, modes), ("drift", rotor.drift, modes // 2),
        ("rush", rotor.rush, points),
        ("kick", rotor.kick, 2 * modes), ("hub", rotor.hub, 2 * modes),
        ("radial", rotor.radial, points * modes),
        ("along", rotor.along, points * modes),
        ("clear", arrays.contact.clear, 2 * wide),
        ("reads", rotor.support.reads, 8 * supports * FOUR * len(rotor.support.which)),
        ("gives", rotor.support.gives, 4 * supports * FOUR * len(rotor.support.which)),
        *sizes_of_rows(rotor.rows, points, modes, width),
    ])  # fmt: skip
    check_places("points", modes // 2 - FOUR + 1, {"which": rotor.support.which})
    slides = arrays.contact.slides
    loose = len(slides.drag) > 0
    check_sizes("slides", [
        (name, getattr(slides, name), points * modes * loose)
        for name in ("rises", "pasts", "drag")
    ] + [("law", slides.law.rotor, 4 * points**2 * loose)])  # fmt: skip
    solver = constant_space(points, wide, arrays.contact.w, state.known)
    sectors = isinstance(rotor.rows, SectorRows)
    room = room_of_sectors(rotor.rows) if sectors else modes
    sizes = width, room, *(2 * wide,) * 3
    spare, spectra, out, again, opened = all_aligned([*map(np.zeros, sizes)])
    return PointsSpace(
        spare, spectra, np.zeros(points), solver, out, again, opened,
        np.zeros((points + 1, 2)), np.zeros(len(rotor.casing)),
        np.zeros_like(state.ledger), np.full(3, -1.0),
        np.zeros(room_of.py_func(stand)), np.zeros(2),
        layer_space.py_func(len(state.entered)),
        constant_response(points, slides.law, springs=len(state.entered) > 0),
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
        2 * rows.pairs * slot, forces, blades * slot,
        -(-blades // FOUR) * FOUR * slot,
    ]  # fmt: skip
    arrays: Any = rows[: len(wanted)]  # without the numbers that follow the arrays
    return list(zip(rows._fields[: len(wanted)], arrays, wanted, strict=True))
