"""Finite elements to an engine: laws, known truths, and files that are wrong."""

import io
import json
import os
import re
import tomllib
import zipfile
from contextlib import redirect_stdout
from functools import partial

import h5py
import numpy as np
import pytest
import tomli_w
from scipy import sparse
from scipy.io import mmread, mmwrite
from scipy.linalg import eigh

from hpcwhirl.cli import main
from hpcwhirl.errors import InputError, MissingFileError
from hpcwhirl.reduction import factors, sparse_modes
from hpcwhirl.reduction.bodies import rotor_model
from hpcwhirl.reduction.imported import rotor_from
from hpcwhirl.reduction.modes import modal_model
from hpcwhirl.reduction.waves import tip_growth, wave_lines
from hpcwhirl.scene import Rotor
from hpcwhirl.store.models.wheel_file import TABLES as KNOWN
from hpcwhirl.store.models.wheel_file import TURNING, read_wheel
from hpcwhirl.structure import bladed_disk, rotation_of
from hpcwhirl.structure.bladed_disk import blade, rim, spoke
from hpcwhirl.structure.elements import add_block, beam, turn
from hpcwhirl.structure.rotation import (
    coriolis_of,
    loads_of,
    members,
    stiffening_of,
    tensions,
)

N, MODES = 6, 30
ROTOR = Rotor(blades=N, elements=4)
SIZE = 3 * (ROTOR.elements + 1)  # DoF of a blade
ROOT, TIP = np.arange(3), np.array([SIZE - 3, SIZE - 2])


def own_reduction():
    """Return this project's own reduction of the wheel, as the truth."""
    return modal_model(bladed_disk(ROTOR), 0.0, MODES)


def in_plane(turned=0.0):
    """Return the map to the rotor's axes from tips and centre in x, y."""
    disk = bladed_disk(ROTOR)
    lift = np.eye(len(disk.mass))
    angle = turned + 2 * np.pi * np.arange(N) / N
    for pair, own in zip(SIZE * np.arange(N)[:, None] + TIP, angle, strict=True):
        lift[np.ix_(pair, pair)] = turn(own)
    hub = np.array(disk.centre)
    lift[np.ix_(hub, hub)] = turn(turned)
    return lift


def wheel(place, name="wheel", turned=0.0, **changed):
    """Write M and K of the whole wheel, tips and centre in x, y; return its TOML."""
    disk, lift = bladed_disk(ROTOR), in_plane(turned)
    tips, hub = SIZE * np.arange(N)[:, None] + TIP, np.array(disk.centre)
    for file, matrix in (("m.mtx", disk.mass), ("k.mtx", disk.stiffness)):
        whole = sparse.csr_array(lift.T @ matrix @ lift)
        mmwrite(place / file, (whole + whole.T) / 2, symmetry="symmetric")
    return write(
        place / f"{name}.toml",
        {
            "wheel": {"mass": "m.mtx", "stiffness": "k.mtx", "blades": N}
            | {"modes": MODES},
            "tips": dict(zip("xy", tips.T.tolist(), strict=True)) | {"angle": turned},
            "centre": dict(zip("xy", hub.tolist(), strict=True)),
        },
        changed,
    )


def in_calculix(place, name="ccx", **changed):
    """Write the whole wheel as CalculiX does; its TOML names DoF as its .dof does."""
    wheel(place)
    for file, ending in (("m.mtx", ".mas"), ("k.mtx", ".sti")):
        half = sparse.coo_array(sparse.triu(mmread(place / file)))
        lines = zip(half.row + 1, half.col + 1, half.data, strict=True)
        text = "".join(f"{i:10d}{j:10d}{v:25.17e}\n" for i, j, v in lines)
        (place / f"{name}{ending}").write_text(text)
    names = [f"{i // 3 + 1}.{i % 3 + 1}" for i in range(half.shape[0])]
    (place / f"{name}.dof").write_text("\n".join(names) + "\n")
    document = tomllib.loads((place / "wheel.toml").read_text())
    document["wheel"] |= {"mass": f"{name}.mas", "stiffness": f"{name}.sti"}
    for table in ("tips", "centre"):
        for axis in "xy":
            rows = document[table][axis]
            document[table][axis] = np.array(names)[rows].tolist()
    return write(place / f"{name}.toml", document, changed)


