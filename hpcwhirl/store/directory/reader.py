"""Read journals: their complete records, in batches, as arrays or one by one.

A record counts if its slot and its text match their checksums, if it has a digest and a
status (and, if the status is ok, a row), and if its traces, if any, are complete. So a
flipped bit costs one case, an interrupted write the group that was being written. How
records are stored is described in the module `record`.
"""

from __future__ import annotations

import json
import os
import stat
import struct
import zlib
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import starmap
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from hpcwhirl.errors import StoreError, unreadable
from hpcwhirl.safe_open import open_regular
from hpcwhirl.scene.words import ENUMS
from hpcwhirl.store.directory.record import (
    CHECKED,
    MALFORMED,
    NUMBERS,
    TAG,
    Header,
    Layout,
    Record,
    read_header,
)

FIRST = 1 << 20  # bytes of the first read; a header takes a few thousand of them
AT_ONCE = 1 << 23  # bytes of each further read
MOST_SLOTS = 4096  # slots checked at once
ENDS = [word for word in ENUMS["status"] if word != "missing"]  # how a case may end
TABLES = ("row", "performance", "traces", "measured")
IN_FIELDS = {"status", "twin", "longest"}  # never in the text of a record
Array = NDArray[Any]
Bools = NDArray[np.bool_]
Cases = NDArray[np.int64]


