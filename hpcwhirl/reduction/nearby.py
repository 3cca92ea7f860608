"""Lowest modes of a structure near one whose modes are known, by inverse iteration.

Subspace iteration (Bathe 2014, section 11.6) begins with the known modes and ends when
the modes are exact to round-off; the inertia of K - sigma M (Sylvester) proves that
none is missing.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.linalg import LinAlgError, eigh
from scipy.sparse.linalg import LinearOperator, eigsh

from hpcwhirl.arrays import Floats, Matrix
from hpcwhirl.reduction.factors import Solve, factored, negative_pivots

EXACT = 1e-10  # largest mass norm of x - omega^2 K^-1 M x of modes x of unit mass
MOST = 24  # steps of the iteration, after which dense matrices are quicker
ROUGH = 1e-6  # relative error of omega^2 of the modes from which iterations begin
SEED = 17  # of ARPACK's first vector, so that the same rotor has the same bits
APART = 1e-6  # least relative distance of omega^2 between kept modes and the next one


def rough_modes(mass: Matrix, stiffness: Matrix, count: int) -> Floats:
    """Return approximate lowest modes, (n, count), with which `modes_near` may begin.

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
    """Return omega^2 (count,) and shapes (n, count) of the lowest modes of a structure.

    Shapes are mass-orthonormal. None where the iteration does not converge or a mode
    might be missing.

    Parameters
    ----------
    matrices : M, K, (n, n), symmetric, K positive definite
    solve : x of K x = b
    near : (n, p), p > count: lowest modes of a similar structure
    count : number of modes wanted
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
    """Return whether no mode is missing among the lowest `count` of `squared`."""
    last, further = squared[count - 1 : count + 1]
    if further < (1 + APART) * last:
        return False
    shifted = matrices[1] - (last + further) / 2 * matrices[0]
    return negative_pivots(sparse.csc_array(shifted)) == count
