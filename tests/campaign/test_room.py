"""No room, and what will never be there: which exit code tells a job to come again."""

import errno
import io
import os
import shutil
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from launch import ended

from hpcwhirl.cli import main
from hpcwhirl.errors import MissingFileError, NoRoomError, unwritable
from hpcwhirl.store import hdf5
from hpcwhirl.store.atomic import write_whole
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.hdf5 import refusal, writing
from hpcwhirl.store.results.gather import gather

FULL = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
SHORT = """
scene = {duration = 2e-3}
solver = {time_step = 2e-6}
sweep = {speed = [300, 410]}
"""


@pytest.fixture
def unfinished(finished, tmp_path):
    """Return (campaign file, directory): all cases computed, no results yet."""
    folder = Path(shutil.copytree(finished, tmp_path / "out"))
    (folder / "results.h5").unlink()
    toml = tmp_path / "short.toml"
    toml.write_text((finished.parent / "short.toml").read_text())
    return toml, folder


def command(unfinished):
    toml, folder = unfinished
    return main(["campaign", str(toml), "--out", str(folder), "--report=no"])


def full(*_, **__):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def patient_of(room):
    """Return the class that writes HDF5, on a disk of so many bytes."""
    taken = 0

    def write(_, data):
        nonlocal taken
        taken += len(data)
        return len(data) if taken <= room else full()

    disk = type("Disk", (io.FileIO,), {"write": write})
    return type("Patient", (hdf5._Patient, disk), {})


def told(capsys):
    lines = [li for li in capsys.readouterr().err.splitlines() if "cases," not in li]
    return [li for li in lines if "error" in li or "stopped" in li]


@pytest.mark.turns
def test_a_disk_full_at_the_map_is_a_reason_to_come_again(
    unfinished, monkeypatch, capsys
):
    with monkeypatch.context() as patch:
        patch.setattr("matplotlib.figure.Figure.savefig", full)
        assert command(unfinished) == 75
    (line,) = told(capsys)
    assert "No space left on device" in line
    assert "the same command continues" in line
    assert list(unfinished[1].glob("*.part")) == []
    assert command(unfinished) == 0
    assert (unfinished[1] / "map.png").exists()


@pytest.mark.turns
def test_a_disk_full_at_the_results_is_a_reason_to_come_again(
    unfinished, monkeypatch, capsys
):
    with monkeypatch.context() as patch:
        patch.setattr(hdf5, "_Patient", patient_of(3000))
        assert command(unfinished) == 75
    assert "No space left on device" in told(capsys)[0]
    assert [p.name for p in unfinished[1].glob("results*")] == []
    assert command(unfinished) == 0


def test_a_disk_full_at_the_beginning_is_a_reason_to_come_again(
    tmp_path, monkeypatch, capsys
):
    (tmp_path / "short.toml").write_text(SHORT)
    monkeypatch.setattr("hpcwhirl.store.atomic.publish", full)
    words = ["campaign", str(tmp_path / "short.toml"), "--out", str(tmp_path / "o")]
    assert main(words) == 75
    assert "No space left on device" in told(capsys)[0]


@pytest.mark.turns
@pytest.mark.parametrize("place", ["results.h5", "map.png"])
def test_what_no_repetition_mends_is_not_come_again_for(unfinished, capsys, place):
    (unfinished[1] / place).unlink(missing_ok=True)
    (unfinished[1] / place / "inside").mkdir(parents=True)
    assert command(unfinished) == 2
    (line,) = told(capsys)
    assert "directory" in line
    assert "the same command" not in line


def test_traces_that_cannot_be_read_are_not_come_again_for(unfinished, capsys):
    for path in (unfinished[1] / "traces").glob("*.bin"):
        size = path.stat().st_size
        path.unlink()
        with path.open("wb") as file:  # as long, and damaged
            file.truncate(size)
    assert command(unfinished) == 2
    (line,) = told(capsys)
    assert "--retry failed" in line


def test_a_full_disk_is_told_from_other_refusals():
    assert type(unwritable("x", FULL)) is NoRoomError
    assert type(unwritable("x", errno.EDQUOT)) is NoRoomError
    assert type(unwritable("x", PermissionError(errno.EACCES, "no"))) is (
        MissingFileError
    )


def test_hdf5_hiding_the_cause_is_told_by_what_it_came_from():
    hidden = RuntimeError("Can't decrement id ref count")
    hidden.__context__ = OSError("file write failed\n, errno = 28, error message")
    text = refusal(Path("x.h5"), hidden)
    assert str(text) == "cannot write x.h5: No space left on device"
    assert isinstance(text, NoRoomError)


@pytest.mark.parametrize("room", [0, 500, 5_000, 50_000, 400_000])
def test_hdf5_never_sees_the_disk_refuse(tmp_path, monkeypatch, room):
    """Objects closed as Python forgets them, chunks, attributes: one error of all."""
    monkeypatch.setattr(hdf5, "_Patient", patient_of(room))

    def fill():
        with writing(tmp_path / "x.h5") as file:
            for i in range(60):
                options = {"chunks": (100,), "compression": 1}
                data = file.create_dataset(f"g/a{i}", data=np.ones(500) * i, **options)
                data.attrs["units"] = "x" * 250
            for i in range(200):
                file.attrs[f"f{i}"] = "z" * 2000

    with pytest.raises(OSError, match="No space"):
        fill()


def test_what_is_written_is_what_h5py_writes(tmp_path):
    for name, opened in (("a.h5", writing), ("b.h5", h5py.File)):
        with opened(tmp_path / name, "w", libver="latest") as file:
            file.create_dataset("x", data=np.arange(5.0), track_times=False)
    with writing(tmp_path / "a.h5", "r+") as file:
        file["x"][2] = 7.0
    with h5py.File(tmp_path / "a.h5") as file:
        assert file["x"][:].tolist() == [0.0, 1.0, 7.0, 3.0, 4.0]


@pytest.mark.turns
def test_gathering_where_a_file_may_not_grow_is_one_line(finished, tmp_path):
    """A limit of the system instead of a full disk, in a process of its own."""
    folder = shutil.copytree(finished, tmp_path / "out")
    (folder / "results.h5").unlink()
    call = f"ulimit -f 4; exec {sys.executable} -m hpcwhirl gather {folder}"
    done = ended("bash", "-c", call)
    assert done.returncode == 2
    assert done.stderr == (
        f"hpcwhirl: error: cannot write {folder}/results.h5: File too large\n"
    )
    assert list(folder.glob("results*")) == []
    assert gather(Directory(folder), {}).exists()


def test_a_small_file_on_a_full_disk_is_told(tmp_path, monkeypatch):
    (tmp_path / "x").write_text("before")
    monkeypatch.setattr("hpcwhirl.store.atomic.publish", full)
    with pytest.raises(NoRoomError, match="No space"):
        write_whole(tmp_path / "x", b"after")
    assert (tmp_path / "x").read_text() == "before"
