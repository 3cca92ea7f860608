"""Cyclic coordinates of N identical sectors (Eqs. 5 and 10 of the paper).

In complex form, Eq. (10) reads x_j = sqrt(2) Re(z e^{i k theta_j} / sqrt(N)), with
z = u^{k,c} - i u^{k,s}; for the simple harmonics (Eq. 5) there is no sqrt(2) Re. A
centre displacement belongs to k = 1 alone (Eq. 11), as z_o (e_x + i e_y) / sqrt(2).
"""

from __future__ import annotations

import numpy as np

from hpcwhirl.arrays import Complexes, Floats
from hpcwhirl.structure import CyclicStructure


def diameters(sectors: int) -> range:
    """Return the nodal diameters 0 .. N // 2."""
    return range(sectors // 2 + 1)


def is_simple(k: int, sectors: int) -> bool:
    """Return whether k is a simple harmonic (0, or N/2 for even N)."""
    return 2 * k % sectors == 0


def wave(k: int, sectors: int) -> Complexes:
    """Return the wave e^{i k theta_j} / sqrt(N) of nodal diameter k, (N,)."""
    steps = k * np.arange(sectors) % sectors  # exact multiples: no drift of the phase
    return np.asarray(np.exp(2j * np.pi * steps / sectors) / np.sqrt(sectors))


def block(
    matrix: Floats, structure: CyclicStructure, k: int, *, skew: bool = False
) -> Complexes:
    """Return the Hermitian block of a structure's matrix for nodal diameter k.

    Parameters
    ----------
    matrix : (n, n), symmetric or, with `skew`, skew-symmetric
    structure : structure of equal sectors
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
    """Return the number of centre coordinates in nodal diameter k (Eq. 11, paper).

    One complex displacement z_o for k = 1; the real x_o and y_o where one or two
    sectors make k = 1 a simple harmonic; none for any other k.
    """
    if not structure.centre or k != 1 % structure.sectors:
        return 0
    return 2 if is_simple(k, structure.sectors) else 1


def real_block(hermitian: Complexes, *, simple: bool) -> Floats:
    """Return the real symmetric form of a Hermitian block.

    With z = a + i b the energy z^H H z is (a, b)^T [[Hr, -Hi], [Hi, Hr]] (a, b);
    simple harmonics have b = 0. The real form of a skew block is skew.
    """
    if simple:
        return np.ascontiguousarray(hermitian.real)
    re, im = hermitian.real, hermitian.imag
    return np.block([[re, -im], [im, re]])


def spread(k: int, sectors: int) -> Floats:
    """Return the real orthonormal columns of nodal diameter k over the sectors.

    Returns
    -------
    (N, 1) for a simple harmonic, else (N, 2): columns for a and b of z = a + i b
    """
    waves = wave(k, sectors)
    if is_simple(k, sectors):
        return waves.real[:, None]
    return np.asarray(np.sqrt(2) * np.column_stack([waves.real, -waves.imag]))
