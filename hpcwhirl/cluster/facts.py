"""What `hpcwhirl doctor` finds out on each rank: machine, MPI, libraries, directory.

A campaign's directory is probed from all ranks: whether they see each other's files,
and whether locks and exclusive creation of files work.
"""

from __future__ import annotations

import fcntl
import json
import os
import platform
import shutil
import socket
import subprocess
import sys
import uuid
from importlib import metadata
from pathlib import Path
from typing import Any

import hpcwhirl
from hpcwhirl import launch
from hpcwhirl.campaign.machine import core_facts, processor_name
from hpcwhirl.dynamics.kernel_cache import cache_facts
from hpcwhirl.store.hdf5 import hdf5_facts, mpi_libraries

Facts = dict[str, Any]
THREADS = (
    "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS",
    "BLIS_NUM_THREADS", "VECLIB_MAXIMUM_THREADS",
)  # fmt: skip
LIBRARIES = ("numpy", "scipy", "numba", "h5py", "mpi4py")
PROBE = (
    "import json; from hpcwhirl.cluster.facts import mpi_facts; "
    "print(json.dumps(mpi_facts()))"
)
LIMIT = 60  # s, longest time that a probing process may take


def mpi_facts() -> Facts:
    """Initialize MPI in this process; return its version and the libraries loaded."""
    name = launch.library()
    hdf5_facts()  # loads h5py after MPI, as a campaign does; it may add another libmpi
    return {"mpi": name, "mpi_libraries": mpi_libraries(), "mpi_error": ""}


def ranks_of(launched: int) -> tuple[launch.Communicator, Facts]:
    """Return the communicator for `doctor`, and facts on MPI, without risking an abort.

    The communicator is MPI's world if the launcher matches mpi4py's library, else that
    of a single process.

    Parameters
    ----------
    launched : number of ranks started, as the launcher says
    """
    if alien := launch.alien_library():
        facts = {"mpi": alien, "mpi_libraries": mpi_libraries(), "mpi_error": ""}
        return launch.ALONE, facts
    if launched == 1:
        return launch.ALONE, probed_mpi()
    return launch.world(), mpi_facts()


def probed_mpi() -> Facts:
    """Return `mpi_facts` of a child process, which alone ends if MPI aborts."""
    none: Facts = {"mpi": "", "mpi_libraries": []}
    try:
        done = _asked([sys.executable, "-c", PROBE])
    except subprocess.TimeoutExpired:
        return none | {"mpi_error": f"no answer in {LIMIT} s"}
    try:
        facts: Facts = json.loads(done.stdout.splitlines()[-1])
    except (IndexError, ValueError):
        lines = done.stderr.strip().splitlines() or [f"exit code {done.returncode}"]
        return none | {"mpi_error": lines[-1]}
    return facts


