"""Kill -9 of a job, of a rank and of rank 0, and signals from the first millisecond."""

from __future__ import annotations

import math
import os
import shutil
import signal
import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from attacks import specimens
from attacks.family import Chance, Family, Verdict, fault
from attacks.process import PROGRAM, Child, kill_tree, start, tree
from attacks.specimens import PLAIN, Mode, Specimen, differs, parts, undisturbed

MODES = {
    PLAIN: 5,
    specimens.EXACT: 4,
    specimens.SHARDS: 4,
    specimens.STATES: 5,
    specimens.ISOLATE: 1,
    specimens.RANKS: 1,
    specimens.RANKS_STATES: 1,
}
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


def _strike(child: Child, victim: int | None) -> None:
    """Kill a rank, or with None all of the job."""
    pid = _pid_of(child, victim) if victim is not None else None
    if pid is None:
        kill_tree(child.pid)
        return
    with suppress(ProcessLookupError):
        os.kill(pid, signal.SIGKILL)


def attempt_kills(shared: Shared, chance: Chance, place: Path) -> Verdict:
    """Kill a campaign up to four times; then the same command until it is complete."""
    mode, out = chance.weighted(MODES), place / "out"
    specimen, seconds = shared[mode]
    calls, kills = specimen.calls(out), 0
    for _ in range(chance.randint(1, 4)):
        child = mode.begin(chance.choice(calls), place)
        time.sleep(chance.uniform(0.0, 1.1 * seconds))
        kills += child.alive
        _strike(child, chance.choice([None, *range(mode.ranks)]))
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
        codes = []
        for words in calls:
            ended = mode.begin([*words, *again], place).wait(2)
            wrong = fault(ended, (0, 1, 75))
            if wrong:
                return wrong
            codes.append(ended.code)
            last = ended.last
        if not any(codes):
            return ""
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
    notes = [p.name for p in (out / "running").glob("*") if p.stat().st_size]
    names = halves + states + sorted(notes)
    return f"left over: {', '.join(names[:3])}" if names else ""


# Signals

SIGNALS = (signal.SIGUSR1, signal.SIGTERM, signal.SIGINT)
HEAVY = ("numpy", "pydantic", "h5py", "mpi4py", "llvmlite", "scipy")
FIRST, LAST = 1e-3, 2.0  # s after the start


def prepare_signals(place: Path) -> Specimen:
    """Compute a campaign undisturbed, so that all is compiled."""
    return undisturbed(replace(PLAIN, duration=0.2, speeds=10), place)


def attempt_signals(shared: Specimen, chance: Chance, place: Path) -> Verdict:
    """Start a campaign, send it a signal early; now and then, complete it.

    From the moment when the program's own code runs, a signal ends it with 75 and it
    comes again. Before, the interpreter itself is starting, has no handler, and dies of
    the signal: nothing of the campaign was begun, and a job script that has passed a
    signal on treats that end as it treats 75. What tells the two apart does not depend
    on time: the process is halted, and what it has mapped is looked at. Once a heavy
    library is there, handlers must have been first.
    """
    number, ranks = chance.choice(SIGNALS), chance.choice([0] * 9 + [2])
    after = math.exp(chance.uniform(math.log(FIRST), math.log(LAST)))
    script, out = shutil.which("hpcwhirl"), place / "out"
    front = [script] if script and chance.random() < 0.3 else PROGRAM
    (words,) = shared.calls(out)
    child = start([*front, *words], place, ranks=ranks)
    time.sleep(after)
    if not ranks:
        _halt(child)
    early = not any(map(_heavy, tree(child.pid)))
    child.signal(number)
    child.signal(signal.SIGCONT)
    ended = child.wait()
    what = f"{number.name}{' to mpirun' if ranks else ''}: {1e3 * after:.0f} ms"
    if early and _died(ended.code, number, ranks):
        return Verdict(f"{what} (interpreter starting)", parts(out))
    wrong = fault(ended, (0, 75))
    if not wrong and chance.random() < 0.2:
        again = start([*PROGRAM, *words], place).wait(2)
        wrong = fault(again, (0,)) or differs(out, shared.truth, place)
    return Verdict(what, wrong)


def _died(code: int, number: int, ranks: int) -> bool:
    """Return whether a code is that of a process, or launcher, that died of a signal.

    Launchers have codes of their own for ranks that died; job scripts take all but
    these four for 75 once they have passed a signal on.
    """
    interrupted = number == signal.SIGINT
    # 1: KeyboardInterrupt in site.py, which MPICH passes on; 2: SIGINT's own number
    if ranks:
        return code not in (0, 70, *(() if interrupted else (1, 2)))
    return code in (-number, 128 + number, *((1,) if interrupted else ()))


def _halt(child: Child) -> None:
    child.signal(signal.SIGSTOP)
    state = Path(f"/proc/{child.pid}/stat")
    for _ in range(1000):
        with suppress(OSError, IndexError):
            if state.read_text().rpartition(")")[2].split()[0] in "TZX":
                return
        time.sleep(1e-3)


def _heavy(pid: int) -> bool:
    """Return whether a process has a library that the program imports."""
    try:
        maps = Path(f"/proc/{pid}/maps").read_text()
    except OSError:
        return False
    return any(f"/{name}" in maps for name in HEAVY)


FAMILIES = {
    "kills": Family("kill -9 of a job, of a rank, of rank 0, in every mode", 150,
                    prepare, attempt_kills),
    "signals": Family("signals from the first millisecond", 200, prepare_signals,
                      attempt_signals),
}  # fmt: skip
