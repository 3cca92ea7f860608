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
    from scipy.signal import windows  # half a second that `--help` need not wait

    window = windows.hann(len(orbit), sym=False)
    centred = orbit - (window @ orbit) / window.sum()
    lines = np.fft.fftshift(np.fft.fft(window * centred)) / window.sum()
    omega = 2 * np.pi * np.fft.fftshift(np.fft.fftfreq(len(orbit), interval))
    return omega, np.abs(lines)
