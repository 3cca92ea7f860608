"""The paper's sweep (Table 2, 51 speeds of 2.5 s at 1e-6 s), three ways, on two ranks.

    python scripts/sweep.py [DIR]

Times whole commands, `mpirun -n 2 hpcwhirl campaign jobs/table2.toml`: single cases,
batches of four, and the exact scheme; a short run of each before fills numba's cache.
Prints seconds, ratios and how many regimes are those of the first.
"""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import hpcwhirl
from hpcwhirl.store.reader import words

ROOT = Path(__file__).resolve().parent.parent
MPIRUN = shlex.split(os.environ.get("HPCWHIRL_MPIRUN", "mpirun"))
WAYS = {
    "modal, single cases": ["--lanes", "no"],
    "modal, batches of four": ["--lanes", "yes"],
    "exact": ["--lanes", "no", "--set", "scheme=exact"],
}


def swept(out: Path, options: list[str]) -> float:
    """Run the sweep into a directory and return the seconds of the whole command."""
    call = [*MPIRUN, "-n", "2", sys.executable, "-m", "hpcwhirl", "campaign"]
    start = time.perf_counter()
    subprocess.run(
        [*call, str(ROOT / "jobs/table2.toml"), "--out", str(out), *options],
        check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    return time.perf_counter() - start


def main() -> None:
    """Time the three ways one after the other."""
    with tempfile.TemporaryDirectory(prefix="hpcwhirl-sweep-") as place:
        base = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(place)
        for number, options in enumerate(WAYS.values()):
            swept(Path(place) / f"warm{number}", [*options, "--set", "duration=1e-3"])
        first, reference = 0.0, None
        for number, (name, options) in enumerate(WAYS.items()):
            seconds = swept(base / f"sweep{number}", options)
            first = first or seconds
            found = words(hpcwhirl.open_results(base / f"sweep{number}").regime)
            reference = found if reference is None else reference
            same = sum(a == b for a, b in zip(found, reference, strict=True))
            print(
                f"{name:24s} {seconds:6.1f} s   {first / seconds:.2f} times the first; "
                f"{same} of {len(found)} regimes the same"
            )


if __name__ == "__main__":
    main()
