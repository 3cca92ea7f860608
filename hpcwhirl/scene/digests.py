"""SHA-256 digests of the cases of a campaign, most of whose inputs are equal."""

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
# input that comes first in every hashed text
FIRST = min(name for name, _ in LEAVES if name not in LATER)
AT_ONCE = 1 << 16  # largest number of cases whose texts are in memory together
KEY = 8  # leading bytes of a digest by which the index is sorted


class Digests:
    """A function from {input: value} that a case sets to the SHA-256 of the case.

    Each value of an input is checked once, and then remembered.

    Parameters
    ----------
    base : scene with the inputs that all cases share
    contents : {engine file: SHA-256 of its content when the campaign was planned};
        other files are read now
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
        """Return the SHA-256 of a planned case; invalid inputs are hashed as given."""
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
        """Return the value that a scene stores for an input, after a check.

        raw : value as a case sets it, such as "0.8 mm"
        """
        key = f"{name} {raw!r}"
        if key not in self._memory:
            self._memory[key] = flatten(apply_settings(self.base, {name: raw}))[name]
        return self._memory[key]


def starts_of(words: NDArray[np.void]) -> NDArray[np.uint64]:
    """Return the first eight bytes of each of n digests as a number, (n,).

    words : (n,), digests of 32 bytes
    """
    first = np.frombuffer(words.tobytes(), ">u8").reshape(-1, 4)[:, 0]
    return first.astype(np.uint64)


class CaseDigests(OfCases[str]):
    """Sequence of the digests (SHA-256, hexadecimal) of all cases of a campaign.

    A digest is computed on access, without a `Scene`, and equals `digest_of`: the
    hashed JSON text is the same for all cases except for the values that they set,
    which must have been checked before.

    Parameters
    ----------
    shared : {dotted input: value} of all inputs, for cases that do not set them
    table : {input: value} that each case sets
    reads : {engine file: text that stands for it in a digest, from `read_as`}
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
        """Return the digest of the case with the number `case`, hexadecimal."""
        own, shared = self.table[case], self.shared
        head, between = self._text
        one, parts = head.copy(), list[str]()
        for name, text in zip(sorted(self.table.names), between, strict=True):
            value = own[name] if name in own else shared[name]
            parts += fragment(name, value), text
        file = own[FILE] if FILE in own else shared[FILE]
        one.update(f"{''.join(parts)}{json.dumps(self.reads[str(file)])}]".encode())
        return str(one.hexdigest())

    def __reduce__(self) -> tuple[Any, ...]:
        """Let pickle store the arguments of the constructor, not the cached texts."""
        return CaseDigests, (self.shared, self.table, self.reads, self.physics)

    def __iter__(self) -> Iterator[str]:
        """Yield the digest of each case, hexadecimal, in the order of case numbers."""
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
        """Yield the digests of all cases, 32 bytes each, in lists of `AT_ONCE`."""
        for first in range(0, len(self), AT_ONCE):
            yield self._of(np.arange(first, min(first + AT_ONCE, len(self))))

    def _of(self, cases: Cases) -> list[bytes]:
        """Return the digests of some cases, 32 bytes each.

        The text before the first input that cases set is common and hashed only once.

        cases : numbers of the cases
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
        """(Column, hashed texts of its values) of each swept input and the engine file.

        A text is the JSON of a value and what follows it, up to the next swept value;
        the last pair is that of the engine file, whose texts end the hashed text.
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
        """The hashed JSON text that all cases share: its beginning, and other parts.

        The beginning, up to the first swept value, is given as a hash state; then comes
        a list of the texts after each swept value, up to the next one. The end of the
        whole text is left out, since it depends on the engine's file. The name
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
        """SHA-256 of the inputs of all cases in their order, 32 hexadecimal digits."""
        parts = [self._told(), self.table.plain()]
        return hashlib.sha256(json.dumps(parts).encode()).hexdigest()[:32]

    def find_all(self, words: NDArray[np.void], hints: Cases) -> Cases:
        """Return the case number that belongs to each of n digests, (n,); -1: no case.

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
            others = start + np.flatnonzero(wrong)
            cases[others] = -1
            for place in others[self._may_have(words[others])] if len(others) else ():
                cases[place] = self.find(bytes(words[place]).hex())
        return cases

    def _may_have(self, words: NDArray[np.void]) -> NDArray[np.bool_]:
        """Return whether a case's digest begins like each of n digests, (n,).

        words : (n,), digests of 32 bytes
        """
        starts, ordered = starts_of(words), self._index[1]
        places = np.searchsorted(ordered, starts)
        inside = places < len(ordered)
        inside[inside] = ordered[places[inside]] == starts[inside]
        return inside

    def find(self, name: str, hint: int = -1) -> int:
        """Return the number of the case that has the digest `name`; -1: no case.

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
        """Case numbers sorted by the first `KEY` bytes of digests; these, as uint64."""
        words = (word[:KEY] for some in self._chunks() for word in some)
        starts = np.frombuffer(b"".join(words), dtype=">u8").astype(np.uint64)
        order = np.argsort(starts, kind="stable")
        return order, starts[order]


def fragment(name: str, value: Any) -> str:
    """Return the JSON text of an input's value as it is hashed in a case's digest.

    For an input added after the first release (`LATER`) the text includes the name, and
    is "" for the default value.
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
    """Return the hashed text of an input's name and value, with a separating comma.

    name, text : the input's dotted name; JSON text of its value
    """
    return f'"{name}": {text}, ' if name < FIRST else f', "{name}": {text}'


def takes_real(name: str) -> bool:
    """Return whether an input is a real number, for which 1 is hashed like 1.0."""
    return name in REAL
