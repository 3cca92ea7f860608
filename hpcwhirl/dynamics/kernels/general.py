"""The general modal kernel: any rotor, any ring, mode by mode. The oracle of others."""

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
    RIGID,
    ROTATION,
    RUNNING,
    STEP,
    STOP,
    book_contacts,
    complementarity,
    contact_space,
    place_on_elements,
    place_on_waves,
    pulse_of,
    read_ring,
    rigid_radial,
    write_sample,
)
from hpcwhirl.dynamics.kernels.opening import note_miss

FLUSH_EVERY = 256  # steps; see `flush`
TINY = 1e-150


@njit(cache=True)
def flush(values, increments):
    """Zero amplitudes below 1e-150 before their products become denormal."""
    for m in range(len(values)):
        if abs(values[m]) < TINY and abs(increments[m]) < TINY:
            values[m] = 0.0
            increments[m] = 0.0


@njit(cache=True)
def accumulate(rows, values, out):
    """Set out = values @ rows, four rows at a time; rows is (m, n), m % 4 == 0."""
    for j in range(len(out)):
        out[j] = 0.0
    for m in range(0, len(values), 4):
        a, b, c, d = values[m], values[m + 1], values[m + 2], values[m + 3]
        ra, rb, rc, rd = rows[m], rows[m + 1], rows[m + 2], rows[m + 3]
        for j in range(len(out)):
            out[j] += (a * ra[j] + b * rb[j]) + (c * rc[j] + d * rd[j])


@njit(cache=True)
def predict(keep, pull, values, increments, ahead, following):
    """Set d_{n+1} (`ahead`) and q_{n+1} (`following`) without forces."""
    for m in range(len(values)):
        step = keep[m] * increments[m] - pull[m] * values[m]
        ahead[m] = step
        following[m] = values[m] + step


@njit(cache=True)
def accept(values, increments, ahead, rate, loss):
    """Take the step; add damping loss 2 xi w (d' + d)^2 / (4 dt) mode by mode."""
    for m in range(len(values)):
        both = ahead[m] + increments[m]
        loss[m] += rate[m] * both * both
        values[m] += ahead[m]
        increments[m] = ahead[m]


@njit(cache=True)
def modal_energy(values, increments, omega, step):
    """Return 1/2 v^2 + 1/2 w^2 q_n q_{n+1} over all modes at n + 1/2, J."""
    total = 0.0
    for m in range(len(values)):
        speed = increments[m] / step
        total += 0.5 * speed * speed
        total += 0.5 * omega[m] * omega[m] * values[m] * (values[m] - increments[m])
    return total


@njit(cache=True)
def push_modes(force_n, force_t, mu, give, ahead, increments, ledger):
    """Correct the increments by modal contact forces and enter their work."""
    for m in range(len(ahead)):
        ahead[m] += give[m] * (force_n[m] + mu * force_t[m])
    for m in range(len(ahead)):
        mean = 0.5 * (ahead[m] + increments[m])
        ledger[ROTATION] += force_n[m] * mean
        ledger[FRICTION] += mu * force_t[m] * mean


@njit(cache=True)
def place_blades(ring, turned, index, shape):
    """Set what the blades read of the ring; ring: kind, size, element length."""
    kind, size, length = ring
    if kind == ELEMENTS:
        place_on_elements(turned, size, length, index, shape)
    elif kind != RIGID:
        place_on_waves(turned, size, index, shape)


@njit(cache=True)
def read_gaps(u, radial, scene, ring, index, shape, turned, time, gaps):
    """Set the N gaps from tips and radial coordinates; return the lowest."""
    n = len(gaps)
    lowest = 1.0
    for j in range(n):
        if ring[0] == RIGID:
            w = rigid_radial(scene, time, turned + 2.0 * math.pi * j / n)
        else:
            w = read_ring(radial, index, shape, j)
        gaps[j] = scene[0] + w - u[j]
        lowest = min(lowest, gaps[j])
    return lowest


@njit(cache=True)
def farthest(u, blades):
    """Return the largest radial displacement of a tip, m."""
    most = 0.0
    for j in range(blades):
        most = max(most, abs(u[j]))
    return most


@njit(cache=True)
def push_pulse(push, lobes, give, ahead, following):
    """Add the loading's increments."""
    for m in range(len(ahead)):
        change = give[m] * push * lobes[m]
        ahead[m] += change
        following[m] += change


@njit(cache=True)
def pulse_work(push, lobes, ahead, increments):
    """Return the loading's work in a step, J."""
    total = 0.0
    for m in range(len(ahead)):
        total += push * lobes[m] * 0.5 * (ahead[m] + increments[m])
    return total


@njit(cache=True)
def collect(lam, rows, sign, out):
    """Set out (m,) = sign * lam @ rows; rows (N, m)."""
    out[:] = 0.0
    for j in range(len(lam)):
        if lam[j] > 0.0:
            for m in range(len(out)):
                out[m] += sign * lam[j] * rows[j, m]


@njit(cache=True)
def collect_on_ring(lam, index, shape, rows, out):
    """Set out (m,), the modal forces of lam through what the blades read."""
    out[:] = 0.0
    for j in range(len(lam)):
        if lam[j] > 0.0:
            for a in range(index.shape[1]):
                part = lam[j] * shape[j, a]
                row = rows[index[j, a]]
                for m in range(len(out)):
                    out[m] += part * row[m]


