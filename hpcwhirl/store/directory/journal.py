"""Journals: one record per finished case, one file per rank and run, and their traces.

Records, see `record`, are written and synced in groups of about a second. Records with
a wrong checksum are dropped: a flipped bit loses its own case, a torn tail the group
that was being written.

The CRC is for accidents: a torn write, a flipped bit, a copy that was cut short. It is
no signature. Who may write in a campaign's directory can write rows that were never
computed, with the right CRC, and they are gathered as results; rights of the file
system keep others out, and nothing else does.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, suppress
from io import FileIO
from pathlib import Path
from typing import Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import MissingFileError, StoreError
from hpcwhirl.safe_open import open_regular
from hpcwhirl.store.atomic import keep_names, telling
from hpcwhirl.store.directory.listing import run_of
from hpcwhirl.store.directory.packing import packed, unpacked
from hpcwhirl.store.directory.reader import journals, rows_of
from hpcwhirl.store.directory.record import Record, fields_of, header_of

EVERY = 1.0  # s between groups of finished cases; a kill costs those of the last
MOST = 8 << 20  # bytes of a group
T = TypeVar("T")


class Journal:
    """The journal and trace file of one rank of one run.

    Finished cases are written in groups, with one sync of each file, when `EVERY`
    seconds have passed since the last group or `MOST` bytes wait. So a kill loses the
    cases of the last `EVERY` seconds and the one in flight.

    Parameters
    ----------
    folder : the campaign's directory
    run : number of this run, so that no file is ever written by two runs
    rank : rank of this process
    plan : identity of the plan to which case numbers refer; "": unknown
    measured : names of the variables of the user's function
    """

    def __init__(
        self,
        folder: Path,
        run: int,
        rank: int,
        plan: str = "",
        measured: Iterable[str] = (),
    ) -> None:
        name = journal_name(run, rank).removesuffix(".log")
        self._places = folder / "journal", folder / "traces"
        with telling(f"in {folder}"), ExitStack() as both:
            for place in self._places:
                place.mkdir(parents=True, exist_ok=True)
            log = folder / "journal" / f"{name}.log"
            records = both.enter_context(open_regular(log, "ab", 0))
            bin_ = folder / "traces" / f"{name}.bin"
            blocks = both.enter_context(open_regular(bin_, "ab", 0))
            self._both = both.pop_all()
        self._records, self._blocks, self.folder = records, blocks, folder
        self._header, self._head = header_of(plan, bin_.name, fields_of(measured))
        self._named = False  # whether the names of both files outlive the machine
        self._kept = -math.inf  # s, when the last group was
        self._begin_group()

    def _begin_group(self) -> None:
        self._group: list[tuple[bytes, bytes]] = []  # record and traces of each case
        self._waiting = 0  # bytes of both
        self._end = self._blocks.seek(0, os.SEEK_END)

    def append(self, record: Record, traces: dict[str, NDArray[np.float64]]) -> None:
        """Add a finished case; write its group if that is due.

        Raises
        ------
        MissingFileError
            where a group cannot be written; what was there before is still whole
        """
        data = b""
        if traces:
            head, data = packed(traces)
            record = record | {"traces": {"offset": self._end} | head}
        slots = self._header.layout.encode(record, self._header.tag)
        self._group.append((slots, data))
        self._end += len(data)
        self._waiting += len(slots) + len(data)
        self.keep_due()

    def keep_due(self) -> None:
        """Write the waiting cases if that is due; cheap otherwise.

        Raises
        ------
        MissingFileError
            as `append`
        """
        late = self._group and time.monotonic() - self._kept >= EVERY
        if late or self._waiting >= MOST:
            self.keep()

    def keep(self) -> None:
        """Write the waiting cases to disk and sync them.

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
        """Write cases: traces, then the records that refer to them; or nothing."""
        self._keep_names()
        records = self._head + b"".join(slots for slots, _ in group)
        offset = self._blocks.seek(0, os.SEEK_END)
        data = [block for _, block in group if block]
        try:
            if data:
                _write(self._blocks, data)
            _write(self._records, [records])
        except MissingFileError:
            with suppress(OSError):
                self._blocks.truncate(offset)
            raise
        self._head = b""  # it is there

    def _keep_names(self) -> None:
        """Sync the directories of the files, so that they survive a crash."""
        if self._named:
            return
        with telling(f"in {self.folder}"):
            for place in (self.folder, *self._places):
                keep_names(place)
        self._named = True

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, *error: object) -> None:
        """Write the waiting cases and close both files."""
        with telling(f"in {self.folder}"), self._both:
            self.keep()


def _write(file: FileIO, parts: Iterable[bytes]) -> None:
    """Append parts whole and synced, or none of them."""
    with telling(str(file.name)):
        offset = file.seek(0, os.SEEK_END)
        try:
            for part in parts:
                left = memoryview(part)
                while left:
                    left = left[file.write(left) :]
            os.fsync(file.fileno())
        except OSError:
            with suppress(OSError):
                file.truncate(offset)
            raise


def next_run(folder: Path) -> int:
    """Return the next unused run number."""
    return 1 + max(map(run_of, journals(folder)), default=0)


def claim_run(folder: Path) -> int:
    """Reserve a run number by making the journal of rank 0; return the number.

    Shards of an array may start at once on several hosts: if the journal exists, the
    next number is tried.

    Raises
    ------
    MissingFileError
        where the directory cannot be written
    """
    with telling(f"in {folder}"):
        (folder / "journal").mkdir(parents=True, exist_ok=True)
        run = next_run(folder)
        while True:
            try:
                (folder / "journal" / journal_name(run, 0)).touch(exist_ok=False)
            except FileExistsError:
                run += 1
            else:
                return run


def journal_name(run: int, rank: int) -> str:
    """Return the name of the journal of a rank of a run."""
    return f"{run:04d}-{rank:05d}.log"


def whole_records(folder: Path) -> Iterator[Record]:
    """Yield the records of a campaign's journals, the oldest first, see `reader`."""
    for rows in rows_of(folder):
        yield from map(rows.record, range(len(rows)))


def scan(folder: Path, brief: Callable[[Record], T]) -> dict[str, T]:
    """Return {digest: value of `brief` for its newest whole record}.

    One record at a time is in memory.
    """
    return {record["digest"]: brief(record) for record in whole_records(folder)}


def read_records(folder: Path) -> dict[str, Record]:
    """Return {case digest: its newest whole record}."""
    return scan(folder, lambda record: record)


def read_journals(folder: Path) -> dict[str, list[Record]]:
    """Return {journal: its records in the order written}, the oldest run first."""
    out: dict[str, list[Record]] = {}
    for rows in rows_of(folder):
        own = out.setdefault(rows.journal.stem, [])
        own += map(rows.record, range(len(rows)))
    return out


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
    """Return whether the traces of a record, if any, are undamaged."""
    if not record.get("traces"):
        return True
    try:
        read_traces(folder, record["traces"])
    except (MissingFileError, StoreError):
        return False
    return True
