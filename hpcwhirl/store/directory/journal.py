"""Journals: files to which each rank appends a record and traces of every ended case.

There is one journal per rank and run. Records (module `record`) are written and synced
in groups, about once a second. Records with a wrong checksum are dropped: a flipped bit
costs one case, an interrupted write the group that was being written.

The CRC detects accidents: an interrupted write, a flipped bit, a truncated copy. It is
no signature. Anyone who may write in a campaign's directory can write rows that were
never computed, with the right CRC, and they are gathered as results; only the
permissions of the file system prevent that.
"""

from __future__ import annotations

import math
import os
import re
import time
from collections import defaultdict
from collections.abc import Iterable, Iterator
from contextlib import AbstractContextManager, ExitStack, suppress
from io import FileIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import MissingFileError, StoreError, unreadable
from hpcwhirl.safe_open import open_new, open_regular
from hpcwhirl.store.atomic import keep_names, telling
from hpcwhirl.store.directory.reader import Rows, rows_in
from hpcwhirl.store.directory.record import (
    Record,
    fields_of,
    header_of,
    packed,
    unpacked,
)

EVERY = 1.0  # s between groups of finished cases; a kill costs one group
MOST = 8 << 20  # bytes of waiting cases at which a group is written early
NUMBERED = re.compile(r"(\d{1,9})(?:-(\d{1,9}))?\.[a-z0-9]+", re.ASCII)


