"""Time loop for a rotor and a casing of any kind: the paper's Algorithm 1.

It serves scheme `paper`, and scheme `general` where the casing is integrated in the
static frame: a ring of elements, or rotation that couples the rotor's modes where its
speed changes. What a step does to each body is in `body`. The rotor is in the rotating
frame.
"""

from __future__ import annotations

import math

import numpy as np

from hpcwhirl.dynamics.kernels.compiled import by_numba, part
from hpcwhirl.dynamics.kernels.contact import (
    COMPLEMENTARITY,
    ELEMENTS,
    FLUSH_EVERY,
    FRICTION,
    JUDGED,
    NEXT_LOOK,
    NOWHERE,
    PULSE,
    RIGID,
    ROTATION,
    RUNNING,
    SAMPLE,
    STEP,
    STOP,
    TINY,
    angle_at,
    book_contacts,
    book_work,
    complementarity,
    contact_space,
    gap_at,
    keep_state,
    note_slip,
    place_on_elements,
    place_on_waves,
    pulse_of,
    read_ring,
    slides_at,
    slips_now,
    watch,
    write_sample,
)
from hpcwhirl.dynamics.kernels.coulomb import (
    book_slides,
    choose,
    coulomb_space,
    obeyed,
    rub,
)
from hpcwhirl.dynamics.kernels.layer import (
    choose_all,
    closed_by,
    keep_depth,
    layer_space,
    leave,
    press,
    rub_rods,
    to_worn,
    wear,
)
from hpcwhirl.dynamics.kernels.oracle.body import (
    Motion,
    accept,
    collect,
    energy,
    load,
    meet,
    note_beside,
    predict,
    read,
    read_tips,
    slide,
    stand,
    yielded,
)
from hpcwhirl.dynamics.kernels.samples import note_miss
from hpcwhirl.dynamics.kernels.shape import is_shaped, shape_at
from hpcwhirl.dynamics.kernels.standing import room_of


@part
def flush(motion):
    """Set a body's amplitudes and increments to 0 where both are below 1e-150.

    Their products would be denormal numbers, which are slow. motion : `body.Motion`
    """
    q, d = motion.q, motion.d
    for m in range(len(q)):
        if abs(q[m]) < TINY and abs(d[m]) < TINY:
            q[m] = 0.0
            d[m] = 0.0


@part
def place_blades(ring, turned, points, index, shape):
    """Find the coordinates of the ring that move each contact point, and their weights.

    ring, points : `kernel_types.Ring`, `kernel_types.Points`
    turned : rad, angle of blade 0 in the static frame
    index, shape : (N, w), out: for each point, the indices of w radial coordinates of
        the ring, and the weights whose sum of products is its displacement
    """
    kind, size, length = ring
    if kind == ELEMENTS:
        place_on_elements(turned, size, length, points.turn, index, shape)
    elif kind != RIGID:
        place_on_waves(turned, size, points.angle, points.weight, index, shape)


@part
def read_gaps(u, radial, wall, ring, points, index, shape, turned, time, lost, gaps):
    """Compute the gaps (N,) of all tips from both bodies, m; return the lowest gap.

    Parameters
    ----------
    u : (N,) or more, m, radial displacements of the tips
    radial : (R,), m, radial coordinates of the ring
    wall, ring, points : `kernel_types.Wall`, `Ring`, `Points`
    index, shape : results of `place_blades`
    turned, time : rad, angle of blade 0 in the static frame; s
    lost : index of the lost blade, whose gap is `NOWHERE`; -1: none
    """
    gap, shaped = gap_at(wall, time), is_shaped(wall)
    lowest = 1.0
    for j in range(len(gaps)):
        w = read_ring(radial, index, shape, j) if ring.kind != RIGID else 0.0
        if shaped:
            w += shape_at(wall, time, turned + points.angle[j])
        gaps[j] = gap + points.gap[j] + w - u[j] if j != lost else NOWHERE
        lowest = min(lowest, gaps[j])
    return lowest


