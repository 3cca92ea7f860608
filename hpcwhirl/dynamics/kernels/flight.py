"""Flights: jumps of the exact flow over steps in which no blade can touch.

Here a prime is the derivative by time. Let v be a decreasing envelope of a free mode's
velocity, |q'| <= v; then |q''| <= omega v. A harmonic of the ring, of amplitude C in
the static frame, moves past the blades at h Omega, y = C e^{i h Omega t}, so that |y''|
<= (omega + 2 |h Omega|) v + (h Omega)^2 |C|. The sum of these bounds over all modes,
each times its displacement at a tip, is a bound A of the second derivative of every
gap, and

g_j(t) >= g_j + g_j' t - A t^2 / 2

is positive up to a time that is found for each blade. A casing that is not round adds
its harmonics c_h, which move past the blades in the same way, |y''| = (h Omega)^2
|c_h|. Likewise the sum of all amplitudes bounds the change of every gap for all time:
if it is below the least clearance of all angles, contact cannot recur, which is the
certificate.
"""

from __future__ import annotations

import math

from hpcwhirl.dynamics.kernels.compiled import does, kernel, part, verb
from hpcwhirl.dynamics.kernels.contact import (
    CERTIFICATE,
    CERTIFIED,
    ENDED,
    JUMPED,
    JUMPS,
    MISS,
    NEXT_TRY,
    PATIENCE,
    STEP,
)
from hpcwhirl.dynamics.kernels.flow import EXACT
from hpcwhirl.dynamics.kernels.passes import (
    ITEMS,
    RADIAL,
    SPEED_D,
    SPEED_Q,
    SPIN,
    places,
    to_gaps_seldom,
)
from hpcwhirl.dynamics.kernels.shape import is_shaped, write_rates, write_shape
from hpcwhirl.dynamics.kernels.stepping import end_step
from hpcwhirl.dynamics.kernels.vectors import (
    FOUR,
    broadcast,
    fma,
    fnma,
    higher_of,
    load,
    root,
    store,
    total_of,
)
from hpcwhirl.dynamics.kernels.wave_types import CyclicRotor

# coefficients of a jump: of q and its increment d before the jump in q and d after it;
# of q^2, q d and d^2 in the damping loss; e^{i h Omega t} over the jump
QQ, QD, DQ, DD, LQQ, LQD, LDD, TURNED_RE, TURNED_IM = range(9)
JUMP_ITEMS = 9
# coefficients of the bounds: v^2 = stiff q^2 + mixed q dq/dt + one (dq/dt)^2; of v and
# of |C| in A; of v in the bound of the displacement
STIFF, MIXED, ONE, RISE, RISE_HELD, REACH = range(6)
BOUND_ITEMS = 6
SHORTEST = 4  # least number of steps for which a jump is made
LONGEST_PATIENCE = 32  # steps between two tries while blades are near
PASSES = 2  # largest number of jumps by tables that `leap` combines
LESS = 1.0 - 1e-9  # factor on the clearance that covers round-off of the bounds


@verb
def bound_rotor(rotor, s, bound, rows, k, counter, rate):
    """Return the rotor's parts of two bounds: acceleration, m/s^2, and displacement, m.

    The bounds hold for the second derivative of every gap and the displacement of every
    tip in free motion from the present state, until contact occurs.

    s, counter : state of the rotor, after the last step's contact forces; counters of
        the march
    bound : coefficients of the bounds, see `dynamics.flights`
    rows, k : number of modes or waves of a nodal diameter; of nodal diameters, padded
    rate : (2 k,), out: spectrum of the rotor's part of the gaps' rates, m/s
    """


@does(bound_rotor, CyclicRotor)
@kernel
def bound_modes(rotor, s, bound, rows, k, counter, rate):
    """Return the rotor's parts of two bounds: acceleration, m/s^2, and displacement, m.

    The implementation of `bound_rotor`, which explains the arguments, for modes by
    nodal diameter.
    """
    c, width, size = rotor.items, 2 * k, 2 * k * rows
    now, _ = places(counter, size)
    bend, reach = broadcast(0.0), broadcast(0.0)
    for col in range(0, k, FOUR):
        rate_re, rate_im = broadcast(0.0), broadcast(0.0)
        for f in range(rows):
            m = f * width + col
            power = broadcast(0.0)
            for phase in range(2):
                i = m + phase * k
                q, d = load(s, i), load(s, now + i)
                v = load(c, i * ITEMS + SPEED_Q * FOUR) * q
                v = fma(load(c, i * ITEMS + SPEED_D * FOUR), d, v)
                part = load(bound, STIFF * size + m) * q
                part = fma(load(bound, MIXED * size + m), v, part)
                power = fma(part, q, power)
                power = fma(load(bound, ONE * size + m) * v, v, power)
                if phase == 0:
                    rate_re = fma(load(c, i * ITEMS + RADIAL * FOUR), v, rate_re)
                else:
                    rate_im = fma(load(c, i * ITEMS + RADIAL * FOUR), v, rate_im)
            v = root(higher_of(power, broadcast(0.0)))  # of 1e-160 it rounds below 0
            bend = fma(load(bound, RISE * size + m), v, bend)
            reach = fma(load(bound, REACH * size + m), v, reach)
        store(rate, col, rate_re)
        store(rate, k + col, rate_im)
    return total_of(bend), total_of(reach)


