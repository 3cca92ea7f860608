"""Scheme `paper`: Algorithm 1 on the dense reduced matrices. Slow and obvious."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from hpcwhirl.dynamics.kernels.contact import (
    AMPLITUDE,
    COMPLEMENTARITY,
    ELEMENTS,
    FRICTION,
    PULSE,
    ROTATION,
    RUNNING,
    STEP,
    STOP,
    book_contacts,
    complementarity,
    contact_space,
    pulse_of,
    write_sample,
)
from hpcwhirl.dynamics.kernels.general import (
    FLUSH_EVERY,
    farthest,
    flush,
    place_blades,
    pulse_work,
    read_gaps,
)
from hpcwhirl.dynamics.kernels.opening import note_miss


@njit(cache=True)
def apply_dense(matrix_t, vector, sign, out):
    """Add sign * matrix @ vector to out; `matrix_t` is stored by columns."""
    for c in range(len(vector)):
        factor = sign * vector[c]
        column = matrix_t[c]
        for r in range(len(out)):
            out[r] += factor * column[r]


@njit(cache=True)
def predict_dense(keep, pull, values, increments, ahead):
    """Set d_{n+1} without forces."""
    ahead[:] = 0.0
    apply_dense(keep, increments, 1.0, ahead)
    apply_dense(pull, values, -1.0, ahead)


@njit(cache=True)
def accept_dense(values, increments, ahead, damping, step, work):
    """Take the step; return damping loss (d' + d)^T D (d' + d) / (4 dt), J."""
    for i in range(len(values)):
        increments[i] += ahead[i]
    work[:] = 0.0
    apply_dense(damping, increments, 1.0, work)
    loss = 0.0
    for i in range(len(values)):
        loss += increments[i] * work[i]
        increments[i] = ahead[i]
        values[i] += ahead[i]
    return loss / (4.0 * step)


@njit(cache=True)
def dense_energy(values, increments, mass, stiffness, step):
    """Return 1/2 v^T M v + 1/2 x_n^T K x_{n+1} at n + 1/2, J."""
    work = np.zeros_like(values)
    apply_dense(mass, increments, 0.5 / step**2, work)
    total = 0.0
    for i in range(len(values)):
        total += work[i] * increments[i]
    work[:] = 0.0
    apply_dense(stiffness, values, 0.5, work)
    for i in range(len(values)):
        total += work[i] * (values[i] - increments[i])
    return total


@njit(cache=True)
def push_dense(force_n, force_t, mu, inverse, ahead, increments, ledger):
    """Correct dense increments by contact forces and enter their work."""
    for c in range(len(ahead)):
        force = force_n[c] + mu * force_t[c]
        if force != 0.0:
            for r in range(len(ahead)):
                ahead[r] += inverse[c, r] * force
    for i in range(len(ahead)):
        mean = 0.5 * (ahead[i] + increments[i])
        ledger[ROTATION] += force_n[i] * mean
        ledger[FRICTION] += mu * force_t[i] * mean


@njit(cache=True)
def push_all(lam, index, shape, radial, tangential, normal, drag):
    """Set the ring's normal and tangential loads, both (n,), of the multipliers."""
    normal[:] = 0.0
    drag[:] = 0.0
    for j in range(len(lam)):
        if lam[j] > 0.0:
            for a in range(index.shape[1]):
                normal[radial[index[j, a]]] += lam[j] * shape[j, a]
                drag[tangential[index[j, a]]] += lam[j] * shape[j, a]


