"""Engines from elsewhere and mistuned ones: what they equal, and what is refused."""

import shutil
from dataclasses import replace

import h5py
import numpy as np
import pytest
import rotor_files
from alike import assert_alike
from launch import words_of

from hpcwhirl.campaign.begin import prepare
from hpcwhirl.campaign.plan.design import design_of, load_design
from hpcwhirl.case.resolve import resolve
from hpcwhirl.cli import main
from hpcwhirl.dynamics.kernels.loop.wave_types import PointsRotor, SlotRotor
from hpcwhirl.dynamics.march import March
from hpcwhirl.dynamics.schemes import scheme_of
from hpcwhirl.errors import InputError, MissingFileError, ModelError
from hpcwhirl.reduction.bodies import rotor_model
from hpcwhirl.reduction.families import modal_table
from hpcwhirl.reduction.mistuned import boundary_of, whole_model
from hpcwhirl.reduction.model import model_of
from hpcwhirl.reduction.modes import modal_model
from hpcwhirl.scene import (
    Rotor,
    Scene,
    apply_settings,
    digest,
    load_scene,
    named_scene,
    parse_setting,
    scene_from,
    to_toml,
)
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.reading.reader import open_results
from hpcwhirl.store.results.gather import gather
from hpcwhirl.structure import bladed_disk
from hpcwhirl.structure.bladed_disk import NODE, blade

SMALL = {"blades": 6, "engine.rotor.elements": 3, "modes": 18}
MATRICES = ("mass", "stiffness", "damping", "tip_radial", "tip_tangential", "centre")
MODAL = ("omega", "modal_tip_radial", "modal_tip_tangential", "modal_centre")


def scene(**settings):
    fast = {"duration": 3e-3, "interval": 1e-5, "traces": "full", "time_step": 2e-6}
    return apply_settings(
        named_scene("table2"), fast | {"scheme": "general"} | settings
    )


def ended(**settings):
    return March(resolve(scene(**settings))).run()


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    """Return an exported engine of six blades."""
    path = tmp_path_factory.mktemp("small") / "rotor.h5"
    return rotor_files.exported(path, SMALL)


@pytest.fixture
def changed(exported, tmp_path):
    """Return a function: (names kept, {name: new array}) -> path of such a file."""

    def write(names, news=()):
        arrays = rotor_files.arrays_in(exported)
        kept = {name: arrays[name] for name in names} | dict(news)
        return rotor_files.written(tmp_path / "changed.h5", kept)

    return write


def small(file="", **settings):
    geometry = {"blades": 6} if file else SMALL
    return scene(**geometry, file=str(file), **settings)


def refusal(function, *arguments, kind=InputError):
    with pytest.raises(kind) as caught:
        function(*arguments)
    assert len(str(caught.value).splitlines()) == 1
    return str(caught.value)


# From elsewhere


def test_modes_alone_are_the_same_engine_as_their_matrices(changed):
    alike = {"suspension_damping": -1.0}  # such a file tells no damping
    whole = March(resolve(small(**alike))).run()
    path = changed(MODAL)
    assert_alike(March(resolve(small(path, **alike))).run(), whole)
    told = refusal(March, resolve(small(path, scheme="paper")))
    assert "scheme must be 'modal' or 'general', got 'paper'" in told


def rotor_of(scene):
    return scheme_of(resolve(scene).model, scene, 1).arrays.rotor


def test_only_a_tuned_rotor_takes_the_cyclic_kernel(exported):
    tuned = small(scheme="modal")
    again, other = small(exported, scheme="modal"), small(mistuning=[0.0] * 6)
    for equal in (tuned, apply_settings(again, {"scheme": "modal"})):
        assert isinstance(rotor_of(equal), SlotRotor)
    other = apply_settings(other, {"scheme": "modal"})
    assert isinstance(rotor_of(other), PointsRotor)


@pytest.fixture
def unevenly_damped(exported, changed):
    """Return a file whose damping differs from mode to mode, and its ratios."""
    rotor = resolve(small(exported)).model.rotor
    ratios = np.linspace(0.001, 0.02, len(rotor.omega))
    pairs = (rotor.diameter % 3 != 0) & (rotor.phase == 1)
    ratios[pairs] = ratios[np.flatnonzero(pairs) - 1]  # a pair's members are arbitrary
    damped = replace(rotor, damping=ratios).damping_matrix()
    return changed(MATRICES, {"damping": damped}), ratios


