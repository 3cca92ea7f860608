"""The interpreter of isolated cases, struck at one of its awaits.

It awaits each request of its rank, and its rank each answer. It is struck as it is
about to await or to answer, or once half of an answer has gone.
"""

from __future__ import annotations

import os
import signal
import struct
import subprocess
from collections.abc import Iterator
from multiprocessing.reduction import ForkingPickler
from typing import Any

STRUCK = "CRASH_CHILD"  # word, how often it was said before, what happens
AWAITS = ("_next", "_send")  # of `hpcwhirl.campaign.worker_process.Server`
HOW = ("dies", "is stopped", "dies in its midst")
ENDS = (HOW[0], HOW[2])  # those that cost a case
PAUSE = 0.3  # s of being stopped


def points(often: int) -> Iterator[tuple[str, int, str]]:
    """Yield (await, how often it was come to before, what happens there).

    often : times that each is come to
    """
    for word in AWAITS:
        for at in range(often):
            for how in HOW if word == "_send" else HOW[:2]:
                yield word, at, how


def _strike(how: str) -> None:
    if how == "is stopped":
        wake = f"sleep {PAUSE}; kill -CONT {os.getpid()}"
        subprocess.Popen(["sh", "-c", wake], start_new_session=True)
        os.kill(os.getpid(), signal.SIGSTOP)
        return
    os.kill(os.getpid(), signal.SIGKILL)


class _Half:
    """A pipe that takes half of what it is given, and is the end of its process."""

    def __init__(self, pipe: Any) -> None:
        self.pipe = pipe

    def send(self, told: Any) -> None:
        data = ForkingPickler.dumps(told)
        half = struct.pack("!i", len(data)) + data[: len(data) // 2]
        os.write(self.pipe.fileno(), half)  # as `multiprocessing.connection` frames it
        _strike("dies")


def main() -> None:
    """Serve as `hpcwhirl.campaign.worker_process` does, until struck."""
    from hpcwhirl.campaign import worker_process

    word, at, how = os.environ[STRUCK].split(",")
    plain, been = getattr(worker_process.Server, word), [0]

    def struck(server: Any, *told: Any) -> Any:
        now = been[0] == int(at)
        been[0] += 1
        if now and how == "dies in its midst":
            server._pipe = _Half(server._pipe)
        elif now:
            _strike(how)
        return plain(server, *told)

    setattr(worker_process.Server, word, struck)
    worker_process.main()
