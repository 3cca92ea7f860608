"""The cyclic modal kernel: nodal diameter by nodal diameter, in the rotating frame.

Harmonic h of the ring lies in the slot kappa = h folded mod N (conjugated where N - h
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

from hpcwhirl.dynamics.kernels.bodies import FLUSH_EVERY, TINY
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
    IMPACT,
    LAST,
    NEXT_TRY,
    PULSE,
    ROTATION,
    RUNNING,
    STEP,
    STOP,
    book_contacts,
    carried_by_wall,
    pulse_of,
)
from hpcwhirl.dynamics.kernels.flight import LESS, fly
from hpcwhirl.dynamics.kernels.passes import (
    pass_ring,
    pass_rotor,
    pulse_work,
    push_pulse,
    to_gaps,
    write_wall,
)
from hpcwhirl.dynamics.kernels.samples import (
    aside_space,
    farthest,
    keep_between,
    put_aside,
    sample_cyclic,
    sample_space,
    size_of,
)
from hpcwhirl.dynamics.kernels.vectors import (
    FOUR,
    broadcast,
    fma,
    load,
    store,
)


@njit(error_model="numpy", cache=True, inline="always")
def to_spectrum(push, where, size, turns, width, lam):
    """Set lam (2 width,): sum of push e^{-2 pi i kappa j / N}, then (im, -re) of it."""
    half = width // 2
    for v in range(0, width, FOUR):
        store(lam, v, load(turns, where[0] * width + v) * broadcast(push[0]))
    for s in range(1, size):
        for v in range(0, width, FOUR):
            row = load(turns, where[s] * width + v)
            store(lam, v, fma(row, broadcast(push[s]), load(lam, v)))
    for v in range(0, half, FOUR):
        store(lam, width + v, load(lam, half + v))
        store(lam, width + half + v, broadcast(0.0) - load(lam, v))


@njit(error_model="numpy", cache=True)
def flush(s):
    """Zero amplitudes below 1e-150 before their products become denormal."""
    for m in range(len(s)):
        if abs(s[m]) < TINY:
            s[m] = 0.0


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
        steps, strides, limit, step, speed, mu, wall, loading, rotor, casing, contact,
        state, tracks,
    ):  # fmt: skip
        """March `steps` steps; see `bodies.march_bodies` and `named`."""
        force, pulse, lobe = loading
        c_b = rotor.items
        c_c, slot, sign = casing
        column, turns, wave, flight = contact
        s_b, s_c, lam, gaps, sums_b, sums_c, known, last, counter, ledger, impulse = (
            state
        )
        spectrum, out_b, out_c = np.zeros(width), np.zeros(width), np.zeros(width)
        before, sample = np.zeros(blades), sample_space(state, blades, width)
        space = circulant_space(blades, wide, column, known)
        push, known, inverse, opening, where, column, _ = space
        between = exact and strides.traces % strides.evidence != 0  # traces end no jump
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
                    strides.evidence, step, wall, loading, c_b, c_c, wave, flight,
                    state, (out_b, out_c, spectrum), rows, ring_rows, k, wide,
                )  # fmt: skip
                if jumped and between:
                    keep_between(
                        begun, strides.traces, step, mu, wall.gap, rotor, c_c, turns,
                        wave, flight, state, aside, sample, tracks, rows, ring_rows, k,
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
                    angle = wall.lobes * ((speed * time) % (2.0 * math.pi))
                if thrust != 0.0:
                    push_pulse(
                        s_c, c_c, ring_size, thrust, lobe, sign, angle, ring_then,
                        out_c, k,
                    )  # fmt: skip
                for c in range(0, width, FOUR):
                    store(spectrum, c, load(out_b, c) + load(out_c, c))
                far = size_of(out_b, width)
                if ring_size == 0 and wall.amplitude != 0.0:
                    write_wall(wall, time, speed, slot, sign, spectrum)
                row = counter[STEP] % 3 * 2 * wide
                lowest = to_gaps(spectrum, wave, wall.gap, k, wide, gaps, row)
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
                    elif ring_size == 0 and wall.amplitude != 0.0:
                        carried = carried_by_wall(
                            push, where, active, blades, wall, speed, time, step
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
            keep = counter[STEP] % strides.traces == 0
            judge = counter[STEP] % strides.evidence == 0
            if keep or judge:
                sample.wall[:] = 0.0
                if ring_size == 0 and wall.amplitude != 0.0:
                    write_wall(
                        wall, counter[STEP] * step, speed, slot, sign, sample.wall
                    )
                sample_cyclic(
                    step, mu, wall.gap, counter[STEP] % 3 * 2 * wide, rotor, c_c, turns,
                    wave, state, sample, keep, judge, tracks, rows, ring_rows, width,
                    exact,
                )  # fmt: skip

    return march_cyclic
