"""Craig-Bampton reduction (Eq. 1 of the paper) of large sparse matrices.

The boundary DoF, such as tips and centre, are kept; the interior ones are replaced by
static modes and the lowest fixed-interface modes, with the boundary held. With terms of
rotation the basis is extended so that it serves all speeds.
"""

from __future__ import annotations

import gc
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import sparse
from scipy.linalg import eigh, eigh_tridiagonal, solve
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh, onenormest

from hpcwhirl.arrays import Floats, Matrix
from hpcwhirl.errors import ModelError
from hpcwhirl.reduction.factors import Solve, Tell, factored, scaled_norm
from hpcwhirl.reduction.modes import REACH

Project = Callable[[], list[Any]]
RIGID = 1e-12  # omega^2, relative to the highest, up to which a mode counts as rigid
DENSE = 600  # number of unknowns up to which dense matrices and all modes are computed
MORE = 8  # modes computed beyond the number asked for
WORST = 1e14  # largest condition number; beyond it solutions are only round-off
RESIDUAL = 1e-7  # largest |x - omega^2 K^-1 M x| / |x| of a mode
SAME = 1e-6  # relative difference of omega^2 up to which modes may be the same one
PAIR = 1e-6  # relative difference of omega^2 of a pair, which is never split
LACKING = 1e-4  # share of a mode's energy that a basis for all speeds may lack
CLOSER = 2  # steps of inverse iteration that turn modes at rest into those at a speed
STEPS = 60  # steps of the Lanczos process that searches a negative eigenvalue
SEED = 17  # seed of starting vectors, so that the same file gives the same rotor


@dataclass(frozen=True)
class Condensed:
    """A reduced structure: b boundary DoF, then amplitudes of m fixed-interface modes.

    Attributes
    ----------
    mass, stiffness : (b + m + c, b + m + c), symmetric or Hermitian; the last c
        coordinates make the basis serve all speeds; c is 0 for a reduction at rest
    squared : (m,), ascending, omega^2 of the fixed-interface modes
    reach : omega^2 below which no mode is missing; infinite if all are kept
    condition : condition number of the scaled interior stiffness (1-norm, estimated)
    lift : (n, b + m + c), the basis; (0, b + m) if it was not kept, see `condensed`
    turning : reduced terms of rotation C, K_1 and, if any, K_2, see `modes.Spin`, of a
        basis that serves all speeds
    """

    mass: Matrix
    stiffness: Matrix
    squared: Floats
    reach: float
    condition: float
    lift: Matrix
    turning: tuple[Matrix, ...] = ()

    def lowest(self, count: int) -> Condensed:
        """Return this reduction at rest with only its lowest `count` modes.

        count : number of fixed-interface modes, at most m
        """
        size = len(self.mass) - len(self.squared) + count
        return replace(
            self,
            mass=self.mass[:size, :size],
            stiffness=self.stiffness[:size, :size],
            squared=self.squared[:count],
            reach=float(np.r_[self.squared, self.reach][count]),
            lift=self.lift[:, :size].copy(),
        )

    def loaded(self, load: Matrix) -> Matrix:
        """Return a load on the n DoF as a load on reduced coordinates, (b + m + c,).

        load : (n,), N, or N per unit of something
        """
        return np.asarray(self.lift.conj().T @ load)


