"""Motion of the centre in the static frame (Eq. 12): direction of whirl, section.

Forward means turning with Omega. At Omega = 0 there is no rotation to turn with, and
forward means anticlockwise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hpcwhirl.analysis.spectrum import full_spectrum
from hpcwhirl.arrays import Floats

FEWEST = 16  # samples below which an orbit has no direction


@dataclass(frozen=True)
class WhirlNumbers:
    """Evidence of whirl over a window of time; forward is positive.

    Attributes
    ----------
    ratio : (P+ - P-)/(P+ + P-) of the full spectrum, -1 to 1
    area_rate : signed area that the orbit sweeps about its mean per second, m^2/s
    line : frequency of the strongest line, rad/s
    radius : rms distance from the mean, m
    """

    ratio: float
    area_rate: float
    line: float
    radius: float


def static_frame(centre: Floats, angle: Floats) -> Floats:
    """Return the centre's motion in the static frame, Eq. (12).

    Parameters
    ----------
    centre : (n, 2), m, rotating frame: x_o, y_o
    angle : (n,), rad, Omega t

    Returns
    -------
    (n, 2), m, static frame: X_o, Y_o, i.e. Z = (x_o + i y_o) e^{i Omega t}
    """
    turned = (centre[:, 0] + 1j * centre[:, 1]) * np.exp(1j * angle)
    return np.column_stack([turned.real, turned.imag])


def whole_revolutions(time: Floats, speed: float) -> slice:
    """Return the slice of the samples' last whole revolutions.

    At speed 0, or if samples do not cover a revolution, the slice has all samples.
    """
    if speed == 0.0 or len(time) < 2:
        return slice(0, len(time))
    interval = time[1] - time[0]
    span = len(time) * interval
    if abs(speed) * span < 2 * np.pi:  # tested first, since 2 pi / speed may overflow
        return slice(0, len(time))
    revolution = 2 * np.pi / abs(speed)
    turns = np.floor(span / revolution)
    count = round(turns * revolution / interval)
    return slice(len(time) - count, len(time)) if count >= FEWEST else slice(0, None)


def whirl_numbers(time: Floats, centre: Floats, speed: float) -> WhirlNumbers:
    """Return the evidence of whirl of an orbit.

    Parameters
    ----------
    time : (n,), s, equally spaced
    centre : (n, 2), m, static frame
    speed : Omega, rad/s
    """
    part = whole_revolutions(time, speed)
    orbit = centre[part, 0] + 1j * centre[part, 1]
    count = len(orbit)
    if count < FEWEST:
        return WhirlNumbers(0.0, 0.0, 0.0, 0.0)
    orbit = orbit - np.add.reduce(orbit) / count  # `np.mean` takes twice as long
    radius = float(np.sqrt(np.add.reduce(np.abs(orbit) ** 2) / count))
    if not radius > 0.0:
        return WhirlNumbers(0.0, 0.0, 0.0, 0.0)
    sign = -1.0 if speed < 0 else 1.0
    interval = float(time[1] - time[0])
    scaled = orbit / radius  # squares of tiny orbits would be denormal
    omega, amplitude = full_spectrum(scaled, interval)
    power, turning = amplitude**2, sign * omega
    forward, backward = (
        np.add.reduce(power[direction]) for direction in (turning > 0, turning < 0)
    )
    areas = (scaled[:-1].conj() * scaled[1:]).imag
    swept = 0.5 * (np.add.reduce(areas) / len(areas)) / interval
    return WhirlNumbers(
        ratio=float((forward - backward) / (forward + backward)),
        area_rate=float(sign * swept * radius**2),
        line=float(sign * omega[np.argmax(power)]),
        radius=radius,
    )


def section(time: Floats, centre: Floats, speed: float) -> Floats:
    """Return the centre's position at whole revolutions, t = 2 pi m / |Omega|.

    Interpolates linearly between samples, which must be much closer than a revolution.

    Parameters
    ----------
    time : (n,), s, ascending
    centre : (n, 2), m, static frame
    speed : Omega, rad/s, not 0

    Returns
    -------
    (revolutions, 2), m, static frame; (0, 2) at speed 0 or if no revolution is complete
    """
    if speed == 0.0 or len(time) < 2:
        return np.zeros((0, 2))
    period = 2 * np.pi / abs(speed)
    first = np.ceil(time[0] / period - 1e-9)
    turns = period * np.arange(first, np.floor(time[-1] / period + 1e-9) + 1)
    turns = np.clip(turns, time[0], time[-1])
    return np.column_stack([np.interp(turns, time, axis) for axis in centre.T])
