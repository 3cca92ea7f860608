"""How far each blade moves: amplitude, peak, localisation."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def blade_numbers(time: Floats, tips: Floats, start: float) -> dict[str, float]:
    """Return the numbers of `scene.quantities.BLADES`, {} of too few samples.

    The amplitude is an rms, which needs no sample at a crest and has no share of a
    steady deflection; for harmonic motions it is in the ratio of amplitudes. Blades at
    rest have 0, and move alike.

    Parameters
    ----------
    time : (n,), s
    tips : (n, N, 2), m, rotating frame: radial, tangential; (0, N, 2) for none
    start : s, from when on amplitudes are taken
    """
    if not len(tips):
        return {}
    late = time > start
    if late.sum() < 2:  # one sample has no amplitude
        return {}
    size = blade_amplitudes(tips[late])
    return {
        "blade_amplitude": float(size.max()),
        "blade_peak": float(np.sqrt((tips**2).sum(axis=2).max())),
        "localisation": localisation(size),
    }


def blade_amplitudes(tips: Floats) -> Floats:
    """Return the rms distance of each tip from its mean, (N,), m.

    Parameters
    ----------
    tips : (n, N, 2), m, rotating frame: radial, tangential
    """
    away = tips - tips.mean(axis=0)
    return np.asarray(np.sqrt((away**2).sum(axis=2).mean(axis=0)))


def localisation(size: Floats) -> float:
    """Return N sum a^4 / (sum a^2)^2 of amplitudes (N,): N over the blades that share.

    1 if all are alike, N if one moves alone; the inverse participation ratio of the
    energies, times N. A standing wave of the tuned wheel has 1.5.
    """
    largest = size.max()
    if not largest > 0.0:
        return 1.0
    energy = (size / largest) ** 2
    return float(len(size) * (energy**2).sum() / energy.sum() ** 2)
