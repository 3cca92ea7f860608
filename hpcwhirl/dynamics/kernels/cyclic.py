"""The cyclic modal kernel: nodal diameter by nodal diameter, in the rotating frame.

Harmonic h of the ring rides in the slot kappa = h folded mod N (conjugated where N - h
folds on it) beside the rotor's nodal diameter kappa = 0 .. K - 1, K = N // 2 + 1. In
the rotating frame nothing depends on the blades' place: with gamma the radial
amplitude of each mode (tips counted negative), sum over rows gamma y is a spectrum G
of the gaps,

g_j = gap + Re sum_kappa G_kappa e^{2 pi i kappa j / N},

one real transform of N points for both bodies; the spectrum of the multipliers,
Lambda_kappa = sum_j lambda_j e^{-2 pi i kappa j / N}, gives every modal force as
(gamma + mu conj(sigma)) Lambda, sigma the tangential amplitude; and the Delassus
matrix is constant and circulant.

Sizes are literals of the compiled code (a kernel for each).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
from numba import njit

from hpcwhirl.dynamics.kernels.circulant import (
    circulant_space,
    guess,
    place_of,
    solve_any,
)
from hpcwhirl.dynamics.kernels.contact import (
    AMPLITUDE,
    COMPLEMENTARITY,
    ENDED,
    FRICTION,
    IMPACT,
    LAST,
    NEXT_TRY,
    PULSE,
    ROTATION,
    RUNNING,
    SAMPLE,
    STEP,
    STOP,
    book_contacts,
    carried_by_wall,
    pulse_of,
    write_sample,
)
from hpcwhirl.dynamics.kernels.flight import LESS, fly, leap
from hpcwhirl.dynamics.kernels.general import FLUSH_EVERY, TINY, modal_energy
from hpcwhirl.dynamics.kernels.opening import note_miss_cyclic
from hpcwhirl.dynamics.kernels.passes import (
    OMEGA,
    RADIAL,
    RING_STATE,
    ROTOR_STATE,
    SI,
    SPEED_D,
    SPEED_Q,
    SR,
    end_step,
    pass_ring,
    pass_rotor,
    pulse_work,
    push_pulse,
    to_gaps,
    write_wall,
)
from hpcwhirl.dynamics.kernels.vectors import (
    FOUR,
    element,
    fma,
    higher_of,
    load,
    root,
    spread,
    store,
)


@njit(error_model="numpy", cache=True, inline="always")
def to_spectrum(push, where, size, turns, width, lam):
    """Set lam (2 width,): sum of push e^{-2 pi i kappa j / N}, then (im, -re) of it."""
    half = width // 2
    for v in range(0, width, FOUR):
        store(lam, v, load(turns, where[0] * width + v) * spread(push[0]))
    for s in range(1, size):
        for v in range(0, width, FOUR):
            row = load(turns, where[s] * width + v)
            store(lam, v, fma(row, spread(push[s]), load(lam, v)))
    for v in range(0, half, FOUR):
        store(lam, width + v, load(lam, half + v))
        store(lam, width + half + v, spread(0.0) - load(lam, v))


@njit(error_model="numpy", cache=True)
def exact_energy(q, d, c, size, first):
    """Return the energy of modes, the first of which has place `first`, J."""
    total = 0.0
    for m in range(len(q)):
        i = first + m
        speed = c[SPEED_D * size + i] * d[m] + c[SPEED_Q * size + i] * q[m]
        stretch = c[OMEGA * size + i] * q[m]
        total += 0.5 * (speed * speed + stretch * stretch)
    return total


@njit(error_model="numpy", cache=True)
def energies_of(t_b, c_b, t_c, c_c, now, step, exact):
    """Return the energies of rotor and ring from ended states, J.

    Central differences: at n + 1/2; exact flow: at n. now : 0 or 1, the place of d
    """
    m, n = len(t_b) // ROTOR_STATE, len(t_c) // RING_STATE
    q, d = t_b[:m], t_b[(1 + now) * m : (2 + now) * m]
    re, im = t_c[:n], t_c[n : 2 * n]
    at = 2 * n * (1 + now)
    d_re, d_im = t_c[at : at + n], t_c[at + n : at + 2 * n]
    if exact:
        ring = exact_energy(re, d_re, c_c, n, 0) + exact_energy(im, d_im, c_c, n, 0)
        return exact_energy(q, d, c_b, m, 0), ring
    omega = c_c[OMEGA * n : OMEGA * n + n]
    ring = modal_energy(re, d_re, omega, step) + modal_energy(im, d_im, omega, step)
    return modal_energy(q, d, c_b[OMEGA * m : OMEGA * m + m], step), ring


@njit(error_model="numpy", cache=True)
def column_sums(sums_b, sums_c, step, exact):
    """Return work of the rotation, impact loss, work of drag over mu, damping loss, J.

    Of central differences, what `book_contacts` has not entered. In the exact flow the
    rotation's work is that of the contacts carried over the deformed ring, and the
    impact what the normal forces take beside it.
    """
    m, n = len(sums_b) // 3, len(sums_c) // 4
    normal = 0.5 * (sums_b[:m].sum() + sums_c[:n].sum())
    drag = 0.5 * (sums_b[m : 2 * m].sum() + sums_c[n : 2 * n].sum())
    loss = sums_b[2 * m :].sum() + sums_c[2 * n : 3 * n].sum()
    if exact:
        carried = -step * sums_c[3 * n :].sum()
        return carried, carried - normal, drag, loss
    return normal, 0.0, drag, loss


@njit(error_model="numpy", cache=True)
def at_blade(spectrum, turns, j, width):
    """Return Re sum_kappa spectrum e^{2 pi i kappa j / N}."""
    total = 0.0
    for i in range(width):
        total += spectrum[i] * turns[j * width + i]
    return total


@njit(error_model="numpy", cache=True)
def read_tips(q, c, hub, turns, width, work, tips):
    """Set tips (N + 1, 2): radial and tangential of each blade, but not the centre."""
    size = hub.shape[1]
    k, blades = width // 2, len(tips) - 1
    for direction in range(2):
        work[:] = 0.0
        for m in range(size):
            col = m % width
            if direction == 0:
                work[col] -= c[RADIAL * size + m] * q[m]
            elif col < k:  # tangential: -(re sigma + i im sigma) (re q + i im q)
                work[col] -= c[SR * size + m] * q[m] - c[SI * size + m] * q[m + k]
            else:
                work[col] -= c[SR * size + m] * q[m] + c[SI * size + m] * q[m - k]
        for j in range(blades):
            tips[j, direction] = at_blade(work, turns, j, width)


@njit(error_model="numpy", cache=True, inline="always")
def size_of(spectrum, width):
    """Return a bound of every blade's |Re sum_kappa spectrum e^{...}|: the 1-norm."""
    total = spread(0.0)
    for c in range(0, width, FOUR):
        part = load(spectrum, c)
        total = total + higher_of(part, spread(0.0) - part)
    bound = 0.0
    for i in range(FOUR):
        bound += element(total, i)
    return bound