@njit(cache=True)
def march_paper(
    steps, strides, limit, step, speed, mu, scene, load, rotor, casing, contact, state,
    tracks,
):  # fmt: skip
    """March `steps` steps of Algorithm 1.

    As `march_general`, with the bodies in physical coordinates: rotor and casing
    begin with (keep, pull, inverse, mass, stiffness, damping), keep =
    A^-1 (M/dt^2 - D/2dt), pull = A^-1 K, inverse = A^-1, A = M/dt^2 + D/2dt, each
    stored transposed; load is (F, tau, load (nc,)). Tips are the rotor's first 2 N
    coordinates, x_o and y_o the next two if its last item is 1; the casing goes on
    with its radial (R,) and tangential (R,) coordinates and the ring.
    """
    force, pulse, lobes = load
    keep_b, pull_b, inverse_b, mass_b, stiff_b, damp_b, free = rotor
    keep_c, pull_c, inverse_c, mass_c, stiff_c, damp_c, radial, tangential, ring = (
        casing
    )
    w_rotor, compliance = contact
    (
        x_b, d_b, x_c, d_c, loss_b, loss_c, last, older, touched, counter, ledger,
        impulse,
    ) = state  # fmt: skip
    blades, coordinates = len(last), len(compliance)
    ahead_b, ahead_c = np.empty_like(x_b), np.empty_like(x_c)
    normal_b, drag_b = np.zeros_like(x_b), np.zeros_like(x_b)
    normal_c, drag_c = np.zeros_like(x_c), np.zeros_like(x_c)
    work_b, work_c = np.empty_like(x_b), np.empty_like(x_c)
    u, w, tips = np.zeros(blades), np.zeros(coordinates), np.zeros((blades + 1, 2))
    gaps, opened, lam = np.zeros(blades), np.zeros(blades), np.zeros(blades)
    width = 4 if ring[0] == ELEMENTS else coordinates
    index, shape = np.zeros((blades, width), np.int64), np.zeros((blades, width))
    space = contact_space(blades, coordinates)
    for _ in range(steps):
        now = counter[STEP] * step
        following = (counter[STEP] + 1) * step
        turned = (speed * following) % (2.0 * math.pi)
        predict_dense(keep_b, pull_b, x_b, d_b, ahead_b)
        predict_dense(keep_c, pull_c, x_c, d_c, ahead_c)
        push = pulse_of(now, force, pulse)
        if push != 0.0:
            apply_dense(inverse_c, lobes, push, ahead_c)
        for j in range(blades):
            u[j] = x_b[2 * j] + ahead_b[2 * j]
        for r in range(coordinates):
            w[r] = x_c[radial[r]] + ahead_c[radial[r]]
        place_blades(ring, turned, index, shape)
        lowest = read_gaps(u, w, scene, ring, index, shape, turned, following, gaps)
        counter[STEP] += 1
        if farthest(u, blades) > limit:
            counter[STOP] = AMPLITUDE
        if lowest < 0.0:
            space[2][:] = 0  # W changes as the blades pass
            active = complementarity(
                gaps, w_rotor, compliance, index, shape, lam, opened, space
            )
            if active < 0:
                counter[STOP] = COMPLEMENTARITY
                return
            for j in range(blades):
                normal_b[2 * j], drag_b[2 * j + 1] = -lam[j], -lam[j]
            push_all(lam, index, shape, radial, tangential, normal_c, drag_c)
            push_dense(normal_b, drag_b, mu, inverse_b, ahead_b, d_b, ledger)
            push_dense(normal_c, drag_c, mu, inverse_c, ahead_c, d_c, ledger)
            book_contacts(
                space[4], space[6], active, older, touched, counter, ledger, impulse,
                step,
            )  # fmt: skip
        else:
            opened[:] = gaps
        if push != 0.0:
            ledger[PULSE] += pulse_work(push, lobes, ahead_c, d_c)
        loss_b[0] += accept_dense(x_b, d_b, ahead_b, damp_b, step, work_b)
        loss_c[0] += accept_dense(x_c, d_c, ahead_c, damp_c, step, work_c)
        older[:] = last
        last[:] = opened
        if counter[STEP] % FLUSH_EVERY == 0:
            flush(x_b, d_b)
            flush(x_c, d_c)
        keep = counter[STEP] % strides[0] == 0
        judge = counter[STEP] % strides[1] == 0
        if keep or judge:
            energies = (
                dense_energy(x_b, d_b, mass_b, stiff_b, step),
                dense_energy(x_c, d_c, mass_c, stiff_c, step),
            )
            for j in range(blades):
                tips[j, 0], tips[j, 1] = x_b[2 * j], x_b[2 * j + 1]
            if judge and lowest < 0.0:
                for j in range(blades):
                    u[j] = x_b[2 * j]
                for r in range(coordinates):
                    w[r] = x_c[radial[r]]
                read_gaps(u, w, scene, ring, index, shape, turned, following, gaps)
                note_miss(gaps, last, u, scene[0], ledger)
            if free == 1:
                tips[blades, 0], tips[blades, 1] = x_b[2 * blades], x_b[2 * blades + 1]
            lost = loss_b.sum() + loss_c.sum()
            write_sample(
                counter, ledger, impulse, tips, x_c, energies, lost, keep, judge, tracks
            )
        if counter[STOP] != RUNNING:
            return
