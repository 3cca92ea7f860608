"""Modes found from those of a similar structure are the structure's own."""

import numpy as np
import pytest
from scipy import sparse
from scipy.linalg import eigh

from hpcwhirl.reduction import bodies, craig_bampton
from hpcwhirl.reduction.craig_bampton import ROUGH, modes_near, rough_modes
from hpcwhirl.reduction.factors import factored, negative_pivots
from hpcwhirl.reduction.mistuned import boundary_of, whole_model
from hpcwhirl.scene import Rotor
from hpcwhirl.structure import bladed_disk, rotation_of

BLADES, ELEMENTS = 8, 6
FAMILY = 0.01  # relative distance of frequencies from which families are apart
CACHES = bodies.rotor_model, bodies._undivided, bodies._held_modes


def held(deviation, seed=3):
    """Return M and K, tips and centre held, of blades that differ at random."""
    changes = np.random.default_rng(seed).normal(0.0, deviation, BLADES)
    rotor = Rotor(blades=BLADES, elements=ELEMENTS, mistuning=tuple(changes))
    disk = bladed_disk(rotor)
    inner = np.setdiff1d(np.arange(len(disk.mass)), boundary_of(disk))
    return disk, [a[np.ix_(inner, inner)] for a in (disk.mass, disk.stiffness)]


def found(matrices, near, count):
    mass, stiffness = map(sparse.csc_array, matrices)
    return modes_near((mass, stiffness), factored(stiffness, print), near, count)


@pytest.mark.parametrize(
    ("deviation", "count"),  # 13 parts a family
    [(1e-6, 1), (1e-6, 8), (1e-6, 16), (0.02, 13), (0.3, 1), (0.3, 13), (0.3, 16)],
)
def test_the_modes_are_those_of_dense_matrices(deviation, count):
    _, tuned = held(0.0)
    _, matrices = held(deviation)
    mass, stiffness = matrices
    near = eigh(*tuned[::-1])[1][:, : count + BLADES]
    squared, shapes = found(matrices, near, count)
    dense = eigh(stiffness, mass, eigvals_only=True)[:count]
    assert squared == pytest.approx(dense, rel=1e-9)  # round-off of the dense ones
    assert np.abs(shapes.T @ mass @ shapes - np.eye(count)).max() < 1e-12
    ahead = np.linalg.solve(stiffness, mass @ shapes) * squared
    assert np.abs(ahead - shapes).max() < 1e-9 * np.abs(shapes).max()


@pytest.mark.parametrize("lost", [0, 4])
def test_no_mode_is_missing(lost):
    # the known modes lack one, and iteration cannot find it: it remains orthogonal
    _, matrices = held(0.02)
    every = eigh(*matrices[::-1])[1]
    near = np.delete(every, lost, axis=1)[:, : 5 + BLADES]
    assert found(matrices, near, 5) is None
    assert found(matrices, every[:, : 5 + BLADES], 5) is not None


def test_a_whole_rotor_is_the_one_that_dense_matrices_give():
    _, tuned = held(0.0)
    disk, _ = held(0.05)
    near = eigh(*tuned[::-1])[1][:, : 10 + BLADES]
    sooner, dense = whole_model(disk, 0.01, 10, near=near), whole_model(disk, 0.01, 10)
    assert sooner.omega == pytest.approx(dense.omega, rel=1e-10)
    tips = 2 * BLADES  # further coordinates are amplitudes, whose signs are free
    sizes = [np.abs(model.shapes[:tips]) for model in (sooner, dense)]
    assert sizes[0] == pytest.approx(sizes[1], abs=1e-7 * sizes[1].max())


def families(model):
    """Return the sum of phi phi^T over the tips, family by family of frequencies."""
    ends = np.flatnonzero(np.diff(model.omega) > FAMILY * model.omega[1:]) + 1
    tips = model.shapes[: 2 * BLADES + 2]
    return [part @ part.T for part in np.split(tips, ends, axis=1)]


