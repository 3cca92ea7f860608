"""A rank that hangs keeps nobody from ending: the others end with 75, work kept."""

import os
import signal
import threading
import time
from pathlib import Path

import pytest
from launch import (
    LIMIT,
    SIX,
    held,
    inputs,
    kill,
    launch,
    pid_of,
    records,
    root_variables,
    start,
    wait_for,
)

from hpcwhirl.campaign.stop import Stopping, Watchdog

# A case that hangs for ever, and a file that says that it has begun to.
HANG = """
import pathlib, time
from hpcwhirl.campaign import evaluate
compute = evaluate.compute
def hang(case, *others, **named):
    if case.given.speed == 420:
        pathlib.Path("PLACE/hangs").touch()
        while True:
            time.sleep(3600)
    return compute(case, *others, **named)
evaluate.compute = hang
"""


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    place = tmp_path_factory.mktemp("undisturbed")
    assert (
        launch("campaign", inputs(place, SIX), "--out", place / "out").returncode == 0
    )
    return root_variables(place / "out")


@pytest.mark.mpi
@pytest.mark.slow
@pytest.mark.parametrize("hung", [1, 0])
def test_a_rank_that_is_stopped_does_not_keep_the_others(undisturbed, tmp_path, hung):
    out = tmp_path / "out"
    words = ["campaign", inputs(tmp_path, SIX), "--out", out]
    process = start([*words, "--patience", "1"], 3, held(out, 1, pause=0.01))
    wait_for(lambda: records(out), process)
    os.kill(pid_of(process, hung), signal.SIGSTOP)
    kept = records(out)
    process.send_signal(signal.SIGUSR1)
    _, told = process.communicate(timeout=LIMIT)
    assert process.returncode == 75, told
    assert "not all ranks have stopped 1 s after" in told
    assert all(record in records(out) for record in kept)
    assert launch(*words).returncode == 0
    assert root_variables(out) == undisturbed
    assert len(records(out)) == 6


@pytest.mark.mpi
@pytest.mark.slow
@pytest.mark.parametrize("ranks", [0, 2])
def test_a_case_that_hangs_does_not_keep_the_job(undisturbed, tmp_path, ranks):
    out = tmp_path / "out"
    file = inputs(tmp_path, SIX)
    words = ["campaign", file, "--out", out, "--patience", "0.5"]
    process = start(words, ranks, HANG.replace("PLACE", str(tmp_path)))
    wait_for((tmp_path / "hangs").exists, process)
    process.send_signal(signal.SIGUSR1)
    _, told = process.communicate(timeout=LIMIT)
    assert process.returncode == 75, told
    assert "the same command continues" in told
    assert launch(*words).returncode == 0
    assert root_variables(out) == undisturbed


@pytest.fixture
def ends(monkeypatch):
    """Return an event that is set where this process would have been ended."""
    found = threading.Event()

    def note(self):
        found.set()
        self._over.set()

    monkeypatch.setattr(Watchdog, "_end", note)
    return found


def test_without_a_wish_nothing_is_ended(ends):
    with Stopping() as stopping, Watchdog(stopping, 0.0):
        assert not ends.wait(1.0)
        stopping.settled = True
        stopping.ask("a test")
        assert not ends.wait(1.0)  # what is left to do takes its time
        stopping.settled = False
        assert ends.wait(LIMIT)


def test_a_signal_counts_that_no_handler_has_seen(ends):
    stopping = Stopping()
    before = signal.signal(signal.SIGUSR1, lambda *_: None)
    try:
        with Watchdog(stopping, 0.0):
            assert not ends.wait(0.6)
            signal.raise_signal(signal.SIGUSR1)
            assert ends.wait(LIMIT)
        assert not stopping.reason
    finally:
        signal.signal(signal.SIGUSR1, before)


def test_the_wakeup_of_signals_is_given_back():
    read, write = os.pipe()
    os.set_blocking(write, False)
    before = signal.set_wakeup_fd(write)
    try:
        with Watchdog(Stopping(), 1.0):
            time.sleep(0)
        assert signal.set_wakeup_fd(before) == write
    finally:
        signal.set_wakeup_fd(before)
        os.close(read)
        os.close(write)


def lives(pid):
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state not in "ZX"


@pytest.mark.mpi
@pytest.mark.slow
def test_ranks_whose_launcher_is_killed_end_by_themselves(undisturbed, tmp_path):
    """As for lack of memory: mpirun tells them nothing, and the end of MPI waits."""
    out = tmp_path / "out"
    words = ["campaign", inputs(tmp_path, SIX), "--out", out, "--patience", "1"]
    process = start(words, 2, held(out, 1, pause=0.01), real=True)
    wait_for(lambda: records(out), process)
    ranks = [pid_of(process, rank) for rank in range(2)]
    (proxy,) = {int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])
                for pid in ranks}  # fmt: skip
    if proxy == process.pid:
        kill(process)
        pytest.skip("this launcher has no proxy")
    os.kill(proxy, signal.SIGKILL)
    end = time.monotonic() + LIMIT
    while any(map(lives, ranks)) and time.monotonic() < end:
        time.sleep(0.05)
    alive = [pid for pid in ranks if lives(pid)]
    for pid in alive:
        os.kill(pid, signal.SIGKILL)
    kill(process)  # mpirun may wait for its proxy
    assert not alive
    assert launch(*words).returncode == 0
    assert root_variables(out) == undisturbed
