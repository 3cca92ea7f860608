"""Many packed lines of journals at once, as columns and without a record for each.

Lines that tell no more than this program's own layout are read so; all others, and
those in which anything is odd, are left to `lines.opened`, which judges each by itself.
"""

from __future__ import annotations

import itertools
import zlib
from base64 import b64decode
from collections.abc import Iterator, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.regular import open_regular
from hpcwhirl.scene.quantity import Quantity
from hpcwhirl.scene.words import ENUMS
from hpcwhirl.store.lines import AT, CODES, MARK, OWN
from hpcwhirl.store.listing import unreadable
from hpcwhirl.store.schema import dtype

AT_ONCE = 1 << 23  # bytes of lines
PLAIN = 0x80  # letters below are one byte each in UTF-8
HEAD = MARK + OWN.name + b" "
FIRST = AT + len(HEAD)  # where the numbers of a line begin
LENGTH = FIRST + OWN.width + 1
TYPES = {"d": "<f8", "q": "<i8", "B": "u1", "32s": "V32", "24s": "S24"}
Array = NDArray[Any]


def _field(table: str, name: str) -> str:
    return f"{table}.{name}" if table else name


def _dtype() -> np.dtype[Any]:
    """Return what the numbers of a line are, by the names of their fields."""
    kinds = [(_field(t, n), CODES[kind]) for t, n, kind, _ in OWN.fields]
    found = np.dtype([(name, TYPES[code]) for name, code in kinds])
    filler = OWN.numbers.size - found.itemsize
    return np.dtype([*found.descr, ("", f"V{filler}")] if filler else found)


NUMBERS = _dtype()
WORDS = {_field(t, n): words for t, n, kind, words in OWN.fields if kind == "word"}
TEXTS = [_field(t, n) for t, n, kind, _ in OWN.fields if kind == "text"]


class Chunk(NamedTuple):
    """Some lines of a journal.

    Attributes
    ----------
    starts : (lines,), byte at which each begins
    lines : the lines
    at : (m,), those of them that `numbers` has, ascending
    numbers : (m,), what they tell, fields by the names of their table and their own
    """

    starts: NDArray[np.int64]
    lines: list[bytes]
    at: NDArray[np.int64]
    numbers: Array


def chunks(path: Path) -> Iterator[Chunk]:
    """Yield all lines of a journal, some at a time.

    Raises
    ------
    MissingFileError
        where it cannot be read
    """
    start = 0
    try:
        with open_regular(path) as file:
            while lines := file.readlines(AT_ONCE):
                ends = start + np.cumsum([len(line) for line in lines])
                starts = np.concatenate([[start], ends[:-1]])
                yield Chunk(starts, lines, *read(lines))
                start = int(ends[-1])
    except OSError as failed:
        raise unreadable(path, failed) from None


def read(lines: Sequence[bytes]) -> tuple[NDArray[np.int64], Array]:
    """Return which lines are packed, whole and plain, and what those tell."""
    own = [i for i, line in enumerate(lines) if _is_plain(line)]
    text = b"".join([lines[i][FIRST:-1] for i in own])
    try:
        numbers = np.frombuffer(b64decode(text, validate=True), NUMBERS)
    except ValueError:  # sealed by something else than this program
        own, numbers = [], np.zeros(0, NUMBERS)
    good = _are_usual(numbers)
    return np.array(own, np.int64)[good], numbers[good]


def _is_plain(line: bytes) -> bool:
    """Return whether a line has its checksum and nothing but numbers of the layout."""
    return (
        len(line) == LENGTH
        and line.startswith(HEAD, AT)
        and line[: AT - 1] == b"%08x" % zlib.crc32(line[AT:-1])
    )


def _are_usual(numbers: Array) -> NDArray[np.bool_]:
    """Return which of them have words that there are, and texts of plain letters."""
    good = np.ones(len(numbers), dtype=bool)
    for name, words in WORDS.items():
        good &= numbers[name] < len(words)
    for name in TEXTS:
        letters = np.ascontiguousarray(numbers[name]).view(np.uint8)
        width = numbers.dtype[name].itemsize
        good &= (letters.reshape(len(numbers), width) < PLAIN).all(axis=1)
    return good


def columns(table: dict[str, Quantity], numbers: Array, of: str) -> dict[str, Array]:
    """Return the columns of a table as they are stored.

    Parameters
    ----------
    table : {variable: quantity}
    numbers : of packed lines
    of : the table of the records that has them
    """
    return {name: _column(name, quantity, numbers[_field(of, name)], of)
            for name, quantity in table.items()}  # fmt: skip


def _column(name: str, quantity: Quantity, values: Array, of: str) -> Array:
    words = WORDS.get(_field(of, name))
    if words is None:
        return values.astype(dtype(quantity))
    if quantity.kind == "enum":  # the codes of the file
        own = np.array([ENUMS[name].index(word) for word in words])
    else:
        own = np.array([word.encode() for word in words])
    return own[values].astype(dtype(quantity))


def words_in(numbers: Array, name: str) -> NDArray[np.str_]:
    """Return the words of a field."""
    return np.asarray(np.array(WORDS[name])[numbers[name]])


class Numbers:
    """Cases by their digests, 32 bytes each.

    Parameters
    ----------
    digests : of a plan, in the order of its cases
    """

    def __init__(self, digests: Sequence[str]) -> None:
        self._digests = digests
        self._known = np.zeros((0, 4), np.int64)
        try:
            own = b"".join(map(bytes.fromhex, digests))
        except ValueError:  # of another program
            own = b""
        if len(own) == 32 * len(digests):
            self._known = np.frombuffer(own, np.int64).reshape(-1, 4)

    def find(self, name: str, hint: Any = -1) -> int:
        """Return the case of a digest, -1 for none; `hint`: which it may be."""
        if isinstance(hint, int) and 0 <= hint < len(self._known):
            own = self._known[hint].tobytes().hex()
            if own == name:
                return hint
        return self._by_name.get(name, -1)

    def find_all(self, digests: Array, hints: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the cases of digests of 32 bytes, (m,), -1 for none."""
        words = np.ascontiguousarray(digests).view(np.int64).reshape(-1, 4)
        count = len(self._known)
        inside = (hints >= 0) & (hints < count)
        cases = np.where(inside, hints, 0)
        same = inside.copy()
        if count:
            same &= (self._known[cases] == words).all(axis=1)
        cases[~same] = [
            self._by_name.get(words[i].tobytes().hex(), -1)
            for i in np.flatnonzero(~same)
        ]
        return cases

    @cached_property
    def _by_name(self) -> dict[str, int]:
        """Cases by their names, once some case is another than it was thought to be."""
        return {name: case for case, name in enumerate(self._digests)}


def runs(at: NDArray[np.int64], lines: int) -> Iterator[tuple[slice, int]]:
    """Yield, in order, runs of `at` and the line after each that is not among them.

    The last run has the number -1.
    """
    others = np.setdiff1d(np.arange(lines), at, assume_unique=True)
    edges = [0, *np.searchsorted(at, others).tolist(), len(at)]
    for (begin, end), line in zip(
        itertools.pairwise(edges), [*others.tolist(), -1], strict=True
    ):
        yield slice(begin, end), line
