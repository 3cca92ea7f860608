"""Campaigns that are stopped within a case, crash, or meet a full disk."""

import os
import signal
import subprocess
import sys
import time

import h5py
import pytest
from launch import (
    BARE,
    ENVIRONMENT,
    LIMIT,
    ROOT,
    SLOW,
    inputs,
    kill,
    launch,
    python,
    records,
    root_variables,
    start,
    wait_for,
)

from hpcwhirl.scene.words import ENUMS

SLOWER = SLOW.replace("0.01", "0.04")
# cases of different schemes, which a stop finds on their way where they are slowed
LONG = """
scene = {duration = 0.1}
solver = {time_step = 2e-6, plan = "everything"}
output = {interval = 2.5e-3}
campaign = {save_every = 0.02, map = "no", report = "no"}
sweep = {scheme = ["modal", "exact"], speed = [410, 430]}
"""
SHORT = (
    BARE
    + """
scene = {duration = 4e-3}
solver = {time_step = 2e-6}
output = {interval = 5e-5}
sweep = {speed = [300, 340, 380, 420]}
"""
)
WIDE = (
    BARE
    + """
scene = {duration = 0.05}
solver = {time_step = 2e-6}
output = {interval = 2e-5, traces = "full"}
sweep = {speed = {start = 300, stop = 500, step = 20}}
"""
)
# what a defect in a library would do to the second case of SHORT
SEGFAULT = """
import ctypes
from hpcwhirl.dynamics.march import March
def advance(march, steps, own=March.advance):
    own(march, steps)
    if march.scene.speed == 340.0 and march.steps > 1:
        ctypes.string_at(0)
March.advance = advance
"""


def planted(place, script):
    """Return an environment in which every process of Python runs a script first."""
    (place / "sitecustomize.py").write_text(script)
    return ENVIRONMENT | {
        "PYTHONPATH": f"{place}:{ROOT}:{os.environ.get('PYTHONPATH', '')}"
    }


def crashing(place):
    """Return options of a start in which the second case of SHORT kills its process.

    That is a fork, or the interpreter of isolated cases, which it begins.
    """
    return {"first": SEGFAULT, "real": False, "env": planted(place, SEGFAULT)}


def undisturbed(place, text, *words):
    out = place / "undisturbed"
    done = launch("campaign", inputs(place, text), "--out", out, *words)
    assert done.returncode == 0, done.err
    return root_variables(out)


def states(folder):
    return sorted(path.name for path in folder.glob("states/*.state"))


def under_way(folder):
    notes = folder.glob("running/*.log")  # zeros until the first case is noted
    return [path for path in notes if path.read_bytes().strip(b"\0")]


def stopped(process, ask):
    """Ask a campaign to stop and return its stderr; it has ended within seconds."""
    begin = time.monotonic()
    ask(process)
    _, told = process.communicate(timeout=LIMIT)
    sys.stderr.write(f"stopped after {time.monotonic() - begin:.2f} s\n")
    assert process.returncode == 75, told
    assert "stopped early: " in told
    assert "anew" not in told
    return told


@pytest.mark.mpi
@pytest.mark.slow
def test_cases_cut_again_and_again_end_with_the_same_bits(tmp_path):
    whole, out = undisturbed(tmp_path, LONG), tmp_path / "out"
    words = ["campaign", inputs(tmp_path, LONG), "--out", out]

    process = start(words, first=SLOWER)
    wait_for(lambda: states(out), process)
    assert "signal USR1" in stopped(process, lambda p: p.send_signal(signal.SIGUSR1))
    assert len(states(out)) == 1

    process = start(words, ranks=2, first=SLOWER)
    wait_for(lambda: len(states(out)) > 1 and under_way(out), process)
    assert "STOP is there" in stopped(process, lambda _: (out / "STOP").touch())
    kept = states(out)
    refused = launch(*words)
    assert refused.returncode == 2
    assert "remove it to continue" in refused.err
    (out / "STOP").unlink()
    assert states(out) == kept

    soon = [*words, "--walltime", "00:00:01"]
    told = stopped(start(soon, ranks=3, first=SLOWER), lambda _: None)
    assert "wall-time" in told
    soon = ENVIRONMENT | {"SLURM_JOB_END_TIME": str(int(time.time()) + 2)}
    process = start(words, first=SLOWER, real=False, env=soon)
    assert "wall-time" in stopped(process, lambda _: None)

    done = launch(*words, ranks=3)
    assert done.returncode == 0, done.err
    assert "anew" not in done.err
    assert root_variables(out) == whole
    assert not states(out)
    assert len(records(out)) == 4


def statuses(folder):
    with h5py.File(folder / "results.h5") as file:
        words = [ENUMS["status"][i] for i in file["status"][:]]
        return words, file["message"][:].tolist(), file["performance/rank"][:].tolist()


