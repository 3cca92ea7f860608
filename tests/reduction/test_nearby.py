"""Modes found from those of a similar structure are the structure's own."""

import numpy as np
import pytest
from scipy import sparse
from scipy.linalg import eigh

from hpcwhirl.reduction.factors import factored
from hpcwhirl.reduction.mistuned import boundary_of, whole_model
from hpcwhirl.reduction.nearby import modes_near
from hpcwhirl.scene import Rotor
from hpcwhirl.structure import bladed_disk

BLADES, ELEMENTS = 8, 6


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
