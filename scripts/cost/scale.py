"""How far a campaign scales: the hand-out as a discrete-event simulation.

    python scripts/cost/scale.py [DIR] [--most 1000000] [--quick]

Fed with message times measured here between two ranks, and with the case times of a
finished campaign DIR (or of one that is integrated now): N cases are scattered over its
parameter space, each with the cost of the nearest one, a tenth of noise on it. The
simulation hands out by hpcwhirl's own queue and answers. It is held against real runs
first: ranks that sleep instead of computing (so that more ranks than cores are fair),
and DIR's own run. Then: efficiency over ranks and cases beside a static split and a
dedicated master, and how busy messages keep rank 0. What gathering costs:
evidence/scale_cost.py.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from hpcwhirl.campaign.begin import prepare
from hpcwhirl.campaign.plan.cost import Costs, Places
from hpcwhirl.campaign.plan.design import Design, load_design
from hpcwhirl.campaign.run import run_campaign
from hpcwhirl.scene import Scene, apply_settings, input_names
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.directory.journal import Journals
from hpcwhirl.store.directory.manifest import PlanFile
from hpcwhirl.store.directory.runs import Runs

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import under_mpi
from cost.scale_model import Model, Outcome, Times, dedicated_master, static_split

Floats = NDArray[np.float64]
RANKS = (2, 10, 100, 1000, 10_000)
CASES = (1000, 10_000, 100_000, 1_000_000)
MIXED = """
scene = {duration = 0.25}
solver = {time_step = 1e-6}
output = {interval = 1e-3}
sweep = {speed = {start = 120, stop = 520, step = 40}, nodal_diameter = [1, 2]}
"""
# Two ranks: what rank 0 spends on a message, and how long one is on its way.
PING = """
import json, time
from mpi4py import MPI
from hpcwhirl.campaign.work_queue import WorkQueue
from hpcwhirl.campaign.plan.cost import Costs
from hpcwhirl.campaign.ranks import _Root, Tally, ASK
import numpy as np
comm, N = MPI.COMM_WORLD, 2000
if comm.rank == 0:
    costs = Costs(np.ones(4 * N), np.zeros((4 * N, 1)))
    queue = WorkQueue(range(4 * N), costs, 2)
    queue.stale, queue.learned = True, -(10**9)  # sorting is timed by itself
    root = _Root(queue, lambda u, s: None, lambda: False, comm, Tally())
    comm.Barrier()
    serve = 0.0
    while queue.left > 3 * N:
        start = time.perf_counter()
        if root.serve():
            serve += (time.perf_counter() - start) / N
    comm.Barrier()
    start = time.perf_counter()
    for _ in range(N):
        comm.send(None, 1); comm.recv(source=1)
    print(json.dumps([serve, (time.perf_counter() - start) / N / 2]))
else:
    comm.Barrier()
    for i in range(N):
        comm.send((1, ASK, [(i, "ok", 1.0)], False), 0)
    for _ in range(N):
        comm.recv(source=0)
    comm.Barrier()
    for _ in range(N):
        comm.recv(source=0); comm.send(None, 0)
"""
# The real hand-out of cases that sleep, in slices: span and busy seconds of each rank.
SLEEP = """
import json, sys, time
import numpy as np
from mpi4py import MPI
from hpcwhirl.campaign.work_queue import WorkQueue
from hpcwhirl.campaign.plan.cost import Costs
from hpcwhirl.campaign.ranks import Tally, map_ranks
comm = MPI.COMM_WORLD
seconds, places = map(np.array, json.load(open(sys.argv[1])))
costs = Costs(np.full(len(seconds), seconds.mean()), places)
def evaluate(unit, between):
    end = time.perf_counter() + seconds[unit]
    while (left := end - time.perf_counter()) > 0:
        time.sleep(min(left, 0.01)); between()
    return "ok"
units = range(len(seconds) if comm.rank == 0 else 0)
queue = WorkQueue(units, costs, comm.size)
comm.Barrier()
tally = Tally()
map_ranks(queue, evaluate, lambda u, s: None, lambda: False, comm, tally)
found = comm.gather((tally.span, tally.busy))
if found:
    print(json.dumps([max(s for s, _ in found), [b for _, b in found]]))
