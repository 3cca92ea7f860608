"""Many packed lines of journals at once, without a record for each.

Lines that tell no more than their layout are read as columns, of their numbers no more
than is asked for; all others, and those in which anything is odd, are left to
`lines.opened`, which judges each by itself.
"""

from __future__ import annotations

import zlib
from base64 import b64decode
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from hpcwhirl.regular import open_regular
from hpcwhirl.scene.digests import CaseDigests
from hpcwhirl.scene.quantity import Quantity
from hpcwhirl.scene.words import ENUMS
from hpcwhirl.store.directory.journal import journals, record_of
from hpcwhirl.store.directory.lines import (
    AT,
    DTYPES,
    LAYOUT,
    MARK,
    OWN,
    PLAN,
    Layout,
    Record,
    layout_of,
    learn,
    opened,
)
from hpcwhirl.store.directory.listing import unreadable
from hpcwhirl.store.schema import dtype

AT_ONCE = 1 << 23  # bytes of lines
HEADS = tuple(f'{{"{key}"'.encode() for key in (LAYOUT, PLAN))
TEXT = np.dtype(DTYPES["text"]).itemsize
PLAIN = 0x80  # letters below are one byte each in UTF-8
FIRST = AT + len(MARK + OWN.name + b" ")  # where the numbers of a line begin
CASE, DIGEST = "case", "digest"
DIGITS = np.full(256, -1, dtype=np.int64)
DIGITS[np.frombuffer(b"0123456789abcdef", np.uint8)] = np.arange(16)
POWERS = 16 ** np.arange(AT - 2, -1, -1)
Array = NDArray[Any]
Cases = NDArray[np.int64]
Bytes = NDArray[np.uint8]


class Known:
    """Cases by their digests.

    Parameters
    ----------
    digests : of a plan, in the order of its cases
    """

    def __init__(self, digests: Sequence[str]) -> None:
        self.digests, self._case_of = digests, {}
        if not isinstance(digests, CaseDigests):
            self._case_of = {name: case for case, name in enumerate(digests)}

    def is_of(self, plan: str) -> bool:
        """Return whether the numbers of cases are those of a plan by its identity."""
        return isinstance(self.digests, CaseDigests) and plan == self.digests.identity

    def find(self, name: str, hint: Any = -1) -> int:
        """Return the case of a digest, -1 for none; `hint`: which it may be."""
        place = hint if isinstance(hint, int) else -1
        if isinstance(self.digests, CaseDigests):
            return self.digests.find(name, place)
        if 0 <= place < len(self.digests) and self.digests[place] == name:
            return place
        return self._case_of.get(name, -1)

    def find_all(self, words: Array, hints: Cases) -> Cases:
        """Return the cases of digests of 32 bytes, (m,), -1 for none."""
        if isinstance(self.digests, CaseDigests):
            return self.digests.find_all(words, hints)
        names = [bytes(word).hex() for word in words]
        both = zip(names, hints.tolist(), strict=True)
        return np.array([self.find(*pair) for pair in both], np.int64)


class Chunk(NamedTuple):
    """Some lines of a journal.

    Attributes
    ----------
    journal : its file
    starts : (lines,), byte at which each begins
    at : (m,), those of them that are read at once, ascending
    fields : {table.name: (m,)}, what was asked for of them, words as such; `case` in
        the plan, -1 for none
    others : (line, record) of the others that are whole, in their order; once
    """

    journal: Path
    starts: Cases
    at: Cases
    fields: dict[str, Array]
    others: Iterator[tuple[int, Record]]


def chunks(folder: Path, known: Known, names: Sequence[str]) -> Iterator[Chunk]:
    """Yield all lines of a campaign's journals, the oldest first, some at a time.

    Torn lines are dropped, and those whose traces are not all there.

    Parameters
    ----------
    folder, known : of the campaign and its plan
    names : of fields, `table.name`

    Raises
    ------
    MissingFileError
        where a journal cannot be read
    """
    sizes: dict[str, int] = {}
    for path in journals(folder):
        reading, rest, start = _Reading(path, known, (CASE, *names), sizes), b"", 0
        try:
            with open_regular(path) as file:
                while data := file.read(AT_ONCE):
                    whole, end, rest = (rest + data).rpartition(b"\n")
                    if end:
                        yield reading.chunk(whole + end, start)
                        start += len(whole) + 1
        except OSError as failed:
            raise unreadable(path, failed) from None


