"""Hostile engine files: what escapes the digest, has no end, or has no room."""

import json
import os
import resource
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from hpcwhirl.cli import main
from hpcwhirl.errors import InputError, MissingFileError, WhirlError
from hpcwhirl.reduction.imported import rotor_from
from hpcwhirl.scene import digest, named_scene, scene_from
from hpcwhirl.scene.case_digest import MOST_BYTES
from hpcwhirl.scene.plain_data import apply_settings
from hpcwhirl.store.models.engine_file import LARGEST, read_group

SMALL = ("--set", "blades=6", "--set", "engine.rotor.elements=3", "--set", "modes=18")


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    """Return an exported engine of six blades."""
    path = tmp_path_factory.mktemp("engine") / "rotor.h5"
    assert main(["export-model", str(path), *SMALL]) == 0
    return path


@pytest.fixture
def engine(exported, tmp_path):
    """Return a copy of an exported engine, to be spoilt."""
    return Path(shutil.copy(exported, tmp_path / "engine.h5"))


def refusal(path, kind=InputError):
    with pytest.raises(kind) as caught:
        rotor_from(str(path), 6, 0.01)
    assert len(str(caught.value).splitlines()) == 1
    assert str(path) in str(caught.value)
    return str(caught.value)


def moved(path, name):
    """Take a dataset out of an engine's file; return it and the file it is now in."""
    other = path.with_name("elsewhere.h5")
    with h5py.File(path, "r+") as file, h5py.File(other, "w") as new:
        array = file[name][()]
        new["there"] = array
        del file[name]
    return array, other


def linked(path):
    _, other = moved(path, "rotor/stiffness")
    with h5py.File(path, "r+") as file:
        file["rotor/stiffness"] = h5py.ExternalLink(other.name, "/there")
    return "rotor/stiffness", "link to another file, elsewhere.h5"


def linked_group(path):
    with h5py.File(path.with_name("elsewhere.h5"), "w") as new, h5py.File(path) as old:
        old.copy("rotor", new)
    with h5py.File(path, "r+") as file:
        del file["rotor"]
        file["rotor"] = h5py.ExternalLink("elsewhere.h5", "/rotor")
    return "has rotor as", "link to another file, elsewhere.h5"


def linked_twice(path):
    _, other = moved(path, "rotor/stiffness")
    with h5py.File(path, "r+") as file:
        del file["casing/stiffness"]
        file["casing/stiffness"] = h5py.ExternalLink(other.name, "/there")
        file["rotor/stiffness"] = h5py.SoftLink("/casing/stiffness")
    return "stiffness", "link to another file, elsewhere.h5"


def linked_aside(path):
    _, other = moved(path, "rotor/stiffness")
    with h5py.File(path, "r+") as file:
        file["aside"] = h5py.ExternalLink(other.name, "/")
        file["rotor/stiffness"] = h5py.SoftLink("/aside/there")
    return "unknown aside", "known: casing, rotor"


def raw(path):
    array, _ = moved(path, "rotor/stiffness")
    (path.parent / "raw.bin").write_bytes(array.tobytes())
    with h5py.File(path, "r+") as file:
        file.create_dataset(
            "rotor/stiffness", array.shape, array.dtype,
            external=[(str(path.parent / "raw.bin"), 0, array.nbytes)],
        )  # fmt: skip
    return "rotor/stiffness", "in another file, ", "raw.bin"


def virtual(path):
    array, other = moved(path, "rotor/stiffness")
    layout = h5py.VirtualLayout(array.shape, array.dtype)
    layout[:] = h5py.VirtualSource(other, "there", array.shape)
    with h5py.File(path, "r+") as file:
        file.create_virtual_dataset("rotor/stiffness", layout)
    return "rotor/stiffness", "virtual dataset"


@pytest.mark.parametrize(
    "escape", [linked, linked_group, linked_twice, linked_aside, raw, virtual]
)
def test_what_lies_in_another_file_is_refused_by_name(engine, escape):
    told = escape(engine)
    text = refusal(engine)
    assert all(word in text for word in told)


def test_a_link_inside_the_file_is_of_the_digest_and_may_stay(engine, exported):
    with h5py.File(engine, "r+") as file:
        file.move("rotor/stiffness", "casing/mass2")
        del file["casing/mass"]
        file.move("casing/mass2", "casing/mass")
        file["rotor/stiffness"] = h5py.SoftLink("/casing/mass")
    same = rotor_from(str(exported), 6, 0.01)
    assert np.array_equal(rotor_from(str(engine), 6, 0.01).omega, same.omega)