def sector(place, *, plane=False, name="sector", **changed):
    """Write M and K of one sector, the right root beside its own; return its TOML.

    plane : whether roots, tip and centre are in x, y of the sector, and turned at that
    """
    right, hub = SIZE + ROOT, SIZE + 3 + np.arange(2)
    matrices = [np.zeros((SIZE + 5, SIZE + 5)) for _ in range(2)]
    *arms, spoke_turn = spoke(ROTOR, 0.0)
    *chords, rim_turn = rim(ROTOR)
    for target, own, arm, chord in zip(
        matrices, blade(ROTOR), beam(*arms), beam(*chords), strict=True
    ):
        target[:SIZE, :SIZE] += own
        add_block(target, spoke_turn.T @ arm @ spoke_turn, np.r_[hub, ROOT])
        add_block(target, rim_turn.T @ chord @ rim_turn, np.r_[ROOT, right])
    turned, lift = (0.3 if plane else 0.0), np.eye(SIZE + 5)
    ahead = turned + 2 * np.pi / N
    for pair, own in ((ROOT, turned), (TIP, turned), (hub, turned), (right, ahead)):
        lift[np.ix_(pair[:2], pair[:2])] = turn(own) if plane else np.eye(2)
    for file, matrix in zip(("sm.npz", "sk.npz"), matrices, strict=True):
        whole = sparse.csr_array(lift.T @ matrix @ lift)
        sparse.save_npz(place / file, (whole + whole.T) / 2)
    cuts = {"left": ROOT.tolist(), "right": right.tolist()}
    if plane:
        cuts = {"left": [2], "right": [SIZE + 2]}
        for axis, letter in enumerate("xy"):
            cuts[f"left_{letter}"] = [axis]
            cuts[f"right_{letter}"] = [SIZE + axis]
    names = ("x", "y") if plane else ("radial", "tangential")
    return write(
        place / f"{name}.toml",
        {
            "sector": {"mass": "sm.npz", "stiffness": "sk.npz", "blades": N}
            | {"modes": MODES, **cuts},
            "tips": dict(zip(names, TIP.tolist(), strict=True)) | {"angle": turned},
            "centre": dict(zip("xy", hub.tolist(), strict=True))
            | {"stiffness": ROTOR.centre_stiffness, "angle": turned},
        },
        changed,
    )


def turning_wheel(place):
    """Write the terms of rotation of `wheel`; return keys of its TOML."""
    added, mass = rotation_of(ROTOR), bladed_disk(ROTOR).mass
    lift = in_plane()
    matrices = (
        lift.T @ matrix @ lift for matrix in (added.coriolis, added.stiffening, mass)
    )
    return turning_files(place, *matrices, lift.T @ added.load)


def turning_sector(place):
    """Write the terms of rotation of `sector`; return keys of its TOML."""
    parts, size = members(ROTOR), SIZE + 5
    coriolis, taut, mass = (np.zeros((size, size)) for _ in range(3))
    load = np.zeros(size)
    for part, mean in zip(parts, tensions(parts, SIZE), strict=True):
        length, section, lift = part.length, part.section, part.transform
        stiff = stiffening_of(length, section, part.start[0], mean)
        grid = np.ix_(part.dofs, part.dofs)
        coriolis[grid] += lift.T @ coriolis_of(length, section) @ lift
        taut[grid] += lift.T @ stiff @ lift
        mass[grid] += lift.T @ beam(length, section)[0] @ lift
        load[part.dofs] += lift.T @ loads_of(length, section, part.start)[0]
    return turning_files(place, coriolis, taut, mass, load)


def turning_files(place, coriolis, taut, mass, load):
    files = {"coriolis": coriolis, "stress_stiffness": taut, "softening": mass}
    for name, matrix in files.items():
        sparse.save_npz(place / f"{name}.npz", sparse.csc_array(matrix))
    mmwrite(place / "load.mtx", load[:, None])
    names = {name: f"{name}.npz" for name in files}
    return names | {"centrifugal_load": "load.mtx"}


def write(path, document, changed):
    """Write a TOML with some keys changed, as table__key; None leaves a key out."""
    for name, value in changed.items():
        table, _, key = name.partition("__")
        place = document.setdefault(table, {}) if key else document
        place[key or table] = value
        if value is None:
            del place[key or table]
    path.write_text(tomli_w.dumps(document), encoding="utf-8")
    return path


def imported(path):
    """Return (what is told, the engine's file) of a TOML."""
    out = path.with_suffix(".h5")
    with redirect_stdout(io.StringIO()) as told:
        assert main(["import-model", str(path), "--out", str(out), "--json"]) == 0
    return json.loads(told.getvalue()), out


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    """Return {kind: (what is told, the engine's file)} of the wheel and its sector."""
    place = tmp_path_factory.mktemp("plain")
    return {"wheel": imported(wheel(place)), "sector": imported(sector(place))}


def told_wrong(path, capsys):
    """Return the one line that refuses a TOML."""
    out = path.with_name("never.h5")
    assert main(["import-model", str(path), "--out", str(out)]) == 2
    *progress, line = capsys.readouterr().err.splitlines()
    assert all(told.startswith("hpcwhirl: nodal diameter") for told in progress)
    assert line.startswith("hpcwhirl: error: ")
    assert not out.exists()
    return line


