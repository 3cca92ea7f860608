"""One pass over the amplitudes of a body: end the last step, predict the next.

Amplitudes are complex, one for the two phases of a double mode, and sorted in rows:
row f holds the f-th mode of every slot (nodal diameter). A step of any mode is

d' = keep d - pull q + give f,   q' = q + d',

with the coefficients of central differences or of the exact flow (`timestep`); the
ring's are marched in the rotating frame, y = C e^{i h Omega t}, where d and q are first
turned by E = e^{i h Omega dt}. What contact adds to a step is known once all blades
have been predicted: it waits as the spectrum of the multipliers until the next pass,
which adds it, books the step's works and losses, and goes on. So every amplitude is
read and written once a step, and the two increments that a step needs take turns in
two places of the state (even and odd steps).
"""

from __future__ import annotations

import math

from numba import njit

from hpcwhirl.dynamics.kernels.contact import ENDED, LAST, STEP, rigid_amplitude
from hpcwhirl.dynamics.kernels.vectors import (
    FOUR,
    broadcast,
    element,
    fma,
    fnma,
    load,
    lower_of,
    store,
)

ROTOR_STATE, RING_STATE = 3, 6
# items of a mode
KEEP, PULL, RATE, RADIAL, NORMAL, ALONG, SR, SI, OMEGA = range(9)
MEAN_OLD, MEAN_NEW, MEAN_PLACE = 9, 10, 11  # dt (v- + v+) from d, d', q'
LOSS_DD, LOSS_DQ, LOSS_QQ = 12, 13, 14  # damping loss of a step, from d', q'
SPEED_D, SPEED_Q = 15, 16  # velocity from d, q
TURN_RE, TURN_IM, GIVE = 17, 18, 19
DAMPING, SPIN = 20, 21  # xi; h Omega of the ring's turn, signed
ITEMS = 22


@njit(error_model="numpy", cache=True, inline="always")
def pass_rotor(s, t, c, lam, rows, width, now, then, ended, touched, go, exact, out,
               sums):  # fmt: skip
    """End a step of the rotor and, if `go`, predict the next.

    Parameters
    ----------
    s, t : (3 size,), state read and written: q, and d in two places
    c : items of the modes
    lam : (2 width,), spectrum of the multipliers, then (im, -re) of it
    now, then : places of d and of the d before it; the next goes to `then`
    ended : whether a step waits to be booked; touched : whether with contact
    out : (width,), out: sum over rows of gamma q
    sums : (3 width,): works of normal forces and of drag (twice, over mu), and the
        damping loss, by column
    """
    size = rows * width
    for col in range(0, width, FOUR):
        straight, quarter = load(lam, col), load(lam, width + col)
        loss, spectrum = load(sums, 2 * width + col), broadcast(0.0)
        normal, drag_re, drag_im = broadcast(0.0), broadcast(0.0), broadcast(0.0)
        for f in range(rows):
            m = f * width + col
            q, d = load(s, m), load(s, now + m)
            if touched:
                change = load(c, ALONG * size + m) * quarter
                change = fma(load(c, NORMAL * size + m), straight, change)
                q, d = q + change, d + change
                store(t, now + m, d)
            if ended:
                if exact:
                    part = load(c, LOSS_DQ * size + m) * q
                    part = fma(load(c, LOSS_DD * size + m), d, part)
                    loss = fma(part, d, loss)
                    loss = fma(load(c, LOSS_QQ * size + m) * q, q, loss)
                    if touched:
                        both = load(c, MEAN_OLD * size + m) * load(s, then + m)
                        both = fma(load(c, MEAN_NEW * size + m), d, both)
                        both = fma(load(c, MEAN_PLACE * size + m), q, both)
                else:
                    both = d + load(s, then + m)
                    loss = fma(load(c, RATE * size + m) * both, both, loss)
                if touched:
                    normal = fma(load(c, RADIAL * size + m), both, normal)
                    drag_re = fma(load(c, SR * size + m), both, drag_re)
                    drag_im = fma(load(c, SI * size + m), both, drag_im)
            if go:
                d = fnma(load(c, PULL * size + m), q, load(c, KEEP * size + m) * d)
                q = q + d
                store(t, then + m, d)
                spectrum = fma(load(c, RADIAL * size + m), q, spectrum)
            else:
                store(t, now + m, d)
            store(t, m, q)
        store(sums, 2 * width + col, loss)
        if touched:
            store(sums, col, fma(straight, normal, load(sums, col)))
            drag = fma(quarter, drag_im, load(sums, width + col))
            store(sums, width + col, fma(straight, drag_re, drag))
        if go:
            store(out, col, spectrum)


