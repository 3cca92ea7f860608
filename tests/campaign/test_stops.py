"""What ends a campaign early, and that nothing of it is left behind."""

import ctypes
import os
import signal
import sys
import time

import pytest
from launch import finish, start, wait_for

from hpcwhirl.campaign import stop
from hpcwhirl.campaign.stop import (
    SIGNALS,
    Stop,
    Stopping,
    breakable,
    time_left,
)
from hpcwhirl.scene.campaign_tables import walltime_seconds


def handlers():
    return [signal.getsignal(name) for name in (*SIGNALS, signal.SIGALRM)]


@pytest.mark.parametrize("name", SIGNALS)
def test_a_signal_is_a_wish_and_is_given_back(name):
    before = handlers()
    with Stopping() as stopping:
        assert not stopping()
        os.kill(os.getpid(), name)
        assert stopping()
        assert name.name.removeprefix("SIG") in stopping.reason
    assert handlers() == before


def test_signals_are_given_back_after_an_error():
    before = handlers()
    with pytest.raises(ValueError, match="planted"), Stopping():
        raise ValueError("planted")
    assert handlers() == before


def test_the_clock_and_the_first_reason_count(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    stopping = Stopping()
    stopping.watch(None, 5.0)
    now[0] = 104.9
    assert not stopping()
    now[0] = 105.0
    assert stopping()
    assert "wall-time" in stopping.reason
    stopping.ask("another")
    assert "wall-time" in stopping.reason


def test_a_directory_that_cannot_be_looked_into_does_not_end_a_campaign(
    tmp_path, monkeypatch
):
    monkeypatch.setattr(stop, "LOOK_EVERY", 0.0)
    stopping = Stopping()
    stopping.watch(
        tmp_path / ("x" * 300) / "STOP", None
    )  # which is an error, not an absence
    assert not stopping()


def test_the_stop_file_is_looked_for_once_a_second(tmp_path, monkeypatch):
    now = [100.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    stopping, elsewhere = Stopping(), Stopping()
    stopping.watch(tmp_path / "STOP", None)
    elsewhere.watch(None, None)
    (tmp_path / "STOP").touch()
    now[0] = 100.9
    assert not stopping()
    now[0] = 101.1
    assert stopping()
    assert not elsewhere()


@pytest.mark.parametrize(
    ("text", "seconds"), [("01:50:00", 6600), ("00:00:07", 7), ("100:00:01", 360001)]
)
def test_a_walltime_is_hours_minutes_seconds(text, seconds):
    assert walltime_seconds(text) == seconds


@pytest.mark.parametrize(
    "text", ["", "90", "1:90:00", "00:00:00", "-1:00:00", "1:2", "a:b:c", "1:00:60"]
)
def test_another_walltime_is_refused(text):
    with pytest.raises(ValueError, match="must be "):
        walltime_seconds(text)


def test_the_nearer_end_counts_less_its_margin(monkeypatch):
    monkeypatch.setattr(time, "time", lambda: 1e9)
    assert time_left(None, {}) is None
    assert time_left(7200.0, {}) == 7140.0
    assert time_left(100.0, {}) == 90.0
    assert time_left(None, {"SLURM_JOB_END_TIME": "1000000600"}) == 540.0
    assert time_left(100.0, {"SLURM_JOB_END_TIME": "1000000600"}) == 90.0
    assert time_left(7200.0, {"SLURM_JOB_END_TIME": "999999999"}) == 0.0
    assert time_left(None, {"SLURM_JOB_END_TIME": "soon"}) is None


@pytest.mark.turns
def test_what_has_no_slices_is_broken_off_and_the_timer_is_given_back():
    before, begin, told = handlers(), time.monotonic(), []

    def check():
        told.append(1)
        if time.monotonic() - begin > 0.5:
            raise Stop

    def busy():
        with breakable(check):
            while time.monotonic() - begin < 30.0:
                pass

    with pytest.raises(Stop):
        busy()
    assert time.monotonic() - begin < 20.0
    assert len(told) > 1
    assert handlers() == before
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)


def test_a_compiler_that_hides_the_stop_does_not_make_a_failure_of_it():
    def check():
        raise Stop

    def compiler():
        with breakable(check):
            try:
                time.sleep(30.0)
            except Exception as hidden:
                raise TypeError("cannot compile") from hidden

    with pytest.raises(Stop):
        compiler()
    with pytest.raises(TypeError, match="own"), breakable(lambda: None):
        raise TypeError("own")


@pytest.mark.turns
def test_a_check_is_not_called_again_while_it_is_at_work():
    depth, most = [0], [0]

    def check():
        depth[0] += 1
        most[0] = max(most[0], depth[0])
        time.sleep(0.5)
        depth[0] -= 1

    begin = time.monotonic()
    with breakable(check):
        while time.monotonic() - begin < 1.2:
            pass
    assert most == [1]


def test_a_stop_that_falls_into_a_callback_of_the_compiler_is_no_traceback(capfd):
    told = []

    def check():
        told.append(1)
        raise Stop

    def noticed(*pair):  # called from C, which has nowhere to raise to
        while pair and not told:
            time.sleep(1e-3)
        return 0

    kind = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p)
    numbers = (ctypes.c_int * 2)(2, 1)

    def compiler():
        with breakable(check):
            ctypes.CDLL(None).qsort(numbers, 2, 4, kind(noticed))
            while True:
                time.sleep(1e-3)

    before = sys.unraisablehook
    with pytest.raises(Stop):
        compiler()
    assert sys.unraisablehook is before
    assert "Traceback" not in capfd.readouterr().err


ASLEEP = """
import time
from pathlib import Path
from hpcwhirl.campaign.foresight import forecast
def slow(*_):
    Path({begun!r}).touch()
    time.sleep(600)
forecast.forecast = slow
"""


@pytest.mark.turns
@pytest.mark.parametrize("name", SIGNALS)
def test_a_signal_ends_a_dry_run_at_once_and_speaks_of_no_case(name, tmp_path):
    """It has nothing to save, so nothing that it would have to wait for."""
    begun = tmp_path / "begun"
    words = ["campaign", "--dry-run", "--out", str(tmp_path / "out")]
    process = start(words, first=ASLEEP.format(begun=str(begun)), real=True)
    wait_for(begun.exists, process)
    process.send_signal(name)
    finish(process)
    assert process.returncode == (130 if name == signal.SIGINT else -name)
    assert "case" not in process.err
    assert "Traceback" not in process.err


def test_a_signal_heard_before_a_dry_run_ends_it(monkeypatch):
    sent = []
    with Stopping() as stopping:
        os.kill(os.getpid(), signal.SIGUSR1)
        monkeypatch.setattr(os, "kill", lambda pid, number: sent.append((pid, number)))
        stopping.step_aside()
        assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL
    assert sent == [(os.getpid(), signal.SIGUSR1)]