class _Reading:
    """The reading of one journal."""

    def __init__(
        self, path: Path, known: Known, names: Sequence[str], sizes: dict[str, int]
    ) -> None:
        self.path, self.known, self.names, self.sizes = path, known, names, sizes
        self.ours = False  # whether its numbers of cases are those of the plan

    def chunk(self, text: bytes, start: int) -> Chunk:
        """Return what whole lines tell; `start`: byte of the first."""
        letters = np.frombuffer(text, np.uint8)
        ends = np.flatnonzero(letters == ord("\n")) + 1
        starts = np.concatenate([[0], ends[:-1]])
        ours, ats, parts = self._are_ours(text, letters, starts), [], []
        for layout, lines in self._by_layout(letters, starts, ends):
            rows = _rows(letters, starts[lines], _length(layout))
            own, found = self._of_rows(layout, rows, ours[lines])
            ats.append(lines[own])
            parts.append(found)
        at = np.concatenate(ats)
        order = np.argsort(at)
        fields = {name: np.concatenate([part[name] for part in parts])[order]
                  for name in self.names}  # fmt: skip
        rest = np.setdiff1d(np.arange(len(ends)), at, assume_unique=True).tolist()
        lines_of = ((i, text[starts[i] : ends[i]]) for i in rest)
        return Chunk(self.path, start + starts, at[order], fields,
                     self._others(lines_of))  # fmt: skip

    def _others(
        self, lines: Iterator[tuple[int, bytes]]
    ) -> Iterator[tuple[int, Record]]:
        """Yield the records of lines that are whole, by their numbers."""
        for number, line in lines:
            record = record_of(self.path.parent.parent, line, self.sizes)
            if record is not None:
                yield number, record

    def _are_ours(
        self, text: bytes, letters: Bytes, starts: Cases
    ) -> NDArray[np.bool_]:
        """Return of which lines the numbers of cases are the plan's; learn layouts."""
        ours = np.full(len(starts), self.ours)
        first = letters[np.minimum(starts + AT, len(letters) - 1)]
        for number in np.flatnonzero(first == HEADS[0][0]).tolist():
            start = int(starts[number])
            if text.startswith(HEADS, start + AT):
                head = opened(text[start : text.index(b"\n", start) + 1]) or {}
                learn(head)
                if PLAN in head:
                    ours[number:] = self.ours = self.known.is_of(str(head[PLAN]))
        return ours

    def _by_layout(
        self, letters: Bytes, starts: Cases, ends: Cases
    ) -> Iterator[tuple[Layout, Cases]]:
        """Yield layouts, with the lines that tell no more; this program's in any case.

        Those that lack what is asked for are left out.
        """
        long = np.flatnonzero(ends - starts >= FIRST)
        heads = _rows(letters, starts[long] + AT, FIRST - AT)
        words = np.ascontiguousarray(heads).view(f"S{FIRST - AT}").ravel()
        for word in {_head(OWN), *words.tolist()}:
            layout = layout_of(bytes(AT) + word)
            if layout and word == _head(layout) and self._is_told_by(layout):
                sizes = (ends - starts)[long]
                yield layout, long[(words == word) & (sizes == _length(layout))]

    def _is_told_by(self, layout: Layout) -> bool:
        names = (DIGEST, *self.names)
        return all(layout.kinds.get(name) == OWN.kinds[name] for name in names)

    def _of_rows(
        self, layout: Layout, rows: Bytes, ours: NDArray[np.bool_]
    ) -> tuple[Cases, dict[str, Array]]:
        """Return which lines of a layout are whole and plain, and what those tell."""
        own = np.flatnonzero(_are_whole(rows))
        try:
            odd = [*layout.words, *layout.texts]
            found = layout.fields_of(rows[own, FIRST:-1], {*odd, *self.names})
        except ValueError:  # sealed by something else than this program
            return self._of_rows(layout, rows[:0], ours[:0])
        good = _are_usual(layout, found)
        own, found = own[good], {name: found[name][good] for name in self.names}
        found[CASE] = self._cases(layout, rows[own, FIRST:-1], found[CASE], ours[own])
        for name in layout.words.keys() & found.keys():
            known = np.array([*map(str, layout.words[name])], dtype=object)
            found[name] = known[found[name]]
        return own, found

    def _cases(
        self, layout: Layout, text: Bytes, told: Cases, ours: NDArray[np.bool_]
    ) -> Cases:
        """Return the cases of lines, by digests where numbers are of another plan."""
        inside = (told >= 0) & (told < len(self.known.digests))
        cases, others = np.where(inside, told, -1), np.flatnonzero(~ours)
        if len(others):
            words = layout.fields_of(text[others], [DIGEST])[DIGEST]
            cases[others] = self.known.find_all(words, told[others])
        return cases


