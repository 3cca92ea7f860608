"""Stress at named points: closed forms of blades, and files that are wrong."""

import h5py
import numpy as np
import pytest
import test_import_model as frame
from rotor_files import written
from scipy import sparse
from scipy.io import mmwrite
from stage import N as FEW
from stage import by_modes
from stage import rotor as small
from test_import_model import ROTOR, SIZE, N, imported, in_plane, told_wrong

from hpcwhirl.cli import main
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.finite_elements import _translation
from hpcwhirl.reduction.imported import rotor_from
from hpcwhirl.reduction.points import von_mises
from hpcwhirl.structure.bladed_disk import blade_sections
from hpcwhirl.structure.elements import beam

NAMES = ["root", "middle"]
NODES = 0, 2  # of a blade of four elements
FORCE = 7.0  # N


def bending(components=1):
    """Return rows (2 c, SIZE), Pa/m, of the outer fibre at both points of a blade.

    M of a beam's element at its inner node, over I / (h / 2).
    """
    length, sections = blade_sections(ROTOR)
    out = np.zeros((2, components, SIZE))
    for row, node in zip(out, NODES, strict=True):
        moment = beam(length, sections[node])[1][2]
        _, second = sections[node].at(0.0)
        dofs = 3 * node + np.arange(6)
        row[0, dofs] = moment * sections[node].thickness[0] / 2 / second
    return out.reshape(-1, SIZE)


def closed_form():
    """Return the stress at both points under a tangential force at the tip, Pa."""
    length, sections = blade_sections(ROTOR)
    found = []
    for node in NODES:
        arm = length * (ROTOR.elements - node)
        _, second = sections[node].at(0.0)
        found.append(FORCE * arm * sections[node].thickness[0] / 2 / second)
    return np.array(found)


def described(place, kind, components=1):
    """Write a wheel or a sector with the stress of its blades; return its TOML."""
    table = {"matrix": "stress.mtx", "names": NAMES}
    rows = bending(components)
    if kind == "wheel":
        whole = np.kron(np.eye(N), rows)
        whole = np.pad(whole, ((0, 0), (0, 2))) @ in_plane()
        toml = frame.wheel(place, stress=table)
    else:
        whole = np.pad(rows, ((0, 0), (0, 5)))
        if kind == "plane":  # tips and roots in x, y of the sector, turned
            for pair in (frame.ROOT[:2], frame.TIP):
                whole[:, pair] = whole[:, pair] @ frame.turn(0.3)
        toml = frame.sector(place, plane=kind == "plane", stress=table)
    mmwrite(place / "stress.mtx", sparse.coo_array(whole))
    return toml


