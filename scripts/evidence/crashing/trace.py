"""What a process has done to a directory, call by call, by a shim in C."""

from __future__ import annotations

import ctypes
import os
import re
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

SOURCE = Path(__file__).with_name("shim.c")
HEAD = re.compile(rb"(\w+) (\d+) (\d+) (\d+) (-?\d+) ([^\t\n]*)\t([^\t\n]*)\n")
CHANGES = ("write", "memory", "size", "grow")  # of what a file holds
NAMES = ("create", "mkdir", "rename", "link", "unlink", "rmdir")


@dataclass(frozen=True)
class Call:
    """A call that was made.

    Attributes
    ----------
    kind : one of `CHANGES` and `NAMES`, or ``sync``
    inode : of the file, a number that no other has
    path, other : from the directory on, "" for itself; what it was renamed to
    offset : where `data` was written, or the new size
    time : the file's after the call, ns since 1970
    """

    kind: str
    inode: int
    path: str
    other: str
    offset: int
    time: int
    data: bytes


def compiled(place: Path, source: Path = SOURCE) -> Path:
    """Return the shim, compiled by gcc into a directory."""
    shim = place / "shim.so"
    call = ["gcc", "-shared", "-fPIC", "-O1", "-o", str(shim), str(source), "-ldl"]
    subprocess.run(call, check=True)
    return shim


def watch(folder: Path, log: Path, at: int = -1, by: int = 0) -> None:
    """Record this process from now on; at a call, raise the signal `by` before it.

    The shim has to be in the process: it was started with `LD_PRELOAD`. What this
    process begins is recorded, too.
    """
    os.environ.update(CRASH_ROOT=str(folder), CRASH_LOG=str(log))
    library = ctypes.CDLL(None)
    library.watch(os.fsencode(folder), os.fsencode(log), at, by)


def calls_of(log: Path) -> list[Call]:
    """Return the calls of a log, in their order.

    The system gives the number of a file that is gone to a new one: here each has its
    own.
    """
    own: dict[int, int] = {}
    out = []
    for call in _read(log.read_bytes() if log.exists() else b""):
        if call.kind in ("create", "mkdir"):
            own[call.inode] = -1 - len(out)
        out.append(replace(call, inode=own.get(call.inode, call.inode)))
    return out


def _read(text: bytes) -> Iterator[Call]:
    at = 0
    while at < len(text):
        head = HEAD.match(text, at)
        if head is None:
            msg = f"no call at byte {at} of the log: {text[at : at + 80]!r}"
            raise ValueError(msg)
        kind, path, other = (head[i].decode() for i in (1, 6, 7))
        offset, size, inode, time = (int(head[i]) for i in (2, 3, 4, 5))
        at = head.end() + size
        data = text[head.end() : at]
        yield Call(kind, inode, path[1:], other[1:], offset, time, data)
