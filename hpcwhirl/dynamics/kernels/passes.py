"""Arithmetic of one pass over a body's amplitudes: complete a step, predict the next.

Amplitudes are complex, one for the two phases of a double mode, and sorted in rows: row
f holds the f-th mode of every slot (nodal diameter). A step of any mode is

d' = keep d - pull q + give f,   q' = q + d',

d = q_n - q_{n-1} and d' the increments in the last and in this step, f the modal force,
with the coefficients of central differences or of the exact flow (`timestep`). The
modes of the ring are integrated in the rotating frame, y = C e^{i h Omega t}, in which
d and q are first multiplied by E = e^{i h Omega dt}.

The contact forces of a step follow from the gaps, which need the predictions of all
modes. They are stored as the spectrum of the multipliers and the step is *pending*
until the next pass *completes* it: the pass applies the forces, adds the step's works
and damping losses to the sums of the ledger, and predicts the next step. So every
amplitude is read and written once per step. A step needs two increments d; the state
has one array for even and one for odd steps.

This module has the functions for four modes that central differences and the exact flow
share; `stepping` has the passes, `differences` and `flow` the works, which differ. The
coefficients of a mode are called its items. They are *packed*: those of four
neighbouring modes m .. m + 3 are contiguous, item i at (m ITEMS + 4 i), so that one
pointer reads them all.
"""

from __future__ import annotations

import math

import numpy as np

from hpcwhirl.arrays import Floats, Integers
from hpcwhirl.dynamics.kernels.compiled import inlined, part, rare
from hpcwhirl.dynamics.kernels.contact import LAST, STEP
from hpcwhirl.dynamics.kernels.transform import SPAN, to_gaps_split
from hpcwhirl.dynamics.kernels.vectors import (
    FOUR,
    aligned,
    broadcast,
    element,
    fma,
    fnma,
    get,
    higher_of,
    load,
    lower_of,
    store,
    total_of,
)

ROTOR_STATE, RING_STATE = 3, 6
# items of a mode: keep, pull; damping loss over (d + d')^2; gamma; re and -im of give
# (gamma + mu conj(sigma)); sigma; E of the ring, see this module; gamma and sigma are
# radial and tangential displacements, of tips with negative sign, see `cyclic`
KEEP, PULL, RATE, RADIAL, NORMAL, ALONG, SR, SI, TURN_RE, TURN_IM = range(10)
MEAN_OLD, MEAN_NEW, MEAN_PLACE = 10, 11, 12  # of d, d', q' in `both` of `work_rotor`
LOSS_DD, LOSS_DQ, LOSS_QQ = 13, 14, 15  # of d'^2, d' q', q'^2 in a step's damping loss
SPEED_D, SPEED_Q = 16, 17  # factors of d, q in the velocity
DAMPING, SPIN = 18, 19  # xi; h Omega of the ring's turn, signed
OMEGA, GIVE = 20, 21
ITEMS = 22


def packed(items: Floats) -> Floats:
    """Return the coefficients of modes as the flat array that kernels read.

    Each coefficient of four neighbouring modes is contiguous in it.

    items : (ITEMS, modes), a row for each coefficient, such as `KEEP`
    """
    apart = items.reshape(ITEMS, -1, FOUR).transpose(1, 0, 2)
    return aligned(np.ascontiguousarray(apart).ravel())


def unpacked(items: Floats) -> Floats:
    """Return the coefficients of modes, (ITEMS, modes), a copy, from their flat array.

    items : flat, as `packed` returns it
    """
    return items.reshape(-1, ITEMS, FOUR).transpose(1, 0, 2).reshape(ITEMS, -1)