@pytest.mark.slow
def test_a_case_that_kills_its_process_twice_is_set_aside(tmp_path):
    whole, out = undisturbed(tmp_path, SHORT), tmp_path / "out"
    words = ["campaign", inputs(tmp_path, SHORT), "--out", out]
    crashes = crashing(tmp_path)
    for _ in range(2):
        assert launch(*words, **crashes).returncode == -signal.SIGSEGV
        assert 1 not in [record["case"] for record in records(out)]
    done = launch(*words, **crashes)
    assert done.returncode == 1, done.err
    assert "1 isolated after two crashes" in done.err
    words_of, messages, ranks = statuses(out)
    assert words_of == ["ok", "crashed", "ok", "ok"]
    assert messages[1] == b"the case's process died of SIGSEGV"
    assert ranks == [0, 0, 0, 0]
    assert launch(*words, **crashes).returncode == 1
    assert len(records(out)) == 4
    assert launch(*words, "--retry", "crashed").returncode == 0
    assert root_variables(out) == whole
    assert not list(out.glob("running/*"))


@pytest.mark.mpi
@pytest.mark.slow
def test_isolated_cases_crash_alone_and_have_the_same_bits(tmp_path):
    whole, out = undisturbed(tmp_path, SHORT), tmp_path / "out"
    words = ["campaign", inputs(tmp_path, SHORT), "--out", out, "--isolate"]
    done = launch(*words, ranks=2, **crashing(tmp_path))
    assert done.returncode == 1, done.err
    assert statuses(out)[0] == ["ok", "crashed", "ok", "ok"]
    assert "case 1 crashed on " in done.err
    assert "rank " in done.err
    assert launch(*words, "--retry", "failed,crashed", ranks=2).returncode == 0
    assert root_variables(out) == whole


@pytest.mark.slow
def test_an_isolated_case_stops_and_continues_to_the_same_bits(tmp_path):
    text = LONG.replace("[410, 430]", "[430]")
    whole, out = undisturbed(tmp_path, text), tmp_path / "out"
    words = ["campaign", inputs(tmp_path, text), "--out", out]
    slowed = planted(tmp_path, SLOWER)  # that which computes the cases
    process = start([*words, "--isolate"], real=False, env=slowed)
    wait_for(lambda: states(out), process)
    stopped(process, lambda p: p.send_signal(signal.SIGUSR1))
    assert states(out)
    assert launch(*words).returncode == 0
    assert root_variables(out) == whole


@pytest.mark.slow
def test_a_case_that_was_killed_twice_from_outside_still_gives_its_bits(tmp_path):
    text = LONG.replace("[410, 430]", "[430]")
    whole, out = undisturbed(tmp_path, text), tmp_path / "out"
    words = ["campaign", inputs(tmp_path, text), "--out", out]
    for crash in (1, 2):
        process = start(words, first=SLOWER)
        wait_for(lambda: len(under_way(out)) == crash, process)  # noqa: B023
        kill(process)
    done = launch(*words)
    assert done.returncode == 0, done.err
    assert "isolated after two crashes" in done.err
    assert root_variables(out) == whole


@pytest.mark.mpi
@pytest.mark.slow
@pytest.mark.parametrize("ranks", [0, 2])
def test_a_full_disk_ends_a_campaign_and_room_continues_it(disk, tmp_path, ranks):
    place, resize = disk
    whole, out = undisturbed(tmp_path, WIDE), place / "out"
    words = ["campaign", inputs(tmp_path, WIDE), "--out", out]
    full = launch(*words, ranks=ranks)
    assert full.returncode == 75, full.err
    assert "No space left on device" in full.err
    assert f"finished cases are safe in {out}" in full.err
    assert "Traceback" not in full.err
    assert 0 < len(records(out)) < 11
    resize("27M")  # traces of 25.6 MB, but no results beside them
    full = launch(*words)
    assert full.returncode == 75, full.err
    assert "results.h5: No space left on device" in full.err
    assert len(records(out)) == 11
    assert [path.name for path in out.glob("results*")] == []
    resize("70M")
    assert launch(*words, ranks=ranks).returncode == 0
    assert root_variables(out) == whole


@pytest.mark.slow
def test_hdf5_on_a_full_disk_is_an_error_and_no_crash(disk):
    place, _ = disk
    script = (
        "import sys, numpy as np\n"
        "from pathlib import Path\n"
        "from hpcwhirl.store.hdf5 import refusal, writing\n"
        "try:\n"
        "    with writing(Path(sys.argv[1])) as file:\n"
        "        for i in range(60):\n"
        "            data = file.create_dataset(f'v{i}', (20000,), 'f8')\n"
        "            for k in range(0, 20000, 500):\n"
        "                data[k : k + 500] = 1.0\n"
        "except (OSError, RuntimeError) as failed:\n"
        "    print(refusal(sys.argv[1], failed))\n"
    )
    done = python(script, place / "x.h5")
    assert done.returncode == 0
    assert done.stdout == f"cannot write {place}/x.h5: No space left on device\n"


@pytest.mark.slow
def test_a_disk_that_may_not_be_written_is_one_line(disk, tmp_path):
    place, _ = disk
    subprocess.run(["mount", "-o", "remount,ro", place], check=True)
    done = launch("campaign", inputs(tmp_path, SHORT), "--out", place / "out")
    assert done.returncode == 2
    (line,) = done.err.splitlines()
    assert line.startswith("hpcwhirl: error: --out ")
    assert line.endswith(f"{place} cannot be written")
