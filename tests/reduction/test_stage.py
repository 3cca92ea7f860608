"""A stage of solid twisted blades: its reduced waves are those of all unknowns."""

import functools
import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg
from rotor_files import arrays_in
from scipy import sparse
from scipy.sparse.linalg import LinearOperator, eigs, splu

from hpcwhirl.cli import main
from hpcwhirl.errors import InputError
from hpcwhirl.store.models.wheel_file import read_wheel

ROOT = Path(__file__).parents[2]
FEW = 9  # blades
COUNT = 6  # lines that are compared of a nodal diameter: two of each family

FAMILIES = 30  # fixed-interface modes of a diameter
pytestmark, EVIDENCE = pytest.mark.slow, pytest.mark.evidence
DIAMETERS = [0, 1, *(pytest.param(k, marks=EVIDENCE) for k in (2, 3)), FEW // 2]


@pytest.fixture(scope="module")
def stage():
    """Return the example, with few blades."""
    pytest.importorskip("skfem", reason="pip install scikit-fem")
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "jobs"))
        place = ROOT / "jobs" / "stage.py"  # tests have another module `stage`
        spec = importlib.util.spec_from_file_location("stage_of_jobs", place)
        stage = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(stage)
        patch.setattr(stage, "BLADES", FEW)
        patch.setattr(stage, "STEP", 2 * np.pi / FEW)
        patch.setattr(stage, "COARSE", (4, 2, 1, 2, 2))
        yield stage
    sys.modules.pop("wheel", None)


@pytest.fixture(scope="module")
def made(stage, tmp_path_factory):
    """Return (folder, body, {name: array} of the reduced rotor)."""
    folder = tmp_path_factory.mktemp("stage")
    body = stage.written(folder, stage.COARSE, FAMILIES * FEW)
    out = folder / "rotor.h5"
    assert main(["import-model", str(folder / "sector.toml"), "--out", str(out)]) == 0
    return folder, body, arrays_in(out)


@pytest.fixture(scope="module")
def tangents(made):
    """Return {speed: stiffness of the sector}, made when it is first asked for."""
    body, found = made[1], {}

    def tangent(speed):
        if speed not in found:
            found[speed] = body.turning(speed)
        return found[speed]

    return tangent


def roots_of(factored, gyro, mass, count):
    """Return (roots s, shapes) nearest 0 of s^2 M + s G + K, K by its factor."""
    size = mass.shape[0]

    def inverse(x):
        first, second = x[:size], x[size:]
        return np.r_[-factored(gyro @ first + mass @ second), first]

    operator = LinearOperator((2 * size, 2 * size), inverse, dtype=complex)
    ncv = min(2 * size - 1, 3 * count + 20)
    inverted, shapes = eigs(operator, count, ncv=ncv, v0=np.ones(2 * size))
    return 1 / inverted, shapes[size:]


@pytest.fixture(scope="module")
def turning_modes(made):
    """Return {speed: (omega, tips (N, m))} of the reduced rotor, by K_0, K_1, K_2."""
    arrays, found = made[2], {}
    (a, b), first = arrays["speeds"] ** 2, arrays["stiffness"]
    up, far = (arrays[f"stiffness_{n}"] - first for n in "ab")

    def modes(speed):
        if speed not in found:
            square = speed**2
            own = first + square * (b**2 * up - a**2 * far) / (a * b * (b - a))
            own = own + square**2 * (a * far - b * up) / (a * b * (b - a))
            gyro, factor = 2 * speed * arrays["coriolis"], scipy.linalg.lu_factor(own)
            solve = functools.partial(scipy.linalg.lu_solve, factor)
            roots, shapes = roots_of(solve, gyro, arrays["mass"], 2 * COUNT * FEW)
            found[speed] = roots.imag, shapes[arrays["tip_radial"][:, 1]]
        return found[speed]

    return modes


