"""A campaign's directory with FIFOs, devices and directories where files should be."""

import os
import shutil
from pathlib import Path

import numpy as np
import pytest
from launch import python

from hpcwhirl.cli import main
from hpcwhirl.errors import MissingFileError, StoreError
from hpcwhirl.safe_open import open_regular, read_regular
from hpcwhirl.store.directory.heartbeats import Notes, Running
from hpcwhirl.store.directory.journal import Journal, Journals
from hpcwhirl.store.directory.states import States

pytestmark = pytest.mark.timeout(900)


@pytest.fixture
def folder(finished, tmp_path):
    """Return a copy of a finished campaign's directory."""
    return Path(shutil.copytree(finished, tmp_path / "copy"))


@pytest.fixture(params=["fifo", "socket", "device", "directory"])
def odd(request):
    """Return a function that puts what is no regular file at a path."""

    def put(path):
        path.unlink(missing_ok=True)
        if request.param == "fifo":
            os.mkfifo(path)
        elif request.param == "socket":
            os.mknod(path, 0o140644)
        elif request.param == "device":
            path.symlink_to("/dev/zero")
        else:
            path.mkdir()
        return path

    return put


@pytest.mark.parametrize("mode", ["rb", "ab", "wb", "rb+"])
def test_what_is_not_a_regular_file_is_not_opened(odd, tmp_path, mode):
    with pytest.raises(OSError, match=r"regular|directory"):
        open_regular(odd(tmp_path / "odd"), mode)


def test_a_regular_file_is_opened_as_open_does(tmp_path):
    path = tmp_path / "file"
    for mode, held in (("wb", b"ab"), ("ab", b"abab"), ("wb", b"ab")):
        with open_regular(path, mode, 0) as file:
            assert file.write(b"ab") == 2
            assert Path(file.name) == path
        assert read_regular(path) == held
    (tmp_path / "link").symlink_to(path)
    assert read_regular(tmp_path / "link") == b"ab"
    for name in ("none", "a\0b"):
        with pytest.raises(OSError, match=r"No such|null"):
            read_regular(tmp_path / name)


@pytest.mark.parametrize("command", ["status", "gather"])
@pytest.mark.parametrize("name", ["campaign.json", "journal/0002-00000.log"])
def test_commands_tell_what_they_cannot_read(odd, folder, capsys, name, command):
    odd(folder / name)
    assert main([command, str(folder)]) == 2
    err = capsys.readouterr().err
    assert err.startswith("hpcwhirl: error: ")
    assert err.count("\n") == 1
    assert Path(name).name in err


@pytest.mark.turns
@pytest.mark.parametrize("name", ["running/0002-00000.log", "runs/0002.json"])
def test_notes_that_no_result_depends_on_are_passed_over(odd, folder, name):
    (folder / name).parent.mkdir(exist_ok=True)
    odd(folder / name)
    assert Notes(folder).all() == []
    assert main(["status", str(folder)]) == 0
    assert main(["gather", str(folder)]) == 0


@pytest.mark.parametrize("part", ["journal", "traces"])
def test_no_rank_writes_to_what_is_no_file(odd, tmp_path, part):
    (tmp_path / part).mkdir()
    odd(tmp_path / part / ("0001-00000." + ("log" if part == "journal" else "bin")))
    with pytest.raises(MissingFileError, match="cannot write in"):
        Journal(Journals(tmp_path), 1, 0)


def test_no_rank_notes_what_it_does_in_what_is_no_file(odd, tmp_path):
    (tmp_path / "running").mkdir()
    odd(tmp_path / "running" / "0001-00000.log")
    with pytest.raises(MissingFileError, match="cannot write in"):
        Running(Notes(tmp_path), 1, 0)


def test_no_state_is_taken_from_what_is_no_file(odd, tmp_path):
    States(tmp_path).write("d", {}, {"x": np.zeros(2)})
    odd(tmp_path / "states" / "d.state")
    with pytest.raises(StoreError, match="cannot read"):
        States(tmp_path).read("d", {})


def test_no_job_script_is_read_from_what_is_no_file(odd, tmp_path, capsys):
    path = odd(tmp_path / "job.sh")
    assert main(["job", "slurm", "c.toml", "--script", str(path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.turns
@pytest.mark.parametrize("name", ["report.html", "map.png", "map.csv"])
def test_what_shows_results_may_be_a_fifo_and_nobody_waits(name, tmp_path):
    os.mkfifo(tmp_path / name)
    read = (
        "from pathlib import Path; from hpcwhirl.report.map.maps import wish_of; "
        "from hpcwhirl.report.page.build import is_stale; "
        "from hpcwhirl.store.directory.campaign_directory import Directory; "
        f"place = Path({str(tmp_path)!r}); "
        f"print(is_stale(Directory(place)), wish_of(place / {name!r}))"
    )
    assert python(read, check=True).stdout.split() == ["False", "None"]


@pytest.mark.parametrize("plant", [Path.symlink_to, Path.hardlink_to, shutil.copyfile])
@pytest.mark.parametrize("part", ["journal", "traces", "running"])
def test_a_rank_writes_into_no_file_but_one_that_it_made(plant, part, tmp_path):
    """Who may write in the directory must not choose what its owner's ranks write."""
    victim = tmp_path / "victim"
    victim.write_bytes(b"kept")
    (tmp_path / part).mkdir()
    ending = "bin" if part == "traces" else "log"
    aim = tmp_path / part / f"0001-00001.{ending}"
    plant(*((victim, aim) if plant is shutil.copyfile else (aim, victim)))
    with pytest.raises(MissingFileError, match="is a link, or is not empty"):  # noqa: SIM117
        with Journal(Journals(tmp_path), 1, 1), Running(Notes(tmp_path), 1, 1):
            pass
    assert victim.read_bytes() == b"kept"


def test_a_file_of_a_rank_may_exist_empty_as_that_of_a_claimed_run_does(tmp_path):
    number = Journals(tmp_path).claim_run()
    with Journal(Journals(tmp_path), number, 0), Running(Notes(tmp_path), number, 0):
        pass