def test_a_wheel_has_the_frequencies_of_its_own_reduction(plain):
    truth, (told, out) = own_reduction(), plain["wheel"]
    assert told["modes"] == truth.kept
    np.testing.assert_allclose(
        told["frequencies_hz"], truth.omega / (2 * np.pi), rtol=1e-8
    )
    read = rotor_from(str(out), N, 0.0)
    np.testing.assert_allclose(read.omega, truth.omega, rtol=1e-8)
    k = 2 * N + 2
    np.testing.assert_allclose(
        read.stiffness[:k, :k], truth.stiffness[:k, :k], atol=1e-9 * 3.4e7
    )
    np.testing.assert_allclose(read.mass[:k, :k], truth.mass[:k, :k], atol=1e-9)


@pytest.mark.parametrize("plane", [False, True])
def test_a_sector_gives_its_wheel(plain, tmp_path, plane):
    whole, _ = plain["wheel"]
    told, out = imported(sector(tmp_path, plane=True)) if plane else plain["sector"]
    np.testing.assert_allclose(
        told["frequencies_hz"], whole["frequencies_hz"], rtol=1e-8
    )
    truth, read = own_reduction(), rotor_from(str(out), N, 0.0)
    np.testing.assert_allclose(
        read.stiffness, truth.stiffness, atol=1e-8 * abs(truth.stiffness).max()
    )
    k = 2 * N + 2
    np.testing.assert_allclose(read.mass[:k, :k], truth.mass[:k, :k], atol=1e-9)


def own_lines(model, speed, most=3000.0):
    found = wave_lines(model, N, speed)
    return [(x.nodal_diameter, x.rotating) for x in found if abs(x.rotating) < most]


def with_rotation(place, kind, **changed):
    """Write a wheel or a sector that turns, with changed keys; return its TOML."""
    terms = (turning_wheel if kind == "wheel" else turning_sector)(place)
    keys = {f"{kind}__{name}": file for name, file in terms.items()} | changed
    return (wheel if kind == "wheel" else sector)(place, **keys)


@pytest.fixture
def turned(tmp_path):
    return partial(with_rotation, tmp_path)


@pytest.fixture(scope="module")
def turning(tmp_path_factory):
    """Return {kind: (what is told, the engine's file)} of those that turn."""
    return {
        kind: imported(with_rotation(tmp_path_factory.mktemp(kind), kind))
        for kind in ("wheel", "sector")
    }


@pytest.mark.turns
@pytest.mark.parametrize("kind", ["wheel", "sector"])
def test_a_wheel_turns_as_its_whole_matrices_do(turning, kind):
    """One basis serves all speeds: frequencies to a thousandth."""
    facts, out = turning[kind]
    assert facts["turns"]
    found = rotor_from(str(out), N, 0.0, turns=True)
    still = {"damping": 0.0, "suspension_damping": 0.0}
    whole = len(bladed_disk(ROTOR).mass) - 2 * N - 2
    own = rotor_model(ROTOR.model_copy(update=still), whole, "full")
    assert found.cyclic
    for speed in (0.0, 270.0, 520.0, -520.0):
        one, other = (own_lines(model, speed) for model in (own, found))
        assert [k for k, _ in one] == [k for k, _ in other]
        lines = [[w for _, w in side] for side in (one, other)]
        assert lines[1] == pytest.approx(lines[0], rel=1e-3)
    assert tip_growth(found, N, 500.0) == pytest.approx(
        tip_growth(own, N, 500.0), rel=1e-3
    )


def test_a_shaft_s_mass_is_part_of_all_terms(turned, turning):
    path = turned("wheel", centre__mass=20.0)
    found = rotor_from(str(imported(path)[1]), N, 0.0, turns=True)
    hub = 2 * N
    with h5py.File(turning["wheel"][1]) as file:
        bare = {name: file[f"rotor/{name}"][()] for name in ("coriolis", "mass")}
    assert found.spin.coriolis[hub + 1, hub] == pytest.approx(
        bare["coriolis"][hub + 1, hub] + 20.0
    )
    assert found.mass[hub, hub] == pytest.approx(bare["mass"][hub, hub] + 20.0)


@pytest.mark.turns
def test_a_wheel_told_at_two_speeds_is_the_same(turned, turning, tmp_path):
    """To what both bases may lack, `sparse_modes.LACKING` of the energy of a mode."""
    disk, added = bladed_disk(ROTOR), rotation_of(ROTOR)
    one = rotor_from(str(turning["wheel"][1]), N, 0.0, turns=True)
    keys = {"speeds": [200.0, 500.0], "stress_stiffness": None, "softening": None}
    for name, speed in zip("ab", keys["speeds"], strict=True):
        at = disk.stiffness + speed**2 * (added.stiffening - disk.mass)
        at = sparse.csr_array(in_plane().T @ (at + at.T) @ in_plane() / 2)
        mmwrite(tmp_path / f"{name}.mtx", at, symmetry="symmetric", precision=17)
        keys[f"stiffness_{name}"] = f"{name}.mtx"
    path = turned("wheel", **{f"wheel__{name}": value for name, value in keys.items()})
    other = rotor_from(str(imported(path)[1]), N, 0.0, turns=True)
    for speed in (0.0, 350.0, 700.0):
        lines = [own_lines(model, speed) for model in (one, other)]
        assert np.array(lines[1]) == pytest.approx(np.array(lines[0]), rel=2e-4)


