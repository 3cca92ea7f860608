"""Facts that each rank collects: its machine, MPI, libraries and caches."""

from __future__ import annotations

import json
import os
import platform
import shutil
import socket
import subprocess
import sys
from importlib import metadata
from pathlib import Path
from typing import Any

import hpcwhirl
from hpcwhirl.dynamics.kernels import cache_facts
from hpcwhirl.launch import (
    ALONE,
    Communicator,
    alien_library,
    launched_ranks,
    library,
    world,
)
from hpcwhirl.store.hdf5 import hdf5_facts, mpi_libraries

Facts = dict[str, Any]
THREADS = (
    "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS",
    "BLIS_NUM_THREADS", "VECLIB_MAXIMUM_THREADS",
)  # fmt: skip
LIBRARIES = ("numpy", "scipy", "numba", "h5py", "mpi4py")
PROBE = (
    "import json; from hpcwhirl.cluster.doctor.facts import mpi_facts; "
    "print(json.dumps(mpi_facts()))"
)
LIMIT = 60  # s, longest time that a probing process may take


def mpi_facts() -> Facts:
    """Initialize MPI here; return its version text and the libmpi files loaded."""
    name = library()
    hdf5_facts()  # loads h5py after MPI, as a campaign does; it may add another libmpi
    return {"mpi": name, "mpi_libraries": mpi_libraries(), "mpi_error": ""}


def ranks_of(launched: int) -> tuple[Communicator, Facts]:
    """Return the communicator to use and the facts of MPI, see `mpi_facts`.

    The communicator is MPI's world if the launcher matches mpi4py's library, else that
    of a single process.

    Parameters
    ----------
    launched : number of ranks started, as the launcher says
    """
    if alien := alien_library():
        facts = {"mpi": alien, "mpi_libraries": mpi_libraries(), "mpi_error": ""}
        return ALONE, facts
    if launched == 1:
        return ALONE, probed_mpi()
    return world(), mpi_facts()


def probed_mpi() -> Facts:
    """Return `mpi_facts` of a child process, which alone ends if MPI aborts."""
    none: Facts = {"mpi": "", "mpi_libraries": []}
    try:
        done = subprocess.run(
            [sys.executable, "-c", PROBE], capture_output=True, text=True,
            timeout=LIMIT, check=False, stdin=subprocess.DEVNULL,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return none | {"mpi_error": f"no answer in {LIMIT} s"}
    try:
        facts: Facts = json.loads(done.stdout.splitlines()[-1])
    except (IndexError, ValueError):
        lines = done.stderr.strip().splitlines() or [f"exit code {done.returncode}"]
        return none | {"mpi_error": lines[-1]}
    return facts


def launcher_facts() -> Facts:
    """Return path and version text of the mpirun on PATH, both empty if none is."""
    path = shutil.which("mpirun") or shutil.which("mpiexec")
    if path is None:
        return {"mpirun": "", "mpirun_version": ""}
    try:
        done = subprocess.run(
            [path, "--version"], capture_output=True, text=True,
            timeout=LIMIT, check=False, stdin=subprocess.DEVNULL,
        )  # fmt: skip
    except (OSError, subprocess.TimeoutExpired) as failed:
        return {"mpirun": path, "mpirun_version": f"does not start: {failed}"}
    lines = (done.stdout + done.stderr).split("\n\n")[0].splitlines()[:2]
    return {"mpirun": path, "mpirun_version": " ".join(" ".join(lines).split())}


def vector_bits(flags: str) -> int:
    """Return a core's vector width in bits from its /proc/cpuinfo flags; 0: unknown."""
    words = set(flags.split())
    widths = {"avx512f": 512, "avx2": 256, "avx": 256, "sse2": 128, "asimd": 128}
    return max((bits for flag, bits in widths.items() if flag in words), default=0)


def machine_facts() -> Facts:
    """Return host, usable cores, CPU, vector width, thread settings and versions."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    shown = dict(line.split(":", 1) for line in lines if ":" in line)
    named = {key.strip(): value.strip() for key, value in shown.items()}
    cores = (
        sorted(os.sched_getaffinity(0))
        if hasattr(os, "sched_getaffinity")
        else list(range(os.cpu_count() or 1))
    )
    return {
        "host": socket.gethostname(),
        "cores": cores,
        "cpu": named.get("model name", platform.processor()),
        "vector_bits": vector_bits(named.get("flags", named.get("Features", ""))),
        "threads": {name: os.environ[name] for name in THREADS if name in os.environ},
        "versions": {
            "hpcwhirl": hpcwhirl.__version__,
            "python": platform.python_version(),
            **{name: _version(name) for name in LIBRARIES},
        },
    }


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "missing"


def rank_facts() -> Facts:
    """Return the facts that a rank collects without communicating with other ranks."""
    return {
        "launched": launched_ranks(),
        **machine_facts(),
        **hdf5_facts(),
        **cache_facts(),
    }
