"""Spectra of many speeds on one axis: speed-frequency maps and cascades."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


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
    """Return several spectra on one common axis, one column each.

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