def reduced(toml, **settings):
    return rotor_from(str(imported(toml)[1]), N, 0.01, **settings)


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Return {kind: the engine's file}."""
    return {
        kind: str(imported(described(tmp_path_factory.mktemp(kind), kind))[1])
        for kind in ("wheel", "sector", "plane")
    }


@pytest.mark.parametrize("eta", [None, 12])
@pytest.mark.parametrize("kind", ["wheel", "sector", "plane"])
def test_a_force_at_a_tip_bends_its_blade_as_a_cantilever(files, kind, eta):
    """F L h / 2 I at the root, whatever holds it; none in the other blades."""
    rotor = rotor_from(files[kind], N, 0.01, eta=eta)
    assert rotor.stress.names == tuple(NAMES)
    for j in (0, 2):
        force = np.zeros(len(rotor.mass))
        force[2 * j + 1] = FORCE
        found = rotor.stress.at(np.linalg.solve(rotor.stiffness, force))
        expected = np.zeros((N, 2))
        expected[j] = closed_form()
        sign = np.sign(found[j, 0])
        assert sign * found == pytest.approx(expected, abs=1e-7 * expected.max())


@pytest.mark.parametrize("kind", ["wheel", "sector"])
def test_modes_have_the_stress_of_the_unreduced_wheel(files, kind):
    """The first family, to the accuracy of a reduction to 30 modes."""
    rotor = rotor_from(files[kind], N, 0.01)
    disk = frame.bladed_disk(ROTOR)
    squared, shapes = frame.eigh(disk.stiffness, disk.mass, subset_by_index=(0, 5))
    assert rotor.omega[:6] ** 2 == pytest.approx(squared, rel=1e-4)
    rows = np.pad(np.kron(np.eye(N), bending()), ((0, 0), (0, 2)))
    # summed over modes of one frequency, products do not depend on the choice of them
    truth, found = rows @ shapes, rotor.stress.rows[:, :, 0] @ rotor.shapes[:, :6]
    truth, found = (a.reshape(2 * N, -1) for a in (truth, found))
    assert found @ found.T == pytest.approx(
        truth @ truth.T, abs=1e-3 * np.abs(truth @ truth.T).max()
    )


@pytest.mark.parametrize("kind", ["wheel", "sector"])
def test_a_translation_of_the_rotor_strains_nothing(files, kind):
    rotor = rotor_from(files[kind], N, 0.01)
    places = 2 * np.pi * np.arange(N) / N
    moved = _translation(len(rotor.mass), places)
    bent = np.zeros(len(moved))
    bent[1] = 1.0
    size = np.abs(rotor.stress.at(bent)).max()
    assert np.abs(rotor.stress.rows @ moved).max() < 1e-7 * size
    assert not rotor.stress.at(np.zeros(len(moved))).any()


def test_six_components_are_told_as_von_mises_does(files, tmp_path):
    one = rotor_from(files["sector"], N, 0.01)
    six = reduced(described(tmp_path, "sector", 6))
    moved = np.random.default_rng(1).normal(size=len(one.mass))
    found = [rotor.stress.at(moved) for rotor in (one, six)]
    assert found[1] == pytest.approx(np.abs(found[0]), rel=1e-6)


@pytest.mark.parametrize(
    ("components", "told"),
    [
        ([-3.0, 0, 0, 0, 0, 0], 3.0),
        ([2.0, 2.0, 2.0, 0, 0, 0], 0.0),
        ([0, 0, 0, 0, 2.0, 0], 2 * np.sqrt(3)),
        ([4.0, 4.0, 0, 0, 0, 0], 4.0),
        ([5.0, -5.0, 0, 1.0, 2.0, 3.0], np.sqrt(75 + 42)),
    ],
)
def test_von_mises(components, told):
    assert von_mises(np.array(components)) == pytest.approx(told)


def test_terms_of_rotation_leave_the_stress(tmp_path):
    terms = {f"sector__{n}": f for n, f in frame.turning_sector(tmp_path).items()}
    toml = described(tmp_path, "sector")
    table = {"matrix": "stress.mtx", "names": NAMES}
    frame.sector(tmp_path, stress=table, **terms)
    rotor = reduced(toml, turns=True)
    force = np.zeros(len(rotor.mass))
    force[1] = FORCE
    found = np.abs(rotor.stress.at(np.linalg.solve(rotor.stiffness, force))[0])
    assert found == pytest.approx(closed_form(), rel=1e-7)


def test_a_file_exported_again_has_its_stress(files, tmp_path):
    own, copy = files["sector"], tmp_path / "copy.h5"
    first = rotor_from(own, N, 0.01)
    words = ["--set", f"file={own}", "--set", f"blades={N}"]
    assert main(["export-model", str(copy), "table2", *words]) == 0
    again = rotor_from(str(copy), N, 0.01)
    assert again.stress.names == first.stress.names
    assert np.array_equal(again.stress.rows, first.stress.rows)


def with_stress(**changed):
    """Return arrays of a small rotor with a stress matrix, some of them changed."""
    arrays = small()
    rows = np.ones((FEW, 2, 6, len(arrays["mass"])))
    return arrays | {"stress": rows, "stress_name": ["one", "two"]} | changed


WRONG = [
    ({"stress_name": None}, "has rotor/stress without rotor/stress_name"),
    ({"stress": None}, "has rotor/stress_name without rotor/stress"),
    ({"stress_name": ["one"]}, r"rotor/stress must be \(5, 1, 6, 32\) \(blades, names"),
    ({"stress_name": ["one", "one"]}, "stress_name must be names that are all diff"),
    ({"stress_name": ["one", " "]}, "all different, got ' '"),
    ({"stress_name": ["one", "x" * 61]}, "at most 60 characters each, got 61"),
    ({"stress_name": [1.0, 2.0]}, "rotor/stress_name must hold text, got float64"),
    ({"stress": np.ones((FEW, 2, 3, 32))}, r"have 1 or 6 components \(axis 2\), got 3"),
    ({"stress": np.ones((FEW, 2, 6, 31))}, r"be \(5, 2, 6, 32\) .* got \(5, 2, 6, 31"),
    ({"stress": np.full((FEW, 2, 6, 32), np.nan)}, "rotor/stress must be finite"),
    ({"stress": np.ones((2, 6, 32))}, "rotor/stress must have 4 dimensions, got 3"),
]  # fmt: skip


@pytest.mark.parametrize(("spoil", "told"), WRONG)
def test_a_wrong_file_is_told_in_one_line(tmp_path, spoil, told):
    arrays = {n: a for n, a in with_stress(**spoil).items() if a is not None}
    file = written(tmp_path / "stage.h5", arrays)
    with pytest.raises(InputError, match=told) as caught:
        rotor_from(str(file), FEW, 0.01)
    assert len(str(caught.value).splitlines()) == 1


def test_modes_alone_have_no_coordinates_of_a_stress(tmp_path):
    arrays = with_stress()
    beside = {name: arrays[name] for name in ("stress", "stress_name")}
    file = written(tmp_path / "modes.h5", by_modes(small()) | beside)
    with pytest.raises(InputError, match=r"must come with rotor/mass, .* modes alone"):
        rotor_from(str(file), FEW, 0.01)


DESCRIBED = [
    ({"names": ["root"]}, r"\[stress\] matrix must have 1 or 6 rows, got 2"),
    ({"names": ["root", "root"]}, "names must be texts that are all different, got 'r"),
    ({"names": []}, "names must be texts that are all different"),
    ({"names": "root"}, "names must be a list of texts"),
    ({"matrix": "k.npz"}, r"\(stress\) must end in .mtx, got .npz"),
    ({"matrices": "k"}, "did you mean 'matrix'"),
    ({"matrix": "load.mtx"}, r"\(stress\) must be real, any x 20, got 20 x 1, real"),
]  # fmt: skip


@pytest.mark.parametrize(("spoil", "told"), DESCRIBED)
def test_a_wrong_description_is_told_in_one_line(tmp_path, capsys, spoil, told):
    described(tmp_path, "sector")
    mmwrite(tmp_path / "load.mtx", np.ones((SIZE + 5, 1)))
    table = {"matrix": "stress.mtx", "names": NAMES} | spoil
    path = frame.sector(tmp_path, stress=table)
    line = told_wrong(path, capsys)
    assert frame.re.search(told, line), line


def test_the_file_says_units_of_the_stress(files):
    with h5py.File(files["sector"]) as file:
        assert file["rotor/stress"].attrs["units"] == "Pa/m"
        assert file["rotor/stress"].shape[:3] == (N, 2, 1)
