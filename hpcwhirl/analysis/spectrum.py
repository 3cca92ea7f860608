"""Spectra of a planar orbit, of a signal, and of many speeds on a common axis."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.arrays import Complexes, Floats

MOST_KEPT = 8  # number of cached windows, 32 bytes per sample each


def full_spectrum(orbit: Complexes, interval: float) -> tuple[Floats, Floats]:
    """Return the two-sided amplitude spectrum of Z = X + i Y.

    Parameters
    ----------
    orbit : (n,), m, equally spaced, n >= 4
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
    """Return the Hann window and the order of spectral lines for `count` samples.

    Returns
    -------
    Hann window (count,), its sum, the order that sorts lines of an FFT by frequency,
    and the number of each sorted line, (count,), negative for negative frequencies
    """
    # not scipy.signal's, whose import takes 0.4 s of every process's start
    window = 0.5 + 0.5 * np.cos(np.linspace(-np.pi, np.pi, count + 1)[:-1])
    each = np.arange(count)
    return window, window.sum(), np.fft.fftshift(each), each - count // 2


def amplitude_spectrum(signal: Floats, interval: float) -> tuple[Floats, Floats]:
    """Return the one-sided amplitude spectrum of a real signal.

    Parameters
    ----------
    signal : (n,), e.g. m, equally spaced, n >= 4
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


def strongest(
    where: Floats, amplitude: Floats, low: float, high: float
) -> tuple[float, float]:
    """Return (frequency, amplitude) of the strongest line in [low, high].

    Return (nan, 0) if no line lies there.

    Parameters
    ----------
    where, amplitude : (n,), frequencies and amplitudes of a spectrum
    low, high : limits, in the unit of `where`
    """
    inside = np.flatnonzero((where >= low) & (where <= high))
    if not len(inside):
        return float("nan"), 0.0
    top = inside[np.argmax(amplitude[inside])]
    return float(where[top]), float(amplitude[top])


def pooled(where: Floats, amplitude: Floats, edges: Floats) -> Floats:
    """Return the largest amplitude of a spectrum in each bin of an axis, (m,).

    A coarse axis loses no spectral line; a bin narrower than the spectrum's resolution
    takes the amplitude of the nearest line.

    Parameters
    ----------
    where : (n,), ascending, frequencies or orders of the spectrum
    amplitude : (n,)
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
    """Return several spectra on a common axis of bins, one column for each spectrum.

    Parameters
    ----------
    spectra : (where, amplitude) of each speed, see `pooled`
    edges : (m + 1,), edges of the bins, in the unit of `where`

    Returns
    -------
    (m, len(spectra)), in the unit of the amplitudes
    """
    return np.column_stack([pooled(w, a, edges) for w, a in spectra])


def after_revolutions(time: Floats, speed: float, revolutions: float) -> slice:
    """Return the slice of samples after a number of revolutions; all at speed 0."""
    if speed == 0.0:
        return slice(0, None)
    start = revolutions * 2 * np.pi / abs(speed)
    return slice(int(np.searchsorted(time, start)), None)
