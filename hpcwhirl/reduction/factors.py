"""Direct solution of sparse linear systems: factors by LU, or Cholesky if installed.

Matrices are positive definite, such as the stiffness of a finite-element wheel.

A large matrix is factored by CHOLMOD (Chen et al. 2008, doi 10.1145/1391989.1391995; in
cvxopt) in the order of METIS's nested dissection (pymetis): for a massive solid this
factor has a quarter of the entries of SuperLU's factor, ordered by minimum degree.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from hpcwhirl.arrays import Integers, Matrix
from hpcwhirl.errors import ModelError

Solve = Callable[[Matrix], Matrix]
Tell = Callable[[str], None]
SMALL = 20_000  # number of unknowns up to which SuperLU is used
ROOM = 1e9  # bytes of a factor beyond which its size is reported
LIBRARIES = ("cvxopt", "pymetis")
UNHELD = "stiffness must hold every part while tips and centre are fixed; it is {}"


def factored(matrix: sparse.csc_array, tell: Tell) -> Solve:
    """Factor a matrix A; return a function from b to the solution x of A x = b.

    b and x are (n,) or (n, m).

    Parameters
    ----------
    matrix : A (n, n), symmetric or Hermitian, positive definite
    tell : called with a line of text before a large factor is made

    Raises
    ------
    ModelError
        where the matrix is singular
    """
    matrix.sum_duplicates()  # as `splu` does, in place: indices are shared below
    if matrix.shape[0] <= SMALL:
        return _lu(matrix).solve  # type: ignore[no-any-return]
    graph, node = _nodes(matrix)
    installed = all(map(find_spec, LIBRARIES))
    order = _dissected(graph) if installed else None
    size = matrix.dtype.itemsize * expected_fill(graph, node, order)
    if installed:
        size /= 2  # U is the transpose of L
    if size > ROOM:
        hint = (
            ""
            if installed
            else f"; a quarter of that after: pip install {' '.join(LIBRARIES)}"
        )
        tell(f"the factor of {len(node)} unknowns takes {size / 1e9:.1f} GB{hint}")
    if order is None:
        return _lu(matrix).solve  # type: ignore[no-any-return]
    return _cholesky(matrix, _of_unknowns(order, node))


def _nodes(matrix: sparse.csc_array) -> tuple[sparse.csc_array, Integers]:
    """Return which nodes of a sparse matrix are coupled, and each unknown's node, (n,).

    Unknowns that are coupled to the same unknowns, such as the DoF of a finite-element
    node, form one node. The coupling is returned as a graph, (nodes, nodes), a positive
    definite matrix with an entry -1 for each pair of coupled nodes.

    matrix : (n, n)
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
    """Estimate the number of nonzero entries of the factors L and U of a sparse matrix.

    It tells the memory that a factor needs, before it is made.

    Parameters
    ----------
    graph : (nodes, nodes), coupling of the matrix's nodes, see `_nodes`
    node : (n,), node of each unknown
    order : (nodes,), order in which nodes are eliminated; None: minimum degree
    """
    # relax: SuperLU fills up subtrees of this many columns; here columns are nodes
    ordered = graph if order is None else sparse.csc_array(graph[:, order][order])
    fill = _lu(ordered, order, relax=1).nnz
    return int(fill * (len(node) / graph.shape[0]) ** 2)


def _dissected(graph: sparse.csc_array) -> Integers:
    """Return the order in which METIS's nested dissection eliminates nodes, (nodes,).

    graph : (nodes, nodes), coupling of a matrix's nodes, see `_nodes`
    """
    import pymetis

    off_diagonal = sparse.csr_array(graph)
    off_diagonal.setdiag(0)
    off_diagonal.eliminate_zeros()
    joined = pymetis.CSRAdjacency(
        off_diagonal.indptr.astype(np.int32), off_diagonal.indices.astype(np.int32)
    )
    return np.array(pymetis.nested_dissection(joined)[0])


def _of_unknowns(order: Integers, node: Integers) -> Integers:
    """Return the elimination order of the n unknowns, (n,), from that of their nodes.

    Parameters
    ----------
    order : (nodes,), elimination order of the nodes
    node : (n,), node of each unknown
    """
    return np.argsort(np.argsort(order)[node], kind="stable")


def scaled_norm(matrix: sparse.csc_array) -> float:
    """Return the 1-norm of a matrix A scaled to unit diagonal.

    The scaled matrix is D^-1/2 A D^-1/2, D = diag A; A is `matrix`, (n, n).
    """
    scale = 1 / np.sqrt(matrix.diagonal().real)
    sizes = np.abs(matrix.data)
    sizes *= scale[matrix.indices]
    return float((scale * np.add.reduceat(sizes, matrix.indptr[:-1])).max())


def _lu(
    matrix: sparse.csc_array, order: Integers | None = None, relax: int | None = None
) -> Any:
    """Return SuperLU's factor of a matrix, `scipy.sparse.linalg.SuperLU`.

    Parameters
    ----------
    matrix : (n, n), symmetric or Hermitian
    order : elimination order in which rows and columns of the matrix already are;
        None: SuperLU orders them by minimum degree
    relax : see `scipy.sparse.linalg.splu`

    Raises
    ------
    ModelError
        where the matrix is singular
    """
    kind = {"permc_spec": "MMD_AT_PLUS_A" if order is None else "NATURAL"}
    options = {"SymmetricMode": True}
    try:
        return splu(matrix, diag_pivot_thresh=0.0, relax=relax, options=options, **kind)
    except RuntimeError as failed:
        if "singular" not in str(failed):
            raise
        raise ModelError(UNHELD.format("singular")) from None


def negative_pivots(matrix: sparse.csc_array) -> int | None:
    """Return the number of negative eigenvalues of a matrix (Sylvester's inertia).

    None where the factorization has exchanged rows, so that pivots do not count them.

    Raises
    ------
    ModelError
        where the matrix is singular
    """
    factor = _lu(matrix)
    if (factor.perm_r != factor.perm_c).any():
        return None
    return int(np.count_nonzero(factor.U.diagonal() < 0.0))


def _cholesky(matrix: sparse.csc_array, order: Integers) -> Solve:
    """Return a function from b to the solution x of A x = b, by Cholesky's factor of A.

    A = P^T L L^H P, where P permutes the unknowns to the elimination order.

    matrix, order : A (n, n); (n,), elimination order of the unknowns
    """
    from cvxopt import cholmod, spmatrix
    from cvxopt import matrix as dense

    half = sparse.coo_array(sparse.triu(matrix))
    # cvxopt takes integers of 64 bits
    places = (dense(x.astype(np.int64)) for x in half.coords)
    upper = spmatrix(dense(half.data), *places, matrix.shape)
    del half
    factor = cholmod.symbolic(upper, dense(order.astype(np.int64)), "U")
    try:
        cholmod.numeric(upper, factor)
    except ArithmeticError:
        raise ModelError(UNHELD.format("not positive definite")) from None

    def solve(b: Matrix) -> Matrix:
        cast = b.astype(matrix.dtype, casting="safe", copy=False)
        x = dense(cast.reshape(len(b), -1))
        cholmod.solve(factor, x)
        return np.array(x).reshape(b.shape)

    return solve
