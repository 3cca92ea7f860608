"""Campaigns of a few milliseconds in every mode, and the truth of each.

The truth is what an undisturbed run gave: the root variables of its results.h5.
"""

from __future__ import annotations

import pickle
from collections.abc import Sequence
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from attacks.process import PROGRAM, Child, command, fork, start

CAMPAIGN = """
scene = {{duration = {duration}}}
solver = {{time_step = 2e-6, scheme = "{scheme}"}}
output = {{interval = 1e-4, traces = "{traces}"}}
campaign = {{save_every = {save_every}}}
sweep = {{speed = {{start = 300, stop = 500, num = {speeds}}}, friction = [0.0, 0.2]}}
"""
Column = tuple[str, tuple[int, ...], bytes]  # type, shape, bytes
Table = dict[str, Column]


@dataclass(frozen=True)
class Mode:
    """A way to compute a campaign: by how many commands (shards) and ranks, and how."""

    name: str
    options: tuple[str, ...] = ()
    scheme: str = "modal"
    traces: str = "orbit"
    duration: float = 2e-3
    speeds: int = 6
    save_every: float = 600.0
    shards: int = 1
    ranks: int = 0

    def calls(self, file: Path, out: Path) -> list[list[str]]:
        """Return the words of the commands that compute it, one a shard."""
        words = ["campaign", str(file), "--out", str(out), *self.options]
        shards = [["--shard", f"{i + 1}/{self.shards}"] for i in range(self.shards)]
        return [words + shard for shard in shards] if self.shards > 1 else [words]

    def begin(self, words: Sequence[str], place: Path) -> Child:
        """Start one of its commands: a fork, or with ranks a launcher."""
        if self.ranks:
            return start([*PROGRAM, *words], place, ranks=self.ranks)
        return fork(command(words), place)


PLAIN = Mode("plain")
EXACT = Mode("exact", scheme="exact", traces="summary")
SHARDS = Mode("shards", shards=2, traces="full")
STATES = Mode("states", duration=2e-2, speeds=3, save_every=1e-3)
ISOLATE = Mode("isolate", ("--isolate",), speeds=3)
RANKS = Mode("mpirun -n 2", ranks=2, duration=2e-2, speeds=10)
RANKS_STATES = Mode("mpirun -n 3, states", ranks=3, duration=2e-2, save_every=1e-3)


@dataclass(frozen=True)
class Specimen:
    """A campaign's mode, its file, the directory of an undisturbed run, its truth."""

    mode: Mode
    file: Path
    out: Path
    truth: Table

    def calls(self, out: Path) -> list[list[str]]:
        """Return the words of the commands that compute it in a directory."""
        return self.mode.calls(self.file, out)


def table(folder: Path) -> Table:
    """Return the root variables of results.h5."""
    with h5py.File(folder / "results.h5", "r") as file:
        data = {n: d for n, d in file.items() if isinstance(d, h5py.Dataset)}
        return {n: (str(d.dtype), d.shape, d[()].tobytes()) for n, d in data.items()}


def without_maps() -> None:
    """Leave out the pictures: half a second each, and not what is attacked."""
    from hpcwhirl.report import render_process
    from hpcwhirl.report.map import maps

    render_process.draw_in_process = maps.draw_map = lambda *_, **__: []


def undisturbed(mode: Mode, place: Path, *, maps: bool = False) -> Specimen:
    """Compute a campaign in this process, so that forks find all compiled."""
    place.mkdir(parents=True, exist_ok=True)
    file, out = place / "campaign.toml", place / "out"
    file.write_text(CAMPAIGN.format(**vars(mode)))
    if not maps:
        without_maps()
    for words in mode.calls(file, out):
        quietly(words, place)
    return Specimen(mode, file, out, table(out))


def quietly(words: Sequence[str], place: Path) -> None:
    """Run a command in this process, its streams kept in a file."""
    said = (place / "quiet.txt").open("a")
    with said, redirect_stdout(said), redirect_stderr(said):
        code = command(words)()
    if code:
        msg = f"undisturbed, {' '.join(words)} ends with {code}: see {place}"
        raise RuntimeError(msg)


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


def differs(
    folder: Path, truth: Table, place: Path, beside: frozenset[str] = frozenset()
) -> str:
    """Return in what results differ from the truth, "" where they have its bits.

    beside : variables that they may have besides
    """
    rows = read_apart(folder, place)
    if isinstance(rows, str):
        return rows
    names = truth.keys() | (rows.keys() - beside)
    bad = sorted(n for n in names if truth.get(n) != rows.get(n))
    return f"results differ in {', '.join(bad[:4])}" if bad else ""


def alters(folder: Path, truth: Table, place: Path) -> tuple[str, int]:
    """Return what is published that is not true, and how many rows are not there.

    A row without a result is no lie; one that has a result must have its bits.
    """
    rows = read_apart(folder, place)
    if isinstance(rows, str):
        return rows, 0
    if "status" not in rows or rows["status"][1] != truth["status"][1]:
        return "results have another number of rows", 0
    states = np.frombuffer(rows["status"][2], "i1")
    ok = states == np.frombuffer(truth["status"][2], "i1")[0]
    missing = int((~ok).sum())
    for name, column in truth.items():
        if column[1] != ok.shape or name == "case":
            continue
        if name not in rows and ok.any():
            return f"results lack {name}", missing
        if name in rows and _rows(rows[name], ok) != _rows(column, ok):
            return f"{name} of a row is not the truth", missing
    return "", missing


def _rows(column: Column, ok: Any) -> list[bytes]:
    """Return the bytes of the rows that have a result; text without its padding."""
    _, shape, data = column
    size = len(data) // max(shape[0], 1)
    return [data[i * size : (i + 1) * size].rstrip(b"\0") for i in ok.nonzero()[0]]


def parts(out: Path) -> str:
    """Return that something half written is left over, "" where nothing is."""
    left = [p.name for p in out.rglob("*.part*")]
    return f"left over: {left[0]}" if left else ""
