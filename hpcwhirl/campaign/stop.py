"""Why and when a campaign ends early: signals, clocks, a file, a rank's own wish."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from types import FrameType
from typing import Any, Self

from hpcwhirl import early_signals
from hpcwhirl.errors import InputError

SIGNALS = early_signals.SIGNALS
FILE = "STOP"  # in the campaign's directory
MARGIN = 60.0  # s kept free before a wall-time ends, at most a tenth of it
LOOK_EVERY = 1.0  # s between looks for the file
BREAK_EVERY = 0.2  # s between looks while something cannot be cut into slices
PILOT_OVER = "the pilot is over"
END_TIME = "SLURM_JOB_END_TIME"  # s since 1970, set by Slurm


class Stop(Exception):  # noqa: N818
    """Raised between slices when this process has been asked to end."""


class Stopping:
    """Whether this process is to end; asked between slices.

    As a context it takes over TERM, USR1 and INT, those that came while the program
    was being imported included, and gives them back.

    Attributes
    ----------
    reason : why it is to end; empty: it is not
    settled : whether all is computed: what is left to do is not ended by force
    began : s, of the monotonic clock, from which on a limit of time counts
    """

    def __init__(self) -> None:
        self.reason = ""
        self.settled = False
        self.began = time.monotonic()
        self._file: Path | None = None
        self._deadline: float | None = None
        self._pilot_ends: float | None = None
        self._looked = 0.0
        self._before: dict[int, Any] = {}

    def watch(self, folder: Path | None, seconds: float | None) -> None:
        """Watch a file and the clock, too.

        Parameters
        ----------
        folder : looked into for `STOP`; None: by another rank of this node
        seconds : from `began` until this process is to end; None: no limit
        """
        self._looked = time.monotonic()
        self._file = folder / FILE if folder else None
        self._deadline = self.began + seconds if seconds is not None else None

    def pilot(self, seconds: float) -> None:
        """End this process some seconds from now, as a pilot does."""
        self._pilot_ends = time.monotonic() + seconds

    def ask(self, reason: str) -> None:
        """Ask this process, and with it the campaign, to end."""
        self.reason = self.reason or reason

    def __call__(self) -> bool:
        """Return whether this process has been asked to end."""
        now = time.monotonic()
        if self._deadline is not None and now >= self._deadline:
            self.ask("the wall-time is nearly over")
        elif self._pilot_ends is not None and now >= self._pilot_ends:
            self.ask(PILOT_OVER)
        elif self._file is not None and now - self._looked >= LOOK_EVERY:
            self._looked = now
            with suppress(OSError):  # a file server that does not answer: later
                if self._file.exists():
                    self.ask(f"{self._file} is there")
        return bool(self.reason)

    def check(self) -> None:
        """Raise Stop where this process has been asked to end."""
        if self():
            raise Stop

    def _hear(self, number: int, frame: FrameType | None) -> None:
        del frame
        self.ask(f"signal {signal.Signals(number).name.removeprefix('SIG')}")

    def ignore(self) -> None:
        """Let nothing but KILL change how this process ends; no signal is given back.

        What is left is the end of the interpreter, which gives up Python's handlers,
        and then MPI's, which may wait for other ranks.
        """
        for name in self._before:
            signal.signal(name, signal.SIG_IGN)
        self._before.clear()

    def __enter__(self) -> Self:
        """Take the signals over; only a main thread can."""
        if threading.current_thread() is threading.main_thread():
            for name in SIGNALS:
                self._before[name] = signal.signal(name, self._hear)
            for number in early_signals.heard:
                self._hear(number, None)
            early_signals.heard.clear()
        return self

    def __exit__(self, *error: object) -> None:
        """Give the signals back as they were."""
        for name, handler in self._before.items():
            signal.signal(name, handler or signal.SIG_DFL)
        self._before.clear()


class _Alarm:
    """Calls `check` at every tick of a timer and remembers what it raised."""

    def __init__(self, check: Callable[[], None]) -> None:
        self.check, self._at_it = check, False
        self.told: Stop | None = None

    def __call__(self, number: int, frame: FrameType | None) -> None:
        del number, frame
        if self._at_it:  # a check that receives a message must not be cut in two
            return
        self._at_it = True
        try:
            self.check()
        except Stop as stop:
            self.told = stop
            raise
        finally:
            self._at_it = False


@contextmanager
def breakable(check: Callable[[], None]) -> Iterator[None]:
    """Break what is inside off at any line where `check` raises Stop.

    Compiling a kernel takes up to a minute and building a model may take seconds,
    without slices: a timer calls `check` meanwhile. Nothing is written to the
    campaign's files inside.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    alarm = _Alarm(check)
    before, hook = signal.signal(signal.SIGALRM, alarm), sys.unraisablehook
    sys.unraisablehook = partial(_unless_stop, hook)
    signal.setitimer(signal.ITIMER_REAL, BREAK_EVERY, BREAK_EVERY)
    try:
        yield
    except Exception:
        if alarm.told:  # a compiler may make another error of it
            raise alarm.told from None
        raise
    finally:
        try:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
        finally:  # also where the last tick came just now
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(signal.SIGALRM, before or signal.SIG_DFL)
            sys.unraisablehook = hook


def _unless_stop(hook: Callable[[Any], object], lost: Any) -> None:
    """Let `hook` tell of an exception that nobody could raise, unless it is Stop.

    A tick that falls into a callback of the compiler cannot raise there; the next one,
    a moment later, does.
    """
    if not isinstance(lost.exc_value, Stop):
        hook(lost)


def refuse_stop_file(folder: Path) -> None:
    """Raise InputError where a campaign has been stopped by its file until further."""
    if (folder / FILE).exists():
        msg = f"{folder / FILE} keeps this campaign stopped: remove it to go on"
        raise InputError(msg)


def time_left(
    walltime: float | None, env: Mapping[str, str] = os.environ
) -> float | None:
    """Return the seconds until a stop, None for no limit.

    The nearer of a wall-time that begins now and the end of the Slurm job counts,
    less a margin in which states are saved. PBS, LSF, SGE and Flux tell a job no end
    that could be relied on: there, `--walltime` says it.

    Parameters
    ----------
    walltime : s, or None
    env : the environment, with `SLURM_JOB_END_TIME` where Slurm sets it
    """
    ends = [walltime] if walltime is not None else []
    known = env.get(END_TIME, "")
    if known.isascii() and known.isdigit() and len(known) < 20:
        ends.append(max(int(known) - time.time(), 0.0))
    if not ends:
        return None
    left = min(ends)
    return left - min(MARGIN, 0.1 * left)
