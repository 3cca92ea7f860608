"""Journals: one checksummed line per finished case, one file per rank and run.

A line is sealed, see `lines`. Lines are written and synced in groups of what was
computed in a second; what does not match its checksum is dropped, so a flipped bit
costs its own case, and a torn tail those of the group that was being written.

The CRC is for accidents: a torn write, a flipped bit, a copy that was cut short. It is
no signature. Who may write in a campaign's directory can write rows that were never
computed, with the right CRC, and they are gathered as results; rights of the file
system keep others out, and nothing else does.
"""

from __future__ import annotations

import math
import os
import stat
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, suppress
from io import FileIO
from pathlib import Path
from typing import Any, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import MissingFileError, StoreError, unwritable
from hpcwhirl.regular import open_regular
from hpcwhirl.scene.words import ENUMS
from hpcwhirl.store.directory.lines import (
    LAYOUT,
    OWN,
    PLAN,
    is_packed,
    layout_of,
    learn,
    line_of,
    opened,
    sealed,
)
from hpcwhirl.store.directory.listing import listed, run_of, unreadable
from hpcwhirl.store.directory.packing import packed, unpacked

ENDS = frozenset(ENUMS["status"]) - {"missing"}  # how a case may have ended
Record = dict[str, Any]
EVERY = 1.0  # s between groups of finished cases; a kill costs those of the last
MOST = 8 << 20  # bytes of a group
A_LINE = 1024  # bytes, that most lines have
T = TypeVar("T")


class Journal:
    """The journal and trace file of one rank of one run.

    Finished cases are kept in groups, each with one sync of either file: whenever
    `EVERY` seconds have passed since the last group, or `MOST` bytes wait. A case that
    ends later than that after the group before is kept at once. So a kill costs the
    cases that were computed in the last `EVERY` seconds, and the one in flight.

    Parameters
    ----------
    folder : the campaign's directory
    run : number of this run, so that no file is ever written by two runs
    rank : rank of this process
    plan : identity of the plan that the numbers of cases are of; "": not known
    """

    def __init__(self, folder: Path, run: int, rank: int, plan: str = "") -> None:
        name = journal_name(run, rank).removesuffix(".log")
        try:
            for part in ("journal", "traces"):
                (folder / part).mkdir(parents=True, exist_ok=True)
            with ExitStack() as both:
                log = folder / "journal" / f"{name}.log"
                lines = both.enter_context(open_regular(log, "ab", 0))
                bin_ = folder / "traces" / f"{name}.bin"
                blocks = both.enter_context(open_regular(bin_, "ab", 0))
                self._both = both.pop_all()
        except OSError as failed:
            msg = f"cannot write in {folder}: {failed.strerror}"
            raise unwritable(msg, failed) from None
        self._lines, self._blocks = lines, blocks
        self.folder, self._name = folder, f"{name}.bin"
        self._plan = plan
        self._told = False  # plan, and layout of packed lines, in this file
        self._kept = -math.inf  # s, when the last group was
        self._begin_group()

    def _begin_group(self) -> None:
        self._group: list[tuple[bytes, bytes]] = []  # line and traces of each case
        self._waiting = 0  # bytes of both
        self._end = self._blocks.seek(0, os.SEEK_END)

    def append(self, record: Record, traces: dict[str, NDArray[np.float64]]) -> None:
        """Take in a finished case, and keep it with its group where that is due.

        Raises
        ------
        MissingFileError
            where a group cannot be written; what was there before is still whole
        """
        data = b""
        if traces:
            head, data = packed(traces)
            block = {"file": self._name, "offset": self._end} | head
            record = record | {"traces": block}
        line = line_of(record)
        self._group.append((line, data))
        self._end += len(data)
        self._waiting += len(line) + len(data)
        self.keep_due()

    def keep_due(self) -> None:
        """Keep the cases that wait where it is time to; as cheap as a look elsewhere.

        Raises
        ------
        MissingFileError
            as `append`
        """
        late = self._group and time.monotonic() - self._kept >= EVERY
        if late or self._waiting >= MOST:
            self.keep()

    def keep(self) -> None:
        """Keep all cases that wait.

        Raises
        ------
        MissingFileError
            where they cannot be written; what was there before is still whole, and so
            are those that waited, up to the first one that there is no room for
        """
        group = self._group
        if not group:
            return
        try:
            self._keep(group)
        except MissingFileError:
            with suppress(MissingFileError):
                for case in group:
                    self._keep([case])
            raise
        finally:
            self._kept = time.monotonic()
            self._begin_group()

    def _keep(self, group: list[tuple[bytes, bytes]]) -> None:
        """Keep cases: traces first, then the lines that name them, or nothing."""
        lines = [line for line, _ in group]
        tells = not self._told and any(map(is_packed, lines))
        if tells:
            plan = [sealed({PLAN: self._plan})] if self._plan else []
            lines = [*plan, OWN.head, *lines]
        offset = self._blocks.seek(0, os.SEEK_END)
        data = [block for _, block in group if block]
        try:
            if data:
                _write(self._blocks, data)
            _write(self._lines, [b"".join(lines)])
        except MissingFileError:
            with suppress(OSError):
                self._blocks.truncate(offset)
            raise
        self._told = self._told or tells

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, *error: object) -> None:
        """Keep what waits and close both files."""
        with self._both:
            self.keep()