def skewed(place, sign):
    matrix = sparse.load_npz(place / "coriolis.npz")
    sparse.save_npz(place / "coriolis.npz", sparse.csc_array(sign * matrix))


@pytest.mark.parametrize(
    ("sign", "told"), [(-1.0, "it has the other sign"), (2.0, "it is 2 C")]
)
def test_another_coriolis_matrix_is_one_line(turned, tmp_path, capsys, sign, told):
    path = turned("sector")
    skewed(tmp_path, sign)
    assert told in told_wrong(path, capsys)


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"coriolis": None}, "has no coriolis: all terms of rotation or none"),
        ({"coriolis": "k.mtx"}, "(coriolis) must be skew-symmetric, got symmetric"),
        ({"coriolis": "softening.npz"}, "(coriolis) must be skew to 1e-09"),
        ({"softening": None}, "has no softening"),
        ({"speeds": [1.0, 2.0]}, "got both"),
        ({"centrifugal_load": "k.mtx"}, "must be real, "),
        ({"centrifugal_load": "softening.npz"}, "must end in .mtx"),
        (
            {"speeds": [2.0, 1.0], "stiffness_a": "k.mtx", "stiffness_b": "k.mtx",
             "stress_stiffness": None, "softening": None},
            "speeds must be two, ascending",
        ),
    ],
)  # fmt: skip
def test_wrong_terms_of_rotation_are_one_line(turned, capsys, changed, told):
    keys = {f"wheel__{name}": value for name, value in changed.items()}
    assert told in told_wrong(turned("wheel", **keys), capsys)


@pytest.mark.turns
@pytest.mark.parametrize("make", [wheel, sector])
def test_lanczos_and_large_factors_give_the_same_rotor(
    plain, tmp_path, monkeypatch, make
):
    path, wanted = make(tmp_path), plain[make.__name__][0]["frequencies_hz"]
    monkeypatch.setattr(sparse_modes, "DENSE", 0)
    found = imported(path)[0]["frequencies_hz"]
    np.testing.assert_allclose(found, wanted, rtol=1e-9)
    for name in factors.LIBRARIES:
        pytest.importorskip(name, reason=f"pip install {name}")
    monkeypatch.setattr(factors, "SMALL", 0)
    used, first = [], factors._cholesky
    monkeypatch.setattr(
        factors, "_cholesky", lambda *given: used.append(given) or first(*given)
    )
    again = imported(path)[0]["frequencies_hz"]
    np.testing.assert_allclose(again, found, rtol=1e-10)
    assert used


def test_modes_that_the_first_search_misses_are_found_by_the_second(monkeypatch):
    searches, first = [], sparse_modes._lowest

    def forgetful(k_ii, m_ii, solve, found, wanted):
        new = first(k_ii, m_ii, solve, found, wanted)
        searches.append(wanted)
        return new[:, [0, *range(3, wanted)]] if len(searches) == 1 else new

    monkeypatch.setattr(sparse_modes, "DENSE", 0)
    monkeypatch.setattr(sparse_modes, "_lowest", forgetful)
    disk = bladed_disk(ROTOR)
    mass, stiffness = (sparse.csr_array(a) for a in (disk.mass, disk.stiffness))
    found = sparse_modes.condensed(lambda: [mass, stiffness], 3, 20, pytest.fail)
    truth = eigh(disk.stiffness[3:, 3:], disk.mass[3:, 3:], eigvals_only=True)
    count = len(found.squared)
    assert count >= 20
    np.testing.assert_allclose(found.squared, truth[:count], rtol=1e-8)
    np.testing.assert_allclose(found.reach, truth[count], rtol=1e-5)


@pytest.mark.slow
def test_a_twin_is_never_left_behind(tmp_path):
    split = 0
    for modes in (22, 23):  # of two in a row, one parts a pair
        told, _ = imported(wheel(tmp_path, wheel__modes=modes))
        again, _ = imported(sector(tmp_path, sector__modes=modes))
        assert modes - 1 <= told["modes"] <= modes
        split += told["modes"] < modes
        np.testing.assert_allclose(
            told["frequencies_hz"], again["frequencies_hz"], rtol=1e-7
        )
    assert split > 0


def test_a_wheel_may_lie_at_any_angle(plain, tmp_path):
    straight, out = plain["wheel"]
    turned, other = imported(wheel(tmp_path, "turned", turned=0.7))
    np.testing.assert_allclose(
        turned["frequencies_hz"], straight["frequencies_hz"], rtol=1e-8
    )
    with h5py.File(out) as a, h5py.File(other) as b:
        miss = a["rotor/stiffness"][:14, :14] - b["rotor/stiffness"][:14, :14]
        assert abs(miss).max() <= 1e-9 * a["rotor/stiffness"][()].max()