@kernel
def bound_ring(s, c, bound, rows, k, counter, rate):
    """Return the ring's parts of two bounds: acceleration, m/s^2, and displacement, m.

    The bounds hold for the second derivative of every gap and the ring's radial
    displacement in free motion from the present state, until contact occurs.

    s, counter : (6 size,), state of the ring, after the last step's contact forces;
        counters of the march
    c, bound : coefficients of the modes, packed; of the bounds, see `dynamics.flights`
    rows, k : rows of modes; number of nodal diameters, padded
    rate : (2 k,), m/s, in and out: the ring's part of the spectrum of the gaps' rates
        is added
    """
    size = rows * k
    now, _ = places(counter, 2 * size)
    bend, reach = broadcast(0.0), broadcast(0.0)
    for col in range(0, k, FOUR):
        rate_re, rate_im = load(rate, col), load(rate, k + col)
        for r in range(rows):
            m = r * k + col
            yr, yi = load(s, m), load(s, size + m)
            dr, di = load(s, now + m), load(s, now + size + m)
            of_d = load(c, m * ITEMS + SPEED_D * FOUR)
            of_q = load(c, m * ITEMS + SPEED_Q * FOUR)
            vr, vi = fma(of_d, dr, of_q * yr), fma(of_d, di, of_q * yi)
            held = fma(yr, yr, yi * yi)
            power = load(bound, STIFF * size + m) * held
            mixed = fma(yr, vr, yi * vi)
            power = fma(load(bound, MIXED * size + m), mixed, power)
            power = fma(load(bound, ONE * size + m), fma(vr, vr, vi * vi), power)
            v = root(higher_of(power, broadcast(0.0)))  # of 1e-160 it rounds below 0
            bend = fma(load(bound, RISE * size + m), v, bend)
            bend = fma(load(bound, RISE_HELD * size + m), root(held), bend)
            reach = fma(load(bound, REACH * size + m), v, reach)
            spin = load(c, m * ITEMS + SPIN * FOUR)
            psi = load(c, m * ITEMS + RADIAL * FOUR)
            rate_re = fma(psi, fnma(spin, yi, vr), rate_re)
            rate_im = fma(psi, fma(spin, yr, vi), rate_im)
        store(rate, col, rate_re)
        store(rate, k + col, rate_im)
    return total_of(bend), total_of(reach)


@kernel
def open_until(gap, rate, bend):
    """Return a time, s, up to which gap + rate t - bend t^2 / 2 is above 0.

    No contact of a blade can occur before.

    gap, rate, bend : m, gap of the blade now; m/s, its rate; m/s^2, bound of the
        magnitude of its second derivative
    """
    if gap <= 0.0 and rate <= 0.0:
        return 0.0
    if bend <= 0.0:
        return math.inf if rate >= 0.0 else -gap / rate
    apex = math.sqrt(rate * rate + 2.0 * bend * max(gap, 0.0))
    return (rate + apex) / bend if rate >= 0.0 else 2.0 * gap / (apex - rate)


@kernel
def free_steps(gaps, row, rates, count, bend, step, longest):
    """Return the number of steps, at most `longest`, in which no blade can touch.

    It is 0 if a gap is not a number.

    gaps, row : m, gaps, of which those of the present step begin at index `row`
    rates, count : m/s, rates of these `count` gaps
    bend : m/s^2, bound of the magnitude of all second derivatives
    step : dt, s
    """
    time = longest * step
    for i in range(count):
        opened = open_until(gaps[row + i], rates[i], bend)
        if not opened >= 0.0:  # also if NaN: no jump
            return 0
        time = min(time, opened)
    return int(LESS * time / step)


@verb
def jump_rotor(rotor, s, table, rows, k, now, then, out, sums):
    """Move the rotor's state s to the end of a jump; add the damping loss to sums, J.

    table : coefficients of the jump, (JUMP_ITEMS size,)
    rows, k : number of modes or waves of a nodal diameter; of nodal diameters, padded
    now, then : number of the step before and after the jump, mod 2: selects the
        increments in s
    out : (2 k,), m, out: spectrum of the rotor's part of the gaps at the jump's end
    """