@pytest.mark.parametrize("deviation", [0.05, 0.005, 1e-4])
def test_with_rotation_families_are_those_that_dense_matrices_give(deviation):
    """A single shape of two modes that are near is as wrong as round-off over the gap.

    So shapes of 1e-4 differ by 5e-8, and what a family does to the tips by 1e-9.
    """
    disk, _ = held(deviation)
    rotor = Rotor(blades=BLADES, elements=ELEMENTS)
    near = bodies._held_modes(rotor, 10 + BLADES)
    given = disk, 0.01, 10, rotation_of(rotor)  # Young's modulus changes no mass
    sooner, dense = whole_model(*given, near=near), whole_model(*given)
    assert sooner.omega == pytest.approx(dense.omega, rel=1e-9)
    both = families(sooner), families(dense)
    assert len(both[0]) == len(both[1])
    largest = max(np.abs(part).max() for part in both[1])
    for part, other in zip(*both, strict=True):
        assert part == pytest.approx(other, abs=1e-8 * largest)


@pytest.mark.parametrize("count", [9, 16, 24])
def test_rough_modes_are_about_the_lowest_though_pairs_are_equal(count):
    _, (mass, stiffness) = held(0.0)
    rough = rough_modes(mass, stiffness, count)
    exact = eigh(stiffness, mass, eigvals_only=True)[:count]
    assert np.diff(exact).min() < 1e-9 * exact[0]  # what makes it hard
    quotients = np.sort((rough * (stiffness @ rough)).sum(axis=0))
    assert np.abs(rough.T @ mass @ rough - np.eye(count)).max() < 1e-12
    assert quotients == pytest.approx(exact, rel=ROUGH)
    squared = (rough * (stiffness @ rough)).sum(axis=0)
    miss = rough - np.linalg.solve(stiffness, mass @ rough) * squared
    assert (miss * (mass @ miss)).sum(axis=0).max() < ROUGH**2


@pytest.mark.parametrize(("deviation", "count"), [(0.0, 8), (0.02, 13), (0.3, 16)])
def test_begun_with_rough_modes_none_is_missing(deviation, count):
    _, tuned = held(0.0)
    _, (mass, stiffness) = held(deviation)
    near = rough_modes(*tuned, count + BLADES)
    squared, _ = found((mass, stiffness), near, count)
    above = 1.0 + 1e-9
    shifted = sparse.csc_array(stiffness - above * squared[-1] * mass)
    assert negative_pivots(shifted) == count
    dense = eigh(stiffness, mass, eigvals_only=True)
    assert squared == pytest.approx(dense[:count], rel=1e-9)


@pytest.mark.turns
def test_engines_have_the_same_bits_in_any_order():
    draws = np.random.default_rng(7).normal(0.0, 0.02, (3, 22))
    rotors = [Rotor(mistuning=tuple(row)) for row in (0.0 * draws[0], *draws)]

    def bits(order):
        for cached in CACHES:
            cached.cache_clear()
        models = {i: bodies.rotor_model(rotors[i], 44) for i in order}
        return [
            models[i].shapes.tobytes() + models[i].omega.tobytes()
            for i in sorted(order)
        ]

    asked = bits([0, 1, 2, 3])
    assert bodies._held_modes.cache_info().misses == 1  # not by dense matrices
    assert bits([3, 1, 0, 2]) == asked
    assert bits([2]) == asked[2:3]


def test_a_submatrix_is_that_of_its_own_places():
    # as many entries, elsewhere or at the same places, after one that is kept
    first = np.diag([1.0, 2.0, 3.0, 4.0]) + np.eye(4, k=1)
    inner, larger = np.array([0, 1, 3]), np.diag([1.0, 2.0, 3.0, 4.0, 5.0])
    larger[0, 1] = larger[3, 4] = 6.0
    for matrix in (first, 3.0 * first, first.T, first[::-1], np.eye(4), larger, first):
        for _ in range(2):
            found = craig_bampton._within(matrix, inner)
            np.testing.assert_array_equal(found.toarray(), matrix[np.ix_(inner, inner)])
            assert found.nnz == np.count_nonzero(found.toarray())
