"""No room, told as late as by fsync or close, as file servers do: at every writer."""

import errno
import os
import shutil
import subprocess

import pytest
from forked import Server
from launch import BARE, ENVIRONMENT, ROOT, launch, root_variables

from hpcwhirl.cli import main

SHORT = """
scene = {duration = 2e-3}
solver = {time_step = 2e-6}
output = {interval = 5e-5, traces = "full"}
sweep = {speed = [300, 410]}
"""
NUMBERS = {"close": errno.EDQUOT, "fsync": errno.EROFS}
# {part of the path: files of a campaign that cannot do without them}
DRAWN = ("/map.png", "/map.svg", "/report.html")
NEEDED = ("/campaign.json", "/journal/0001", "/traces/0001", "/results.h5", *DRAWN)
WORDS = ("campaign", "short.toml", "--out", "out")
SPARED = ("/owners/", "/running/", "/runs/0001.json", "/runs/results.stamp")
OTHERS = {  # {part of the path: command that writes it from a finished campaign}
    "/.hpcwhirl-": ("run", "short.toml", "--out", "o.h5"),
    "/engine.h5": ("export-model", "engine.h5", "short.toml"),
    "/map.csv": ("map", "out", "--csv"),
    "/map.svg": ("map", "out"),
    "/results.h5": ("classify", "out"),
    "/results.h5.": ("gather", "out"),
    "/orbit-0000": ("figures", "out", "--kind", "orbit", "--out", "f"),
    "/report.html": ("report", "out"),
    "/job.sh": ("job", "slurm", "short.toml", "--script", "job.sh"),
    "/words.txt": ("cases", "out", "--csv"),
}
# what fails to be written there must not be the compiled modules of all tests
NO_BYTECODE = {"PYTHONDONTWRITEBYTECODE": "1"}


@pytest.fixture(scope="module")
def shim(tmp_path_factory):
    """Return the library that lets calls fail."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no cc")
    library = tmp_path_factory.mktemp("shim") / "late.so"
    source = ROOT / "tests/support/late.c"
    call = [compiler, "-shared", "-fPIC", "-o", library, source, "-ldl"]
    subprocess.run(call, check=True)
    return library


@pytest.fixture(scope="module")
def command(shim):
    """Return a function that runs a command in a place; its calls can be let fail."""
    server = Server(ENVIRONMENT | {"LD_PRELOAD": str(shim), **NO_BYTECODE})

    def run(place, *words, env=None, out=None):
        return server.command(words, place, env, out)

    yield run
    server.close()


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Return a place with a finished campaign, and what its results are."""
    place = tmp_path_factory.mktemp("whole")
    (place / "short.toml").write_text(SHORT)
    words = ("campaign", str(place / "short.toml"), "--out", str(place / "out"))
    assert main(words) == 0
    return place, root_variables(place / "out")


def begun(place, whole, name):
    """Return the words of a new campaign, or of one that lacks a picture alone."""
    if name in DRAWN:
        shutil.copytree(whole[0], place, dirs_exist_ok=True)
        (place / f"out{name}").unlink()
        return WORDS
    (place / "short.toml").write_text(BARE + SHORT)
    return WORDS


def late(place, call, name):
    """Return the environment in which a call tells an error of files of a name."""
    return {
        "LATE_CALL": call, "LATE_NAME": name, "LATE_ERRNO": str(NUMBERS[call]),
        "LATE_SEEN": str(place / "seen"),
    }  # fmt: skip


def check_line(ended, call):
    """Check that an end is 75, and that one line says why."""
    lines = [li for li in ended.err.splitlines() if "stopped" in li or "error" in li]
    assert ended.returncode == 75, ended.err
    assert len(lines) == 1, ended.err
    assert os.strerror(NUMBERS[call]) in lines[0]
    assert "Traceback" not in ended.err


@pytest.mark.slow
@pytest.mark.parametrize("call", NUMBERS)
@pytest.mark.parametrize("name", NEEDED)
def test_a_campaign_comes_again_once_there_is_room(
    tmp_path, command, whole, call, name
):
    words = begun(tmp_path, whole, name)
    ended = command(tmp_path, *words, env=late(tmp_path, call, name))
    assert (tmp_path / "seen").exists()
    check_line(ended, call)
    assert "the same command continues" in ended.err
    again = command(tmp_path, *words)
    assert again.returncode == 0, again.err
    assert root_variables(tmp_path / "out") == whole[1]
    assert not list((tmp_path / "out").rglob("*.part"))
    assert not (tmp_path / "out/owners").exists()


@pytest.mark.slow
@pytest.mark.parametrize("name", SPARED)
def test_a_campaign_does_without_what_no_result_needs(tmp_path, command, whole, name):
    words = begun(tmp_path, whole, name)
    ended = command(tmp_path, *words, env=late(tmp_path, "close", name))
    assert (tmp_path / "seen").exists()
    assert ended.returncode == 0, ended.err
    assert "Traceback" not in ended.err
    assert root_variables(tmp_path / "out") == whole[1]


@pytest.mark.slow
@pytest.mark.parametrize("name", OTHERS)
def test_any_command_that_writes_comes_again(tmp_path, command, whole, name):
    shutil.copytree(whole[0], tmp_path, dirs_exist_ok=True)
    env = late(tmp_path, "close", name)
    out = tmp_path / "words.txt" if name == "/words.txt" else None
    ended = command(tmp_path, *OTHERS[name], env=env, out=out)
    assert (tmp_path / "seen").exists(), ended.err
    check_line(ended, "close")
    ended = command(tmp_path, *OTHERS[name])
    assert ended.returncode == 0, ended.err
    assert root_variables(tmp_path / "out") == whole[1]
    assert not list(tmp_path.rglob("*.part"))


@pytest.mark.mpi
@pytest.mark.slow
@pytest.mark.parametrize("rank", [0, 1])
def test_no_rank_waits_for_one_whose_journal_cannot_be_closed(
    tmp_path, shim, whole, rank
):
    (tmp_path / "short.toml").write_text(BARE + SHORT)
    words = ["campaign", tmp_path / "short.toml", "--out", tmp_path / "out"]
    env = ENVIRONMENT | late(tmp_path, "close", f"/journal/0001-0000{rank}")
    env |= {"LD_PRELOAD": str(shim), **NO_BYTECODE}
    ended = launch(*words, ranks=2, env=env)
    assert ended.returncode == 75, ended.err
    assert os.strerror(errno.EDQUOT) in ended.err
    again = launch(*words)
    assert again.returncode == 0, again.err
    assert root_variables(tmp_path / "out") == whole[1]
