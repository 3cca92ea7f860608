"""Journals as columns: what their lines tell of many cases, without a record for each.

A packed line that tells no more than its layout is read with all others of its kind at
once; every other line is opened by itself.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.regular import open_regular
from hpcwhirl.scene.digests import CaseDigests
from hpcwhirl.scene.words import OPEN, is_open
from hpcwhirl.store.journal import journals, record_of
from hpcwhirl.store.lines import (
    AT,
    PLAN,
    Layout,
    Record,
    layout_of,
    opened,
)
from hpcwhirl.store.listing import unreadable

AT_ONCE = 1 << 24  # bytes of lines
NAME = AT + len("~00000000 ")  # where the numbers of a packed line begin
FIELDS = ("case", "digest", "ended", "performance.seconds", "row.outcome",
          "row.regime", "row.stop")  # fmt: skip
DIGITS = np.full(256, -1, dtype=np.int64)
DIGITS[np.frombuffer(b"0123456789abcdef", np.uint8)] = np.arange(16)
Words = NDArray[np.object_]


EMPTY: tuple[tuple[Any, ...], ...] = ((),) * 7


class Told(NamedTuple):
    """What some lines of a journal tell, (lines,) each, in their order.

    Attributes
    ----------
    case : in the plan, of a case as planned; -1: of another one, a twin, a later stage
    status, outcome, regime : words
    open : whether a longer run may tell what it does not
    ended : s since 1970; NaN where a line does not tell
    seconds : s, computing; NaN alike
    """

    case: NDArray[np.int64]
    status: Words
    outcome: Words
    regime: Words
    open: NDArray[np.bool_]
    ended: NDArray[np.float64]
    seconds: NDArray[np.float64]


class Known:
    """Cases by their digests.

    Parameters
    ----------
    digests : of a plan
    """

    def __init__(self, digests: Sequence[str]) -> None:
        self.digests, self._case_of = digests, {}
        if not isinstance(digests, CaseDigests):
            self._case_of = {name: case for case, name in enumerate(digests)}

    def is_of(self, plan: str) -> bool:
        """Return whether the numbers of cases are those of a plan by its identity."""
        return isinstance(self.digests, CaseDigests) and plan == self.digests.identity

    def find(self, name: str, hint: int) -> int:
        """Return the case of a digest, -1 for none; `hint`: what it may be."""
        if isinstance(self.digests, CaseDigests):
            return self.digests.find(name, hint)
        return self._case_of.get(name, -1)

    def find_all(self, words: NDArray[np.void], hints: Any) -> NDArray[np.int64]:
        """Return the cases of digests as bytes, see `find`."""
        if isinstance(self.digests, CaseDigests):
            return self.digests.find_all(words, np.asarray(hints))
        names = (bytes(word).hex() for word in words)
        return np.array([self._case_of.get(name, -1) for name in names], np.int64)


def told_by(folder: Path, digests: Sequence[str]) -> Iterator[tuple[str, Told]]:
    """Yield (journal, what some of its lines tell), the oldest first.

    Torn lines are dropped, and those whose traces are not all there.

    Parameters
    ----------
    folder : of a campaign
    digests : of its plan's cases
    """
    known, sizes = Known(digests), dict[str, int]()
    for path in journals(folder):
        reading, rest = _Reading(folder, known, sizes), b""
        try:
            with open_regular(path) as file:
                while data := file.read(AT_ONCE):
                    whole, end, rest = (rest + data).rpartition(b"\n")
                    yield path.stem, reading.told(whole + end)
        except OSError as failed:
            raise unreadable(path, failed) from None


class _Reading:
    """The reading of one journal."""

    def __init__(self, folder: Path, known: Known, sizes: dict[str, int]) -> None:
        self.folder, self.known, self.sizes = folder, known, sizes
        self.ours = False  # whether its numbers of cases are those of the plan

    def told(self, text: bytes) -> Told:
        """Return what whole lines tell."""
        parts: list[Told] = []
        alone: list[tuple[Any, ...]] = []
        for at, size, layout in _runs(text):
            told = self._of_packed(text[at : at + size], layout) if layout else None
            if told is None:
                lines = text[at : at + size].splitlines(keepends=True)
                alone += [one for line in lines if (one := self._of_line(line))]
                continue
            parts += [_joined(alone), told]
            alone = []
        both = zip(*parts, _joined(alone), strict=True)
        return Told(*map(np.concatenate, both))

    def _of_line(self, line: bytes) -> tuple[Any, ...] | None:
        """Return what a line tells, in the order of `Told`; None if of no case."""
        record = record_of(self.folder, line, self.sizes)
        if record is not None:
            return self._of_record(record)
        head = opened(line) or {}
        if PLAN in head:
            self.ours = self.known.is_of(str(head[PLAN]))
        return None

    def _of_record(self, record: Record) -> tuple[Any, ...]:
        case, row = -1, record.get("row") or {}
        if not record.get("twin") and not record.get("longest"):
            hint = record.get("case")
            hint = hint if isinstance(hint, int) else -1
            case = self.known.find(str(record["digest"]), hint)
        seconds = record.get("performance", {}).get("seconds", np.nan)
        words = (str(row.get(name, "none")) for name in ("outcome", "regime"))
        ended, status = float(record.get("ended", np.nan)), str(record["status"])
        still = status == "ok" and is_open(row)
        return case, status, *words, still, ended, float(seconds)

    def _of_packed(self, lines: bytes, layout: Layout) -> Told | None:
        """Return what packed lines tell; None where they are not to be read at once."""
        width = NAME + layout.width + 1
        text = np.frombuffer(lines, np.uint8).reshape(-1, width)
        view = memoryview(lines)
        starts = range(AT, len(lines), width)
        crc = [zlib.crc32(view[at : at + width - AT - 1]) for at in starts]
        kept = _hexadecimal(text[:, : AT - 1]) == np.array(crc)
        text = text if kept.all() else text[kept]
        try:
            return self._of_fields(layout, layout.fields_of(text[:, NAME:], FIELDS))
        except (ValueError, IndexError, KeyError, StopIteration):  # of another program
            return None

    def _of_fields(self, layout: Layout, found: dict[str, NDArray[Any]]) -> Told:
        """Return what the fields of packed lines tell."""
        case = found["case"].astype(np.int64)
        if self.ours:
            case = np.where(case < len(self.known.digests), case, -1)
        else:
            case = self.known.find_all(found["digest"], case)
        outcome, regime, stop = (
            layout.words("row", n, found) for n in ("outcome", "regime", "stop")
        )
        return Told(
            case, np.full(len(case), "ok", dtype=object), outcome, regime,
            (regime == OPEN["regime"]) & (stop == OPEN["stop"]), found["ended"],
            found["performance.seconds"],
        )  # fmt: skip


def _runs(text: bytes) -> Iterator[tuple[int, int, Layout | None]]:
    """Yield where lines begin, their bytes, and the layout of those that have one.

    Lines of a layout that tell no more than it are alike: they come together.
    """
    at = 0
    while at < len(text):
        size = text.index(b"\n", at) + 1 - at
        layout = layout_of(text[at : at + size])
        if layout is not None and size == NAME + layout.width + 1:
            count = (len(text) - at) // size
            rows = np.frombuffer(text, np.uint8, count * size, at).reshape(-1, size)
            alike = (rows[:, AT:NAME] == rows[0, AT:NAME]).all(axis=1)
            alike &= rows[:, -1] == rows[0, -1]
            size *= count if alike.all() else int(alike.argmin())
            yield at, size, layout
        else:
            yield at, size, None
        at += size


def _hexadecimal(text: NDArray[np.uint8]) -> NDArray[np.int64]:
    """Return the numbers that rows of digits tell, (n,); -1 for what is none."""
    digits = DIGITS[text]
    powers = 16 ** np.arange(text.shape[1] - 1, -1, -1)
    return np.where((digits < 0).any(axis=1), -1, digits @ powers)


def _joined(lines: list[tuple[Any, ...]]) -> Told:
    """Return columns of what lines tell one by one."""
    kinds = (np.int64, object, object, object, bool, float, float)
    columns = zip(*lines, strict=True) if lines else EMPTY
    both = zip(columns, kinds, strict=True)
    return Told(*(np.array(column, dtype=kind) for column, kind in both))
