"""The cyclic modal kernel: nodal diameter by nodal diameter, in the rotating frame.

The recursion is that of the general kernel. Amplitudes are complex, one for the two
phases of a double mode, and sorted in rows: row f holds the f-th mode of every nodal
diameter kappa = 0 .. K - 1, K = N // 2 + 1. Harmonic h of the ring rides in the slot
kappa = h folded mod N (conjugated where N - h folds on it) and is marched in the
rotating frame, y = C e^{i h Omega t}, where one step is

D' = keep E D - pull E y + give f,   y' = E y + D',   E = e^{i h Omega dt},

so that nothing depends on the blades' place: with gamma the radial amplitude of each
mode (tips counted negative), sum over rows gamma y is a spectrum G of the gaps,

g_j = gap + Re sum_kappa G_kappa e^{2 pi i kappa j / N},

one real transform of N points for both bodies; the spectrum of the multipliers,
Lambda_kappa = sum_j lambda_j e^{-2 pi i kappa j / N}, gives every modal force as
(gamma + mu conj(sigma)) Lambda, sigma the tangential amplitude; and the Delassus
matrix is constant and circulant.

Sizes are literals of the compiled code (a kernel for each), which lets the compiler
see that no two rows overlap.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
from numba import njit

from hpcwhirl.dynamics.kernels.contact import (
    COMPLEMENTARITY,
    FRICTION,
    PULSE,
    ROTATION,
    RUNNING,
    STEP,
    STOP,
    book_contacts,
    complementarity,
    contact_space,
    penetrating_alone,
    pulse_of,
    rigid_amplitude,
    write_sample,
)
from hpcwhirl.dynamics.kernels.general import FLUSH_EVERY, TINY, modal_energy

ROTOR_STATE, ROTOR_ITEMS = 3, 8
RING_STATE, RING_ITEMS = 6, 10


@njit(error_model="numpy", cache=True, inline="always")
def step_rotor(s, c, rows, width, out, sums):
    """March the rotor's modes; set out (width,): sum of gamma q; add damping loss.

    s : (3 size,): q, d, d' + d; c : keep, pull, rate, gamma, ...; sums : (3 width,):
    work of normal forces and of drag, damping loss, by column
    """
    size = rows * width
    for col in range(width):
        spectrum, loss = 0.0, 0.0
        for f in range(rows):
            m = f * width + col
            q, d = s[m], s[size + m]
            ahead = c[m] * d - c[size + m] * q
            both, value = ahead + d, q + ahead
            s[m] = value
            s[size + m] = ahead
            s[2 * size + m] = both
            loss += c[2 * size + m] * both * both
            spectrum += c[3 * size + m] * value
        out[col] = spectrum
        sums[2 * width + col] += loss


@njit(error_model="numpy", cache=True, inline="always")
def step_ring(s, c, rows, k, out, sums):
    """March the ring's modes; set out (2 k,): re and im of sum psi y; add to sums.

    s : (6 size,): re and im of y, D, D' + E D; c : keep, pull, rate, re and im of E,
    psi, ...
    """
    size = rows * k
    for col in range(k):
        real, imag, loss = 0.0, 0.0, 0.0
        for r in range(rows):
            m = r * k + col
            er, ei = c[3 * size + m], c[4 * size + m]
            yr, yi, dr, di = s[m], s[size + m], s[2 * size + m], s[3 * size + m]
            keep, pull = c[m], c[size + m]
            pr, pi = er * dr - ei * di, er * di + ei * dr
            zr, zi = er * yr - ei * yi, er * yi + ei * yr
            ar, ai = keep * pr - pull * zr, keep * pi - pull * zi
            br, bi = ar + pr, ai + pi
            yr, yi = zr + ar, zi + ai
            s[m] = yr
            s[size + m] = yi
            s[2 * size + m] = ar
            s[3 * size + m] = ai
            s[4 * size + m] = br
            s[5 * size + m] = bi
            loss += c[2 * size + m] * (br * br + bi * bi)
            real += c[5 * size + m] * yr
            imag += c[5 * size + m] * yi
        out[col] = real
        out[k + col] = imag
        sums[2 * k + col] += loss


@njit(error_model="numpy", cache=True, inline="always")
def to_gaps(spectrum, wave, k, wide, even, odd):
    """Transform; return the lowest of even - |odd|, the gap of j or of N - j."""
    for j in range(wide):
        total = 0.0
        for c in range(k):
            total += spectrum[c] * wave[c * wide + j]
        even[j] = total
    for j in range(wide):
        total = 0.0
        for c in range(k):
            total += spectrum[k + c] * wave[(k + c) * wide + j]
        odd[j] = total
    lowest = even[0]
    for j in range(wide):
        value = even[j] - abs(odd[j])
        lowest = value if value < lowest else lowest
    return lowest


@njit(error_model="numpy", cache=True, inline="always")
def at_blade(spectrum, turns, j, width):
    """Return Re sum_kappa spectrum e^{2 pi i kappa j / N}; width % 4 == 0."""
    row = turns[j]
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    for i in range(0, width, 4):
        a += spectrum[i] * row[i]
        b += spectrum[i + 1] * row[i + 1]
        c += spectrum[i + 2] * row[i + 2]
        d += spectrum[i + 3] * row[i + 3]
    return (a + b) + (c + d)


@njit(error_model="numpy", cache=True, inline="always")
def push_rotor(s, c, lam, mu, rows, width, sums):
    """Correct the rotor by contact; add the works and what the loss changes by.

    lam : (2 width,): the spectrum of the multipliers, then (im, -re) of it
    """
    size = rows * width
    for col in range(width):
        straight, quarter = lam[col], lam[width + col]
        normal, drag, loss = 0.0, 0.0, 0.0
        for f in range(rows):
            m = f * width + col
            push = c[3 * size + m] * straight
            along = c[5 * size + m] * straight + c[6 * size + m] * quarter
            change = c[4 * size + m] * (push + mu * along)
            old = s[2 * size + m]
            both = old + change
            s[m] += change
            s[size + m] += change
            loss += c[2 * size + m] * change * (old + both)
            normal += push * both
            drag += along * both
        sums[col] += normal
        sums[width + col] += drag
        sums[2 * width + col] += loss


@njit(error_model="numpy", cache=True, inline="always")
def push_ring(s, c, lam, mu, rows, k, sums):
    """Correct the ring by contact; add the works and what the loss changes by.

    lam : (2 k,): re and im of the spectrum of the multipliers
    """
    size = rows * k
    for col in range(k):
        lr, li = lam[col], lam[k + col]
        normal, drag, loss = 0.0, 0.0, 0.0
        for r in range(rows):
            m = r * k + col
            psi, give = c[5 * size + m], c[6 * size + m]
            sr, si = c[7 * size + m], c[8 * size + m]
            along_r, along_i = sr * lr + si * li, sr * li - si * lr
            cr, ci = give * (psi * lr + mu * along_r), give * (psi * li + mu * along_i)
            br, bi = s[4 * size + m], s[5 * size + m]
            nr, ni = br + cr, bi + ci
            s[m] += cr
            s[size + m] += ci
            s[2 * size + m] += cr
            s[3 * size + m] += ci
            s[4 * size + m] = nr
            s[5 * size + m] = ni
            loss += c[2 * size + m] * (cr * (br + nr) + ci * (bi + ni))
            normal += psi * (lr * nr + li * ni)
            drag += along_r * nr + along_i * ni
        sums[col] += normal
        sums[k + col] += drag
        sums[2 * k + col] += loss


@njit(error_model="numpy", cache=True)
def push_pulse(s, c, size, push, lobe, sign, angle, out, sums, k):
    """Add the loading's increments to the ring, its place turned by `angle`.

    lobe : (size,) modal load of the static frame; sign : -1 on conjugated slots;
    out, sums : of `step_ring`, corrected too
    """
    for m in range(size):
        if lobe[m] != 0.0:
            change = c[6 * size + m] * push * lobe[m]
            re, im = change * math.cos(angle), sign * change * math.sin(angle)
            br, bi = s[4 * size + m], s[5 * size + m]
            s[m] += re
            s[size + m] += im
            s[2 * size + m] += re
            s[3 * size + m] += im
            s[4 * size + m] = br + re
            s[5 * size + m] = bi + im
            gained = re * (2.0 * br + re) + im * (2.0 * bi + im)
            out[m % k] += c[5 * size + m] * re
            out[k + m % k] += c[5 * size + m] * im
            sums[2 * k + m % k] += c[2 * size + m] * gained


@njit(error_model="numpy", cache=True)
def pulse_work(s, size, push, lobe, sign, angle):
    """Return the loading's work in a step, J."""
    total = 0.0
    for m in range(size):
        if lobe[m] != 0.0:
            both = s[4 * size + m] * math.cos(angle)
            both += sign * s[5 * size + m] * math.sin(angle)
            total += 0.5 * push * lobe[m] * both
    return total


