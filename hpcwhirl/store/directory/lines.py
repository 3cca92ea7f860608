"""Sealed lines: a JSON object, or the numbers of a usual record, packed to a third.

A line is the CRC-32 of the rest in hexadecimal, a space, and the rest. That is JSON;
or `~`, the name of a layout, a space, base64 of the numbers that the layout tells, all
little-endian, and, where the record has more than those, a space and JSON of what.

A layout is the table of a record's fields and of their words, its name the CRC-32 of
it as JSON. It stands in each file that has lines of it, so that a program with other
variables or words reads them rightly; this program's own is known without.
"""

from __future__ import annotations

import json
import struct
import zlib
from base64 import b64decode, b64encode
from collections.abc import Callable, Iterable, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.scene.quantities import PERFORMANCE, ROW
from hpcwhirl.scene.quantity import Quantity
from hpcwhirl.scene.schemes import SCHEMES
from hpcwhirl.scene.words import ENUMS

Record = dict[str, Any]
Field = tuple[str, str, str, Sequence[str]]  # table, name, kind, words
MARK = b"~"
AT = len("00000000 ")  # where the rest of a line begins
LAYOUT = "layout"  # key of a line that tells one
PLAN = "plan"  # key of a line that tells whose numbers the cases of a journal have
DTYPES = {"f8": "<f8", "i8": "<i8", "word": "u1", "hex": "V32", "text": "S24"}
CODES = {"f8": "d", "i8": "q", "word": "B", "hex": "32s", "text": "24s"}
USUAL = {"status": "ok", "message": ""}  # of a packed record; not stored


def _sealed(body: bytes) -> bytes:
    return f"{zlib.crc32(body):08x} ".encode() + body + b"\n"


class Layout:
    """The fields of a packed record, in their order.

    Parameters
    ----------
    fields : [table of the record or "", name, kind, words of the kind `word`] of each
    """

    def __init__(self, fields: Sequence[Field]) -> None:
        self.fields = [(t, n, kind, tuple(words)) for t, n, kind, words in fields]
        told = json.dumps({LAYOUT: self.fields}).encode()
        self.name, self.head = f"{zlib.crc32(told):08x}".encode(), _sealed(told)
        codes = "".join(CODES[kind] for _, _, kind, _ in self.fields)
        size = struct.calcsize(f"<{codes}")
        self.numbers = struct.Struct(f"<{codes}{-size % 3}x")  # base64 needs no `=`
        self.width = self.numbers.size // 3 * 4  # characters
        self._out = [_writer(kind, words) for _, _, kind, words in self.fields]
        self._in = [_reader(kind, words) for _, _, kind, words in self.fields]
        tables = dict.fromkeys(table for table, *_ in self.fields)
        self.tables = {t: [n for u, n, _, _ in self.fields if u == t] for t in tables}

    @cached_property
    def kinds(self) -> dict[str, str]:
        """Kind of each field, by `table.name`."""
        return {_named(t, n): kind for t, n, kind, _ in self.fields}

    @cached_property
    def words(self) -> dict[str, Sequence[str]]:
        """Words of those fields that are one, by the same names."""
        return {_named(t, n): w for t, n, kind, w in self.fields if kind == "word"}

    @cached_property
    def texts(self) -> list[str]:
        """Names of the fields that are texts."""
        return [name for name, kind in self.kinds.items() if kind == "text"]

    @cached_property
    def dtype(self) -> np.dtype[Any]:
        """What the numbers are, by the names of their fields."""
        found = np.dtype([(name, DTYPES[kind]) for name, kind in self.kinds.items()])
        filler = self.numbers.size - found.itemsize
        return np.dtype([*found.descr, ("", f"V{filler}")] if filler else found)

    def fields_of(
        self, text: NDArray[np.uint8], names: Iterable[str]
    ) -> dict[str, NDArray[Any]]:
        """Return some fields of many records, {`table.name`: (records,)}.

        Of the text no more is decoded than has to be.

        Parameters
        ----------
        text : (records, width), base64 of the numbers
        names : of fields

        Raises
        ------
        ValueError
            where it is no base64
        """
        out, places = {}, dict(self.dtype.fields or {})
        for name in names:
            kind, begin = places[name][:2]
            first, last = begin // 3, -(-(begin + kind.itemsize) // 3)
            own = b64decode(text[:, 4 * first : 4 * last].tobytes(), validate=True)
            rows = np.frombuffer(own, np.uint8).reshape(len(text), 3 * (last - first))
            part = rows[:, begin - 3 * first :][:, : kind.itemsize]
            out[name] = np.frombuffer(part.tobytes(), kind)
        return out

    @cached_property
    def own(self) -> dict[str, set[str]]:
        """Names of each table that the layout has."""
        return {table: set(names) for table, names in self.tables.items()}

    def packed(self, record: Record) -> bytes | None:
        """Return what follows the seal of a record's line; None for one that is JSON.

        That is one of a case without a result, or with a value of another type.
        """
        if any(record.get(name) != usual for name, usual in USUAL.items()):
            return None
        try:
            parts = {t: record[t] if t else record for t in self.tables}
            values = [parts[table][name] for table, name, _, _ in self.fields]
            pairs = zip(self._out, values, strict=True)
            data = self.numbers.pack(*[write(value) for write, value in pairs])
        except (KeyError, TypeError, ValueError, struct.error):
            return None
        body = MARK + self.name + b" " + b64encode(data)
        rest = self._rest(record)
        return body + b" " + json.dumps(rest).encode() if rest else body

    def _rest(self, record: Record) -> Record:
        """Return what a record has beside the fields."""
        known = {*self.own[""], *self.own, *USUAL}
        rest = {name: record[name] for name in record if name not in known}
        for table, names in self.own.items():
            if table and len(record[table]) > len(names):
                more = {n: v for n, v in record[table].items() if n not in names}
                rest[table] = more
        return rest

    def opened(self, body: bytes) -> Record | None:
        """Return the record of what `packed` made."""
        data, _, rest = body[len(MARK + self.name) + 1 :].partition(b" ")
        try:
            found = self.numbers.unpack(b64decode(data, validate=True))
            more = json.loads(rest) if rest else {}
            values = [read(value) for read, value in zip(self._in, found, strict=True)]
        except (ValueError, struct.error, IndexError, RecursionError):
            return None
        record: Record = {**dict.fromkeys(self.tables[""]), **USUAL}
        tables = {t: record if not t else record.setdefault(t, {}) for t in self.tables}
        for (table, name, _, _), value in zip(self.fields, values, strict=True):
            tables[table][name] = value
        for name, value in more.items():
            if name in self.own and isinstance(value, dict):
                record[name] |= value
            else:
                record[name] = value
        return record


