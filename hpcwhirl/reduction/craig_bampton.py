"""Craig-Bampton component mode synthesis (Eq. 1 of the paper).

A structure's boundary DoF are kept; the interior ones are replaced by static modes,
which follow the boundary, and by the lowest fixed-interface modes, with the boundary
held.

Fixed-interface modes of a structure near one whose modes are known are found by inverse
iteration: subspace iteration (Bathe 2014, section 11.6) begins with the known modes and
ends when the modes are exact to round-off; the inertia of K - sigma M (Sylvester)
proves that none is missing.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import LinAlgError, eigh
from scipy.sparse.linalg import LinearOperator, eigsh

from hpcwhirl.arrays import Floats, Indices, Matrix
from hpcwhirl.errors import ModelError
from hpcwhirl.reduction.factors import Solve, factored, negative_pivots

TOLERANCE = 1e-9  # largest error of mass-orthonormality
MOST_KEPT = 8  # number of cached patterns, some 100 kB each
NEW = 1e-3  # least mass norm of the part of a unit-mass shape that a basis lacks


def craig_bampton(
    mass: Matrix,
    stiffness: Matrix,
    boundary: Indices,
    eta: int,
    near: Matrix | None = None,
) -> tuple[Matrix, Matrix]:
    """Return the Craig-Bampton basis Phi_CB of a structure, Eq. (1), and frequencies.

    x = Phi_CB (x_b, q_CB): x are all displacements, x_b those of the boundary, q_CB the
    amplitudes of the fixed-interface modes.

    Parameters
    ----------
    mass, stiffness : M, K (n, n), symmetric or Hermitian
    boundary : (b,), indices of the boundary DoF, which are kept
    eta : number of fixed-interface modes kept, the lowest
    near : (n - b, more than eta), lowest fixed-interface modes of a similar structure,
        from which an iteration starts: with real, sparse matrices it is faster, and its
        modes are the same to round-off; None: no iteration

    Returns
    -------
    Phi_CB : (n, b + eta): static modes, then mass-orthonormal fixed-interface modes
    omega : (eta,), rad/s, of the fixed-interface modes

    Raises
    ------
    ModelError
        if the modes are not mass-orthonormal to 1e-9
    """
    size, kept = len(mass), len(boundary)
    inner = np.setdiff1d(np.arange(size), boundary)
    basis = np.zeros((size, kept + eta), dtype=mass.dtype)
    basis[boundary, np.arange(kept)] = 1.0
    coupling = stiffness[np.ix_(inner, boundary)]
    m_ii: Any
    if near is None:
        k_ii, m_ii = stiffness[np.ix_(inner, inner)], mass[np.ix_(inner, inner)]
        basis[inner, :kept], found = -np.linalg.solve(k_ii, coupling), None
    else:
        k_ii, m_ii = _within(stiffness, inner), _within(mass, inner)
        solve = factored(k_ii, print)
        basis[inner, :kept] = -solve(coupling)
        found = modes_near((m_ii, k_ii), solve, near, eta) if eta else None
        if found is None:
            k_ii, m_ii = k_ii.toarray(), m_ii.toarray()
    if eta == 0:
        return basis, np.zeros(0)
    squared, modes = found or eigh(k_ii, m_ii, subset_by_index=(0, eta - 1))
    basis[inner, kept:] = modes
    kept_modes = basis[inner, kept:]
    miss = np.abs(kept_modes.conj().T @ m_ii @ kept_modes - np.eye(eta)).max()
    if not miss < TOLERANCE:
        msg = "fixed-interface modes must be mass-orthonormal, got an error of "
        msg += f"{miss:.1e} (at most {TOLERANCE:.0e})"
        raise ModelError(msg)
    return basis, np.sqrt(np.maximum(squared, 0.0))


class _Pattern(NamedTuple):
    """Where a dense matrix (n, n), and its submatrix of interior DoF, are not zero.

    It is kept, so that submatrices of engines with zeros in the same places are made
    sparse quickly.

    Attributes
    ----------
    places : (c,), flat indices of the c nonzero entries of the matrix
    inner : (d,), flat indices of the d entries that belong to the submatrix, column by
        column
    indices, pointers : (d,), row indices, and column pointers of the submatrix as a
        compressed sparse column array
    """

    places: Indices
    inner: Indices
    indices: NDArray[np.int32]
    pointers: NDArray[np.int32]


# {(n, number of nonzero entries, interior DoF): pattern} of the `MOST_KEPT` last
# matrices; engines that differ only in mistuning have the same pattern
_patterns: dict[tuple[int, int, bytes], _Pattern] = {}


def _within(matrix: Matrix, inner: Indices) -> sparse.csc_array:
    """Return the submatrix of interior DoF, (i, i), of a dense matrix, sparse.

    matrix, inner : (n, n); (i,), indices of the interior DoF
    """
    key = len(matrix), int(np.count_nonzero(matrix)), inner.tobytes()
    kept = _patterns.get(key)
    if kept is None or not matrix.take(kept.places).all():  # other places, same number
        kept = _patterns[key] = _pattern_of(matrix, inner)
        if len(_patterns) > MOST_KEPT:
            del _patterns[next(iter(_patterns))]
    shape = len(inner), len(inner)
    values = matrix.take(kept.inner), kept.indices, kept.pointers
    return sparse.csc_array(values, shape)


def _pattern_of(matrix: Matrix, inner: Indices) -> _Pattern:
    places = np.flatnonzero(matrix)
    numbers = np.arange(1, len(places) + 1), np.divmod(places, len(matrix))
    own = sparse.csc_array(numbers, matrix.shape)[inner][:, inner]
    own.sort_indices()
    return _Pattern(places, places[own.data - 1], own.indices, own.indptr)


def enriched(mass: Matrix, basis: Matrix, other: Matrix, boundary: Indices) -> Matrix:
    """Return a Craig-Bampton basis with c more columns, to serve a second stiffness.

    `basis` belongs to one stiffness matrix, `other` to another one, such as those at
    rest and at speed. The result approximates the modes for both, and for those
    between. Boundary coordinates stay physical. Added are the differences of the static
    modes (scaled to unit mass of the static mode) and the fixed-interface modes of
    `other`, without their parts in the span of the fixed-interface modes of `basis`,
    orthonormalised. Parts whose mass norm is below `NEW` are left out.

    Parameters
    ----------
    mass : (n, n), of the structure
    basis, other : (n, b + eta), results of `craig_bampton`
    boundary : (b,) DoF kept

    Returns
    -------
    (n, b + eta + c), `basis` first
    """
    inner, kept = np.setdiff1d(np.arange(len(mass)), boundary), len(boundary)
    m_ii = mass[np.ix_(inner, inner)]
    static, modes = basis[inner, :kept], basis[inner, kept:]
    # static modes of a reduced body may have little mass inside
    least = NEW * _mass_norms(mass, basis[:, :kept])
    size = np.maximum(_mass_norms(m_ii, static), least)
    change = (other[inner, :kept] - static) / np.where(size > 0.0, size, 1.0)
    more = np.hstack([change, other[inner, kept:]])
    for _ in range(2):  # twice, since small parts have much round-off
        more = more - modes @ (modes.conj().T @ (m_ii @ more))
    gram = more.conj().T @ (m_ii @ more)
    squared, mixed = np.linalg.eigh((gram + gram.conj().T) / 2)
    new = squared > NEW**2
    out = np.zeros((len(mass), int(new.sum())), dtype=basis.dtype)
    out[inner] = (more @ mixed[:, new]) / np.sqrt(squared[new])
    return np.hstack([basis, out])


def _mass_norms(mass: Matrix, shapes: Matrix) -> Matrix:
    """Return the mass norm sqrt(x^H M x) of each of c shapes x, (c,).

    mass, shapes : M (n, n); (n, c), a shape in each column
    """
    return np.asarray(np.sqrt((shapes.conj() * (mass @ shapes)).sum(axis=0).real))


EXACT = 1e-10  # largest mass norm of x - omega^2 K^-1 M x of modes x of unit mass
MOST = 24  # steps of the iteration, after which dense matrices are quicker
ROUGH = 1e-6  # relative error of omega^2 of the modes from which iterations begin
SEED = 17  # of ARPACK's first vector, so that the same rotor has the same bits
APART = 1e-6  # least relative distance of omega^2 between kept modes and the next one


def rough_modes(mass: Matrix, stiffness: Matrix, count: int) -> Floats:
    """Return approximate lowest modes of a structure, (n, count), mass-orthonormal.

    They are good enough to begin the iteration of `modes_near` for similar structures.

    mass, stiffness : (n, n), n > count, dense arrays with few entries other than 0
    """
    solve = factored(sparse.csc_array(stiffness), print)
    operator = LinearOperator(mass.shape, matvec=solve, dtype=mass.dtype)
    first = np.random.default_rng(SEED).normal(size=len(mass))
    matrices = (sparse.csc_array(a) for a in (stiffness, mass))
    given = dict(zip(("A", "M"), matrices, strict=True))
    return np.asarray(
        eigsh(k=count, sigma=0.0, OPinv=operator, v0=first, tol=ROUGH, **given)[1]
    )


def modes_near(
    matrices: tuple[sparse.csc_array, sparse.csc_array],
    solve: Solve,
    near: Floats,
    count: int,
) -> tuple[Floats, Matrix] | None:
    """Return a structure's lowest modes by iteration from those of a similar one.

    Returns omega^2, (rad/s)^2, (count,), and mass-orthonormal shapes, (n, count); None
    where the iteration does not converge or a mode might be missing

    Parameters
    ----------
    matrices : M, K, (n, n), symmetric, K positive definite
    solve : function from b to x, K x = b
    near : (n, p), p > count: lowest modes of a similar structure
    count : number of modes to compute
    """
    mass, shapes = matrices[0], near
    squared = np.zeros(near.shape[1])
    for _ in range(MOST):
        loads = mass @ shapes
        ahead = solve(loads)
        miss = (shapes - ahead * squared)[:, :count]
        if (miss * (mass @ miss)).sum(axis=0).max() < EXACT**2:
            lowest = squared[:count], shapes[:, :count]
            return lowest if _is_complete(matrices, squared, count) else None
        try:
            squared, mixed = eigh(_even(ahead.T @ loads), _even(ahead.T @ mass @ ahead))
        except LinAlgError:  # shapes that are not independent
            return None
        shapes = ahead @ mixed
    return None


def _even(matrix: Floats) -> Floats:
    return np.asarray((matrix + matrix.T) / 2)


def _is_complete(
    matrices: tuple[sparse.csc_array, sparse.csc_array], squared: Floats, count: int
) -> bool:
    """Return whether no mode is missing among the lowest `count` modes that were found.

    matrices : M, K, (n, n), of the structure
    squared : omega^2 of the modes found, ascending, more than `count` of them
    """
    last, further = squared[count - 1 : count + 1]
    if further < (1 + APART) * last:
        return False
    shifted = matrices[1] - (last + further) / 2 * matrices[0]
    return negative_pivots(sparse.csc_array(shifted)) == count
