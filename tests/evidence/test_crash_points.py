"""A slice of scripts/evidence/crash_points.py: no crash and no await costs anything."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from crashing.disk import ANY, ORDERED, Crash, Disk, crashes, state
from crashing.trace import Call, calls_of, compiled

SCRIPT = Path(__file__).parents[2] / "scripts" / "evidence" / "crash_points.py"
SLICE = [("sweep", 0.005)] + [
    pytest.param(kind, share, marks=pytest.mark.evidence)
    for kind, share in (
        ("sweep", 0.025),
        ("gather", 0.2),
        ("states", 0.04),
        ("longer list", 0.04),
    )
]


def looked_at(*words):
    call = [sys.executable, SCRIPT, "--json", *map(str, words)]
    return subprocess.run(call, capture_output=True, text=True, check=False)


@pytest.mark.slow
@pytest.mark.mpi
@pytest.mark.timeout(3000)
@pytest.mark.parametrize(("kind", "share"), SLICE)
def test_after_a_crash_at_any_call_the_same_command_gives_the_same_bits(kind, share):
    done = looked_at("--only", kind, "--share", share)
    assert done.stdout, f"ended with {done.returncode}: {done.stderr}"
    (facts,) = json.loads(done.stdout)
    assert not facts["failures"], facts["failures"]
    assert not any(one["failures"] for one in facts["awaits"]), facts["awaits"]
    assert done.returncode == 0, done.stderr
    assert facts["tried"] >= share * facts["models"]["process"]
    assert facts["crashes"] > facts["states"] > facts["calls"] / 5


@pytest.mark.turns
def test_an_unknown_kind_is_told_with_the_known_ones():
    done = looked_at("--only", "nonsense")
    assert done.returncode == 2
    assert "unknown kind nonsense; known: sweep" in done.stderr


# What a death may leave

FILE = [
    Call("create", -1, "a.part", "", 0, 1, b""),
    Call("write", -1, "a.part", "", 0, 2, b"abcd"),
    Call("sync", -1, "a.part", "", 0, 2, b""),
    Call("rename", -1, "a.part", "a", 0, 2, b""),
    Call("sync", 7, "", "", 0, 2, b""),
]


def left_by(calls, how):
    """Return {what is there: bytes}, of all deaths of a machine at the end."""
    disk = Disk(folders={""})
    found = []
    for crash in crashes(calls, len(calls)):
        if crash.how == how:
            _, files = state(disk, calls, crash).reachable()
            found.append({name: bytes(file.data) for name, file in files.items()})
    return found


def test_what_was_not_synced_may_be_gone_half_there_or_zeros():
    found = left_by(FILE[:2], ORDERED)
    kept = [b"abcd", b"", b"ab", bytes(4), b"\0\0cd"]
    assert all({"a.part": data} in found for data in kept)
    assert {} in found  # and its name


@pytest.mark.parametrize("how", [ORDERED, ANY])
def test_a_file_renamed_after_its_sync_is_old_or_whole(how):
    found = left_by(FILE[:4], how)
    assert {"a": b"abcd"} in found
    assert all(state in ({}, {"a": b"abcd"}, {"a.part": b"abcd"}) for state in found)
    assert ({} in found) == (how == ANY)  # a sync of a file keeps names in order alone


@pytest.mark.parametrize("how", [ORDERED, ANY])
def test_a_name_is_there_once_its_directory_was_synced(how):
    assert all(found == {"a": b"abcd"} for found in left_by(FILE, how))


def test_a_write_may_be_torn_by_the_death_of_a_process():
    torn = [crash for crash in crashes(FILE, 1) if crash.torn]
    (found,) = (state(Disk(folders={""}), FILE, crash) for crash in torn)
    assert bytes(found.files[-1].data) == b"ab"
    assert isinstance(torn[0], Crash)


WRITER = """
import ctypes, mmap, os, shutil, sys
place, log = sys.argv[1:]
ctypes.CDLL(None).watch(os.fsencode(place), os.fsencode(log), -1, 0)
os.chdir(place)
os.mkdir("d")
with open("d/a", "wb") as file:
    file.write(b"hello")
with open("d/a", "ab", 0) as file:
    os.writev(file.fileno(), [b", ", b"world"])
with open("d/a", "rb+", 0) as file:
    file.truncate(9)
shutil.copyfile("d/a", "b")
os.replace("b", "d/c")
os.link("d/c", "e")
os.remove("d/c")
handle = os.open("m", os.O_CREAT | os.O_RDWR)
os.pwrite(handle, bytes(4096), 0)
memory = mmap.mmap(handle, 4096)
memory[:3] = b"abc"
os.mkdir("gone", dir_fd=os.open(".", os.O_RDONLY))
os.rmdir("gone")
memory[3:5] = b"de"
os.fsync(handle)
os.mkdir("old")
os.mkdir("old/in")
open("old/in/f", "wb").close()
os.rename("old", "new")
"""


@pytest.mark.turns
@pytest.mark.skipif(not shutil.which("gcc"), reason="gcc compiles the shim")
def test_the_calls_recorded_make_the_directory_that_was_made(tmp_path):
    place, log = tmp_path / "w", tmp_path / "log"
    place.mkdir()
    env = {"LD_PRELOAD": str(compiled(tmp_path))}
    call = [sys.executable, "-I", "-c", WRITER, str(place), str(log)]
    subprocess.run(call, check=True, env=env)
    calls = calls_of(log)
    made = Disk(folders={""})
    whole = state(made, calls, Crash(len(calls), "process"))
    folders, files = whole.reachable()
    there = Disk.of(place)
    assert folders == sorted(there.folders - {""}) == ["d", "new", "new/in"]
    found = {name: bytes(file.data) for name, file in files.items()}
    assert found == {n: bytes(f.data) for n, f in there.reachable()[1].items()}
    assert found["e"] == b"hello, wo"
    assert found["m"][:5] == b"abcde"
    again = tmp_path / "again"
    again.mkdir()
    whole.write(again)
    assert (again / "d/a").stat().st_mtime_ns == (place / "d/a").stat().st_mtime_ns
    kinds = {call.kind for call in calls}
    assert kinds >= {"mkdir", "create", "write", "memory", "size", "rename", "link"}