def test_damping_of_a_file_comes_mode_by_mode(unevenly_damped):
    path, ratios = unevenly_damped
    again = resolve(small(path)).model.rotor
    assert again.ratios == pytest.approx(ratios, rel=1e-6)
    one, other = (
        March(resolve(small(path, scheme=s))).run() for s in ("general", "paper")
    )
    assert_alike(one, other)
    whole = sum(one.ledger[n] for n in ("pulse", "rotation", "friction"))
    assert abs(one.ledger["residual"]) < 1e-9 * abs(whole)


@pytest.mark.turns
@pytest.mark.parametrize("scheme", ["general", "paper"])
def test_gaps_stay_open_whatever_the_damping_of_a_mode(unevenly_damped, scheme):
    march = March(resolve(small(unevenly_damped[0], scheme=scheme, time_step=5e-6)))
    touched, lowest, step = 0, np.inf, march.scene.solver.time_step
    while not march.done:
        march.advance(1)
        rotor, casing = march.displacements()
        angle = march.scene.speed * march.steps * step
        radial, _ = march.model.ring.rows(angle + 2 * np.pi * np.arange(6) / 6)
        gaps = march.scene.gap + radial @ casing - rotor[0:12:2]
        lowest = min(lowest, gaps.min())
        touched += np.count_nonzero(np.abs(gaps) < 1e-15)
    assert touched > 30
    assert lowest > -1e-14


def test_a_clamped_file_keeps_its_centre_at_rest(tmp_path):
    clamped = {"centre": "clamped"}
    path = rotor_files.exported(tmp_path / "clamped.h5", SMALL | clamped)
    found, own = (March(resolve(s)).run() for s in (small(path), small(**clamped)))
    assert not found.centre.any()
    assert np.abs(found.tips - own.tips).max() < 1e-8 * np.abs(own.tips).max()


@pytest.mark.parametrize("names", [MATRICES, MODAL])
def test_an_engine_from_file_is_exported_as_it_came(changed, tmp_path, names):
    path = changed(names)
    again = rotor_files.exported(tmp_path / "again.h5", {"blades": 6, "file": path})
    one, other = (resolve(small(f)).model.rotor for f in (path, again))
    assert other.omega == pytest.approx(one.omega, rel=1e-9)
    assert other.has_matrices == (names is MATRICES)


def test_model_tells_no_blade_stiffness_of_a_file(exported, facts):
    found = facts("model", "--json", *words_of({"blades": 6, "file": exported}))
    assert found["blade_stiffness"] is None
    assert {line["body"] for line in found["modes"]} == {"rotor", "casing"}


def spoilt(name, change):
    """Return a function: {name: array} -> the array changed, to be written."""

    def news(rotor):
        array = rotor[name].copy()
        return {name: change(array)}

    return news


def put(place, value):
    def change(array):
        array[place] = value
        return array

    return change


