"""Full spectrum of a planar orbit: forward and backward lines apart."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


def full_spectrum(orbit: Complexes, interval: float) -> tuple[Floats, Floats]:
    """Return the two-sided amplitude spectrum of Z = X + i Y.

    Parameters
    ----------
    orbit : (n,), m, equally spaced, n >= 4
    interval : s between samples

    Returns
    -------
    omega : (n,), rad/s, ascending; > 0 turns anticlockwise
    amplitude : (n,), m: radius of the circle each line stands for (Hann window,
        mean removed)
    """
    # scipy.signal has it, too, for 0.4 s of every process's start
    window = 0.5 + 0.5 * np.cos(np.linspace(-np.pi, np.pi, len(orbit) + 1)[:-1])
    centred = orbit - (window @ orbit) / window.sum()
    lines = np.fft.fftshift(np.fft.fft(window * centred)) / window.sum()
    omega = 2 * np.pi * np.fft.fftshift(np.fft.fftfreq(len(orbit), interval))
    return omega, np.abs(lines)


def amplitude_spectrum(signal: Floats, interval: float) -> tuple[Floats, Floats]:
    """Return the one-sided amplitude spectrum of a real signal.

    Parameters
    ----------
    signal : (n,), e.g. m, equally spaced, n >= 4
    interval : s between samples

    Returns
    -------
    hertz : (n // 2 + 1,), Hz
    amplitude : (n // 2 + 1,), unit of the signal: peak amplitude of the sine each line
        stands for (Hann window, mean removed)
    """
    omega, lines = full_spectrum(signal.astype(np.complex128), interval)
    start = int(np.argmin(np.abs(omega)))
    hertz, amplitude = omega[start:] / (2 * np.pi), lines[start:].copy()
    amplitude[1:] *= 2.0
    return hertz, amplitude


def strongest(
    where: Floats, amplitude: Floats, low: float, high: float
) -> tuple[float, float]:
    """Return (place, amplitude) of the strongest line in [low, high]; (nan, 0) if none.

    Parameters
    ----------
    where, amplitude : (n,), of a spectrum
    low, high : in the unit of `where`
    """
    inside = np.flatnonzero((where >= low) & (where <= high))
    if not len(inside):
        return float("nan"), 0.0
    top = inside[np.argmax(amplitude[inside])]
    return float(where[top]), float(amplitude[top])