def read(lines: Sequence[bytes]) -> tuple[Cases, Array]:
    """Return which lines are packed, whole and plain, and all that those tell.

    Of this program's layout alone.
    """
    size = _length(OWN)
    own = np.array([i for i, line in enumerate(lines)
                    if len(line) == size and line.startswith(_head(OWN), AT)],
                   np.int64)  # fmt: skip
    text = b"".join([lines[i] for i in own.tolist()])
    rows = np.frombuffer(text, np.uint8).reshape(-1, size)
    good = _are_whole(rows)
    own, text = own[good], rows[good, FIRST:-1].tobytes()
    try:
        numbers = np.frombuffer(b64decode(text, validate=True), OWN.dtype)
    except ValueError:  # sealed by something else than this program
        own, numbers = own[:0], np.zeros(0, OWN.dtype)
    good = _are_usual(OWN, numbers)
    return own[good], numbers[good]


def _head(layout: Layout) -> bytes:
    return MARK + layout.name + b" "


def _length(layout: Layout) -> int:
    return FIRST + layout.width + 1


def _rows(letters: Bytes, starts: Cases, width: int) -> Bytes:
    """Return so many letters from each start on, (m, width)."""
    if not len(starts):  # a window may be longer than all there is
        return np.zeros((0, width), np.uint8)
    return np.asarray(sliding_window_view(letters, width)[starts])


def _are_whole(rows: Bytes) -> NDArray[np.bool_]:
    """Return which lines, (m, bytes), have their checksum."""
    if not rows.size:
        return np.zeros(len(rows), dtype=bool)
    text, width = np.ravel(rows).data, rows.shape[1]
    ends = range(width - 1, len(text), width)
    crc = [zlib.crc32(text[end + 1 - width + AT : end]) for end in ends]
    digits = DIGITS[rows[:, : AT - 1]]
    told = np.where((digits < 0).any(axis=1), -1, digits @ POWERS)
    return np.asarray((told == np.array(crc)) & (rows[:, AT - 1] == ord(" ")))


def _are_usual(layout: Layout, numbers: Mapping[str, Array] | Array) -> Array:
    """Return which have words that there are, and texts of plain letters."""
    good = np.ones(len(numbers[CASE]), dtype=bool)
    for name, words in layout.words.items():
        good &= numbers[name] < len(words)
    for name in layout.texts:
        letters = np.ascontiguousarray(numbers[name]).view(np.uint8)
        good &= (letters.reshape(len(good), TEXT) < PLAIN).all(axis=1)
    return good


def columns(table: dict[str, Quantity], numbers: Array, of: str) -> dict[str, Array]:
    """Return the columns of a table as they are stored.

    Parameters
    ----------
    table : {variable: quantity}
    numbers : of packed lines
    of : the table of the records that has them
    """
    return {name: _column(name, quantity, numbers[f"{of}.{name}"], of)
            for name, quantity in table.items()}  # fmt: skip


def _column(name: str, quantity: Quantity, values: Array, of: str) -> Array:
    words = OWN.words.get(f"{of}.{name}")
    if words is None:
        return values.astype(dtype(quantity))
    if quantity.kind == "enum":  # the codes of the file
        own = np.array([ENUMS[name].index(word) for word in words])
    else:
        own = np.array([word.encode() for word in words])
    return own[values].astype(dtype(quantity))