def test_a_free_wheel_has_rigid_modes_and_its_mass(tmp_path):
    told, _ = imported(sector(tmp_path, centre__stiffness=0.0))
    assert told["rigid_modes"] == 2  # rotation is blocked in the sector's hub
    disk = bladed_disk(ROTOR)
    along = np.zeros(len(disk.mass))
    angle = 2 * np.pi * np.arange(N) / N
    for axis, share in ((0, np.cos(angle)), (1, -np.sin(angle))):
        nodes = np.arange(axis, SIZE, 3)
        along[(SIZE * np.arange(N)[:, None] + nodes).ravel()] = share.repeat(len(nodes))
    along[disk.centre[0]] = 1.0
    assert told["mass"] == pytest.approx(along @ disk.mass @ along, rel=1e-9)
    heavy, _ = imported(sector(tmp_path, centre__mass=50.0))
    assert heavy["mass"] == pytest.approx(told["mass"] + 50.0, rel=1e-9)
    assert heavy["rigid_modes"] == 0


def test_a_wheel_of_tips_and_centre_alone_stays_as_it_is(tmp_path):
    angle, hub = 2 * np.pi * np.arange(N) / N, 2 * N + np.arange(2)
    rigid = np.eye(2 * N + 2)
    rigid[0 : 2 * N : 2, hub] = -np.column_stack([np.cos(angle), np.sin(angle)])
    rigid[1 : 2 * N : 2, hub] = -np.column_stack([-np.sin(angle), np.cos(angle)])
    springs, weights = [2e7, 6.8e4] * N + [3.4e7] * 2, [0.9] * 2 * N + [60.0] * 2
    matrices = np.diag(weights), rigid.T @ np.diag(springs) @ rigid
    with h5py.File(tmp_path / "given.h5", "w") as file:
        for name, matrix in zip(("mass", "stiffness"), matrices, strict=True):
            whole = sparse.csr_array(matrix)
            for part in ("data", "indices", "indptr"):
                data, packed = getattr(whole, part), {"compression": "gzip"}
                file.create_dataset(f"{name}/{part}", data=data, chunks=(8,), **packed)
    tips = np.arange(2 * N).reshape(N, 2).T.tolist()
    document = {
        "wheel": {"mass": "given.h5", "stiffness": "given.h5", "blades": N},
        "tips": dict(zip(("radial", "tangential"), tips, strict=True)),
        "centre": dict(zip("xy", hub.tolist(), strict=True)),
    }
    _, out = imported(write(tmp_path / "springs.toml", document, {}))
    with h5py.File(out) as file:
        for name, matrix in zip(("mass", "stiffness"), matrices, strict=True):
            miss = abs(file[f"rotor/{name}"][()] - matrix).max()
            assert miss <= 1e-15 * abs(matrix).max()


def test_what_is_held_is_left_out(tmp_path):
    hub = bladed_disk(ROTOR).centre
    told, _ = imported(wheel(tmp_path, wheel__held=list(hub), centre=None))
    clamped = modal_model(
        bladed_disk(ROTOR.model_copy(update={"centre": "clamped"})), 0.0, MODES
    )
    np.testing.assert_allclose(
        told["frequencies_hz"], clamped.omega / (2 * np.pi), rtol=1e-8
    )


@pytest.mark.parametrize("suffix", [".npz", ".h5"])
def test_every_kind_of_file_tells_the_same(plain, tmp_path, suffix):
    told, _ = imported(wheel(tmp_path, **compressed(tmp_path, suffix)))
    wanted = plain["wheel"][0]["frequencies_hz"]
    np.testing.assert_allclose(told["frequencies_hz"], wanted, rtol=1e-9)


def compressed(place, suffix):
    """Write the wheel's matrices as CSR; return the keys that name them."""
    wheel(place)
    names = {}
    for kind, file in (("mass", "m"), ("stiffness", "k")):
        matrix = sparse.csr_array(mmread(place / f"{file}.mtx"))
        names[f"wheel__{kind}"] = f"{file}{suffix}"
        if suffix == ".npz":
            sparse.save_npz(place / f"{file}.npz", matrix)
            continue
        with h5py.File(place / f"{file}.h5", "w") as out:
            for part in ("data", "indices", "indptr"):
                out[f"{kind}/{part}"] = getattr(matrix, part)
    return names


def test_a_compressed_matrix_must_be_square(tmp_path, capsys):
    path = wheel(tmp_path, **compressed(tmp_path, ".npz"))
    matrix = sparse.load_npz(tmp_path / "k.npz")
    sparse.save_npz(tmp_path / "k.npz", sparse.csr_array(matrix)[:-1])
    assert "be square" in told_wrong(path, capsys)


