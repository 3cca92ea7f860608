"""SHA-256 digests of the inputs of many cases that differ in a few inputs."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import InputError
from hpcwhirl.scene.case_digest import content_digest, digest_of, without_defaults
from hpcwhirl.scene.input_names import FILE, LATER, Value, default_of, takes_list
from hpcwhirl.scene.inputs import Scene
from hpcwhirl.scene.plain_data import apply_settings, flatten
from hpcwhirl.scene.quantities import LEAVES
from hpcwhirl.scene.table import Cases, Column, OfCases, Table, listed

REAL = frozenset(name for name, field in LEAVES if field.annotation is float)
FIRST = min(name for name, _ in LEAVES if name not in LATER)  # first in every text
AT_ONCE = 1 << 16  # largest number of cases whose texts are in memory together
KEY = 8  # leading bytes of a digest by which the index is sorted


class Digests:
    """Function from the inputs that a case sets to the case's SHA-256.

    Each value of an input is checked once.

    Parameters
    ----------
    base : scene with the inputs that all cases share
    contents : {engine file: SHA-256} when the campaign was planned; other files are
        read now
    """

    def __init__(self, base: Scene, contents: Mapping[str, str]) -> None:
        self.base, self.contents = base, dict(contents)
        self._flat = flatten(base)
        self._memory: dict[str, Any] = {}

    def __call__(self, settings: Mapping[str, Value]) -> str:
        """Return the SHA-256 of a case, hexadecimal.

        settings : {input: value} that the case sets

        Raises
        ------
        InputError
            if the case's inputs are invalid
        """
        try:
            checked = {name: self._value(name, raw) for name, raw in settings.items()}
            values = self._flat | checked
        except InputError:  # a value may be valid only together with values of others
            values = flatten(apply_settings(self.base, settings))
        return self._digest(values)

    def planned(self, settings: Mapping[str, Value]) -> str:
        """Return the SHA-256 of a planned case, even if its inputs are invalid."""
        try:
            return self(settings)
        except InputError:
            return self._digest(self._flat | dict(settings))

    def _digest(self, values: Mapping[str, Any]) -> str:
        file = str(values[FILE])
        if file not in self.contents:
            self.contents[file] = content_digest(file)
        return digest_of(values, self.contents[file])

    def _value(self, name: str, raw: Any) -> Any:
        """Return the checked value of an input, as a scene stores it.

        raw : value as a case sets it
        """
        key = f"{name} {raw!r}"
        if key not in self._memory:
            self._memory[key] = flatten(apply_settings(self.base, {name: raw}))[name]
        return self._memory[key]


class CaseDigests(OfCases[str]):
    """Sequence of the SHA-256 of a table's cases, each computed on access.

    They equal `digest_of` of the cases' scenes but need no scene: the hashed text is
    the same for all cases except for the inputs that they set. Values must have been
    checked.

    Parameters
    ----------
    shared : {dotted input: value} of all inputs, see `flatten`
    table : the inputs that each case sets
    reads : {engine file: result of `read_as`, its part of a digest}
    physics : physics version that is part of the digests
    """

    def __init__(
        self,
        shared: Mapping[str, Any],
        table: Table,
        reads: Mapping[str, str],
        physics: int,
    ) -> None:
        self.shared, self.table = dict(shared), table
        self.reads, self.physics = dict(reads), physics

    def __len__(self) -> int:
        """Return the number of cases."""
        return len(self.table)

    def _of_case(self, case: int) -> str:
        """Return the digest of a case, by its number."""
        values = self.shared | self.table[case]
        head, between = self._text
        one = head.copy()
        for name, text in zip(sorted(self.table.names), between, strict=True):
            one.update((fragment(name, values[name]) + text).encode())
        one.update(f"{json.dumps(self.reads[str(values[FILE])])}]".encode())
        return str(one.hexdigest())

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the arguments of the constructor, not the cached texts."""
        return CaseDigests, (self.shared, self.table, self.reads, self.physics)

    def __iter__(self) -> Iterator[str]:
        """Yield the digest of each case."""
        for words in self._chunks():
            yield from (word.hex() for word in words)

    def __eq__(self, other: object) -> bool:
        """Return whether another sequence has the same digests in the same order."""
        if not isinstance(other, Sequence):
            return NotImplemented
        if len(self) != len(other):
            return False
        if isinstance(other, CaseDigests) and self.identity == other.identity:
            return True
        return all(a == b for a, b in zip(self, other, strict=True))

    __hash__ = None  # type: ignore[assignment]

    def _told(self) -> str:
        # shared values are included, since cases that do not set an input have them
        shared = without_defaults(self.shared)
        return json.dumps([shared, self.reads, self.physics], sort_keys=True)

    def _chunks(self) -> Iterator[list[bytes]]:
        """Yield the digests of all cases as bytes, in lists of at most `AT_ONCE`."""
        for first in range(0, len(self), AT_ONCE):
            yield self._of(np.arange(first, min(first + AT_ONCE, len(self))))

    def _of(self, cases: Cases) -> list[bytes]:
        """Return the digests of `cases`, numbers of cases, 32 bytes each.

        The text before the first input that cases set is common and hashed only once.
        """
        head, parts, digests = self._text[0], [], []
        for column, texts in self._parts:
            parts.append(map(texts.__getitem__, column.codes(cases).tolist()))
        for texts_of_case in zip(*parts, strict=True):
            one = head.copy()
            one.update(b"".join(texts_of_case))
            digests.append(one.digest())
        return digests

    @cached_property
    def _parts(self) -> list[tuple[Column, list[bytes]]]:
        """Hashed texts, (column, texts), of each swept input, then of the engine file.

        A text is the JSON of a value and what follows it, up to the next swept input.
        """
        pairs = []
        for name, text in zip(sorted(self.table.names), self._text[1], strict=True):
            column = self.table.column(name, self.shared[name])
            texts = [(fragment(name, v) + text).encode() for v in listed(column.values)]
            pairs.append((column, texts))
        column = self.table.column(FILE, self.shared[FILE])
        ends = [f"{json.dumps(self.reads[str(v)])}]".encode() for v in column.values]
        return [*pairs, (column, ends)]

    @cached_property
    def _text(self) -> tuple[Any, list[str]]:
        """Hash state of the JSON text before the first swept value; the texts between.

        The end of the text is left out, since it depends on the engine's file. The name
        of an input of `LATER` is not in the text before its value but in its
        `fragment`.
        """
        mark = "\0swept\0"
        values = self.shared | dict.fromkeys(self.table.names, mark)
        text = json.dumps([self.physics, without_defaults(values), ""], sort_keys=True)
        for name in LATER:
            text = text.replace(_named(name, json.dumps(mark)), json.dumps(mark))
        start, *between = text.removesuffix('""]').split(json.dumps(mark))
        return hashlib.sha256(start.encode()), between

    @cached_property
    def identity(self) -> str:
        """SHA-256 of all cases in their order, shortened to 32 hexadecimal digits."""
        parts = [self._told(), self.table.plain()]
        return hashlib.sha256(json.dumps(parts).encode()).hexdigest()[:32]

    def find_all(self, words: NDArray[np.void], hints: Cases) -> Cases:
        """Return the number of the case with each of n digests, (n,); -1: no case.

        Parameters
        ----------
        words : (n,), digests of 32 bytes
        hints : (n,), number of the case to try first for each digest, see `find`
        """
        cases = np.where((hints >= 0) & (hints < len(self)), hints, -1)
        for start in range(0, len(words), AT_ONCE):
            part = slice(start, start + AT_ONCE)
            expected = b"".join(self._of(np.maximum(cases[part], 0)))
            both = (np.frombuffer(data, "<u8").reshape(-1, 4)
                    for data in (expected, words[part].tobytes()))  # fmt: skip
            wrong = np.not_equal(*both).any(axis=1) | (cases[part] < 0)
            for place in start + np.flatnonzero(wrong):
                cases[place] = self.find(bytes(words[place]).hex())
        return cases

    def find(self, name: str, hint: int = -1) -> int:
        """Return the number of the case that has a digest, -1 if no case has it.

        Parameters
        ----------
        name : digest, hexadecimal
        hint : number of the case to try first; if it has another digest, the digests of
            all cases are searched, which are computed at the first search
        """
        if 0 <= hint < len(self) and self[hint] == name:
            return hint
        try:
            start = np.uint64(int(name[: 2 * KEY], 16))
        except ValueError:
            return -1
        order, ordered = self._index
        place = int(np.searchsorted(ordered, start))
        while place < len(order) and ordered[place] == start:
            if self[int(order[place])] == name:
                return int(order[place])
            place += 1
        return -1

    @cached_property
    def _index(self) -> tuple[NDArray[np.int64], NDArray[np.uint64]]:
        """Case numbers by ascending first `KEY` bytes of digests, and these bytes."""
        words = (word[:KEY] for some in self._chunks() for word in some)
        starts = np.frombuffer(b"".join(words), dtype=">u8").astype(np.uint64)
        order = np.argsort(starts, kind="stable")
        return order, starts[order]


def fragment(name: str, value: Any) -> str:
    """Return the JSON text of an input's value as it is hashed in a case's digest.

    For an input of `LATER` the text includes the name, and is "" for the default value.
    """
    if name in LATER:
        told = float.__repr__(float(value)) if takes_real(name) else json.dumps(value)
        return "" if value == default_of(name) else _named(name, told)
    if takes_real(name):
        return float.__repr__(float(value))
    if takes_list(name):
        return json.dumps([float(one) for one in value])
    return json.dumps(value)


def _named(name: str, text: str) -> str:
    """Return the hashed text of an input's name and value, with its comma.

    name, text : the input's dotted name; JSON text of its value
    """
    return f'"{name}": {text}, ' if name < FIRST else f', "{name}": {text}'


def takes_real(name: str) -> bool:
    """Return whether an input is a real number, so that an integer is converted."""
    return name in REAL
