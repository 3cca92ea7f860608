"""Early stop of a campaign: stop requests, and the watchdog that enforces them.

A request comes by a signal, a limit of time, the file STOP or from another rank. The
watchdog ends a job after a stop request even if a rank hangs. A rank that is stuck in a
case, or suspended, does not answer, and all others would wait for it. So a thread
watches the clock; it runs even while this process waits in MPI, where signal handlers
do not run.
"""

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
from hpcwhirl.errors import STOPPED, say
from hpcwhirl.launch import ALONE, Communicator, end_all, launcher

SIGNALS = early_signals.SIGNALS
MARGIN = 60.0  # s reserved before a wall-time ends, but at most a tenth of it
LOOK_EVERY = 1.0  # s between checks for the file STOP
BREAK_EVERY = 0.2  # s between checks during work that is not divided into slices
PILOT_OVER = "the pilot is over"
END_TIME = "SLURM_JOB_END_TIME"  # s since 1970, set by Slurm
WATCH_EVERY = 0.25  # s between checks
AFTER_ROOT = 2.0  # s by which other ranks wait longer, so that rank 0 can report first


class Stop(Exception):  # noqa: N818
    """Raised after a stop request, between two slices (10 ms) of an integration."""


class Stopping:
    """Stop requests to this process; code that integrates polls it every some 10 ms.

    Used in a `with` statement, it handles the signals TERM, USR1 and INT, also those
    that arrived during the imports, and restores the earlier handlers at the end.

    Attributes
    ----------
    reason : reason for the stop; "": no stop was requested
    settled : whether all cases are computed; the process is then not ended by force
    began : time from which limits count, monotonic clock, s
    """

    def __init__(self) -> None:
        self.reason = ""
        self.settled = False
        self.began = time.monotonic()
        self._file: Path | None = None
        self._deadline: float | None = None
        self._pilot_ends: float | None = None
        self._looked = 0.0
        self._heard = 0  # number of the last stop signal
        self._before: dict[int, Any] = {}

    def watch(self, file: Path | None, seconds: float | None) -> None:
        """Set what requests a stop besides signals: a file, a limit of time.

        Parameters
        ----------
        file : the file STOP; None: another rank of this node checks for that file
        seconds : time from `began` until the stop, s; None: no limit
        """
        self._looked = time.monotonic()
        self._file = file
        self._deadline = self.began + seconds if seconds is not None else None

    def pilot(self, seconds: float) -> None:
        """Request a stop in `seconds` from now, the computing time of a pilot."""
        self._pilot_ends = time.monotonic() + seconds

    def ask(self, reason: str) -> None:
        """Request a stop of this process, and so of the campaign on all ranks.

        reason : text for the user; the first request's text is kept
        """
        self.reason = self.reason or reason

    def __call__(self) -> bool:
        """Return whether a stop of this process has been requested or is due by now."""
        now = time.monotonic()
        if self._deadline is not None and now >= self._deadline:
            self.ask("the wall-time is nearly over")
        elif self._pilot_ends is not None and now >= self._pilot_ends:
            self.ask(PILOT_OVER)
        elif self._file is not None and now - self._looked >= LOOK_EVERY:
            self._looked = now
            with suppress(OSError):  # the file server does not answer: try again later
                if self._file.exists():
                    self.ask(f"{self._file} is there")
        return bool(self.reason)

    def check(self) -> None:
        """Raise Stop if a stop of this process has been requested."""
        if self():
            raise Stop

    def _hear(self, number: int, _frame: FrameType | None) -> None:
        self._heard = number
        self.ask(f"signal {signal.Signals(number).name.removeprefix('SIG')}")

    def step_aside(self) -> None:
        """Let the stop signals end this process at once, as they end other commands.

        One that has been heard already does so, too. Call it where nothing is computed
        that would have to be saved.
        """
        for name in self._before:
            own = name == signal.SIGINT
            signal.signal(name, signal.default_int_handler if own else signal.SIG_DFL)
        if self._heard:
            os.kill(os.getpid(), self._heard)

    def ignore(self) -> None:
        """Ignore the stop signals from now on, until the process ends.

        Call it before the interpreter ends, which drops Python's handlers, and before
        MPI ends, which may wait for other ranks.
        """
        for name in self._before:
            signal.signal(name, signal.SIG_IGN)
        self._before.clear()

    def __enter__(self) -> Self:
        """Install the signal handlers, which only the main thread can do."""
        if threading.current_thread() is threading.main_thread():
            for name in SIGNALS:
                self._before[name] = signal.signal(name, self._hear)
            for number in early_signals.heard:
                self._hear(number, None)
            early_signals.heard.clear()
        return self

    def __exit__(self, *error: object) -> None:
        """Restore the signal handlers that were installed before the block."""
        for name, handler in self._before.items():
            signal.signal(name, handler or signal.SIG_DFL)
        self._before.clear()