def rewritten(place, change, kind="k", **options):
    """Change a matrix of the wheel and write it again."""
    matrix = sparse.lil_array(mmread(place / f"{kind}.mtx"))
    matrix = change(matrix) if callable(change) else matrix
    mmwrite(place / f"{kind}.mtx", sparse.coo_array(matrix), **options)


def put(row, column, value):
    def change(matrix):
        matrix[row, column] = value
        return matrix

    return change


def cut_off(matrix):
    """Part two unknowns from all others: they hold each other alone."""
    matrix[[3, 4], :] = 0.0
    matrix[:, [3, 4]] = 0.0
    matrix[3, 3] = matrix[4, 4] = 1e6
    matrix[3, 4] = matrix[4, 3] = -1e6 * (1 - 1e-15)
    return matrix


MATRICES = [
    (put(3, 4, 1e9), {"symmetry": "general"}, "k", "symmetric"),
    (put(3, 3, np.nan), {"symmetry": "general"}, "k", "finite, got nan"),
    (lambda a: a.astype(complex), {}, "k", "be real, got complex"),
    (sparse.triu, {"symmetry": "general"}, "k", "write both"),
    (lambda a: a.tocsr()[:-1], {}, "k", "be square"),
    (lambda a: a.tocsr()[:-1, :-1], {}, "k", "be of one size"),
    (put(5, 5, -1.0), {}, "m", "mass must be positive, got -1 at degree of freedom 5"),
    (put(5, 5, 0.0), {}, "m", "mass must be positive, got 0 at degree of freedom 5"),
    (lambda a: a.tocsr() * 0, {}, "m", "not 0"),
    (lambda a: -a.tocsr(), {}, "k", "stiffness must be positive"),
    (cut_off, {"symmetry": "symmetric"}, "k", "must hold every part"),
    (
        lambda a: a + sparse.coo_array(([9e9, 9e9], ([6, 7], [7, 6])), a.shape),
        {}, "k", "stiffness must be positive semidefinite",
    ),
    (
        lambda a: a + sparse.coo_array(([9e3, 9e3], ([6, 7], [7, 6])), a.shape),
        {}, "m", "mass must be positive definite",
    ),
]  # fmt: skip


@pytest.mark.parametrize(("change", "options", "kind", "told"), MATRICES)
def test_a_wrong_matrix_is_one_line(tmp_path, capsys, change, options, kind, told):
    path = wheel(tmp_path)
    rewritten(tmp_path, change, kind, **options)
    assert told in told_wrong(path, capsys)


TIPS = (SIZE * np.arange(N)[:, None] + TIP).T.tolist()
LAST = SIZE * N + 1
TABLES = [
    ({"tips__x": TIPS[0][1:]}, "name 6 degrees of freedom, got 5"),
    ({"tips__x": None}, "[tips] has no x"),
    ({"tips": None}, "[tips] has no radial"),
    ({"tips__x": [i + 1 for i in TIPS[0]]}, "named twice"),
    ({"tips__y": [i + 1 for i in TIPS[1]]}, "a translation of tips and centre"),
    ({"tips__x": TIPS[1], "tips__y": TIPS[0]}, "a translation of tips and centre"),
    ({"tips__angle": 0.1, "centre__angle": 0.0}, "a translation of tips and centre"),
    ({"tips__angle": [-i * 1.0 for i in range(N)]}, "anticlockwise"),
    ({"tips__radial": TIPS[0]}, "x, y or radial, tangential, got both"),
    ({"centre__x": LAST, "centre__y": LAST + 1}, "these numbers begin with 0"),
    ({"centre__x": -1}, f"be 0 to {LAST}, got -1"),
    ({"centre__y": True}, "whole numbers"),
    ({"centre__stiffness": -1.0}, "number >= 0"),
    ({"centre__stiffness": float("nan")}, "number >= 0"),
    ({"wheel__held": [0, 1, 2, TIPS[0][0]]}, f"{TIPS[0][0]} is named twice"),
    ({"wheel__blades": N + 1}, "name 7 degrees of freedom, got 6"),
    ({"wheel__blades": 0}, "whole number 1 to"),
    ({"wheel__modes": 10**6}, "whole number 0 to"),
    ({"wheel__mass": "m.mat"}, "end in .mtx, .npz, .mas, .sti, .h5"),
    ({"wheel__mass": "none.mtx"}, "No such file"),
    ({"wheel__mass": "."}, "end in .mtx"),
    ({"wheel__mass": 3}, "name of a file"),
    ({"wheel__mas": "m.mtx"}, "did you mean 'mass'"),
    ({"weel__mass": "m.mtx"}, "did you mean 'wheel'"),
    ({"wheel": None}, "one of the tables"),
    ({"sector__mass": "m.mtx"}, "one of the tables [wheel], [sector], got 2"),
]  # fmt: skip