def filled_rows(items: Floats, k: int) -> Integers:
    """Return how many rows of modes each group of four nodal diameters has, (k/4,).

    It is the largest number of modes of one of the four; k is the number of nodal
    diameters, padded. A pass leaves out the further, empty rows.

    items : packed coefficients; the modes of a nodal diameter are in its first rows
    """
    moves = items.reshape(-1, ITEMS, FOUR)[:, KEEP] != 0.0
    there = moves.any(axis=1).reshape(-1, k // FOUR)
    rows = np.arange(1, len(there) + 1)[:, None]
    return np.asarray((rows * there).max(axis=0, initial=0))


@inlined
def holds(c, m):
    """Return whether any of the four places m .. m + 3 has a mode, and is not padding.

    c : packed coefficients of all modes; without a mode they are 0
    """
    at = m * ITEMS + KEEP * FOUR
    return c[at] != 0.0 or c[at + 1] != 0.0 or c[at + 2] != 0.0 or c[at + 3] != 0.0


@inlined
def item(c, which, m):
    """Return coefficient number `which`, such as `OMEGA`, of mode m.

    c : coefficients of all modes, packed as this module explains
    """
    return c[(m - m % FOUR) * ITEMS + which * FOUR + m % FOUR]


@inlined
def places(counter, size):
    """Return where the increments of this step and of the step before begin in a state.

    The state (3 size,) of a body has the amplitudes, then the increments of the last
    even step, then those of the last odd step; the two results are indices in it.

    counter : counters of the march, among them the number of the step
    """
    odd = counter[STEP] & 1
    return (1 + odd) * size, (2 - odd) * size


@inlined
def push_rotor(c, at, push, q, d):
    """Apply a step's contact forces to four rotor modes; return q and d after it.

    Both change by the same.

    c, at : coefficients of all modes, packed, and the index in c at which those of the
        four begin
    q, d : amplitudes, and their increments in the step
    push : two vectors, N, entries of the multipliers' spectrum at the slots (nodal
        diameters) of these modes, as (re, im), and as (im, -re)
    """
    change = load(c, at + ALONG * FOUR) * push[1]
    change = fma(load(c, at + NORMAL * FOUR), push[0], change)
    return q + change, d + change


@inlined
def push_ring(c, at, push, y, d):
    """Apply a step's contact forces to four ring modes; return y and d after it.

    Both change by the same.

    c, at : coefficients of all modes, packed, and the index in c at which those of the
        four begin
    y, d : amplitudes, and their increments in the step, as (re, im)
    push : two vectors, N, re and im of the multipliers' spectrum at the slots (nodal
        diameters) of the modes
    """
    a, b = load(c, at + NORMAL * FOUR), load(c, at + ALONG * FOUR)
    re, im = fma(a, push[0], b * push[1]), fnma(b, push[0], a * push[1])
    return (y[0] + re, y[1] + im), (d[0] + re, d[1] + im)


@inlined
def turn(er, ei, re, im):
    """Return four complex products (er + i ei) (re + i im) as (re, im).

    So the amplitudes of ring modes are turned by a step of the rotor, E = er + i ei.
    """
    return fnma(ei, im, er * re), fma(er, im, ei * re)


@inlined
def ahead_rotor(c, at, q, d):
    """Predict four rotor modes a step ahead, without contact: return (q', d').

    They are the amplitudes and the increments d' = q' - q.

    c, at : coefficients of all modes, packed, and the index in c at which those of the
        four begin
    q, d : amplitudes, and their increments in the step before
    """
    d = fnma(load(c, at + PULL * FOUR), q, load(c, at + KEEP * FOUR) * d)
    return q + d, d


@inlined
def ahead_ring(c, at, y, d):
    """Predict four ring modes a step ahead, without contact: return (y', d').

    They are the amplitudes and the increments, each a pair (re, im), in the rotating
    frame of the end of the step.

    c, at : coefficients of all modes, packed, and the index in c at which those of the
        four begin
    y, d : (re, im) of the amplitudes, and of their increments in the step before
    """
    er, ei = load(c, at + TURN_RE * FOUR), load(c, at + TURN_IM * FOUR)
    keep, pull = load(c, at + KEEP * FOUR), load(c, at + PULL * FOUR)
    pr, pi = turn(er, ei, d[0], d[1])
    zr, zi = turn(er, ei, y[0], y[1])
    dr, di = fnma(pull, zr, keep * pr), fnma(pull, zi, keep * pi)
    return (zr + dr, zi + di), (dr, di)


@inlined
def work_rotor(c, at, both, works):
    """Add four rotor modes to the sums `works` for the work of contact; return them.

    c, at : coefficients of all rotor modes, packed, and the index in c at which those
        of the four begin
    both : dt (v- + v+) of these modes, v- and v+ their velocities before and after the
        contact impulse of a step
    works : three vectors, m, factors by which the multipliers' spectrum is multiplied
        in twice the work of a step: of normal forces; of friction over mu, re and im
    """
    normal, re, im = works
    normal = fma(load(c, at + RADIAL * FOUR), both, normal)
    re = fma(load(c, at + SR * FOUR), both, re)
    return normal, re, fma(load(c, at + SI * FOUR), both, im)


@inlined
def work_ring(c, at, br, bi, works):
    """Add four ring modes to the sums `works` for the work of contact; return them.

    c, at : coefficients of all ring modes, packed, and the index in c at which those of
        the four begin
    br, bi : re and im of dt (v- + v+) of these modes, v- and v+ their velocities before
        and after the contact impulse of a step
    works : four vectors, m, factors by which the multipliers' spectrum is multiplied in
        twice the work of a step: re and im for normal forces, re and im for friction
        over mu
    """
    normal_re, normal_im, drag_re, drag_im = works
    psi = load(c, at + RADIAL * FOUR)
    sr, si = load(c, at + SR * FOUR), load(c, at + SI * FOUR)
    normal_re, normal_im = fma(psi, br, normal_re), fma(psi, bi, normal_im)
    drag_re = fnma(si, bi, fma(sr, br, drag_re))
    return normal_re, normal_im, drag_re, fma(si, br, fma(sr, bi, drag_im))


@inlined
def book_rotor(sums, width, col, push, works):
    """Add twice a step's works of contact, J, to the rotor's sums, at four places.

    The works are those of normal forces and of friction over mu at the places col ..
    col + 3 of a spectrum (re, then im, of all nodal diameters).

    sums, width : (3 width,), works and losses by place, see `stepping.pass_modes`
    push, works : spectrum of the multipliers, N, as in `push_rotor`; sums of
        `work_rotor` over the modes
    """
    normal, re, im = works
    store(sums, col, fma(push[0], normal, load(sums, col)))
    drag = fma(push[1], im, load(sums, width + col))
    store(sums, width + col, fma(push[0], re, drag))


@inlined
def keep_slip(slip, size, col, works):
    """Store the factors of the multipliers in friction's work, at four nodal diameters.

    From these lengths, m, `slip_of` computes the slip of the tips.

    slip, size : (2 size,), m, out: re, then im
    col : the first of the four
    works : sums of `work_rotor` or `work_ring` over the modes, of which the last two,
        those for friction, are stored
    """
    store(slip, col, works[-2])
    store(slip, size + col, works[-1])


@part
def slip_of(slip_b, slip_c, k, spectrum):
    """Compute dt (v- + v+) of the casing less that of the tips, m: a spectrum (2 k,).

    v- and v+ are velocities along the rotation before and after the step's contact
    impulse. There are k slots, one for each nodal diameter, padded.

    slip_b, slip_c : (4 k,), (2 k,), m, arrays `slip` of rotor and ring, see
        `keep_slip`: that of the rotor has factors of the spectrum of the multipliers as
        (re, im), then as (im, -re)
    spectrum : (2 k,), out: re, then im
    """
    for c in range(0, k, FOUR):
        real = load(slip_b, c) - load(slip_b, 3 * k + c)
        imag = load(slip_b, k + c) + load(slip_b, 2 * k + c)
        store(spectrum, c, real + load(slip_c, c))
        store(spectrum, k + c, imag + load(slip_c, k + c))


@inlined
def book_ring(sums, k, col, push, works):
    """Add twice a step's works of contact, J, to the ring's sums, at four diameters.

    The works are those of normal forces and of friction over mu.

    sums, k : (4 k,), works and losses by nodal diameter; number of these, padded
    col : first of the four nodal diameters
    push, works : (re, im) of the multipliers' spectrum, N; sums of `work_ring` over the
        modes
    """
    normal_re, normal_im, drag_re, drag_im = works
    work = fma(push[1], normal_im, load(sums, col))
    store(sums, col, fma(push[0], normal_re, work))
    drag = fma(push[1], drag_im, load(sums, k + col))
    store(sums, k + col, fma(push[0], drag_re, drag))


@inlined
def load_both(a, size, m):
    """Return four complex values (re, im): re from a[m], im from a[size + m] on."""
    return load(a, m), load(a, size + m)


@inlined
def store_both(a, size, m, value):
    """Store four complex values: re from a[m], im from a[size + m] on.

    a, size, m : array, number of its real parts, index; value : (re, im)
    """
    store(a, m, value[0])
    store(a, size + m, value[1])


@part
def copy_to(out, values):
    """Copy the first len(out) entries of the array `values` to `out`."""
    for i in range(len(out)):
        out[i] = values[i]


@rare
def sum_of(values, first, last):
    """Return the sum of values[first:last], always added in this order."""
    total = 0.0
    for i in range(first, last):
        total += values[i]
    return total


@inlined
def sums_of(sums_b, sums_c):
    """Return three sums over rotor and ring so far, J: normal work, drag work, damping.

    They are the works of normal forces and of friction over mu, and the damping loss.

    sums_b, sums_c : (3 m,), (4 n,), works and losses by nodal diameter, of rotor and
        ring, see `stepping.pass_modes` and `stepping.pass_ring`
    """
    m, n = len(sums_b) // 3, len(sums_c) // 4
    normal = 0.5 * (sum_of(sums_b, m - m, m) + sum_of(sums_c, n - n, n))
    drag = 0.5 * (sum_of(sums_b, m, 2 * m) + sum_of(sums_c, n, 2 * n))
    loss = sum_of(sums_b, 2 * m, 3 * m) + sum_of(sums_c, 2 * n, 3 * n)
    return normal, drag, loss


@rare
def push_pulse(s, c, size, push, lobe, sign, angle, counter, out, k):
    """Add the effect of the pulse on the casing to the ring's predicted step.

    That is, its change of the amplitudes and increments is added to the state s, and
    its change of the gaps to the spectrum `out`.

    s, c : (6 size,), state of the ring; coefficients of its modes, packed
    push, lobe : N, force of the pulse; (size,), modal forces of a unit force, static
        frame
    sign : -1 if the harmonic of the pulse is the conjugate of its slot's, else 1
    angle : rad, number of lobes times the rotor's angle
    counter : counters of the march, at the step that has been predicted
    out, k : (2 k,), m, spectrum of the ring's part of the gaps; number of slots (nodal
        diameters, padded)
    """
    then, _ = places(counter, 2 * size)
    for m in range(size):
        if lobe[m] != 0.0:
            change = item(c, GIVE, m) * push * lobe[m]
            re, im = change * math.cos(angle), sign * change * math.sin(angle)
            s[m] += re
            s[size + m] += im
            s[then + m] += re
            s[then + size + m] += im
            out[m % k] += item(c, RADIAL, m) * re
            out[k + m % k] += item(c, RADIAL, m) * im


@rare
def pulse_work(s, c, lam, size, k, push, lobe, sign, angle, counter):
    """Return the work of the pulse on the ring in the last step, J.

    lam : N, re, then im, of the spectrum of the step's multipliers, in the first 2 k

    Arguments not listed are those of `push_pulse`.
    """
    total, touched = 0.0, counter[LAST] == counter[STEP]
    now, then = places(counter, 2 * size)
    for m in range(size):
        if lobe[m] != 0.0:
            er, ei = item(c, TURN_RE, m), item(c, TURN_IM, m)
            yr, yi, dr, di = s[m], s[size + m], s[now + m], s[now + size + m]
            if touched:
                lr, li = lam[m % k], lam[k + m % k]
                a, b = item(c, NORMAL, m), item(c, ALONG, m)
                cr, ci = a * lr + b * li, a * li - b * lr
                yr, yi, dr, di = yr + cr, yi + ci, dr + cr, di + ci
            gr, gi = s[then + m], s[then + size + m]
            old, new = item(c, MEAN_OLD, m), item(c, MEAN_NEW, m)
            at = item(c, MEAN_PLACE, m)
            re = old * (er * gr - ei * gi) + new * dr + at * yr
            im = old * (er * gi + ei * gr) + new * di + at * yi
            both = re * math.cos(angle) + sign * im * math.sin(angle)
            total += 0.5 * push * lobe[m] * both
    return total


@inlined
def one_norm(spectrum, width):
    """Return the sum of |re| + |im| of a spectrum: a bound of its value at every blade.

    spectrum : its real and imaginary parts, the first `width` entries, m
    """
    total = broadcast(0.0)
    for c in range(0, width, FOUR):
        part = load(spectrum, c)
        total = total + higher_of(part, broadcast(0.0) - part)
    return total_of(total)


@inlined
def at_four(spectrum, wave, gap, k, wide, j):
    """Return the parts of gaps, m, that are sums of cosines and of sines: (even, odd).

    They are those of blades j .. j + 3: the gaps are even - odd, and even + odd at the
    blades N - j. Arguments are those of `to_gaps`.
    """
    even, odd = broadcast(gap), broadcast(0.0)
    for c in range(k):
        even = fma(broadcast(spectrum[c]), load(wave, c * wide + j), even)
        odd = fma(broadcast(spectrum[k + c]), load(wave, (k + c) * wide + j), odd)
    return even, odd


@inlined
def at_twelve(spectrum, wave, gap, k, wide, j):
    """Return (even, odd), the result of `at_four`, for blades j, j + 4 and j + 8 on.

    The three pairs are computed together to hide the latency of the processor's units.
    Arguments are those of `at_four`.
    """
    first = second = third = broadcast(gap)
    one = two = three = broadcast(0.0)
    for c in range(k):
        at, on = c * wide + j, (k + c) * wide + j
        re, im = broadcast(get(spectrum, c)), broadcast(get(spectrum, k + c))
        first = fma(re, load(wave, at), first)
        second = fma(re, load(wave, at + FOUR), second)
        third = fma(re, load(wave, at + 2 * FOUR), third)
        one = fma(im, load(wave, on), one)
        two = fma(im, load(wave, on + FOUR), two)
        three = fma(im, load(wave, on + 2 * FOUR), three)
    return (first, one), (second, two), (third, three)


@inlined
def unfold_four(parts, gaps, row, wide, j, least):
    """Store the gaps of blades j .. j + 3 and N - j .. N - j - 3 in an array of gaps.

    Return the elementwise minimum of these gaps and the four numbers `least`, m.

    parts : (even, odd), m, result of `at_four`
    gaps, row, wide : array in which the gaps of blades j begin at index `row`, those of
        blades N - j at row + wide
    """
    even, odd = parts
    here, there = even - odd, even + odd
    store(gaps, row + j, here)
    store(gaps, row + wide + j, there)
    return lower_of(least, lower_of(here, there))


@inlined
def lowest_of(least, gap):
    """Return the lowest gap, m, of the vector `least` and the number `gap`."""
    lowest = gap
    for i in range(FOUR):
        lowest = min(lowest, element(least, i))
    return lowest


@inlined
def to_gaps(spectrum, wave, gap, k, wide, gaps, row):
    """Compute the gaps of all blades from their spectrum; return the lowest gap, m.

    spectrum : (2 k,), m, re, then im, of the k nodal diameters, padded
    wave : (2 k, wide), flat: cos and sin of every nodal diameter at blades j = 0 .. N
        // 2, then padding; followed by N and its split in two factors, see `transform`
    gap : m, clearance, which is added to all gaps
    gaps, row : m, out: from index `row` on, `wide` gaps of blades j, then `wide` of
        blades N - j
    """
    if get(wave, 2 * k * wide + SPAN) > 0.0:
        return lowest_of(to_gaps_split(spectrum, wave, gap, k, wide, gaps, row), gap)
    least = broadcast(gap)
    for j in range(0, wide - 2 * FOUR, 3 * FOUR):
        one, two, three = at_twelve(spectrum, wave, gap, k, wide, j)
        least = unfold_four(one, gaps, row, wide, j, least)
        least = unfold_four(two, gaps, row, wide, j + FOUR, least)
        least = unfold_four(three, gaps, row, wide, j + 2 * FOUR, least)
    for j in range(wide - wide % (3 * FOUR), wide, FOUR):
        parts = at_four(spectrum, wave, gap, k, wide, j)
        least = unfold_four(parts, gaps, row, wide, j, least)
    return lowest_of(least, gap)


@rare
def to_gaps_seldom(spectrum, wave, gap, k, wide, gaps, row):
    """Compute the gaps of all blades from their spectrum; return the lowest gap, m.

    It is `to_gaps`, with its arguments, compiled once for callers that run in few
    steps.
    """
    return to_gaps(spectrum, wave, gap, k, wide, gaps, row)