def _named(table: str, name: str) -> str:
    return f"{table}.{name}" if table else name


def _writer(kind: str, words: Sequence[str]) -> Callable[[Any], Any]:
    """Return what makes a value of a record one to pack, or raises."""
    if kind == "word":
        places = {word: place for place, word in enumerate(words)}
        return lambda value: places[value]
    return {"f8": _float, "i8": _whole, "hex": _of_hex, "text": _of_text}[kind]


def _reader(kind: str, words: Sequence[str]) -> Callable[[Any], Any]:
    """Return what makes a packed value what it was in the record."""
    if kind == "word":
        return words.__getitem__
    known: dict[str, Callable[[Any], Any]] = {
        "f8": float, "i8": int, "hex": bytes.hex, "text": _text,
    }  # fmt: skip
    return known[kind]


def _float(value: Any) -> float:
    if not isinstance(value, float):
        raise TypeError
    return value


def _whole(value: Any) -> int:
    if not isinstance(value, int) or isinstance(value, bool):
        raise TypeError
    return value


def _of_hex(value: str) -> bytes:
    found = bytes.fromhex(value)
    if found.hex() != value or len(found) != struct.calcsize(CODES["hex"]):
        raise ValueError
    return found


def _of_text(value: str) -> bytes:
    found = value.encode()
    if len(found) > struct.calcsize(CODES["text"]) or b"\0" in found:
        raise ValueError
    return found


def _text(value: bytes) -> str:
    return value.rstrip(b"\0").decode()


def _fields(table: str, quantities: dict[str, Quantity]) -> list[Field]:
    """Return the fields of a table of numbers and words."""
    kinds = {"enum": "word", "S16": "word", "S64": "text"}
    words = {**ENUMS, "scheme": tuple(SCHEMES)}
    return [(table, name, kinds.get(quantity.kind, quantity.kind), words.get(name, ()))
            for name, quantity in quantities.items()]  # fmt: skip


HEAD: list[Field] = [("", n, k, ()) for n, k in
                     (("case", "i8"), ("digest", "hex"), ("ended", "f8"))]  # fmt: skip
OWN = Layout([*HEAD, *_fields("row", ROW), *_fields("performance", PERFORMANCE)])
_known = {OWN.name: OWN}


def sealed(record: Record) -> bytes:
    """Return a record as a line of JSON."""
    return _sealed(json.dumps(record).encode())


def line_of(record: Record) -> bytes:
    """Return a record as a line: packed if it is a usual one, else JSON."""
    body = OWN.packed(record)
    return sealed(record) if body is None else _sealed(body)


def is_packed(line: bytes) -> bool:
    """Return whether a line is of numbers of a layout."""
    return line.startswith(MARK, AT)


def learn(record: Record) -> None:
    """Take in the layout that a line tells, if it is such a line."""
    try:
        layout = Layout(record[LAYOUT])
    except (KeyError, TypeError, ValueError):
        return
    _known.setdefault(layout.name, layout)


def layout_of(line: bytes) -> Layout | None:
    """Return the layout of a packed line; None of another, or where none is known."""
    name = line[AT + len(MARK) :][: len(OWN.name)]
    return _known.get(name) if is_packed(line) else None


def opened(line: bytes) -> Record | None:
    """Return the record of a line, None where it does not match its checksum."""
    seal, _, body = line.rstrip(b"\n").partition(b" ")
    if not line.endswith(b"\n") or seal != f"{zlib.crc32(body):08x}".encode():
        return None
    if body.startswith(MARK):
        layout = layout_of(line)
        return layout.opened(body) if layout else None
    try:
        record = json.loads(body)
    except (ValueError, RecursionError):  # sealed by something else than this program
        return None
    return record if isinstance(record, dict) else None