@pytest.mark.parametrize(("changed", "told"), TABLES)
def test_a_wrong_table_is_one_line(tmp_path, capsys, changed, told):
    assert told in told_wrong(wheel(tmp_path, **changed), capsys)


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"sector__blades": N + 1}, "look at blades"),
        ({"sector__blades": 2}, "whole number 3 to"),
        ({"sector__right": [SIZE, SIZE + 1]}, "left and right must be of one length"),
        ({"sector__left": [1, 0, 2]}, "a translation of tips and centre"),
        ({"sector__left": [SIZE + i for i in range(3)], "sector__right": [0, 1, 2],
          "sector__held": [0]}, "named twice"),
        ({"sector__left": None, "sector__right": None}, "neither left and right"),
        ({"sector__left_x": [4], "sector__right_x": [5]}, "left_x and left_y"),
    ],
)  # fmt: skip
def test_a_wrong_sector_is_one_line(tmp_path, capsys, changed, told):
    assert told in told_wrong(sector(tmp_path, **changed), capsys)


def linked(place):
    with h5py.File(place / "k.h5", "r+") as file:
        file.move("stiffness/data", "aside")
        with h5py.File(place / "other.h5", "w") as other:
            other["data"] = file["aside"][()]
        file["stiffness/data"] = h5py.ExternalLink("other.h5", "/data")
    return "stiffness/data as a link to another file, other.h5"


def linked_group(place):
    (place / "k.h5").rename(place / "other.h5")
    with h5py.File(place / "k.h5", "w") as file:
        file["stiffness"] = h5py.ExternalLink("other.h5", "/stiffness")
    return "stiffness as a link to another file, other.h5"


def out_of_range(place):
    with h5py.File(place / "k.h5", "r+") as file:
        file["stiffness/indices"][0] = 10**6
    return "cannot read"


def no_csr(place):
    with h5py.File(place / "k.h5", "r+") as file:
        del file["stiffness/indptr"]
    return "has no stiffness/indptr"


def complex_data(place):
    with h5py.File(place / "k.h5", "r+") as file:
        data = file["stiffness/data"][()]
        del file["stiffness/data"]
        file["stiffness/data"] = data + 0j
    return "must be real, got complex"


def no_group(place):
    with h5py.File(place / "k.h5", "r+") as file:
        file.move("stiffness", "K")
    return "has no group stiffness"


def no_hdf5(place):
    (place / "k.h5").write_bytes(b"no HDF5 at all")
    return "cannot read"


def vast(place):
    with h5py.File(place / "k.h5", "r+") as file:
        del file["stiffness/data"]
        file.create_dataset("stiffness/data", (10**12,), "f8", chunks=(1000,))
    return "at most 300000000 entries"


@pytest.mark.parametrize(
    "spoil",
    [linked, linked_group, out_of_range, no_csr, complex_data, no_group, no_hdf5, vast],
)
def test_a_wrong_hdf5_file_is_one_line(tmp_path, capsys, spoil):
    path = wheel(tmp_path, **compressed(tmp_path, ".h5"))
    told = spoil(tmp_path)
    line = told_wrong(path, capsys)
    assert told in line
    assert "k.h5" in line


def pickled(place):
    held = dict(np.load(place / "k.npz"))
    held["data"] = np.array([print], dtype=object)
    np.savez(place / "k.npz", **held)
    return "must be real, got object"


def coordinates(place):
    sparse.save_npz(place / "k.npz", sparse.coo_array(mmread(place / "k.mtx")))
    return "save_npz in CSR or CSC"


def claimed(place):
    """Claim 10^9 entries in the header of an array that has a few."""
    with zipfile.ZipFile(place / "k.npz") as old:
        parts = {name: old.read(name) for name in old.namelist()}
    head = parts["data.npy"]
    parts["data.npy"] = re.sub(rb"\(\d+,\), }\s{5}", b"(99999999,), }", head, count=1)
    assert b"(99999999,)" in parts["data.npy"]
    with zipfile.ZipFile(place / "k.npz", "w") as new:
        for name, data in parts.items():
            new.writestr(name, data)
    return "data is cut short"


@pytest.mark.parametrize("spoil", [pickled, coordinates, claimed])
def test_a_wrong_npz_file_is_one_line(tmp_path, capsys, spoil):
    path = wheel(tmp_path, **compressed(tmp_path, ".npz"))
    assert spoil(tmp_path) in told_wrong(path, capsys)


