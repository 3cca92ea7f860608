"""What a killed process leaves behind is removed by who comes next, and no more."""

import fcntl
import os
import shutil
import time
from pathlib import Path

import pytest

from hpcwhirl.campaign.begin import owned
from hpcwhirl.campaign.stop import Stopping
from hpcwhirl.cli import main
from hpcwhirl.launch import ALONE
from hpcwhirl.store.atomic import YOUNG, part_of, replacing
from hpcwhirl.store.directory.campaign_directory import Directory

AGO = YOUNG + 60.0  # s


def left(path):
    """Return a temporary file beside a path, as of a process killed a minute ago."""
    part = part_of(path)
    part.write_bytes(b"half")
    os.utime(part, (time.time() - AGO, time.time() - AGO))
    return part


@pytest.fixture
def out(finished, tmp_path):
    return Path(shutil.copytree(finished, tmp_path / "out"))


@pytest.mark.turns
@pytest.mark.parametrize(
    ("command", "names"),
    [
        ("classify", ["results.h5"]),
        ("map", ["map.png", "map.svg"]),
        ("report", ["report.html"]),
    ],
)
def test_the_same_command_sweeps_what_a_kill_has_left(out, command, names):
    parts = [left(out / name) for name in names]
    others = [left(out / "another.csv")]
    assert main([command, str(out)]) == 0
    assert not [part for part in parts if part.exists()]
    assert all(part.exists() for part in others)


@pytest.mark.turns
def test_what_another_process_is_writing_is_left_alone(out):
    with replacing(out / "map.png", held=True) as part:
        os.utime(part, (time.time() - AGO, time.time() - AGO))
        assert main(["map", str(out)]) == 0
        assert part.exists()
        with part.open("rb+") as file, pytest.raises(BlockingIOError):
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    assert not part.exists()


@pytest.mark.parametrize("note", [b"", b"\0" * 4096, b"deadbeef {torn"])
def test_a_note_of_a_rank_killed_as_it_began_is_removed(out, note):
    path = out / "running" / "0001-00001.log"
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(note)
    with owned(Directory(out), None, ALONE, Stopping(), None):
        assert not path.exists()
