"""Heartbeats: notes of the cases that each rank computes, one file per rank and run.

The file is mapped into memory: writing a note takes no system call, and the note of a
process that is killed remains.

A process that ends in an orderly way, finished or stopped, removes its file. So a file
left behind names the cases that were being computed when a process died. Number and
start of a process tell a dead process from a new one with the same number.
"""

from __future__ import annotations

import os
import socket
import time
from collections import Counter
from collections.abc import Collection, Iterable
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass
from functools import cache
from mmap import mmap
from pathlib import Path

from hpcwhirl.errors import MissingFileError
from hpcwhirl.safe_open import open_new, read_regular
from hpcwhirl.store.atomic import telling
from hpcwhirl.store.directory.journal import journal_name, listed
from hpcwhirl.store.directory.record import Record, opened, sealed

PAGE = 4096  # bytes
DEAD = {"Z", "X", "x"}  # states in /proc of a process that has ended


class Running(AbstractContextManager["Running"]):
    """The file in which this rank notes the cases that it computes, during one run.

    It is used in a `with` statement, which removes the file at the end.

    Parameters
    ----------
    notes : notes of the campaign
    run, rank : number of the run, and rank of this process, as in its journal's name
    """

    def __init__(self, notes: Notes, run: int, rank: int) -> None:
        self._path = notes.place / journal_name(run, rank)
        pid = os.getpid()
        self._who: Record = {"rank": rank, "host": socket.gethostname(), "pid": pid}
        self._who["ticks"] = begun(pid)
        self._memory: mmap | bytearray = bytearray()
        with telling(f"in {notes.folder}"):
            self._path.parent.mkdir(parents=True, exist_ok=True)
            self._file = open_new(self._path, "w+b")

    def begin(self, digests: Iterable[str]) -> None:
        """Write a note that this rank begins to compute some cases.

        The note is not synced: it must survive the process, not the machine.

        digests : digests of the cases
        """
        line = sealed(self._who | {"digests": list(digests), "since": time.time()})
        # If the disk is full, the campaign stops when it writes its next result.
        with suppress(OSError):
            if len(line) > len(self._memory):
                self._memory = self._mapped(-(-len(line) // PAGE) * PAGE)
            self._memory[: len(line)] = line
            if not isinstance(self._memory, mmap):
                os.pwrite(self._file.fileno(), line, 0)

    def _mapped(self, size: int) -> mmap | bytearray:
        """Return the file of the note mapped into memory, or a buffer if that fails.

        size : bytes of both
        """
        os.pwrite(self._file.fileno(), bytes(size), 0)  # a full disk shows only here
        try:
            return mmap(self._file.fileno(), size)
        except (OSError, ValueError):  # ValueError: the file is shorter than `size`
            return bytearray(size)

    def __exit__(self, *error: object) -> None:
        """Remove the file of the note, since this process ends in an orderly way."""
        with suppress(OSError):  # the file is no longer needed
            self._file.close()
        with suppress(OSError):
            self._path.unlink()


@dataclass(frozen=True)
class Note:
    """Content of a heartbeat file: which process computes which cases.

    Attributes
    ----------
    rank, host, pid : rank, host and number of the process
    digests : digests of the cases: one, or several while kernels are compiled
    since : time at which these cases were begun, s since 1970; None if unknown
    ticks : start of the process, clock ticks since the boot; None if unknown
    """

    rank: int
    host: str
    pid: int
    digests: list[str]
    since: float | None
    ticks: int | None = None

    @property
    def left_over(self) -> bool:
        """Whether the process of this note ran on this host and is dead."""
        here = self.host == socket.gethostname()
        return here and not is_alive(self.pid, self.ticks)


def _note(path: Path) -> Note | None:
    """Return the note that a heartbeat file holds; None if it was written in part."""
    try:
        line, end, _ = read_regular(path).partition(b"\n")
        known = opened(line + end) or {}
        rank, pid, host = known["rank"], known["pid"], known["host"]
        since, ticks = known.get("since"), known.get("ticks")
        digests = [str(name) for name in known["digests"]]
    except (OSError, KeyError, TypeError):
        return None
    whole = all(isinstance(value, int) for value in (rank, pid, ticks or 0))
    if not whole or not isinstance(host, str) or isinstance(since, str | list | dict):
        return None
    return Note(rank, host, pid, digests, since, ticks)


class Notes:
    """The heartbeat files in a campaign's directory: which cases each process computes.

    folder : the campaign's directory
    """

    def __init__(self, folder: Path) -> None:
        self.folder, self.place = folder, folder / "running"

    def _whole(self) -> list[tuple[Path, Note]]:
        """Return (path, content) of each heartbeat file that is complete."""
        try:
            paths = listed(self.place, ".log")
        except MissingFileError:
            return []
        return [(path, note) for path in paths if (note := _note(path)) is not None]

    def all(self) -> list[Note]:
        """Return the contents of complete heartbeat files, also of dead processes."""
        return [note for _, note in self._whole()]

    def crashes(self) -> Counter[str]:
        """Return {digest: number of processes that died while computing the case}."""
        return Counter(digest for note in self.all() for digest in note.digests)

    def sweep(self, older: float) -> None:
        """Remove heartbeat files of dead processes that were written only in part.

        Such notes name no case, so `forget` would never remove them.

        older : remove only notes last written before this time, s since 1970 by the
            clock of the file system
        """
        with suppress(MissingFileError):
            for path in listed(self.place, ".log"):
                with suppress(OSError):
                    if _note(path) is None and path.lstat().st_mtime < older:
                        path.unlink()

    def forget(self, finished: Collection[str]) -> None:
        """Remove the notes whose cases have all ended meanwhile.

        A note of a process that is alive on this host is kept.

        finished : digests of ended cases
        """
        ended = set(finished)
        here = socket.gethostname()
        for path, note in self._whole():
            # a process of another shard may be at work
            at_work = note.host == here and not note.left_over
            if set(note.digests) <= ended and not at_work:
                with suppress(OSError):
                    path.unlink()


@cache
def machine() -> str:
    """Return a text equal for all processes that see each other's process numbers.

    It consists of the number of the boot and the name space of process numbers: two
    machines may have one name, and two containers may share a machine.
    """
    try:
        boot = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii")
        space = os.readlink("/proc/self/ns/pid")  # noqa: PTH115 - no path at all
    except OSError:  # not Linux
        return socket.gethostname()
    return f"{boot.strip()} {space}"


def begun(pid: int) -> int | None:
    """Return when a process of this machine was started, in clock ticks since the boot.

    This distinguishes a process from a later one with the same number. None if no such
    process exists, or its start is unknown.

    pid : number of the process
    """
    state = _state(pid)
    return int(state[19]) if state else None


def is_alive(pid: int, ticks: int | None = None) -> bool:
    """Return whether a process of this machine exists, running or suspended.

    Parameters
    ----------
    pid : number of the process
    ticks : its start as `begun` returns it; None: unknown
    """
    foreign = False
    try:
        os.kill(pid, 0)
    except (ProcessLookupError, OverflowError, ValueError):
        return False
    except OSError:  # a process of another user, which may be hidden
        foreign = True
    state = _state(pid)
    if state is None:  # the process is hidden or has just ended, or this is not Linux
        return foreign or not Path("/proc/self/stat").exists()
    return state[0] not in DEAD and (ticks is None or int(state[19]) == ticks)


def _state(pid: int) -> list[str] | None:
    """Return what Linux tells of a process: the fields of /proc/PID/stat.

    These are the fields after the command's name; None if there is no such file.
    """
    try:
        text = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return None
    return text.rpartition(")")[2].split()
