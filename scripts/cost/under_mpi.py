"""Programs of this interpreter under mpirun."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
import time
from pathlib import Path

MPIRUN = shlex.split(os.environ.get("HPCWHIRL_MPIRUN", "mpirun"))


def under_mpi(ranks: int, *words: str | Path) -> str:
    """Return what `python WORDS` prints on so many ranks; 0: without mpirun."""
    front = [*MPIRUN, "-n", str(ranks)] if ranks else []
    call = [*front, sys.executable, *map(str, words)]
    return subprocess.run(call, check=True, capture_output=True, text=True).stdout


def campaign(file: Path, out: Path, *options: str, ranks: int = 2) -> float:
    """Return the seconds of a whole `hpcwhirl campaign` of a file into a directory."""
    start = time.perf_counter()
    under_mpi(ranks, "-m", "hpcwhirl", "campaign", file, "--out", out, *options)
    return time.perf_counter() - start
