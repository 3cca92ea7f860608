"""Isolated cases: computed in another interpreter, so that a crash ends only the case.

The child is a new process, never a fork of a process that has initialized MPI. It
computes one case after the other: a request is a line with CRC; an answer is such a
line and the bytes of the traces. It ends when its input ends, and so with its parent.
"""

from __future__ import annotations

import contextlib
import math
import os
import select
import subprocess
import time
from collections.abc import Callable

from hpcwhirl.campaign.compute import DiedError, FailedError, LateError
from hpcwhirl.campaign.simulate import Result
from hpcwhirl.campaign.stop import Stop
from hpcwhirl.launch import fate, interpreter
from hpcwhirl.scene import Scene, flatten
from hpcwhirl.store.directory.packing import opened, sealed, unpacked
from hpcwhirl.store.directory.record import Record
from hpcwhirl.store.directory.states import States

LOOK_EVERY = 0.01  # s between checks, as between slices
PATIENCE = 3.0  # s that a child has to save its state at a stop
GRACE = 10.0  # s beyond a case's limit, for work outside the kernel
STOP = b"stop\n"
MODULE = "hpcwhirl.campaign.worker_main"


class Child:
    """The subprocess in which a rank runs isolated cases; started when needed.

    Parameters
    ----------
    states : those of the campaign
    save_every : computing time of a case between two checkpoints, s
    """

    def __init__(self, states: States, save_every: float) -> None:
        self._first = {"path": str(states.folder.resolve()), "every": save_every}
        self._process: subprocess.Popen[bytes] | None = None
        self._come = bytearray()
        self._head: Record | None = None

    def warm(self, scenes: list[Scene], between: Callable[[], None]) -> None:
        """Let the child compile the kernels of some scenes; errors appear later."""
        for scene in scenes:
            with contextlib.suppress(DiedError):
                self._ask({"warm": flatten(scene)}, math.inf, between)

    def compute(
        self,
        scene: Scene,
        digest: str,
        limit: float,
        between: Callable[[], None],
        *,
        keep: bool = False,
    ) -> Result:
        """Return the result of a case, computed by `compute` in the child.

        Raises
        ------
        DiedError, FailedError, LateError
            if the case crashes, fails or exceeds its limit; `Stop` if `between` raises
            it and no result has arrived
        """
        asked: Record = {"scene": flatten(scene), "digest": digest, "keep": keep}
        asked["limit"] = limit if limit < math.inf else None
        answer, data = self._ask(asked, limit, between)
        kinds = {"failed": FailedError, "timeout": LateError}
        if answer["status"] in kinds:
            raise kinds[answer["status"]](answer["message"])
        if answer["status"] == "stopped":
            raise Stop
        traces = unpacked(answer, data)
        if traces is None:
            msg = "the answer of the case's process is damaged"
            raise FailedError(msg)
        return Result(answer["row"], traces, answer["performance"])

    def close(self) -> None:
        """End the child."""
        if self._process is None or self._process.stdin is None:
            return
        with contextlib.suppress(OSError):
            self._process.stdin.close()
        try:
            self._process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            self._process.kill()
        self._reap()

    def _begin(self) -> subprocess.Popen[bytes]:
        # a session of its own: only the parent gets Ctrl-C, and stops the child
        self._process = subprocess.Popen(
            interpreter(MODULE), stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            bufsize=0, start_new_session=True,
        )  # fmt: skip
        self._come, self._head = bytearray(), None
        self._send(sealed(self._first))
        return self._process

    def _reap(self) -> int:
        """Close the pipes, wait for the child's end, and return its exit code."""
        process, self._process = self._process, None
        if process is None:
            return 0
        for pipe in (process.stdin, process.stdout):
            if pipe:
                with contextlib.suppress(OSError):
                    pipe.close()
        return process.wait()

    def _send(self, line: bytes) -> None:
        """Write a line to the child; if it has died, reading the answer will fail."""
        process = self._process
        if process is not None and process.stdin is not None:
            with contextlib.suppress(OSError):
                process.stdin.write(line)

    def _ask(
        self, asked: Record, limit: float, between: Callable[[], None]
    ) -> tuple[Record, bytes]:
        """Return the child's answer and the bytes of its traces.

        between : called while waiting; may raise Stop
        """
        process = self._process or self._begin()
        self._send(sealed(asked))
        end = time.monotonic() + limit + GRACE
        stop: Stop | None = None
        while True:
            answer = self._look(process, between)
            if answer is not None:
                return answer
            try:
                if stop is None:
                    between()
            except Stop as told:
                stop, end = told, time.monotonic() + PATIENCE
                self._send(STOP)
            if time.monotonic() > end:
                process.kill()
                self._reap()
                msg = f"more than {limit:g} s, and the case did not answer"
                raise stop or LateError(msg)

    def _look(
        self, process: subprocess.Popen[bytes], between: Callable[[], None]
    ) -> tuple[Record, bytes] | None:
        """Return a complete answer and the bytes of its traces; None: not there yet."""
        if process.stdout is None:
            return None
        pipe = process.stdout.fileno()
        if not select.select([pipe], [], [], LOOK_EVERY)[0]:
            return None
        part = os.read(pipe, 1 << 20)
        if not part:
            raise self._death(between)
        self._come += part
        end = self._come.find(b"\n") + 1 if self._head is None else 0
        if end:
            self._head = opened(bytes(self._come[:end]))
            del self._come[:end]
        if self._head is None or len(self._come) < self._head["bytes"]:
            return None
        answer = self._head, bytes(self._come)
        self._come, self._head = bytearray(), None
        return answer

    def _death(self, between: Callable[[], None]) -> DiedError:
        """Return the error for a dead child, unless `between` raises Stop first."""
        code = self._reap()
        between()
        return DiedError(f"the case's process {fate(code)}")