class _Alarm:
    """Handler of timer signals, for `breakable`: calls `check` at each signal.

    told : the Stop that `check` has raised; None: none yet
    """

    def __init__(self, check: Callable[[], None]) -> None:
        self.check, self._at_it = check, False
        self.told: Stop | None = None

    def __call__(self, _number: int, _frame: FrameType | None) -> None:
        if self._at_it:  # never interrupt a check that receives a message
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
    """Call `check` every `BREAK_EVERY` seconds in the block, so that a stop can end it.

    Any line of the block may then raise Stop. It is used for work that is not divided
    into slices: compiling a kernel takes up to a minute, building a model may take
    seconds. Nothing in the block may write to the campaign's files.
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
        if alarm.told:  # the compiler may have replaced the exception
            raise alarm.told from None
        raise
    finally:
        try:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
        finally:  # even if the last tick came just now
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(signal.SIGALRM, before or signal.SIG_DFL)
            sys.unraisablehook = hook


def _unless_stop(hook: Callable[[Any], object], lost: Any) -> None:
    """Report an exception that Python cannot raise to `hook`, unless it is Stop.

    A timer signal during a callback of the compiler cannot raise Stop; the next will.

    Parameters
    ----------
    hook : former `sys.unraisablehook`
    lost : argument of such a hook, which has the exception
    """
    if not isinstance(lost.exc_value, Stop):
        hook(lost)


def time_left(
    walltime: float | None, env: Mapping[str, str] = os.environ
) -> float | None:
    """Return the time until a run must stop, s; None for no limit.

    This is the time until a wall-time that begins now has passed or the Slurm job ends,
    whichever is earlier, less a margin for saving states. PBS, LSF, SGE and Flux give a
    job no reliable end time: use `--walltime` there.

    Parameters
    ----------
    walltime : s; None: no limit but the end of the Slurm job
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


class Watchdog:
    """Ends all ranks by force if this rank goes on for too long after a stop request.

    It is a thread that runs in a `with` statement.

    Parameters
    ----------
    stopping : handler of stop requests; nothing is ended once all cases are computed
    seconds : time from the request until the end, s
    comm : communicator of all ranks
    """

    def __init__(
        self, stopping: Stopping, seconds: float, comm: Communicator = ALONE
    ) -> None:
        self.stopping, self.seconds, self.comm = stopping, seconds, comm
        self.last: Callable[[], None] = lambda: None  # called before the end
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._read, self._write = os.pipe()
        self._before: int | None = None

    def _watch(self) -> None:
        asked: float | None = None
        while not self._over.wait(WATCH_EVERY):
            heard = self._heard()  # also signals that no handler has seen yet
            if launcher.is_dead:
                self.stopping.ask("the process that started this rank has died")
            if asked is None and (heard or self.stopping.reason):
                asked = time.monotonic()
            limit = self.seconds + (AFTER_ROOT if self.comm.rank else 0.0)
            late = asked is not None and time.monotonic() - asked > limit
            if late and not self.stopping.settled:
                self._end()

    def _heard(self) -> bool:
        """Return whether a stop signal has arrived since this was last called."""
        with suppress(OSError):
            return any(number in SIGNALS for number in os.read(self._read, 65536))
        return False

    def _end(self) -> None:
        """End all ranks by force; finished cases and saved states are kept."""
        whom = "ranks" if self.comm.size > 1 else "case"
        say(
            f"not all {whom} have stopped {self.seconds:g} s after the request: ended "
            "without them; finished cases are kept, the same command continues the "
            "campaign"
        )
        self.last()
        end_all(self.comm, STOPPED)
        os._exit(STOPPED)

    def __enter__(self) -> Self:
        """Start the watching thread; in the main thread, let it see signals, too."""
        for end in (self._read, self._write):
            os.set_blocking(end, False)
        if threading.current_thread() is threading.main_thread():
            write = self._write
            self._before = signal.set_wakeup_fd(write, warn_on_full_buffer=False)
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        """Stop the watching thread."""
        if self._before is not None:
            signal.set_wakeup_fd(self._before)
        self._over.set()
        self._thread.join()
        os.close(self._read)
        os.close(self._write)
