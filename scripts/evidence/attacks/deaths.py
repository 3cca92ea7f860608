"""Kill -9 of a job, of a rank and of rank 0."""

from __future__ import annotations

import os
import signal
import time
from contextlib import suppress
from pathlib import Path

from attacks import specimens
from attacks.family import Chance, Family, Verdict, fault
from attacks.process import Child, kill_tree, tree
from attacks.specimens import PLAIN, Mode, Specimen, differs, undisturbed

MODES = {
    PLAIN: 5, specimens.EXACT: 4, specimens.SHARDS: 4, specimens.STATES: 5,
    specimens.ISOLATE: 1, specimens.RANKS: 1, specimens.RANKS_STATES: 1,
}  # fmt: skip
MOST_RUNS = 6  # until complete: a case of two crashes is computed last, alone
RANK = (b"PMI_RANK=", b"OMPI_COMM_WORLD_RANK=", b"PMIX_RANK=")
Shared = dict[Mode, tuple[Specimen, float]]


def prepare(place: Path) -> Shared:
    """Return the undisturbed campaign of each mode, and the seconds that it takes."""
    out: Shared = {}
    for mode in MODES:
        own = place / mode.name.replace(" ", "-")
        specimen, begun = undisturbed(mode, own), time.monotonic()
        for words in specimen.calls(own / "timed"):
            mode.begin(words, own).wait(2)
        out[mode] = specimen, time.monotonic() - begun
    return out


def _pid_of(child: Child, rank: int) -> int | None:
    """Return the process that is some rank, by what its launcher told it."""
    for pid in tree(child.pid):
        with suppress(OSError):
            environ = Path(f"/proc/{pid}/environ").read_bytes().split(b"\0")
            call = Path(f"/proc/{pid}/cmdline").read_bytes()
            is_rank = any(name + b"%d" % rank in environ for name in RANK)
            if b"hpcwhirl" in call and b"\0-n\0" not in call and is_rank:
                return pid
    return None


def attempt_kills(shared: Shared, chance: Chance, place: Path) -> Verdict:
    """Kill a campaign up to four times; then the same command until it is complete."""
    mode, out = chance.weighted(MODES), place / "out"
    specimen, seconds = shared[mode]
    calls, kills = specimen.calls(out), 0
    for _ in range(chance.randint(1, 4)):
        child = mode.begin(chance.choice(calls), place)
        time.sleep(chance.uniform(0.0, 1.1 * seconds))
        kills += child.alive
        victim = chance.choice([None, *range(mode.ranks)])  # None: all of the job
        pid = None if victim is None else _pid_of(child, victim)
        with suppress(ProcessLookupError):
            kill_tree(child.pid) if pid is None else os.kill(pid, signal.SIGKILL)
        child.wait()
    wrong = _completed(calls, mode, place) or differs(out, specimen.truth, place)
    struck = kills * (mode.ranks or 1)
    return Verdict(mode.name, wrong or _left_over(out, struck, mode.shards))


def _completed(calls: list[list[str]], mode: Mode, place: Path) -> str:
    """Give the same commands until they end with 0; return what went wrong."""
    last = ""
    for number in range(MOST_RUNS):
        # what was under way at two kills may have been set aside: again, please
        again = ["--retry", "failed,crashed"] if number else []
        ends = [mode.begin([*words, *again], place).wait(2) for words in calls]
        wrong = next(filter(None, (fault(ended, (0, 1, 75)) for ended in ends)), "")
        if wrong or not any(ended.code for ended in ends):
            return wrong
        last = ends[-1].last
    return f"not complete after {MOST_RUNS} runs: {last}"


def _left_over(out: Path, struck: int, shards: int) -> str:
    """Return what a complete campaign should not have in its directory.

    The state of an undecided case may stay, one for each of the processes struck: a
    longer run may go on from it. So may, where shards share a directory, files half
    written: another may be writing them, until they are old.
    """
    from hpcwhirl.scene.words import is_open
    from hpcwhirl.store.directory.journal import Journals

    halves = sorted(p.name for p in out.rglob("*.part*"))[struck * (shards > 1) :]
    ended = Journals(out).records()
    going = {record["digest"]: is_open(record.get("row", {})) for record in ended}
    kept = sorted((out / "states").glob("*.state"), key=lambda p: not going.get(p.stem))
    undecided = sum(bool(going.get(p.stem)) for p in kept)
    states = [p.name for p in kept[min(struck, undecided) :]]
    notes = sorted(p.name for p in (out / "running").glob("*") if p.stat().st_size)
    names = halves + states + notes
    return f"left over: {', '.join(names[:3])}" if names else ""


FAMILIES = {
    "kills": Family("kill -9 of a job, of a rank, of rank 0, in every mode", 150,
                    prepare, attempt_kills),
}  # fmt: skip
