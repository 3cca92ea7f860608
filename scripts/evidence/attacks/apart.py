"""Commands in processes of their own that are watched: forked, or started anew.

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
import traceback
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

LIMIT = 300.0  # s until a command counts as hung; a kernel may have to be compiled
BROKEN = 99  # exit code of a fork where something else than the command raised
MEMORY = 8 << 30  # bytes of address space a fork may ask for beyond what it has
ROOT = Path(__file__).parents[3]
Words = Sequence[str | Path]


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
        """The last line of what it complained of, cut to be read."""
        lines = self.err.strip().splitlines() or [""]
        return lines[-1][:160]


class Child:
    """A process at work, its streams kept in files.

    Parameters
    ----------
    pid : of the process, which leads a group of its own
    place : where its streams are kept
    name : of the files
    """

    def __init__(self, pid: int, place: Path, name: str) -> None:
        self.pid, self.place, self.name = pid, place, name
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
        """Send a signal to the process alone."""
        signal.pidfd_send_signal(self._handle, number)

    def kill(self) -> None:
        """End the process and all that it has started."""
        with suppress(ProcessLookupError):
            os.killpg(self.pid, signal.SIGKILL)

    def wait(self, times: float = 1.0) -> Ended:
        """Return how it ended; what takes so many times `LIMIT` is killed: hung."""
        if self._ended is None:
            hung = not self._over(times * LIMIT)
            if hung:
                self.kill()
            _, status, usage = os.wait4(self.pid, 0)
            self.kill()  # what it may have left behind
            os.close(self._handle)
            code = os.waitstatus_to_exitcode(status)
            out, err = (self._text(kind) for kind in ("out", "err"))
            self._ended = Ended(code, out, err, hung, 1024 * usage.ru_maxrss)
        return self._ended

    def _text(self, kind: str) -> str:
        path = self.place / f"{self.name}.{kind}"
        return path.read_bytes().decode(errors="replace") if path.exists() else ""


def _streams(place: Path, name: str) -> None:
    """Let standard streams of this process be nothing, and two files."""
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    for number, kind in ((1, "out"), (2, "err")):
        path = place / f"{name}.{kind}"
        file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_APPEND)
        os.dup2(file, number)


def fork(
    action: Callable[[], int],
    place: Path,
    name: str = "command",
    *,
    setup: Callable[[], object] | None = None,
) -> Child:
    """Start `action` in a fork of this process.

    Parameters
    ----------
    action : gives the exit code
    place : where streams are kept
    name : of the files
    setup : called before, in the fork
    """
    place.mkdir(parents=True, exist_ok=True)
    sys.stdout.flush()
    sys.stderr.flush()
    pid = os.fork()
    if pid:
        with suppress(OSError):
            os.setpgid(pid, pid)
        return Child(pid, place, name)
    code = BROKEN
    try:
        os.setpgid(0, 0)
        _streams(place, name)
        _limit_memory()
        if setup:
            setup()
        code = action()
        sys.stdout.flush()
    except SystemExit as left:
        code = left.code if isinstance(left.code, int) else BROKEN
    except BaseException:  # noqa: BLE001 - told, and a code that no command has
        traceback.print_exc()
    finally:
        with suppress(Exception):
            sys.stderr.flush()
        os._exit(code & 0xFF)


def _limit_memory() -> None:
    """Let a bomb burst in its own process before it takes the machine."""
    had = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (had + MEMORY, had + MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def command(words: Words) -> Callable[[], int]:
    """Return the call of `hpcwhirl WORDS` in this process."""

    def call() -> int:
        from hpcwhirl.cli import main

        sys.argv = ["hpcwhirl", *map(str, words)]
        return main([str(word) for word in words])

    return call


def run(
    words: Words,
    place: Path,
    *,
    setup: Callable[[], object] | None = None,
) -> Ended:
    """Return how `hpcwhirl WORDS` ends in a fork."""
    return fork(command(words), place, setup=setup).wait()


def start(
    call: Words,
    place: Path,
    name: str = "command",
    env: Mapping[str, str] | None = None,
    cwd: Path | None = None,
) -> Child:
    """Start a program of its own, e.g. an interpreter or mpirun, in its own group."""
    place.mkdir(parents=True, exist_ok=True)
    told = {**os.environ, "PYTHONPATH": str(ROOT), **(env or {})}
    files = [(place / f"{name}.{kind}").open("wb") for kind in ("out", "err")]
    with files[0] as out, files[1] as err:
        process = subprocess.Popen(
            [str(word) for word in call],
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=err,
            env=told,
            cwd=cwd,
            process_group=0,
        )
    process.returncode = 0  # it is waited for by its handle, not by this object
    return Child(process.pid, place, name)


def tree(pid: int) -> list[int]:
    """Return a process and all that descend from it; mpirun's have own groups."""
    found = [pid]
    for task in Path(f"/proc/{pid}/task").glob("*/children"):
        with suppress(OSError):
            for child in task.read_text().split():
                found += tree(int(child))
    return found


def kill_tree(pid: int) -> None:
    """Kill a process and its descendants before one of them can clean up."""
    members = tree(pid)
    for number in (signal.SIGSTOP, signal.SIGKILL):
        for one in members:
            with suppress(ProcessLookupError):
                os.kill(one, number)


def until(reached: Callable[[], bool], limit: float) -> bool:
    """Wait until something is reached; return whether it was within `limit` s."""
    end = time.monotonic() + limit
    while not reached():
        if time.monotonic() > end:
            return False
        time.sleep(0.001)
    return True