class Journals:
    """All journals and trace files in a campaign's directory, for reading.

    folder : the campaign's directory
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.logs, self.blocks = folder / "journal", folder / "traces"

    def files(self) -> list[Path]:
        """Return the paths of the journals, the oldest run first."""
        return listed(self.logs, ".log")

    def trace_files(self) -> list[Path]:
        """Return the paths of the trace files, the oldest run first."""
        return listed(self.blocks, ".bin")

    def rows(self) -> Iterator[Rows]:
        """Yield all records of all journals in batches (`Rows`), the oldest first.

        Raises
        ------
        MissingFileError
            where an existing journal cannot be read
        """
        sizes: dict[str, int] = {}
        for path in self.files():
            yield from rows_in(path, sizes)

    def records(self) -> Iterator[Record]:
        """Yield all complete records of all journals one by one, the oldest first."""
        for rows in self.rows():
            yield from map(rows.record, range(len(rows)))

    def newest(self) -> dict[str, Record]:
        """Return {digest of a computation: its newest complete record}."""
        return {record["digest"]: record for record in self.records()}

    def by_file(self) -> dict[str, list[Record]]:
        """Return {journal's name: its records in written order}, oldest run first."""
        out = defaultdict[str, list[Record]](list)
        for rows in self.rows():
            out[rows.journal.stem] += map(rows.record, range(len(rows)))
        return out

    def traces(self, block: Record) -> dict[str, NDArray[np.float64]]:
        """Read the traces of a case from its trace file; return {trace: array}.

        block : entry `traces` of the case's record: file, offset, bytes, CRC-32 and
            shapes

        Raises
        ------
        MissingFileError, StoreError
            where the traces cannot be read, or are damaged
        """
        path = self.blocks / Path(block["file"]).name
        try:
            with open_regular(path) as file:
                file.seek(block["offset"])
                data = file.read(block["bytes"])
        except OSError as failed:
            msg = f"cannot read traces in {path}: {failed.strerror}"
            raise MissingFileError(msg) from None
        traces = unpacked(block, data)
        if traces is None:
            raise StoreError(
                f"traces in {path} at byte {block['offset']} are damaged; the "
                "campaign's command with --retry failed computes them again"
            )
        return traces

    def is_whole(self, record: Record) -> bool:
        """Return whether the traces of a record are undamaged; True without traces."""
        if not record.get("traces"):
            return True
        try:
            self.traces(record["traces"])
        except (MissingFileError, StoreError):
            return False
        return True

    def next_run(self) -> int:
        """Return the next run's number: one more than the largest so far."""
        return 1 + max(map(run_of, self.files()), default=0)

    def claim_run(self) -> int:
        """Reserve and return a number for this run, by making rank 0's journal.

        Shards of an array may start at once on several hosts: if the journal exists,
        the next number is tried.

        Raises
        ------
        MissingFileError
            where the directory cannot be written
        """
        with telling(f"in {self.folder}"):
            self.logs.mkdir(parents=True, exist_ok=True)
            run = self.next_run()
            while True:
                try:
                    (self.logs / journal_name(run, 0)).touch(exist_ok=False)
                except FileExistsError:
                    run += 1
                else:
                    return run


def journal_name(run: int, rank: int) -> str:
    """Return the file name of the journal that a rank writes in a run."""
    return f"{run:04d}-{rank:05d}.log"


class Journal(AbstractContextManager["Journal"]):
    """The journal and trace file that one rank writes in one run.

    Ended cases are written in groups, with one sync of each file, when `EVERY` seconds
    have passed since the last group or `MOST` bytes wait. So a kill loses the cases of
    the last `EVERY` seconds and the one being computed.

    Parameters
    ----------
    journals : journals of the campaign
    run : number of this run, so that no file is ever written by two runs
    rank : rank of this process
    plan : identity of the plan to which case numbers refer; "": unknown
    measured : names of the variables of the user's function
    """

    def __init__(
        self,
        journals: Journals,
        run: int,
        rank: int,
        plan: str = "",
        measured: Iterable[str] = (),
    ) -> None:
        name = journal_name(run, rank).removesuffix(".log")
        self.journals = journals
        with telling(f"in {journals.folder}"), ExitStack() as both:
            for place in (journals.logs, journals.blocks):
                place.mkdir(parents=True, exist_ok=True)
            log, bin_ = journals.logs / f"{name}.log", journals.blocks / f"{name}.bin"
            self._records = both.enter_context(open_new(log))
            self._blocks = both.enter_context(open_new(bin_))
            self._both = both.pop_all()
        self._header, self._head = header_of(plan, bin_.name, fields_of(measured))
        self._named = False  # whether the names of both files are synced
        self._kept = -math.inf  # s, time of the last group
        self._begin_group()

    def _begin_group(self) -> None:
        self._group: list[tuple[bytes, bytes]] = []  # record and traces of each case
        self._waiting = 0  # bytes in the group
        self._end = self._blocks.seek(0, os.SEEK_END)

    def append(self, record: Record, traces: dict[str, NDArray[np.float64]]) -> None:
        """Add record and traces of an ended case; write those that wait if it is time.

        Parameters
        ----------
        record : the record
        traces : {trace: array} of the case

        Raises
        ------
        MissingFileError
            where waiting records cannot be written; those written earlier stay complete
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
        """Write the waiting records to disk if it is time; else return at once.

        It is time `EVERY` seconds after the last write, or when `MOST` bytes wait.

        Raises
        ------
        MissingFileError
            as `append`
        """
        late = self._group and time.monotonic() - self._kept >= EVERY
        if late or self._waiting >= MOST:
            self.keep()

    def keep(self) -> None:
        """Write the waiting records and traces to disk and sync them.

        Raises
        ------
        MissingFileError
            where they cannot be written; those written earlier stay complete, and so do
            the waiting ones before the first that does not fit on the disk
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
        """Write records with their traces, all or none: traces first, then the records.

        group : (bytes of the record, bytes of the traces) of each case
        """
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
        self._head = b""  # the header is written once

    def _keep_names(self) -> None:
        """Sync the folders of journal and traces: their names survive a crash."""
        if self._named:
            return
        own = self.journals
        with telling(f"in {own.folder}"):
            for place in (own.folder, own.logs, own.blocks):
                keep_names(place)
        self._named = True

    def __exit__(self, *error: object) -> None:
        """Write the waiting records and close journal and trace file."""
        with telling(f"in {self.journals.folder}"), self._both:
            self.keep()


def _write(file: FileIO, parts: Iterable[bytes]) -> None:
    """Append bytes to a file and sync it; if that fails, restore its former size.

    Parameters
    ----------
    file : the file
    parts : the bytes, in pieces
    """
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


def listed(folder: Path, ending: str) -> list[Path]:
    """Return the files of a folder, in the order of the run and rank in their names.

    Runs and ranks are compared as numbers, since as text 10000 comes before 9999. Names
    without numbers come first; [] if the folder does not exist.

    Parameters
    ----------
    folder : one of the folders in a campaign's directory
    ending : ending of the file names, e.g. ``.log``

    Raises
    ------
    MissingFileError
        where the folder cannot be listed, which must not be taken for an empty one
    """
    try:
        names = os.listdir(folder)  # noqa: PTH208 - glob is silent where it may not look
    except FileNotFoundError as failed:
        if not os.path.lexists(folder):
            return []
        raise unreadable(folder, failed) from None  # a broken link
    except OSError as failed:
        raise unreadable(folder, failed) from None
    found = (folder / name for name in names if name.endswith(ending))
    return sorted(found, key=_order)


def run_of(path: Path) -> int:
    """Return the run number in the name of a journal or other file; 0: it has none."""
    return _order(path)[0]


def _order(path: Path) -> tuple[int, int, str]:
    number = NUMBERED.fullmatch(path.name)
    if number is None:
        return 0, 0, path.name
    return int(number[1]), int(number[2] or 0), path.name
