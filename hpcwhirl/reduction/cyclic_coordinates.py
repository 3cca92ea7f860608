"""Cyclic coordinates of N identical sectors (Eqs. 5 and 10 of the paper).

In complex form, Eq. (10) reads x_j = sqrt(2) Re(z e^{i k theta_j} / sqrt(N)), with
z = u^{k,c} - i u^{k,s}; for the simple harmonics (Eq. 5) there is no sqrt(2) Re. A
centre displacement belongs to k = 1 alone (Eq. 11), as z_o (e_x + i e_y) / sqrt(2).

Modes of equal frequency are separated into modes of one nodal diameter each.
If modes share a frequency, an eigensolver returns any basis of their space, in which
nodal diameters are mixed. A rotation of the rotor by one sector maps this space to
itself, so that it is the sum of one subspace per diameter: with the discrete Fourier
transform of the tips on diameter k, T_k, and G_k = T_k^H T_k, modes x of diameter k
solve

(sum_k k G_k) x = k (sum_k G_k) x.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hpcwhirl.arrays import Complexes, Floats, Indices, Integers
from hpcwhirl.structure import CyclicStructure


def diameters(sectors: int) -> range:
    """Return the nodal diameters that N = `sectors` equal sectors have: 0 .. N // 2."""
    return range(sectors // 2 + 1)


def is_simple(k: int, sectors: int) -> bool:
    """Return whether nodal diameter k is a simple harmonic (0, or N/2 for even N).

    A simple harmonic has single modes, standing waves; others have pairs.

    sectors : N
    """
    return 2 * k % sectors == 0


def wave(k: int, sectors: int) -> Complexes:
    """Return the wave e^{i k theta_j} / sqrt(N) of nodal diameter k, (N,).

    theta_j = 2 pi j / N is the angle of sector j; sectors : N
    """
    steps = k * np.arange(sectors) % sectors  # exact multiples: no drift of the phase
    return np.asarray(np.exp(2j * np.pi * steps / sectors) / np.sqrt(sectors))


def block(
    matrix: Floats, structure: CyclicStructure, k: int, *, skew: bool = False
) -> Complexes:
    """Return the part of a structure's matrix that acts on nodal diameter k.

    It is a Hermitian block in complex amplitudes z of one sector and of the centre.

    Parameters
    ----------
    matrix : (n, n), symmetric or, with `skew`, skew-symmetric
    structure : structure of equal sectors, of d DoF each
    k : nodal diameter
    skew : whether the matrix is skew-symmetric, and so its block skew-Hermitian

    Returns
    -------
    (d + c, d + c), with the c = `centre_width` centre coordinates last
    """
    d, sectors = structure.sector_size, structure.sectors
    rows = matrix[:d, : d * sectors].reshape(d, sectors, d)
    inner = np.einsum("asb,s->ab", rows, np.sqrt(sectors) * wave(k, sectors))
    extra = centre_width(structure, k)
    out = np.zeros((d + extra, d + extra), dtype=np.complex128)
    out[:d, :d] = inner
    hub = list(structure.centre)
    if extra == 1:
        x, y = hub
        out[:d, d] = np.sqrt(sectors / 2) * (matrix[:d, x] + 1j * matrix[:d, y])
        out[d, d] = (matrix[x, x] + matrix[y, y]) / 2
        out[d, d] += 1j * (matrix[x, y] - matrix[y, x]) / 2
    elif extra == 2:
        out[:d, d:] = np.sqrt(sectors) * matrix[:d, hub]
        out[d:, d:] = matrix[np.ix_(hub, hub)]
    sign = -1.0 if skew else 1.0
    out[d:, :d] = sign * out[:d, d:].conj().T
    return (out + sign * out.conj().T) / 2


def centre_width(structure: CyclicStructure, k: int) -> int:
    """Return how many coordinates of the centre nodal diameter k has (Eq. 11, paper).

    One complex displacement z_o for k = 1; the real x_o and y_o where one or two
    sectors make k = 1 a simple harmonic; none for any other k.
    """
    if not structure.centre or k != 1 % structure.sectors:
        return 0
    return 2 if is_simple(k, structure.sectors) else 1


def real_block(hermitian: Complexes, *, simple: bool) -> Floats:
    """Return the real symmetric form of a nodal diameter's Hermitian matrix H.

    Its coordinates are the real, then the imaginary parts of z = a + i b: the energy
    z^H H z is (a, b)^T [[Hr, -Hi], [Hi, Hr]] (a, b). The real form of a skew-Hermitian
    H is skew-symmetric.

    simple : whether the diameter is a simple harmonic, which has b = 0
    """
    if simple:
        return np.ascontiguousarray(hermitian.real)
    re, im = hermitian.real, hermitian.imag
    return np.block([[re, -im], [im, re]])


def spread(k: int, sectors: int) -> Floats:
    """Return how N sectors move in a DoF whose amplitude on nodal diameter k is 1.

    Returns
    -------
    (N, 1) for a simple harmonic, else (N, 2), real: orthonormal columns, the first for
    the real part a, the second for the imaginary part b of the amplitude z = a + i b
    """
    waves = wave(k, sectors)
    if is_simple(k, sectors):
        return waves.real[:, None]
    return np.asarray(np.sqrt(2) * np.column_stack([waves.real, -waves.imag]))


SAME = 1e-8  # relative difference of omega^2 up to which frequencies count as equal
ROUND_OFF = 1e-15  # an eigensolver's error of omega^2, relative to m times the largest
NEAR = 1e-3  # relative difference of omega of modes that a small asymmetry may mix
PURE = 0.99  # least share of one diameter in a mode that counts as unmixed
STILL = 1e-10  # squared tip motion, relative to the largest, that counts as 0


def diameter_shares(shapes: Floats, blades: int) -> Floats:
    """Return the share of each nodal diameter in the squared tip motion of m modes.

    Parameters
    ----------
    shapes : (n, m), the tips (radial, tangential of blade 0, 1, ...) first
    blades : N

    Returns
    -------
    (N // 2 + 1, m), which add up to 1 in each mode; 0 for a mode without tip motion
    """
    power = np.einsum("kmm->km", _grams(shapes, blades))
    return np.asarray(power / np.maximum(power.sum(axis=0), np.finfo(float).tiny))


def _grams(shapes: Floats, blades: int) -> Floats:
    """Return the Gram matrix of m modes' tip motion on each nodal diameter k.

    Returns G_k = T_k^H T_k, (N // 2 + 1, m, m), T_k being the discrete Fourier
    transform of the tips on k

    shapes, blades : (n, m), tips (radial, tangential of blade 0, 1, ...) first; N
    """
    tips = shapes[: 2 * blades].reshape(blades, 2, -1)
    waves = np.fft.fft(tips, axis=0)[: blades // 2 + 1]
    twice = [1.0 if is_simple(k, blades) else 2.0 for k in diameters(blades)]
    squared = np.einsum("kam,kan->kmn", waves.conj(), waves).real
    return np.asarray(np.array(twice)[:, None, None] * squared)


def runs(values: Floats, apart: Floats) -> Iterator[Indices]:
    """Yield the indices of values that lie close together, such as equal frequencies.

    Two successive values or more, each close to the one before it, form a run.

    values : (m,), ascending
    apart : (m,), largest difference of a value from the one before it in the same run
    """
    cuts = np.flatnonzero(np.diff(values) > apart[1:]) + 1
    for run in np.split(np.arange(len(values)), cuts):
        if len(run) > 1:
            yield run


def mixed(shapes: Floats, blades: int) -> bool:
    """Return whether any of m modes mixes nodal diameters in its tip motion.

    shapes, blades : (n, m), tips (radial, tangential of blade 0, 1, ...) first; N
    """
    power = np.einsum("kmm->km", _grams(shapes, blades))
    whole = power.sum(axis=0)
    moving = whole > STILL * max(float(whole.max()), np.finfo(float).tiny)
    return bool((power.max(axis=0)[moving] < PURE * whole[moving]).any())


def unmixed(
    shapes: Floats, blades: int, hub: Floats | None = None
) -> tuple[Floats, int]:
    """Return combinations of m modes of one frequency, each of a single nodal diameter.

    Parameters
    ----------
    shapes : (n, m), modes of one frequency, the tips first
    blades : N
    hub : (2, m), x_o and y_o, which count as tip motion of k = 1; None: do not count

    Returns
    -------
    columns : (m, m), orthogonal: combinations by diameter, those without tip motion
        last
    moving : number of combinations with tip motion
    """
    grams = _grams(shapes, blades)
    if hub is not None:
        grams[1] += blades * hub.T @ hub
    size, axes = np.linalg.eigh(grams.sum(axis=0))
    moving = size > STILL * size[-1]
    white = axes[:, moving] / np.sqrt(size[moving])
    weighed = np.tensordot(np.arange(len(grams)), grams, axes=1)
    diameter, inner = np.linalg.eigh(white.T @ weighed @ white)
    near = np.rint(diameter)
    parts = [
        np.linalg.svd(white @ inner[:, near == k])[0][:, : np.count_nonzero(near == k)]
        for k in np.unique(near)
    ]  # each orthonormal in itself
    left, _, right = np.linalg.svd(np.hstack([*parts, axes[:, ~moving]]))
    return np.asarray(left @ right), int(moving.sum())


def aligned(shapes: Floats, omega: Floats, blades: int) -> Floats:
    """Return mode shapes of a rotor, combined so that each has one nodal diameter.

    Only modes whose frequencies are equal to round-off are combined, so that the
    results are modes, too; others may keep several diameters.

    Parameters
    ----------
    shapes : (n, m), mass-orthonormal, the tips first
    omega : (m,), ascending
    blades : N
    """
    squared, out = omega**2, shapes.copy()
    same = SAME * squared + ROUND_OFF * len(omega) * squared.max()
    for run in runs(squared, same):
        if mixed(shapes[:, run], blades):
            out[:, run] = shapes[:, run] @ unmixed(shapes[:, run], blades)[0]
    return out


def dominant(shapes: Floats, omega: Floats, blades: int) -> Integers:
    """Return the nodal diameter that dominates the tip motion of each of m modes, (m,).

    Mixed modes of nearly one frequency get the diameters of their unmixed combinations
    (see `unmixed`), with which they are paired by the largest overlap.

    Parameters are those of `aligned`.
    """
    out = np.asarray(np.argmax(diameter_shares(shapes, blades), axis=0), dtype=np.int64)
    for run in runs(omega, NEAR * omega):
        if mixed(shapes[:, run], blades):
            out[run] = _assigned(shapes[:, run], out[run], blades)
    return out


def _assigned(shapes: Floats, first: Integers, blades: int) -> Integers:
    """Return nodal diameters for m modes of nearly one frequency, (m,), as labels.

    The modes are paired, by largest overlap, with combinations of them that have one
    diameter each; a mode gets the diameter of its combination. If the combination has
    no tip motion, the mode keeps its diameter in `first`.

    shapes : (n, m), tips first
    first : (m,), nodal diameter that dominates the tips of each mode
    blades : N
    """
    from scipy.optimize import linear_sum_assignment  # slow to import

    columns, moving = unmixed(shapes, blades)
    shares = diameter_shares(shapes @ columns, blades)
    _, paired = linear_sum_assignment(columns**2, maximize=True)
    diameter = np.argmax(shares, axis=0)[paired]
    return np.asarray(np.where(paired < moving, diameter, first), dtype=np.int64)