"""


def facts(ranks: int, program: str, *words: str) -> Any:
    """Return what a program says on so many ranks, as JSON."""
    return json.loads(under_mpi(ranks, "-c", program, *words).splitlines()[-1])


def finished(place: Path | None, scratch: Path) -> tuple[Path, Design]:
    """Return a finished campaign and its design; integrates one if none is given."""
    if place is None:
        place, file = scratch / "mixed", scratch / "mixed.toml"
        file.write_text(MIXED)
        design = load_design(file, {})
        prepare(design, Directory(place))
        run_campaign(design, Directory(place))
        return place, design
    plan = PlanFile(place).read()
    known = input_names()
    base = apply_settings(Scene(), {n: v for n, v in plan.base.items() if n in known})
    return place, Design(base, plan.table, tuple(plan.swept))


def case_times(place: Path, design: Design) -> tuple[Floats, Floats]:
    """Return the seconds and the places of the finished cases of a campaign."""
    records, plan = Journals(place).newest(), PlanFile(place).read()
    places = Places(design)[np.arange(len(design.settings))]
    found = [
        (records[d]["performance"]["seconds"], places[case])
        for case, d in enumerate(plan.digests)
        if records.get(d, {}).get("status") == "ok"
    ]
    return np.array([s for s, _ in found]), np.array([p for _, p in found])


class Field:
    """Case times over a parameter space, from those of a real campaign."""

    def __init__(self, seconds: Floats, places: Floats) -> None:
        self.seconds, self.tree = seconds, cKDTree(places)
        self.low, self.high = places.min(axis=0), places.max(axis=0)

    def cases(self, count: int, seed: int = 0) -> tuple[Floats, Floats]:
        """Return the seconds and places of so many cases, in the order of a sweep."""
        random = np.random.default_rng(seed)
        places = random.uniform(self.low, self.high, (count, len(self.low)))
        places = places[np.lexsort(places.T)]
        near = self.seconds[self.tree.query(places)[1]]
        return near * random.lognormal(0.0, 0.1, count), places


def simulated(seconds: Floats, places: Floats, ranks: int, times: Times) -> Outcome:
    """Return how hpcwhirl's hand-out goes; it begins knowing nothing but the mean."""
    costs = Costs(np.full(len(seconds), seconds.mean()), places)
    return Model(seconds, costs, ranks, times).run()


def validate(field: Field, times: Times, scratch: Path, ranks: tuple[int, ...]) -> None:
    """Hold the simulation against real ranks that sleep."""
    for count in ranks:
        seconds, places = field.cases(25 * count, seed=count)
        seconds *= 0.15 / seconds.mean()
        (scratch / "cases.json").write_text(
            json.dumps([seconds.tolist(), places.tolist()])
        )
        span, busy = facts(count, SLEEP, str(scratch / "cases.json"))
        told = simulated(seconds, places, count, times)
        print(
            f"  -n {count:2d}, {len(seconds)} sleeping cases of 0.15 s: real "
            f"{span:.3f} s, simulated {told.span:.3f} s "
            f"({100 * (told.span / span - 1):+.1f} %); busy "
            f"{sum(busy) / span / count:.3f}, simulated {told.efficiency:.3f}",
            flush=True,
        )


def hold_against(place: Path, times: Times, design: Design) -> None:
    """Hold the simulation against the campaign's own run, if it was one of several."""
    shares = Runs(place).shares()
    seconds, places = case_times(place, design)
    cases = sum(share["cases"] for share in shares)
    if len({share["run"] for share in shares}) != 1 or cases != len(seconds):
        return
    span = max(share["span"] for share in shares)
    kept = sum(share["busy"] for share in shares) / seconds.sum()
    told = simulated(seconds * kept, places, len(shares), times)
    print(
        f"  {place.name}, -n {len(shares)}: real {span:.2f} s, simulated "
        f"{told.span:.2f} s ({100 * (told.span / span - 1):+.1f} %); a case takes "
        f"{kept:.3f} times its kernel's seconds"
    )


def table(field: Field, times: Times, most: int) -> None:
    """Print efficiencies over ranks and cases."""
    print("  cases    ranks  hpcwhirl  split  master   hours  messages/s at rank 0")
    for cases in (count for count in CASES if count <= most):
        seconds, places = field.cases(cases)
        for ranks in RANKS:
            ours = simulated(seconds, places, ranks, times)
            expected = np.full(cases, seconds.mean())
            master = dedicated_master(seconds, expected, ranks, times).efficiency
            split = static_split(seconds, ranks).efficiency
            rate = ours.messages / ours.span
            print(
                f"  {cases:8d} {ranks:6d}  {ours.efficiency:7.3f} {split:7.3f} "
                f"{master:7.3f} {ours.span / 3600:7.3f}  {rate:9.1f} "
                f"({100 * rate * times.serve:.2f} % of its time)",
                flush=True,
            )


def main() -> None:
    """Measure, validate, simulate."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, help="a finished campaign")
    parser.add_argument("--most", type=int, default=CASES[-1], help="cases simulated")
    parser.add_argument("--quick", action="store_true", help="10,000 cases, -n 2 only")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="hpcwhirl-scale-") as place:
        scratch = Path(place)
        folder, design = finished(options.folder, scratch)
        seconds, places = case_times(folder, design)
        field = Field(seconds, places)
        serve, way = facts(2, PING)
        times = Times(serve, way)
        print(
            f"measured: {1e6 * serve:.0f} us to serve a message, {1e6 * way:.0f} us "
            f"its way; {len(seconds)} cases of {seconds.min():.2f} to "
            f"{seconds.max():.2f} s",
            flush=True,
        )
        print("simulation against real ranks:")
        validate(field, times, scratch, (2,) if options.quick else (2, 4, 8))
        hold_against(folder, times, design)
        print("efficiency:")
        table(field, times, 10_000 if options.quick else options.most)


if __name__ == "__main__":
    main()
