"""Four cases of one engine at once: the cyclic kernel with cases for columns.

The passes and the way to the gaps run on all lanes at once, the contact problem lane
by lane; every case has the bits that `cyclic` gives it. All lanes share the number of
the step modulo 6 (which place holds d, which row the gaps of this step), not its own
count, with which a case may begin at any time.
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
    COMPLEMENTARITY,
    FRICTION,
    IMPACT,
    IMPULSE,
    LAST,
    PULSE,
    ROTATION,
    RUNNING,
    STEP,
    STOP,
    TOUCHDOWNS,
    TOUCHED,
    contact_space,
    pulse_of,
    write_sample,
)
from hpcwhirl.dynamics.kernels.cyclic import (
    column_sums,
    cyclic_kernel,
    read_tips,
    total_energy,
    widths,
)
from hpcwhirl.dynamics.kernels.general import FLUSH_EVERY, TINY
from hpcwhirl.dynamics.kernels.lane_passes import ring_lanes, rotor_lanes
from hpcwhirl.dynamics.kernels.passes import (
    ALONG,
    GIVE,
    MEAN_NEW,
    MEAN_OLD,
    MEAN_PLACE,
    NORMAL,
    RADIAL,
    RING_STATE,
    ROTOR_STATE,
    TURN_IM,
    TURN_RE,
)
from hpcwhirl.dynamics.kernels.vectors import (
    FOUR,
    element,
    fma,
    fnma,
    load,
    lower_of,
    spread,
    store,
    transpose,
)

CYCLE = 6  # steps after which places of d and rows of gaps come round
SPEED, LOBES, FORCE, DURATION, SIGN, MU, LIMIT = range(7)  # scalars of a lane
SCALARS = 7
STRIDE, ACTIVE = 0, 1  # whole numbers of a lane
WHOLES = 2


@njit(error_model="numpy", cache=True, inline="always")
def to_gaps_lanes(out_b, out_c, wave, gap, k, wide, gaps, length, row):
    """Transform all lanes; set row `row` of each lane's gaps; return the least four.

    out_b, out_c : (2 k lanes,), spectra of both bodies; gaps : (lanes length,)
    """
    for c in range(0, 2 * k * FOUR, FOUR):
        store(out_b, c, load(out_b, c) + load(out_c, c))
    least = spread(gap)
    for j in range(0, wide, FOUR):
        e0, e1, e2, e3 = spread(gap), spread(gap), spread(gap), spread(gap)
        o0, o1, o2, o3 = spread(0.0), spread(0.0), spread(0.0), spread(0.0)
        for c in range(k):
            re, im = load(out_b, c * FOUR), load(out_b, (k + c) * FOUR)
            p, q = c * wide + j, (k + c) * wide + j
            e0, o0 = fma(re, spread(wave[p]), e0), fma(im, spread(wave[q]), o0)
            e1, o1 = fma(re, spread(wave[p + 1]), e1), fma(im, spread(wave[q + 1]), o1)
            e2, o2 = fma(re, spread(wave[p + 2]), e2), fma(im, spread(wave[q + 2]), o2)
            e3, o3 = fma(re, spread(wave[p + 3]), e3), fma(im, spread(wave[q + 3]), o3)
        h0, h1, h2, h3 = e0 - o0, e1 - o1, e2 - o2, e3 - o3
        t0, t1, t2, t3 = e0 + o0, e1 + o1, e2 + o2, e3 + o3
        least = lower_of(least, lower_of(lower_of(h0, t0), lower_of(h1, t1)))
        least = lower_of(least, lower_of(lower_of(h2, t2), lower_of(h3, t3)))
        h0, h1, h2, h3 = transpose(h0, h1, h2, h3)
        t0, t1, t2, t3 = transpose(t0, t1, t2, t3)
        store(gaps, row + j, h0)
        store(gaps, row + wide + j, t0)
        store(gaps, length + row + j, h1)
        store(gaps, length + row + wide + j, t1)
        store(gaps, 2 * length + row + j, h2)
        store(gaps, 2 * length + row + wide + j, t2)
        store(gaps, 3 * length + row + j, h3)
        store(gaps, 3 * length + row + wide + j, t3)
    return least


@njit(error_model="numpy", cache=True, inline="always")
def hold(gaps, row, lowest, blades, wide, padded, lane, known, push, inverse, rows,
         opened):  # fmt: skip
    """Open the gaps with the blades of the last solution, as `guess` tries first.

    Returns their number, with their multipliers in the lane's part of `push`; or -1,
    and leaves the row alone, where they are not the solution.
    """
    at, p = lane * (blades + 2), lane * padded
    size, n = known[at + blades], 2 * wide
    if size == 0 or known[at + blades + 1] != 1:
        return -1
    for v in range(0, size, FOUR):
        total = spread(0.0)
        for s in range(size):
            gap = gaps[row + place_of(known[at + s], blades, wide)]
            column = load(inverse, (p + s) * padded + v)
            total = fnma(column, spread(gap), total)
        store(push, p + v, total)
    sound = True
    for s in range(size):
        sound = sound and push[p + s] >= 0.0
    least = spread(0.0)
    for v in range(0, n, FOUR):
        total = load(gaps, row + v)
        for s in range(size):
            opening = load(rows, (lane * blades + known[at + s]) * n + v)
            total = fma(opening, spread(push[p + s]), total)
        store(opened, v, total)
        least = lower_of(least, total)
    for i in range(FOUR):
        sound = sound and element(least, i) >= 1e-13 * lowest
    if not sound:
        return -1
    for v in range(0, n, FOUR):
        store(gaps, row + v, load(opened, v))
    for s in range(size):
        gaps[row + place_of(known[at + s], blades, wide)] = 0.0
    return size


@njit(error_model="numpy", cache=True)
def lanes_space(blades, wide, column, known):
    """Return (push, inverse, rows), lanes one behind the other; `circulant_space`."""
    padded, lanes = -(-blades // FOUR) * FOUR, len(column)
    push, inverse = np.zeros((lanes, padded)), np.zeros((lanes, padded * padded))
    rows = np.zeros((lanes, blades * 2 * wide))
    for i in range(lanes):
        space = circulant_space(blades, wide, column[i], known[i])
        inverse[i], rows[i] = space[2], space[3]
    return push.reshape(-1), inverse.reshape(-1), rows.reshape(-1)


@njit(error_model="numpy", cache=True)
def search(gaps, row, lowest, blades, wide, lane, known, push, inverse, rows, column):
    """Open the gaps of a lane by `guess` or pivoting; return the blades, or -1."""
    padded, n = -(-blades // FOUR) * FOUR, blades * 2 * wide
    fallback = contact_space(blades, 0)
    for j in range(blades):
        for i in range(blades):
            fallback[1][j, i] = column[lane, (i - j) % blades]
        fallback[2][j] = 1
    space = (
        push[lane * padded : (lane + 1) * padded],
        known[lane],
        inverse[lane * padded * padded : (lane + 1) * padded * padded],
        rows[lane * n : (lane + 1) * n],
        fallback[6],
        column[lane],
        fallback,
    )
    active = guess(gaps, row, lowest, blades, wide, padded, space)
    if active < 0:
        active = solve_any(gaps, row, blades, wide, space)
    return active


@njit(error_model="numpy", cache=True, inline="always")
def spectrum_of(push, p, known, at, size, turns, width, fresh, lane):
    """Set the lane's part of `fresh` (lanes width,) to the multipliers' spectrum."""
    for v in range(0, width, FOUR):
        total = load(turns, known[at] * width + v) * spread(push[p])
        for s in range(1, size):
            row = load(turns, known[at + s] * width + v)
            total = fma(row, spread(push[p + s]), total)
        store(fresh, lane * width + v, total)


@njit(error_model="numpy", cache=True, inline="always")
def book(push, p, known, at, size, blades, wide, gaps, older, lane, state, step):
    """Enter a lane's multipliers, as `book_contacts`; older : its row of n - 1."""
    last, counter, ledger, impulse = state
    work, total = 0.0, 0.0
    for s in range(size):
        j = known[at + s]
        force = push[p + s]
        work -= 0.5 * force * gaps[older + place_of(j, blades, wide)]
        total += force * step
        impulse[lane, j] += force * step
        counter[lane, TOUCHDOWNS] += last[lane, j] != counter[lane, STEP] - 1
        last[lane, j] = counter[lane, STEP]
    ledger[lane, IMPACT] -= work
    ledger[lane, ROTATION] -= work
    ledger[lane, IMPULSE] += total
    counter[lane, LAST] = counter[lane, STEP]
    counter[lane, TOUCHED] += 1


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


