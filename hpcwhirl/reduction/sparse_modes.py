"""Craig-Bampton reduction (Eq. 1) of large sparse matrices."""

from __future__ import annotations

import gc
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import eigh, eigh_tridiagonal
from scipy.sparse.linalg import (
    ArpackNoConvergence,
    LinearOperator,
    eigsh,
    onenormest,
)

from hpcwhirl.errors import ModelError
from hpcwhirl.reduction.factors import Solve, Tell, factored, scaled_norm

Matrix = NDArray[Any]
Floats = NDArray[np.float64]
Project = Callable[[], list[Any]]
DENSE = 600  # unknowns up to which all modes are computed, with dense matrices
MORE = 8  # modes computed beyond those asked for
WORST = 1e14  # largest condition number; beyond it solutions are round-off
RESIDUAL = 1e-7  # largest |x - omega^2 K^-1 M x| / |x| of a mode
SAME = 1e-6  # relative difference of omega^2 up to which modes are copies of one
STEPS = 60  # of the Lanczos process that looks for a negative eigenvalue
SEED = 17  # of starting vectors, so that the same file gives the same rotor


@dataclass(frozen=True)
class Condensed:
    """Reduced matrices in coordinates (boundary DoF, fixed-interface amplitudes).

    Attributes
    ----------
    mass, stiffness : (b + m, b + m), symmetric or Hermitian
    squared : (m,), ascending, omega^2 of the fixed-interface modes
    reach : omega^2 below which no mode is missing; infinite if all are kept
    condition : condition number of the scaled interior stiffness (1-norm, estimated)
    """

    mass: Matrix
    stiffness: Matrix
    squared: Floats
    reach: float
    condition: float


def lowest_ritz(matrix: sparse.csr_array) -> float:
    """Return an upper bound of the lowest eigenvalue of D^-1/2 A D^-1/2, D = diag A.

    A negative bound proves that A is not positive semidefinite. By a Lanczos process
    with full orthogonalization, exact for up to `STEPS` unknowns.
    """
    scale = 1 / np.sqrt(matrix.diagonal())
    size = len(scale)
    steps = min(STEPS, size)
    basis = np.zeros((steps, size))
    diagonal, off_diagonal = np.zeros(steps), np.zeros(steps)
    new = np.random.default_rng(SEED).normal(size=size)
    for j in range(steps):
        off_diagonal[j] = np.linalg.norm(new)
        if j and off_diagonal[j] <= size * np.finfo(float).eps:  # an invariant subspace
            steps = j
            break
        basis[j] = new / off_diagonal[j]
        new = scale * (matrix @ (scale * basis[j]))
        diagonal[j] = basis[j] @ new
        for _ in range(2):
            new -= basis[: j + 1].T @ (basis[: j + 1] @ new)
    values = eigh_tridiagonal(
        diagonal[:steps], off_diagonal[1:steps], eigvals_only=True
    )
    return float(values[0])


def condensed(project: Project, boundary: int, count: int, tell: Tell) -> Condensed:
    """Return the Craig-Bampton reduction to the first DoF and the lowest modes.

    Parameters
    ----------
    project : returns [mass, stiffness], (n, n) sparse, symmetric or Hermitian, positive
        semidefinite; called twice, so as not to hold large ones together with a factor
    boundary : b, number of leading DoF that are kept
    count : fixed-interface modes wanted; some more are returned
    tell : called with a line of text before a large factor is made

    Raises
    ------
    ModelError
        where the interior has parts without stiffness when the boundary is held
    """
    mass, stiffness = project()
    if mass.shape[0] == boundary:
        return Condensed(mass.toarray(), stiffness.toarray(), np.zeros(0), np.inf, 1.0)
    inside = slice(boundary, None)
    k_ii, m_ii = (sparse.csc_array(a[inside, inside]) for a in (stiffness, mass))
    coupling = stiffness[inside, :boundary].toarray()
    del mass, stiffness
    lift, squared, reach, condition = _lift(k_ii, m_ii, coupling, count, tell)
    del k_ii, m_ii
    # SciPy's ARPACK leaves its operator in a cycle of references, and with it
    # the factor: 1.1 GB instead of 0.25 over 12 diameters of 23,000 unknowns.
    gc.collect()
    parts = [_hermitian(lift.conj().T @ (a @ lift)) for a in project()]
    return Condensed(parts[0], parts[1], squared, reach, condition)


