"""Craig-Bampton reduction (Eq. 1) of large sparse matrices."""

from __future__ import annotations

import gc
from collections.abc import Callable
from dataclasses import dataclass, field
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
from hpcwhirl.reduction.craig_bampton import lacking, mass_norms
from hpcwhirl.reduction.factors import Solve, Tell, factored, scaled_norm
from hpcwhirl.reduction.modes import REACH

Matrix = NDArray[Any]
Floats = NDArray[np.float64]
Project = Callable[[], list[Any]]
RIGID = 1e-12  # omega^2 over the highest below which a mode may be rigid
DENSE = 600  # number of unknowns up to which dense matrices and all modes are computed
MORE = 8  # modes computed beyond the number asked for
WORST = 1e14  # largest condition number; beyond it solutions are only round-off
RESIDUAL = 1e-7  # largest |x - omega^2 K^-1 M x| / |x| of a mode
SAME = 1e-6  # relative difference of omega^2 up to which modes may be the same one
PAIR = 1e-6  # relative difference of omega^2 of a pair, which is never split
STEPS = 60  # steps of the Lanczos process that searches a negative eigenvalue
SEED = 17  # seed of starting vectors, so that the same file gives the same rotor


@dataclass(frozen=True)
class Condensed:
    """Reduced matrices in coordinates (boundary DoF, fixed-interface amplitudes).

    Attributes
    ----------
    mass, stiffness : (b + m, b + m), symmetric or Hermitian
    squared : (m,), ascending, omega^2 of the fixed-interface modes
    reach : omega^2 below which no mode is missing; infinite if all are kept
    condition : condition number of the scaled interior stiffness (1-norm, estimated)
    more : c, number of further coordinates, for a basis that serves all speeds
    turning : reduced C, K_1 and, if any, K_2
    lift : (n, b + m + c), the basis
    """

    mass: Matrix
    stiffness: Matrix
    squared: Floats
    reach: float
    condition: float
    more: int = 0
    turning: tuple[Matrix, ...] = ()
    lift: Matrix = field(default_factory=lambda: np.zeros((0, 0)))

    def kept(self, count: int) -> NDArray[np.intp]:
        """Return the coordinates with `count` of the fixed-interface modes."""
        size, modes = len(self.mass), len(self.squared)
        first = size - self.more - modes
        every = np.arange(size)
        return np.concatenate([every[: first + count], every[first + modes :]])

    def loaded(self, load: Matrix) -> Matrix:
        """Return the reduced form of a load (n,) on the projected coordinates."""
        return np.asarray(self.lift.conj().T @ load)


