"""Commands in watched processes of their own: forked, or started anew.

A fork of a process that has imported and compiled everything answers within
milliseconds; where the start of an interpreter is the point, or MPI, one is started.
"""

from __future__ import annotations

import os
import resource
import select
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from common import MPIRUN
from forks import forked

LIMIT = 300.0  # s until a command counts as hung; a kernel may have to be compiled
MEMORY = 8 << 30  # bytes of address space a fork may ask for beyond what it has
ROOT = Path(__file__).parents[3]
PROGRAM = (sys.executable, "-m", "hpcwhirl")
Words = Sequence[str | Path]
Action = Callable[[], int]


@dataclass(frozen=True)
class Ended:
    """How a command ended.

    Attributes
    ----------
    code : its exit code; -N where signal N ended it
    out, err : what it printed
    hung : whether it had to be killed
    peak : bytes of memory it had at most
    """

    code: int
    out: str
    err: str
    hung: bool
    peak: int

    @property
    def last(self) -> str:
        """The last line on stderr, cut to be read."""
        return (self.err.strip().splitlines() or [""])[-1][:160]


class Child:
    """A process at work, leader of a group, its streams kept in files `path`.out, .err.

    Parameters
    ----------
    pid : of the process
    path : of its streams, without a suffix
    """

    def __init__(self, pid: int, path: Path) -> None:
        self.pid, self.path = pid, path
        self._handle = os.pidfd_open(pid)
        self._ended: Ended | None = None

    @property
    def alive(self) -> bool:
        """Whether it is still at work."""
        return self._ended is None and not self._over(0.0)

    def _over(self, seconds: float) -> bool:
        poll = select.poll()
        poll.register(self._handle, select.POLLIN)
        return bool(poll.poll(1e3 * seconds))

    def signal(self, number: int) -> None:
        """Send a signal to the process alone, if it is still there."""
        with suppress(ProcessLookupError):
            signal.pidfd_send_signal(self._handle, number)

    def kill(self) -> None:
        """End the process and all of its group."""
        with suppress(ProcessLookupError):
            os.killpg(self.pid, signal.SIGKILL)

    def wait(self, times: float = 1.0) -> Ended:
        """Return how it ended; after so many times `LIMIT` it is killed as hung."""
        if self._ended is None:
            hung = not self._over(times * LIMIT)
            if hung:
                self.kill()
            _, status, usage = os.wait4(self.pid, 0)
            self.kill()  # what it may have left behind
            os.close(self._handle)
            files = [self.path.with_suffix(kind) for kind in (".out", ".err")]
            told = (f.read_bytes().decode(errors="replace") if f.exists() else ""
                    for f in files)  # fmt: skip
            code = os.waitstatus_to_exitcode(status)
            self._ended = Ended(code, *told, hung, 1024 * usage.ru_maxrss)
        return self._ended


def fork(action: Action, place: Path, name: str = "command") -> Child:
    """Call `action`, which gives the exit code, in a fork; streams go to `place`."""
    place.mkdir(parents=True, exist_ok=True)
    files = [(place / name).with_suffix(kind) for kind in (".out", ".err")]
    for file in files:
        file.write_bytes(b"")

    def limited() -> int:
        """Let a bomb burst in its own process before it takes the machine."""
        os.setpgid(0, 0)
        pages = int(Path("/proc/self/statm").read_text().split()[0])
        most = pages * resource.getpagesize() + MEMORY
        resource.setrlimit(resource.RLIMIT_AS, (most, most))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        return action()

    pid = forked(limited, *files)
    with suppress(OSError):
        os.setpgid(pid, pid)
    return Child(pid, place / name)


def command(words: Words, setup: Callable[[], object] = bool) -> Action:
    """Return the call of `hpcwhirl WORDS` in this process, `setup` called before."""

    def call() -> int:
        from hpcwhirl.cli import main

        setup()
        sys.argv = ["hpcwhirl", *map(str, words)]
        return main(sys.argv[1:])

    return call


def run(words: Words, place: Path, setup: Callable[[], object] = bool) -> Ended:
    """Return how `hpcwhirl WORDS` ends in a fork."""
    return fork(command(words, setup), place).wait()


def start(
    call: Words, place: Path, env: Mapping[str, str] | None = None, ranks: int = 0
) -> Child:
    """Start a program, e.g. an interpreter, under mpirun if it has ranks."""
    place.mkdir(parents=True, exist_ok=True)
    front = [*MPIRUN, "-n", str(ranks)] if ranks else []
    path = place / "started"
    with (
        path.with_suffix(".out").open("wb") as out,
        path.with_suffix(".err").open("wb") as err,
    ):
        process = subprocess.Popen(
            [*front, *map(str, call)], stdin=subprocess.DEVNULL, stdout=out,
            stderr=err, process_group=0,
            env={**os.environ, "PYTHONPATH": str(ROOT), **(env or {})},
        )  # fmt: skip
    process.returncode = 0  # it is waited for by its handle, not by this object
    return Child(process.pid, path)


def tree(pid: int) -> list[int]:
    """Return a process and all that descend from it; mpirun's have own groups."""
    out = [pid]
    for task in Path(f"/proc/{pid}/task").glob("*/children"):
        with suppress(OSError):
            for child in task.read_text().split():
                out += tree(int(child))
    return out


def kill_tree(pid: int) -> None:
    """Kill a process and its descendants before one of them can clean up."""
    members = tree(pid)
    for number in (signal.SIGSTOP, signal.SIGKILL):
        for member in members:
            with suppress(ProcessLookupError):
                os.kill(member, number)


def wait_for(reached: Callable[[], bool], limit: float) -> None:
    """Wait until something is reached, at most `limit` s."""
    end = time.monotonic() + limit
    while not reached() and time.monotonic() < end:
        time.sleep(0.001)
