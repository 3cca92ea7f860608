"""Main program of the interpreter for isolated cases; see `worker_process`."""

from __future__ import annotations

import contextlib
import faulthandler
import os
import select
import signal
import time
import traceback
from collections.abc import Mapping
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.campaign.checkpoints import Checkpoints
from hpcwhirl.campaign.compute import LateError, compute, message_of
from hpcwhirl.campaign.log import say
from hpcwhirl.campaign.stop import SIGNALS, Stop
from hpcwhirl.campaign.worker_process import STOP
from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import WhirlError
from hpcwhirl.launch import without_mpi
from hpcwhirl.scene import Scene, apply_settings
from hpcwhirl.store.directory.lines import opened, sealed
from hpcwhirl.store.directory.packing import packed
from hpcwhirl.store.directory.record import Record
from hpcwhirl.store.directory.states import States


class Server:
    """Child process of `isolate`: integrates requested cases until its input ends."""

    def __init__(self, source: int, sink: BinaryIO) -> None:
        self._source, self._sink, self._come = source, sink, b""
        first = self._next() or {}
        self.checkpoints = Checkpoints(States(Path(first["path"])), first["every"], say)

    def serve(self) -> None:
        """Answer one request after the other."""
        while (asked := self._next()) is not None:
            if "warm" in asked:
                self._warm(asked)
            else:
                self._answer(asked)

    def _next(self) -> Record | None:
        """Return the next request; None at the end. Late stop requests are skipped."""
        while True:
            line, found, rest = self._come.partition(b"\n")
            if found:
                self._come = rest
                asked = opened(line + found)
                if asked is not None:
                    return asked
                continue
            part = os.read(self._source, 65536)
            if not part:
                return None
            self._come += part

    def _between(self) -> None:
        """Raise Stop if the parent requests it; exit if the parent has ended."""
        if not select.select([self._source], [], [], 0.0)[0]:
            return
        part = os.read(self._source, 65536)
        if not part:
            os._exit(1)
        self._come += part
        if STOP in self._come:
            self._come = b""
            raise Stop

    def _warm(self, asked: Record) -> None:
        with contextlib.suppress(Exception):  # the case itself will fail the same way
            March(resolve(apply_settings(Scene(), asked["warm"]))).warm()
        self._send({"status": "warm"})

    def _answer(self, asked: Record) -> None:
        start = time.perf_counter()
        limit = float("inf") if asked["limit"] is None else asked["limit"]
        try:
            digest, keep = asked["digest"], asked["keep"]
            case = resolve(apply_settings(Scene(), asked["scene"]))
            result = compute(
                case, digest, self.checkpoints, limit, self._between, keep=keep
            )
        except Stop:
            self._send({"status": "stopped"})
        except Exception as failed:  # noqa: BLE001 - sent as the answer
            if not isinstance(failed, WhirlError):
                traceback.print_exc()
            status = "timeout" if isinstance(failed, LateError) else "failed"
            spent = time.perf_counter() - start
            told = {"status": status, "message": message_of(failed), "seconds": spent}
            self._send(told)
        else:
            told = {"status": "ok", "row": result.row}
            self._send(told | {"performance": result.performance}, result.traces)

    def _send(
        self, told: Record, traces: Mapping[str, NDArray[np.float64]] | None = None
    ) -> None:
        head, data = packed(traces or {})
        self._sink.write(sealed(told | head) + data)
        self._sink.flush()


def main() -> None:
    """Serve requests on stdin, answer on stdout; other output goes to stderr."""
    for name in SIGNALS:  # only the parent requests a stop
        signal.signal(name, signal.SIG_IGN)
    faulthandler.enable()
    without_mpi()
    sink = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    with contextlib.suppress(BrokenPipeError):
        Server(0, sink).serve()


if __name__ == "__main__":
    main()
