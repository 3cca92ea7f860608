"""Kill -9 of a job, of a rank and of rank 0, at random moments, in every mode."""

from __future__ import annotations

import os
import random
import shlex
import signal
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

from attacks import specimens
from attacks.apart import Child, Words, command, fork, kill_tree, start, tree
from attacks.family import Verdict, fault
from attacks.specimens import Mode, Specimen, differs, pick, undisturbed
from hpcwhirl.scene.words import is_open
from hpcwhirl.store.directory.journal import scan

MODES = {
    specimens.PLAIN: 5,
    specimens.EXACT: 4,
    specimens.SHARDS: 4,
    specimens.STATES: 5,
    specimens.ISOLATE: 1,
    specimens.RANKS: 1,
    specimens.RANKS_STATES: 1,
}
MOST_KILLS = 4
MOST_RUNS = 6  # until complete: a case of two crashes is computed last, alone
RANK = (b"PMI_RANK=", b"OMPI_COMM_WORLD_RANK=", b"PMIX_RANK=")
ENOUGH = (0, 75)  # 75: stopped and resumable, e.g. by a signal of a dying launcher


def mpirun() -> list[str]:
    """Return the launcher's words."""
    return shlex.split(os.environ.get("HPCWHIRL_MPIRUN", "mpirun"))


def prepare(place: Path) -> dict[str, Any]:
    """Return the undisturbed campaign of each mode, and how long each takes."""
    out: dict[str, Any] = {}
    for mode in MODES:
        specimen = undisturbed(mode, place / mode.name.replace(" ", "-"))
        out[mode.name] = specimen
    return out


def begin(words: Words, mode: Mode, place: Path) -> Child:
    """Start a campaign: a fork, or with ranks a launcher."""
    if not mode.ranks:
        return fork(command(words), place)
    front = [*mpirun(), "-n", str(mode.ranks), sys.executable, "-m", "hpcwhirl"]
    return start([*front, *words], place)


def duration(specimen: Specimen, place: Path) -> float:
    """Return how long a campaign of a mode takes here and now, s."""
    begun = time.monotonic()
    for words in specimen.mode.calls(specimen.file, place / "timed"):
        begin(words, specimen.mode, place).wait(2)
    return time.monotonic() - begun


def pid_of(child: Child, rank: int) -> int | None:
    """Return the process that is some rank, by what its launcher told it."""
    for pid in tree(child.pid):
        with suppress(OSError):
            told = Path(f"/proc/{pid}/environ").read_bytes().split(b"\0")
            call = Path(f"/proc/{pid}/cmdline").read_bytes()
            mine = any(name + b"%d" % rank in told for name in RANK)
            if b"hpcwhirl" in call and b"\0-n\0" not in call and mine:
                return pid
    return None


def strike(child: Child, victim: int | None) -> None:
    """Kill a rank, or with None all of the job."""
    pid = pid_of(child, victim) if victim is not None else None
    if pid is None:
        kill_tree(child.pid)
        return
    with suppress(ProcessLookupError):
        os.kill(pid, signal.SIGKILL)


def killed(child: Child, mode: Mode, seconds: float, chance: random.Random) -> bool:
    """Kill a campaign at a random moment; return whether it was still at work."""
    time.sleep(chance.uniform(0.0, seconds))
    alive = child.alive
    victim = chance.choice([None, *range(mode.ranks)]) if mode.ranks else None
    strike(child, victim)
    child.wait()
    return alive


_SECONDS: dict[str, float] = {}


def attempt(shared: dict[str, Specimen], chance: random.Random, place: Path) -> Verdict:
    """Kill a campaign up to four times; then the same command until it is complete."""
    mode = pick(chance, MODES)
    specimen, out = shared[mode.name], place / "out"
    if mode.name not in _SECONDS:
        _SECONDS[mode.name] = duration(specimen, place)
    calls = mode.calls(specimen.file, out)
    kills = sum(
        killed(begin(chance.choice(calls), mode, place), mode,
               1.1 * _SECONDS[mode.name], chance)
        for _ in range(chance.randint(1, MOST_KILLS))
    )  # fmt: skip
    wrong = completed(calls, mode, place) or differs(out, specimen.truth, place)
    return Verdict(
        mode.name,
        wrong or left_over(out, kills * (mode.ranks or 1), shared=mode.shards > 1),
        weight=max(kills, 1),
    )


def completed(calls: list[list[str]], mode: Mode, place: Path) -> str:
    """Give the same commands until they end with 0; return what went wrong."""
    ended, tried = None, 0
    for tried in range(1, MOST_RUNS + 1):
        # what was under way at two kills may have been set aside: again, please
        again = ["--retry", "failed,crashed"] if tried > 1 else []
        codes = []
        for words in calls:
            ended = begin([*words, *again], mode, place).wait(2)
            wrong = fault(ended, (0, 1, 75))
            if wrong:
                return wrong
            codes.append(ended.code)
        if not any(codes):
            return ""
    return f"not complete after {tried} runs: {ended.last if ended else ''}"


def left_over(out: Path, struck: int, *, shared: bool) -> str:
    """Return what a complete campaign should not have in its directory.

    The state of an undecided case may stay, one for each of the processes struck: a
    longer run may go on from it. So may, where shards share a directory, files half
    written: another may be writing them, until they are old.
    """
    parts = sorted(p.name for p in out.rglob("*.part*"))
    parts = parts[struck:] if shared else parts
    going = scan(out, lambda record: is_open(record.get("row", {})))
    kept = sorted((out / "states").glob("*.state"), key=lambda p: not going.get(p.stem))
    open_ones = sum(bool(going.get(p.stem)) for p in kept)
    states = [p.name for p in kept[min(struck, open_ones) :]]
    running = (out / "running").glob("*")
    notes = sorted(p.name for p in running if p.stat().st_size)
    found = parts + states + notes
    return f"left over: {', '.join(found[:3])}" if found else ""