@dataclass(frozen=True)
class Rows:
    """A batch of records of one journal, whose fields are read as arrays.

    A record has a slot of fixed size with binary fields, and further entries as text.

    Attributes
    ----------
    journal : file of the journal
    header : header of the journal
    slots : (records,), structured array of the slots, with the dtype of the header's
        layout
    starts : (records,), byte of the file at which each record begins
    texts : {index of a record: entries for which the layout has no binary field}
    """

    journal: Path
    header: Header
    slots: Array
    starts: Cases
    texts: Mapping[int, Record]

    def __len__(self) -> int:
        """Return the number of records in the batch."""
        return len(self.slots)

    def take(self, which: Cases) -> Rows:
        """Return a batch of only those records of this one that have given indices.

        which : (m,), indices of the records, all different
        """
        if np.array_equal(which, np.arange(len(self))):
            return self
        texts = self.texts
        if texts:
            both = enumerate(which.tolist())
            texts = {new: texts[old] for new, old in both if old in texts}
        plain = self.slots.view(f"V{self.header.layout.size}")  # copied as raw bytes
        slots = plain[which].view(self.slots.dtype)
        return Rows(self.journal, self.header, slots, self.starts[which], texts)

    @cached_property
    def others(self) -> dict[str, dict[int, Any]]:
        """Values that records hold as text: {`TABLE.NAME`: {record's index: value}}.

        These are the values for which the journal's layout has no binary field.
        """
        out: dict[str, dict[int, Any]] = {}
        for record, text in self.texts.items():
            for table, value in text.items():
                inside = value.items() if isinstance(value, dict) else [("", value)]
                for name, one in inside:
                    key = f"{table}.{name}" if name else table
                    out.setdefault(key, {})[record] = one
        return out

    def has(self, name: str) -> Bools:
        """Return for each record whether it has a value in a binary field, (records,).

        name : full name of the field
        """
        place = self.header.layout.place.get(name)
        if place is None:
            return np.zeros(len(self), dtype=bool)
        bits = self.slots["has"][:, place // 8] >> (place % 8)
        return np.asarray(bits & 1, dtype=bool)

    def has_any(self, table: str) -> Bools:
        """Return for each record whether it has a value of a table, (records,).

        table : table of the record, such as "row"
        """
        places = [p for n, p in self.header.layout.place.items()
                  if n.startswith(f"{table}.")]  # fmt: skip
        bits = np.zeros(8 * self.slots["has"].shape[1], dtype=np.uint8)
        bits[places] = 1
        mask = np.packbits(bits, bitorder="little")
        found: Bools = np.any(self.slots["has"] & mask, axis=1)
        for record, text in self.texts.items():
            found[record] |= isinstance(text.get(table), dict)
        return found

    def numbers(self, name: str, empty: float) -> Array:
        """Return the number that each record has in a field, (records,).

        Parameters
        ----------
        name : full name of the field
        empty : value for a record without a number
        """
        out = np.full(len(self), empty)
        has = self.has(name)
        if has.any():
            out[has] = self.slots[name][has]
        for record, value in self.others.get(name, {}).items():
            if isinstance(value, int | float):
                with suppress(OverflowError):
                    out[record] = value
        return out

    def codes(self, name: str) -> tuple[Cases, list[str]]:
        """Return the codes of the words that records have in a binary field.

        name : full name of the field

        Returns
        -------
        (records,), index of each record's word; and the words, the last one "none", for
        a record without a word
        """
        has, own = self.has(name), self.header.layout.words.get(name, ())
        codes = self.slots[name] if len(own) else len(own)
        return np.where(has, codes, len(own)), [*map(str, own), "none"]

    def words(self, name: str) -> NDArray[np.object_]:
        """Return the word that each record has in a field, (records,); "none": no word.

        name : full name of the field
        """
        codes, own = self.codes(name)
        out: NDArray[np.object_] = np.array(own, dtype=object)[codes]
        for record, value in self.others.get(name, {}).items():
            out[record] = str(value)
        return out

    def record(self, number: int) -> Record:
        """Return one record of the batch as {name: value}.

        number : index of the record
        """
        text = self.texts.get(number, {})
        return self.header.record(self.slots[number].tobytes(), text)


def rows_in(path: Path, sizes: dict[str, int]) -> Iterator[Rows]:
    """Yield the complete records of a journal in batches, in written order.

    Parameters
    ----------
    path : file of the journal
    sizes : {file of traces: bytes}, a cache that this function fills

    Raises
    ------
    MissingFileError
        where the journal cannot be read: its cases must not be lost silently
    """
    try:
        with open_regular(path) as file:
            data = file.read(FIRST)
            found = read_header(data)
            if found is None:
                return
            header, start = found
            data = data[start:]
            while data:
                more = file.read(AT_ONCE)
                rows, end = _parsed(path, header, data, last=not more)
                rows = Rows(path, header, rows.slots, rows.starts + start, rows.texts)
                yield rows.take(np.flatnonzero(_are_of_cases(rows, sizes)))
                del rows  # it may hold `data`
                data, start = data[end:] + more if more else b"", start + end
    except OSError as failed:
        raise unreadable(path, failed) from None


def rows_at(path: Path, header: Header, starts: Cases) -> Rows:
    """Read the records that begin at given bytes of a journal, in the given order.

    Parameters
    ----------
    path : file of the journal
    header : header of the journal
    starts : (records,), first byte of each record

    Raises
    ------
    StoreError, MissingFileError
        where the records no longer exist
    """
    layout, parts = header.layout, []
    try:
        with open_regular(path) as file:  # buffered, each record would cost 8 kB
            for start in starts.tolist():
                slot = os.pread(file.fileno(), layout.size, start)
                text = _text_bytes(slot)
                more = layout.slots_of(text) * layout.size if text > 0 else 0
                if more:
                    slot += os.pread(file.fileno(), more, start + layout.size)
                parts.append(slot)
    except OSError as failed:
        raise unreadable(path, failed) from None
    rows, _ = _parsed(path, header, b"".join(parts), last=True)
    begin = np.cumsum([0, *map(len, parts)])[:-1]
    if len(rows) != len(starts) or (rows.starts != begin).any():
        lost = np.flatnonzero(~np.isin(begin, rows.starts))
        msg = f"{path} has changed at byte {starts[lost[0]]} while it was read"
        raise StoreError(msg)
    return Rows(path, header, rows.slots, starts, rows.texts)


def _text_bytes(slot: bytes) -> int:
    """Return how many bytes of text follow a record's slot; 0 if that is cut short."""
    if len(slot) < CHECKED + NUMBERS.size:
        return 0
    return int(NUMBERS.unpack_from(slot, CHECKED)[0])


def _parsed(path: Path, header: Header, data: bytes, *, last: bool) -> tuple[Rows, int]:
    """Return the complete records in a part of a journal, and the byte where they end.

    Parameters
    ----------
    path, header : file of the journal, and its header
    data : the part of the journal, which need not begin with a slot
    last : whether it is the last part of the journal
    """
    layout = header.layout
    found, end = _whole_slots(header, data)
    slots = _slots_at(found, data, layout)
    good, texts = slots["text"] >= 0, {}
    for place in np.flatnonzero(slots["text"] > 0).tolist():
        begin, count = int(found[place]), layout.slots_of(int(slots["text"][place]))
        if not last and begin + (1 + count) * layout.size > len(data):
            good[place:], end = False, begin
            break
        text = _text(slots[place : place + 1 + count], layout)
        together = place + count < len(found) and (
            found[place + count] == begin + count * layout.size
        )
        good[place] = together and text is not None
        texts[place] = text or {}
    rows = Rows(path, header, slots, found, texts)
    return rows.take(np.flatnonzero(good & _have_words(slots, layout))), end


def _slots_at(starts: Cases, data: bytes, layout: Layout) -> Array:
    """Return the slots that begin at given bytes as a structured array, (slots,).

    If the slots lie one after the other, they are not copied.

    Parameters
    ----------
    starts : (slots,), ascending positions in `data`
    data : part of a journal
    layout : layout of the journal's slots
    """
    if not len(starts):
        return np.zeros(0, layout.dtype)
    if starts[-1] - starts[0] == layout.size * (len(starts) - 1):
        return np.frombuffer(data, layout.dtype, len(starts), starts[0])
    windows = sliding_window_view(np.frombuffer(data, np.uint8), layout.size)[starts]
    return windows.view(layout.dtype).ravel()


def _whole_slots(header: Header, data: bytes) -> tuple[Cases, int]:
    """Return where undamaged slots begin in a part of a journal, and where they end.

    Parameters
    ----------
    header : header of the journal
    data : part of the journal

    Returns
    -------
    (slots,), position of each undamaged slot; and the number of bytes examined
    """
    size, found, place, run = header.layout.size, [np.zeros(0, np.int64)], 0, 1
    while place + size <= len(data):
        count = min((len(data) - place) // size, run)
        good = _are_whole(header, memoryview(data)[place : place + count * size])
        whole = int(good.argmin()) if not good.all() else count
        found.append(place + size * np.arange(whole))
        place += whole * size
        run = min(2 * run, MOST_SLOTS)
        if whole < count:  # damage: a slot may begin anywhere
            place, run = data.find(header.tag, place + 1), 1
            if place < 0:
                place = max(len(data) - TAG + 1, 0)
                break
    return np.concatenate(found), place


def _are_whole(header: Header, data: memoryview) -> Bools:
    """Return for each slot whether its tag and its checksum are right, (slots,).

    Parameters
    ----------
    header : header of the journal
    data : the slots, one after the other
    """
    slots, rest = np.frombuffer(data, header.layout.dtype), header.layout.size - CHECKED
    crc = list(starmap(zlib.crc32, struct.iter_unpack(f"{CHECKED}x{rest}s", data)))
    return np.asarray((slots["crc"] == crc) & (slots["tag"] == np.void(header.tag)))


def _text(slots: Array, layout: Layout) -> Record | None:
    """Return the entries that a record holds as text; None if the text is damaged.

    Parameters
    ----------
    slots : slot of the record, then those that hold its text
    layout : layout of the journal's slots
    """
    first, more = slots[0], slots[1:]
    whole = (more["after"] == first["crc"]).all()
    if not whole or (more["text"] != -1 - np.arange(len(more))).any():
        return None
    body = b"".join(slot.tobytes()[-layout.room :] for slot in more)
    return _json(body[: first["text"]])


@lru_cache(maxsize=256)
def _json(text: bytes) -> Record | None:
    """Return the JSON object that some bytes hold, None for anything else; cached."""
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):  # not written by this program
        return None
    return found if isinstance(found, dict) else None


def _have_words(slots: Array, layout: Layout) -> Bools:
    """Return for each slot whether the header has words for its codes, (slots,).

    A slot stores a word as its index (code) in the list of words in the header.
    """
    good = np.ones(len(slots), dtype=bool)
    for name, words in layout.words.items():
        good &= slots[name] < max(len(words), 1)
    return good


def _are_of_cases(rows: Rows, sizes: dict[str, int]) -> Bools:
    """Return for each record whether it counts as the end of a case, (records,).

    It must have a digest and a known status, a row if it is ok, and complete traces if
    it has any.

    Parameters
    ----------
    rows : records
    sizes : {file of traces: bytes}, a cache
    """
    words = rows.header.layout.words.get("status", ())
    has, named = rows.has("status"), rows.has("digest")
    codes = np.where(has, rows.slots["status"] if len(words) else 0, len(words))
    good = np.array([*(word in ENDS for word in words), False])[codes]
    ok = np.array([*(word == "ok" for word in words), False])[codes]
    good &= ~ok | rows.has_any("row")
    for record, text in rows.texts.items():
        parts = (text.get(table, {}) for table in TABLES)
        good[record] &= all(isinstance(part, dict) for part in parts)
        good[record] &= not IN_FIELDS & text.keys()
        named[record] = isinstance(
            text.get("digest", "" if named[record] else None), str
        )
    return good & named & _have_traces(rows, sizes)


def _have_traces(rows: Rows, sizes: dict[str, int]) -> Bools:
    """Return for each record whether its traces, if any, are complete, (records,).

    Parameters
    ----------
    rows : records of a journal
    sizes : {file of traces: bytes}, a cache
    """
    traced = np.flatnonzero(rows.has_any("traces"))
    good = np.ones(len(rows), dtype=bool)
    if not len(traced):
        return good
    name = Path(rows.header.traces).name
    whole = (
        rows.has("traces.offset") & rows.has("traces.bytes") & rows.has("traces.crc")
    )
    end = rows.numbers("traces.offset", 0) + rows.numbers("traces.bytes", 0)
    if sizes.get(name, -1) < end[traced].max():  # the file may have grown
        sizes[name] = _size(rows.journal.parent.parent / "traces" / name)
    good[traced] = (whole & (end <= sizes[name]))[traced]
    for record in traced.tolist():
        good[record] &= samples_of(rows.texts.get(record, {})) is not None
    return good


def samples_of(text: Record) -> int | None:
    """Return the number of samples in the traces of a record; None without traces.

    text : the entries that the record holds as text
    """
    try:
        return int(text["traces"]["shapes"]["time"][0])
    except (*MALFORMED, IndexError):
        return None


def _size(traces: Path) -> int:
    """Return the size of a trace file, bytes; 0 if the file does not exist."""
    try:
        state = traces.stat()
        return state.st_size if stat.S_ISREG(state.st_mode) else 0
    except FileNotFoundError:
        return 0
    except OSError as failed:
        raise unreadable(traces, failed) from None