@pytest.mark.turns
@pytest.mark.parametrize(
    ("names", "news", "told"),
    [
        (MATRICES, spoilt("mass", lambda m: m[:-1]), "rotor/mass must be"),
        (MATRICES, spoilt("stiffness", lambda k: k[1:, 1:]), "rotor/stiffness must be"),
        (MATRICES, spoilt("mass", lambda m: m[0]), "2 dimensions, got 1"),
        (MATRICES, spoilt("mass", lambda m: m + 0j), "hold numbers, got complex128"),
        (MATRICES, spoilt("mass", put((0, 1), 1.0)),
         "mass must be symmetric to 1e-09 of its largest entry"),
        (MATRICES, spoilt("stiffness", put((0, 0), np.nan)), "finite, got nan"),
        (MATRICES, spoilt("mass", np.negative), "mass must be positive definite"),
        (MATRICES, spoilt("mass", lambda m: 0 * m), "mass must be positive definite"),
        (MATRICES, spoilt("stiffness", np.negative), "have a positive eigenvalue"),
        (MATRICES, spoilt("stiffness", put((0, 0), 0.0)), "positive semidefinite, got"),
        (MATRICES, spoilt("damping", put((0, 0), 100.0)), "must be modal"),
        (MATRICES, spoilt("damping", np.negative), "damping must be positive semi"),
        (MATRICES, spoilt("tip_radial", put(0, 99)), "be indices 0 to 31, got 99"),
        (MATRICES, spoilt("tip_tangential", put(0, -1)), "0 to 31, got -1"),
        (MATRICES, spoilt("tip_radial", put(0, 1)), "names coordinate 1 twice"),
        (MATRICES, spoilt("centre", lambda c: c[:1]), "name 0 or 2 coordinates, got 1"),
        (MATRICES, spoilt("centre", lambda c: c + 0.5), "whole numbers, got float64"),
        (MATRICES, spoilt("tip_radial", lambda t: t[1:]), "has 5 blades"),
        ((*MATRICES, "shapes"), spoilt("mass", lambda m: m), "has no rotor/omega"),
        ((*MATRICES, "shapes", "omega"), spoilt("shapes", lambda s: 1.001 * s),
         "shapes must be mass-orthonormal to 1e-06, got 0.002"),
        ((*MATRICES, "shapes", "omega"), spoilt("omega", lambda w: 1.001 * w),
         "omega must be the frequencies of rotor/shapes"),
        ((*MATRICES, "shapes", "omega"), spoilt("shapes", lambda s: s[1:]),
         "shapes must be (32, 32), got (31, 32)"),
        (MATRICES[1:], spoilt("damping", lambda d: d), "has no rotor/mass"),
        (MATRICES[:1], spoilt("mass", lambda m: m), "has no rotor/stiffness"),
        (MODAL[1:], spoilt("modal_centre", lambda c: c), "has no rotor/omega"),
        (MODAL, spoilt("omega", np.negative), "omega must be >= 0"),
        (MODAL, spoilt("omega", lambda w: w[:-1]), "must be (6, 31), got (6, 32)"),
        (MODAL, spoilt("modal_tip_radial", lambda t: t[1:]), "has 5 blades"),
        (MODAL, spoilt("modal_centre", lambda c: c[:1]), "be (2, 32), got (1, 32)"),
        (MODAL, spoilt("damping", lambda d: d), "damping without rotor/mass"),
    ],
)  # fmt: skip
def test_a_wrong_file_is_told_in_one_line(exported, changed, names, news, told):
    path = changed(names, news(rotor_files.arrays_in(exported)))
    text = refusal(model_of, small(path))
    assert told in text
    assert str(path) in text


@pytest.mark.parametrize("link", [False, True])
def test_what_is_no_array_is_refused(changed, link):
    path = changed(MATRICES[1:])
    with h5py.File(path, "r+") as file:
        if link:
            file["rotor/mass"] = h5py.SoftLink("/nowhere")
        else:
            file.create_group("rotor/mass")
    told = "leads nowhere: /nowhere" if link else "numbers, got no array"
    assert told in refusal(model_of, small(path))


def test_a_file_without_loss_is_not_damped(changed):
    path = changed(MATRICES, {"damping": np.zeros((32, 32))})
    assert not resolve(small(path)).model.rotor.ratios.any()


def test_other_blades_than_the_files_are_refused_with_both_numbers(exported):
    text = refusal(model_of, scene(file=str(exported)))
    assert "has 6 blades" in text
    assert "engine.rotor.blades is 22" in text


@pytest.mark.parametrize("content", [None, b"no HDF5"])
def test_a_file_that_cannot_be_read_is_named(tmp_path, content):
    path = tmp_path / "none.h5"
    if content:
        path.write_bytes(content)
    assert str(path) in refusal(model_of, small(path), kind=MissingFileError)
    assert main(["model", *words_of({"file": path})]) == 2


def test_a_file_without_a_rotor_is_refused(tmp_path):
    with h5py.File(tmp_path / "empty.h5", "w") as file:
        file["rotor"] = 3
    assert "has no group rotor" in refusal(model_of, small(tmp_path / "empty.h5"))


# Paths and content


def test_a_relative_path_starts_where_it_is_written(exported, tmp_path, monkeypatch):
    (tmp_path / "here").mkdir()
    path = tmp_path / "here" / "scene.toml"
    path.write_text('[engine]\nfile = "../rotor.h5"\n')
    want = str(tmp_path / "rotor.h5")
    assert load_scene(path).engine.file == want
    monkeypatch.chdir(tmp_path)
    assert scene(file="rotor.h5").engine.file == want
    path.write_text('[sweep]\n"engine.file" = ["../rotor.h5"]\n')
    shutil.copy(exported, want)
    design = load_design(path, {})
    assert design.scenes[0].engine.file == design.settings[0]["engine.file"] == want


def test_the_digest_is_of_the_content_too(exported, tmp_path):
    path = shutil.copy(exported, tmp_path)
    before = digest(small(path))
    assert digest(small(path)) == before
    with h5py.File(path, "r+") as file:
        file["rotor/stiffness"][0, 0] *= 1.01
    assert digest(small(path)) != before


