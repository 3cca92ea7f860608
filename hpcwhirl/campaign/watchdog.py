"""Watchdog: a job ends after a stop request even if one of its ranks hangs.

A rank that is stuck in a case, or suspended, does not answer, and all others would wait
for it. So a thread watches the clock; it runs even while this process waits in MPI,
where signal handlers do not run.
"""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Self

from hpcwhirl.campaign.log import say
from hpcwhirl.campaign.stop import SIGNALS, Stopping
from hpcwhirl.launch import ALONE, Communicator, end_all

STOPPED = 75
LOOK_EVERY = 0.25  # s between checks
AFTER_ROOT = 2.0  # s by which other ranks wait longer, so that rank 0 can report first


class Watchdog:
    """Ends this process, and with it all ranks, some time after a stop request.

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
        while not self._over.wait(LOOK_EVERY):
            heard = self._heard()  # also signals that no handler has seen yet
            if asked is None and (heard or self.stopping.reason):
                asked = time.monotonic()
            limit = self.seconds + (AFTER_ROOT if self.comm.rank else 0.0)
            late = asked is not None and time.monotonic() - asked > limit
            if late and not self.stopping.settled:
                self._end()

    def _heard(self) -> bool:
        """Return whether a stop signal has arrived since the last call."""
        with suppress(OSError):
            return any(number in SIGNALS for number in os.read(self._read, 65536))
        return False

    def _end(self) -> None:
        """End all ranks; finished cases and saved states are kept."""
        whom = "ranks" if self.comm.size > 1 else "case"
        say(
            f"not all {whom} have stopped {self.seconds:g} s after the request: ended "
            "without them; finished cases are kept, the same command continues"
        )
        self.last()
        end_all(self.comm, STOPPED)
        os._exit(STOPPED)

    def __enter__(self) -> Self:
        """Start the thread; the main thread, which alone gets signals, passes them."""
        for end in (self._read, self._write):
            os.set_blocking(end, False)
        if threading.current_thread() is threading.main_thread():
            write = self._write
            self._before = signal.set_wakeup_fd(write, warn_on_full_buffer=False)
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        """Stop the thread."""
        if self._before is not None:
            signal.set_wakeup_fd(self._before)
        self._over.set()
        self._thread.join()
        os.close(self._read)
        os.close(self._write)
