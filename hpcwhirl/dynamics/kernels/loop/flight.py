"""How long a gap stays open: flights of the exact flow, in which no blade can touch.

If a bound A of the second derivative of every gap is known,

g_j(t) >= g_j + g_j' t - A t^2 / 2

is positive up to a time that is found for each blade, a prime being the derivative by
time. `slot_flights` has the bounds and the jumps.
"""

from __future__ import annotations

import math

from hpcwhirl.dynamics.kernels.compiled import kernel

SHORTEST = 4  # least number of steps for which a jump is made
LONGEST_PATIENCE = 32  # steps between two tries while blades are near
PASSES = 2  # largest number of jumps by tables that are combined
LESS = 1.0 - 1e-9  # factor on the clearance that covers round-off of the bounds


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
