"""How a journal stores records: a binary slot of fixed size each, and optional text.

A record says how one computation ended. A journal is a header, written twice, and slots
of equal size. The header lists the fields of the records (table, name, kind and words
of each), the identity of the plan to which case numbers refer, and the file of the
traces. Each copy of the header is a magic number, the length and CRC-32 of its JSON,
and that JSON. So a program with other fields or words reads the journal correctly, and
damage to one copy costs nothing.

A slot is a tag (the CRC-32 of the header's JSON), the CRC-32 of the rest, two numbers
and a body. The body of a record has one bit for each field, set if the record has a
value for it, and the values, little-endian. Entries without a field are JSON text in
the slots that follow. The first number is the length of that text, or -k in the k-th of
the text's slots, where the second number is the CRC-32 of the record. After damage, the
next slot is found by its tag and CRC, wherever it begins.

Other files of the directory hold lines of JSON with a CRC-32 (`sealed`), and arrays as
raw bytes (`packed`).
"""

from __future__ import annotations

import json
import math
import struct
import zlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.scene.quantities import BLADES, PERFORMANCE, ROW
from hpcwhirl.scene.schemes import SCHEMES
from hpcwhirl.scene.units import Quantity
from hpcwhirl.scene.words import ENUMS

Record = dict[str, Any]
Field = tuple[str, str, str, Sequence[str]]  # table, name, kind, words
MAGIC = b"\x93hpcwhirl\n"
COPY = struct.Struct(f"<{len(MAGIC)}sII")  # in front of each copy of a header
FRAME = np.dtype(
    [("tag", "V4"), ("crc", "<u4"), ("text", "<i4"), ("after", "<u4")]
)  # of each slot
TAG = 4  # bytes
CHECKED = 8  # first byte of a slot that its CRC covers
NUMBERS = struct.Struct("<iI")
HEX, TEXT = 32, 64  # bytes of a digest, and of a text
NOTHING: Record = {}
MALFORMED = (KeyError, TypeError, ValueError, RecursionError)
TYPE = "<f8"