@njit(error_model="numpy", cache=True, inline="always")
def pass_ring(s, t, c, lam, rows, k, now, then, ended, touched, go, exact, out, sums):
    """End a step of the ring and, if `go`, predict the next; as `pass_rotor`.

    s, t : (6 size,): re and im of y, and of d in two places; lam : re, im in its
    first 2 k; out : (2 k,), re and im of sum psi y; sums : (4 k,), the last the normal
    forces over what the ring's shape passes below the blades in a second (exact flow)
    """
    size = rows * k
    for col in range(0, k, FOUR):
        lr, li = load(lam, col), load(lam, k + col)
        loss, real, imag = load(sums, 2 * k + col), broadcast(0.0), broadcast(0.0)
        normal_re, normal_im = broadcast(0.0), broadcast(0.0)
        drag_re, drag_im = broadcast(0.0), broadcast(0.0)
        pass_re, pass_im = broadcast(0.0), broadcast(0.0)
        for r in range(rows):
            m = r * k + col
            er, ei = load(c, TURN_RE * size + m), load(c, TURN_IM * size + m)
            psi = load(c, RADIAL * size + m)
            yr, yi = load(s, m), load(s, size + m)
            dr, di = load(s, now + m), load(s, now + size + m)
            if touched:
                a, b = load(c, NORMAL * size + m), load(c, ALONG * size + m)
                cr, ci = fma(a, lr, b * li), fnma(b, lr, a * li)
                yr, yi, dr, di = yr + cr, yi + ci, dr + cr, di + ci
                store(t, now + m, dr)
                store(t, now + size + m, di)
            if ended:
                if exact:
                    part = fma(dr, dr, di * di)
                    loss = fma(load(c, LOSS_DD * size + m), part, loss)
                    part = fma(dr, yr, di * yi)
                    loss = fma(load(c, LOSS_DQ * size + m), part, loss)
                    part = fma(yr, yr, yi * yi)
                    loss = fma(load(c, LOSS_QQ * size + m), part, loss)
                if touched or not exact:
                    gr, gi = load(s, then + m), load(s, then + size + m)
                    br, bi = fnma(ei, gi, er * gr), fma(er, gi, ei * gr)
                    if exact:
                        old, new = (
                            load(c, MEAN_OLD * size + m),
                            load(c, MEAN_NEW * size + m),
                        )
                        at = load(c, MEAN_PLACE * size + m)
                        if touched:
                            spin = load(c, SPIN * size + m) * psi
                            pass_re = fnma(spin, yi, pass_re)
                            pass_im = fma(spin, yr, pass_im)
                        br = fma(old, br, fma(new, dr, at * yr))
                        bi = fma(old, bi, fma(new, di, at * yi))
                    else:
                        br, bi = br + dr, bi + di
                        part = fma(br, br, bi * bi)
                        loss = fma(load(c, RATE * size + m), part, loss)
                    if touched:
                        sr, si = load(c, SR * size + m), load(c, SI * size + m)
                        normal_re = fma(psi, br, normal_re)
                        normal_im = fma(psi, bi, normal_im)
                        drag_re = fnma(si, bi, fma(sr, br, drag_re))
                        drag_im = fma(si, br, fma(sr, bi, drag_im))
            if go:
                keep, pull = load(c, KEEP * size + m), load(c, PULL * size + m)
                pr, pi = fnma(ei, di, er * dr), fma(er, di, ei * dr)
                zr, zi = fnma(ei, yi, er * yr), fma(er, yi, ei * yr)
                dr, di = fnma(pull, zr, keep * pr), fnma(pull, zi, keep * pi)
                yr, yi = zr + dr, zi + di
                store(t, then + m, dr)
                store(t, then + size + m, di)
                real, imag = fma(psi, yr, real), fma(psi, yi, imag)
            else:
                store(t, now + m, dr)
                store(t, now + size + m, di)
            store(t, m, yr)
            store(t, size + m, yi)
        store(sums, 2 * k + col, loss)
        if touched:
            work = fma(li, normal_im, load(sums, col))
            store(sums, col, fma(lr, normal_re, work))
            drag = fma(li, drag_im, load(sums, k + col))
            store(sums, k + col, fma(lr, drag_re, drag))
            if exact:
                carried = fma(li, pass_im, load(sums, 3 * k + col))
                store(sums, 3 * k + col, fma(lr, pass_re, carried))
        if go:
            store(out, col, real)
            store(out, k + col, imag)