@njit(error_model="numpy", cache=True)
def farthest(spectrum, turns, blades, width):
    """Return the largest radial displacement of a tip, m, from the rotor's spectrum."""
    most = 0.0
    for j in range(blades):
        most = max(most, abs(at_blade(spectrum, turns, j, width)))
    return most


@njit(error_model="numpy", cache=True)
def radial_bound(q, c, size, width):
    """Return a bound of every tip's radial displacement, m."""
    total = spread(0.0)
    for col in range(0, width, FOUR):
        spectrum = spread(0.0)
        for m in range(col, size, width):
            radial = load(c, RADIAL * size + m)
            spectrum = fma(radial, load(q, m), spectrum)
        total = total + root(spectrum * spectrum)
    bound = 0.0
    for i in range(FOUR):
        bound += element(total, i)
    return bound


@njit(error_model="numpy", cache=True)
def read_centre(q, hub, tips):
    """Set the last of tips (N + 1, 2): x_o, y_o."""
    for axis in range(2):
        total = 0.0
        for m in range(hub.shape[1]):
            total += hub[axis, m] * q[m]
        tips[-1, axis] = total


@njit(error_model="numpy", cache=True)
def flush(s):
    """Zero amplitudes below 1e-150 before their products become denormal."""
    for m in range(len(s)):
        if abs(s[m]) < TINY:
            s[m] = 0.0