@pytest.mark.parametrize("table", ["engine", "sweep"])
def test_a_campaign_refuses_to_continue_with_another_content(exported, tmp_path, table):
    path = shutil.copy(exported, tmp_path)
    document = {
        "engine": {"rotor": {"blades": 6}},
        "sweep": {"speed": [300.0]},
        "solver": {"time_step": 2e-6},
    }
    files = {"engine": {"file": path}, "sweep": {"engine.file": [path]}}
    document[table] |= files[table]
    prepare(design_of(document), Directory(tmp_path / "out"))
    prepare(design_of(document), Directory(tmp_path / "out"))
    with h5py.File(path, "r+") as file:
        file["rotor/stiffness"][0, 0] *= 1.01
    text = refusal(prepare, design_of(document), Directory(tmp_path / "out"))
    assert ("engine.file (SHA-256)" in text) == (table == "engine")
    assert (f"other content of {path}" in text) == (table == "sweep")


# Mistuning


def test_no_change_of_any_blade_is_the_tuned_engine():
    zeros = {"mistuning": [0.0] * 22}
    tuned, whole = (resolve(scene(**s)).model.rotor for s in ({}, zeros))
    assert whole.omega == pytest.approx(tuned.omega, rel=1e-9)
    assert (whole.diameter == tuned.diameter).all()
    assert (whole.rank == tuned.rank).all()
    assert whole.centre_share == pytest.approx(tuned.centre_share, abs=1e-9)
    assert_alike(ended(**zeros), ended())


def test_all_blades_changed_alike_is_another_young_of_the_blades():
    change = 0.3
    disk = bladed_disk(Rotor(blades=6))
    stiffness = disk.stiffness.copy()
    for j in range(6):
        own = slice(j * disk.sector_size, (j + 1) * disk.sector_size)
        stiffness[own, own] += blade(Rotor(young=210e9 * (1 + change)))[1]
        stiffness[own, own] -= blade(Rotor())[1]
    cyclic = modal_model(replace(disk, stiffness=stiffness), 0.01, 30)
    mistuned = rotor_model(Rotor(blades=6, mistuning=(change,) * 6), 30)
    assert mistuned.omega == pytest.approx(cyclic.omega, rel=1e-9)


@pytest.mark.turns
def test_relabelling_blades_leaves_the_basis_for_all_speeds():
    pattern = np.random.default_rng(1).normal(scale=0.05, size=6)
    kinds = [{"mistuning": tuple(np.roll(pattern, n))} for n in range(3)]
    for ways in (kinds, [{"lost_blade": n} for n in range(3)]):
        rotors = [Rotor(blades=6, elements=3, **own) for own in ways]
        base, *others = (rotor_model(each, 6, "full").omega for each in rotors)
        for omega in others:
            assert omega == pytest.approx(base, rel=1e-5)
            assert omega[:12] == pytest.approx(base[:12], rel=1e-6)


@pytest.mark.turns
def test_relabelling_mistuned_blades_permutes_the_answer():
    # a rigid casing that closes alike everywhere tells no blade from another
    rigid = {"kind": "rigid", "nodal_diameter": 0, "amplitude": 2e-4}
    pattern = [0.05 * np.sin(7.0 * j) for j in range(22)]
    one, other = (ended(mistuning=list(np.roll(pattern, n)), **rigid) for n in (0, 1))
    scale = np.abs(one.tips).max()
    assert one.contacts > 0
    assert np.abs(one.tips - one.tips[:, :1]).max() > 1e-4 * scale
    assert np.abs(np.roll(one.tips, 1, axis=1) - other.tips).max() < 1e-8 * scale
    c, s = np.cos(2 * np.pi / 22), np.sin(2 * np.pi / 22)
    turned = one.centre @ np.array([[c, s], [-s, c]])
    assert np.abs(turned - other.centre).max() < 1e-8 * np.abs(one.centre).max()


