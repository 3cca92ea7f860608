"""Spectra of many speeds on one axis: speed-frequency maps and cascades."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def pooled(where: Floats, amplitude: Floats, edges: Floats) -> Floats:
    """Return the largest amplitude in each bin; no line is lost to a coarse axis.

    Parameters
    ----------
    where, amplitude : (n,), a spectrum, ascending
    edges : (m + 1,), ascending, of the common axis

    Returns
    -------
    (m,); a bin narrower than the spectrum's resolution takes the nearest line's
    """
    middle = (edges[1:] + edges[:-1]) / 2
    nearest = np.clip(np.searchsorted(where, middle), 1, len(where) - 1)
    nearest -= middle - where[nearest - 1] < where[nearest] - middle
    out = amplitude[nearest].copy()
    place = np.searchsorted(edges, where, side="right") - 1
    inside = (place >= 0) & (place < len(out))
    np.maximum.at(out, place[inside], amplitude[inside])
    return np.asarray(out)


def cascade(spectra: Sequence[tuple[Floats, Floats]], edges: Floats) -> Floats:
    """Return spectra side by side on one axis.

    Parameters
    ----------
    spectra : (where, amplitude) of each speed
    edges : (m + 1,), in the unit of `where`

    Returns
    -------
    (m, len(spectra)), unit of the amplitudes
    """
    return np.column_stack([pooled(w, a, edges) for w, a in spectra])


def after_revolutions(time: Floats, speed: float, revolutions: float) -> slice:
    """Return the samples after so many revolutions; all of them at speed 0."""
    if speed == 0.0:
        return slice(0, None)
    start = revolutions * 2 * np.pi / abs(speed)
    return slice(int(np.searchsorted(time, start)), None)
