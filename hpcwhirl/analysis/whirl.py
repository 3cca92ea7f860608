"""Motion of the centre: static frame (Eq. 12), direction of whirl, spectra, section.

Forward means turning with Omega. At Omega = 0 there is no rotation to turn with, and
forward means anticlockwise. Spectra are those of a planar orbit, of a signal, and of
many speeds on a common axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.arrays import Complexes, Floats

MOST_KEPT = 8  # number of cached windows, 32 bytes per sample each
COLUMNS = 120  # largest number of spectra in a waterfall
TURNS = 8.0  # revolutions at the mean speed that each spectrum of a waterfall covers
FEWEST = 32  # least number of samples of a spectrum of a waterfall


def full_spectrum(orbit: Complexes, interval: float) -> tuple[Floats, Floats]:
    """Return the full spectrum of an orbit Z = X + i Y: amplitudes of both senses.

    Parameters
    ----------
    orbit : (n,), m, X + i Y at equal intervals of time, n >= 4
    interval : s between samples

    Returns
    -------
    omega : (n,), rad/s, ascending; > 0 turns anticlockwise
    amplitude : (n,), m: radius of the circle that each line represents (Hann window,
        mean removed)
    """
    count = len(orbit)
    window, total, order, number = _hann(count)
    centred = orbit - (window @ orbit) / total
    lines = np.fft.fft(window * centred)[order] / total
    omega = np.asarray(2 * np.pi * (number * (1.0 / (count * interval))))
    return omega, np.asarray(np.abs(lines))


@lru_cache(maxsize=MOST_KEPT)
def _hann(count: int) -> tuple[Floats, Any, NDArray[np.intp], NDArray[np.intp]]:
    """Return the Hann window for `count` samples, and how to sort the lines of an FFT.

    Returns
    -------
    Hann window, (count,); its sum; indices that sort the lines of an FFT by frequency,
    (count,); and the number of each sorted line, (count,), below 0 for frequencies < 0
    """
    # not scipy.signal's, whose import takes 0.4 s of every process's start
    window = 0.5 + 0.5 * np.cos(np.linspace(-np.pi, np.pi, count + 1)[:-1])
    each = np.arange(count)
    return window, window.sum(), np.fft.fftshift(each), each - count // 2


def amplitude_spectrum(signal: Floats, interval: float) -> tuple[Floats, Floats]:
    """Return the one-sided amplitude spectrum of a real signal.

    Parameters
    ----------
    signal : (n,), any unit, samples at equal intervals, n >= 4
    interval : s between samples

    Returns
    -------
    hertz : (n // 2 + 1,), Hz
    amplitude : (n // 2 + 1,), unit of the signal: peak amplitude of the sine that each
        line represents (Hann window, mean removed)
    """
    omega, lines = full_spectrum(signal.astype(np.complex128), interval)
    start = int(np.argmin(np.abs(omega)))
    hertz, amplitude = omega[start:] / (2 * np.pi), lines[start:].copy()
    amplitude[1:] *= 2.0
    return hertz, amplitude


def pooled(where: Floats, amplitude: Floats, edges: Floats) -> Floats:
    """Return the largest amplitude of a spectrum in each of m bins of frequency, (m,).

    So a figure with coarse bins loses no spectral line; a bin narrower than the
    spectrum's resolution takes the amplitude of the nearest line.

    Parameters
    ----------
    where : (n,), ascending, frequency of each spectral line, or its order, the ratio to
        the speed
    amplitude : (n,), amplitude of each spectral line, any unit
    edges : (m + 1,), ascending, edges of the bins, in the unit of `where`
    """
    middle = (edges[1:] + edges[:-1]) / 2
    nearest = np.clip(np.searchsorted(where, middle), 1, len(where) - 1)
    nearest -= middle - where[nearest - 1] < where[nearest] - middle
    out = amplitude[nearest].copy()
    bins = np.searchsorted(edges, where, side="right") - 1
    inside = (bins >= 0) & (bins < len(out))
    np.maximum.at(out, bins[inside], amplitude[inside])
    return np.asarray(out)


def cascade(spectra: Sequence[tuple[Floats, Floats]], edges: Floats) -> Floats:
    """Return several spectra on a common axis of m bins, for a picture over the speed.

    Parameters
    ----------
    spectra : spectrum at each speed: frequencies and amplitudes of its lines
    edges : (m + 1,), edges of the bins, in the unit of `where`

    Returns
    -------
    (m, len(spectra)), a column for each spectrum, in the unit of the amplitudes
    """
    return np.column_stack([pooled(w, a, edges) for w, a in spectra])


def spectra_over(
    time: Floats, orbit: Complexes, turn: float, most: int = COLUMNS
) -> tuple[Floats, Floats, Floats]:
    """Return full spectra of an orbit for overlapping parts of its time.

    Parameters
    ----------
    time : (n,), s, equally spaced
    orbit : (n,), m, X + i Y, static frame
    turn : s, duration of a revolution
    most : largest number of spectra

    Returns
    -------
    middles : (c,), s, middle of the part of `TURNS` revolutions of each spectrum
    omega : (f,), rad/s, ascending
    amplitude : (c, f), m
    """
    interval = float(time[1] - time[0])
    size = min(max(round(TURNS * turn / interval), FEWEST), len(time))
    first = np.unique(np.linspace(0, len(time) - size, most).astype(int))
    parts = [full_spectrum(orbit[i : i + size], interval) for i in first]
    middles = time[first] + 0.5 * (size - 1) * interval
    return middles, parts[0][0], np.stack([amplitude for _, amplitude in parts])


def after_revolutions(time: Floats, speed: float, revolutions: float) -> slice:
    """Return the slice of the samples that follow the first `revolutions` of a run.

    At speed 0 it has all samples.

    time, speed : (n,), s, time of each sample; Omega, rad/s
    """
    if speed == 0.0:
        return slice(0, None)
    start = revolutions * 2 * np.pi / abs(speed)
    return slice(int(np.searchsorted(time, start)), None)


FEWEST = 16  # samples below which an orbit has no direction


def sense_of(speed: float) -> float:
    """Return the sense that counts as forward: 1.0 anticlockwise, -1.0 clockwise.

    speed : Omega, rad/s; at 0 forward means anticlockwise
    """
    return -1.0 if speed < 0.0 else 1.0


@dataclass(frozen=True)
class WhirlNumbers:
    """Numbers of the centre's orbit over a window of time, static frame.

    They are the evidence of whirl; forward whirl is positive.

    Attributes
    ----------
    ratio : (P+ - P-)/(P+ + P-), P being the power of the forward and of the backward
        side of the full spectrum, -1 to 1
    area_rate : signed area that the orbit sweeps about its mean per second, m^2/s
    line : frequency of the strongest spectral line, rad/s
    radius : rms distance of the centre from its mean position, m
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
    """Return the slice of samples that covers the most whole revolutions, to the end.

    At speed 0, or if the samples do not cover a revolution, it has all samples.

    time, speed : (n,), s, at equal intervals; Omega, rad/s
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
    """Return the evidence of whirl, such as direction and radius, of an orbit.

    Of fewer than `FEWEST` samples it is the radius alone; all other numbers are 0.

    Parameters
    ----------
    time : (n,), s, equally spaced
    centre : (n, 2), m, static frame
    speed : Omega, rad/s
    """
    part = whole_revolutions(time, speed)
    orbit = centre[part, 0] + 1j * centre[part, 1]
    count = len(orbit)
    if count == 0:
        return WhirlNumbers(0.0, 0.0, 0.0, 0.0)
    orbit = orbit - np.add.reduce(orbit) / count  # `np.mean` takes twice as long
    radius = float(np.sqrt(np.add.reduce(np.abs(orbit) ** 2) / count))
    if count < FEWEST or not radius > 0.0:
        return WhirlNumbers(0.0, 0.0, 0.0, radius)
    sign = sense_of(speed)
    interval = float(time[1] - time[0])
    scaled = orbit / radius  # squares of tiny orbits would be denormal
    omega, amplitude = full_spectrum(scaled, interval)
    power, turning = amplitude**2, sign * omega
    forward, backward = (
        np.add.reduce(power[direction]) for direction in (turning > 0, turning < 0)
    )
    if count % 2 == 0:  # the line at half the sampling rate turns either way
        half = sign * power[0] / 2
        forward, backward = forward + half, backward - half
    areas = (scaled[:-1].conj() * scaled[1:]).imag
    swept = 0.5 * (np.add.reduce(areas) / len(areas)) / interval
    return WhirlNumbers(
        ratio=float((forward - backward) / (forward + backward)),
        area_rate=float(sign * swept * radius**2),
        line=float(sign * omega[np.argmax(power)]),
        radius=radius,
    )


def section(time: Floats, centre: Floats, speed: float) -> Floats:
    """Return the Poincaré section of an orbit: the centre's position once a revolution.

    The times are t = 2 pi m / |Omega|. Positions are interpolated linearly between
    samples, which must be much closer than a revolution.

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