def test_a_softer_blade_splits_the_pairs_as_perturbation_theory_says():
    # all modes kept, so that the reduction is exact; delta far below the gaps
    delta = -1e-6
    rotor = Rotor(blades=6, elements=3)
    disk = bladed_disk(rotor)
    everything = len(disk.mass) - len(boundary_of(disk))
    tuned = modal_model(disk, 0.01)
    one = rotor.model_copy(update={"mistuning": (delta,) + (0.0,) * 5})
    softer = whole_model(bladed_disk(one), 0.01, everything)
    pushed = np.zeros_like(disk.stiffness)
    pushed[: disk.sector_size, : disk.sector_size] = delta * blade(rotor)[1]
    for rank in range(3):
        pair = np.flatnonzero((tuned.diameter == 2) & (tuned.rank == rank))
        phi = tuned.shapes[:, pair]
        first = np.linalg.eigvalsh(phi.T @ pushed @ phi)
        moved = softer.omega[pair] ** 2 - tuned.omega[pair] ** 2
        assert first[0] < 2 * first[1]  # both sink, one far more: the pair is split
        assert moved == pytest.approx(first, rel=0.02, abs=0.02 * abs(first.sum()))
        assert moved.sum() == pytest.approx(first.sum(), rel=0.01)


@pytest.mark.parametrize(
    ("blades", "centre"), [(1, "free"), (2, "clamped"), (3, "free"), (5, "clamped")]
)
def test_few_blades_may_be_mistuned(blades, centre):
    # one more fixed-interface mode than whole pairs of the tuned rotor hold
    settings = {"blades": blades, "engine.rotor.elements": 3, "centre": centre}
    pattern = [0.1, *(-0.05,) * (blades - 1)]
    for modes in (0, 4, 5):
        march = March(resolve(scene(modes=modes, mistuning=pattern, **settings)))
        rotor = march.model.rotor
        assert len(rotor.omega) == 2 * blades + 2 * (centre == "free") + modes
        given = set(zip(rotor.diameter, rotor.rank, rotor.phase, strict=True))
        assert len(given) == len(rotor.omega)
        march.advance(10)


@pytest.mark.turns
def test_strongly_mistuned_families_stay_whole():
    pattern = (-0.3, *(0.1 * np.sin(5.0 * j) for j in range(1, 22)))
    model = resolve(scene(mistuning=list(pattern))).model
    table = modal_table(model)
    first = [line for line in table if line.body == "rotor" and line.family == "1F"]
    assert len(first) == 22
    assert sum(line.family == "suspension" for line in table) == 2
    assert max(line.frequency_hz for line in first) < 50


def test_mistuning_is_set_written_and_read_back():
    name, value = parse_setting("mistuning=[0.01, -0.02, 0]")
    assert (name, value) == ("engine.rotor.mistuning", [0.01, -0.02, 0])
    made = apply_settings(Scene(), {"blades": 3, name: value})
    assert made.engine.rotor.mistuning == (0.01, -0.02, 0.0)
    assert "mistuning" in to_toml(made)


@pytest.mark.parametrize(
    ("value", "told"),
    [
        ([0.0] * 21 + [-1.0], "must be > -1.0, got -1.0"),
        ([0.0] * 21 + [np.nan], "finite"),
        ([0.0] * 21 + ["soft"], "a number, got 'soft'"),
        (0.1, "a list of numbers, got 0.1"),
    ],
)
def test_wrong_mistuning_is_told_in_one_line(value, told):
    text = refusal(scene_from, {"engine": {"rotor": {"mistuning": value}}})
    assert "mistuning" in text
    assert told in text


def test_more_modes_than_a_mistuned_rotor_has_are_refused():
    rotor = Rotor(blades=3, elements=2, mistuning=(0.1, 0.0, 0.0))
    assert "got 1000: 3 blades have 21" in refusal(rotor_model, rotor, 1000)
    assert len(rotor_model(rotor, 21).omega) == 29  # all of them


def test_a_mistuned_disk_is_not_taken_for_a_cyclic_one():
    disk = bladed_disk(Rotor(blades=3, mistuning=(0.1, 0.0, 0.0)))
    with pytest.raises(ModelError, match="mistuned"):
        modal_model(disk, 0.01, 9)
    assert disk.sector_size % NODE == 0


def test_mistuning_may_be_swept_and_is_kept_in_the_results(tmp_path):
    lists = [[0.0, 0.0, 0.1], [0.0, 0.2, 0.0]]
    sweep = {"engine.rotor.mistuning": lists}
    engine, solver = {"rotor": {"blades": 3}}, {"modes": 15}
    design = design_of({"engine": engine, "solver": solver, "sweep": sweep})
    assert [list(s.engine.rotor.mistuning) for s in design.scenes] == lists
    prepare(design, Directory(tmp_path))
    data = open_results(gather(Directory(tmp_path), {}))
    assert data["rotor_mistuning"].to_numpy().tolist() == [
        "[0.0, 0.0, 0.1]", "[0.0, 0.2, 0.0]",
    ]  # fmt: skip
