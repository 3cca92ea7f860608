"""What a search has computed: a file that only grows, a checked line an engine.

The first line says what the lines are of; a search whose screening or box is another
does not go on in it. A line ends with the CRC-32 of what is before. A kill leaves at
most a last line without its end, which is cut off; any other line that does not check
is refused by its number, since a search that goes on must ask the same questions.
"""

from __future__ import annotations

import json
import os
import zlib
from pathlib import Path
from typing import Any

from identify.score import Row
from identify.space import UNKNOWNS, Engine

Values = tuple[float, ...]


class NotKept(SystemExit):
    """What is wrong with a file, in one line."""

    def __init__(self, path: Path, wrong: str) -> None:
        super().__init__(f"identify: {path}: {wrong}")


def key_of(engine: Engine) -> Values:
    """Return the values of an engine in the order of the unknowns."""
    return tuple(float(engine[name]) for name in UNKNOWNS)


def engine_of(key: Values) -> Engine:
    """Return the engine of such values."""
    return dict(zip(UNKNOWNS, key, strict=True))


def line_of(record: Any) -> str:
    """Return a line, its checksum last."""
    text = json.dumps(record, separators=(",", ":"))
    return f"{text} {zlib.crc32(text.encode()):08x}\n"


def record_of(path: Path, number: int, line: bytes) -> Any:
    """Return what a line holds, or refuse it by its number."""
    text, _, told_sum = line.rpartition(b" ")
    found = f"{zlib.crc32(text):08x}"
    if told_sum != found.encode():
        got = told_sum[:8].decode("ascii", "replace")
        told = f"line {number} has checksum {got!r}, its text {found!r}: cut it "
        raise NotKept(path, told + "and what follows it off, and the search goes on")
    return json.loads(text)


class Kept:
    """Engines and their rows, in the order they were computed.

    Parameters
    ----------
    path : of the file; made where there is none
    about : what its lines depend on; equal, or the file is refused
    """

    def __init__(self, path: Path, about: Any) -> None:
        self.path, self.rows = path, dict[Values, list[Row]]()
        self.seconds = 0.0  # of processor time, of all engines
        if path.exists():
            self._read(json.loads(json.dumps(about)))
        else:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._write({"about": about})

    def add(self, engine: Engine, rows: list[Row], seconds: float) -> None:
        """Keep an engine's rows, computed in so many seconds of processor time."""
        key = key_of(engine)
        self._write({"engine": key, "seconds": round(seconds, 4), "rows": rows})
        self._take(key, rows, seconds)

    def _take(self, key: Values, rows: list[Row], seconds: float) -> None:
        self.rows[key] = rows
        self.seconds += seconds

    def _write(self, record: Any) -> None:
        with self.path.open("a") as file:
            file.write(line_of(record))

    def _read(self, about: Any) -> None:
        given = self.path.read_bytes()
        whole = given[: given.rfind(b"\n") + 1]
        records = [
            record_of(self.path, number, line)
            for number, line in enumerate(whole.splitlines(), 1)
        ]
        if records and records[0].get("about") != about:
            raise NotKept(
                self.path, "begun with another box, screening or physics version; "
                "take another --out",
            )  # fmt: skip
        if whole != given:  # a kill while a line was written
            os.truncate(self.path, len(whole))
        if not records:
            self._write({"about": about})
        for record in records[1:]:
            self._take(tuple(record["engine"]), record["rows"], record["seconds"])