@njit(error_model="numpy", cache=True)
def until_event(counter, wholes):
    """Return the steps until a lane is flushed or sampled."""
    least = FLUSH_EVERY
    for i in range(len(wholes)):
        if wholes[i, ACTIVE] == 1:
            least = min(least, FLUSH_EVERY - counter[i, STEP] % FLUSH_EVERY)
            stride = wholes[i, STRIDE]
            least = min(least, stride - counter[i, STEP] % stride)
    return least


@njit(error_model="numpy", cache=True)
def any_pulse(counter, wholes, scalars, step):
    """Return whether a lane is loaded now."""
    for i in range(len(wholes)):
        if wholes[i, ACTIVE] == 1 and counter[i, STEP] * step < scalars[i, DURATION]:
            return True
    return False


@lru_cache(maxsize=64)
def lanes_kernel(blades: int, rows: int, ring_rows: int) -> Callable[..., Any]:
    """Return the compiled kernel for these sizes; see `cyclic_kernel`."""
    k, wide = widths(blades)
    width, padded, n = 2 * k, -(-blades // FOUR) * FOUR, 2 * wide
    size, ring_size = rows * width, ring_rows * k
    rotor_touched, rotor_free = rotor_lanes(True, k), rotor_lanes(False, k)
    ring_touched, ring_free = ring_lanes(True, k), ring_lanes(False, k)
    _, settle = cyclic_kernel(blades, rows, ring_rows, False)

    @njit(error_model="numpy", cache=True)
    def sample(lane, turn, step, bodies, fixed, items, numbers, state, tracks):
        """Write a sample of one lane from its own ended state, as `cyclic` does."""
        s_b, s_c, sums_b, sums_c = bodies
        places_b, places_c, hub, turns = fixed
        c_b, c_c = items[0][lane], items[1][lane]
        gaps, lam, known, last, counter, ledger, impulse = state
        other = (turn - counter[lane, STEP]) & 1
        one_b, one_c = np.zeros(ROTOR_STATE * size), np.zeros(RING_STATE * ring_size)
        take_lane(s_b, places_b[other], lane, one_b)
        take_lane(s_c, places_c[other], lane, one_c)
        all_b, all_c = sums_b[lane::FOUR].copy(), sums_c[lane::FOUR].copy()
        ended = np.zeros_like(one_b), np.zeros_like(one_c), all_b.copy(), all_c.copy()
        one = (
            one_b, one_c, lam[lane], gaps[lane], all_b, all_c, known[lane], last[lane],
            counter[lane], ledger[lane], impulse[lane],
        )  # fmt: skip
        settle((c_b,), (c_c,), one, ended)
        now = counter[lane, STEP] & 1
        energy = total_energy(ended[0], c_b, ended[1], c_c, now, step, False)
        tips = np.zeros((blades + 1, 2))
        read_tips(ended[0], c_b, hub, turns, width, np.zeros(width), tips)
        normal, drag, loss = column_sums(ended[2], ended[3])
        whole = ledger[lane].copy()
        whole[ROTATION] += 0.5 * normal
        whole[FRICTION] += 0.5 * numbers[lane, MU] * drag
        write_sample(
            counter[lane], whole, impulse[lane], tips, energy, loss,
            numbers[lane, LIMIT], tracks[lane],
        )  # fmt: skip

    @njit(error_model="numpy", cache=True)
    def events(turn, step, bodies, fixed, items, numbers, wholes, state, tracks):
        """Flush and sample the lanes whose turn it is."""
        counter = state[4]
        for i in range(FOUR):
            if wholes[i, ACTIVE] == 1 and counter[i, STOP] == RUNNING:
                if counter[i, STEP] % FLUSH_EVERY == 0:
                    flush_lane(bodies[0], i)
                    flush_lane(bodies[1], i)
                if counter[i, STEP] % wholes[i, STRIDE] == 0:
                    sample(
                        i, turn, step, bodies, fixed, items, numbers, state, tracks
                    )

    @njit(error_model="numpy", cache=True)
    def thrusts(step, numbers, wholes, counter, thrust, angle):
        """Set thrust, N, and angle of every lane for the step that is being made."""
        for i in range(FOUR):
            thrust[i] = 0.0
            if wholes[i, ACTIVE] == 1:
                before = (counter[i, STEP] - 1) * step
                thrust[i] = pulse_of(before, numbers[i, FORCE], numbers[i, DURATION])
                turned = (numbers[i, SPEED] * (counter[i, STEP] * step)) % (
                    2.0 * math.pi
                )
                angle[i] = numbers[i, LOBES] * turned

    @njit(error_model="numpy", cache=True)
    def march_lanes(steps, step, gap, shared, fixed, items, own, numbers, wholes,
                    column, lobes, bodies, state, turn, tracks):  # fmt: skip
        """March all active lanes `steps` steps, or until one of them stops.

        Parameters
        ----------
        shared : (rotor's items, slots; ring's items, slots; turns, wave)
        fixed : (places of rotor (2, 3 size) and ring (2, 6 ring_size); hub, turns)
        items : (rotor's (lanes, ITEMS size), ring's), of `cyclic`
        own : (rotor's, ring's), see `lane_passes`
        numbers, wholes : (lanes, SCALARS), (lanes, WHOLES)
        column : (lanes, N), W to blade 0; lobes : (lanes, ring_size)
        bodies : (rotor, ring, sums of rotor and ring), of lanes
        state : (gaps, lam, known, last, counter, ledger, impulse), a row each lane
        turn : (1,), number of the step modulo 6
        tracks : of each lane
        """
        c_b, slots_b, c_c, slots_c, turns, wave = shared
        s_b, s_c, sums_b, sums_c = bodies
        gaps, lams, knowns, last, counter, ledger, impulse = state
        gaps, known = gaps.reshape(-1), knowns.reshape(-1)
        places = fixed[1][0]
        push, inverse, rows_w = lanes_space(blades, wide, column, knowns)
        out_b, out_c = np.zeros(width * FOUR), np.zeros(width * FOUR)
        lam, fresh, opened = np.zeros(width * FOUR), np.zeros(width * FOUR), np.zeros(n)
        thrust, angle = np.zeros(FOUR), np.zeros(FOUR)
        touched = np.zeros(FOUR, np.int64)
        booked = (last, counter, ledger, impulse)
        any_touched = False
        for i in range(FOUR):
            if wholes[i, ACTIVE] == 1 and counter[i, LAST] == counter[i, STEP]:
                any_touched = True
                touched[i] = 1
                for v in range(width):
                    fresh[i * width + v] = lams[i, v]
                    lam[v * FOUR + i] = lams[i, v]
        quiet = until_event(counter, wholes)
        pulse = any_pulse(counter, wholes, numbers, step)
        running = True
        for _ in range(steps):
            odd = turn[0] & 1
            if any_touched:
                rotor_touched(s_b, c_b, own[0], slots_b, lam, odd, out_b, sums_b)
                ring_touched(s_c, c_c, own[1], slots_c, lam, odd, out_c, sums_c)
            else:
                rotor_free(s_b, c_b, own[0], slots_b, lam, odd, out_b, sums_b)
                ring_free(s_c, c_c, own[1], slots_c, lam, odd, out_c, sums_c)
            turn[0] = turn[0] + 1 if turn[0] < CYCLE - 1 else 0
            for i in range(FOUR):
                counter[i, STEP] += wholes[i, ACTIVE]
            ring_now, ring_then = (2 + 2 * odd) * ring_size, (4 - 2 * odd) * ring_size
            if pulse:
                thrusts(step, numbers, wholes, counter, thrust, angle)
                for i in range(FOUR):
                    if thrust[i] != 0.0:
                        push_lane(
                            s_c, places, i, items[1][i], ring_size, thrust[i],
                            lobes[i], numbers[i, SIGN], angle[i], ring_then, out_c, k,
                        )  # fmt: skip
            row = turn[0] % 3 * n
            least = to_gaps_lanes(
                out_b, out_c, wave, gap, k, wide, gaps, 3 * n, row
            )
            older = (turn[0] + 1) % 3 * n
            before, any_touched = any_touched, False
            for i in range(FOUR):
                lowest = element(least, i)
                if lowest < 0.0:
                    at, mine = i * (blades + 2), i * 3 * n
                    active = hold(
                        gaps, mine + row, lowest, blades, wide, padded, i, known, push,
                        inverse, rows_w, opened,
                    )  # fmt: skip
                    if active < 0:
                        active = search(
                            gaps, mine + row, lowest, blades, wide, i, knowns, push,
                            inverse, rows_w, column,
                        )  # fmt: skip
                    if active < 0:
                        counter[i, STOP] = COMPLEMENTARITY
                        running = False
                        continue
                    any_touched = True
                    touched[i] = 1
                    spectrum_of(
                        push, i * padded, known, at, active, turns, width, fresh, i
                    )
                    book(
                        push, i * padded, known, at, active, blades, wide, gaps,
                        mine + older, i, booked, step,
                    )  # fmt: skip
                elif touched[i] == 1:
                    touched[i] = 0
                    for v in range(width):
                        lams[i, v] = fresh[i * width + v]
                        fresh[i * width + v] = 0.0
            if any_touched or before:
                for v in range(0, width, FOUR):
                    a, b, c, d = transpose(
                        load(fresh, v), load(fresh, width + v),
                        load(fresh, 2 * width + v), load(fresh, 3 * width + v),
                    )  # fmt: skip
                    store(lam, v * FOUR, a)
                    store(lam, (v + 1) * FOUR, b)
                    store(lam, (v + 2) * FOUR, c)
                    store(lam, (v + 3) * FOUR, d)
            if pulse:
                for i in range(FOUR):
                    if thrust[i] != 0.0 and counter[i, STOP] == RUNNING:
                        ledger[i, PULSE] += work_lane(
                            s_c, places, i, items[1][i], fresh, ring_size, k,
                            thrust[i], lobes[i], numbers[i, SIGN], angle[i], ring_then,
                            ring_now,
                        )  # fmt: skip
            quiet -= 1
            if quiet == 0 or not running:
                keep_spectra(touched, fresh, lams, k)
                events(
                    turn[0], step, bodies, fixed, items, numbers, wholes, state, tracks
                )
                quiet = until_event(counter, wholes)
                pulse = any_pulse(counter, wholes, numbers, step)
                for i in range(FOUR):
                    running = running and counter[i, STOP] == RUNNING
                if not running:
                    break
        keep_spectra(touched, fresh, lams, k)

    return march_lanes


@njit(error_model="numpy", cache=True)
def keep_spectra(touched, fresh, lams, k):
    """Copy the spectra of lanes in contact to their states."""
    width = 2 * k
    for i in range(len(touched)):
        if touched[i] == 1:
            for v in range(width):
                lams[i, v] = fresh[i * width + v]
        for v in range(k):
            lams[i, width + v], lams[i, width + k + v] = lams[i, k + v], -lams[i, v]