def _write(file: FileIO, parts: Iterable[bytes]) -> None:
    """Append parts whole and synced, or none of them."""
    offset = file.seek(0, os.SEEK_END)
    try:
        for part in parts:
            left = memoryview(part)
            while left:
                left = left[file.write(left) :]
        os.fsync(file.fileno())
    except OSError as failed:
        with suppress(OSError):
            file.truncate(offset)
        msg = f"cannot write {file.name!s}: {failed.strerror}"
        raise unwritable(msg, failed) from None


def next_run(folder: Path) -> int:
    """Return a run number that no journal of the campaign has."""
    return 1 + max(map(run_of, journals(folder)), default=0)


def claim_run(folder: Path) -> int:
    """Return a run number that no one else has or will get, and make its journal.

    Shards of an array may begin at once, on several hosts: the journal of rank 0 is
    made only where there was none, and who comes second takes the next number.

    Raises
    ------
    MissingFileError
        where the directory cannot be written
    """
    try:
        (folder / "journal").mkdir(parents=True, exist_ok=True)
        run = next_run(folder)
        while True:
            try:
                (folder / "journal" / journal_name(run, 0)).touch(exist_ok=False)
            except FileExistsError:
                run += 1
            else:
                return run
    except OSError as failed:
        msg = f"cannot write in {folder}: {failed.strerror}"
        raise unwritable(msg, failed) from None


def journal_name(run: int, rank: int) -> str:
    """Return the name of the journal of a rank of a run."""
    return f"{run:04d}-{rank:05d}.log"


def journals(folder: Path) -> list[Path]:
    """Return the journals of a campaign's directory, the oldest run first."""
    return listed(folder / "journal", ".log")


def _whole_lines(journal: Path) -> Iterator[tuple[int, Record]]:
    """Yield (byte, record); torn lines, and those that are of no case, are dropped.

    Raises
    ------
    MissingFileError
        where a journal that is there cannot be read: its cases are not to be lost
    """
    try:
        with open_regular(journal) as file:
            start = 0
            for line in file:
                record = _of_a_case(line)
                if record is not None:
                    yield start, record
                start += len(line)
    except OSError as failed:
        raise unreadable(journal, failed) from None


def _of_a_case(line: bytes) -> Record | None:
    """Return the record of a line, None of a torn one, or of one that is of no case."""
    record = opened(line)
    if record is not None and LAYOUT in record:
        learn(record)
    elif record is not None and _is_of_a_case(record):
        return record
    return None


def record_of(folder: Path, line: bytes, sizes: dict[str, int]) -> Record | None:
    """Return the record of a line, None also where its traces are not all there.

    Parameters
    ----------
    folder : the campaign's directory
    line : of one of its journals
    sizes : {trace file: bytes}, of those looked at before
    """
    record = _of_a_case(line)
    return record if record and _has_traces(folder, record, sizes) else None


def _is_of_a_case(record: Record) -> bool:
    """Return whether a record tells a case and how it ended."""
    name, status = record.get("digest"), record.get("status")
    if not isinstance(name, str) or not isinstance(status, str) or status not in ENDS:
        return False
    return status != "ok" or isinstance(record.get("row"), dict)


def read_journals(folder: Path) -> dict[str, list[Record]]:
    """Return {journal: its whole lines in the order written}, oldest run first."""
    return {
        path.stem: [record for _, record in _whole_lines(path)]
        for path in journals(folder)
    }


