"""A casing that is not round: its departure from the circle, and the work of that.

The harmonics of the departure are fixed in the static frame. In the frame of the blades
harmonic h turns by e^{i h theta}, theta the angle of the rotor, and is added to the
slot (nodal diameter) of `cyclic` that has harmonic h of the ring.
"""

from __future__ import annotations

import math

from hpcwhirl.dynamics.kernels.compiled import inlined, kernel, part, rare
from hpcwhirl.dynamics.kernels.contact import angle_at


@inlined
def is_shaped(wall):
    """Return whether an undeformed casing departs from the circle.

    wall : `kernel_types.Wall`
    """
    return len(wall.orders) > 0


@kernel
def faded(wall, r, time):
    """Return the amplitudes (a, b), m, of harmonic number r of a casing's shape.

    The shape is a cos h theta + b sin h theta, outward. The amplitudes grow as e^{sigma
    t}, sigma = wall.growth[r], and are faded in over the time wall.rise[r], if that is
    not 0. Without fading, a time below 0 gives the same function, continued backward.

    wall, time : `kernel_types.Wall`; s
    """
    grown, ramp = 1.0, 1.0
    if wall.growth[r] != 0.0:
        grown = math.exp(wall.growth[r] * time)
    if wall.rise[r] > 0.0 and time < wall.rise[r]:
        ramp = 0.5 * (1.0 - math.cos(math.pi * time / wall.rise[r]))
    return wall.cosine[r] * grown * ramp, wall.sine[r] * grown * ramp


@kernel
def trace_shape(wall, times, out):
    """Add the harmonics of an undeformed casing's shape to a trace of the casing.

    wall, times : `kernel_types.Wall`; (n,), s, of the samples
    out : (n, H + 1, 2), m, in and out: cosine and sine part of harmonics 0 .. H, static
        frame
    """
    for n in range(len(times)):
        for r in range(len(wall.orders)):
            a, b = faded(wall, r, times[n])
            out[n, wall.orders[r], 0] += a
            out[n, wall.orders[r], 1] += b


@kernel
def shape_at(wall, time, angle):
    """Return how far an undeformed casing departs outward from the circle, m.

    wall, time : `kernel_types.Wall`; s, on which growth and fading in of the shape
        depend
    angle : rad, static frame
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

    It is the sum of -lambda dw/dt dt over blades where[:active], lambda their
    multipliers.

    The multipliers are those of the step that ends at `time`; they act at its start,
    where dw/dt, which includes the blade's motion past the shape, is the mean of the
    steps on both sides, as in central differences.

    push, where : multipliers, N, and numbers of the blades in contact
    blades, speed : N; Omega, rad/s
    time, step : s; dt, s
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
    """Add the shape of an undeformed casing at a time, m, to the spectrum of the gaps.

    wall : `kernel_types.Wall`
    time, speed : s; Omega, rad/s
    spectrum : (2 k,), m, in and out: re, then im of k slots, one for each nodal
        diameter, padded; rotating frame
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
    """Add the rate of a casing's shape, m/s, to the spectrum of the gaps' rates.

    It is the rate in the rotating frame of a shape that is fully faded in. Return a
    bound of the second derivative of the gap at every blade, m/s^2.

    time, speed : s; Omega, rad/s
    spectrum : (2 k,), m/s, in and out: re, then im of k slots, one for each nodal
        diameter, padded
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