def lowest_ritz(matrix: sparse.csr_array) -> float:
    """Return an upper bound of the lowest eigenvalue of D^-1/2 A D^-1/2, D = diag A.

    A negative bound proves that A is not positive semidefinite. It is computed by a
    Lanczos process with full orthogonalization, which is exact for up to `STEPS`
    unknowns.
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


def whole_pairs(squared: Floats, reach: float, most: int) -> int:
    """Return the number of modes to keep, at most `most`, without splitting a pair.

    squared, reach : see `Condensed`
    """
    further = np.r_[squared, reach]
    for count in range(min(most, len(squared)), 0, -1):
        if further[count] > (1 + PAIR) * further[count - 1]:
            return count
    return 0


def condensed(project: Project, boundary: int, count: int, tell: Tell) -> Condensed:
    """Return the Craig-Bampton reduction to the first DoF and the lowest modes.

    Parameters
    ----------
    project : returns [mass, stiffness], (n, n) sparse, symmetric or Hermitian, positive
        semidefinite, and C, K_1, K_2, if any; called repeatedly, so that large matrices
        are not kept in memory together with a factor
    boundary : b, number of leading DoF that are kept
    count : fixed-interface modes wanted; some more are returned
    tell : called with a line of text before a large factor is made

    Raises
    ------
    ModelError
        if parts of the interior have no stiffness when the boundary is held
    """
    mass, stiffness, *turning = project()
    if mass.shape[0] == boundary:
        whole, *rest = (a.toarray() for a in (stiffness, *turning))
        kept = np.zeros(0), np.inf, 1.0, 0, tuple(rest), np.eye(boundary)
        return Condensed(mass.toarray(), whole, *kept)
    inside = slice(boundary, None)
    k_ii, m_ii = (sparse.csc_array(a[inside, inside]) for a in (stiffness, mass))
    coupling = stiffness[inside, :boundary].toarray()
    del mass, stiffness, turning
    lift, squared, reach, condition = _lift(k_ii, m_ii, coupling, count, tell)
    del k_ii, m_ii
    # SciPy's ARPACK leaves its operator in a cycle of references, and with it
    # the factor: 1.1 GB instead of 0.25 over 12 diameters of 23,000 unknowns.
    gc.collect()
    mass, stiffness, *turning = project()
    more = 0
    if turning:
        count = whole_pairs(squared, reach, len(squared))
        reach = float(np.r_[squared, reach][count])
        lift, squared = lift[:, : boundary + count], squared[:count]
        extra = _for_all_speeds(lift, boundary, (mass, stiffness, turning), count, tell)
        lift, more = np.hstack([lift, extra]), extra.shape[1]
    parts = _reduced(mass, lift), _reduced(stiffness, lift)
    added = tuple(
        _reduced(a, lift, -1.0 if place == 0 else 1.0)
        for place, a in enumerate(turning)
    )
    if not turning:
        return Condensed(*parts, squared, reach, condition)
    return Condensed(*parts, squared, reach, condition, more, added, lift)


def _reduced(matrix: Any, lift: Matrix, sign: float = 1.0) -> Matrix:
    """Return the Hermitian, or for sign -1 skew, part of T^H A T."""
    whole = lift.conj().T @ (matrix @ lift)
    return np.asarray((whole + sign * whole.conj().T) / 2)


def _for_all_speeds(
    lift: Matrix,
    boundary: int,
    matrices: tuple[Any, Any, list[Any]],
    count: int,
    tell: Tell,
) -> Matrix:
    """Return the columns (n, c) that a basis at rest lacks at speed, 0 on the boundary.

    They are `craig_bampton.lacking` of the basis at the speed `REACH` times the first
    frequency. Its fixed-interface modes are computed without the spin softening
    -Omega^2 M, which changes no shape of these modes, so that their stiffness matrix is
    positive definite.

    Parameters
    ----------
    lift : (n, b + m), the basis at rest
    boundary : b
    matrices : M, K and [C, K_1] or [C, K_1, K_2]
    count, tell : see `condensed`
    """
    mass, stiffness, (_, first, *second) = matrices
    slow = eigh(_reduced(stiffness, lift), _reduced(mass, lift), eigvals_only=True)
    square = REACH**2 * slow[slow > RIGID * slow[-1]][0]
    taut = stiffness + square * (first + mass)
    for quartic in second:
        taut = taut + square**2 * quartic
    inside = slice(boundary, None)
    k_ii, m_ii = (sparse.csc_array(a[inside, inside]) for a in (taut, mass))
    coupling = taut[inside, :boundary].toarray()
    other, squared, reach, _ = _lift(k_ii, m_ii, coupling, count, tell)
    other = other[:, : boundary + whole_pairs(squared, reach, count)]
    gc.collect()
    whole = mass_norms(mass, lift[:, :boundary])
    found = lacking(m_ii, lift[boundary:], other[boundary:], whole)
    return np.vstack([np.zeros((boundary, found.shape[1])), found])


def _lift(
    k_ii: Any, m_ii: Any, coupling: Matrix, count: int, tell: Tell
) -> tuple[Matrix, Floats, float, float]:
    """Return (static and fixed-interface modes, omega^2, reach, condition).

    The last three are those of `Condensed`.
    """
    solve = factored(k_ii, tell)
    condition = _condition(k_ii, solve)
    if not condition <= WORST:
        msg = (
            "stiffness must hold every part while tips and centre are fixed, got a "
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
    while True:  # Lanczos may miss a mode of a pair: repeat without known ones
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
    """Raise ModelError if modes do not satisfy x = omega^2 K^-1 M x."""
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
