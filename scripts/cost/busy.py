"""How busy the ranks are: hpcwhirl's hand-out beside a dedicated master and a split.

    python scripts/cost/busy.py [--ranks 2] [--repeat 1] [--duration 1.0] [--out DIR]

One campaign of mixed regimes and lengths, four ways of sharing it among the same
number of ranks, and on one rank: `hpcwhirl campaign` itself; a dedicated master, which
hands out the same longest-first order and computes nothing; a static split, cases in
the order of the file, in contiguous blocks and dealt round. The baselines are programs
of their own (this file under mpirun) around the same integration, journals and slices.
Prints seconds from the first hand-out to the end of the last rank (start-up, warming
and gathering left out for all), throughput over that on one rank, busy fractions.
`apart` is what the machine allows: as many campaigns of one rank at the same time, each
turn once. The last lines tell by how much they slow each other, which no hand-out can
help, and how much of what is left `hpcwhirl` reaches.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np

from hpcwhirl.campaign.checkpoints import Checkpoints
from hpcwhirl.campaign.evaluate import Desk, Evaluator
from hpcwhirl.campaign.isolate import Child
from hpcwhirl.campaign.log import say
from hpcwhirl.campaign.plan.cost import costs_of
from hpcwhirl.campaign.plan.design import Design, load_design
from hpcwhirl.campaign.ranks import Tally, keep_shares
from hpcwhirl.campaign.resume import prepare
from hpcwhirl.dynamics.march import March
from hpcwhirl.store.directory.journal import Journal
from hpcwhirl.store.directory.running import Running
from hpcwhirl.store.directory.runs import read_runs

sys.path.insert(0, str(Path(__file__).parents[1]))
from cost.under_mpi import campaign, under_mpi

MIXED = """
# damped, sustained and divergent ones, short and long
scene = {{gap = 1.28e-4}}
solver = {{time_step = 1e-6, plan = "everything"}}
output = {{interval = 1e-3}}
[sweep]
speed = {{start = 120, stop = 520, step = 40}}
nodal_diameter = [1, 2]
duration = [{short}, {long}]
"""
SAVE_EVERY = 600.0  # s: cases are shorter
Share = Callable[[Any, Design, Evaluator, Tally], None]


def master(comm: Any, design: Design, evaluate: Evaluator, tally: Tally) -> None:
    """Share: rank 0 hands out, the longest first, and computes nothing."""
    if comm.rank:
        while (unit := comm.sendrecv(None, dest=0, source=0)) is not None:
            tally.compute(unit, evaluate, lambda: None)
        return
    from mpi4py import MPI

    costs, place = costs_of(design), MPI.Status()
    order = sorted(range(len(design.scenes)), key=lambda i: -costs.nominal[i])
    at_work = comm.size - 1
    while at_work:
        comm.recv(source=MPI.ANY_SOURCE, status=place)
        unit = order.pop(0) if order else None
        at_work -= unit is None
        comm.send(unit, dest=place.Get_source())


def blocks(comm: Any, design: Design, evaluate: Evaluator, tally: Tally) -> None:
    """Share: contiguous blocks of cases, decided beforehand."""
    for unit in np.array_split(np.arange(len(design.scenes)), comm.size)[comm.rank]:
        tally.compute(int(unit), evaluate, lambda: None)


def dealt(comm: Any, design: Design, evaluate: Evaluator, tally: Tally) -> None:
    """Share: every n-th case, decided beforehand."""
    for unit in range(comm.rank, len(design.scenes), comm.size):
        tally.compute(unit, evaluate, lambda: None)


SHARES: dict[str, Share] = {"master": master, "blocks": blocks, "dealt": dealt}


def baseline(share: str, file: Path, out: Path) -> None:
    """Compute a campaign shared in another way; under mpirun, on every rank."""
    from mpi4py import MPI

    comm, design = MPI.COMM_WORLD, load_design(file, {})
    if comm.rank == 0:
        prepare(design, out)
    March(design.resolved(0)).advance(1)  # numba's cache has the kernel
    comm.Barrier()
    units = [(case,) for case in range(len(design.scenes))]
    with (
        Journal(out, 1, comm.rank) as journal,
        Running(out, 1, comm.rank) as running,
        closing(Child(out, SAVE_EVERY)) as child,
    ):
        checkpoints = Checkpoints(out, SAVE_EVERY, say)
        desk = Desk(comm.rank, journal, running, checkpoints, child)
        evaluate, tally = Evaluator(design, units, desk), Tally()
        SHARES[share](comm, design, evaluate, tally)
        comm.Barrier()
        tally.close()
    keep_shares(out, 1, tally, comm)


def ran(way: str, ranks: int, file: Path, out: Path) -> tuple[float, list[float]]:
    """Run the campaign one way; return its seconds and the ranks' busy fractions."""
    if way in SHARES:
        under_mpi(ranks, __file__, "--as", way, file, "--out", out)
    else:
        campaign(file, out, ranks=ranks)
    shares = read_runs(out)
    span = max(share["span"] for share in shares)
    return span, [share["busy"] / span for share in shares]


