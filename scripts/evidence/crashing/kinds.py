"""Small campaigns of every kind, and what is done with them."""

from __future__ import annotations

import sys
import tomllib
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomli_w
from common import on_engine

Words = Sequence[str]
TABLE = Path(__file__).with_suffix(".toml")
CAMPAIGN = ("campaign", "{file}", "--report=no", "--out", "{out}")


@dataclass(frozen=True)
class Kind:
    """A way to use a campaign's directory.

    Attributes
    ----------
    name : of it
    text : the campaign's TOML
    words : of the command that is recorded, {file} and {out} in their place
    before : commands that have been given before, as (TOML, words)
    engine : a named one, the default otherwise
    slices : steps of every slice of a march; 0: as the clock has it
    made : files beside the results that the command makes
    ranks : how many may share it
    beyond : the TOML by which another goes on that has taken over, a longer plan
    every : one of so many states that a machine's death leaves is gone on from
    under_mpirun : whether mpirun's own ranks go on, too, now and then
    """

    name: str
    text: str
    words: Words = CAMPAIGN
    before: tuple[tuple[str, Words], ...] = ()
    engine: str = ""
    slices: int = 0
    made: tuple[str, ...] = ()
    ranks: int = 3
    beyond: str = ""
    every: int = 8
    under_mpirun: bool = False

    def call(self, place: Path, number: int | None = None) -> list[str]:
        """Return the words of the command, or of one before; its file is written."""
        text, words = self.before[number] if number is not None else (self.text, None)
        file = place / f"c{zlib.crc32(text.encode())}.toml"
        if not file.exists():
            tables = tomllib.loads(text)
            own = on_engine(self.engine, tables) if self.engine else tables
            file.write_text(tomli_w.dumps(own))
        out = place / "w" / "out"
        return [w.format(file=file, out=out) for w in words or self.words]


def kinds() -> dict[str, Kind]:
    """Return {name: kind} of the table."""
    told = tomllib.loads(TABLE.read_text("utf-8"))

    def text(parts: list[str]) -> str:
        return "".join(told["texts"].get(part, part) for part in parts)

    out = {}
    for row in told["kinds"]:
        for name in ("text", "beyond"):
            row[name] = text(row.get(name, []))
        row["before"] = tuple((text(one["text"]), one.get("words", CAMPAIGN))
                              for one in row.get("before", []))  # fmt: skip
        out[row["name"]] = Kind(**row)
    return out


def widest(case: Any) -> Mapping[str, float]:
    """Return what the kind `measure` measures."""
    return {"widest": float(abs(case.centre).max())}


def command(words: Words, comm: Any) -> Callable[[], int]:
    """Return the call of `hpcwhirl WORDS`, or of `hpcwhirl.campaign`, on some ranks."""

    def call() -> int:
        if words[0] == "measure":
            return _measured(words, comm)
        from hpcwhirl.cli import main

        sys.argv = ["hpcwhirl", *words]
        return main(list(words))

    return call


def _measured(words: Words, comm: Any) -> int:
    import hpcwhirl

    _, file, out = words
    units = {"widest": "m"}
    hpcwhirl.campaign(file, out, measure=widest, variables=units, comm=comm).close()
    return 0
