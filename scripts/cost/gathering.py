"""What gathering costs: seconds, memory and bytes, serial and through MPI-IO.

    python scripts/cost/gathering.py [--cases 10000] [--samples 500] [--ranks 2]

Makes campaign directories of many cases, without and with orbits, and gathers them in
processes of their own. A few cases are really integrated; every record is one of their
rows, and every trace block their traces, kept through the real journal under the digest
of a case of its own. What gathering does with them is what it does with as many
different ones. MPI-IO is measured where h5py has parallel HDF5. Told are the wall time
and the processor time of the busiest rank, medians, and the most that a rank kept.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

from hpcwhirl.campaign.foresight.forecast import forecast
from hpcwhirl.campaign.plan.design import Design, design_of
from hpcwhirl.campaign.simulate import Result, simulate
from hpcwhirl.scene import apply_settings
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.directory.journal import Journal, Journals
from hpcwhirl.store.directory.manifest import PlanFile
from hpcwhirl.store.results.gather import has_mpi_io

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import under_mpi

COMPUTED = 8  # cases that are really integrated
DURATION = 0.05  # s of engine time
JOURNALS = 16  # ranks that the cases are spread over
GATHER = """
import sys, time
from pathlib import Path
from hpcwhirl.launch import communicator
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.results.gather import gather
def most():  # kB; ru_maxrss would count what started this process, too
    status = Path("/proc/self/status").read_text()
    return int(status.split("VmHWM:")[1].split()[0])
comm = communicator()
before = most()
start, busy = time.perf_counter(), time.process_time()
gather(Directory(Path(sys.argv[1])), {}, comm, compress=int(sys.argv[2]))
spent, busy = time.perf_counter() - start, time.process_time() - busy
found = comm.gather((busy, before / 1024, most() / 1024))
if found:
    print(spent, *map(max, zip(*found)))
"""


def design(cases: int, detail: str, samples: int) -> Design:
    """Return a design of many cases over speed and friction."""
    speeds = -(-cases // 10)
    return design_of(
        {
            "scene": {"duration": DURATION},
            "solver": {"time_step": 2e-6},
            "output": {"traces": detail, "interval": DURATION / samples},
            "sweep": {
                "speed": {"start": 100.0, "stop": 500.0, "num": speeds},
                "friction": [0.02 * i for i in range(10)],
            },
        }
    )


def begin(folder: Path, many: Design, results: list[Result]) -> float:
    """Journal a record for every case; return the seconds an append took."""
    plan = many.manifest()
    PlanFile(folder).write(plan)
    journals = [Journal(Journals(folder), 1, rank) for rank in range(JOURNALS)]
    start = time.perf_counter()
    for case, digest in enumerate(plan.digests):
        result = results[case % len(results)]
        record = {"case": case, "digest": digest, "status": "ok", "message": ""}
        where = {"rank": case % JOURNALS, "host": "node0000"}
        record |= {"row": result.row | many.settings[case]}
        record |= {"performance": where | result.performance}
        journals[case % JOURNALS].append(record, result.traces)
    spent = time.perf_counter() - start
    for journal in journals:
        journal.__exit__(None, None, None)
    return spent / len(plan.digests)


def gathered(folder: Path, ranks: int, repeat: int, compress: int = 0) -> str:
    """Gather in processes of their own; return what it took."""
    words = "-c", GATHER, folder, str(compress)
    runs = [[*map(float, under_mpi(ranks, *words).split())] for _ in range(repeat)]
    seconds, busy, before, peak = map(median, zip(*runs, strict=True))
    size = (folder / "results.h5").stat().st_size
    return (
        f"{seconds:7.2f} s, processor {busy:5.2f} s  {size / 1e6:8.1f} MB  "
        f"peak {peak:5.0f} MB a process, {peak - before:4.0f} MB of it gathering"
    )


def measure(options: argparse.Namespace, place: Path, detail: str) -> None:
    """Print what one kind of campaign takes."""
    many = design(options.cases, detail, options.samples)
    few = [many.scenes[i * len(many.scenes) // COMPUTED] for i in range(COMPUTED)]
    results = [simulate(apply_settings(scene, {})) for scene in few]
    folder = place / detail
    print(f"{len(many.scenes)} cases, {detail}: ", end="")
    each = begin(folder, many, results)
    told = forecast(many, Directory(folder)).disk.results
    print(f"{1e3 * each:.2f} ms to keep one; predicted {told / 1e6:.1f} MB", flush=True)
    repeat = options.repeat
    print("  serial      ", gathered(folder, 0, repeat), flush=True)
    if has_mpi_io():
        how = f"  MPI-IO, -n {options.ranks}"
        print(how, gathered(folder, options.ranks, repeat), flush=True)
    if detail != "summary":
        print("  serial, gzip", gathered(folder, 0, 1, 4), flush=True)


def main() -> None:
    """Measure summaries and orbits."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=10_000)
    parser.add_argument("--samples", type=int, default=500, help="of an orbit")
    parser.add_argument("--ranks", type=int, default=2, help="of the MPI-IO gather")
    parser.add_argument("--repeat", type=int, default=3, help="gathers of each kind")
    parser.add_argument("--out", type=Path, help="where the directories go")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="hpcwhirl-", dir=options.out) as place:
        for detail in ("summary", "orbit"):
            measure(options, Path(place), detail)


if __name__ == "__main__":
    main()
