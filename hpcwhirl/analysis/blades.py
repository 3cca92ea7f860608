"""Motion of the single blades: amplitude, peak, localisation."""

from __future__ import annotations

import numpy as np

from hpcwhirl.arrays import Floats


def blade_numbers(time: Floats, tips: Floats, start: float) -> dict[str, float]:
    """Return the blades' amplitude, peak and localisation; {} with one sample or none.

    The amplitude is the rms about the mean: it does not depend on whether a sample lies
    at a crest, and excludes a steady deflection; for harmonic motion it is proportional
    to the peak. Blades at rest have amplitude 0 and localisation 1.

    Parameters
    ----------
    time : (n,), s
    tips : (n, N, 2), m, rotating frame: radial, tangential; n = 0 without samples
    start : s, time from which amplitudes are taken
    """
    if not len(tips):
        return {}
    late = time > start
    if late.sum() < 2:  # one sample has no amplitude
        return {}
    size = blade_amplitudes(tips[late])
    return {
        "blade_amplitude": float(size.max()),
        "blade_peak": float(np.sqrt(_squares(tips).max())),
        "localisation": localisation(size),
    }


def blade_amplitudes(tips: Floats) -> Floats:
    """Return the rms distance of each tip from its mean, (N,), m.

    Parameters
    ----------
    tips : (n, N, 2), m, rotating frame: radial, tangential
    """
    away = tips - tips.mean(axis=0)
    return np.asarray(np.sqrt(_squares(away).mean(axis=0)))


def _squares(tips: Floats) -> Floats:
    """Return the squared magnitudes (n, N), m^2, of displacements (n, N, 2), m."""
    return np.asarray(tips[..., 0] ** 2 + tips[..., 1] ** 2)


def localisation(size: Floats) -> float:
    """Return the localisation N sum a^4 / (sum a^2)^2 of blade amplitudes a, (N,).

    This is N times the inverse participation ratio of the blades' energies: 1 if all
    blades have equal amplitudes, N if only one blade moves, 1.5 for a standing wave of
    a tuned wheel.
    """
    largest = size.max()
    if not largest > 0.0:
        return 1.0
    energy = (size / largest) ** 2
    return float(len(size) * (energy**2).sum() / energy.sum() ** 2)