def lowest_ritz(matrix: sparse.csr_array) -> float:
    """Return an upper bound of the lowest eigenvalue of a matrix A of unit diagonal.

    A is `matrix`, scaled to D^-1/2 A D^-1/2, D = diag A. A negative bound proves that
    it is not positive semidefinite. The bound is a Ritz value, computed by a
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
    """Return how many of the lowest modes to keep so that no pair is split, <= `most`.

    squared : (m,), ascending, omega^2 of the modes computed
    reach : omega^2 below which no mode is missing
    """
    further = np.r_[squared, reach]
    for count in range(min(most, len(squared)), 0, -1):
        if further[count] > (1 + PAIR) * further[count - 1]:
            return count
    return 0


def condensed(
    project: Project, boundary: int, count: int, tell: Tell, *, keep: bool = False
) -> Condensed:
    """Return the Craig-Bampton reduction at rest of a structure with sparse matrices.

    Parameters
    ----------
    project : function that returns [M, K], (n, n) sparse, symmetric or Hermitian,
        positive semidefinite, and the terms of rotation C, K_1, K_2, if any; called
        repeatedly, so that large matrices are not kept in memory together with a factor
    boundary : b, number of DoF that are kept, the first of the n
    count : number of fixed-interface modes wanted; some more are returned
    tell : called with a line of text before a large factor is made
    keep : whether to return the basis even if there are no terms of rotation

    Raises
    ------
    ModelError
        if parts of the interior have no stiffness when the boundary is held
    """
    mass, stiffness, *turning = project()
    if mass.shape[0] == boundary:
        whole = mass.toarray(), stiffness.toarray()
        return Condensed(*whole, np.zeros(0), np.inf, 1.0, np.eye(boundary))
    keep = keep or bool(turning)
    own = _interior(mass, stiffness, boundary)
    del mass, stiffness, turning
    lift, squared, reach, condition = _lift(*own, count, tell)
    del own
    # SciPy's ARPACK leaves its operator in a cycle of references, and with it
    # the factor: 1.1 GB instead of 0.25 over 12 diameters of 23,000 unknowns.
    if len(lift) - boundary > DENSE:  # else ARPACK does not run
        gc.collect()
    mass, stiffness, *_ = project()
    parts = _reduced(mass, lift), _reduced(stiffness, lift)
    if not keep:
        lift = np.zeros((0, lift.shape[1]))
    return Condensed(*parts, squared, reach, condition, lift)


def for_all_speeds(
    piece: Condensed, project: Project, speeds: Sequence[float], tell: Tell
) -> Condensed:
    """Return a reduction at rest extended to all speeds, with the terms of rotation.

    Parameters
    ----------
    piece : the reduction at rest, of the modes that are kept
    project, tell : parameters of `condensed`
    speeds : rad/s, speeds at which the basis is to be as good as at rest; empty: at
        `REACH` times the lowest natural frequency
    """
    mass, stiffness, *turning = project()
    lift = piece.lift
    boundary = lift.shape[1] - len(piece.squared)
    if lift.shape[1] < len(lift):
        for speed in speeds if len(speeds) else (_reference(piece),):
            taut = _taut(mass, stiffness, turning, speed)
            at = mass, taut, speed**2
            more = _lacking(lift, boundary, len(piece.squared), at, tell)
            lift = np.hstack([lift, more])
    signs = -1.0, *np.ones(len(turning) - 1)
    return replace(
        piece,
        mass=_reduced(mass, lift),
        stiffness=_reduced(stiffness, lift),
        lift=lift,
        turning=tuple(
            _reduced(a, lift, sign) for a, sign in zip(turning, signs, strict=True)
        ),
    )


def _reduced(matrix: Any, lift: Matrix, sign: float = 1.0) -> Matrix:
    """Return a matrix A in the coordinates of a basis T: T^H A T without round-off.

    Round-off is removed by taking the Hermitian or, with sign -1, skew-Hermitian part.

    matrix, lift : A, (n, n); T, (n, m)
    """
    whole = lift.conj().T @ (matrix @ lift)
    return np.asarray((whole + sign * whole.conj().T) / 2)


def _interior(mass: Any, stiffness: Any, boundary: int) -> tuple[Any, Any, Matrix]:
    """Return the parts K_ii, M_ii, K_ib of a structure's matrices.

    i are the interior DoF, b the boundary's.

    boundary : number of boundary DoF, which are the first ones
    """
    inside = slice(boundary, None)
    k_ii, m_ii = (sparse.csc_array(a[inside, inside]) for a in (stiffness, mass))
    return k_ii, m_ii, stiffness[inside, :boundary].toarray()


def _reference(piece: Condensed) -> float:
    """Return the speed, rad/s, at which a basis is extended to serve all speeds.

    It is `REACH` times the lowest natural frequency of the reduction `piece`.
    """
    squared = eigh(piece.stiffness, piece.mass, eigvals_only=True)
    return REACH * float(np.sqrt(squared[squared > RIGID * squared[-1]][0]))


def _taut(mass: Any, stiffness: Any, turning: list[Any], speed: float) -> Any:
    """Return a structure's stiffness at a speed, made positive definite.

    It is K(Omega) + Omega^2 M, which has the same modes as K(Omega).

    speed : Omega, rad/s
    turning : [C, K_1] or [C, K_1, K_2], terms of rotation, see `modes.Spin`
    """
    _, first, *second = turning
    taut = stiffness + speed**2 * (first + mass)
    for quartic in second:
        taut = taut + speed**4 * quartic
    return taut


def _lacking(
    lift: Matrix,
    boundary: int,
    count: int,
    matrices: tuple[Any, Any, float],
    tell: Tell,
) -> Matrix:
    """Return the shapes, (n, c), that a basis lacks to serve a speed, as new columns.

    They are 0 on the boundary.

    The modes x of the Craig-Bampton basis at that speed, by subspace iteration from the
    modes at rest, are approximated in the given basis with the least energy of the
    error e. By Rayleigh's quotient the ratio of that energy to that of x bounds the
    relative error of omega^2 at the speed. Parts of e whose energy is above `LACKING`
    times that of x are added, orthonormalised.

    Parameters
    ----------
    lift : the basis, (n, m), whose first b columns are unit motions of the boundary
    boundary : b, number of boundary DoF
    count : number of fixed-interface modes that the basis is to have at the speed
    matrices : M, K(Omega) + Omega^2 M, (n, n); Omega^2, (rad/s)^2
    tell : called with a line of text before a large factor is made
    """
    mass, taut, shift = matrices
    k_ii, m_ii, coupling = _interior(mass, taut, boundary)
    inverse, modes = factored(k_ii, tell), lift[boundary:, boundary:]
    near = modes[:, :count]
    for _ in range(CLOSER):
        near = _ritz(k_ii, m_ii, inverse(m_ii @ near))[1]
    other = _with_boundary(-inverse(coupling), near)
    del inverse, k_ii
    energy = taut + shift * mass  # definite, though a free wheel may translate
    squared, mix = eigh(_reduced(energy, other), _reduced(mass, other))
    shapes = other @ (mix / np.sqrt(squared))
    strain, inner = energy @ lift, _reduced(energy, lift)
    for _ in range(2):  # twice, since small parts have much round-off
        shapes = shapes - lift @ solve(inner, strain.conj().T @ shapes, assume_a="pos")
    part, mix = np.linalg.eigh(_reduced(energy, shapes))
    shapes = shapes @ mix[:, part > LACKING]
    shapes = (shapes - lift[:, :boundary] @ shapes[:boundary])[boundary:]
    more = np.zeros((len(lift), shapes.shape[1]), dtype=lift.dtype)
    more[boundary:] = _orthonormal(m_ii, modes, shapes)
    return more


def _orthonormal(m_ii: Any, modes: Matrix, shapes: Matrix) -> Matrix:
    """Return shapes made mass-orthonormal to modes and to each other, (i, c).

    m_ii, modes, shapes : M (i, i); (i, m), mass-orthonormal; (i, c)
    """
    for _ in range(2):
        shapes = shapes - modes @ (modes.conj().T @ (m_ii @ shapes))
        squared, mix = np.linalg.eigh(_reduced(m_ii, shapes))
        shapes = shapes @ (mix / np.sqrt(squared))
    return shapes


def _lift(
    k_ii: Any, m_ii: Any, coupling: Matrix, count: int, tell: Tell
) -> tuple[Matrix, Floats, float, float]:
    """Return the Craig-Bampton basis of a structure at rest, and how good it is.

    Returns static and fixed-interface modes, a column each; omega^2 of the latter;
    omega^2 below which no mode is missing; the condition number, see `Condensed`

    k_ii, m_ii, coupling : K_ii, M_ii of the interior DoF; K_ib to the boundary
    count : number of fixed-interface modes wanted; some more are returned
    tell : called with a line of text before a large factor is made
    """
    solve = factored(k_ii, tell)
    condition = _condition(k_ii, solve)
    if not condition <= WORST:
        raise ModelError(
            "stiffness must hold every part while tips and centre are fixed, got a "
            f"condition number of {condition:.1e} (at most {WORST:.0e})"
        )
    squared, modes, reach = _fixed_modes(k_ii, m_ii, solve, count)
    return _with_boundary(-solve(coupling), modes), squared, reach, condition


def _with_boundary(static: Matrix, modes: Matrix) -> Matrix:
    """Return a Craig-Bampton basis, (b + i, b + m), from its interior parts.

    The first b rows, of the boundary, are 1 in its static modes, 0 in other modes.

    static, modes : (i, b); (i, m), fixed-interface modes
    """
    boundary = static.shape[1]
    rows = np.eye(boundary, boundary + modes.shape[1])
    return np.vstack([rows, np.hstack([static, modes])])


def _condition(matrix: sparse.csc_array, solve: Solve) -> float:
    """Estimate the condition number (1-norm) of a matrix A scaled to unit diagonal.

    matrix, solve : A (n, n); function from b to x, A x = b
    """
    scale = np.sqrt(matrix.diagonal().real)

    def apply(x: Matrix) -> Matrix:
        x = (scale * np.ravel(x)).astype(matrix.dtype)
        return np.asarray(scale * solve(x))

    inverse = LinearOperator(matrix.shape, apply, rmatvec=apply, dtype=matrix.dtype)
    return float(scaled_norm(matrix) * onenormest(inverse))


def _fixed_modes(
    k_ii: sparse.csc_array, m_ii: sparse.csc_array, solve: Solve, count: int
) -> tuple[Floats, Matrix, float]:
    """Return a structure's lowest fixed-interface modes, some more than `count`.

    Returns omega^2, (m,), ascending; shapes, (i, m), mass-orthonormal; and omega^2
    below which no mode is missing, infinite if all modes are returned

    k_ii, m_ii, solve : K, M of the interior, (i, i); function from b to x, K x = b
    """
    size = k_ii.shape[0]
    if size <= DENSE or count + MORE >= size // 2:
        squared, modes = eigh(k_ii.toarray(), m_ii.toarray())
        most = min(count + MORE, size)
        reach = np.inf if most == size else float(squared[most])
        return squared[:most], modes[:, :most], reach
    modes = np.zeros((size, 0), dtype=k_ii.dtype)
    squared = np.zeros(0)
    wanted = count + MORE
    while True:  # Lanczos may miss a mode of a pair: search again beside those found
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
    """Return the lowest modes other than known ones, (n, wanted).

    They are computed by Lanczos's method for K^-1 M (ARPACK, shift-invert at 0).

    k_ii, m_ii, solve : K, M (n, n); function from b to x, K x = b
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
        msg = f"ARPACK did not find {wanted} fixed-interface modes of {size} unknowns"
        raise ModelError(msg) from None
    return np.asarray(new)


