"""Campaigns of a few milliseconds in every mode, and the truth of each.

The truth is what an undisturbed run gave: the root variables of its results.h5.
"""

from __future__ import annotations

import pickle
import random
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from attacks.apart import command, fork

CAMPAIGN = """
scene = {{duration = {duration}}}
solver = {{time_step = 2e-6{scheme}}}
output = {{interval = 1e-4, traces = "{traces}"}}
campaign = {{save_every = {save_every}}}
sweep = {{speed = {{start = 300, stop = 500, num = {speeds}}}, friction = [0.0, 0.2]}}
"""
Table = dict[str, tuple[str, tuple[int, ...], bytes]]


@dataclass(frozen=True)
class Mode:
    """A way to compute a campaign.

    Attributes
    ----------
    name : of it
    options : of the command
    shards : how many commands it takes, each a shard
    ranks : under mpirun; 0: without
    """

    name: str
    options: tuple[str, ...] = ()
    scheme: str = ""
    traces: str = "orbit"
    duration: float = 2e-3
    speeds: int = 6
    save_every: float = 600.0
    shards: int = 1
    ranks: int = 0

    @property
    def cases(self) -> int:
        """Number of cases."""
        return 2 * self.speeds

    def text(self) -> str:
        """Return the campaign's TOML."""
        scheme = f', scheme = "{self.scheme}"' if self.scheme else ""
        return CAMPAIGN.format(
            duration=self.duration,
            scheme=scheme,
            traces=self.traces,
            save_every=self.save_every,
            speeds=self.speeds,
        )

    def calls(self, file: Path, out: Path) -> list[list[str]]:
        """Return the words of the commands that compute it, one a shard."""
        words = ["campaign", str(file), "--out", str(out), *self.options]
        if self.shards == 1:
            return [words]
        return [[*words, "--shard", f"{i + 1}/{self.shards}"]
                for i in range(self.shards)]  # fmt: skip


PLAIN = Mode("plain")
EXACT = Mode("exact", scheme="exact", traces="summary")
SHARDS = Mode("shards", shards=2, traces="full")
STATES = Mode("states", duration=2e-2, speeds=3, save_every=1e-3)
ISOLATE = Mode("isolate", ("--isolate",), speeds=3)
RANKS = Mode("mpirun -n 2", ranks=2, duration=2e-2, speeds=10)
RANKS_STATES = Mode("mpirun -n 3, states", ranks=3, duration=2e-2, save_every=1e-3)


@dataclass(frozen=True)
class Specimen:
    """A campaign's file and its truth.

    Attributes
    ----------
    mode : of it
    file : TOML
    out : directory of the undisturbed run
    truth : root variables of its results
    """

    mode: Mode
    file: Path
    out: Path
    truth: Table


def table(folder: Path) -> Table:
    """Return {name: (type, shape, bytes)} of the root variables of results.h5."""
    import h5py

    with h5py.File(folder / "results.h5", "r") as file:
        found = {n: d for n, d in file.items() if isinstance(d, h5py.Dataset)}
        return {n: (str(d.dtype), d.shape, d[()].tobytes()) for n, d in found.items()}


def without_maps() -> None:
    """Leave out the pictures: half a second each, and not what is attacked."""
    from hpcwhirl.report import maps

    maps.draw_map = lambda *_, **__: []


def undisturbed(mode: Mode, place: Path, *, maps: bool = False) -> Specimen:
    """Compute a campaign in this process, so that forks find all compiled."""
    place.mkdir(parents=True, exist_ok=True)
    file, out = place / "campaign.toml", place / "out"
    file.write_text(mode.text())
    if not maps:
        without_maps()
    for words in Mode.calls(mode, file, out):
        code = quietly(words, place)
        if code:
            msg = f"an undisturbed campaign ({mode.name}) ends with {code}: see {place}"
            raise RuntimeError(msg)
    return Specimen(mode, file, out, table(out))


def quietly(words: Sequence[str], place: Path) -> int:
    """Run a command in this process, its streams kept in files."""
    from contextlib import redirect_stderr, redirect_stdout

    with (
        (place / "truth.out").open("a") as out,
        (place / "truth.err").open("a") as err,
        redirect_stdout(out),
        redirect_stderr(err),
    ):
        before, sys.argv = sys.argv, ["hpcwhirl", *words]
        try:
            return command(words)()
        finally:
            sys.argv = before


def read_apart(folder: Path, place: Path) -> Table | str:
    """Return `table` read by a fork, or why not: a damaged file may do anything."""
    answer = place / "table.pickle"

    def action() -> int:
        answer.write_bytes(pickle.dumps(table(folder)))
        return 0

    ended = fork(action, place, "table").wait()
    if ended.code:
        return f"results.h5 cannot be read: {ended.last}"
    return dict(pickle.loads(answer.read_bytes()))


def differs(folder: Path, truth: Table, place: Path) -> str:
    """Return in what results differ from the truth, "" where they have its bits."""
    found = read_apart(folder, place)
    if isinstance(found, str):
        return found
    names = sorted(n for n in truth.keys() | found.keys()
                   if truth.get(n) != found.get(n))  # fmt: skip
    return f"results differ in {', '.join(names[:4])}" if names else ""


def alters(folder: Path, truth: Table, place: Path) -> tuple[str, int]:
    """Return what is published that is not true, and how many rows are not there.

    A row without a result is no lie; one that has a result must have its bits.
    """
    import numpy as np

    found = read_apart(folder, place)
    if isinstance(found, str):
        return found, 0
    if "status" not in found or found["status"][1] != truth["status"][1]:
        return "results have another number of rows", 0
    count = truth["status"][1][0]
    states = np.frombuffer(found["status"][2], "i1")
    ok = states == np.frombuffer(truth["status"][2], "i1")[0]
    for name, (kind, shape, data) in truth.items():
        if shape[:1] != (count,) or name == "case":
            continue
        if name not in found:
            if ok.any() and len(shape) == 1:
                return f"results lack {name}", int((~ok).sum())
            continue
        if len(shape) == 1 and _rows(found[name], ok) != _rows((kind, shape, data), ok):
            return f"{name} of a row is not the truth", int((~ok).sum())
    return "", int((~ok).sum())


def _rows(column: tuple[str, tuple[int, ...], bytes], ok: Any) -> list[bytes]:
    """Return the bytes of the rows that have a result; text without its padding."""
    _, shape, data = column
    size = len(data) // max(shape[0], 1)
    return [data[i * size : (i + 1) * size].rstrip(b"\0") for i in ok.nonzero()[0]]


def pick(chance: random.Random, weights: dict[Any, float]) -> Any:
    """Return one of the keys, by their weights."""
    return chance.choices(list(weights), list(weights.values()))[0]
