"""Wheels of other finite element codes, small ones: the codes' own frequencies."""

import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from scipy import sparse
from scipy.sparse.linalg import eigs, eigsh, spsolve

from hpcwhirl.cli import main
from hpcwhirl.reduction.imported import rotor_from
from hpcwhirl.reduction.waves import wave_lines
from hpcwhirl.store.models.wheel_file import read_wheel

ROOT = Path(__file__).parents[2]
GRID = (3, 1, 1, 4)
FINER = (4, 2, 1, 3)  # in which CalculiX's Coriolis forces are those of M
PLANE = (4, 2, 2, 6)  # in which solids are as soft as the plane wheel, to 2 %

pytestmark = pytest.mark.slow


@pytest.fixture
def job(request, monkeypatch):
    """Return the example, its mesh made coarse."""
    monkeypatch.syspath_prepend(str(ROOT / "jobs"))
    monkeypatch.syspath_prepend(str(ROOT / "scripts/evidence"))
    import wheel

    monkeypatch.setattr(wheel, "GRID", getattr(request, "param", GRID))
    yield wheel
    for name in ("wheel", "wheel_ccx"):
        sys.modules.pop(name, None)


def written(folder, name, document, modes):
    path = folder / f"{name}.toml"
    document[name]["modes"] = modes
    path.write_text(tomli_w.dumps(document), encoding="utf-8")
    return path


def frequencies(path, blades):
    out = path.with_suffix(".h5")
    assert main(["import-model", str(path), "--out", str(out)]) == 0
    return rotor_from(str(out), blades, 0.0).omega / (2 * np.pi)


def full(path, count):
    wheel = read_wheel(path)
    mass, stiffness = wheel.mass.tocsc(), wheel.stiffness.tocsc()
    squared = eigsh(stiffness, count, mass, sigma=-1e4, return_eigenvectors=False)
    return np.sqrt(np.sort(squared)) / (2 * np.pi)


@pytest.mark.evidence  # at rest: CalculiX's; turning: the next one
def test_a_wheel_of_scikit_fem(job, tmp_path):
    pytest.importorskip("skfem", reason="pip install scikit-fem")
    whole = written(tmp_path, "wheel", job.whole(tmp_path), 440)
    sector = written(tmp_path, "sector", job.sector(tmp_path), 440)
    truth = full(whole, 46)
    for path in (whole, sector):
        got = frequencies(path, job.BLADES)[:46]
        np.testing.assert_allclose(got, truth, rtol=1e-6)
        assert (got > truth * (1 - 1e-7)).all()  # a reduction is too stiff, if at all


def lines_of(path, blades, speed, most):
    model = rotor_from(str(path.with_suffix(".h5")), blades, 0.0, turns=True)
    assert model.cyclic
    found = [x.rotating for x in wave_lines(model, blades, speed)]
    return np.sort(np.abs(found))[:most]


def turning_full(path, speed, count):
    """Return the lowest frequencies at speed of the whole matrices, rad/s."""
    wheel, size = read_wheel(path), read_wheel(path).mass.shape[0]
    terms = wheel.turning
    first = terms["stress_stiffness"] - terms["softening"]
    stiffness = wheel.stiffness + speed**2 * first
    gyro, same = 2 * speed * terms["coriolis"], sparse.eye_array(size)
    left = sparse.block_array([[None, same], [-stiffness, -gyro]], format="csc")
    right = sparse.block_array([[same, None], [None, wheel.mass]], format="csc")
    roots = eigs(left, 2 * count, right, sigma=1.0, return_eigenvectors=False)
    return np.sort(np.abs(roots.imag))


def test_a_wheel_of_scikit_fem_turns_as_its_whole_matrices(job, tmp_path):
    """To a thousandth at any speed, and its sector as well."""
    pytest.importorskip("skfem", reason="pip install scikit-fem")
    whole = written(tmp_path, "wheel", job.whole(tmp_path), 110)
    sector = written(tmp_path, "sector", job.sector(tmp_path), 110)
    for path in (whole, sector):
        frequencies(path, job.BLADES)
    truth = turning_full(whole, 500.0, 20)[::2]  # s and its conjugate
    for path in (whole, sector):
        got = lines_of(path, job.BLADES, 500.0, len(truth))
        np.testing.assert_allclose(got[:18], truth[:18], rtol=1e-3)


