"""Unfriendly ground: homes, caches and links that lead nowhere."""

import os
import shutil
import subprocess
from pathlib import Path

import h5py
import pytest
from launch import kept, python

from hpcwhirl.cli import main
from hpcwhirl.errors import StoreError
from hpcwhirl.store.directory.heartbeats import Notes, Running
from hpcwhirl.store.directory.journal import Journals
from hpcwhirl.store.directory.record import opened, sealed
from hpcwhirl.store.reading.results_file import Results

NOWHERE = "/proc/nowhere"  # not even root can make it
ASK = """
from hpcwhirl.dynamics.kernel_cache import PLACE, cache_facts
(PLACE / "probe").write_text("")
print(cache_facts()["cache_writable"], PLACE)
"""


@pytest.mark.turns
@pytest.mark.parametrize(
    "ground", [{"NUMBA_CACHE_DIR": NOWHERE}, {"HOME": NOWHERE}], ids=" ".join
)
def test_a_cache_that_cannot_be_written_is_one_of_the_process_alone(ground):
    gone = ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME")
    env = {n: v for n, v in os.environ.items() if n not in gone} | ground
    done = python(ASK, env=env, check=True)
    kept, place = done.stdout.split()
    assert kept == "False"
    assert not Path(place).exists()


@pytest.mark.parametrize("command", ["campaign", "run"])
def test_a_loop_of_links_is_one_line(command, tmp_path, capsys):
    loop = tmp_path / "loop"
    loop.symlink_to("loop")
    assert main([command, "--out", str(loop)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("hpcwhirl: error: ")
    assert str(loop) in line


def test_results_that_lack_a_variable_are_damaged(finished, tmp_path):
    out = tmp_path / "out"
    shutil.copytree(finished, out)
    with h5py.File(out / "results.h5", "r+") as file:
        del file["regime"]
    with pytest.raises(StoreError, match="damaged: it has no regime"):
        Results(out)


LONG = "\\u0001" * 10_000


@pytest.mark.parametrize(
    "text",
    [
        f'campaign = {{save_every = "{LONG}"}}\nsweep = {{speed = [300]}}',
        f'sweep = {{speed = "{LONG}"}}',
        f'scene = {{"{LONG}" = 1}}',
    ],
    ids=["rule", "sweep", "key"],
)
def test_a_value_of_a_campaign_is_not_repeated_at_length(text, tmp_path, capsys):
    path = tmp_path / "long.toml"
    path.write_text(text)
    assert main(["campaign", str(path), "--out", str(tmp_path / "out")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert len(line) < 900  # it names all inputs that a scene knows


@pytest.mark.turns
def test_a_complete_campaign_keeps_no_note_of_a_process_that_died(finished, tmp_path):
    out = tmp_path / "out"
    shutil.copytree(finished, out)
    (log,) = (out / "journal").glob("*.log")
    _, last = Journals(out).newest()
    *_, (begin, _, _) = kept(log)
    os.truncate(log, begin)
    with subprocess.Popen(["true"]) as dead:
        dead.wait()
    with Running(Notes(out), 7, 0) as running:
        running.begin([last])
        (note,) = (out / "running").iterdir()
        left = opened(note.read_bytes().splitlines(True)[0]) | {"pid": dead.pid}
    note.write_bytes(sealed(left))
    toml = finished.parent / "short.toml"
    assert main(["campaign", str(toml), "--out", str(out)]) == 0
    assert not list((out / "running").glob("*"))