def _asked(words: list[str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        words, capture_output=True, text=True, timeout=LIMIT, check=False,
        stdin=subprocess.DEVNULL,
    )  # fmt: skip


def launcher_facts() -> Facts:
    """Return path and version of the mpirun on PATH; both are "" if there is none."""
    path = launch.mpirun()
    if not path:
        return {"mpirun": "", "mpirun_version": ""}
    try:
        done = _asked([path, "--version"])
    except (OSError, subprocess.TimeoutExpired) as failed:
        return {"mpirun": path, "mpirun_version": f"does not start: {failed}"}
    lines = (done.stdout + done.stderr).split("\n\n")[0].splitlines()[:2]
    return {"mpirun": path, "mpirun_version": " ".join(" ".join(lines).split())}


def vector_bits(flags: str) -> int:
    """Return how wide the vectors of a core are, bits, from its flags; 0: unknown.

    flags : flags of the core in /proc/cpuinfo
    """
    words = set(flags.split())
    widths = {"avx512f": 512, "avx2": 256, "avx": 256, "sse2": 128, "asimd": 128}
    return max((bits for flag, bits in widths.items() if flag in words), default=0)


def machine_facts() -> Facts:
    """Return facts on this machine: host, cores, CPU, vectors, threads, versions."""
    named = core_facts()
    cores = (
        sorted(os.sched_getaffinity(0))
        if hasattr(os, "sched_getaffinity")
        else list(range(os.cpu_count() or 1))
    )
    return {
        "host": socket.gethostname(),
        "cores": cores,
        "cpu": processor_name(),
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
    """Return the facts that a rank finds out without communicating with others."""
    return {
        "launched": launch.launched_ranks(),
        **machine_facts(),
        **hdf5_facts(),
        **cache_facts(),
    }


def filesystem(path: Path, mounts: str) -> str:
    """Return the type of the file system that has a path, such as ``nfs4``.

    "" if it is unknown.

    Parameters
    ----------
    path : absolute path
    mounts : content of /proc/mounts
    """
    best, kind = "", ""
    for line in mounts.splitlines():
        fields = line.split()
        if len(fields) < 3:
            continue
        point = fields[1].replace("\\040", " ")
        inside = path == Path(point) or Path(point) in path.parents
        if inside and len(point) >= len(best):
            best, kind = point, fields[2]
    return kind


def place_facts(folder: Path, comm: launch.Communicator = launch.ALONE) -> Facts:
    """Find out whether a campaign's directory works from all ranks.

    All ranks of `comm` must call this. Rank 0 removes the probe files, whose names are
    unique.

    Parameters
    ----------
    folder : the directory
    comm : communicator of all ranks

    Returns
    -------
    dict with the keys
        exists : whether this rank finds the directory
        writable : whether this rank may write in the directory
        seen : whether this rank sees a file that rank 0 has created
        locks : ``held`` if rank 0's lock keeps this rank out, else ``not held``, or the
            system's error
        exclusive : whether this rank created the file that only one rank can create
        free : free space, bytes; None: unknown
        filesystem : type of the file system; empty: unknown
    """
    name = comm.bcast(f".hpcwhirl-doctor-{uuid.uuid4().hex}", root=0)
    held, facts = None, _usage(folder)
    if comm.rank == 0:
        held, facts["locks"] = _held(folder / name)
    comm.Barrier()
    facts["seen"] = (folder / name).exists()
    if comm.rank != 0 or comm.size == 1:
        facts["locks"] = _tried(folder / name, facts.get("locks", ""))
    facts["exclusive"] = _exclusive(folder / f"{name}-once")
    comm.Barrier()
    if held is not None:
        held.close()
    if comm.rank == 0:
        for path in (folder / name, folder / f"{name}-once"):
            path.unlink(missing_ok=True)
    return facts


def _usage(folder: Path) -> Facts:
    try:
        mounts = Path("/proc/mounts").read_text(encoding="utf-8")
    except OSError:
        mounts = ""
    try:
        free: int | None = shutil.disk_usage(folder).free
    except OSError:
        free = None
    return {
        "exists": folder.is_dir(),
        "writable": folder.is_dir() and os.access(folder, os.W_OK | os.X_OK),
        "free": free,
        "filesystem": filesystem(folder.resolve(), mounts),
    }


def _held(path: Path) -> tuple[Any, str]:
    """Create a file and lock it as HDF5 does, to probe locks of a file system.

    Returns
    -------
    the open file, None if it cannot be created; and ``held``, or the system's error as
    text
    """
    try:
        file = path.open("w", encoding="utf-8")
    except OSError as failed:
        return None, str(failed.strerror)
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as failed:
        return file, str(failed.strerror)
    return file, "held"


def _tried(path: Path, state: str) -> str:
    """Try to lock the file that rank 0 has locked; return ``held`` if that is refused.

    That is the right outcome; ``not held`` means that locks do not work.

    Parameters
    ----------
    path : the locked file
    state : text that `_held` returned on this rank; "" on ranks that did not call it.
        An error is returned unchanged, and no lock is tried
    """
    if state and state != "held":
        return state
    try:
        with path.open("r+", encoding="utf-8") as file:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return "held"
    except OSError as failed:
        return str(failed.strerror)
    return "not held"


def _exclusive(path: Path) -> bool:
    try:
        path.touch(exist_ok=False)
    except OSError:
        return False
    return True