@njit(cache=True)
def read_tips(outputs, tangential, values, u, tips):
    """Set tips (N + 1, 2): radial and tangential of each blade, then x_o, y_o."""
    blades = len(tangential)
    accumulate(outputs, values, u)
    for j in range(blades):
        total = 0.0
        for m in range(len(values)):
            total += tangential[j, m] * values[m]
        tips[j, 0], tips[j, 1] = u[j], total
    tips[blades, 0], tips[blades, 1] = u[blades], u[blades + 1]


@njit(cache=True)
def march_general(
    steps, strides, limit, step, speed, mu, scene, load, rotor, casing, contact, state,
    tracks,
):  # fmt: skip
    """March `steps` steps of the central differences, see timestep.recursion.

    Parameters
    ----------
    steps : to take
    strides : steps between samples of the traces, and between rows of the evidence
    limit : tip displacement that ends the run, at any step, m
    step, speed : dt, s; Omega, rad/s
    mu : friction coefficient times the sign of Omega
    scene : (gap, k, amplitude, growth, rise)
    load : (F, tau, modal load (mc,))
    rotor : (keep, pull, give, rate, omega, outputs (mb, N + 2), radial (N, mb),
        tangential (N, mb)); outputs are radial tips, then x_o, y_o
    casing : (keep, pull, give, rate, omega, read (mc, R), radial (R, mc),
        tangential (R, mc), ring); ring is kind, size, element length
    contact : (W of the rotor (N, N), compliance (R, R))
    state : q, d of rotor and casing, losses, gaps of the last two steps, touched,
        counter, ledger, impulse
    tracks : of `write_sample`
    """
    force, pulse, lobes = load
    keep_b, pull_b, give_b, rate_b, omega_b, outputs, radial, tangential = rotor
    keep_c, pull_c, give_c, rate_c, omega_c, read_c, radial_c, along_c, ring = casing
    w_rotor, compliance = contact
    (
        q_b, d_b, q_c, d_c, loss_b, loss_c, last, older, touched, counter, ledger,
        impulse,
    ) = state  # fmt: skip
    blades, coordinates = len(last), len(compliance)
    ahead_b, next_b = np.empty_like(q_b), np.empty_like(q_b)
    ahead_c, next_c = np.empty_like(q_c), np.empty_like(q_c)
    normal_b, drag_b = np.empty_like(q_b), np.empty_like(q_b)
    normal_c, drag_c = np.empty_like(q_c), np.empty_like(q_c)
    u, w, tips = np.zeros(blades + 2), np.zeros(coordinates), np.zeros((blades + 1, 2))
    gaps, opened, lam = np.zeros(blades), np.zeros(blades), np.zeros(blades)
    width = 4 if ring[0] == ELEMENTS else coordinates
    index, shape = np.zeros((blades, width), np.int64), np.zeros((blades, width))
    space = contact_space(blades, coordinates)
    for _ in range(steps):
        now = counter[STEP] * step
        following = (counter[STEP] + 1) * step
        turned = (speed * following) % (2.0 * math.pi)
        predict(keep_b, pull_b, q_b, d_b, ahead_b, next_b)
        predict(keep_c, pull_c, q_c, d_c, ahead_c, next_c)
        push = pulse_of(now, force, pulse)
        if push != 0.0:
            push_pulse(push, lobes, give_c, ahead_c, next_c)
        accumulate(outputs, next_b, u)
        accumulate(read_c, next_c, w)
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
            collect(lam, radial, -1.0, normal_b)
            collect(lam, tangential, -1.0, drag_b)
            collect_on_ring(lam, index, shape, radial_c, normal_c)
            collect_on_ring(lam, index, shape, along_c, drag_c)
            push_modes(normal_b, drag_b, mu, give_b, ahead_b, d_b, ledger)
            push_modes(normal_c, drag_c, mu, give_c, ahead_c, d_c, ledger)
            book_contacts(
                space[4], space[6], active, older, touched, counter, ledger, impulse,
                step,
            )  # fmt: skip
        else:
            opened[:] = gaps
        if push != 0.0:
            ledger[PULSE] += pulse_work(push, lobes, ahead_c, d_c)
        accept(q_b, d_b, ahead_b, rate_b, loss_b)
        accept(q_c, d_c, ahead_c, rate_c, loss_c)
        older[:] = last
        last[:] = opened
        if counter[STEP] % FLUSH_EVERY == 0:
            flush(q_b, d_b)
            flush(q_c, d_c)
        keep = counter[STEP] % strides[0] == 0
        judge = counter[STEP] % strides[1] == 0
        if keep or judge:
            energies = (
                modal_energy(q_b, d_b, omega_b, step),
                modal_energy(q_c, d_c, omega_c, step),
            )
            read_tips(outputs, tangential, q_b, u, tips)
            if judge and lowest < 0.0:
                accumulate(read_c, q_c, w)
                read_gaps(u, w, scene, ring, index, shape, turned, following, gaps)
                note_miss(gaps, last, u, scene[0], ledger)
            lost = loss_b.sum() + loss_c.sum()
            write_sample(
                counter, ledger, impulse, tips, q_c, energies, lost, keep, judge, tracks
            )
        if counter[STOP] != RUNNING:
            return
