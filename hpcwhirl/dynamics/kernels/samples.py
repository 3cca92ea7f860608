"""Reading a state of the cyclic kernel: energies, works, tips, samples.

Nothing here moves the motion: samples are made of copies with their step ended.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from hpcwhirl.dynamics.kernels.contact import (
    ENDED,
    FRICTION,
    IMPACT,
    LAST,
    ROTATION,
    SAMPLE,
    STEP,
    write_sample,
)
from hpcwhirl.dynamics.kernels.flight import leap
from hpcwhirl.dynamics.kernels.general import modal_energy
from hpcwhirl.dynamics.kernels.named import CyclicState, SampleSpace
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
)
from hpcwhirl.dynamics.kernels.vectors import (
    FOUR,
    broadcast,
    element,
    fma,
    higher_of,
    load,
    root,
)


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
    total = broadcast(0.0)
    for c in range(0, width, FOUR):
        part = load(spectrum, c)
        total = total + higher_of(part, broadcast(0.0) - part)
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
    total = broadcast(0.0)
    for col in range(0, width, FOUR):
        spectrum = broadcast(0.0)
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
def sample_cyclic(step, mu, gap, row, rotor, c_c, turns, wave, state, sample, keep,
                  judge, tracks, rows, ring_rows, width, exact):  # fmt: skip
    """Write a sample of the state as it is with its step ended.

    Tips are read where they are kept. Where there is contact and the motion is judged,
    the gaps are compared with `row` of those that were solved.
    """
    counter, ledger, impulse = state.counter, state.ledger, state.impulse
    t_b, t_c, end_b, end_c, columns, tips, whole, again, wall = sample
    c_b, hub = rotor
    settle(c_b, c_c, state, (t_b, t_c, end_b, end_c), rows, ring_rows, width, exact)
    energies = energies_of(t_b, c_b, t_c, c_c, counter[STEP] & 1, step, exact)
    if judge and counter[LAST] == counter[STEP]:
        most = radial_bound(t_b, c_b, rows * width, width)
        note_miss_cyclic(t_b, c_b, t_c, c_c, wave, gap, most, state.gaps, row, wall,
                         again, len(impulse), ledger)  # fmt: skip
    if keep and len(tracks.tips) > 0:
        read_tips(t_b, c_b, hub, turns, width, columns, tips)
    read_centre(t_b, hub, tips)
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
    return SampleSpace(
        np.zeros_like(state.rotor), np.zeros_like(state.ring),
        np.zeros_like(state.sums_b), np.zeros_like(state.sums_c), np.zeros(width),
        np.zeros((blades + 1, 2)), np.zeros_like(state.ledger),
        np.zeros(len(state.gaps) // 3), np.zeros(width),
    )  # fmt: skip


@njit(error_model="numpy", cache=True)
def settle(c_b, c_c, state, copies, rows, ring_rows, width, exact):
    """Set copies of bodies and sums (s_b, s_c, sums_b, sums_c), their step ended."""
    t_b, t_c, end_b, end_c = copies
    end_b[:] = state.sums_b
    end_c[:] = state.sums_c
    end_step(
        state.rotor, t_b, c_b, state.ring, t_c, c_c, state.lam, state.counter, end_b,
        end_c, rows, ring_rows, width, exact,
    )  # fmt: skip


@njit(error_model="numpy", cache=True)
def aside_space(state):
    """Return a state with copies of what a jump changes: bodies, sums and counter."""
    return CyclicState(
        state.rotor.copy(), state.ring.copy(), state.lam, state.gaps,
        state.sums_b.copy(), state.sums_c.copy(), state.known, state.last,
        state.counter.copy(), state.ledger, state.impulse,
    )  # fmt: skip


@njit(error_model="numpy", cache=True)
def put_aside(state, aside):
    """Copy what a jump changes."""
    aside.rotor[:], aside.ring[:] = state.rotor, state.ring
    aside.sums_b[:], aside.sums_c[:] = state.sums_b, state.sums_c
    aside.counter[:] = state.counter


@njit(error_model="numpy", cache=True)
def keep_between(begun, stride, step, mu, gap, rotor, c_c, turns, wave, flight, state,
                 aside, sample, tracks, rows, ring_rows, k):  # fmt: skip
    """Write the samples of the traces that a jump has passed over, from copies of it.

    A jump ends at the evidence, never at a sample of the traces, so that the motion is
    the same whatever is kept of it.
    """
    counter, own = state.counter, aside.counter
    if own[ENDED] != begun:  # the step that waited has been ended by the jump
        end_step(
            aside.rotor, aside.rotor, rotor.items, aside.ring, aside.ring, c_c,
            aside.lam, own, aside.sums_b, aside.sums_c, rows, ring_rows, 2 * k, True,
        )  # fmt: skip
        own[ENDED] = begun
    outs = np.zeros(2 * k), np.zeros(2 * k), np.zeros(2 * k)
    first = (begun // stride + 1) * stride
    for goal in range(first, counter[STEP], stride):
        while own[STEP] < goal:
            leap(goal - own[STEP], rotor.items, c_c, flight, aside, outs, rows,
                 ring_rows, k)  # fmt: skip
        own[SAMPLE] = counter[SAMPLE]
        sample_cyclic(
            step, mu, gap, 0, rotor, c_c, turns, wave, aside, sample, True, False,
            tracks, rows, ring_rows, 2 * k, True,
        )  # fmt: skip
        counter[SAMPLE] = own[SAMPLE]
