"""Compute isolated cases in another process, so that a crash ends only the case.

The child is a new interpreter, never a fork of a process that has initialized MPI. It
computes one case after the other: requests and answers are pickled objects, sent over a
pair of sockets that nothing else uses. The child ends when its end of the pair is
closed, and so with its parent.
"""

from __future__ import annotations

import faulthandler
import math
import os
import signal
import subprocess
import sys
import threading
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from typing import Any

from hpcwhirl.campaign.compute import (
    Checkpoints,
    DiedError,
    FailedError,
    LateError,
    compute,
    message_of,
)
from hpcwhirl.campaign.simulate import Result
from hpcwhirl.campaign.stop import SIGNALS, Stop
from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import WhirlError, say
from hpcwhirl.launch import fate, interpreter, without_mpi
from hpcwhirl.scene import Scene
from hpcwhirl.store.directory.states import States

LOOK_EVERY = 0.01  # s between checks, as between slices
PATIENCE = 3.0  # s that a child has to save its state at a stop
GRACE = 10.0  # s beyond a case's limit, for work outside the kernel
STOP = "stop"  # message, sent in place of a request, that asks the child to stop


class Child:
    """The separate process in which a rank runs isolated cases; started when needed.

    Parameters
    ----------
    states : saved states of the campaign
    save_every : computing time of a case between two checkpoints, s
    """

    def __init__(self, states: States, save_every: float) -> None:
        self._first = States(states.folder.resolve()), save_every
        self._process: subprocess.Popen[bytes] | None = None
        self._pipe: Any = None

    def warm(self, scenes: list[Scene], between: Callable[[], None]) -> None:
        """Let the separate process compile the kernels of some scenes.

        An error of a scene is reported only when its case is computed.

        Parameters
        ----------
        scenes : inputs of the cases
        between : called while waiting; may raise Stop
        """
        for scene in scenes:
            with suppress(DiedError):
                self._ask((scene,), math.inf, between)

    def compute(
        self,
        scene: Scene,
        digest: str,
        limit: float,
        between: Callable[[], None],
        *,
        keep: bool = False,
    ) -> Result:
        """Compute a case in the separate process and return its result.

        The arguments are those of the function `compute.compute`.

        Raises
        ------
        DiedError, FailedError, LateError
            if the case crashes, fails or exceeds its limit; `Stop` if `between` raises
            it and no result has arrived
        """
        answer = self._ask((scene, digest, limit, keep), limit, between)
        if isinstance(answer, Result):
            return answer
        raise answer

    def close(self) -> None:
        """End the separate process, if it was started."""
        if self._process is None:
            return
        self._pipe.close()
        try:
            self._process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            self._process.kill()
        self._reap()

    def _begin(self) -> subprocess.Popen[bytes]:
        self._pipe, theirs = Pipe()
        # a session of its own: only the parent gets Ctrl-C, and stops the child
        with theirs:
            self._process = subprocess.Popen(
                interpreter(__name__, str(theirs.fileno())), stdin=subprocess.DEVNULL,
                stdout=2, pass_fds=[theirs.fileno()], start_new_session=True,
            )  # fmt: skip
        self._send(self._first)
        return self._process

    def _reap(self) -> int:
        """Close the socket, wait until the child process ends; return its exit code."""
        process, self._process = self._process, None
        self._pipe.close()
        return process.wait() if process else 0

    def _send(self, told: Any) -> None:
        """Send a request to the child process; nothing is raised if it has died.

        Reading its answer will fail then.
        """
        with suppress(OSError):
            self._pipe.send(told)

    def _ask(self, asked: Any, limit: float, between: Callable[[], None]) -> Any:
        """Send the child process a request; return its answer.

        The answer is a result, or the exception to raise.

        Parameters
        ----------
        asked : the request
        limit : limit of the computing time of its case, s
        between : called while waiting; may raise Stop
        """
        process = self._process or self._begin()
        self._send(asked)
        end = time.monotonic() + limit + GRACE
        stop: Stop | None = None
        while True:
            try:
                if self._pipe.poll(LOOK_EVERY):
                    return self._received(process)
            except (EOFError, OSError):
                code = self._reap()
                between()
                raise DiedError(f"the case's process {fate(code)}") from None
            try:
                if stop is None:
                    between()
            except Stop as told:
                stop, end = told, time.monotonic() + PATIENCE
                self._send(STOP)
            if time.monotonic() > end:
                process.kill()
                self._reap()
                late = LateError(
                    f"more than {limit:g} s of computing; the case's process hangs"
                )
                raise stop or late

    def _received(self, process: subprocess.Popen[bytes]) -> Any:
        """Return an answer that has begun to arrive; kill a child that hangs."""
        timer = threading.Timer(GRACE, process.kill)
        timer.start()
        try:
            return self._pipe.recv()
        finally:
            timer.cancel()


class Server:
    """Computes cases in the separate process and sends the results to its `Child`.

    pipe : connection to the parent process
    """

    def __init__(self, pipe: Any) -> None:
        self._pipe = pipe
        states, every = self._next()
        self.checkpoints = Checkpoints(states, every, say)

    def serve(self) -> None:
        """Compute what the parent process requests, one request after the other."""
        while True:
            scene, *how = self._next()
            self._send(self._computed(scene, *how) if how else _warmed(scene))

    def _next(self) -> Any:
        """Return the parent's next request, skipping stop requests that come late."""
        while (asked := self._pipe.recv()) == STOP:
            pass
        return asked

    def _send(self, told: Any) -> None:
        self._pipe.send(told)

    def _between(self) -> None:
        """Raise Stop if the parent process requests it; exit if that has ended."""
        if self._pipe.poll():
            try:
                self._pipe.recv()
            except (EOFError, OSError):
                os._exit(1)
            raise Stop

    def _computed(
        self,
        scene: Scene,
        digest: str,
        limit: float,
        keep: bool,  # noqa: FBT001
    ) -> Result | Exception:
        """Compute a case; return its result, or the exception for the parent to raise.

        scene, digest, limit, keep : arguments of `compute.compute`, without model
        """
        try:
            return compute(
                resolve(scene), digest, self.checkpoints, limit, self._between,
                keep=keep,
            )  # fmt: skip
        except (Stop, LateError) as told:
            return told
        except Exception as failed:  # noqa: BLE001 - recorded as a failed case
            if not isinstance(failed, WhirlError):
                traceback.print_exc()
            return FailedError(message_of(failed))


def _warmed(scene: Scene) -> str:
    """Compile the kernels of a scene; return "warm", the answer to such a request."""
    with suppress(Exception):  # this case will fail
        March(resolve(scene)).warm()
    return "warm"


def main() -> None:
    """Answer the parent's requests until it ends: main program of the child process.

    The argument of this process is the descriptor of its socket.
    """
    for name in SIGNALS:  # only the parent requests a stop
        signal.signal(name, signal.SIG_IGN)
    faulthandler.enable()
    without_mpi()
    with suppress(EOFError, OSError):  # the parent has ended
        Server(Connection(int(sys.argv[1]))).serve()
