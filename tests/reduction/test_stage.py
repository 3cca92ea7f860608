"""A stage of solid twisted blades: its reduced waves are those of all unknowns."""

import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.linalg
from scipy import sparse
from scipy.sparse.linalg import LinearOperator, eigs, splu

from hpcwhirl.cli import main
from hpcwhirl.errors import InputError
from hpcwhirl.store.models.wheel_file import read_wheel

ROOT = Path(__file__).parents[2]
FEW = 9  # blades
SPEED = 300.0  # rad/s
COUNT = 8  # lines that are compared of a nodal diameter: two of each family

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def stage():
    """Return the example, with few blades."""
    pytest.importorskip("skfem", reason="pip install scikit-fem")
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "jobs"))
        import stage

        patch.setattr(stage, "BLADES", FEW)
        patch.setattr(stage, "STEP", 2 * np.pi / FEW)
        patch.setattr(stage, "COARSE", (4, 2, 1, 2, 2))
        yield stage
    for name in ("stage", "wheel"):
        sys.modules.pop(name, None)


@pytest.fixture(scope="module")
def made(stage, tmp_path_factory):
    """Return (folder, body, {name: array} of the reduced rotor)."""
    folder = tmp_path_factory.mktemp("stage")
    body = stage.written(folder, stage.COARSE, 20 * FEW)
    out = folder / "rotor.h5"
    assert main(["import-model", str(folder / "sector.toml"), "--out", str(out)]) == 0
    with h5py.File(out) as file:
        return folder, body, {n: a[()] for n, a in file["rotor"].items()}


def all_unknowns(stage, body, k, speed):
    """Return the lowest frequencies of waves e^{i (k theta + omega t)}, rad/s."""
    lift, springs = body.wave(k), np.zeros(len(body.load))
    springs[list(body.centre.values())] = stage.SHAFT / FEW
    own = body.turning(speed) + sparse.diags_array(springs)
    stiffness, gyro, mass = (
        sparse.csc_array(lift.conj().T @ a @ lift)
        for a in (own, 2 * speed * body.coriolis, body.mass)
    )
    size, factor = stiffness.shape[0], splu(stiffness.astype(complex))

    def inverse(x):
        first, second = x[:size], x[size:]
        return np.r_[-factor.solve(gyro @ first + mass @ second), first]

    roots = 1 / eigs(
        LinearOperator((2 * size, 2 * size), inverse, dtype=complex),
        COUNT,
        return_eigenvectors=False,
    )
    return np.sort(roots.imag)


def reduced(arrays, k, speed):
    """Return the same of the reduced rotor, by the waves of its tips."""
    (a, b), first = arrays["speeds"] ** 2, arrays["stiffness"]
    up, far = (arrays[f"stiffness_{n}"] - first for n in "ab")
    square = speed**2
    own = first + square * (b**2 * up - a**2 * far) / (a * b * (b - a))
    own = own + square**2 * (a * far - b * up) / (a * b * (b - a))
    size = len(first)
    same, none = np.eye(size), np.zeros((size, size))
    left = np.block([[none, same], [-own, -2 * speed * arrays["coriolis"]]])
    right = scipy.linalg.block_diag(same, arrays["mass"])
    roots, shapes = scipy.linalg.eig(left, right)
    tips = shapes[arrays["tip_radial"][:, 1]]
    share = np.abs(np.fft.fft(tips, axis=0)) ** 2
    kept = (share.argmax(axis=0) == k) & (share[k] > 0.9 * share.sum(axis=0))
    found = roots.imag[kept]
    return np.sort(found[np.argsort(np.abs(found))][:COUNT])


def test_waves_at_speed_are_those_of_the_tangent_there(stage, made):
    """To a thousandth, those that move the shaft as well."""
    _, body, arrays = made
    truth = all_unknowns(stage, body, 1, SPEED)
    assert reduced(arrays, 1, SPEED) == pytest.approx(truth, rel=1e-3)
    split = np.abs(truth[COUNT // 2 :]) - np.abs(truth[: COUNT // 2][::-1])
    assert np.abs(split).max() > 100.0  # forward and backward


@pytest.mark.parametrize("k", [1, 2])
def test_modes_at_rest_are_those_of_all_unknowns(stage, made, k):
    """To a millionth the first; k and -k have one frequency, so that shapes may mix."""
    _, body, arrays = made
    truth = all_unknowns(stage, body, k, 0.0)[COUNT // 2 :]
    squared, shapes = scipy.linalg.eigh(arrays["stiffness"], arrays["mass"])
    share = np.abs(np.fft.fft(shapes[arrays["tip_radial"][:, 1]], axis=0)) ** 2
    kept = share[k] + share[-k] > 0.9 * share.sum(axis=0)
    found = np.sqrt(squared[kept])
    first, *others = ([x for x in found if abs(x / t - 1) < 3e-5] for t in truth)
    assert first == pytest.approx([truth[0]] * 2, rel=1e-6)
    assert all(len(pair) == 2 for pair in others)


def test_the_tangent_is_the_derivative_of_the_forces(made):
    _, body, _ = made
    random = np.random.default_rng(1)
    moved, more = 1e-4 * random.normal(size=(2, len(body.load)))
    near, far = (body.stiffness(moved + h * more)[0] for h in (-1e-4, 1e-4))
    found = body.stiffness(moved)[1] @ more
    assert np.abs(found - (far - near) / 2e-4).max() < 1e-6 * np.abs(found).max()


def test_stiffening_that_is_not_symmetric_is_told_in_one_line(made):
    folder, _, _ = made
    matrix = sparse.load_npz(folder / "stiffness_b.npz").tolil()
    matrix[0, 1] += 1e-3 * abs(matrix).max()
    sparse.save_npz(folder / "uneven.npz", sparse.csr_array(matrix.tocsr()))
    text = (folder / "sector.toml").read_text(encoding="utf-8")
    path = folder / "uneven.toml"
    path.write_text(text.replace("stiffness_b.npz", "uneven.npz"), encoding="utf-8")
    with pytest.raises(
        InputError, match=r"\(stiffness_b\) must be symmetric"
    ) as caught:
        read_wheel(path)
    assert len(str(caught.value).splitlines()) == 1
