"""The contact problem of one lane, with all that it reads kept together.

What `circulant` does for a single case, on flat arrays with the lanes one behind the
other; blades in contact are padded to vectors with blades that do nothing.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from hpcwhirl.dynamics.kernels.circulant import (
    circulant_space,
    guess,
    place_of,
    solve_any,
)
from hpcwhirl.dynamics.kernels.contact import (
    COUNTERS,
    ENTRIES,
    IMPACT,
    IMPULSE,
    LAST,
    ROTATION,
    STEP,
    TOUCHDOWNS,
    TOUCHED,
)
from hpcwhirl.dynamics.kernels.vectors import (
    FOUR,
    all_at_least,
    broadcast,
    fma,
    fnma,
    get,
    load,
    lower_of,
    put,
    spread_at,
    store,
)


@njit(error_model="numpy", cache=True, inline="always")
def hold(gaps, row, lowest, lane, known, n, padded, kept, opened):
    """Open the gaps with the blades of the last solution, as `guess` tries first.

    Returns whether they are the solution; if not, the row is left alone. What pads
    the blades to vectors adds zeros. known : whether their inverse is sound

    kept : addresses of what `fill` sets, but of all rows and turns
    opened : (n,), work space
    """
    size, push, inverse, rows, _, place = kept
    count, p = get(size, lane), lane * padded
    zero, sound = broadcast(0.0), known == 1 and count > 0
    for v in range(0, count, FOUR):
        total = zero
        for s in range(p, p + count, FOUR):
            a, b = row + get(place, s), row + get(place, s + 1)
            c, d = row + get(place, s + 2), row + get(place, s + 3)
            i = s * padded + v
            total = fnma(load(inverse, i), spread_at(gaps, a), total)
            total = fnma(load(inverse, i + padded), spread_at(gaps, b), total)
            total = fnma(load(inverse, i + 2 * padded), spread_at(gaps, c), total)
            total = fnma(load(inverse, i + 3 * padded), spread_at(gaps, d), total)
        sound = sound and all_at_least(total, zero)
        store(push, p + v, total)
    least = zero
    for v in range(0, n, 2 * FOUR):
        one, two = load(gaps, row + v), load(gaps, row + v + FOUR)
        for s in range(p, p + count, FOUR):
            i = s * n + v
            a, b = spread_at(push, s), spread_at(push, s + 1)
            c, d = spread_at(push, s + 2), spread_at(push, s + 3)
            one, two = fma(load(rows, i), a, one), fma(load(rows, i + FOUR), a, two)
            i += n
            one, two = fma(load(rows, i), b, one), fma(load(rows, i + FOUR), b, two)
            i += n
            one, two = fma(load(rows, i), c, one), fma(load(rows, i + FOUR), c, two)
            i += n
            one, two = fma(load(rows, i), d, one), fma(load(rows, i + FOUR), d, two)
        store(opened, v, one)
        store(opened, v + FOUR, two)
        least = lower_of(least, lower_of(one, two))
    sound = sound and all_at_least(least, broadcast(1e-13 * lowest))
    if sound:
        for v in range(0, n, FOUR):
            store(gaps, row + v, load(opened, v))
    return sound


@njit(error_model="numpy", cache=True, inline="always")
def spectrum_of(lane, n, padded, kept, fresh):
    """Set the lane's part of `fresh` (lanes n,) to the multipliers' spectrum."""
    size, push, _, _, turns, _ = kept
    count, p = get(size, lane), lane * padded
    for v in range(0, n, 2 * FOUR):
        one, two = broadcast(0.0), broadcast(0.0)
        for s in range(p, p + count, FOUR):
            i = s * n + v
            a, b = spread_at(push, s), spread_at(push, s + 1)
            c, d = spread_at(push, s + 2), spread_at(push, s + 3)
            one, two = fma(load(turns, i), a, one), fma(load(turns, i + FOUR), a, two)
            i += n
            one, two = fma(load(turns, i), b, one), fma(load(turns, i + FOUR), b, two)
            i += n
            one, two = fma(load(turns, i), c, one), fma(load(turns, i + FOUR), c, two)
            i += n
            one, two = fma(load(turns, i), d, one), fma(load(turns, i + FOUR), d, two)
        store(fresh, lane * n + v, one)
        store(fresh, lane * n + v + FOUR, two)


@njit(error_model="numpy", cache=True)
def fill(blades, wide, column, known, kept):
    """Set `kept` (`named.LaneKept`) from the states."""
    length, whole = blades * 2 * wide, kept.all_rows
    for i in range(len(column)):
        space = circulant_space(blades, wide, column[i], known[i])
        whole[i * length : (i + 1) * length] = space.rows
        learn(i, blades, wide, known[i], space.inverse, kept)


@njit(error_model="numpy", cache=True)
def learn(lane, blades, wide, known, inverse, kept):
    """Keep the blades `known` of a lane and the inverse (padded padded,) of their W."""
    size, push, inverses, rows, turns, place, all_rows, all_turns = kept
    padded, n, count = -(-blades // FOUR) * FOUR, 2 * wide, known[blades]
    size[lane] = -(-count // FOUR) * FOUR
    for s in range(size[lane]):
        to = lane * padded + s
        real, j = s < count, known[s] if s < count else 0
        place[to] = place_of(j, blades, wide)
        push[to] = push[to] if real else 0.0
        for v in range(padded):
            within = real and v < count
            inverses[to * padded + v] = inverse[s * padded + v] if within else 0.0
        for v in range(n):
            row, turn = all_rows[(lane * blades + j) * n + v], all_turns[j * n + v]
            rows[to * n + v] = row if real else 0.0
            turns[to * n + v] = turn if real else 0.0


@njit(error_model="numpy", cache=True)
def search(gaps, row, lowest, blades, wide, lane, known, column, kept):
    """Open the gaps of a lane by `guess` or pivoting and keep the solution's blades.

    Returns whether it could.
    """
    padded, n = -(-blades // FOUR) * FOUR, 2 * wide
    push, first, length = kept.push, lane * padded, blades * n
    where, inverse = np.zeros(blades + 1, np.int64), np.zeros(padded * padded)
    rows = kept.all_rows[lane * length : (lane + 1) * length]
    mine = push[first : first + padded]
    known[blades + 1] = 0  # `hold` has tried them
    active = guess(
        gaps, row, lowest, blades, wide, padded, mine, known, inverse, rows, where,
        column,
    )  # fmt: skip
    if active < 0:
        space = circulant_space(blades, wide, column, known)
        active = solve_any(gaps, row, blades, wide, space)
        mine[:], inverse[:] = space.push, space.inverse
    if active < 0:
        return False
    learn(lane, blades, wide, known, inverse, kept)
    return True


@njit(error_model="numpy", cache=True, inline="always")
def book(push, p, known, place, size, gaps, row, older, lane, blades, state, step):
    """Enter a lane's multipliers, as `book_contacts`, and close its gaps.

    row, older : of this step and of that before the last
    """
    last, counter, ledger, impulse = state
    at, j0 = lane * (blades + 2), lane * blades
    count, entry = lane * COUNTERS, lane * ENTRIES
    work, total, now, begun = 0.0, 0.0, get(counter, count + STEP), 0
    for s in range(size):
        j, where = j0 + get(known, at + s), get(place, p + s)
        force = get(push, p + s)
        work -= 0.5 * force * get(gaps, older + where)
        total += force * step
        put(impulse, j, get(impulse, j) + force * step)
        begun += 1 if get(last, j) != now - 1 else 0
        put(last, j, now)
        put(gaps, row + where, 0.0)
    put(counter, count + TOUCHDOWNS, get(counter, count + TOUCHDOWNS) + begun)
    put(ledger, entry + IMPACT, get(ledger, entry + IMPACT) - work)
    put(ledger, entry + ROTATION, get(ledger, entry + ROTATION) - work)
    put(ledger, entry + IMPULSE, get(ledger, entry + IMPULSE) + total)
    put(counter, count + LAST, now)
    put(counter, count + TOUCHED, get(counter, count + TOUCHED) + 1)
