"""How many numbers the factor of a massive solid sector has.

    python scripts/evidence/fill.py [NODES NODES NODES]

Takes a block of bricks of 27 nodes (39 x 39 x 21 nodes unless told), factors the
matrix that joins its nodes as `import-model` does, and with the order of METIS's nested
dissection where `pymetis` is installed. A node's three unknowns fill nine numbers for
one of the nodes' matrix.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

BYTES = 16  # of a complex number


def joined(counts: tuple[int, ...]) -> sparse.csr_array:
    """Return the matrix -1 between nodes of a brick, definite."""
    place = np.arange(np.prod(counts)).reshape(counts)
    begin = np.stack(np.meshgrid(*(range(0, n - 2, 2) for n in counts)), -1)
    bricks = np.array(
        [
            place[i : i + 3, j : j + 3, k : k + 3].ravel()
            for i, j, k in begin.reshape(-1, 3)
        ]
    )
    pairs = np.repeat(bricks, 27, axis=1).ravel(), np.tile(bricks, (1, 27)).ravel()
    graph = sparse.csr_array((np.ones(pairs[0].size), pairs), shape=[place.size] * 2)
    graph.data[:] = -1.0
    return sparse.csr_array(graph + sparse.diags_array(1.0 - graph.sum(axis=1)))


def tell(name: str, matrix: sparse.csr_array, order: str) -> None:
    """Factor and print the fill of three unknowns a node."""
    start, options = time.process_time(), {"SymmetricMode": True}
    factor = splu(
        matrix.tocsc(), permc_spec=order, diag_pivot_thresh=0.0, options=options
    )
    fill, spent = 9 * factor.nnz, time.process_time() - start
    print(f"{name}: {fill / 1e6:.0f} million numbers in L and U, ", end="")
    print(f"{fill * BYTES / 1e9:.2f} GB complex; {spent:.1f} s for the nodes alone")


def main() -> None:
    """Print the fill by both orders."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument(
        "nodes", nargs="*", type=int, default=(39, 39, 21), metavar="NODES"
    )
    nodes = parser.parse_args().nodes
    if len(nodes) != 3 or min(nodes) < 3 or not all(n % 2 for n in nodes):
        parser.error(f"NODES must be three odd numbers from 3, got {nodes}")
    matrix = joined(tuple(nodes))
    print(f"{3 * matrix.shape[0]} unknowns")
    tell("minimum degree", matrix, "MMD_AT_PLUS_A")
    try:
        import pymetis
    except ImportError:
        print("nested dissection: needs pip install pymetis")
        return
    apart = sparse.csr_array(matrix - sparse.diags_array(matrix.diagonal()))
    apart.eliminate_zeros()
    graph = pymetis.CSRAdjacency(apart.indptr, apart.indices)
    order = np.array(pymetis.nested_dissection(graph)[0])
    tell("nested dissection", matrix[order][:, order], "NATURAL")


if __name__ == "__main__":
    main()