@part
def farthest(tips):
    """Return the largest displacement of a tip (radial and tangential), m.

    tips : (N + 1, 2), m, radial and tangential for each blade; the last row, the
        shaft's centre, does not count
    """
    most = 0.0
    for j in range(len(tips) - 1):
        most = max(most, math.hypot(tips[j, 0], tips[j, 1]))
    return most


@part
def book_forces(body, motion, ledger):
    """Enter the work of contact forces on a body in a step, J, in the ledger.

    Its entries ROTATION and FRICTION grow by the work of the forces motion.normal and
    motion.drag on the motion from step n - 1 to n + 1, halved. Work of friction on the
    motion without contact is entered by `contact.book_work`.

    body, motion : `kernel_types.Body`; `body.Motion`
    """
    _, d, _, ahead, _, normal, drag = motion
    for m in range(body.own):
        mean = 0.5 * (ahead[m] + d[m])
        ledger[ROTATION] += normal[m] * mean
        ledger[FRICTION] += drag[m] * mean
    for m in range(body.own, len(ahead)):
        work = 0.5 * drag[m] * (ahead[m] + d[m])
        book_work(FRICTION, work, -work, ledger)


@part
def push_apart(rotor, casing, b, c, lam, tau, own, inward, index, shape):
    """Add the effect of contact forces to the increments of both bodies.

    b, c : `body.Motion` of rotor and casing
    lam, tau : (N,), N, multipliers of the tips; friction on the casing
    own, inward, index, shape : coordinates of rotor and of casing on which each tip
        acts, and weights, see `body.collect`
    """
    collect(rotor, b, lam, tau, own, inward)
    collect(casing, c, lam, tau, index, shape)
    meet(rotor, b)
    meet(casing, c)


@part
def slides_of(
    rotor, casing, d_b, d_c, lam, moved, own, inward, index, shape, along_b, along_c,
    out,
):  # fmt: skip
    """Set out (N,) to the slides of tips with lam > 0 in a step, m, see `coulomb`.

    d_b, d_c : increments of the coordinates of rotor and casing in the step
    moved : m, Omega R dt
    lam, own, inward, index, shape : as in `push_apart`
    along_b, along_c : (N,), (R,), work space
    """
    for j in range(len(out)):
        out[j] = -moved
    slide(rotor, d_b, lam, own, inward, along_b, out)
    slide(casing, d_c, lam, index, shape, along_c, out)


@part
def pulse_work(push, modal, ahead, increments):
    """Return the work of the pulse on the casing in a step, J.

    push, modal : N, force of the pulse; (n,), the casing's modal forces of a unit force
    ahead, increments : (n,), increments of the casing's amplitudes in this and in the
        last step
    """
    total = 0.0
    for m in range(len(ahead)):
        total += push * modal[m] * 0.5 * (ahead[m] + increments[m])
    return total


@by_numba()
def motion_of(q, d, loss):
    """Return the arrays of a body that a step uses: those of its state, and work space.

    q, d, loss : arrays of the state, see `body.Motion`
    """
    return Motion(
        q, d, loss, np.zeros_like(q), np.zeros_like(q), np.zeros_like(q),
        np.zeros_like(q),
    )  # fmt: skip


@by_numba()
def energies_of(rotor, casing, state, step):
    """Return (energy of the rotor, energy of the casing), J, in the state after a step.

    rotor, casing, state : as in `march_bodies`; step : dt, s
    """
    return (
        energy(rotor, state.q_b, state.d_b, step),
        energy(casing, state.q_c, state.d_c, step),
    )


