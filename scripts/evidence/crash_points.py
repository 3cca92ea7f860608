"""Every crash point of small campaigns of every kind, and every await.

    python scripts/evidence/crash_points.py         all of it
        --only sweep,gather                         some kinds
        --share 0.02                                of the states and of the awaits
        --jobs 2                                    processes at once
        --share 64                                  of all states that a machine's
                                                    death leaves, too: hours
        --write                                     and scripts/evidence/crash_points.md

A command is recorded by a shim in C: every call that changes its directory, with what
was written. From the record, every directory is made that a death before, after or in
the midst of any of these calls may leave, see `crashing/disk.py`; equal ones once. On
each, the same command is given again, by another number of ranks. It has to end with
exit code 0, the bits of the undisturbed results, no case computed again that was there,
and nothing left over. Then ranks are stopped, slow or dead at each await of theirs, and
a command loses its directory to another at each of its calls, see `crashing/awaits.py`.

Prints kind | calls | crashes | states | failed, and a line for each kind of failure.
Exits 1 where one failed. It needs gcc.
"""

from __future__ import annotations

import json
import os
import resource
import sys
import tempfile
from collections import Counter
from pathlib import Path
from typing import Any

import h5py

sys.path.insert(0, str(Path(__file__).parents[1]))
import apart
from common import parser_of, processor_time, table, tell
from crashing import awaits, checks
from crashing.awaits import some
from crashing.disk import PROCESS, Crash
from crashing.kinds import Kind, kinds
from crashing.trace import compiled

ROOT = Path(__file__).parents[2]
PAGE = Path(__file__).with_suffix(".md")
PLACE = "CRASH_POINTS_PLACE"  # where the process with the shim in it works
EACH = 8  # of so many deaths of a process, one is gone on from under mpirun
SOME = 10  # of so many states, one is gone on from by two or three ranks
BOTH = resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN
Facts = dict[str, Any]


def look_at(kind: Kind, place: Path, share: float) -> Facts:
    """Return what became of all crashes of a kind, and of its awaits."""
    start = processor_time(*BOTH)
    checks.prepare([kind], place)
    found = checks.record(kind, place / "record")
    crashes = checks.states(found)
    states = [crash for crash, _ in crashes.values()]
    own = [crash for crash in states if crash.how == PROCESS]
    others = [crash for crash in states if crash.how != PROCESS]
    chosen = some(own, share) + some(others, share / kind.every)
    tally = awaits.Tally("")
    for number, crash in enumerate(chosen):
        size = 2 + number // SOME % 2 if number % SOME == 0 else 1
        wrong = checks.wrong_after(found, crash, size)
        tally.add(checks.described(found, crash), wrong)
    total = sum(count for _, count in crashes.values())
    facts = tally.facts() | {
        "kind": kind.name, "calls": len(found.calls), "crashes": total,
        "states": len(states), "awaits": [], "tried": len(chosen),
        "models": dict(Counter(crash.how for crash in states)),
    }  # fmt: skip
    if kind.under_mpirun:
        facts["awaits"].append(under_mpirun(found, some(own, min(share, 1.0) / EACH)))
    facts["awaits"] += awaits.look_at(kind, found, place, share)
    facts["seconds"] = processor_time(*BOTH) - start
    return facts


def under_mpirun(found: checks.Record, chosen: list[Crash]) -> Facts:
    """Return what became of crashes after which mpirun's ranks go on."""
    tally = awaits.Tally("gone on from under mpirun -n 2 or 3")
    for number, crash in enumerate(chosen):
        wrong = checks.wrong_under_mpirun(found, crash, 2 + number % 2)
        tally.add(checks.described(found, crash), wrong)
    return tally.facts()


def tables(found: list[Facts]) -> list[str]:
    """Return the table of crashes and that of awaits."""
    names = ("calls", "crashes", "states", "tried", "failed")
    rows = [[f["kind"], *(f[n] for n in names)] for f in found]
    rows.append(["all", *(sum(f[n] for f in found) for n in names)])
    points = [[facts["kind"], one["what"], one["points"], one["failed"]]
              for facts in found for one in facts["awaits"]]  # fmt: skip
    head = ("awaits of", "what happens there", "points", "failed")
    return [*table(("kind", *names), rows), "", *table(head, points)]


def failures(found: list[Facts]) -> list[str]:
    """Return a line for each kind of failure."""
    out = [f"- {f['kind']}: {line}" for f in found for line in f["failures"]]
    return out + [f"- {f['kind']}, {one['what']}: {line}" for f in found
                  for one in f["awaits"] for line in one["failures"]]  # fmt: skip


def main() -> int:
    """Look at all, and tell what became of it."""
    parser, known = parser_of(__doc__, write=PAGE), kinds()
    if h5py.get_config().mpi:  # whose ranks are not those of `crashing.wire`
        parser.error("this h5py writes by MPI-IO; a plain one is needed")
    plain = {name.replace(", ", " "): kind for name, kind in known.items()}
    args = apart.asked(parser, "kind", list(plain))
    if args.inside:
        place = Path(os.environ[PLACE])
        print(json.dumps(look_at(plain[args.inside], place, args.share)))
        return 0
    with tempfile.TemporaryDirectory(prefix="crash-", dir=checks.room()) as folder:
        shim = compiled(Path(folder))

        def environment(name: str) -> dict[str, str]:
            own = Path(folder) / name.replace(" ", "-")
            own.mkdir()
            return {"LD_PRELOAD": str(shim), PLACE: str(own), "PYTHONPATH": str(ROOT)}

        found = list(apart.each(args, environment))
    wrong = failures(found)
    if args.json:
        print(json.dumps(found))
    else:
        minutes = sum(facts["seconds"] for facts in found) / 60
        told = [*tables(found), "", f"{minutes:.0f} minutes of processor time.", ""]
        told += ["Failed:", "", *wrong] if wrong else ["None failed."]
        tell("\n".join(told), PAGE if args.write else None)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
