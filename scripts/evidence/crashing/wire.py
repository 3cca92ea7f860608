"""Ranks as forks of one process, that talk over pipes by mpi4py's names.

A rank that dies takes the others with it, as under mpirun. Every call of a communicator
is an await, counted on its rank: a rank may be slow, stopped or dead there.
"""

from __future__ import annotations

import os
import signal
import sys
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, Pipe, wait
from pathlib import Path
from typing import Any, NoReturn

from forks import RAISED, forked

from hpcwhirl.launch import Alone

TOGETHER = -1  # the tag of what all ranks call
ABORTED = 100  # and the code
LIMIT = 120.0  # s until ranks count as hung


@dataclass(frozen=True)
class Fault:
    """What happens to a rank at one of its awaits.

    Attributes
    ----------
    rank, where, at : whose, which of them, and how often it has been there before
    act : called there
    """

    rank: int
    where: str
    at: int
    act: Callable[[], None]


class Wire(Alone):
    """The communicator of one of several forks.

    Parameters
    ----------
    rank : of this one
    ends : of its pipes, one to each other rank
    fault : that may strike
    note : a file that is told of every await
    """

    def __init__(
        self,
        rank: int,
        ends: dict[int, Connection],
        fault: Fault | None = None,
        note: Path | None = None,
    ) -> None:
        self.rank, self.size = rank, len(ends) + 1
        self._ends, self._fault, self._note = ends, fault, note
        self._come: list[tuple[int, int, Any]] = []
        self._been: Counter[str] = Counter()

    def _await(self) -> None:
        frame = sys._getframe(1)
        while frame.f_back and frame.f_code.co_filename == __file__:
            call, frame = frame.f_code.co_name, frame.f_back
        where = f"{call} in {frame.f_code.co_qualname}"
        at = self._been[where]
        self._been[where] += 1
        if self._note:
            with self._note.open("a") as file:
                file.write(f"{self.rank} {where}\n")
        fault = self._fault
        if fault and (fault.rank, fault.where, fault.at) == (self.rank, where, at):
            fault.act()

    def _take(self, source: int | None, tag: int | None) -> Any:
        """Return the first message that has come from there, None without one."""
        for place, (rank, own, _) in enumerate(self._come):
            fits = own != TOGETHER if tag is None else own == tag
            if fits and source in (None, rank):
                return place
        return None

    def _listen(self, seconds: float | None) -> None:
        for end in wait(list(self._ends.values()), seconds):
            rank = next(r for r, own in self._ends.items() if own is end)
            try:
                while end.poll():
                    self._come.append((rank, *end.recv()))
            except (EOFError, OSError):  # it has ended, or died: then all will
                del self._ends[rank]

    def _send(self, value: Any, dest: int, tag: int) -> None:
        with suppress(OSError, KeyError):  # it has died: so will this one
            self._ends[dest].send((tag, value))

    def _receive(self, source: int | None, tag: int | None) -> Any:
        while (place := self._take(source, tag)) is None:
            if not self._ends:
                signal.pause()
            self._listen(None)
        return self._come.pop(place)[2]

    def send(self, value: Any, dest: int, tag: int = 0) -> None:
        """Send to a rank."""
        self._await()
        self._send(value, dest, tag)

    def recv(self, source: int | None = None, tag: int | None = None) -> Any:
        """Return the first message of a rank, or of any."""
        self._await()
        return self._receive(source, tag)

    def Iprobe(self, source: int | None = None, tag: int | None = None) -> bool:
        """Return whether a message has come."""
        self._await()
        self._listen(0.0)
        return self._take(source, tag) is not None

    def allgather(self, value: Any) -> list[Any]:
        """Return what every rank has given."""
        self._await()
        for other in range(self.size):
            if other != self.rank:
                self._send(value, other, TOGETHER)
        return [
            value if rank == self.rank else self._receive(rank, TOGETHER)
            for rank in range(self.size)
        ]

    def bcast(self, value: Any = None, root: int = 0) -> Any:
        """Return what `root` has given."""
        return self.allgather(value if self.rank == root else None)[root]

    def scatter(self, values: Any, root: int = 0) -> Any:
        """Return this rank's part."""
        return self.bcast(values, root)[self.rank]

    def gather(self, value: Any, root: int = 0) -> list[Any] | None:
        """Return what every rank has given, to `root`."""
        found = self.allgather(value)
        return found if self.rank == root else None

    def Barrier(self) -> None:
        """Wait for all."""
        self.allgather(None)

    def Abort(self, code: int) -> NoReturn:
        """End all ranks."""
        sys.stderr.flush()
        os._exit(ABORTED + code)