@njit(error_model="numpy", cache=True)
def total_energy(s_b, c_b, s_c, c_c, step):
    """Return the energy of both bodies at n + 1/2, J."""
    m, n = len(s_b) // ROTOR_STATE, len(s_c) // RING_STATE
    energy = modal_energy(s_b[:m], s_b[m : 2 * m], c_b[7 * m : 8 * m], step)
    omega = c_c[9 * n : 10 * n]
    energy += modal_energy(s_c[:n], s_c[2 * n : 3 * n], omega, step)
    return energy + modal_energy(s_c[n : 2 * n], s_c[3 * n : 4 * n], omega, step)


@njit(error_model="numpy", cache=True)
def column_sums(sums_b, sums_c):
    """Return works of normal forces and of drag (twice, and over mu), damping loss."""
    m, n = len(sums_b) // 3, len(sums_c) // 3
    normal = sums_b[:m].sum() + sums_c[:n].sum()
    drag = sums_b[m : 2 * m].sum() + sums_c[n : 2 * n].sum()
    return normal, drag, sums_b[2 * m :].sum() + sums_c[2 * n :].sum()


@njit(error_model="numpy", cache=True)
def read_tips(s, c, hub, turns, width, work, tips):
    """Set tips (N + 1, 2): radial and tangential of each blade, then x_o, y_o."""
    size = len(s) // ROTOR_STATE
    k, blades = width // 2, len(turns)
    for direction in range(2):
        work[:] = 0.0
        for m in range(size):
            col = m % width
            if direction == 0:
                work[col] -= c[3 * size + m] * s[m]
            elif col < k:  # tangential: -(re sigma + i im sigma) (re q + i im q)
                work[col] -= c[5 * size + m] * s[m] - c[6 * size + m] * s[m + k]
            else:
                work[col] -= c[5 * size + m] * s[m] + c[6 * size + m] * s[m - k]
        for j in range(blades):
            tips[j, direction] = at_blade(work, turns, j, width)
    for axis in range(2):
        total = 0.0
        for m in range(size):
            total += hub[axis, m] * s[m]
        tips[blades, axis] = total


