"""Digests of many cases that differ in a few inputs."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import InputError
from hpcwhirl.scene.files import (
    FILE,
    Value,
    apply_settings,
    content_digest,
    digest_of,
    flatten,
    takes_list,
)
from hpcwhirl.scene.inputs import Scene
from hpcwhirl.scene.quantities import LEAVES
from hpcwhirl.scene.table import Cases, Column, OfCases, Table, listed

REAL = frozenset(name for name, field in LEAVES if field.annotation is float)
AT_ONCE = 1 << 16  # cases whose texts are in memory together
KEY = 8  # bytes of a digest that cases are looked up by


class Digests:
    """Digests of cases by what they set; each value is checked once for all of them.

    Parameters
    ----------
    base : what the cases share
    contents : {engine file: SHA-256} as planned; others are read
    """

    def __init__(self, base: Scene, contents: Mapping[str, str]) -> None:
        self.base, self.contents = base, dict(contents)
        self._flat = flatten(base)
        self._memory: dict[str, Any] = {}

    def __call__(self, settings: Mapping[str, Value]) -> str:
        """Return the digest of a case.

        Raises
        ------
        InputError
            where there is no such case
        """
        try:
            own = {name: self._value(name, raw) for name, raw in settings.items()}
            values = self._flat | own
        except InputError:  # allowed together with others alone
            values = flatten(apply_settings(self.base, settings))
        return self._digest(values)

    def planned(self, settings: Mapping[str, Value]) -> str:
        """Return the digest of a case, of one that will fail as a row, too."""
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
        """Return a value as a scene has it."""
        key = f"{name} {raw!r}"
        if key not in self._memory:
            self._memory[key] = flatten(apply_settings(self.base, {name: raw}))[name]
        return self._memory[key]


class CaseDigests(OfCases[str]):
    """The digests of the cases of a table, each made when it is asked for.

    They are those of `digest_of` the cases' scenes, without a scene: of a text that all
    cases share but for what they set. Values must have been found allowed.

    Parameters
    ----------
    shared : {dotted input: value} of all inputs, as `flatten` has them
    table : what each case sets
    reads : {engine file: its part of a digest, see `read_as`}
    physics : version that the digests are of
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
        """Return the digest of a case."""
        values = self.shared | self.table[case]
        head, between = self._text
        one = head.copy()
        for name, text in zip(sorted(self.table.names), between, strict=True):
            one.update((fragment(name, values[name]) + text).encode())
        one.update(f"{json.dumps(self.reads[str(values[FILE])])}]".encode())
        return str(one.hexdigest())

    def __reduce__(self) -> tuple[Any, ...]:
        """Send what they are made from."""
        return CaseDigests, (self.shared, self.table, self.reads, self.physics)

    def __iter__(self) -> Iterator[str]:
        """Yield the digest of each case."""
        for words in self._chunks():
            yield from (word.hex() for word in words)

    def __eq__(self, other: object) -> bool:
        """Return whether another sequence has the same digests."""
        if not isinstance(other, Sequence):
            return NotImplemented
        if len(self) != len(other):
            return False
        if isinstance(other, CaseDigests) and self.identity == other.identity:
            return True
        return all(a == b for a, b in zip(self, other, strict=True))

    __hash__ = None  # type: ignore[assignment]

    def _told(self) -> str:
        # A block of cases that does not set an input takes the shared one.
        return json.dumps([self.shared, self.reads, self.physics], sort_keys=True)

    def _chunks(self) -> Iterator[list[bytes]]:
        """Yield the digests of all cases, some at once."""
        for first in range(0, len(self), AT_ONCE):
            yield self._of(np.arange(first, min(first + AT_ONCE, len(self))))

    def _of(self, cases: Cases) -> list[bytes]:
        """Return the digests of some cases.

        What stands before the first input that cases set is hashed once.
        """
        head, parts, found = self._text[0], [], []
        for column, texts in self._parts:
            parts.append(map(texts.__getitem__, column.codes(cases).tolist()))
        for own in zip(*parts, strict=True):
            one = head.copy()
            one.update(b"".join(own))
            found.append(one.digest())
        return found

    @cached_property
    def _parts(self) -> list[tuple[Column, list[bytes]]]:
        """What cases set, as the text of each of its values and what follows it."""
        found = []
        for name, text in zip(sorted(self.table.names), self._text[1], strict=True):
            column = self.table.column(name, self.shared[name])
            texts = [(fragment(name, v) + text).encode() for v in listed(column.values)]
            found.append((column, texts))
        column = self.table.column(FILE, self.shared[FILE])
        ends = [f"{json.dumps(self.reads[str(v)])}]".encode() for v in column.values]
        return [*found, (column, ends)]

    @cached_property
    def _text(self) -> tuple[Any, list[str]]:
        """The hash of a case's text up to what is set first, and the texts after each.

        The end is not among them: it tells an engine's file.
        """
        mark = "\0swept\0"
        values = self.shared | dict.fromkeys(self.table.names, mark)
        text = json.dumps([self.physics, values, ""], sort_keys=True)
        start, *between = text.removesuffix('""]').split(json.dumps(mark))
        return hashlib.sha256(start.encode()), between

    @cached_property
    def identity(self) -> str:
        """What tells this order of these cases from any other."""
        told = [self._told(), self.table.plain()]
        return hashlib.sha256(json.dumps(told).encode()).hexdigest()[:32]

    def find_all(self, words: NDArray[np.void], hints: Cases) -> Cases:
        """Return the cases of digests as bytes, (n,), see `find`."""
        found = np.where((hints >= 0) & (hints < len(self)), hints, -1)
        for start in range(0, len(words), AT_ONCE):
            part = slice(start, start + AT_ONCE)
            own = b"".join(self._of(np.maximum(found[part], 0)))
            both = (np.frombuffer(known, "<u8").reshape(-1, 4)
                    for known in (own, words[part].tobytes()))  # fmt: skip
            wrong = np.not_equal(*both).any(axis=1) | (found[part] < 0)
            for place in start + np.flatnonzero(wrong):
                found[place] = self.find(bytes(words[place]).hex())
        return found

    def find(self, name: str, hint: int = -1) -> int:
        """Return the case of a digest, -1 where it is of none.

        hint : the case that it is thought to be of; else all digests are made, once
        """
        if 0 <= hint < len(self) and self[hint] == name:
            return hint
        try:
            own = np.uint64(int(name[: 2 * KEY], 16))
        except ValueError:
            return -1
        order, ordered = self._index
        place = int(np.searchsorted(ordered, own))
        while place < len(order) and ordered[place] == own:
            if self[int(order[place])] == name:
                return int(order[place])
            place += 1
        return -1

    @cached_property
    def _index(self) -> tuple[NDArray[np.int64], NDArray[np.uint64]]:
        """The cases by the first bytes of their digests."""
        words = (word[:KEY] for some in self._chunks() for word in some)
        own = np.frombuffer(b"".join(words), dtype=">u8").astype(np.uint64)
        order = np.argsort(own, kind="stable")
        return order, own[order]


def fragment(name: str, value: Any) -> str:
    """Return the text that a value of an input has in what is digested."""
    if takes_real(name):
        return float.__repr__(float(value))
    if takes_list(name):
        return json.dumps([float(one) for one in value])
    return json.dumps(value)


def takes_real(name: str) -> bool:
    """Return whether an input is a real number: a whole one becomes one there."""
    return name in REAL