@by_numba()
def march_bodies(
    steps, strides, limit, step, speed, mu, wall, loading, rotor, casing, contact,
    state, tracks,
):  # fmt: skip
    """Integrate rotor and casing in contact over `steps` steps of central differences.

    Where tips have several contact points, N in all arrays is the number of points.
    `state` and `tracks` are changed in place.

    Parameters
    ----------
    steps : number of steps to take
    strides : steps between samples of the traces, and between rows of the evidence
    limit : m, magnitude of a tip's displacement that ends the run, see `contact.watch`
    step, speed : dt, s; Omega, rad/s
    mu : friction coefficient times the sign of Omega
    wall, loading : `kernel_types.Wall`, `kernel_types.Load`
    rotor, casing : `kernel_types.Body`
    contact, state, tracks : `kernel_types.Contact`, `kernel_types.BodiesState`,
        `kernel_types.Tracks`
    """
    w_rotor, compliance, ring, lost, points, layer, coulomb = contact
    (
        q_b, d_b, q_c, d_c, loss_b, loss_c, last, older, touched, counter, ledger,
        impulse, worn,
    ) = state  # fmt: skip
    blades, coordinates = len(last), len(compliance)
    b, c = motion_of(q_b, d_b, loss_b), motion_of(q_c, d_c, loss_c)
    u, w, tips = np.zeros(blades + 2), np.zeros(coordinates), np.zeros((blades + 1, 2))
    gaps, opened, lam = np.zeros(blades), np.zeros(blades), np.zeros(blades)
    slid, stood = np.zeros(blades), np.zeros(room_of(rotor.stand))
    tau = np.zeros(blades)
    width = 4 if ring.kind == ELEMENTS else coordinates
    index, shape = np.zeros((blades, width), np.int64), np.zeros((blades, width))
    own, inward = np.arange(blades).reshape(blades, 1), np.full((blades, 1), -1.0)
    space = contact_space(blades, coordinates)
    layered, own_rods = worn.shape[1] > 0, layer_space(blades)
    softness = layer.soft + layer.rub * abs(speed)
    loose, every = len(coulomb.rotor) > 0, np.ones(blades)
    along_b, along_c = np.zeros(blades), np.zeros(coordinates)
    friction = coulomb_space(blades * loose, coordinates * loose)
    free_b, free_c = np.zeros_like(q_b), np.zeros_like(q_c)
    for _ in range(steps):
        now = counter[STEP] * step
        following = (counter[STEP] + 1) * step
        turned = angle_at(wall, speed, following) % (2.0 * math.pi)
        predict(rotor, b)
        predict(casing, c)
        stand(rotor, b, angle_at(wall, speed, now), stood)
        push = pulse_of(now, loading.force, loading.pulse)
        if push != 0.0:
            load(casing, c, push, loading.modal)
        read(rotor, b.following, u)
        read(casing, c.following, w)
        place_blades(ring, turned, points, index, shape)
        lowest = read_gaps(
            u, w, wall, ring, points, index, shape, turned, following, lost, gaps
        )
        if layered:
            started = angle_at(wall, speed, now)
            lowest = to_worn(
                turned, started, points, worn, layer.under, own_rods, gaps, last
            )
            leave(layer, worn, last, ledger, own_rods)
        counter[STEP] += 1
        if counter[STEP] >= counter[NEXT_LOOK]:
            read_tips(rotor, b.following, u, tips)
            if lost >= 0:
                tips[lost] = 0.0
            watch(farthest(tips), limit, counter)
        if lowest < 0.0:
            space.have[:] = 0  # W changes as the blades pass
            if layered:
                own_rods.soft[:] = softness
                active = press(
                    layer, worn, gaps, w_rotor, compliance, index, shape, lam, opened,
                    space, own_rods,
                )  # fmt: skip
            else:
                active = complementarity(
                    gaps, w_rotor, compliance, index, shape, lam, opened, space
                )
            if active < 0 and not loose:
                counter[STOP] = COMPLEMENTARITY
                return
            for j in range(blades):
                tau[j] = mu * lam[j]
            if loose:
                moves = slides_at(wall, speed, coulomb.radius, following, step)
                moved, moved_before = moves
                free_b[:], free_c[:] = b.ahead, c.ahead
                push_apart(rotor, casing, b, c, lam, tau, own, inward, index, shape)
                slides_of(
                    rotor, casing, b.ahead, c.ahead, lam, moved, own, inward, index,
                    shape, along_b, along_c, friction.after,
                )  # fmt: skip
                slides_of(
                    rotor, casing, b.d, c.d, every, moved_before, own, inward, index,
                    shape,
                    along_b, along_c, friction.before,
                )  # fmt: skip
                if not obeyed(mu, coulomb, lam, friction) or active < 0:
                    b.ahead[:], c.ahead[:] = free_b, free_c
                    slides_of(
                        rotor, casing, b.ahead, c.ahead, every, moved, own, inward,
                        index, shape, along_b, along_c, friction.slides,
                    )  # fmt: skip
                    size, more = 0, choose(gaps, coulomb, friction)
                    if layered:
                        size = more = choose_all(friction.chosen)
                        active = rub_rods(
                            layer, worn, gaps, coulomb, step, index, shape, lam, tau,
                            opened, space, friction, own_rods,
                        )  # fmt: skip
                    while size < more:
                        size = more
                        active, more = rub(
                            gaps, size, coulomb, step, index, shape, lam, tau, opened,
                            space, friction,
                        )  # fmt: skip
                    if active < 0:
                        counter[STOP] = COMPLEMENTARITY
                        return
                    push_apart(rotor, casing, b, c, lam, tau, own, inward, index, shape)
                    slides_of(
                        rotor, casing, b.ahead, c.ahead, lam, moved, own, inward, index,
                        shape, along_b, along_c, friction.after,
                    )  # fmt: skip
                book_slides(lam, tau, step, mu, moves, counter, ledger, friction)
            else:
                push_apart(rotor, casing, b, c, lam, tau, own, inward, index, shape)
            closing = older
            if layered:
                wear(layer, worn, lam, last, ledger, own_rods)
                closed_by(older, opened, own_rods.shifted)
                closing = own_rods.shifted
            if lost >= 0:
                opened[lost] = NOWHERE
            book_forces(rotor, b, ledger)
            book_forces(casing, c, ledger)
            book_contacts(
                space.right, space.where, active, closing, touched, counter, ledger,
                impulse, step,
            )  # fmt: skip
            if slips_now(counter):
                slid[:] = 0.0
                for part in (b.ahead, b.d):
                    slide(rotor, part, lam, own, inward, along_b, slid)
                for part in (c.ahead, c.d):
                    slide(casing, part, lam, index, shape, along_c, slid)
                for j in range(blades):
                    note_slip(slid[j], step, ledger)
        else:
            opened[:] = gaps
        if push != 0.0:
            ledger[PULSE] += pulse_work(push, loading.modal, c.ahead, d_c)
        yielded(rotor, b, stood, ledger)
        accept(rotor, b, step)
        accept(casing, c, step)
        older[:] = last
        last[:] = opened
        if counter[STEP] % FLUSH_EVERY == 0:
            flush(b)
            flush(c)
        keep = counter[STEP] % strides.traces == 0
        judge = counter[STEP] % strides.evidence == 0
        if keep or judge:
            read(rotor, q_b, u)
            read_tips(rotor, q_b, u, tips)
            if lost >= 0:
                tips[lost] = 0.0
            if judge and lowest < 0.0:
                read(casing, q_c, w)
                read_gaps(
                    u, w, wall, ring, points, index, shape, turned, following, lost,
                    gaps,
                )  # fmt: skip
                note_miss(gaps, last, u, gap_at(wall, following), ledger)
            if layered and keep:
                keep_depth(worn, counter[SAMPLE], tracks.worn)
            if judge:
                note_beside(rotor, b, step, tracks.evidence[counter[JUDGED]])
            write_sample(
                counter, ledger, impulse, tips, q_c,
                energies_of(rotor, casing, state, step), loss_b.sum() + loss_c.sum(),
                keep, judge, tracks,
            )  # fmt: skip
        if len(tracks.states) > 0 and counter[STEP] % strides.states == 0:
            keep_state(q_b, d_b, counter, ledger, strides.states, tracks.states)
        if counter[STOP] != RUNNING:
            return