@does(jump_rotor, CyclicRotor)
@part
def jump_modes(rotor, s, table, rows, k, now, then, out, sums):
    """Move the rotor's state s to the end of a jump; add the damping loss to sums, J.

    The implementation of `jump_rotor`, with its arguments, for modes by nodal diameter.
    """
    c, width, size = rotor.items, 2 * k, 2 * k * rows
    now, then = (1 + now) * size, (1 + then) * size
    for col in range(0, width, FOUR):
        loss, spectrum = load(sums, 2 * width + col), broadcast(0.0)
        for f in range(rows):
            m = f * width + col
            q, d = load(s, m), load(s, now + m)
            part = fma(load(table, LQD * size + m), d, load(table, LQQ * size + m) * q)
            loss = fma(part, q, loss)
            loss = fma(load(table, LDD * size + m) * d, d, loss)
            ahead = fma(load(table, QD * size + m), d, load(table, QQ * size + m) * q)
            store(
                s, then + m,
                fma(load(table, DD * size + m), d, load(table, DQ * size + m) * q),
            )  # fmt: skip
            store(s, m, ahead)
            spectrum = fma(load(c, m * ITEMS + RADIAL * FOUR), ahead, spectrum)
        store(out, col, spectrum)
        store(sums, 2 * width + col, loss)


@part
def jump_ring(s, c, table, rows, k, now, then, out, sums):
    """Move the ring's state s to the end of a jump; add the damping loss to sums, J.

    s : (6 size,), amplitudes and increments in the rotating frame
    c : coefficients of the ring's modes, packed
    table, rows, k, now, then : as in `jump_rotor`, for the ring
    out : (2 k,), m, out: spectrum of the ring's part of the gaps at the jump's end
    """
    size = rows * k
    now, then = 2 * (1 + now) * size, 2 * (1 + then) * size
    for col in range(0, k, FOUR):
        loss, real, imag = load(sums, 2 * k + col), broadcast(0.0), broadcast(0.0)
        for r in range(rows):
            m = r * k + col
            er, ei = (
                load(table, TURNED_RE * size + m),
                load(table, TURNED_IM * size + m),
            )
            yr, yi = load(s, m), load(s, size + m)
            dr, di = load(s, now + m), load(s, now + size + m)
            held, mixed = fma(yr, yr, yi * yi), fma(yr, dr, yi * di)
            loss = fma(load(table, LQQ * size + m), held, loss)
            loss = fma(load(table, LQD * size + m), mixed, loss)
            loss = fma(load(table, LDD * size + m), fma(dr, dr, di * di), loss)
            qq, qd = load(table, QQ * size + m), load(table, QD * size + m)
            dq, dd = load(table, DQ * size + m), load(table, DD * size + m)
            zr, zi = fma(qd, dr, qq * yr), fma(qd, di, qq * yi)
            pr, pi = fma(dd, dr, dq * yr), fma(dd, di, dq * yi)
            yr, yi = fnma(ei, zi, er * zr), fma(er, zi, ei * zr)
            store(s, m, yr)
            store(s, size + m, yi)
            store(s, then + m, fnma(ei, pi, er * pr))
            store(s, then + size + m, fma(er, pi, ei * pr))
            psi = load(c, m * ITEMS + RADIAL * FOUR)
            real, imag = fma(psi, yr, real), fma(psi, yi, imag)
        store(out, col, real)
        store(out, k + col, imag)
        store(sums, 2 * k + col, loss)


@kernel
def look_ahead(step, speed, wall, rotor, c_c, wave, flight, state, rate, rates, rows,
               ring_rows, k, wide):  # fmt: skip
    """Complete the last step in the states; return how many steps a jump may have.

    In so many steps no blade can touch. If contact cannot recur at all, this
    certificate is entered in counter and ledger.

    speed, wall : Omega, rad/s; `kernel_types.Wall`
    rate, rates : m/s, out: rates of the gaps, as spectrum (2 k,), and of all blades (2
        wide,) in folded order (see `circulant.folded`)
    rows, ring_rows : numbers of rows of modes of rotor and ring
    k, wide : number of nodal diameters, padded; half the length of `rates`
    c_c, wave, flight : as in `fly`
    """
    s_b, s_c, lam, gaps, sums_b, sums_c, _, _, counter, ledger, _ = state
    end_step(rotor, EXACT, s_b, s_b, s_c, s_c, c_c, lam, counter, sums_b, sums_c)
    counter[ENDED] = counter[STEP]
    bend, reach = bound_rotor(rotor, s_b, flight.bounds_b, rows, k, counter, rate)
    more, further = bound_ring(s_c, c_c, flight.bounds_c, ring_rows, k, counter, rate)
    if is_shaped(wall):
        bend += write_rates(wall, counter[STEP] * step, speed, rate)
    if flight.certifiable and (reach + further) < LESS * wall.room:
        counter[CERTIFIED] = counter[STEP]
        ledger[CERTIFICATE] = reach + further
    to_gaps_seldom(rate, wave, 0.0, k, wide, rates, 0)
    row = counter[STEP] % 3 * 2 * wide
    longest = flight.counts[-2]
    return free_steps(gaps, row, rates, 2 * wide, bend + more, step, longest) - 1