class Layout:
    """The fields of a journal's records, and where a record's slot stores each of them.

    Parameters
    ----------
    fields : (table of the record or "", name, kind, words of the kind `word`) of each
        field, in order
    """

    def __init__(self, fields: Sequence[Field]) -> None:
        self.fields = [(t, n, kind, tuple(words)) for t, n, kind, words in fields]
        names = [named(table, name) for table, name, _, _ in self.fields]
        self.place = {name: place for place, name in enumerate(names)}
        self._kinds = [_kind(kind, words) for _, _, kind, words in self.fields]
        bits = -(-len(names) // 8)
        own = [(n, kind.dtype) for n, kind in zip(names, self._kinds, strict=True)]
        self.dtype = np.dtype([*FRAME.descr, ("has", "u1", (bits,)), *own])
        self.size = self.dtype.itemsize
        codes = "".join(kind.code for kind in self._kinds)
        usual = {"f8": float}  # type that is written as it is
        self._writes = [
            (1 << place, table, name, kind, usual.get(stored))
            for place, ((table, name, stored, _), kind)
            in enumerate(zip(self.fields, self._kinds, strict=True))
        ]  # fmt: skip
        # {table: {name: bit of the field}}, "" for fields without a table; all together
        self._bits: dict[str, dict[str, int]] = {"": {}}
        for bit, table, name, *_ in self._writes:
            self._bits.setdefault(table, {})[name] = bit
        self._all = {table: sum(own.values()) for table, own in self._bits.items()}
        self._body = struct.Struct(f"<{bits}s{codes}")

    def __reduce__(self) -> tuple[type[Layout], tuple[Sequence[Field]]]:
        """Return how to pickle the layout: by its fields, without struct objects."""
        return Layout, (self.fields,)

    @property
    def kinds(self) -> dict[str, str]:
        """{`TABLE.NAME`: kind} of all fields, such as "f8" or "word"."""
        return {named(t, n): kind for t, n, kind, _ in self.fields}

    @cached_property
    def words(self) -> dict[str, Sequence[str]]:
        """{`TABLE.NAME`: words that it may have} of all fields of kind `word`."""
        return {named(t, n): w for t, n, kind, w in self.fields if kind == "word"}

    @property
    def room(self) -> int:
        """Number of bytes of a record's text that one slot can hold."""
        return self.size - FRAME.itemsize

    def slots_of(self, text: int) -> int:
        """Return the number of slots that a text of `text` bytes needs."""
        return -(-text // self.room)

    def encode(self, record: Record, tag: bytes) -> bytes:
        """Return the bytes that store a record in a journal: its slot, slots of text.

        Parameters
        ----------
        record : the record
        tag : first bytes of each slot of this journal
        """
        own = {table: record.get(table, NOTHING) for table in self._bits} | {"": record}
        values, has = [], 0
        for bit, table, name, kind, usual in self._writes:
            try:
                value = own[table][name]
                if usual is None or not isinstance(value, usual):
                    value = kind.write(value)
            except (KeyError, TypeError, ValueError, OverflowError):
                values.append(kind.empty)
                continue
            values.append(value)
            has |= bit
        bits = has.to_bytes(self.dtype["has"].itemsize, "little")
        text = _text_of(self._left(record, has))
        first = _slot(tag, len(text), 0, self._body.pack(bits, *values))
        crc = int.from_bytes(first[TAG:CHECKED], "little")
        parts = (text[i : i + self.room] for i in range(0, len(text), self.room))
        more = (_slot(tag, -number, crc, part.ljust(self.room, b"\0"))
                for number, part in enumerate(parts, 1))  # fmt: skip
        return first + b"".join(more)

    def _left(self, record: Record, has: int) -> Record:
        """Return those entries of a record that its slot does not hold.

        has : bit by bit, whether the slot holds each field
        """
        left: Record = {}
        for name, value in record.items():
            own = self._bits.get(name) if isinstance(value, dict) else None
            if own is None:
                if not has & self._bits[""].get(name, 0):
                    left[name] = value
            elif (has & self._all[name]).bit_count() < len(value) or not value:
                left[name] = {n: v for n, v in value.items() if not has & own.get(n, 0)}
        return left

    def decode(self, slot: bytes, text: Record) -> Record:
        """Return the record that a journal stores in a slot and in text.

        Parameters
        ----------
        slot : bytes of the slot
        text : entries that the record holds as text
        """
        bits, *values = self._body.unpack_from(slot, FRAME.itemsize)
        has, record = int.from_bytes(bits, "little"), Record(message="")
        for place, (table, name, _, _) in enumerate(self.fields):
            if has >> place & 1:
                part = record.setdefault(table, {}) if table else record
                part[name] = self._kinds[place].read(values[place])
        for name, value in text.items():
            both = isinstance(value, dict) and isinstance(record.get(name), dict)
            record[name] = record[name] | value if both else value
        return record


class Header(NamedTuple):
    """Header of a journal, which says how its records are stored.

    Attributes
    ----------
    layout : fields of the records
    tag : first bytes of each slot of this journal
    plan : identity of the plan to which case numbers refer; "": unknown
    traces : name of the file with the traces
    """

    layout: Layout
    tag: bytes
    plan: str
    traces: str

    def record(self, slot: bytes, text: Record) -> Record:
        """Return the record stored in a slot and text, with its trace file's name.

        Parameters
        ----------
        slot : bytes of the slot
        text : entries that the record holds as text
        """
        found = self.layout.decode(slot, text)
        if isinstance(found.get("traces"), dict):
            found["traces"]["file"] = self.traces
        return found


def header_of(plan: str, traces: str, fields: Sequence[Field]) -> tuple[Header, bytes]:
    """Return the header of a new journal, and the bytes that the journal begins with.

    Parameters
    ----------
    plan : identity of the plan to which case numbers refer; "": unknown
    traces : name of the file with the traces
    fields : fields of the records, see `Layout`
    """
    body = json.dumps({"plan": plan, "traces": traces, "fields": fields}).encode()
    copy = COPY.pack(MAGIC, len(body), zlib.crc32(body)) + body
    return _header(body), 2 * copy


def read_header(data: bytes) -> tuple[Header, int] | None:
    """Return the first undamaged header at the start of a journal, and where it ends.

    None if there is no undamaged header.

    data : first bytes of the journal
    """
    place = -1
    while (place := data.find(MAGIC, place + 1)) >= 0:
        begin = place + COPY.size
        if begin > len(data):
            break
        _, size, crc = COPY.unpack_from(data, place)
        body = data[begin : begin + size]
        if len(body) == size and zlib.crc32(body) == crc:
            try:
                return _header(body), begin + size
            except MALFORMED:  # not written by this program
                continue
    return None


def _header(body: bytes) -> Header:
    told = json.loads(body)
    tag = zlib.crc32(body).to_bytes(TAG, "little")
    return Header(_layout(json.dumps(told["fields"])), tag, str(told["plan"]),
                  str(told["traces"]))  # fmt: skip


@lru_cache(maxsize=64)
def _layout(fields: str) -> Layout:
    """Return the layout that a header's list of fields describes, cached.

    fields : the list as JSON text
    """
    layout, own = Layout(json.loads(fields)), Layout(fields_of())
    if any(layout.kinds.get(name, kind) != kind for name, kind in own.kinds.items()):
        raise ValueError("fields of other kinds")
    return layout


def fields_of(measured: Iterable[str] = ()) -> list[Field]:
    """Return the fields that every record of a campaign may have, see `Layout`.

    measured : names of the variables that the user's own function returns
    """
    head = (("case", "i8"), ("digest", "hex"), ("of", "hex"), ("twin", "i8"),
            ("longest", "f8"), ("ended", "f8"))  # fmt: skip
    block = [("traces", name, "i8", ()) for name in ("offset", "bytes", "crc")]
    own = [("measured", name, "f8", ()) for name in measured]
    return [
        *(("", name, kind, ()) for name, kind in head),
        ("", "status", "word", ENUMS["status"]),
        *_fields("row", ROW | BLADES),
        *_fields("performance", PERFORMANCE),
        *block,
        *own,
    ]


def _fields(table: str, quantities: dict[str, Quantity]) -> list[Field]:
    """Return the fields (table, name, kind, words) of one table of a record.

    Parameters
    ----------
    table : name of the table
    quantities : {name: quantity} of its entries
    """
    kinds = {"enum": "word", "S16": "word", "S64": "text"}
    words = {**ENUMS, "scheme": tuple(SCHEMES)}
    return [(table, name, kinds.get(quantity.kind, quantity.kind), words.get(name, ()))
            for name, quantity in quantities.items()]  # fmt: skip


def named(table: str, name: str) -> str:
    """Return the full name of a record's field: ``TABLE.NAME``, or ``NAME`` alone."""
    return f"{table}.{name}" if table else name


def _slot(tag: bytes, text: int, after: int, body: bytes) -> bytes:
    rest = NUMBERS.pack(text, after) + body
    return tag + zlib.crc32(rest).to_bytes(4, "little") + rest


def _text_of(left: Record) -> bytes:
    """Return the JSON text of those entries of a record that have no binary field.

    b"" if there are none.

    left : these entries; an empty message is removed
    """
    if not left.get("message", " "):
        del left["message"]
    return json.dumps(left).encode() if left else b""


def _float(value: Any) -> float:
    if not isinstance(value, float):
        raise TypeError
    return value


def _whole(value: Any) -> int:
    if type(value) is not int or value >> 63 not in (0, -1):
        raise TypeError
    return value


def _of_hex(value: str) -> bytes:
    found = bytes.fromhex(value)
    if found.hex() != value or len(found) != HEX:
        raise ValueError
    return found


def _of_text(value: str) -> bytes:
    found = value.encode()
    if len(found) > TEXT or b"\0" in found:
        raise ValueError
    return found


def _text(value: bytes) -> str:
    return value.rstrip(b"\0").decode(errors="replace")


class _Kind(NamedTuple):
    """How a slot stores values of one kind, such as float64 or a word.

    Attributes
    ----------
    dtype, code : NumPy's dtype, and the code of `struct`
    empty : what is stored for a record without a value
    write, read : functions from a value to the stored one, and back; `write` raises for
        a value that cannot be stored
    """

    dtype: str
    code: str
    empty: Any
    write: Callable[[Any], Any]
    read: Callable[[Any], Any]


KINDS = {
    "f8": _Kind("<f8", "d", 0.0, _float, float),
    "i8": _Kind("<i8", "q", 0, _whole, int),
    "hex": _Kind(f"V{HEX}", f"{HEX}s", b"", _of_hex, bytes.hex),
    "text": _Kind(f"S{TEXT}", f"{TEXT}s", b"", _of_text, _text),
}


def _kind(name: str, words: Sequence[str]) -> _Kind:
    """Return how a slot stores values of a kind.

    Parameters
    ----------
    name : name of the kind
    words : for the kind `word`, its words; a value is stored as its index in them
    """
    if name != "word":
        return KINDS[name]
    places = {word: place for place, word in enumerate(words)}
    return _Kind("u1", "B", 0, places.__getitem__, words.__getitem__)


def packed(arrays: Mapping[str, NDArray[np.float64]]) -> tuple[dict[str, Any], bytes]:
    """Return arrays as raw bytes, and a header by which `unpacked` restores them.

    Parameters
    ----------
    arrays : {name: array of any shape}; the order is kept

    Returns
    -------
    header, {"bytes": size, "crc": CRC-32, "shapes": shape of each array}; and the bytes
    """
    data = b"".join(np.asarray(a, dtype=TYPE).tobytes() for a in arrays.values())
    shapes = {name: list(array.shape) for name, array in arrays.items()}
    return {"bytes": len(data), "crc": zlib.crc32(data), "shapes": shapes}, data


def unpacked(
    head: Mapping[str, Any], data: bytes
) -> dict[str, NDArray[np.float64]] | None:
    """Return {name: read-only array} from the bytes of `packed`; None if damaged.

    head, data : header and bytes that `packed` returned
    """
    if len(data) != head["bytes"] or zlib.crc32(data) != head["crc"]:
        return None
    out: dict[str, NDArray[np.float64]] = {}
    start = 0
    for name, shape in head["shapes"].items():
        values = np.frombuffer(data, TYPE, math.prod(shape), start)
        out[name] = values.reshape(shape)
        start += values.nbytes
    return out


def sealed(record: Record) -> bytes:
    """Return a JSON object as one line of text that begins with its CRC-32."""
    body = json.dumps(record).encode()
    return f"{zlib.crc32(body):08x} ".encode() + body + b"\n"


def opened(line: bytes) -> Record | None:
    """Return the JSON object in a line from `sealed`; None if its CRC-32 is wrong."""
    seal, _, body = line.rstrip(b"\n").partition(b" ")
    if not line.endswith(b"\n") or seal != f"{zlib.crc32(body):08x}".encode():
        return None
    try:
        record = json.loads(body)
    except (ValueError, RecursionError):  # not written by this program
        return None
    return record if isinstance(record, dict) else None
