"""Judge what `hpcwhirl doctor` has found on all ranks, and name remedies.

Each check takes facts and yields findings.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from hpcwhirl.errors import number_told
from hpcwhirl.launch import family

Facts = dict[str, Any]
FINE, SLOW, BREAKS = "fine", "slow", "breaks"
LEAST_FREE = 100e6  # bytes of free space below which a campaign breaks
LITTLE_FREE = 5e9  # bytes of free space below which there is a warning
SITE = (
    "build mpi4py with the site's compiler in an environment without an MPI wheel: "
    "pip install --no-binary mpi4py mpi4py; or name the library: MPI4PY_LIBMPI=PATH"
)
HDF5 = (
    "install an h5py built for parallel HDF5 and this MPI: HDF5_MPI=ON CC=mpicc "
    "pip install --no-build-isolation --no-cache-dir --no-binary=h5py h5py"
)


@dataclass(frozen=True)
class Finding:
    """Result of one check of `hpcwhirl doctor`.

    Attributes
    ----------
    what : name of the thing checked
    level : `FINE`, `SLOW` (works, but wastes time) or `BREAKS`
    got : what was found, as text for the user
    remedy : what to do; "": nothing
    """

    what: str
    level: str
    got: str
    remedy: str = ""


def findings(ranks: Sequence[Facts], size: int) -> list[Finding]:
    """Return the results of all checks of `hpcwhirl doctor`.

    Parameters
    ----------
    ranks : facts of each rank, rank 0 first
    size : number of ranks that MPI sees
    """
    made: list[Iterator[Finding]] = [
        mpi(ranks[0]), launcher(ranks[0], size), same(ranks), hdf5(ranks[0]),
        cores(ranks), threads(ranks), cache(ranks), directory(ranks),
    ]  # fmt: skip
    return [finding for part in made for finding in part]


def mpi(facts: Facts) -> Iterator[Finding]:
    """Check that MPI starts, and that mpirun and mpi4py belong to the same MPI.

    facts : facts of rank 0
    """
    if not facts["mpi"]:
        level = BREAKS if facts["launched"] > 1 else SLOW
        remedy = "for more than one process: pip install 'hpcwhirl[mpich]', or " + SITE
        yield Finding("MPI", level, f"does not start: {facts['mpi_error']}", remedy)
        return
    libraries = ", ".join(facts["mpi_libraries"]) or "library unknown"
    yield Finding("MPI", FINE, f"{facts['mpi']} ({libraries})")
    if not facts["mpirun"]:
        yield Finding("mpirun", SLOW, "none on the path", "load the MPI's module")
        return
    ours, other = family(facts["mpi"]), family(facts["mpirun_version"])
    got = f"{facts['mpirun']}: {facts['mpirun_version']}"
    if ours and other and ours != other:
        text = f"{got}, but mpi4py has {ours}: ranks would not see each other"
        yield Finding("mpirun", BREAKS, text, SITE)
    else:
        yield Finding("mpirun", FINE, got)


def launcher(facts: Facts, size: int) -> Iterator[Finding]:
    """Check that MPI sees as many ranks as the launcher has started.

    Parameters
    ----------
    facts : facts of rank 0
    size : number of ranks that MPI sees
    """
    launched = facts["launched"]
    if launched == size:
        yield Finding("ranks", FINE, f"{size}, as started")
        return
    got = f"the launcher started {launched}, MPI sees {size}"
    remedy = "use the mpirun of mpi4py's MPI (see MPI above), or srun --mpi=pmix or "
    yield Finding("ranks", BREAKS, got, remedy + "--mpi=pmi2; else " + SITE)


def same(ranks: Sequence[Facts]) -> Iterator[Finding]:
    """Check that all ranks have the same versions of Python and packages.

    ranks : facts of each rank
    """
    kinds = Counter(str(facts["versions"]) for facts in ranks)
    shown = " ".join(f"{n} {v}" for n, v in ranks[0]["versions"].items())
    if len(kinds) == 1:
        yield Finding("versions", FINE, shown)
        return
    odd = next(f for f in ranks if f["versions"] != ranks[0]["versions"])
    other = " ".join(f"{n} {v}" for n, v in odd["versions"].items())
    got = f"{shown} on {ranks[0]['host']}, {other} on {odd['host']}"
    yield Finding("versions", BREAKS, got, "activate one environment on all nodes")


def hdf5(facts: Facts) -> Iterator[Finding]:
    """Check that a parallel HDF5, if there is one, was built for mpi4py's MPI.

    facts : facts of rank 0
    """
    got = f"h5py {facts['h5py']}, HDF5 {facts['hdf5']}"
    if not facts["mpi_io"]:
        text = f"{got}, serial: rank 0 alone gathers the results, which are the same"
        yield Finding("HDF5", FINE, text, "optional: " + HDF5)
    elif len(facts["mpi_libraries"]) > 1:
        text = f"{got}, parallel, for another MPI than mpi4py's: "
        yield Finding("HDF5", BREAKS, text + ", ".join(facts["mpi_libraries"]), HDF5)
    else:
        yield Finding("HDF5", FINE, f"{got}, parallel: all ranks gather")


def cores(ranks: Sequence[Facts]) -> Iterator[Finding]:
    """Check that each host has a core for each of its ranks; report vector widths.

    ranks : facts of each rank
    """
    hosts: dict[str, list[Facts]] = {}
    for facts in ranks:
        hosts.setdefault(facts["host"], []).append(facts)
    for host, here in hosts.items():
        usable = {core for facts in here for core in facts["cores"]}
        bits = here[0]["vector_bits"] or "unknown"
        on = f"{number_told(len(here), 'rank')} on {number_told(len(usable), 'core')}"
        got = f"{host}: {on}, vectors of {bits} bits"
        remedy = ""
        if len(here) > len(usable):
            remedy = "start no more ranks than cores; mpirun may have bound them to "
            remedy += "one core: --bind-to core (Open MPI), srun --cpus-per-task=1"
        yield Finding("cores", SLOW if remedy else FINE, got, remedy)


def threads(ranks: Sequence[Facts]) -> Iterator[Finding]:
    """Check that no environment variable asks for more than one thread per rank.

    ranks : facts of each rank
    """
    many = {
        f"{name}={value} on {facts['host']}"
        for facts in ranks
        for name, value in facts["threads"].items()
        if value != "1"
    }
    if many:
        remedy = "export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1"
        yield Finding("threads", SLOW, ", ".join(sorted(many)), remedy)
    else:
        yield Finding("threads", FINE, "one per rank")


def cache(ranks: Sequence[Facts]) -> Iterator[Finding]:
    """Check that all ranks, and no other user, can write the folder of compiled code.

    ranks : facts of each rank
    """
    closed = [facts for facts in ranks if not facts["cache_writable"]]
    if closed:
        place, host = closed[0]["cache"], closed[0]["host"]
        got = f"{place} cannot be written on {host}, or others than its user may write"
        remedy = "export NUMBA_CACHE_DIR=a directory of yours that all ranks may write"
        yield Finding("numba cache", BREAKS, got, remedy)
        return
    count = min(facts["cache_kernels"] for facts in ranks)
    got = f"{ranks[0]['cache']}, {count} compiled functions"
    note = "" if count else ": the first start compiles for some 10 s"
    yield Finding("numba cache", FINE, got + note)


def directory(ranks: Sequence[Facts]) -> Iterator[Finding]:
    """Check the campaign's directory: writable, shared, exclusive files, locks, space.

    ranks : facts of each rank
    """
    first = ranks[0]
    place = f"{first['folder']} ({first['filesystem'] or 'unknown file system'})"
    bad = next((facts for facts in ranks if not facts["writable"]), None)
    if bad is not None:
        fault = "cannot be written" if bad["exists"] else "does not exist"
        got = f"{place} {fault} on {bad['host']}"
        remedy = "create it, or choose another --out (here --dir)"
        yield Finding("directory", BREAKS, got, remedy)
        return
    blind = next((facts for facts in ranks if not facts["seen"]), None)
    if blind is not None:
        got = f"{place}: a file of {first['host']} is not seen on {blind['host']}"
        yield Finding("directory", BREAKS, got, "choose a shared file system for --out")
        return
    makers = sum(facts["exclusive"] for facts in ranks)
    got = f"{place} is written and seen by all ranks"
    yield Finding("directory", FINE, got)
    if makers != 1:
        got = f"{makers} ranks created a file that exactly one should have created"
        remedy = "run no array jobs (--shard) there, or choose another file system"
        yield Finding("exclusive files", BREAKS, got, remedy)
    yield from locks(ranks)
    yield from room(first)


def locks(ranks: Sequence[Facts]) -> Iterator[Finding]:
    """Check that file locks work in the campaign's directory, which HDF5 uses.

    HDF5 does not use them if the environment says so.

    ranks : facts of each rank
    """
    states = [f["locks"] for f in ranks[1:]] or [ranks[0]["locks"]]
    off = ranks[0]["locking"].upper() in {"FALSE", "0", "BEST_EFFORT"}
    variable = f"HDF5_USE_FILE_LOCKING={ranks[0]['locking'] or 'not set'}"
    wrong = sorted({state for state in states if state != "held"})
    if not wrong:
        yield Finding("file locks", FINE, f"respected by all ranks, {variable}")
    elif off:
        yield Finding("file locks", FINE, f"{', '.join(wrong)}, {variable}")
    else:
        remedy = "export HDF5_USE_FILE_LOCKING=FALSE, and gather from one job at a time"
        yield Finding("file locks", BREAKS, f"{', '.join(wrong)}, {variable}", remedy)


def room(facts: Facts) -> Iterator[Finding]:
    """Check that the file system of the campaign's directory has free space.

    facts : facts of rank 0
    """
    free = facts["free"]
    if free is None:
        return
    level = BREAKS if free < LEAST_FREE else SLOW if free < LITTLE_FREE else FINE
    remedy = "free space: hpcwhirl campaign --dry-run predicts how much is needed"
    yield Finding("disk", level, f"{free / 1e9:.1f} GB free", remedy * (level != FINE))