def test_a_wheel_of_calculix(job, tmp_path):
    if shutil.which("ccx") is None:
        pytest.skip("apt-get install calculix-ccx")
    import wheel_ccx

    whole = wheel_ccx.solids(*job.whole_mesh(job.GRID))
    wheel_ccx.solved(tmp_path, "solved", wheel_ccx.deck(whole, job.SPRINGS / 2, ""))
    own = wheel_ccx.own_frequencies(tmp_path / "solved.dat")
    assert len(own) == wheel_ccx.MODES
    sector = wheel_ccx.solids(*job.sector_mesh(job.GRID))
    document = wheel_ccx.document(tmp_path, "sector", sector, job.BLADES)
    got = frequencies(written(tmp_path, "sector", document, 880), job.BLADES)
    np.testing.assert_allclose(got[: len(own)], own, rtol=1e-6)
    document = wheel_ccx.document(tmp_path, "wheel", whole, 1)
    got = frequencies(written(tmp_path, "wheel", document, 110), job.BLADES)
    np.testing.assert_allclose(got[:22], own[:22], rtol=1e-4)


@pytest.mark.evidence  # in short: test_import_model -k "turns or two_speeds"
@pytest.mark.parametrize("job", [PLANE], indirect=True, ids=["plane"])
def test_a_wheel_of_calculix_turns(job, tmp_path):
    """K(Omega) has the softening, the load is CalculiX's, lines are the plane wheel's.

    That is of plane stress, 0.7 % (k = 1) and 1.6 % (1F) softer at rest.
    """
    pytest.importorskip("skfem", reason="pip install scikit-fem")
    if shutil.which("ccx") is None:
        pytest.skip("apt-get install calculix-ccx")
    import wheel_ccx

    mesh, speed = wheel_ccx.solids(*job.whole_mesh(job.GRID)), 300.0
    document = wheel_ccx.turning_document(tmp_path, mesh)
    path = written(tmp_path, "wheel", document, 110)
    wheel, names = read_wheel(path), (tmp_path / "wheel.dof").read_text().split()
    along = np.array([dof.endswith(".1") for dof in names]) * 1.0
    for at, of in zip(wheel_ccx.SPEEDS, "ab", strict=True):
        gone = wheel.stiffness - wheel.turning[f"stiffness_{of}"]
        mass = along @ wheel.mass @ along
        assert along @ gone @ along == pytest.approx(at**2 * mass, rel=1e-5)
    given = job.SPRINGS / 2, ", SOLVER=MATRIXSTORAGE", speed
    text = wheel_ccx.deck(mesh, *given, "*NODE PRINT, NSET=ALL\nU")
    wheel_ccx.solved(tmp_path, "pulled", text)
    printed = (tmp_path / "pulled.dat").read_text()
    rows = [line.split() for line in printed.splitlines()]
    moved = {int(r[0]): float(r[1]) for r in rows if len(r) == 4 and r[0].isdigit()}
    solve = spsolve(wheel.stiffness.tocsc(), wheel.turning["centrifugal_load"])
    tip = wheel_ccx.at(mesh[0], np.array([job.TIP, 0.0, 0.0]))
    found = speed**2 * solve[names.index(f"{tip}.1")]
    assert moved[tip] > 1e-6
    assert found == pytest.approx(moved[tip], rel=1e-5)
    plane = written(tmp_path, "sector", job.sector(tmp_path), 110)
    own, expected = (np.sort(lines_at(p, job.BLADES, speed)) for p in (path, plane))
    assert own[0] == pytest.approx(expected[0], rel=0.01)
    np.testing.assert_allclose(own[1:12], expected[1:12], rtol=0.02)


@pytest.mark.evidence  # their sign and size in short: test_import_model -k coriolis
@pytest.mark.parametrize("job", [FINER], indirect=True, ids=["finer"])
def test_coriolis_forces_from_the_mass_matrix_are_those_of_calculix(job, tmp_path):
    """Of a hub of elastic nodes on springs: CalculiX errs with a rigid body."""
    if shutil.which("ccx") is None:
        pytest.skip("apt-get install calculix-ccx")
    import wheel_ccx

    mesh, speed, springs = wheel_ccx.solids(*job.whole_mesh(job.GRID)), 300.0, 1.7e7
    deck = wheel_ccx.deck(mesh, springs, "", speed)
    text = wheel_ccx.on_springs(deck, mesh, springs)
    found, own = (
        of(tmp_path, text, speed, 12)[:3]
        for of in (wheel_ccx.turning_lines, wheel_ccx.own_lines)
    )
    np.testing.assert_allclose(found, own, rtol=1e-4)


def lines_at(path, blades, speed):
    """Return the sizes of a reduced rotor's frequencies at a speed, rad/s."""
    frequencies(path, blades)
    model = rotor_from(str(path.with_suffix(".h5")), blades, 0.0, turns=True)
    return np.abs([x.rotating for x in wave_lines(model, blades, speed)])