@part
def leap(count, rotor, c_c, flight, state, out_b, out_c, rows, ring_rows, k):
    """Move both bodies over up to `count` steps without contact; return how many.

    It combines up to `PASSES` jumps of tabulated numbers of steps.

    c_c, flight : coefficients of the ring's modes, packed; `wave_types.Flight`
    out_b, out_c : (2 k,), m, out: spectra of the rotor's and the ring's part of the
        gaps at the end
    rows, ring_rows, k : numbers of rows of modes of rotor and ring; of nodal diameters,
        padded
    """
    counts, jumps_b, jumps_c = flight.counts, flight.jumps_b, flight.jumps_c
    counter, left = state.counter, count
    for _ in range(PASSES):
        p = len(counts) - 1 if left == counts[-1] else len(counts) - 2
        while p >= 0 and counts[p] > left:
            p -= 1
        if p < 0:
            break
        now, then = counter[STEP] & 1, (counter[STEP] + counts[p]) & 1
        jump_rotor(
            rotor, state.rotor, jumps_b[p], rows, k, now, then, out_b, state.sums_b
        )
        jump_ring(
            state.ring, c_c, jumps_c[p], ring_rows, k, now, then, out_c, state.sums_c
        )
        counter[STEP] += counts[p]
        counter[ENDED] = counter[STEP]
        counter[JUMPED] += counts[p]
        counter[JUMPS] += 1
        left -= counts[p]
    return count - left


@part
def fly(beat, step, speed, wall, load, rotor, c_c, wave, flight, state, outs, sizes):
    """Jump over steps if no blade can touch for a while; return whether it did.

    A jump ends at the next row of evidence at the latest, and one step before a blade
    might touch, since contact requires the gaps of the two steps before it.

    Parameters
    ----------
    beat : steps between rows of evidence
    wall, load, state : `kernel_types.Wall`, `kernel_types.Load`, the march's state
    c_c, wave : coefficients of the ring's modes, packed; see `passes.to_gaps`
    flight, sizes : `wave_types.Flight`, `wave_types.Sizes`
    outs : out: spectra of the rotor's and the ring's part of the gaps, and of all gaps,
        (2 k,), m; rates of the gaps in folded order, (2 wide,), m/s
    """
    counter, (_, rows, ring_rows, k, wide) = state.counter, sizes
    out_b, out_c, spectrum, rates = outs
    if load.force != 0.0 and counter[STEP] * step < load.pulse:
        counter[NEXT_TRY] = int(load.pulse / step) + 1
        return False
    left = min(beat - counter[STEP] % beat, flight.total - counter[STEP])
    if left < 1:
        return False
    free = left
    if counter[CERTIFIED] < 0:
        free = look_ahead(
            step, speed, wall, rotor, c_c, wave, flight, state, spectrum, rates,
            rows, ring_rows, k, wide,
        )  # fmt: skip
    if counter[CERTIFIED] >= 0:
        leap(left, rotor, c_c, flight, state, out_b, out_c, rows, ring_rows, k)
        return True
    if free < SHORTEST:
        counter[PATIENCE] = min(max(2 * counter[PATIENCE], 2), LONGEST_PATIENCE)
        counter[NEXT_TRY] = counter[STEP] + counter[PATIENCE]
        return False
    counter[PATIENCE] = 0
    done = leap(
        min(free, left), rotor, c_c, flight, state, out_b, out_c, rows, ring_rows, k
    )
    counter[NEXT_TRY] = counter[STEP] + (done == free)
    for c in range(2 * k):
        spectrum[c] = out_b[c] + out_c[c]
    if is_shaped(wall):
        write_shape(wall, counter[STEP] * step, speed, spectrum)
    row = counter[STEP] % 3 * 2 * wide
    lowest = to_gaps_seldom(spectrum, wave, wall.gap, k, wide, state.gaps, row)
    if lowest < -state.ledger[MISS] * wall.gap:  # penetration, which bounds exclude
        state.ledger[MISS] = -lowest / wall.gap
    return True