def whole_records(folder: Path) -> Iterator[tuple[Path, int, Record]]:
    """Yield (journal, byte, record), the oldest first; torn lines are dropped.

    A record whose traces are not all there is dropped too: the case runs again.
    """
    sizes: dict[str, int] = {}
    for path in journals(folder):
        for start, record in _whole_lines(path):
            if _has_traces(folder, record, sizes):
                yield path, start, record


def newest(folder: Path, records: Iterable[Record]) -> dict[str, Record]:
    """Return {case digest: the last of its records whose traces are all there}."""
    sizes: dict[str, int] = {}
    return {r["digest"]: r for r in records if _has_traces(folder, r, sizes)}


def _has_traces(folder: Path, record: Record, sizes: dict[str, int]) -> bool:
    """Return whether the file of a record's traces, if any, is long enough for them."""
    block = record.get("traces")
    if not block:
        return True
    try:
        name, end = Path(block["file"]).name, block["offset"] + block["bytes"]
        _ = block["crc"], block["shapes"]["time"][0]
        if sizes.get(name, -1) < end:  # once a file, or again: it may have grown
            sizes[name] = _size(folder / "traces" / name)
        return bool(sizes[name] >= end)
    except (KeyError, TypeError):  # no block of this program
        return False


def _size(traces: Path) -> int:
    """Return the bytes of a trace file, 0 where there is none."""
    try:
        state = traces.stat()
        return state.st_size if stat.S_ISREG(state.st_mode) else 0
    except FileNotFoundError:
        return 0
    except OSError as failed:
        raise unreadable(traces, failed) from None


def scan(folder: Path, brief: Callable[[Record], T]) -> dict[str, T]:
    """Return {case digest: what `brief` makes of its newest whole record}.

    One record at a time is in memory, however many there are.
    """
    return {record["digest"]: brief(record) for _, _, record in whole_records(folder)}


def read_records(folder: Path) -> dict[str, Record]:
    """Return {case digest: its newest whole record}."""
    return scan(folder, lambda record: record)


def _learn_layouts(path: Path) -> None:
    """Take in the layouts that a journal tells."""
    for _ in _whole_lines(path):
        pass


def read_at(path: Path, starts: Sequence[int]) -> list[Record]:
    """Return the records of a journal that begin at some bytes.

    Raises
    ------
    StoreError, MissingFileError
        where they are no longer there
    """
    out: list[Record] = []
    for start, line in zip(starts, lines_at(path, starts), strict=True):
        if is_packed(line) and layout_of(line) is None:
            _learn_layouts(path)
        record = opened(line)
        if record is None:
            msg = f"{path} has changed at byte {start} while it was read"
            raise StoreError(msg)
        out.append(record)
    return out


def lines_at(path: Path, starts: Iterable[int]) -> list[bytes]:
    """Return the lines of a journal that begin at some bytes.

    Raises
    ------
    MissingFileError
        where it cannot be read
    """
    try:
        with open_regular(path) as file:  # a buffer would read 8 kB for each
            return [_line_at(file.fileno(), start) for start in starts]
    except OSError as failed:
        raise unreadable(path, failed) from None


def _line_at(file: int, start: int) -> bytes:
    """Return the line of a file that begins at a byte."""
    line = b""
    while part := os.pread(file, A_LINE, start + len(line)):
        line += part
        if b"\n" in part:
            return line[: line.index(b"\n") + 1]
    return line


def read_traces(folder: Path, block: Record) -> dict[str, NDArray[np.float64]]:
    """Return the arrays of a trace block, or raise where it is damaged."""
    path = folder / "traces" / Path(block["file"]).name
    try:
        with open_regular(path) as file:
            file.seek(block["offset"])
            data = file.read(block["bytes"])
    except OSError as failed:
        msg = f"cannot read traces in {path}: {failed.strerror}"
        raise MissingFileError(msg) from None
    traces = unpacked(block, data)
    if traces is None:
        msg = (
            f"traces in {path} at byte {block['offset']} are damaged; the campaign's "
            "command with --retry failed computes them again"
        )
        raise StoreError(msg)
    return traces


def is_whole(folder: Path, record: Record) -> bool:
    """Return whether the traces of a record, if any, are as they were written."""
    if not record.get("traces"):
        return True
    try:
        read_traces(folder, record["traces"])
    except (MissingFileError, StoreError):
        return False
    return True