def _lift(
    k_ii: Any, m_ii: Any, coupling: Matrix, count: int, tell: Tell
) -> tuple[Matrix, Floats, float, float]:
    """Return (static and fixed-interface modes, omega^2, reach, condition).

    The last three as in `Condensed`.
    """
    solve = factored(k_ii, tell)
    condition = _condition(k_ii, solve)
    if not condition <= WORST:
        msg = (
            "stiffness must hold every part once tips and centre are held, got a "
            f"condition number of {condition:.1e} (at most {WORST:.0e})"
        )
        raise ModelError(msg)
    squared, modes, reach = _fixed_modes(k_ii, m_ii, solve, count)
    boundary = coupling.shape[1]
    lift = np.zeros((len(modes) + boundary, boundary + len(squared)), dtype=modes.dtype)
    lift[:boundary, :boundary] = np.eye(boundary)
    lift[boundary:, :boundary] = -solve(coupling)
    lift[boundary:, boundary:] = modes
    return lift, squared, reach, condition


def _hermitian(matrix: Matrix) -> Matrix:
    return np.asarray((matrix + matrix.conj().T) / 2)


def _condition(matrix: sparse.csc_array, solve: Solve) -> float:
    """Return the 1-norm condition number of D^-1/2 A D^-1/2, D = diag A."""
    scale = np.sqrt(matrix.diagonal().real)

    def apply(x: Matrix) -> Matrix:
        x = (scale * np.ravel(x)).astype(matrix.dtype)
        return np.asarray(scale * solve(x))

    inverse = LinearOperator(matrix.shape, apply, rmatvec=apply, dtype=matrix.dtype)
    return float(scaled_norm(matrix) * onenormest(inverse))


def _fixed_modes(
    k_ii: sparse.csc_array, m_ii: sparse.csc_array, solve: Solve, count: int
) -> tuple[Floats, Matrix, float]:
    """Return (omega^2 (m,), modes (n, m), reach) of the lowest modes, none missing."""
    size = k_ii.shape[0]
    if size <= DENSE or count + MORE >= size // 2:
        squared, modes = eigh(k_ii.toarray(), m_ii.toarray())
        most = min(count + MORE, size)
        reach = np.inf if most == size else float(squared[most])
        return squared[:most], modes[:, :most], reach
    modes = np.zeros((size, 0), dtype=k_ii.dtype)
    squared = np.zeros(0)
    wanted = count + MORE
    while True:  # a Lanczos process may miss a twin: repeat it without the known modes
        new = _lowest(k_ii, m_ii, solve, (squared, modes), wanted)
        if len(squared):
            low = float(_quotients(k_ii, m_ii, new).min())
            if low >= squared[-1] * (1 - SAME):
                _check(m_ii, solve, squared, modes)
                return squared, modes, low
        modes = np.hstack([modes, new])
        squared, modes = _ritz(k_ii, m_ii, modes)
        wanted = 1


def _lowest(
    k_ii: Any, m_ii: Any, solve: Solve, known: tuple[Floats, Matrix], wanted: int
) -> Matrix:
    """Return the lowest modes (n, wanted) except known ones, by shift-invert at 0.

    known : omega^2 (m,) and modes (n, m) computed before
    """
    squared, modes = known
    size = k_ii.shape[0]

    def apply(x: Matrix) -> Matrix:
        x = np.ravel(x).astype(k_ii.dtype)
        return np.asarray(solve(x) - modes @ ((modes.conj().T @ x) / squared))

    inverse = LinearOperator(k_ii.shape, apply, dtype=k_ii.dtype)
    start = np.random.default_rng(SEED + len(squared)).normal(size=size)
    start = start.astype(k_ii.dtype)
    try:
        _, new = eigsh(k_ii, wanted, m_ii, sigma=0.0, OPinv=inverse, v0=start)
    except ArpackNoConvergence:
        msg = f"ARPACK found no {wanted} fixed-interface modes of {size} unknowns"
        raise ModelError(msg) from None
    return np.asarray(new)


def _check(m_ii: Any, solve: Solve, squared: Floats, modes: Matrix) -> None:
    """Raise ModelError where modes do not satisfy x = omega^2 K^-1 M x."""
    miss = np.linalg.norm(modes - squared * solve(m_ii @ modes), axis=0)
    worst = float((miss / np.linalg.norm(modes, axis=0)).max())
    if not worst <= RESIDUAL:
        msg = f"fixed-interface modes miss x = omega^2 K^-1 M x by {worst:.1e}"
        raise ModelError(msg)


def _quotients(k_ii: Any, m_ii: Any, modes: Matrix) -> Floats:
    """Return the Rayleigh quotient of each column."""
    strain, inertia = ((modes.conj() * (a @ modes)).sum(axis=0) for a in (k_ii, m_ii))
    return np.asarray(strain.real / inertia.real)


def _ritz(k_ii: Any, m_ii: Any, modes: Matrix) -> tuple[Floats, Matrix]:
    """Return Ritz values omega^2 and M-orthonormal modes of the columns' space."""
    strain, inertia = (_hermitian(modes.conj().T @ (a @ modes)) for a in (k_ii, m_ii))
    squared, mix = eigh(strain, inertia)
    return squared, modes @ mix
