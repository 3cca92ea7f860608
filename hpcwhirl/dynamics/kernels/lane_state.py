"""One lane of a body's state: its loading, its copies, its flush."""

from __future__ import annotations

import math

from numba import njit

from hpcwhirl.dynamics.kernels.bodies import TINY
from hpcwhirl.dynamics.kernels.passes import (
    ALONG,
    GIVE,
    MEAN_NEW,
    MEAN_OLD,
    MEAN_PLACE,
    NORMAL,
    RADIAL,
    TURN_IM,
    TURN_RE,
)
from hpcwhirl.dynamics.kernels.vectors import FOUR


@njit(error_model="numpy", cache=True)
def push_lane(s, places, lane, c, size, push, lobe, sign, angle, then, out, k):
    """Add the loading's increments to the ring of one lane, as `push_pulse`."""
    for m in range(size):
        if lobe[m] != 0.0:
            change = c[GIVE * size + m] * push * lobe[m]
            re, im = change * math.cos(angle), sign * change * math.sin(angle)
            s[places[m] + lane] += re
            s[places[size + m] + lane] += im
            s[places[then + m] + lane] += re
            s[places[then + size + m] + lane] += im
            out[m % k * FOUR + lane] += c[RADIAL * size + m] * re
            out[(k + m % k) * FOUR + lane] += c[RADIAL * size + m] * im


@njit(error_model="numpy", cache=True)
def work_lane(s, places, lane, c, lam, size, k, push, lobe, sign, angle, now, then):
    """Return the loading's work in the step of a lane, J, as `pulse_work`.

    lam : (lanes 2 k,), zero where the lane is out of contact
    """
    total = 0.0
    for m in range(size):
        if lobe[m] != 0.0:
            er, ei = c[TURN_RE * size + m], c[TURN_IM * size + m]
            yr, yi = s[places[m] + lane], s[places[size + m] + lane]
            dr, di = s[places[now + m] + lane], s[places[now + size + m] + lane]
            zr, zi = yr - dr, yi - di
            lr, li = lam[lane * 2 * k + m % k], lam[lane * 2 * k + k + m % k]
            a, b = c[NORMAL * size + m], c[ALONG * size + m]
            dr, di = dr + (a * lr + b * li), di + (a * li - b * lr)
            gr, gi = s[places[then + m] + lane], s[places[then + size + m] + lane]
            old, new = c[MEAN_OLD * size + m], c[MEAN_NEW * size + m]
            at = c[MEAN_PLACE * size + m]
            re = old * (er * gr - ei * gi) + new * dr + at * zr
            im = old * (er * gi + ei * gr) + new * di + at * zi
            both = re * math.cos(angle) + sign * im * math.sin(angle)
            total += 0.5 * push * lobe[m] * both
    return total


@njit(error_model="numpy", cache=True)
def flush_lane(s, lane):
    """Zero a lane's amplitudes below 1e-150."""
    for m in range(lane, len(s), FOUR):
        if abs(s[m]) < TINY:
            s[m] = 0.0


@njit(error_model="numpy", cache=True)
def take_lane(s, places, lane, out):
    """Set `out` to one lane of `s`; places : of each item, -1 where there is none."""
    for m in range(len(out)):
        out[m] = s[places[m] + lane] if places[m] >= 0 else 0.0


@njit(error_model="numpy", cache=True)
def put_lane(s, places, lane, values):
    """Set one lane of `s` to `values`, the inverse of `take_lane`."""
    for m in range(len(values)):
        if places[m] >= 0:
            s[places[m] + lane] = values[m]
