"""How this process was started: alone, as a rank of several, as a shard of an array.

The home of mpi4py. It is imported where several ranks were started, or where a doctor
asks for it: a process alone never begins MPI, and goes the same way as rank 0 of many.
"""

from __future__ import annotations

import atexit
import os
import signal
import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

from hpcwhirl.errors import InputError, shown

if TYPE_CHECKING:
    from mpi4py.MPI import Comm

LAUNCHERS = ("PMI_SIZE", "OMPI_COMM_WORLD_SIZE", "MPI_LOCALNRANKS", "PMIX_SIZE")
PMI = ("PMI_", "PMIX_", "OMPI_COMM_WORLD_", "MPI_LOCAL", "PALS_")
RANKS = ("PMI_RANK", "PMIX_RANK", "OMPI_COMM_WORLD_RANK", "SLURM_PROCID")
FAMILIES = {
    "Open MPI": ("open mpi", "openrte", "prte"),
    "MPICH": ("mpich", "hydra", "intel(r) mpi", "mvapich", "cray mpich"),
}
MOST_SHARDS = 100_000  # more than any scheduler's array has elements


class Alone:
    """A communicator of one rank, by mpi4py's names: nobody else to tell or to hear."""

    rank, size = 0, 1

    def bcast(self, value: Any, root: int = 0) -> Any:
        """Return what the only rank has given."""
        del root
        return value

    def scatter(self, values: Any, root: int = 0) -> Any:
        """Return the part of the only rank."""
        del root
        return values[0]

    def gather(self, value: Any, root: int = 0) -> list[Any]:
        """Return what every rank has given."""
        del root
        return [value]

    def allgather(self, value: Any) -> list[Any]:
        """Return what every rank has given."""
        return [value]

    def Barrier(self) -> None:
        """Wait for nobody."""

    def Iprobe(self) -> bool:
        """Return whether a message has come."""
        return False

    def Abort(self, code: int) -> None:
        """End the other ranks, of which there are none; this one ends by itself."""


Communicator: TypeAlias = "Alone | Comm"
ALONE = Alone()


def launched_ranks() -> int:
    """Return how many ranks a launcher says there are, without importing MPI."""
    sizes = [os.environ[name] for name in LAUNCHERS if name in os.environ]
    if {"PMIX_RANK", "PMI_RANK", "SLURM_PROCID"} & os.environ.keys():
        sizes.append(os.environ.get("SLURM_STEP_NUM_TASKS", "1"))
    return max(
        [int(size) for size in sizes if size.isdecimal() and len(size) < 10], default=1
    )


def launched_first() -> bool:
    """Return whether a launcher calls this process its first, whatever MPI sees."""
    return next((os.environ[n] for n in RANKS if n in os.environ), "0") == "0"


def communicator() -> Communicator:
    """Return the ranks that a launcher has started together, or this process alone.

    Raises
    ------
    InputError
        where MPI does not see as many as were started
    """
    ranks = launched_ranks()
    if ranks == 1:
        return ALONE
    comm = ALONE if alien_library() else world()
    if ranks != comm.size:
        why = "mpirun and mpi4py's MPI library do not belong together"
        if not has_pmi():
            why = "srun offered it no PMI, see srun --mpi=list: pmix for Open MPI, "
            why += "pmi2 for MPICH; or use mpirun"
        msg = f"the launcher started {ranks} ranks but MPI sees {comm.size}: {why}"
        raise InputError(msg)
    return comm


def world() -> Comm:
    """Begin MPI and return all ranks that it sees."""
    from mpi4py import MPI

    return MPI.COMM_WORLD


def node_of(comm: Communicator) -> Communicator:
    """Return the ranks of this node."""
    if isinstance(comm, Alone):
        return comm
    from mpi4py import MPI

    return comm.Split_type(MPI.COMM_TYPE_SHARED)


def library() -> str:
    """Return what the MPI library says it is."""
    from mpi4py import MPI

    return MPI.Get_library_version().splitlines()[0].strip("\x00 ")


def library_of(comm: Communicator) -> str:
    """Return what the MPI library of some ranks says it is, or ``none``."""
    return "none" if isinstance(comm, Alone) else library()


def family(text: str) -> str:
    """Return which MPI a library or launcher says it is of, or an empty text."""
    low = text.lower()
    known = (name for name, words in FAMILIES.items() if any(w in low for w in words))
    return next(known, "")


def has_pmi() -> bool:
    """Return whether a launcher has left word of how ranks find each other."""
    return any(name.startswith(PMI) for name in os.environ)


def alien_family() -> str:
    """Return which MPI gives up if it begins here, or an empty text.

    MPICH does under Open MPI's mpirun, Open MPI under an srun that offers no PMI, as
    ``--mpi=none`` (one with Slurm's PMI-1 built in would not; pmi2 suits that, too).
    """
    if "OMPI_COMM_WORLD_SIZE" in os.environ:
        return "MPICH"
    return "" if launched_ranks() == 1 or has_pmi() else "Open MPI"


def alien_library() -> str:
    """Return the MPI library that would be aborted if it began here, or an empty text.

    What is told then is read from the library without starting it. Any other begins.
    """
    if not (alien := alien_family()):
        return ""
    without_mpi()
    from mpi4py import MPI

    if family(told := library()) == alien:
        return told
    if not MPI.Is_initialized():
        MPI.Init_thread()
        atexit.register(MPI.Finalize)
    return ""


def without_mpi() -> None:
    """Let no import begin MPI here, such as that of an h5py which writes in parallel.

    A process that a rank has begun would call itself that rank.
    """
    import mpi4py

    mpi4py.rc.initialize = mpi4py.rc.finalize = False


def interpreter(module: str, *words: str) -> list[str]:
    """Return the command that calls `main` of a module of this very program.

    Its path is that of this process: another version of the program that lies in the
    working directory is not taken for it.
    """
    path = ascii(sys.path)
    run = f"import sys; sys.path[:] = {path}; from {module} import main; main()"
    return [sys.executable, "-P", "-c", run, *words]


def fate(code: int) -> str:
    """Return how a process ended, by its return code, to follow its name."""
    if code >= 0:
        return f"ended with exit code {code}"
    hint = ", perhaps for lack of memory" if -code == signal.SIGKILL else ""
    return f"died of {signal.Signals(-code).name}{hint}"


@dataclass(frozen=True)
class Shard:
    """The I-th of N shares of a campaign, counted from 1."""

    number: int
    of: int

    def __str__(self) -> str:
        """Return ``I/N``."""
        return f"{self.number}/{self.of}"


def parse_shard(text: str) -> Shard:
    """Return the shard of a text ``I/N``.

    Raises
    ------
    InputError
        where it is not two whole numbers with 1 <= I <= N
    """
    number, slash, of = text.partition("/")
    parts = number, of
    digits = all(p.isascii() and p.isdigit() and len(p) < 20 for p in parts)
    if slash and digits and 1 <= int(number) <= int(of) <= MOST_SHARDS:
        return Shard(int(number), int(of))
    msg = f"--shard must be I/N with 1 <= I <= N <= {MOST_SHARDS}, got {shown(text)}"
    raise InputError(msg)