@pytest.mark.parametrize("suffix", [".npz", ".h5", ".mtx"])
def test_a_matrix_beyond_the_free_memory_is_one_line(
    tmp_path, capsys, monkeypatch, suffix
):
    """By what its header tells, before it is read."""
    files = {} if suffix == ".mtx" else compressed(tmp_path, suffix)
    path = wheel(tmp_path, **files)
    place = "hpcwhirl.store.models.sparse_file"
    monkeypatch.setattr(f"{place}._free_memory", lambda: 100.0)
    for reader in ("numpy.load", "scipy.io.mmread"):
        monkeypatch.setattr(reader, lambda *_, **__: pytest.fail("it was read"))
    assert "arrays of at most 3.3e-08 GB, 1/3 of the memory" in told_wrong(path, capsys)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("%%MatrixMarket matrix coordinate real general\n9 9 99999999\n", "cut short"),
        ("%%MatrixMarket matrix coordinate pattern general\n1 1 1\n1 1\n", "pattern"),
        ("%%MatrixMarket matrix coordinate real skew-symmetric\n1 1 0\n", "symmetric"),
        ("%%MatrixMarket matrix coordinate real general\n2 2 1\n3 3 1.0\n", "cannot"),
        ("%%MatrixMarket matrix coordinate real general\n2 2 2\n1 1 1.0\n", "cannot"),
        ("no matrix\n", "cannot read"),
        ("", "cannot read"),
    ],
)
def test_a_wrong_matrix_market_file_is_one_line(tmp_path, capsys, text, told):
    path = wheel(tmp_path)
    (tmp_path / "k.mtx").write_text(text)
    assert told in told_wrong(path, capsys)


def test_what_is_read_is_not_overwritten(tmp_path, capsys):
    path = wheel(tmp_path, **compressed(tmp_path, ".h5"))
    held = (tmp_path / "k.h5").read_bytes()
    assert main(["import-model", str(path), "--out", str(tmp_path / "k.h5")]) == 2
    assert "which this command reads" in capsys.readouterr().err
    assert (tmp_path / "k.h5").read_bytes() == held


def test_a_file_without_end_is_refused(tmp_path, capsys):
    path = wheel(tmp_path)
    (tmp_path / "k.mtx").unlink()
    os.mkfifo(tmp_path / "k.mtx")
    assert "not a regular file" in told_wrong(path, capsys)


@pytest.mark.slow
def test_the_imported_rotor_is_marched(plain, capsys):
    settings = [
        f"file={plain['sector'][1]}",
        f"blades={N}",
        "duration=0.002",
        "preset=draft",
    ]
    words = [w for s in settings[:3] for w in ("--set", s)]
    assert main(["run", *words, "--preset", "draft", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["outcome"] == "completed"


def test_the_example_has_every_key_and_is_read_as_it_stands(
    tmp_path, monkeypatch, capsys
):
    assert main(["import-model", "--example"]) == 0
    text = capsys.readouterr().out
    told = tomllib.loads(re.sub(r"^# (?=\[|\w+ = )", "", text, flags=re.MULTILINE))
    told["sector"] |= dict.fromkeys(TURNING)  # as of a wheel
    assert {name: {*keys} for name, keys in told.items()} == {
        name: {*keys} for name, keys in KNOWN.items()
    }
    monkeypatch.chdir(tmp_path)
    (tmp_path / "wheel.toml").write_text(text)
    for name in ("mass", "stiffness"):
        sparse.save_npz(f"{name}.npz", sparse.csr_array(np.eye(6)))
    found = read_wheel(tmp_path / "wheel.toml")
    assert (found.blades, found.tips.tolist()) == (3, [[0, 1], [2, 3], [4, 5]])


def test_without_a_file_the_way_to_an_example_is_told(capsys):
    assert main(["import-model"]) == 2
    assert "--example" in capsys.readouterr().err


def test_files_of_calculix_are_the_wheel(tmp_path):
    own, ccx = (read_wheel(make(tmp_path)) for make in (wheel, in_calculix))
    for name in ("mass", "stiffness"):
        miss = getattr(own, name) - getattr(ccx, name)
        assert np.abs(miss).max() <= 1e-15 * np.abs(getattr(own, name)).max()
    assert (own.tips == ccx.tips).all()
    assert (own.centre.dofs == ccx.centre.dofs).all()


@pytest.mark.parametrize(
    ("file", "text", "told"),
    [
        ("ccx.toml", None, "tips. x must be \"node.direction\" of .dof, got '1.9'"),
        ("ccx.mas", "1 1\n", "have lines of row, column, value"),
        ("ccx.mas", "0 1 2.0\n", "whole numbers from 1 on"),
        ("ccx.sti", "1 1 x\n", "ccx.sti"),
        ("wheel.inp", "*NODE\n", "SOLVER=MATRIXSTORAGE lets CalculiX write .mas"),
        ("ccx.dof", None, "FILE.toml names mass and stiffness"),
    ],
)
def test_what_is_wrong_with_files_of_calculix_is_told(file, text, told, tmp_path):
    path = in_calculix(tmp_path)
    if file == "ccx.toml":
        document = tomllib.loads(path.read_text())
        document["tips"]["x"][0] = "1.9"
        path.write_text(tomli_w.dumps(document))
    elif text is not None:
        (tmp_path / file).write_text(text)
    if not file.endswith((".mas", ".sti")):
        path = tmp_path / file
    with pytest.raises((InputError, MissingFileError), match=told) as refused:
        read_wheel(path)
    assert "\n" not in str(refused.value)
