"""`passes` for four cases at once: a vector holds one amplitude of each.

The arithmetic of every case is that of `passes`, operation by operation; what is in a
row without a mode is left out, and both phases of a double mode are marched together.
Central differences only.

Arrays are flat, the lane last, and given by their addresses. The modes stand slot by
slot, row by row:

state : q, d in two places; of a double mode and of the ring re and im of each
shared : (6 modes,): `SHARED`, the same for all lanes
own : NORMAL and ALONG of each mode, lane by lane; of the ring TURN_RE, TURN_IM too
lam, out : by column (slot, then slot again for the imaginary parts) and lane
sums : normal work, drag work, damping loss, each by column and lane

A lane out of contact has lam = 0 and adds zeros.
"""

from __future__ import annotations

from numba import njit

from hpcwhirl.dynamics.kernels.passes import KEEP, PULL, RADIAL, RATE, SI, SR
from hpcwhirl.dynamics.kernels.vectors import (
    FOUR,
    broadcast,
    fma,
    fnma,
    get,
    load,
    spread_at,
    store,
)

SHARED = (RATE, RADIAL, SR, SI, PULL, KEEP)
ITEMS = len(SHARED)
SIMPLE, DOUBLE, RING = 3 * FOUR, 6 * FOUR, 6 * FOUR  # state of a mode
OWN_ROTOR, OWN_RING = 2 * FOUR, 4 * FOUR


@njit(error_model="numpy", cache=True, inline="always")
def rotor_lanes(s, c, own, slots, count, lam, odd, out, sums, k, touched):
    """End a step of the rotor and predict the next, as `pass_rotor`.

    slots : (count, 2): modes of each, and whether they are double
    odd : which place holds d, 0 or 1; the next goes to the other
    k : slots; touched : literal, whether a lane was in contact in the step that ends
    """
    i, j, o, width = 0, 0, 0, 2 * k
    for slot in range(count):
        here, there = slot * FOUR, (k + slot) * FOUR
        if get(slots, 2 * slot + 1) == 0:
            now, then = (1 + odd) * FOUR, (2 - odd) * FOUR
            straight, quarter = load(lam, here), load(lam, there)
            loss, spectrum = load(sums, 2 * width * FOUR + here), broadcast(0.0)
            normal, drag_re, drag_im = broadcast(0.0), broadcast(0.0), broadcast(0.0)
            for _ in range(get(slots, 2 * slot)):
                q, d = load(s, i), load(s, i + now)
                if touched:
                    change = load(own, o + FOUR) * quarter
                    change = fma(load(own, o), straight, change)
                    q, d = q + change, d + change
                    store(s, i + now, d)
                both = d + load(s, i + then)
                loss = fma(spread_at(c, j) * both, both, loss)
                radial = spread_at(c, j + 1)
                if touched:
                    normal = fma(radial, both, normal)
                    drag_re = fma(spread_at(c, j + 2), both, drag_re)
                    drag_im = fma(spread_at(c, j + 3), both, drag_im)
                d = fnma(spread_at(c, j + 4), q, spread_at(c, j + 5) * d)
                q = q + d
                store(s, i + then, d)
                store(s, i, q)
                spectrum = fma(radial, q, spectrum)
                i, j, o = i + SIMPLE, j + ITEMS, o + OWN_ROTOR
            store(sums, 2 * width * FOUR + here, loss)
            store(out, here, spectrum)
            if touched:
                store(sums, here, fma(straight, normal, load(sums, here)))
                drag = fma(quarter, drag_im, load(sums, width * FOUR + here))
                store(sums, width * FOUR + here, fma(straight, drag_re, drag))
            continue
        now, then = (2 + 2 * odd) * FOUR, (4 - 2 * odd) * FOUR
        lr, li = load(lam, here), load(lam, there)
        turned = broadcast(0.0) - lr
        loss_r = load(sums, 2 * width * FOUR + here)
        loss_i = load(sums, 2 * width * FOUR + there)
        real, imag = broadcast(0.0), broadcast(0.0)
        normal_r, along_rr, along_ri = broadcast(0.0), broadcast(0.0), broadcast(0.0)
        normal_i, along_ir, along_ii = broadcast(0.0), broadcast(0.0), broadcast(0.0)
        for _ in range(get(slots, 2 * slot)):
            qr, qi = load(s, i), load(s, i + FOUR)
            dr, di = load(s, i + now), load(s, i + now + FOUR)
            if touched:
                a, b = load(own, o), load(own, o + FOUR)
                cr, ci = fma(a, lr, b * li), fma(a, li, b * turned)
                qr, qi, dr, di = qr + cr, qi + ci, dr + cr, di + ci
                store(s, i + now, dr)
                store(s, i + now + FOUR, di)
            br, bi = dr + load(s, i + then), di + load(s, i + then + FOUR)
            rate, radial = spread_at(c, j), spread_at(c, j + 1)
            loss_r, loss_i = fma(rate * br, br, loss_r), fma(rate * bi, bi, loss_i)
            if touched:
                sr, si = spread_at(c, j + 2), spread_at(c, j + 3)
                normal_r = fma(radial, br, normal_r)
                normal_i = fma(radial, bi, normal_i)
                along_rr, along_ri = fma(sr, br, along_rr), fma(si, br, along_ri)
                along_ir, along_ii = fma(sr, bi, along_ir), fma(si, bi, along_ii)
            pull, keep = spread_at(c, j + 4), spread_at(c, j + 5)
            dr, di = fnma(pull, qr, keep * dr), fnma(pull, qi, keep * di)
            qr, qi = qr + dr, qi + di
            store(s, i + then, dr)
            store(s, i + then + FOUR, di)
            store(s, i, qr)
            store(s, i + FOUR, qi)
            real, imag = fma(radial, qr, real), fma(radial, qi, imag)
            i, j, o = i + DOUBLE, j + ITEMS, o + OWN_ROTOR
        store(sums, 2 * width * FOUR + here, loss_r)
        store(sums, 2 * width * FOUR + there, loss_i)
        store(out, here, real)
        store(out, there, imag)
        if touched:
            store(sums, here, fma(lr, normal_r, load(sums, here)))
            store(sums, there, fma(li, normal_i, load(sums, there)))
            drag = fma(li, along_ri, load(sums, width * FOUR + here))
            store(sums, width * FOUR + here, fma(lr, along_rr, drag))
            drag = fma(turned, along_ii, load(sums, width * FOUR + there))
            store(sums, width * FOUR + there, fma(li, along_ir, drag))


