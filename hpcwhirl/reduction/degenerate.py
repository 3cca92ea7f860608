"""Modes of one frequency and several nodal diameters: a basis of one diameter each.

Where modes share a frequency, any rotation among them is as good to an eigensolver, and
nodal diameters come mixed. Turning the rotor by a sector maps such a space to itself,
so that it is the sum of one space a diameter: with the discrete Fourier transform of
the tips on diameter k, T_k, and G_k = T_k^H T_k, the modes x of diameter k solve

(sum_k k G_k) x = k (sum_k G_k) x.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.reduction.cyclic import diameters, is_simple

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
SAME = 1e-8  # of omega^2: modes of one frequency, as the pairs of the modal table
ROUND_OFF = 1e-15  # of the largest omega^2: what an eigensolver tells no better
NEAR = 1e-3  # of omega: modes that a small asymmetry may have mixed
PURE = 0.99  # share of a diameter from which on a mode is not mixed
STILL = 1e-10  # of the largest squared tip motion: modes that the tips take no part in


def diameter_shares(shapes: Floats, blades: int) -> Floats:
    """Return the share of each nodal diameter in each mode's tips, (N // 2 + 1, m).

    Parameters
    ----------
    shapes : (n, m), the tips (radial, tangential of blade 0, 1, ...) first
    blades : N
    """
    power = np.einsum("kmm->km", _grams(shapes, blades))
    return np.asarray(power / np.maximum(power.sum(axis=0), np.finfo(float).tiny))


def _grams(shapes: Floats, blades: int) -> Floats:
    """Return G_k, (N // 2 + 1, m, m), of shapes (n, m), the tips first."""
    tips = shapes[: 2 * blades].reshape(blades, 2, -1)
    waves = np.fft.fft(tips, axis=0)[: blades // 2 + 1]
    twice = [1.0 if is_simple(k, blades) else 2.0 for k in diameters(blades)]
    squared = np.einsum("kam,kan->kmn", waves.conj(), waves).real
    return np.asarray(np.array(twice)[:, None, None] * squared)


def runs(values: Floats, apart: Floats) -> Iterator[NDArray[np.intp]]:
    """Yield the places of ascending values that follow one another within `apart`.

    values, apart : (m,); runs of one are left out
    """
    cuts = np.flatnonzero(np.diff(values) > apart[1:]) + 1
    for own in np.split(np.arange(len(values)), cuts):
        if len(own) > 1:
            yield own


def mixed(shapes: Floats, blades: int) -> bool:
    """Return whether a mode has tips of several nodal diameters."""
    power = np.einsum("kmm->km", _grams(shapes, blades))
    whole = power.sum(axis=0)
    moving = whole > STILL * max(float(whole.max()), np.finfo(float).tiny)
    return bool((power.max(axis=0)[moving] < PURE * whole[moving]).any())


def unmixed(
    shapes: Floats, blades: int, hub: Floats | None = None
) -> tuple[Floats, int]:
    """Return an orthogonal (m, m) whose columns mix modes to one diameter each.

    Parameters
    ----------
    shapes : (n, m), of one frequency, the tips first
    blades : N
    hub : (2, m), x_o and y_o, which belong to k = 1, where they count, too

    Returns
    -------
    columns : by diameter; those that leave the tips still come last
    moving : how many do not
    """
    grams = _grams(shapes, blades)
    if hub is not None:
        grams[1] += blades * hub.T @ hub
    size, axes = np.linalg.eigh(grams.sum(axis=0))
    moving = size > STILL * size[-1]
    white = axes[:, moving] / np.sqrt(size[moving])
    weighed = np.tensordot(np.arange(len(grams)), grams, axes=1)
    found, inner = np.linalg.eigh(white.T @ weighed @ white)
    near = np.rint(found)
    parts = [
        np.linalg.svd(white @ inner[:, near == k])[0][:, : np.count_nonzero(near == k)]
        for k in np.unique(near)
    ]  # each orthonormal in itself
    left, _, right = np.linalg.svd(np.hstack([*parts, axes[:, ~moving]]))
    return np.asarray(left @ right), int(moving.sum())


def aligned(shapes: Floats, omega: Floats, blades: int) -> Floats:
    """Return shapes of which each has one nodal diameter where frequencies allow it.

    Only modes that differ by round-off are mixed: they remain modes.

    Parameters
    ----------
    shapes : (n, m), mass-orthonormal, the tips first
    omega : (m,), ascending
    blades : N
    """
    squared, out = omega**2, shapes.copy()
    same = SAME * squared + ROUND_OFF * len(omega) * squared.max()
    for own in runs(squared, same):
        if mixed(shapes[:, own], blades):
            out[:, own] = shapes[:, own] @ unmixed(shapes[:, own], blades)[0]
    return out


def dominant(shapes: Floats, omega: Floats, blades: int) -> Integers:
    """Return the nodal diameter of each mode, (m,): the one that dominates its tips.

    Among modes of nearly one frequency that are mixed, each diameter is given as
    often as their space has it, to those that have most of it.

    Parameters: as of `aligned`
    """
    out = np.asarray(np.argmax(diameter_shares(shapes, blades), axis=0), dtype=np.int64)
    for own in runs(omega, NEAR * omega):
        if mixed(shapes[:, own], blades):
            out[own] = _given_once(shapes[:, own], out[own], blades)
    return out


def _given_once(shapes: Floats, first: Integers, blades: int) -> Integers:
    """Return diameters (m,), those of the unmixed modes, each given once."""
    from scipy.optimize import linear_sum_assignment  # slow to import

    columns, moving = unmixed(shapes, blades)
    shares = diameter_shares(shapes @ columns, blades)
    _, given = linear_sum_assignment(columns**2, maximize=True)
    own = np.argmax(shares, axis=0)[given]
    return np.asarray(np.where(given < moving, own, first), dtype=np.int64)
