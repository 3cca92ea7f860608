"""What planning costs before the first case: seconds and MB over the number of cases.

    python scripts/evidence/scale_plan.py [--cases 100000 1000000 10000000]

Each size is a grid of as many speeds as gaps, planned in a process of its own as the
command does on rank 0: the file read and checked, the directory begun, the agenda made.
Nothing is computed. Seconds are the processor's, MB the largest resident set; the last
column is what the process had before it was given a design, libraries and all.
"""

from __future__ import annotations

import argparse
import itertools
import math
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

SIZES = (10_000, 100_000, 1_000_000, 10_000_000)
HEAD = "cases | read, check / s | begin / s | agenda / s | all / s | MB | MB without"


def file_of(folder: Path, cases: int) -> Path:
    """Write a grid of so many cases; return the file."""
    side = math.isqrt(cases)
    path = folder / "sweep.toml"
    path.write_text(
        '[scene]\nduration = 0.01\n[output]\ntraces = "summary"\n[sweep]\n'
        f"speed = {{ start = 100, stop = 500, num = {side} }}\n"
        f"gap = {{ start = 1e-4, stop = 3e-4, num = {cases // side} }}\n"
    )
    return path


def megabytes() -> float:
    """Return the largest resident set so far."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3


def plan(folder: Path, cases: int) -> None:
    """Plan and print a row of the table."""
    from hpcwhirl.campaign.plan.design import load_design
    from hpcwhirl.campaign.policy import Policy
    from hpcwhirl.campaign.resume import prepare
    from hpcwhirl.campaign.work import work_of
    from hpcwhirl.launch import ALONE

    before, times = megabytes(), [time.process_time()]
    design = load_design(file_of(folder, cases), {})
    times.append(time.process_time())
    prepare(design, folder / "out")
    times.append(time.process_time())
    work, agenda = work_of(design, folder / "out", Policy(), ALONE)
    times.append(time.process_time())
    if not len(work.units) == len(agenda) == len(design.settings):
        msg = f"{len(agenda)} of {len(design.settings)} cases are handed out"
        raise SystemExit(msg)
    each = [b - a for a, b in itertools.pairwise(times)]
    spent = " | ".join(f"{seconds:.2f}" for seconds in (*each, sum(each)))
    print(f"{len(work.units)} | {spent} | {megabytes():.0f} | {before:.0f}")


def main() -> None:
    """Plan each size in a process of its own."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, nargs="+", default=SIZES)
    parser.add_argument("--here", type=Path, help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.here:
        plan(args.here, args.cases[0])
        return
    print(HEAD, flush=True)
    for cases in args.cases:
        with tempfile.TemporaryDirectory() as folder:
            words = ["--cases", str(cases), "--here", folder]
            subprocess.run([sys.executable, __file__, *words], check=True)


if __name__ == "__main__":
    main()
