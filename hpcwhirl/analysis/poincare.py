"""Once-per-revolution section of the static-frame orbit (Poincare)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


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
