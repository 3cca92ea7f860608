"""USR1, TERM and INT from the first millisecond of a process on.

From the moment when the program's own code runs, a signal ends it with 75 and it comes
again. Before, the interpreter itself is starting, has no handler, and dies of the
signal: nothing of the campaign was begun, and a job script that has passed a signal on
treats that end as it treats 75. What tells the two apart does not depend on time: the
process is halted, and what it has mapped is looked at. Once a heavy library (numpy,
pydantic, h5py, MPI, numba) is there, handlers must have been first.
"""

from __future__ import annotations

import math
import random
import shutil
import signal
import sys
import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from attacks import specimens
from attacks.apart import Child, start, tree
from attacks.family import Verdict, fault
from attacks.kills import mpirun
from attacks.specimens import Specimen, differs, undisturbed

SIGNALS = (signal.SIGUSR1, signal.SIGTERM, signal.SIGINT)
HEAVY = ("numpy", "pydantic", "h5py", "mpi4py", "llvmlite", "scipy")
FIRST, LAST = 1e-3, 2.0  # s after the start


def prepare(place: Path) -> Specimen:
    """Compute a campaign undisturbed, so that all is compiled."""
    return undisturbed(replace(specimens.PLAIN, duration=0.2, speeds=10), place)


def attempt(shared: Specimen, chance: random.Random, place: Path) -> Verdict:
    """Start a campaign, send it a signal early, then complete it."""
    number = chance.choice(SIGNALS)
    after = math.exp(chance.uniform(math.log(FIRST), math.log(LAST)))
    ranks = chance.choice([0] * 9 + [2])
    (words,) = shared.mode.calls(shared.file, place / "out")
    front = [*mpirun(), "-n", str(ranks)] if ranks else []
    child = start([*front, *_program(chance), *words], place)
    time.sleep(after)
    early = _launching(child) if ranks else _halted(child)
    with suppress(ProcessLookupError):
        child.signal(number)
        child.signal(signal.SIGCONT)
    ended = child.wait()
    what = f"{number.name}{' to mpirun' if ranks else ''}: "
    what += f"after {1e3 * after:.0f} ms"
    if early and _died(ended.code, number, ranks):
        return Verdict(f"{what} (interpreter starting)", _nothing(place / "out"))
    wrong = fault(ended, (0, 75))
    wrong = wrong or (_again(words, shared, place) if chance.random() < 0.2 else "")
    return Verdict(what, wrong)


def _died(code: int, number: int, ranks: int) -> bool:
    """Return whether a code is that of a process, or launcher, that died of a signal.

    Launchers have codes of their own for ranks that died; job scripts take all but
    these four for 75 once they have passed a signal on.
    """
    if ranks:
        own = [2] if number == signal.SIGINT else []  # MPICH's: the signal's number
        return code in own or code not in (0, 1, 2, 70)
    own = [1] if number == signal.SIGINT else []  # KeyboardInterrupt, in site.py
    return code in (-number, 128 + number, *own)


def _halted(child: Child) -> bool:
    """Halt a process; return whether none of the program's own code can have run."""
    with suppress(ProcessLookupError):
        child.signal(signal.SIGSTOP)
    state = Path(f"/proc/{child.pid}/stat")
    for _ in range(1000):
        with suppress(OSError, IndexError):
            if state.read_text().rpartition(")")[2].split()[0] in "TZX":
                break
        time.sleep(1e-3)
    return not _heavy(child.pid)


def _program(chance: random.Random) -> list[str]:
    """Return the words that start the program: its module, or its console script."""
    script = shutil.which("hpcwhirl")
    if script and chance.random() < 0.3:
        return [script]
    return [sys.executable, "-m", "hpcwhirl"]


def _launching(child: Child) -> bool:
    """Return whether no rank of a launcher can have run the program's own code."""
    return not any(_heavy(pid) for pid in tree(child.pid))


def _heavy(pid: int) -> bool:
    """Return whether a process has a library that the program imports."""
    try:
        maps = Path(f"/proc/{pid}/maps").read_text()
    except OSError:
        return False
    return any(f"/{name}" in maps for name in HEAVY)


def _nothing(out: Path) -> str:
    """Return what a process that never ran the program's code has left."""
    found = list(out.rglob("*")) if out.exists() else []
    torn = [p.name for p in found if ".part" in p.name]
    return f"left {torn[0]}" if torn else ""


def _again(words: list[str], shared: Specimen, place: Path) -> str:
    """Give the same command again: it completes to the truth."""
    again = start([sys.executable, "-m", "hpcwhirl", *words], place, "again")
    ended = again.wait(2)
    out = place / "out"
    return fault(ended, (0,)) or differs(out, shared.truth, place)
