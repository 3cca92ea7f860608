"""A directory as calls leave it, and all that a crash may make of it.

PROCESS: all calls before it are there, and perhaps half of the next write.
ORDERED: names up to any one of them are there, and a sync of whatever file keeps all
before it, as on ext4 and XFS with their one journal; of what was not synced of files,
of all or of one, there is all, nothing, the first half of each write, zeros in place of
it, or zeros in place of its first half.
ANY: a name is kept by a sync of its directory alone, as POSIX has it; of the others
there is none, or one alone, or all but one, with all or nothing of what was not synced
of files.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from crashing.trace import CHANGES, NAMES, Call

PROCESS, ORDERED, ANY = "process", "machine, names in order", "machine, in any order"
KEEPS = ("whole", "none", "half", "zeros", "late")  # of what was not synced
PART = re.compile(r"[0-9a-f]{32}\.part$")  # half written: nobody reads it


@dataclass
class File:
    """What a file holds, and its time, ns since 1970."""

    data: bytearray = field(default_factory=bytearray)
    time: int = 0

    def put(self, offset: int, data: bytes) -> None:
        """Write some bytes, zeros before them where there was nothing."""
        gap = offset - len(self.data)
        self.data.extend(bytes(max(gap, 0)))
        self.data[offset : offset + len(data)] = data

    def resize(self, size: int) -> None:
        """Cut what is beyond a size, or add zeros up to it."""
        del self.data[size:]
        self.data.extend(bytes(size - len(self.data)))


@dataclass
class Disk:
    """A directory: files by number, names of them, and directories in it.

    The directory itself is "", and always there.
    """

    files: dict[int, File] = field(default_factory=dict)
    names: dict[str, int] = field(default_factory=dict)
    folders: set[str] = field(default_factory=set)

    @classmethod
    def of(cls, folder: Path) -> Disk:
        """Return what a directory holds now; nothing where it is none."""
        disk = cls(folders={""})
        for path in folder.rglob("*"):
            name, state = str(path.relative_to(folder)), path.stat()
            if path.is_dir():
                disk.folders.add(name)
                continue
            disk.names[name] = state.st_ino
            data = bytearray(path.read_bytes())
            disk.files[state.st_ino] = File(data, state.st_mtime_ns)
        return disk

    def copy(self) -> Disk:
        """Return another one that holds the same."""
        files = {n: File(bytearray(f.data), f.time) for n, f in self.files.items()}
        return Disk(files, dict(self.names), set(self.folders))

    def change(self, call: Call, keep: str = "whole") -> None:
        """Let a write or a new size come true, or as much as is kept of it."""
        if keep == "none":
            return
        file, size = self.files.setdefault(call.inode, File()), len(call.data)
        file.time = call.time if call.kind != "memory" else file.time
        if call.kind in ("size", "grow"):
            grown = max(call.offset, len(file.data))
            file.resize(grown if call.kind == "grow" else call.offset)
            return
        kept = {
            "whole": call.data,
            "half": call.data[: size // 2],
            "zeros": bytes(size),
            "late": bytes(size // 2) + call.data[size // 2 :],
        }
        file.put(call.offset, kept[keep])

    def name(self, call: Call) -> None:
        """Let a call on names come true, as far as it can without those before it."""
        if call.kind == "mkdir":
            self.folders.add(call.path)
        elif call.kind == "rmdir":
            inside = call.path + "/"
            if not any(n.startswith(inside) for n in (*self.names, *self.folders)):
                self.folders.discard(call.path)
        elif call.kind == "unlink":
            self.names.pop(call.path, None)
        elif call.kind == "rename" and call.path in self.folders:
            self._move(call.path, call.other)
        else:
            new = call.path if call.kind == "create" else call.other
            self.names[new] = call.inode
            self.files.setdefault(call.inode, File())
            if call.kind == "rename" and call.path != new:
                self.names.pop(call.path, None)

    def _move(self, old: str, new: str) -> None:
        """Rename a directory, with all that is in it."""

        def moved(name: str) -> str:
            inside = name == old or name.startswith(old + "/")
            return new + name[len(old) :] if inside else name

        self.folders = {moved(name) for name in self.folders}
        self.names = {moved(name): inode for name, inode in self.names.items()}

    def paths(self) -> tuple[list[str], dict[str, int]]:
        """Return directories and {name: number of a file} that a path leads to."""

        def there(name: str) -> bool:
            return all(place in self.folders for place in _places(name))

        folders = sorted(n for n in self.folders if n and there(n))
        return folders, {n: i for n, i in sorted(self.names.items()) if there(n)}

    def reachable(self) -> tuple[list[str], dict[str, File]]:
        """Return directories and {name: file} that a path leads to."""
        folders, files = self.paths()
        return folders, {name: self.files[inode] for name, inode in files.items()}

    def write(self, folder: Path) -> None:
        """Make the directory."""
        folders, files = self.reachable()
        for name in folders:
            (folder / name).mkdir()
        for name, file in files.items():
            path = folder / name
            path.write_bytes(file.data)
            os.utime(path, ns=(file.time, file.time))


@dataclass(frozen=True)
class Crash:
    """A death at some call: which of those before it are kept, and how."""

    at: int  # the calls before this one were made
    how: str
    lost: frozenset[int] = frozenset()  # of names
    keep: str = "whole"  # of writes that were not synced
    inode: int | None = None  # the file that this is said of; None: all
    torn: bool = False  # whether half of the call at the point was made


def state(before: Disk, calls: Sequence[Call], crash: Crash) -> Disk:
    """Return what a crash leaves of a directory."""
    disk, open_writes = before.copy(), set(_open_writes(calls[: crash.at]))
    for number, call in enumerate(calls[: crash.at]):
        if call.kind in CHANGES:
            own = number in open_writes and crash.inode in (None, call.inode)
            disk.change(call, crash.keep if own else "whole")
        elif call.kind in NAMES and number not in crash.lost:
            disk.name(call)
    if crash.torn:
        disk.change(calls[crash.at], "half")
    return disk


class Outlines:
    """What tells the states of crashes before a call, without their bytes.

    Files are told by which of their writes they have, so that two outlines are the
    same only where the states are.

    Parameters
    ----------
    before : of the directory
    calls : that were recorded
    at : how many of them were made
    """

    def __init__(self, before: Disk, calls: Sequence[Call], at: int) -> None:
        self.calls, self.at = calls, at
        self.names = Disk({}, dict(before.names), set(before.folders))
        self.moves = [(n, c) for n, c in enumerate(calls[:at]) if c.kind in NAMES]
        self.writes: dict[int, int] = {}
        self.open: dict[int, int] = {}
        for call in calls[:at]:
            if call.kind in CHANGES:
                self.writes[call.inode] = self.writes.get(call.inode, 0) + 1
                self.open[call.inode] = self.open.get(call.inode, 0) + 1
            elif call.kind == "sync":
                self.open.pop(call.inode, None)

    def of(self, crash: Crash) -> tuple[Any, ...]:
        """Return the outline of a crash at this call."""
        disk = Disk({}, dict(self.names.names), set(self.names.folders))
        for number, call in self.moves:
            if number not in crash.lost:
                disk.name(call)
        folders, files = disk.paths()
        told = [(_plain(n), *self._file(n, i, crash)) for n, i in files.items()]
        return tuple(folders), tuple(sorted(told))

    def _file(self, name: str, inode: int, crash: Crash) -> tuple[Any, ...]:
        """Return what tells a file; of a `PART`, whether it is empty."""
        torn = crash.torn and self.calls[crash.at].inode == inode
        count, some = self.writes.get(inode, 0), self.open.get(inode, 0)
        keep = crash.keep if crash.inode in (None, inode) and some else "whole"
        if PART.search(name):
            return (bool(count - some * (keep == "none") + torn),)
        if keep == "whole":
            return inode, count, torn
        return inode, count - some, torn, keep, some * (keep != "none")


def _plain(name: str) -> str:
    return PART.sub("part", name)


def _open_writes(calls: Sequence[Call]) -> Iterator[int]:
    """Yield the writes whose file was not synced afterwards."""
    synced: set[int] = set()
    for number in reversed(range(len(calls))):
        call = calls[number]
        if call.kind == "sync":
            synced.add(call.inode)
        elif call.kind in CHANGES and call.inode not in synced:
            yield number


def _open_names(calls: Sequence[Call], *, ordered: bool) -> list[int]:
    """Return the calls on names that no sync has kept.

    ordered : whether any sync keeps all, not only that of the directory of the name
    """
    synced: set[str] = set()
    found = []
    for number in reversed(range(len(calls))):
        call = calls[number]
        if call.kind == "sync":
            if ordered:
                break
            synced.add(call.path)
        elif call.kind in NAMES:
            places = {_above(n) for n in (call.path, call.other) if n}
            if not places <= synced:
                found.append(number)
    return found[::-1]


def _above(name: str) -> str:
    return name.rpartition("/")[0]


def _places(name: str) -> Iterator[str]:
    """Yield the directories that a path goes through."""
    while name:
        name = _above(name)
        yield name


def crashes(calls: Sequence[Call], at: int) -> Iterator[Crash]:
    """Yield all that may be lost by a death before the call `at`, or in its midst."""
    yield Crash(at, PROCESS)
    if at < len(calls) and calls[at].kind == "write":
        yield Crash(at, PROCESS, torn=True)
    yield from _in_order(calls[:at])
    yield from _in_any_order(calls[:at])


def _in_order(before: Sequence[Call]) -> Iterator[Crash]:
    at = len(before)
    for inode in sorted({before[n].inode for n in _open_writes(before)}):
        for keep in KEEPS[1:]:
            yield Crash(at, ORDERED, keep=keep, inode=inode)
    open_names = _open_names(before, ordered=True)
    for first in range(len(open_names) + 1):
        lost = frozenset(open_names[first:])
        for keep in KEEPS:
            yield Crash(at, ORDERED, lost, keep)


def _in_any_order(before: Sequence[Call]) -> Iterator[Crash]:
    at, every = len(before), _open_names(before, ordered=False)
    alone = [frozenset({n}) for n in every]
    rest = [frozenset(every) - one for one in alone]
    for lost in (frozenset(every), *alone, *rest):
        for keep in ("whole", "none"):
            yield Crash(at, ANY, lost, keep)
