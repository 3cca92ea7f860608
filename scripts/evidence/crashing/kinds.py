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
GRID = """
scene = {duration = 2e-3}
solver = {time_step = 4e-6}
output = {interval = 1e-4}
"""
TWO = "sweep = {speed = [300, 410]}\n"
LONGER = "sweep = {speed = [300, 350, 410, 430]}\n"
DENSE = """
scene = {duration = 0.01}
output = {interval = 1e-3, traces = "summary"}
[sweep]
speed = {start = 40, stop = 520, num = 4}
gap = [8e-5, 4e-4]
[refine]
over = ["speed", "gap"]
levels = 1
scale = {gap = "log"}
words = "both"
first = "draft"
"""
TWINS = """
[twins]
count = 2
spread = {force = 0.1}
"""
OPEN = """
scene = {duration = 0.05, speed = 330.0}
solver = {time_step = 8e-6}
output = {interval = 1e-3, traces = "summary"}
"""


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
    words: Words = ("campaign", "{file}", "--report=no", "--out", "{out}")
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


CAMPAIGN = Kind.words
FIRST = ((GRID + TWO, CAMPAIGN),)
DAMPED = "mostly_damped"
LEGS = ("--extend", "undecided", "--to", "0.1")


def kinds() -> dict[str, Kind]:
    """Return {name: kind}."""
    found = [
        Kind("sweep", GRID + 'sweep = {speed = [300, 410], friction = [0.0, 0.2]}\n',
             every=1, under_mpirun=True),
        Kind("zip", GRID + "zip = {speed = [300, 410, 420], gap = [2e-4, 3e-4, 4e-4]}"),
        Kind("list", GRID + "[[cases]]\nspeed = 300\n[[cases]]\nspeed = 410\n"
             "gap = 2e-4\n"),
        Kind("sampled", GRID + '[sample]\ncount = 1\nmethod = "saltelli"\n'
             'gap = {distribution = "uniform", low = 1e-4, high = 3e-4}\n'
             'force = {distribution = "uniform", low = 7e4, high = 8e4}\n'),
        Kind("refined", DENSE, engine=DAMPED, under_mpirun=True),
        Kind("refined, confirmed", DENSE + 'confirm = "standard"\n', engine=DAMPED),
        Kind("refined, twins of boundaries", DENSE + TWINS + 'of = "boundary"\n',
             engine=DAMPED),
        Kind("refined, twins of speckle", DENSE + TWINS + 'of = "speckle"\n',
             engine=DAMPED),
        Kind("twins", OPEN + "sweep = {speed = [250, 330, 400]}\n" + TWINS
             + 'of = "boundary"\n', engine=DAMPED),
        Kind("decided", OPEN.replace("8e-6", '8e-6, until = "decided", longest = 0.3')
             + "sweep = {speed = [330, 400]}\n", engine=DAMPED),
        Kind("extended", OPEN + "sweep = {speed = [330, 400]}\n",
             words=(*CAMPAIGN, *LEGS), engine=DAMPED,
             before=((OPEN + "sweep = {speed = [330, 400]}\n", CAMPAIGN),)),
        Kind("measure", GRID + TWO, words=("measure", "{file}", "{out}")),
        Kind("states", GRID.replace("2e-3", "1e-2") + TWO + "[campaign]\n"
             "save_every = 1e-9\nkeep_states = true\n", slices=512),
        Kind("isolated", GRID + TWO, words=(*CAMPAIGN, "--isolate"), every=64, ranks=1),
        Kind("longer list", GRID + LONGER, before=FIRST,
             beyond=GRID + LONGER.replace("430", "430, 440")),
        Kind("fresh", GRID + TWO, every=4, words=(*CAMPAIGN, "--fresh"), before=FIRST),
        Kind("gather", GRID + TWO, every=1, words=("gather", "{out}"), before=FIRST),
        Kind("classify", GRID + TWO, before=FIRST, ranks=1, every=1,
             words=("classify", "{out}", "--set", "significance=2")),
        Kind("map", GRID + TWO, words=("map", "{out}"), before=FIRST, ranks=1, every=1,
             made=("map.png", "map.svg")),
        Kind("report", GRID + TWO, words=("report", "{out}"), before=FIRST, ranks=1,
             every=1, made=("report.html",)),
    ]  # fmt: skip
    return {kind.name: kind for kind in found}


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