@pytest.mark.parametrize("k", DIAMETERS)
@pytest.mark.parametrize(
    "speed", [*(pytest.param(v, marks=EVIDENCE) for v in (150.0, 300.0)), 450.0]
)
def test_waves_at_speed_are_those_of_the_tangent_there(
    made, tangents, turning_modes, speed, k
):
    """To a thousandth, those that move the shaft as well, at speeds not in the file."""
    truth = made[1].frequencies(tangents(speed), k, speed, COUNT)
    omega, tips = turning_modes(speed)
    share = np.abs(np.fft.fft(tips, axis=0)) ** 2
    kept = (share.argmax(axis=0) == k) & (share[k] > 0.9 * share.sum(axis=0))
    found = omega[kept]
    found = np.sort(found[np.argsort(np.abs(found))][:COUNT])
    assert found == pytest.approx(truth, rel=1e-3)
    if k == 1:  # forward and backward
        split = np.abs(truth[COUNT // 2 :]) - np.abs(truth[: COUNT // 2][::-1])
        assert np.abs(split).max() > speed / 3


@pytest.mark.parametrize("k", DIAMETERS)
def test_modes_at_rest_are_those_of_all_unknowns(made, tangents, k):
    """To a millionth the first, Rayleigh's quotient of the wave in its near modes."""
    _, body, arrays = made
    truth = body.frequencies(tangents(0.0), k, 0.0, COUNT)[COUNT // 2 :]
    inverse, shapes = scipy.linalg.eigh(arrays["mass"], arrays["stiffness"])
    share = np.abs(np.fft.fft(shapes[arrays["tip_radial"][:, 1]], axis=0)[k]) ** 2
    found = []
    for one in truth:
        near = np.abs(inverse * one**2 - 1) < 2e-3
        found.append(1 / np.sqrt(np.average(inverse[near], weights=share[near])))
    assert found[0] == pytest.approx(truth[0], rel=1e-6)
    assert found == pytest.approx(truth, rel=1e-4)


def test_a_load_on_all_tips_has_the_stress_of_all_unknowns(made, tangents):
    """At the root, as without reduction: static shapes of the tips are in the basis."""
    folder, body, arrays = made
    points = arrays["tip_radial"].shape[1]
    pushes = np.random.default_rng(2).normal(size=2 * points)
    force = np.zeros(len(arrays["mass"]))
    for part, way in enumerate(("tip_radial", "tip_tangential")):
        force[arrays[way]] = pushes[part::2]
    found = arrays["stress"] @ np.linalg.solve(arrays["stiffness"], force)
    wheel = read_wheel(folder / "sector.toml")
    whole, lift = np.zeros(len(body.load)), body.wave(0)
    for pair, angle, push in zip(
        wheel.tips, wheel.angle, pushes.reshape(-1, 2), strict=True
    ):
        c, s = np.cos(angle), np.sin(angle)
        whole[pair] = [c * push[0] - s * push[1], s * push[0] + c * push[1]]
    solve = splu(sparse.csc_array(lift.T @ tangents(0.0) @ lift)).solve
    truth = wheel.stress[1] @ (lift @ solve(lift.T @ whole))
    assert arrays["stress"].shape[:3] == (FEW, 3, 6)
    assert wheel.stress[0] == tuple(n.decode() for n in arrays["stress_name"])
    for blade in found:
        assert blade.ravel() == pytest.approx(truth, abs=1e-6 * np.abs(truth).max())


def test_a_pulled_blade_has_the_stress_of_its_strain(stage, made):
    """Rows of an affine displacement give Hooke's law, at every point."""
    _, body, _ = made
    slope = 1e-3 * np.random.default_rng(3).normal(size=(3, 3))
    moved = np.zeros(len(body.load))
    moved[:-2] = np.einsum("pj,pj->p", body.place, slope[body.axis])
    strain = (slope + slope.T) / 2
    shear = stage.YOUNG / (2 * (1 + stage.POISSON))
    lame = 2 * shear * stage.POISSON / (1 - 2 * stage.POISSON)
    own = 2 * shear * strain + lame * np.trace(strain) * np.eye(3)
    truth = [own[0, 0], own[1, 1], own[2, 2], own[1, 2], own[2, 0], own[0, 1]]
    for z in stage.ROOT.values():
        place = stage.section(
            stage.ABOVE, stage.THICKNESS / 2, stage.WIDTH * z, stage.TWIST
        )
        assert body.stress(place) @ moved == pytest.approx(np.array(truth), rel=1e-9)


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
