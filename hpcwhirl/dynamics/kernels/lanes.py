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

from hpcwhirl.dynamics.kernels.bodies import FLUSH_EVERY
from hpcwhirl.dynamics.kernels.contact import (
    AMPLITUDE,
    COMPLEMENTARITY,
    COUNTERS,
    LAST,
    PULSE,
    RUNNING,
    STEP,
    STOP,
    pulse_of,
)
from hpcwhirl.dynamics.kernels.cyclic import widths
from hpcwhirl.dynamics.kernels.flight import LESS
from hpcwhirl.dynamics.kernels.lane_contact import book, fill, hold, search, spectrum_of
from hpcwhirl.dynamics.kernels.lane_passes import ring_lanes, rotor_lanes
from hpcwhirl.dynamics.kernels.lane_state import (
    flush_lane,
    push_lane,
    take_lane,
    work_lane,
)
from hpcwhirl.dynamics.kernels.named import CyclicRotor, CyclicState
from hpcwhirl.dynamics.kernels.passes import RING_STATE, ROTOR_STATE
from hpcwhirl.dynamics.kernels.samples import farthest, sample_cyclic, sample_space
from hpcwhirl.dynamics.kernels.vectors import (
    FOUR,
    address,
    broadcast,
    element,
    fma,
    get,
    higher_of,
    load,
    lower_of,
    put,
    spread_at,
    store,
    transpose,
)

CYCLE = 6  # steps after which places of d and rows of gaps come round
SPEED, LOBES, FORCE, DURATION, SIGN, MU, LIMIT = range(7)  # scalars of a lane
SCALARS = 7
STRIDE, ACTIVE, BEAT = 0, 1, 2  # whole numbers of a lane
WHOLES = 3


@njit(error_model="numpy", cache=True, inline="always")
def add_wave(re, im, wave, p, q, even, odd):
    """Return the sums at a blade with one more column of the spectrum."""
    return fma(re, spread_at(wave, p), even), fma(im, spread_at(wave, q), odd)


@njit(error_model="numpy", cache=True, inline="always")
def to_gaps_lanes(out_b, out_c, wave, gap, k, wide, gaps, length, row):
    """Transform all lanes; set row `row` of each lane's gaps; return the least four.

    And a bound of the tips' displacements, see `cyclic.size_of`.

    out_b, out_c : (2 k lanes,), spectra of both bodies, then of the rotor and of the
    gaps; gaps : (lanes length,)
    """
    far = broadcast(0.0)
    for c in range(0, 2 * k * FOUR, FOUR):
        part = load(out_b, c)
        far = far + higher_of(part, broadcast(0.0) - part)
        store(out_c, c, part + load(out_c, c))
    least = broadcast(gap)
    for j in range(0, wide, FOUR):
        e0, e1, e2, e3 = broadcast(gap), broadcast(gap), broadcast(gap), broadcast(gap)
        o0, o1, o2, o3 = broadcast(0.0), broadcast(0.0), broadcast(0.0), broadcast(0.0)
        for c in range(k):
            re, im = load(out_c, c * FOUR), load(out_c, (k + c) * FOUR)
            p, q = c * wide + j, (k + c) * wide + j
            e0, o0 = add_wave(re, im, wave, p, q, e0, o0)
            e1, o1 = add_wave(re, im, wave, p + 1, q + 1, e1, o1)
            e2, o2 = add_wave(re, im, wave, p + 2, q + 2, e2, o2)
            e3, o3 = add_wave(re, im, wave, p + 3, q + 3, e3, o3)
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
    return least, far


@njit(error_model="numpy", cache=True)
def until_event(counter, wholes):
    """Return the steps until a lane is flushed or sampled."""
    least = FLUSH_EVERY
    for i in range(len(wholes)):
        if wholes[i, ACTIVE] == 1:
            least = min(least, FLUSH_EVERY - counter[i, STEP] % FLUSH_EVERY)
            for stride in (wholes[i, STRIDE], wholes[i, BEAT]):
                least = min(least, stride - counter[i, STEP] % stride)
    return least


