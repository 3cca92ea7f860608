"""A casing that is not round: its departure from the circle at each blade.

The harmonics are fixed in the static frame. In the frame of the blades harmonic h turns
by e^{i h theta}, theta the angle of the rotor, and is added to the slot of `cyclic`
that has harmonic h of the ring.
"""

from __future__ import annotations

import math

from hpcwhirl.dynamics.kernels.compiled import inlined, kernel, part, rare
from hpcwhirl.dynamics.kernels.contact import angle_at


@inlined
def is_shaped(wall):
    """Return whether a casing departs from the circle without elastic displacement."""
    return len(wall.orders) > 0


@kernel
def faded(wall, r, time):
    """Return the amplitudes (a, b), m, of the r-th harmonic of a casing's shape.

    They grow as e^{sigma t}, sigma = wall.growth[r], and are faded in over the time
    wall.rise[r], if that is not 0. Without it, a time below 0 gives the same function,
    continued backward.
    """
    grown, ramp = 1.0, 1.0
    if wall.growth[r] != 0.0:
        grown = math.exp(wall.growth[r] * time)
    if wall.rise[r] > 0.0 and time < wall.rise[r]:
        ramp = 0.5 * (1.0 - math.cos(math.pi * time / wall.rise[r]))
    return wall.cosine[r] * grown * ramp, wall.sine[r] * grown * ramp


@kernel
def trace_shape(wall, times, out):
    """Add the harmonics of a casing's shape at some times to out (n, H + 1, 2), m.

    times : (n,), s; out has the cosine and sine part of harmonics 0 .. H
    """
    for n in range(len(times)):
        for r in range(len(wall.orders)):
            a, b = faded(wall, r, times[n])
            out[n, wall.orders[r], 0] += a
            out[n, wall.orders[r], 1] += b


@kernel
def shape_at(wall, time, angle):
    """Return the outward departure from the circle at an angle, static frame, m.

    time : s, on which growth and fading in of the shape depend
    """
    total = 0.0
    for r in range(len(wall.orders)):
        a, b = faded(wall, r, time)
        turned = wall.orders[r] * angle
        total += a * math.cos(turned) + b * math.sin(turned)
    return total


@rare
def carried_by_shape(push, where, active, blades, wall, speed, time, step):
    """Return the work of a casing's shape w on the blades in contact in a step, J.

    It is the sum of -lambda dw/dt dt over blades where[:active], lambda the multipliers
    `push`.

    The multipliers are those of the step that ends at `time`; they act at its start,
    where dw/dt, which includes the blade's motion past the shape, is the mean of the
    steps on both sides, as in central differences.
    """
    total = 0.0
    for s in range(active):
        place = 2.0 * math.pi * where[s] / blades
        ahead = shape_at(wall, time, angle_at(wall, speed, time) + place)
        since = time - 2.0 * step
        back = shape_at(wall, since, angle_at(wall, speed, since) + place)
        total -= 0.5 * push[s] * (ahead - back)
    return total


@part
def write_shape(wall, time, speed, spectrum):
    """Add the casing's shape at `time`, m, to the spectrum (2 k,) of the gaps.

    There are k slots, one for each nodal diameter, padded.

    time, speed : s; Omega, rad/s
    """
    turned, half = angle_at(wall, speed, time) % (2.0 * math.pi), len(spectrum) // 2
    for r in range(len(wall.orders)):
        angle = wall.orders[r] * turned
        a, b = faded(wall, r, time)
        cos, sin = math.cos(angle), math.sin(angle)
        spectrum[wall.slots[r]] += a * cos + b * sin
        spectrum[half + wall.slots[r]] += wall.signs[r] * (a * sin - b * cos)


@rare
def write_rates(wall, time, speed, spectrum):
    """Add the rate of a casing's shape, fully faded in, to the spectrum (2 k,), m/s.

    Return a bound of the second derivative at every blade, m/s^2. There are k slots,
    one for each nodal diameter, padded.

    time, speed : s; Omega, rad/s
    """
    turned, half, bend = (speed * time) % (2.0 * math.pi), len(spectrum) // 2, 0.0
    for r in range(len(wall.orders)):
        angle, rate = wall.orders[r] * turned, wall.orders[r] * speed
        a, b = faded(wall, r, time)
        cos, sin = math.cos(angle), math.sin(angle)
        spectrum[wall.slots[r]] += rate * (b * cos - a * sin)
        spectrum[half + wall.slots[r]] += wall.signs[r] * rate * (a * cos + b * sin)
        bend += rate * rate * math.hypot(a, b)
    return bend