@pytest.mark.parametrize("target", ["/rotor/stiffness", "/rotor/mass/x", "/nowhere"])
def test_a_link_that_leads_nowhere_is_told(engine, target):
    with h5py.File(engine, "r+") as file:
        del file["rotor/stiffness"]
        file["rotor/stiffness"] = h5py.SoftLink(target)
    assert f"rotor/stiffness as a link that leads nowhere: {target}" in refusal(engine)


def test_a_group_that_holds_itself_is_refused(engine):
    with h5py.File(engine, "r+") as file:
        file["rotor/rotor"] = file["rotor"]
    assert "unknown rotor/rotor" in refusal(engine)


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("rotor/damping_rate", "rotor/damping_rate; did you mean 'damping_ratio'?"),
        ("rotor/dampng", "unknown rotor/dampng; did you mean 'damping'?"),
        ("Rotor/mass", "unknown Rotor; did you mean 'rotor'?"),
        ("casing/stiff", "unknown casing/stiff; did you mean 'stiffness'?"),
        ("rotor/zz\nzz\x1b[2J", r"unknown rotor/zz\nzz\x1b[2J; known: centre"),
        ("rotor/" + "q" * 70_000, "characters)"),
    ],
)
def test_what_the_layout_does_not_know_is_refused_by_name(engine, name, told):
    with h5py.File(engine, "r+") as file:
        file[name] = 0.5
    text = refusal(engine)
    assert told in text
    assert len(text) < 2500


def huge(path, **options):
    with h5py.File(path, "r+") as file:
        del file["rotor/mass"]
        file.create_dataset("rotor/mass", dtype="f8", **options)


@pytest.mark.parametrize(
    "options",
    [
        {"shape": (15000, 15000)},
        {"shape": (10**6, 10**6), "chunks": (64, 64)},
        {"shape": (15000, 15000), "chunks": (1000, 1000), "compression": 9},
        {"shape": (1, LARGEST + 1)},
    ],
    ids=["sparse", "declared", "packed", "one more"],
)
def test_an_array_too_large_is_refused_before_it_is_read(engine, options):
    huge(engine, **options)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert f"mass must have at most {LARGEST} entries" in refusal(engine)
    after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert after - before < 100_000  # kB


def test_a_chunk_far_larger_than_its_array_is_refused(engine):
    options = {"chunks": (8192, 8192), "compression": 9}
    huge(engine, shape=(32, 32), maxshape=(None, None), **options)
    assert "mass must have chunks of at most 256 MiB, got 512 MiB" in refusal(engine)


@pytest.mark.turns
def test_a_chunk_that_inflates_beyond_its_size_is_refused(engine):
    import zlib

    huge(engine, shape=(32, 32), chunks=(32, 32), compression=9)
    with h5py.File(engine, "r+") as file:
        bomb = zlib.compress(bytes(1 << 29), 9)
        file["rotor/mass"].id.write_direct_chunk((0, 0), bomb)
    assert "mass must have chunks of at most 256 MiB, got" in refusal(engine)


def test_a_real_engine_fits(tmp_path):
    """Packed arrays of noise, of as many coordinates as are allowed, are read."""
    noise = np.random.default_rng(0).normal(size=(2, LARGEST))
    with h5py.File(tmp_path / "wide.h5", "w") as file:
        file.create_dataset("rotor/modal_centre", data=noise, compression=9)
    given = read_group(str(tmp_path / "wide.h5"), "rotor")
    assert np.array_equal(given["modal_centre"], noise)


@pytest.mark.parametrize("kind", ["O", "S5", "V8", "M", "c16", "?"])
def test_what_is_no_number_is_refused_before_it_is_read(engine, kind):
    with h5py.File(engine, "r+") as file:
        del file["rotor/mass"]
        types = {"O": h5py.string_dtype(), "M": h5py.opaque_dtype("M8[s]")}
        file.create_dataset("rotor/mass", (32, 32), types.get(kind, kind))
    assert "mass must hold numbers, got" in refusal(engine)


@pytest.mark.parametrize("name", ["rotor/mass", "rotor/tip_radial", "rotor/shapes"])
def test_an_empty_array_is_refused(engine, name):
    with h5py.File(engine, "r+") as file:
        dimensions = file[name].ndim
        del file[name]
        file.create_dataset(name, shape=(0,) * dimensions, dtype="i8")
    refusal(engine)
    with h5py.File(engine, "r+") as file:
        del file[name]
        file[name] = h5py.Empty("f8")
    refusal(engine)


