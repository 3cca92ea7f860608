"""Solutions with a sparse positive definite matrix: LU, in single precision if large.

A large factor is kept in half the memory, single precision, and preconditions
conjugate gradients in double precision (flexible: Golub & Ye 1999, doi
10.1137/S1064827597323415), which end at the round-off of a double factor's solutions.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from hpcwhirl.errors import ModelError

Matrix = NDArray[Any]
Integers = NDArray[np.int64]
Solve = Callable[[Matrix], Matrix]
Tell = Callable[[str], None]
SURELY_SMALL = 20_000  # unknowns up to which nobody need count
ROOM = 2e9  # bytes of a factor in double precision, the most
HALF = {"d": np.float32, "D": np.complex64}
DONE = 1e-15  # of |A| |x| + |b|: what a double factor leaves
STEPS = 40  # of conjugate gradients from one true residual to the next
ROUNDS = 5  # true residuals


class _NotSolvedError(Exception):
    """Conjugate gradients do not get to `DONE`."""


def factored(matrix: sparse.csc_array, tell: Tell) -> Solve:
    """Return the solution of A x = b, b (n,) or (n, m), by a factor of A.

    Parameters
    ----------
    matrix : (n, n), symmetric or Hermitian, positive definite
    tell : called with a line before and when a large one is factored

    Raises
    ------
    ModelError
        where it is singular
    """
    matrix.sum_duplicates()  # as `splu` does, in place: indices are shared below
    if matrix.shape[0] <= SURELY_SMALL:
        return _lu(matrix).solve  # type: ignore[no-any-return]
    graph, node = _nodes(matrix)
    size = matrix.dtype.itemsize * expected_fill(graph, node)
    if size <= ROOM:
        return _lu(matrix).solve  # type: ignore[no-any-return]
    order, hint = _dissected(graph), "; half with: pip install pymetis"
    if order is not None:
        size, hint = matrix.dtype.itemsize * expected_fill(graph, node, order), ""
        order = np.argsort(np.argsort(order)[node], kind="stable")
    tell(
        f"the factor of {matrix.shape[0]} unknowns takes {size / 2e9:.1f} GB in single "
        f"precision, refined to double{hint}"
    )
    return _Refined(matrix, order, size, tell)


def _nodes(matrix: sparse.csc_array) -> tuple[sparse.csc_array, Integers]:
    """Return (definite matrix of the nodes' graph, node of each unknown).

    Unknowns that are joined to the same ones are one node.
    """
    names = np.random.default_rng(0).integers(1 << 62, size=matrix.shape[0])
    joined = np.add.reduceat(names[matrix.indices], matrix.indptr[:-1])
    _, first, node = np.unique(joined, return_index=True, return_inverse=True)
    ones = np.ones(matrix.nnz, dtype=np.float32)
    pattern = sparse.csc_array((ones, matrix.indices, matrix.indptr))
    graph = sparse.csc_array(pattern[:, first][first])
    graph.data[:] = -1.0
    graph.setdiag(np.diff(graph.indptr))
    return graph, node


def expected_fill(
    graph: sparse.csc_array, node: Integers, order: Integers | None = None
) -> int:
    """Return about how many numbers L and U have, by a factor of the nodes' graph."""
    # relax: SuperLU fills branches of so many columns, of nodes here
    fill = _lu(_ordered(graph, order), order, relax=1).nnz
    return int(fill * (len(node) / graph.shape[0]) ** 2)


def _dissected(graph: sparse.csc_array) -> Integers | None:
    """Return the order of METIS's nested dissection, if that is installed."""
    try:
        import pymetis
    except ImportError:
        return None
    apart = sparse.csr_array(graph)
    apart.setdiag(0)
    apart.eliminate_zeros()
    joined = pymetis.CSRAdjacency(
        apart.indptr.astype(np.int32), apart.indices.astype(np.int32)
    )
    return np.array(pymetis.nested_dissection(joined)[0])


def _ordered(matrix: sparse.csc_array, order: Integers | None) -> sparse.csc_array:
    return matrix if order is None else sparse.csc_array(matrix[:, order][order])


def scaled_norm(matrix: sparse.csc_array) -> float:
    """Return the 1-norm of D^-1/2 A D^-1/2, D = diag A."""
    scale = 1 / np.sqrt(matrix.diagonal().real)
    sizes = np.abs(matrix.data)
    sizes *= scale[matrix.indices]
    return float((scale * np.add.reduceat(sizes, matrix.indptr[:-1])).max())


def _lu(
    matrix: sparse.csc_array, order: Integers | None = None, relax: int | None = None
) -> Any:
    """Return the factor of a matrix, which may be in an order already."""
    kind = {"permc_spec": "MMD_AT_PLUS_A" if order is None else "NATURAL"}
    options = {"SymmetricMode": True}
    try:
        return splu(matrix, diag_pivot_thresh=0.0, relax=relax, options=options, **kind)
    except RuntimeError as failed:
        if "singular" not in str(failed):
            raise
        msg = "stiffness must hold every part once tips and centre are held: singular"
        raise ModelError(msg) from None


class _Refined:
    """A factor of S = D^-1/2 A D^-1/2, D = diag A, in single precision."""

    def __init__(
        self,
        matrix: sparse.csc_array,
        order: Integers | None,
        size: float,
        tell: Tell,
    ) -> None:
        self.matrix, self.size, self.tell = matrix, size, tell
        self.order = order
        self.scale = 1 / np.sqrt(matrix.diagonal().real)
        self.exact: Any = None
        self.half = HALF[matrix.dtype.char]
        self.norm = scaled_norm(matrix)
        try:
            self.factor = _lu(_ordered(self._scaled(), order), order)
        except ModelError:  # to seven digits
            self._double()

    def _scaled(self) -> sparse.csc_array:
        """Return S in single precision."""
        a = self.matrix
        values = a.data * self.scale[a.indices]
        values *= np.repeat(self.scale, np.diff(a.indptr))
        values = values.astype(self.half)
        return sparse.csc_array((values, a.indices, a.indptr), shape=a.shape)

    def _double(self) -> None:
        self.tell(
            "single precision does not carry this stiffness: factored in double "
            f"precision, {self.size / 1e9:.1f} GB"
        )
        self.factor = None
        self.exact = _lu(_ordered(self.matrix, self.order), self.order)

    def __call__(self, b: Matrix) -> Matrix:
        """Return x of A x = b."""
        b = np.asarray(b, dtype=self.matrix.dtype)
        if self.exact is None:
            try:
                return self._gradients(b.reshape(len(b), -1)).reshape(b.shape)
            except _NotSolvedError:
                self._double()
        return self._solved(self.exact, b)

    def _solved(self, factor: Any, b: Matrix) -> Matrix:
        if self.order is None:
            return np.asarray(factor.solve(b))
        x = np.empty_like(b)
        x[self.order] = factor.solve(b[self.order])
        return x

    def _times(self, x: Matrix) -> Matrix:
        d = self.scale[:, None]
        return np.asarray(d * (self.matrix @ (d * x)))

    def _inverse(self, r: Matrix) -> Matrix:
        """Return S^-1 r to seven digits."""
        near = self._solved(self.factor, (r / _largest(r)).astype(self.half))
        return np.asarray(near.astype(self.matrix.dtype) * _largest(r))

    def _gradients(self, b: Matrix) -> Matrix:
        """Return x of A x = b, (n, m), to `DONE`."""
        b = self.scale[:, None] * b
        size = _largest(b)  # squares of small numbers are 0
        b /= size
        y, r = np.zeros_like(b), b
        for _ in range(ROUNDS):
            y += self._descended(r, y, b)
            r = b - self._times(y)
            if (_norm(r) <= self._round_off(y, b)).all():
                return np.asarray(self.scale[:, None] * (size * y))
        raise _NotSolvedError

    def _round_off(self, y: Matrix, b: Matrix) -> Matrix:
        return np.asarray(DONE * (self.norm * _norm(y) + _norm(b)))

    def _descended(self, r: Matrix, y: Matrix, b: Matrix) -> Matrix:
        """Return what conjugate gradients add to y, all columns at once."""
        added = np.zeros_like(r)
        z = self._inverse(r)
        p, along = z, _dot(z, r)
        for _ in range(STEPS):
            q = self._times(p)
            step = _share(along, _dot(p, q))
            added += step * p
            new = r - step * q
            if (_norm(new) <= self._round_off(y + added, b) / 2).all():
                return added
            z = self._inverse(new)
            turned = _share(_dot(z, new - r), along)
            r, along = new, _dot(z, new)
            p = z + turned * p
            if not (np.isfinite(along).all() and (along >= 0).all()):
                raise _NotSolvedError
        return added


def _largest(a: Matrix) -> Matrix:
    """Return the largest size in each column, or 1 where there is none."""
    largest = np.abs(a).max(axis=0)
    return np.where(largest == 0, 1.0, largest)


def _dot(a: Matrix, b: Matrix) -> Matrix:
    return np.asarray((a.conj() * b).sum(axis=0).real)


def _norm(a: Matrix) -> Matrix:
    return np.asarray(np.linalg.norm(a, axis=0))


def _share(a: Matrix, b: Matrix) -> Matrix:
    """Return a / b; 0 where a column is solved."""
    return np.divide(a, b, out=np.zeros_like(a), where=b != 0)
