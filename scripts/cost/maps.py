"""Seconds and memory of `hpcwhirl map`, for campaigns of made-up rows.

    python scripts/cost/maps.py [--cases 1000,10000,100000]

Each map, PNG and SVG together, is drawn by a process of its own; the time is of all of
the process, imports included. Nothing is integrated: rows are synthetic, orbits are
500 samples a case that are there for the reader and are holes on the disk.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from evidence.synthetic import grid_of, synthetic

SAMPLES = 500
DRAW = [sys.executable, "-m", "hpcwhirl", "map"]
IMPORTS = [sys.executable, "-c", "import xarray, h5netcdf, matplotlib.figure"]


def settings(cases: int) -> list[dict[str, Any]]:
    """Return a grid of so many cases, speed by gap."""
    gaps = {1000: 25, 10_000: 80, 100_000: 200}.get(cases, max(int(cases**0.5) // 2, 1))
    speeds = np.linspace(200.0, 600.0, cases // gaps).tolist()
    return grid_of(speed=speeds, gap=np.geomspace(5e-5, 1e-3, gaps).tolist())


def measured(command: list[str]) -> tuple[float, float, float]:
    """Return (seconds of wall, seconds of CPU, peak MB) of a command."""
    begin = time.perf_counter()
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode:
        msg = f"{' '.join(command)} ended with {child.returncode}"
        raise RuntimeError(msg)
    wall = time.perf_counter() - begin
    return wall, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def main() -> int:
    """Write the campaigns, draw them, print a line for each."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--cases", default="1000,10000,100000", metavar="N[,N]")
    args = parser.parse_args()
    load = os.getloadavg()[0]
    print(f"synthetic rows; {os.cpu_count()} cores, load {load:.1f} before the run")
    measured(IMPORTS)  # their files are read from the disk once
    wall, cpu, peak = measured(IMPORTS)
    print(f"imports of xarray and Matplotlib alone: {wall:.1f} s, {cpu:.1f} s of CPU, "
          f"{peak:.0f} MB")  # fmt: skip
    print("| cases | traces | results.h5 | map.png + map.svg | wall | CPU | peak |")
    print("|---|---|---|---|---|---|---|")
    for count in map(int, args.cases.split(",")):
        for samples in (0, SAMPLES):
            line(count, samples)
    return 0


def line(count: int, samples: int) -> None:
    """Print one line of the table."""
    with tempfile.TemporaryDirectory(prefix="map-cost-") as place:
        folder = synthetic(Path(place) / "out", settings(count), samples=samples)
        wall, cpu, peak = measured([*DRAW, str(folder)])
        size = (folder / "results.h5").stat().st_size / 1e6
        drawn = sum((folder / f"map.{kind}").stat().st_size for kind in ("png", "svg"))
    kept = f"orbit, {samples} samples" if samples else "summary"
    print(f"| {count} | {kept} | {size:.0f} MB | {drawn / 1e6:.2f} MB | {wall:.1f} s | "
          f"{cpu:.1f} s | {peak:.0f} MB |", flush=True)  # fmt: skip


if __name__ == "__main__":
    sys.exit(main())