@pytest.mark.parametrize("name", ["modal_tip_radial", "modal_tip_tangential"])
def test_modes_that_contradict_the_matrices_are_refused(engine, name):
    with h5py.File(engine, "r+") as file:
        file[f"rotor/{name}"][2, 3] += 0.1
    assert f"rotor/{name} must be the rows" in refusal(engine)


def test_modes_that_cannot_be_compared_with_the_matrices_are_refused(engine):
    with h5py.File(engine, "r+") as file:
        del file["rotor/shapes"]
    assert "rotor/omega beside matrices without rotor/shapes" in refusal(engine)


def test_a_centre_that_contradicts_the_matrices_is_refused(engine):
    with h5py.File(engine, "r+") as file:
        file["rotor/modal_centre"][0, 0] += 0.1
    assert "rotor/modal_centre must be the rows rotor/centre" in refusal(engine)


# What has no end


@pytest.mark.timeout(900)
@pytest.mark.parametrize(
    ("made", "words"),
    [
        (os.mkfifo, ("model", "--set", "file={}")),
        (lambda path: path.symlink_to("/dev/zero"), ("run", "{}")),
        (Path.mkdir, ("campaign", "{}", "--dry-run")),
        (lambda path: os.mknod(path, 0o140644), ("campaign", "--set", "file={}",
         "--set", "duration=1e-4", "--out", "new")),
    ],
    ids=["fifo", "device", "directory", "socket"],
)  # fmt: skip
def test_only_a_regular_file_is_read(made, words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    endless = tmp_path / "endless"
    made(endless)
    assert main([word.format(endless) for word in words]) == 2
    err = capsys.readouterr().err
    assert err.startswith("hpcwhirl: error: cannot read")
    assert err.count("\n") == 1
    assert str(endless) in err


def test_a_file_too_long_to_be_hashed_is_refused(tmp_path):
    path = tmp_path / "sparse.h5"
    with path.open("wb") as file:
        file.truncate(MOST_BYTES + 1)
    scene = apply_settings(named_scene("table2"), {"file": str(path)})
    with pytest.raises(InputError, match=f"at most {MOST_BYTES} bytes"):
        digest(scene)
    refusal(path)


@pytest.mark.parametrize("name", ["a\0b", "x" * 300, "\udcff", "loop/loop"])
def test_a_name_that_no_file_has_is_told_in_one_line(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    Path("loop").symlink_to("loop")
    with pytest.raises(WhirlError) as caught:
        digest(scene_from({"engine": {"file": name}}))
    text = str(caught.value)
    assert text.isprintable()
    assert "engine.file" in text


@pytest.mark.slow
def test_damaged_files_are_told_in_one_line(exported, tmp_path):
    """In processes of their own: a damaged file may crash the HDF5 library."""
    whole, random = exported.read_bytes(), np.random.default_rng(12)
    for number in range(40):
        spoilt = bytearray(whole)
        for place in random.integers(0, len(whole) // 4, size=8):
            spoilt[place] = int(random.integers(0, 256))
        (tmp_path / f"{number}.h5").write_bytes(spoilt[: random.integers(1, 10**6)])
    code = (
        "import sys\nfrom hpcwhirl.errors import WhirlError\n"
        "from hpcwhirl.reduction.imported import rotor_from\n"
        "for n in range(40):\n"
        "    try: rotor_from(f'{sys.argv[1]}/{n}.h5', 6, 0.01)\n"
        "    except WhirlError as told: assert str(told).isprintable()\n"
    )
    subprocess.run([sys.executable, "-c", code, tmp_path], check=True, timeout=300)


def test_a_missing_file_stays_told_as_before(tmp_path):
    assert "No such file" in refusal(tmp_path / "none.h5", MissingFileError)


def test_the_file_may_be_named_by_an_option_as_for_import_model(tmp_path, capsys):
    first, second = (tmp_path / name for name in ("first.h5", "second.h5"))
    assert main(["export-model", str(first), "table2", *SMALL]) == 0
    words = ["export-model", "table2", "--out", str(second), "--json", *SMALL]
    capsys.readouterr()
    assert main(words) == 0
    assert json.loads(capsys.readouterr().out) == {"files": [str(second)]}
    assert first.read_bytes() == second.read_bytes()
    assert main([words[0], "table1", *words[1:]]) == 2
    assert "takes one SCENE, got 'table1 table2'" in capsys.readouterr().err