@dataclass
class Ranks:
    """Forks at work.

    Attributes
    ----------
    pids : of the ranks
    streams : where all that they print is
    code : the first exit code that is not 0, else 0; -N where signal N ended one
    """

    pids: list[int]
    streams: Path
    code: int | None = None

    def wait(self, *, stopped: bool = False, limit: float = LIMIT) -> int | None:
        """Return `code` once all have ended.

        Parameters
        ----------
        stopped : whether to return None as soon as a rank is stopped
        limit : s until all are killed and TimeoutError is raised
        """
        left, worst, end = set(self.pids), 0, time.monotonic() + limit
        while left:
            time.sleep(0.001)
            for pid in sorted(left):
                found, status = os.waitpid(pid, os.WNOHANG | os.WUNTRACED)
                if found and os.WIFSTOPPED(status):
                    if stopped:
                        self.pids = sorted(left)
                        return None
                    continue
                if found:
                    left.discard(pid)
                    code = os.waitstatus_to_exitcode(status)
                    worst = worst or (code - ABORTED if code >= ABORTED else code)
                    if code < 0 or code >= RAISED:
                        self.kill(left)
            if time.monotonic() > end:
                self.kill(left)
                msg = f"hung: see {self.streams}"
                raise TimeoutError(msg)
        self.code = worst
        return worst

    def go_on(self) -> None:
        """Let ranks that are stopped go on."""
        for pid in self.pids:
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGCONT)

    def kill(self, pids: set[int]) -> None:
        """End ranks, stopped ones, too."""
        for pid in pids:
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)

    def wrong(self, allowed: tuple[int, ...] = (0,)) -> str:
        """Return what is wrong with how they end, "" where nothing is."""
        try:
            code = self.wait() if self.code is None else self.code
        except TimeoutError:
            return "hangs"
        if code in allowed and "Traceback" not in self.told:
            return ""
        return f"ends with {code}: {self.told.strip()[-300:]}"

    @property
    def told(self) -> str:
        """All that was printed."""
        return self.streams.read_text(errors="replace") if self.streams.exists() else ""


def start(
    size: int,
    action: Callable[[Any], int],
    streams: Path,
    fault: Fault | None = None,
    note: Path | None = None,
) -> Ranks:
    """Start ranks as forks of this process.

    Parameters
    ----------
    size : of the communicator
    action : what each does with it; gives its exit code
    streams : a new file for what they print
    fault : that strikes one of them
    note : a file that is told of every await
    """
    streams.unlink(missing_ok=True)
    ends: list[dict[int, Connection]] = [{} for _ in range(size)]
    for one in range(size):
        for other in range(one):
            ends[one][other], ends[other][one] = Pipe()
    pids = []
    for rank in range(size):

        def own(rank: int = rank) -> int:
            _close(ends[:rank] + ends[rank + 1 :])
            return action(Wire(rank, ends[rank], fault, note))

        pids.append(forked(own, streams, streams))
    _close(ends)
    return Ranks(pids, streams)


def _close(all_of: list[dict[int, Connection]]) -> None:
    for own in all_of:
        for end in own.values():
            end.close()