@njit(error_model="numpy", cache=True, inline="always")
def ring_lanes(s, c, own, slots, count, lam, odd, out, sums, k, touched):
    """End a step of the ring and predict the next, as `pass_ring`."""
    i, j, o = 0, 0, 0
    now, then = (2 + 2 * odd) * FOUR, (4 - 2 * odd) * FOUR
    for slot in range(count):
        here, there = slot * FOUR, (k + slot) * FOUR
        lr, li = load(lam, here), load(lam, there)
        loss = load(sums, 2 * k * FOUR + here)
        real, imag = broadcast(0.0), broadcast(0.0)
        normal_re, normal_im = broadcast(0.0), broadcast(0.0)
        drag_re, drag_im = broadcast(0.0), broadcast(0.0)
        for _ in range(get(slots, 2 * slot)):
            er, ei = load(own, o + 2 * FOUR), load(own, o + 3 * FOUR)
            yr, yi = load(s, i), load(s, i + FOUR)
            dr, di = load(s, i + now), load(s, i + now + FOUR)
            if touched:
                a, b = load(own, o), load(own, o + FOUR)
                cr, ci = fma(a, lr, b * li), fnma(b, lr, a * li)
                yr, yi, dr, di = yr + cr, yi + ci, dr + cr, di + ci
                store(s, i + now, dr)
                store(s, i + now + FOUR, di)
            gr, gi = load(s, i + then), load(s, i + then + FOUR)
            br, bi = fnma(ei, gi, er * gr) + dr, fma(er, gi, ei * gr) + di
            loss = fma(spread_at(c, j), fma(br, br, bi * bi), loss)
            psi = spread_at(c, j + 1)
            if touched:
                sr, si = spread_at(c, j + 2), spread_at(c, j + 3)
                normal_re = fma(psi, br, normal_re)
                normal_im = fma(psi, bi, normal_im)
                drag_re = fnma(si, bi, fma(sr, br, drag_re))
                drag_im = fma(si, br, fma(sr, bi, drag_im))
            pull, keep = spread_at(c, j + 4), spread_at(c, j + 5)
            pr, pi = fnma(ei, di, er * dr), fma(er, di, ei * dr)
            zr, zi = fnma(ei, yi, er * yr), fma(er, yi, ei * yr)
            dr, di = fnma(pull, zr, keep * pr), fnma(pull, zi, keep * pi)
            yr, yi = zr + dr, zi + di
            store(s, i + then, dr)
            store(s, i + then + FOUR, di)
            store(s, i, yr)
            store(s, i + FOUR, yi)
            real, imag = fma(psi, yr, real), fma(psi, yi, imag)
            i, j, o = i + RING, j + ITEMS, o + OWN_RING
        store(sums, 2 * k * FOUR + here, loss)
        store(out, here, real)
        store(out, there, imag)
        if touched:
            work = fma(li, normal_im, load(sums, here))
            store(sums, here, fma(lr, normal_re, work))
            drag = fma(li, drag_im, load(sums, k * FOUR + here))
            store(sums, k * FOUR + here, fma(lr, drag_re, drag))