@njit(error_model="numpy", cache=True)
def flush(s):
    """Zero amplitudes below 1e-150 before their products become denormal."""
    for m in range(len(s)):
        if abs(s[m]) < TINY:
            s[m] = 0.0


def widths(blades: int) -> tuple[int, int, int]:
    """Return slots of the rotor, slots of the ring, columns of the transform.

    Each is K = N // 2 + 1 padded to whole vectors.
    """
    k = blades // 2 + 1
    rotor, ring, wide = (-(-k // n) * n for n in (4, 8, 16))
    return rotor, ring, wide


@lru_cache(maxsize=64)
def cyclic_kernel(blades: int, rows: int, ring_rows: int) -> Callable[..., Any]:
    """Return the compiled kernel for N blades and these numbers of rows.

    Parameters
    ----------
    blades : N >= 3
    rows : rows of the rotor
    ring_rows : rows of the ring; 0 where the casing is rigid
    """
    half = blades // 2 + 1
    k, kr, wide = widths(blades)
    width = 2 * k
    ring_size = ring_rows * kr

    @njit(error_model="numpy", cache=True)
    def march_cyclic(
        steps, stride, limit, step, speed, mu, scene, load, rotor, casing, contact,
        state, tracks,
    ):  # fmt: skip
        """March `steps` steps; scalars, scene and tracks as in `march_general`.

        load : (F, tau, modal load (ring_size,))
        rotor : (items (8 size,): keep, pull, rate, gamma, give, sigma re, im, omega;
            hub (2, size)); size = rows * width
        casing : (items (10 ring_size,): keep, pull, rate, E re, im, psi, give,
            sigma re, im, omega; slot and sign of the loading)
        contact : (W^T (N, N), its spectrum (width,), turns (N, width), wave)
        state : rotor, ring, spectra of the gaps n and n - 1, sums by column (3 width,)
            and (3 kr,), touching, counter, ledger, impulse
        """
        force, pulse, lobe = load
        c_b, hub = rotor
        c_c, slot, sign = casing
        w_transposed, symbol, turns, wave = contact
        s_b, s_c, last, older, sums_b, sums_c, touching, counter, ledger, impulse = (
            state
        )
        spectrum, lam_b, lam_c = np.zeros(width), np.zeros(2 * width), np.zeros(2 * kr)
        out_b, out_c = np.zeros(width), np.zeros(2 * kr)
        even, odd = np.zeros(wide), np.zeros(wide)
        gaps, opened, lam = np.zeros(blades), np.zeros(blades), np.zeros(blades)
        before, tips = np.zeros(blades), np.zeros((blades + 1, 2))
        columns, whole = np.zeros(width), np.zeros(len(ledger))
        nothing, no_index = np.zeros((0, 0)), np.zeros((blades, 0), np.int64)
        space, touched = contact_space(blades, 0), True
        space[1][:] = w_transposed
        space[2][:] = 1  # W is constant
        for _ in range(steps):
            now = counter[STEP] * step
            following = (counter[STEP] + 1) * step
            step_rotor(s_b, c_b, rows, width, out_b, sums_b)
            step_ring(s_c, c_c, ring_rows, kr, out_c, sums_c)
            push = pulse_of(now, force, pulse)
            angle = 0.0
            if push != 0.0 or (ring_size == 0 and scene[2] != 0.0):
                angle = scene[1] * ((speed * following) % (2.0 * math.pi))
            if push != 0.0:
                push_pulse(
                    s_c, c_c, ring_size, push, lobe, sign, angle, out_c, sums_c, kr
                )
            for c in range(half):
                spectrum[c] = out_b[c] + out_c[c]
                spectrum[k + c] = out_b[k + c] + out_c[kr + c]
            if ring_size == 0 and scene[2] != 0.0:
                wall = rigid_amplitude(scene, following)
                spectrum[slot] -= wall * math.cos(angle)
                spectrum[k + slot] -= sign * wall * math.sin(angle)
            lowest = scene[0] + to_gaps(spectrum, wave, k, wide, even, odd)
            counter[STEP] += 1
            if lowest < 0.0:
                gaps[0] = scene[0] + even[0]
                for j in range(1, half):
                    gaps[j] = scene[0] + (even[j] - odd[j])
                    gaps[blades - j] = scene[0] + (even[j] + odd[j])
                active = penetrating_alone(gaps, lam, opened, space)
                if active < 0:
                    active = complementarity(
                        gaps, nothing, nothing, no_index, nothing, lam, opened, space
                    )
                if active < 0:
                    counter[STOP] = COMPLEMENTARITY
                    return
                lam_b[:] = 0.0
                for s in range(active):
                    j = space[6][s]
                    before[j] = scene[0] + at_blade(older, turns, j, width)
                    for c in range(width):
                        lam_b[c] += lam[j] * turns[j, c]
                for c in range(half):
                    lr, li = lam_b[c], lam_b[k + c]
                    lam_b[width + c], lam_b[width + k + c] = li, -lr
                    lam_c[c], lam_c[kr + c] = lr, li
                    spectrum[c] += symbol[c] * lr - symbol[k + c] * li
                    spectrum[k + c] += symbol[c] * li + symbol[k + c] * lr
                push_rotor(s_b, c_b, lam_b, mu, rows, width, sums_b)
                push_ring(s_c, c_c, lam_c, mu, ring_rows, kr, sums_c)
                book_contacts(
                    lam, space[6], active, opened, before, touching, counter, ledger,
                    impulse, step,
                )  # fmt: skip
                touched = True
            elif touched:
                touching[:] = 0
                touched = False
            if push != 0.0:
                ledger[PULSE] += pulse_work(s_c, ring_size, push, lobe, sign, angle)
            for c in range(width):
                older[c] = last[c]
                last[c] = spectrum[c]
            if counter[STEP] % FLUSH_EVERY == 0:
                flush(s_b)
                flush(s_c)
            if counter[STEP] % stride == 0:
                energy = total_energy(s_b, c_b, s_c, c_c, step)
                read_tips(s_b, c_b, hub, turns, width, columns, tips)
                normal, drag, loss = column_sums(sums_b, sums_c)
                whole[:] = ledger
                whole[ROTATION] += 0.5 * normal
                whole[FRICTION] += 0.5 * mu * drag
                write_sample(counter, whole, impulse, tips, energy, loss, limit, tracks)
                if counter[STOP] != RUNNING:
                    return

    return march_cyclic
