"""Solutions with large factors are those of SuperLU, whatever is installed."""

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


@pytest.fixture(params=["installed", *factors.LIBRARIES])
def large(monkeypatch, request):
    """Let every factor be a large one, by one library less; return what is told."""
    missing = request.param
    if missing == "installed":
        for name in factors.LIBRARIES:
            pytest.importorskip(name, reason=f"pip install {name}")
    monkeypatch.setitem(sys.modules, missing, None)
    monkeypatch.setattr(factors, "SMALL", 0)
    monkeypatch.setattr(factors, "ROOM", 0)
    told, first = [], factors._cholesky
    monkeypatch.setattr(
        factors, "_cholesky", lambda *given: told.append("cholesky") or first(*given)
    )
    yield told
    hint = told[0].endswith("GB; a quarter of that after: pip install cvxopt pymetis")
    assert hint == (missing in factors.LIBRARIES)
    assert told[1:] == ([] if hint else ["cholesky"])


@pytest.mark.turns
@pytest.mark.parametrize("kind", ["real", "hermitian"])
@pytest.mark.parametrize(("held", "close"), [(1e-2, 1e-11), (1e-5, 1e-8)])
def test_every_factor_gives_the_same_solutions(large, kind, held, close):
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
    for rhs in (b, b[:, :1].ravel(), b.real[:, ::2], np.asfortranarray(b)):
        before = rhs.copy()
        got, wanted = solve(rhs), truth.solve(rhs.astype(matrix.dtype))
        np.testing.assert_array_equal(rhs, before)
        assert (got.dtype, got.shape) == (matrix.dtype, rhs.shape)
        got, wanted = (scale * x.reshape(len(b), -1) for x in (got, wanted))
        miss = np.abs(got - wanted).max(axis=0)
        assert (miss <= close * np.abs(wanted).max(axis=0)).all()


def test_a_singular_matrix_is_one_line(large):
    matrix = lattice().tolil()
    matrix[-3:, :-3] = matrix[:-3, -3:] = 0  # a node that nothing else holds
    matrix[-3:, -3:] = 1.0
    with pytest.raises(ModelError, match="must hold every part"):
        factors.factored(sparse.csc_array(matrix), large.append)


def shuffled(graph):
    """Return any order of the nodes."""
    return np.random.default_rng(7).permutation(graph.shape[0])


@pytest.mark.turns
@pytest.mark.parametrize("phases", [False, True])
@pytest.mark.parametrize("order", [None, shuffled])
def test_the_fill_is_known_before_a_factor_is_made(phases, order):
    matrix = lattice()
    if phases:
        matrix = turned(matrix, np.random.default_rng(1))
    graph, node = factors._nodes(matrix)
    nodes = order and order(graph)
    own = order and factors._of_unknowns(nodes, node)
    known = factors._lu(matrix if own is None else matrix[:, own][own], own).nnz
    assert 0.8 < factors.expected_fill(graph, node, nodes) / known < 1.25


def test_nested_dissection_fills_less():
    pytest.importorskip("pymetis", reason="pip install pymetis")
    graph, node = factors._nodes(lattice())
    order = factors._dissected(graph)
    assert sorted(order) == list(range(np.prod(COUNTS)))
    random = factors.expected_fill(graph, node, shuffled(graph))
    assert factors.expected_fill(graph, node, order) < 0.7 * random


@pytest.mark.parametrize("found", [True, False])
def test_a_cholesky_factor_takes_half_the_room(monkeypatch, found):
    monkeypatch.setattr(factors, "SMALL", 0)
    monkeypatch.setattr(factors, "find_spec", lambda _: found)
    monkeypatch.setattr(factors, "_dissected", lambda _: None)
    monkeypatch.setattr(factors, "expected_fill", lambda *_: 1e9)  # of 8 bytes
    told = []
    factors.factored(lattice(), told.append)
    (line,) = told
    assert f"takes {4.0 if found else 8.0} GB" in line
    assert ("pip install" in line) == (not found)


def test_a_small_factor_is_as_it_was_and_nothing_is_told():
    matrix = lattice()
    b = np.ones(matrix.shape[0])
    got = factors.factored(matrix, pytest.fail)(b)
    np.testing.assert_array_equal(got, factors._lu(matrix).solve(b))


def test_what_has_room_is_not_told(monkeypatch):
    monkeypatch.setattr(factors, "SMALL", 0)
    factors.factored(lattice(), pytest.fail)