def apart(ranks: int, file: Path, place: Path, turn: int) -> float:
    """Return the seconds of as many campaigns of one rank, all at the same time.

    What the machine itself allows: memory and caches are shared.
    """
    with ThreadPoolExecutor(ranks) as pool:
        outs = [place / f"alone-{turn}-{n}" for n in range(ranks)]
        spans = list(pool.map(lambda out: ran("hpcwhirl", 1, file, out)[0], outs))
    return max(spans)


def measure(options: argparse.Namespace, place: Path) -> list[dict[str, Any]]:
    """Run all ways, `repeat` times in turn; return a row of each."""
    ways = [("hpcwhirl", 1), *((w, options.ranks) for w in ("hpcwhirl", *SHARES))]
    file, quick = place / "mixed.toml", place / "quick.toml"
    long = options.duration
    file.write_text(MIXED.format(short=long / 4, long=long))
    quick.write_text(MIXED.format(short=1e-3, long=2e-3))
    ran("hpcwhirl", 1, quick, place / "warm")
    found: dict[tuple[str, int], list[tuple[float, list[float]]]] = {}
    together = []
    for turn in range(options.repeat):
        for way, ranks in ways:
            one = ran(way, ranks, file, place / f"{way}-{ranks}-{turn}")
            found.setdefault((way, ranks), []).append(one)
        together.append(apart(options.ranks, file, place, turn))
    cases, rows = len(load_design(file, {}).scenes), []
    slowest = float(np.median(together))
    base = np.median([seconds for seconds, _ in found["hpcwhirl", 1]])
    for (way, ranks), turns in found.items():
        seconds = float(np.median([seconds for seconds, _ in turns]))
        busy = np.median([fractions for _, fractions in turns], axis=0)
        row = {"way": way, "ranks": ranks, "seconds": seconds, "cases": cases}
        rows.append(row | {"times": float(base / seconds), "busy": busy.tolist()})
    alone = {"way": "apart", "ranks": options.ranks, "seconds": slowest, "busy": []}
    alone |= {"cases": options.ranks * cases, "slowed": float(slowest / base - 1.0)}
    return [*rows, alone | {"times": float(options.ranks * base / slowest)}]


def share_of_machine(rows: list[dict[str, Any]]) -> str:
    """Return a sentence: what the machine takes, and what the hand-out does."""
    alone, size = rows[-1], rows[-1]["ranks"]
    ours = next(r for r in rows if (r["way"], r["ranks"]) == ("hpcwhirl", size))
    return (
        f"{size} campaigns apart slow each other by {alone['slowed']:.1%}: "
        f"{alone['times']:.2f} times -n 1 is all the machine gives, hpcwhirl reaches "
        f"{ours['times'] / alone['times']:.1%} of it"
    )


def main() -> None:
    """Measure, or be a baseline."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", nargs="?", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--as", dest="way", choices=SHARES, help=argparse.SUPPRESS)
    parser.add_argument("--ranks", type=int, default=2)
    parser.add_argument("--repeat", type=int, default=1)
    parser.add_argument("--duration", type=float, default=1.0, help="s, longest case")
    parser.add_argument("--out", type=Path, help="keep the campaigns there")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    if options.way:
        baseline(options.way, options.file, options.out)
        return
    with tempfile.TemporaryDirectory(prefix="hpcwhirl-busy-") as scratch:
        place = (options.out or Path(scratch)).resolve()
        place.mkdir(parents=True, exist_ok=True)
        start = time.perf_counter()
        rows = measure(options, place)
    if options.json:
        print(json.dumps(rows))
        return
    for row in rows:
        busy = " ".join(f"{fraction:.3f}" for fraction in row["busy"])
        print(
            f"{row['way']:9s} -n {row['ranks']}  {row['seconds']:7.2f} s  "
            f"{row['cases'] / row['seconds']:6.2f} cases/s  {row['times']:5.2f} times "
            f"-n 1  busy {busy}"
        )
    print(share_of_machine(rows))
    print(
        f"{len(rows)} ways, {time.perf_counter() - start:.0f} s; load {os.getloadavg()}"
    )


if __name__ == "__main__":
    main()
