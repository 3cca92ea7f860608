"""Solutions with large factors: single precision, refined, is as good as double."""

import sys

import numpy as np
import pytest
from scipy import sparse

from hpcwhirl.errors import ModelError
from hpcwhirl.reduction import factors

NODE = np.array([[3.0, 1.0, 0.5], [1.0, 2.0, 0.3], [0.5, 0.3, 4.0]])
COUNTS = (9, 8, 7)


def lattice(held=0.01):
    """Return a block of nodes of three unknowns, joined to the next ones."""
    lines = [
        sparse.diags_array([1.0, 1.0, 1.0], offsets=[-1, 0, 1], shape=(n, n))
        for n in COUNTS
    ]
    near = sparse.kron(sparse.kron(lines[0], lines[1]), lines[2]).tocsr()
    graph = sparse.diags_array(near.sum(axis=1) + held) - near
    return sparse.csc_array(sparse.kron(graph, NODE))


def turned(matrix, rng):
    """Return a Hermitian matrix of the same eigenvalues."""
    phase = sparse.diags_array(np.exp(1j * rng.normal(size=matrix.shape[0])))
    return sparse.csc_array(phase @ matrix @ phase.conj())


@pytest.fixture(params=["degree", "dissected", "shuffled"])
def large(monkeypatch, request):
    """Let every factor be a large one, in several orders; return what is told."""
    if request.param == "dissected":
        pytest.importorskip("pymetis", reason="pip install pymetis")
    elif request.param == "degree":
        monkeypatch.setitem(sys.modules, "pymetis", None)
    else:
        order = np.random.default_rng(7).permutation(np.prod(COUNTS))
        monkeypatch.setattr(
            factors, "_dissected", lambda graph: order[: graph.shape[0]]
        )
    monkeypatch.setattr(factors, "SURELY_SMALL", 0)
    monkeypatch.setattr(factors, "ROOM", 0)
    return []


@pytest.mark.parametrize("kind", ["real", "hermitian"])
@pytest.mark.parametrize(("held", "close"), [(1e-2, 1e-11), (1e-5, 1e-8)])
def test_single_precision_refined_is_a_double_factor(large, kind, held, close):
    rng = np.random.default_rng(3)
    matrix = lattice(held)
    units = sparse.diags_array(10.0 ** rng.integers(-6, 7, matrix.shape[0]))
    matrix = sparse.csc_array(units @ matrix @ units * 1e9)
    if kind == "hermitian":
        matrix = turned(matrix, rng)
    truth = factors._lu(matrix)
    solve = factors.factored(matrix, large.append)
    b = rng.normal(size=(matrix.shape[0], 4)).astype(matrix.dtype)
    b[:, 2] = 0
    b[:, 3] *= 1e-200
    scale = units.diagonal()[:, None]  # each unknown by its unit
    for rhs in (b, b[:, :1].ravel()):
        got, wanted = solve(rhs), truth.solve(rhs)
        assert (got.dtype, got.shape) == (matrix.dtype, rhs.shape)
        got, wanted = (scale * x.reshape(len(b), -1) for x in (got, wanted))
        miss = np.abs(got - wanted).max(axis=0)
        assert (miss <= close * np.abs(wanted).max(axis=0)).all()
    assert len(large) == 1
    assert "single precision" in large[0]


@pytest.mark.parametrize("kind", ["real", "hermitian"])
def test_what_single_precision_does_not_carry_is_factored_in_double(
    large, kind, monkeypatch
):
    rng = np.random.default_rng(5)
    matrix = lattice(1e-6)
    monkeypatch.setattr(factors, "STEPS", 1)
    monkeypatch.setattr(factors, "ROUNDS", 1)
    if kind == "hermitian":
        matrix = turned(matrix, rng)
    solve = factors.factored(matrix, large.append)
    x = rng.normal(size=matrix.shape[0]).astype(matrix.dtype)
    got = solve(matrix @ x)
    left = np.abs(matrix @ (got - x)).max() / np.abs(matrix @ x).max()
    assert left < 1e-12
    assert [("in double precision" in line) for line in large] == [False, True]


def test_a_singular_matrix_is_one_line(large):
    matrix = lattice().tolil()
    matrix[-3:, :-3] = matrix[:-3, -3:] = 0  # a node that nothing else holds
    matrix[-3:, -3:] = 1.0
    with pytest.raises(ModelError, match="must hold every part"):
        factors.factored(sparse.csc_array(matrix), large.append)


@pytest.mark.parametrize("phases", [False, True])
def test_the_fill_is_known_before_a_factor_is_made(phases):
    matrix = lattice()
    known = factors._lu(matrix).nnz
    if phases:
        matrix = turned(matrix, np.random.default_rng(1))
    assert 0.8 < factors.expected_fill(*factors._nodes(matrix)) / known < 1.25


def test_a_small_factor_stays_in_double_precision():
    matrix = lattice()
    b = np.ones(matrix.shape[0])
    got = factors.factored(matrix, pytest.fail)(b)
    np.testing.assert_array_equal(got, factors._lu(matrix).solve(b))