@njit(error_model="numpy", cache=True)
def write_wall(wall, time, speed, slot, sign, spectrum):
    """Add a rigid casing's part to the spectrum (2 k,) of the gaps, at `time`."""
    angle = wall.lobes * ((speed * time) % (2.0 * math.pi))
    out = rigid_amplitude(wall, time)
    spectrum[slot] -= out * math.cos(angle)
    spectrum[len(spectrum) // 2 + slot] -= sign * out * math.sin(angle)


@njit(error_model="numpy", cache=True)
def push_pulse(s, c, size, push, lobe, sign, angle, then, out, k):
    """Add the loading's increments to the ring, its place turned by `angle`.

    lobe : (size,) modal load of the static frame; sign : -1 on conjugated slots
    """
    for m in range(size):
        if lobe[m] != 0.0:
            change = c[GIVE * size + m] * push * lobe[m]
            re, im = change * math.cos(angle), sign * change * math.sin(angle)
            s[m] += re
            s[size + m] += im
            s[then + m] += re
            s[then + size + m] += im
            out[m % k] += c[RADIAL * size + m] * re
            out[k + m % k] += c[RADIAL * size + m] * im


@njit(error_model="numpy", cache=True)
def pulse_work(s, c, lam, size, k, push, lobe, sign, angle, now, then, touched):
    """Return the loading's work in the step that waits to be ended, J."""
    total = 0.0
    for m in range(size):
        if lobe[m] != 0.0:
            er, ei = c[TURN_RE * size + m], c[TURN_IM * size + m]
            yr, yi, dr, di = s[m], s[size + m], s[now + m], s[now + size + m]
            if touched:
                lr, li = lam[m % k], lam[k + m % k]
                a, b = c[NORMAL * size + m], c[ALONG * size + m]
                cr, ci = a * lr + b * li, a * li - b * lr
                yr, yi, dr, di = yr + cr, yi + ci, dr + cr, di + ci
            gr, gi = s[then + m], s[then + size + m]
            old, new = c[MEAN_OLD * size + m], c[MEAN_NEW * size + m]
            at = c[MEAN_PLACE * size + m]
            re = old * (er * gr - ei * gi) + new * dr + at * yr
            im = old * (er * gi + ei * gr) + new * di + at * yi
            both = re * math.cos(angle) + sign * im * math.sin(angle)
            total += 0.5 * push * lobe[m] * both
    return total


@njit(error_model="numpy", cache=True)
def end_step(s_b, t_b, c_b, s_c, t_c, c_c, lam, counter, sums_b, sums_c, rows,
             ring_rows, width, exact):  # fmt: skip
    """Write both bodies to t_b, t_c with their last step ended and booked in sums."""
    k = width // 2
    size, ring_size, odd = rows * width, ring_rows * k, counter[STEP] & 1
    ended = not exact or counter[ENDED] != counter[STEP]
    touched = ended and counter[LAST] == counter[STEP]
    pass_rotor(
        s_b, t_b, c_b, lam, rows, width, (1 + odd) * size, (2 - odd) * size, ended,
        touched, False, exact, lam, sums_b,
    )  # fmt: skip
    pass_ring(
        s_c, t_c, c_c, lam, ring_rows, k, (2 + 2 * odd) * ring_size,
        (4 - 2 * odd) * ring_size, ended, touched, False, exact, lam, sums_c,
    )  # fmt: skip


@njit(error_model="numpy", cache=True, inline="always")
def to_gaps(spectrum, wave, gap, k, wide, gaps, row):
    """Transform; set gaps[row :][: 2 wide]: of blades j, then of N - j; return least.

    wave : (2 k, wide), flat: cos and sin at blades j = 0 .. N // 2, then padding
    """
    least = broadcast(gap)
    for j in range(0, wide, FOUR):
        even, odd = broadcast(gap), broadcast(0.0)
        for c in range(k):
            even = fma(broadcast(spectrum[c]), load(wave, c * wide + j), even)
            odd = fma(broadcast(spectrum[k + c]), load(wave, (k + c) * wide + j), odd)
        here, there = even - odd, even + odd
        store(gaps, row + j, here)
        store(gaps, row + wide + j, there)
        least = lower_of(least, lower_of(here, there))
    lowest = gap
    for i in range(FOUR):
        lowest = min(lowest, element(least, i))
    return lowest