@njit(error_model="numpy", cache=True)
def sample_cyclic(step, mu, gap, row, rotor, c_c, turns, wave, state, sample, keep,
                  judge, tracks, rows, ring_rows, width, exact):  # fmt: skip
    """Write a sample of the state as it is with its step ended.

    Tips are read where they are kept. Where there is contact and the motion is judged,
    the gaps are compared with `row` of those that were solved.
    """
    s_b, s_c, lam, gaps, sums_b, sums_c, _, _, counter, ledger, impulse = state
    t_b, t_c, end_b, end_c, columns, tips, whole, again, wall = sample
    end_b[:] = sums_b
    end_c[:] = sums_c
    end_step(
        s_b, t_b, rotor[0], s_c, t_c, c_c, lam, counter, end_b, end_c, rows, ring_rows,
        width, exact,
    )  # fmt: skip
    energies = energies_of(t_b, rotor[0], t_c, c_c, counter[STEP] & 1, step, exact)
    if judge and counter[LAST] == counter[STEP]:
        most = radial_bound(t_b, rotor[0], rows * width, width)
        note_miss_cyclic(t_b, rotor[0], t_c, c_c, wave, gap, most, gaps, row, wall,
                         again, len(impulse), ledger)  # fmt: skip
    if keep and len(tracks[5]) > 0:
        read_tips(t_b, rotor[0], rotor[1], turns, width, columns, tips)
    read_centre(t_b, rotor[1], tips)
    rotation, impact, drag, loss = column_sums(end_b, end_c, step, exact)
    whole[:] = ledger
    whole[ROTATION] += rotation
    whole[IMPACT] += impact
    whole[FRICTION] += mu * drag
    ring = t_c[: 2 * len(t_c) // RING_STATE]
    write_sample(
        counter, whole, impulse, tips, ring, energies, loss, keep, judge, tracks
    )


@njit(error_model="numpy", cache=True)
def sample_space(state, blades, width):
    """Return the work space of `sample_cyclic`."""
    s_b, s_c, _, _, sums_b, sums_c, _, _, _, ledger, _ = state
    return (
        np.zeros_like(s_b), np.zeros_like(s_c), np.zeros_like(sums_b),
        np.zeros_like(sums_c), np.zeros(width), np.zeros((blades + 1, 2)),
        np.zeros_like(ledger), np.zeros(len(state[3]) // 3), np.zeros(width),
    )  # fmt: skip


@njit(error_model="numpy", cache=True)
def settle(c_b, c_c, state, copies, rows, ring_rows, width, exact):
    """Set copies of bodies and sums (s_b, s_c, sums_b, sums_c), their step ended."""
    s_b, s_c, lam, _, sums_b, sums_c, _, _, counter, _, _ = state
    t_b, t_c, end_b, end_c = copies
    end_b[:] = sums_b
    end_c[:] = sums_c
    end_step(
        s_b, t_b, c_b, s_c, t_c, c_c, lam, counter, end_b, end_c, rows, ring_rows,
        width, exact,
    )  # fmt: skip


@njit(error_model="numpy", cache=True)
def aside_space(state):
    """Return copies of what a jump changes: both bodies, sums and counter."""
    s_b, s_c, _, _, sums_b, sums_c, _, _, counter, _, _ = state
    return s_b.copy(), s_c.copy(), sums_b.copy(), sums_c.copy(), counter.copy()


@njit(error_model="numpy", cache=True)
def put_aside(state, aside):
    """Copy what a jump changes."""
    s_b, s_c, _, _, sums_b, sums_c, _, _, counter, _, _ = state
    a_b, a_c, a_sums_b, a_sums_c, a_counter = aside
    a_b[:], a_c[:], a_sums_b[:], a_sums_c[:] = s_b, s_c, sums_b, sums_c
    a_counter[:] = counter


@njit(error_model="numpy", cache=True)
def keep_between(begun, stride, step, mu, gap, rotor, c_c, turns, wave, flight, state,
                 aside, sample, tracks, rows, ring_rows, k):  # fmt: skip
    """Write the samples of the traces that a jump has passed over, from copies of it.

    A jump ends at the evidence, never at a sample of the traces, so that the motion is
    the same whatever is kept of it.
    """
    _, _, lam, gaps, _, _, known, last, counter, ledger, impulse = state
    s_b, s_c, sums_b, sums_c, own = aside
    if own[ENDED] != begun:  # the step that waited has been ended by the jump
        end_step(
            s_b, s_b, rotor[0], s_c, s_c, c_c, lam, own, sums_b, sums_c, rows,
            ring_rows, 2 * k, True,
        )  # fmt: skip
        own[ENDED] = begun
    outs = np.zeros(2 * k), np.zeros(2 * k)
    copy = s_b, s_c, lam, gaps, sums_b, sums_c, known, last, own, ledger, impulse
    first = (begun // stride + 1) * stride
    for goal in range(first, counter[STEP], stride):
        while own[STEP] < goal:
            leap(goal - own[STEP], rotor[0], c_c, flight, copy, outs, rows, ring_rows,
                 k)  # fmt: skip
        own[SAMPLE] = counter[SAMPLE]
        sample_cyclic(
            step, mu, gap, 0, rotor, c_c, turns, wave, copy, sample, True, False,
            tracks, rows, ring_rows, 2 * k, True,
        )  # fmt: skip
        counter[SAMPLE] = own[SAMPLE]


def widths(blades: int) -> tuple[int, int]:
    """Return (slots, columns of the transform): K = N // 2 + 1, padded to vectors."""
    slots = -(-(blades // 2 + 1) // FOUR) * FOUR
    return slots, slots


@lru_cache(maxsize=64)
def cyclic_kernel(
    blades: int, rows: int, ring_rows: int, exact: bool
) -> Callable[..., Any]:
    """Return the compiled kernel for these sizes.

    Parameters
    ----------
    blades : N >= 3
    rows : rows of the rotor
    ring_rows : rows of the ring; 0 where the casing is rigid
    exact : whether the coefficients are those of the exact flow; then flights are
        jumped over, see `flight`
    """
    k, wide = widths(blades)
    width, padded = 2 * k, -(-blades // FOUR) * FOUR
    size, ring_size = rows * width, ring_rows * k

    @njit(error_model="numpy", cache=True)
    def march_cyclic(
        steps, strides, limit, step, speed, mu, scene, loading, rotor, casing, contact,
        state, tracks,
    ):  # fmt: skip
        """March `steps` steps; scalars, scene and tracks as in `march_general`.

        loading : (F, tau, modal load (ring_size,))
        rotor : (items (ITEMS size,), see `passes`; hub (2, size)); size = rows * width
        casing : (items (ITEMS ring_size,); slot and sign of the loading)
        contact : (W to blade 0 (N,), turns (N, width) flat, wave, flight)
        state : rotor, ring, spectrum of the multipliers of the last step, gaps of
            three steps, sums by column (3 width,) and (4 k,), blades of the last
            solution (N + 2,), steps of last contacts, counter, ledger, impulse
        """
        force, pulse, lobe = loading
        c_b = rotor[0]
        c_c, slot, sign = casing
        column, turns, wave, flight = contact
        s_b, s_c, lam, gaps, sums_b, sums_c, known, last, counter, ledger, impulse = (
            state
        )
        spectrum, out_b, out_c = np.zeros(width), np.zeros(width), np.zeros(width)
        before, sample = np.zeros(blades), sample_space(state, blades, width)
        space = circulant_space(blades, wide, column, known)
        push, known, inverse, opening, where, _, _ = space
        between = exact and strides[0] % strides[1] != 0  # traces end no jump
        aside = aside_space(state)
        goal = counter[STEP] + steps
        while counter[STEP] < goal and counter[STOP] == RUNNING:
            jumped, far = False, 0.0
            if (
                exact
                and counter[STEP] >= counter[NEXT_TRY]
                and (counter[LAST] != counter[STEP])
            ):
                begun = counter[STEP]
                if between:
                    put_aside(state, aside)
                jumped = fly(
                    strides[1], step, scene, force, pulse, c_b, c_c, wave, flight,
                    state, (out_b, out_c, spectrum), rows, ring_rows, k, wide,
                )  # fmt: skip
                if jumped and between:
                    keep_between(
                        begun, strides[0], step, mu, scene[0], rotor, c_c, turns, wave,
                        flight, state, aside, sample, tracks, rows, ring_rows, k,
                    )  # fmt: skip
            if not jumped:
                odd = counter[STEP] & 1
                ring_now = (2 + 2 * odd) * ring_size
                ring_then = (4 - 2 * odd) * ring_size
                ended = not exact or counter[ENDED] != counter[STEP]
                touched = ended and counter[LAST] == counter[STEP]
                pass_rotor(
                    s_b, s_b, c_b, lam, rows, width, (1 + odd) * size,
                    (2 - odd) * size, ended, touched, True, exact, out_b, sums_b,
                )  # fmt: skip
                pass_ring(
                    s_c, s_c, c_c, lam, ring_rows, k, ring_now, ring_then, ended,
                    touched, True, exact, out_c, sums_c,
                )  # fmt: skip
                thrust = pulse_of(counter[STEP] * step, force, pulse)
                counter[STEP] += 1
                time, angle = counter[STEP] * step, 0.0
                if thrust != 0.0:
                    angle = scene[1] * ((speed * time) % (2.0 * math.pi))
                if thrust != 0.0:
                    push_pulse(
                        s_c, c_c, ring_size, thrust, lobe, sign, angle, ring_then,
                        out_c, k,
                    )  # fmt: skip
                for c in range(0, width, FOUR):
                    store(spectrum, c, load(out_b, c) + load(out_c, c))
                far = size_of(out_b, width)
                if ring_size == 0 and scene[2] != 0.0:
                    write_wall(scene, time, speed, slot, sign, spectrum)
                row = counter[STEP] % 3 * 2 * wide
                lowest = to_gaps(spectrum, wave, scene[0], k, wide, gaps, row)
                if lowest < 0.0:
                    active = guess(
                        gaps, row, lowest, blades, wide, padded, push, known, inverse,
                        opening, where, column,
                    )  # fmt: skip
                    if active < 0:
                        active = solve_any(gaps, row, blades, wide, space)
                    if active < 0:
                        counter[STOP] = COMPLEMENTARITY
                        return
                    older = (counter[STEP] + 1) % 3 * 2 * wide
                    if not exact:  # where the impact's loss is booked by columns
                        for s in range(active):
                            j = where[s]
                            before[j] = gaps[older + place_of(j, blades, wide)]
                    elif ring_size == 0 and scene[2] != 0.0:
                        carried = carried_by_wall(
                            push, where, active, blades, scene, speed, time, step
                        )  # what the columns take for impact
                        ledger[ROTATION] += carried
                        ledger[IMPACT] += carried
                    to_spectrum(push, where, active, turns, width, lam)
                    book_contacts(
                        push, where, active, before, last, counter, ledger, impulse,
                        step,
                    )  # fmt: skip
                if thrust != 0.0:
                    ledger[PULSE] += pulse_work(
                        s_c, c_c, lam, ring_size, k, thrust, lobe, sign, angle,
                        ring_then, ring_now, counter[LAST] == counter[STEP],
                    )  # fmt: skip
                if counter[STEP] % FLUSH_EVERY == 0:
                    flush(s_b)
                    flush(s_c)
            if jumped:
                far = size_of(out_b, width)
            if far > LESS * limit and farthest(out_b, turns, blades, width) > limit:
                counter[STOP] = AMPLITUDE
            keep = counter[STEP] % strides[0] == 0
            judge = counter[STEP] % strides[1] == 0
            if keep or judge:
                sample[-1][:] = 0.0
                if ring_size == 0 and scene[2] != 0.0:
                    write_wall(
                        scene, counter[STEP] * step, speed, slot, sign, sample[-1]
                    )
                sample_cyclic(
                    step, mu, scene[0], counter[STEP] % 3 * 2 * wide, rotor, c_c, turns,
                    wave, state, sample, keep, judge, tracks, rows, ring_rows, width,
                    exact,
                )  # fmt: skip

    return march_cyclic