@njit(error_model="numpy", cache=True)
def nearest_limit(numbers, wholes):
    """Return the least displacement at which a lane might have to stop, m."""
    least = math.inf
    for i in range(len(wholes)):
        if wholes[i, ACTIVE] == 1:
            least = min(least, LESS * numbers[i, LIMIT])
    return least


@njit(error_model="numpy", cache=True)
def any_pulse(counter, wholes, scalars, step):
    """Return whether a lane is loaded now."""
    for i in range(len(wholes)):
        if wholes[i, ACTIVE] == 1 and counter[i, STEP] * step < scalars[i, DURATION]:
            return True
    return False


@njit(error_model="numpy", cache=True)
def sample(lane, turn, step, gap, bodies, fixed, items, numbers, state, keep, judge,
           tracks, rows, ring_rows):  # fmt: skip
    """Write a sample of one lane from its own ended state, as `cyclic` does."""
    s_b, s_c, sums_b, sums_c = bodies
    places_b, places_c, hub, turns, wave = fixed
    c_b, c_c = items.rotor[lane], items.ring[lane]
    gaps, lam, known, last, counter, ledger, impulse = state
    k, blades = lam.shape[1] // 4, last.shape[1]
    size, ring_size, width = 2 * rows * k, ring_rows * k, 2 * k
    other = (turn - counter[lane, STEP]) & 1
    one_b, one_c = np.zeros(ROTOR_STATE * size), np.zeros(RING_STATE * ring_size)
    take_lane(s_b, places_b[other], lane, one_b)
    take_lane(s_c, places_c[other], lane, one_c)
    all_b, all_c = sums_b[lane::FOUR].copy(), sums_c[lane::FOUR].copy()
    one = CyclicState(
        one_b, one_c, lam[lane], gaps[lane], all_b, all_c, known[lane], last[lane],
        counter[lane], ledger[lane], impulse[lane],
    )  # fmt: skip
    row = turn % 3 * (gaps.shape[1] // 3)
    sample_cyclic(
        step, numbers[lane, MU], gap, row, CyclicRotor(c_b, hub), c_c, turns, wave, one,
        sample_space(one, blades, width), keep, judge, tracks[lane], rows, ring_rows,
        width, False,
    )  # fmt: skip


@njit(error_model="numpy", cache=True)
def events(
    turn, step, gap, bodies, fixed, items, numbers, wholes, state, tracks, rows,
    ring_rows,
):  # fmt: skip
    """Flush and sample the lanes whose turn it is."""
    counter = state.counter
    for i in range(FOUR):
        stop = counter[i, STOP]
        if wholes[i, ACTIVE] == 1 and stop in (RUNNING, AMPLITUDE):
            if counter[i, STEP] % FLUSH_EVERY == 0:
                flush_lane(bodies.rotor, i)
                flush_lane(bodies.ring, i)
            keep = counter[i, STEP] % wholes[i, STRIDE] == 0
            judge = counter[i, STEP] % wholes[i, BEAT] == 0
            if keep or judge:
                sample(
                    i, turn, step, gap, bodies, fixed, items, numbers, state, keep,
                    judge, tracks, rows, ring_rows,
                )  # fmt: skip


@njit(error_model="numpy", cache=True)
def stop_far(far, limits, out_b, turns, blades, k, counter):
    """Stop the lanes with a tip beyond its limit; return whether there is one.

    far : (lanes,), bounds; limits : (lanes,), m; out_b : (2 k lanes,), of the rotor
    """
    found = False
    for i in range(FOUR):
        if far[i] > LESS * limits[i] and counter[i, STOP] == RUNNING:
            own = out_b[i : 2 * k * FOUR : FOUR].copy()
            if farthest(own, turns, blades, 2 * k) > limits[i]:
                counter[i, STOP] = AMPLITUDE
                found = True
    return found


@njit(error_model="numpy", cache=True)
def thrusts(step, numbers, wholes, counter, thrust, angle):
    """Set thrust, N, and angle of every lane for the step that is being made."""
    for i in range(FOUR):
        thrust[i] = 0.0
        if wholes[i, ACTIVE] == 1:
            before = (counter[i, STEP] - 1) * step
            thrust[i] = pulse_of(before, numbers[i, FORCE], numbers[i, DURATION])
            turned = (numbers[i, SPEED] * (counter[i, STEP] * step)) % (2.0 * math.pi)
            angle[i] = numbers[i, LOBES] * turned


@lru_cache(maxsize=64)
def lanes_kernel(blades: int, rows: int, ring_rows: int) -> Callable[..., Any]:
    """Return the compiled kernel for these sizes; see `cyclic_kernel`."""
    k, wide = widths(blades)
    width, padded, n = 2 * k, -(-blades // FOUR) * FOUR, 2 * wide
    ring_size = ring_rows * k

    @njit(error_model="numpy", cache=True)
    def march_lanes(steps, step, gap, shared, fixed, items, own, numbers, wholes,
                    column, lobes, bodies, state, turn, tracks, work, touching,
                    kept):  # fmt: skip
        """March all active lanes `steps` steps, or until one of them stops.

        Parameters
        ----------
        shared, fixed, bodies, state, work, kept : see `named`
        items, own : `LaneItems`, of `cyclic` and of `lane_passes`
        numbers, wholes : (lanes, SCALARS), (lanes, WHOLES)
        column : (lanes, N), W to blade 0; lobes : (lanes, ring_size)
        turn : (1,), number of the step modulo 6
        tracks : of each lane
        touching : (lanes,), work space
        """
        lams, knowns, counter, ledger = (
            state.lam, state.known, state.counter, state.ledger
        )  # fmt: skip
        s_b, s_c = address(bodies.rotor), address(bodies.ring)
        sums_b, sums_c = address(bodies.sums_b), address(bodies.sums_c)
        c_b, slots_b = address(shared.items_b), address(shared.slots_b)
        c_c, slots_c = address(shared.items_c), address(shared.slots_c)
        count_b, count_c = len(shared.slots_b), len(shared.slots_c)
        wave, own_b, own_c = (
            address(shared.wave), address(own.rotor), address(own.ring)
        )  # fmt: skip
        gaps, known = address(state.gaps), address(knowns)
        steps_of, active_of = address(counter), address(wholes)
        booked = address(state.last), steps_of, address(ledger), address(state.impulse)
        places, fresh_all, touched = fixed.places_c[0], work.fresh, touching
        out_b, out_c, lam = address(work.out_b), address(work.out_c), address(work.lam)
        fresh, opened = address(work.fresh), address(work.opened)
        thrust, angle, bounds = np.zeros(FOUR), np.zeros(FOUR), np.zeros(FOUR)
        nearest = nearest_limit(numbers, wholes)
        fill(blades, wide, column, knowns, kept)
        held = (
            address(kept.size), address(kept.push), address(kept.inverse),
            address(kept.rows), address(kept.turns), address(kept.place),
        )  # fmt: skip
        push, place = address(kept.push), address(kept.place)
        any_touched = False
        work.lam[:] = 0.0
        fresh_all[:] = 0.0
        for i in range(FOUR):
            touched[i] = 0
            if wholes[i, ACTIVE] == 1 and counter[i, LAST] == counter[i, STEP]:
                any_touched = True
                touched[i] = 1
                for v in range(width):
                    fresh_all[i * width + v] = lams[i, v]
                    work.lam[v * FOUR + i] = lams[i, v]
        quiet = until_event(counter, wholes)
        pulse = any_pulse(counter, wholes, numbers, step)
        running = True
        for _ in range(steps):
            odd = turn[0] & 1
            if any_touched:
                rotor_lanes(
                    s_b, c_b, own_b, slots_b, count_b, lam, odd, out_b, sums_b, k, True
                )
                ring_lanes(
                    s_c, c_c, own_c, slots_c, count_c, lam, odd, out_c, sums_c, k, True
                )
            else:
                rotor_lanes(
                    s_b, c_b, own_b, slots_b, count_b, lam, odd, out_b, sums_b, k, False
                )
                ring_lanes(
                    s_c, c_c, own_c, slots_c, count_c, lam, odd, out_c, sums_c, k, False
                )
            turn[0] = turn[0] + 1 if turn[0] < CYCLE - 1 else 0
            for i in range(FOUR):
                at = i * COUNTERS + STEP
                active = get(active_of, i * WHOLES + ACTIVE)
                put(steps_of, at, get(steps_of, at) + active)
            ring_now, ring_then = (2 + 2 * odd) * ring_size, (4 - 2 * odd) * ring_size
            if pulse:
                thrusts(step, numbers, wholes, counter, thrust, angle)
                for i in range(FOUR):
                    if thrust[i] != 0.0:
                        push_lane(
                            bodies.ring, places, i, items.ring[i], ring_size, thrust[i],
                            lobes[i], numbers[i, SIGN], angle[i], ring_then, work.out_c,
                            k,
                        )  # fmt: skip
            row = turn[0] % 3 * n
            least, far = to_gaps_lanes(
                out_b, out_c, wave, gap, k, wide, gaps, 3 * n, row
            )
            older = (turn[0] + 1) % 3 * n
            before, any_touched = any_touched, False
            for i in range(FOUR):
                lowest = element(least, i)
                if lowest < 0.0:
                    mine = i * 3 * n
                    found = hold(
                        gaps, mine + row, lowest, i,
                        get(known, i * (blades + 2) + blades + 1), n, padded, held,
                        opened,
                    )  # fmt: skip
                    if not found:
                        found = search(
                            state.gaps.reshape(-1), mine + row, lowest, blades, wide, i,
                            knowns[i], column[i], kept,
                        )  # fmt: skip
                    if not found:
                        counter[i, STOP] = COMPLEMENTARITY
                        running = False
                        continue
                    any_touched = True
                    touched[i] = 1
                    spectrum_of(i, n, padded, held, fresh)
                    book(
                        push, i * padded, known, place,
                        get(known, i * (blades + 2) + blades), gaps,
                        mine + row, mine + older, i, blades, booked, step,
                    )  # fmt: skip
                elif touched[i] == 1:
                    touched[i] = 0
                    for v in range(width):
                        lams[i, v] = fresh_all[i * width + v]
                        fresh_all[i * width + v] = 0.0
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
                            bodies.ring, places, i, items.ring[i], fresh_all, ring_size,
                            k, thrust[i], lobes[i], numbers[i, SIGN], angle[i],
                            ring_then, ring_now,
                        )  # fmt: skip
            beyond = False
            for i in range(FOUR):
                bounds[i] = element(far, i)
                beyond = beyond or bounds[i] > nearest
            if beyond and stop_far(
                bounds, numbers[:, LIMIT], work.out_b, fixed.turns, blades, k, counter
            ):
                running = False
            quiet -= 1
            if quiet == 0 or not running:
                keep_spectra(touched, fresh_all, lams, k)
                events(
                    turn[0], step, gap, bodies, fixed, items, numbers, wholes, state,
                    tracks, rows, ring_rows,
                )  # fmt: skip
                quiet = until_event(counter, wholes)
                pulse = any_pulse(counter, wholes, numbers, step)
                for i in range(FOUR):
                    running = running and counter[i, STOP] == RUNNING
                if not running:
                    break
        keep_spectra(touched, fresh_all, lams, k)

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