def _check(m_ii: Any, solve: Solve, squared: Floats, modes: Matrix) -> None:
    """Raise ModelError if fixed-interface modes do not satisfy x = omega^2 K^-1 M x.

    solve, squared : function from b to x, K x = b; omega^2 of each mode
    """
    miss = np.linalg.norm(modes - squared * solve(m_ii @ modes), axis=0)
    worst = float((miss / np.linalg.norm(modes, axis=0)).max())
    if not worst <= RESIDUAL:
        msg = "fixed-interface modes x must satisfy x = omega^2 K^-1 M x, got a "
        msg += f"relative error of {worst:.1e} (at most {RESIDUAL:.0e})"
        raise ModelError(msg)


def _quotients(k_ii: Any, m_ii: Any, modes: Matrix) -> Floats:
    """Return the Rayleigh quotient of each of m shapes, omega^2, (rad/s)^2, (m,).

    k_ii, m_ii, modes : K, M (n, n); (n, m), a shape in each column
    """
    strain, inertia = ((modes.conj() * (a @ modes)).sum(axis=0) for a in (k_ii, m_ii))
    return np.asarray(strain.real / inertia.real)


def _ritz(k_ii: Any, m_ii: Any, modes: Matrix) -> tuple[Floats, Matrix]:
    """Return the best approximations to modes that m shapes can be combined to.

    Returns Ritz values omega^2, (rad/s)^2, (m,), and Ritz vectors, (n, m), orthonormal
    by M

    k_ii, m_ii, modes : K, M (n, n); (n, m), a shape in each column
    """
    strain, inertia = (_reduced(a, modes) for a in (k_ii, m_ii))
    squared, mix = eigh(strain, inertia)
    return squared, modes @ mix
