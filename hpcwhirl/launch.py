"""How this process was started: alone, as one of several MPI ranks, or as a shard.

This is the only module that imports mpi4py, and only if several ranks were started or
`doctor` inspects MPI. A single process never initializes MPI: it runs the code of rank
0 with `Alone` as its communicator.
"""

from __future__ import annotations

import array
import atexit
import fcntl
import os
import re
import shutil
import signal
import stat
import sys
import termios
import threading
import time
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from hpcwhirl.errors import STOPPED, InputError, shown

if TYPE_CHECKING:
    from mpi4py.MPI import Comm

# Environment variables that MPI launchers set: the number of ranks (LAUNCHERS), any
# setting of PMI (PMI: prefixes), the number of this rank (RANKS).
LAUNCHERS = ("PMI_SIZE", "OMPI_COMM_WORLD_SIZE", "MPI_LOCALNRANKS", "PMIX_SIZE")
PMI = ("PMI_", "PMIX_", "OMPI_COMM_WORLD_", "MPI_LOCAL", "PALS_")
RANKS = ("PMI_RANK", "PMIX_RANK", "OMPI_COMM_WORLD_RANK", "SLURM_PROCID")
FAMILIES = {  # MPI family: words in the version text of its libraries and launchers
    "Open MPI": ("open mpi", "openrte", "prte"),
    "MPICH": ("mpich", "hydra", "intel(r) mpi", "mvapich", "cray mpich"),
}
READY = 13  # tag of the message by which rank 0 wakes another rank
REST = 1e-4, 0.01  # s, first and longest pause between two checks for that message
LOOK_EVERY = 0.5  # s between checks whether the launcher still lives
HEARD_WITHIN = 2.0  # s, longest wait for the launcher to read a rank's last output
MOST_SHARDS = 100_000  # more than any scheduler's array has elements


class Alone:
    """Communicator of a single process, in place of mpi4py's where MPI is not started.

    It has those methods of an mpi4py communicator that hpcwhirl calls.
    """

    rank, size = 0, 1

    def bcast(self, value: Any, root: int = 0) -> Any:  # noqa: ARG002
        """Return the value of the only rank."""
        return value

    def scatter(self, values: Any, root: int = 0) -> Any:  # noqa: ARG002
        """Return `values[0]`, the part that belongs to the only rank."""
        return values[0]

    def gather(self, value: Any, root: int = 0) -> list[Any]:  # noqa: ARG002
        """Return a list of one: the value of the only rank."""
        return [value]

    def allgather(self, value: Any) -> list[Any]:
        """Return a list of one: the value of the only rank."""
        return [value]

    def Barrier(self) -> None:
        """Return at once, since there is no other rank to wait for."""

    def Iprobe(self) -> bool:
        """Return False: no other rank can send a message."""
        return False

    def Abort(self, code: int) -> None:
        """Do nothing: MPI would end the other ranks here, and there are none."""


Communicator: TypeAlias = "Alone | Comm"
ALONE = Alone()


def launched_ranks() -> int:
    """Return the number of MPI ranks that the launcher (mpirun, srun) has started.

    It is read from the environment variables `LAUNCHERS`, without importing MPI; it is
    1 without a launcher.
    """
    sizes = [os.environ[name] for name in LAUNCHERS if name in os.environ]
    if {"PMIX_RANK", "PMI_RANK", "SLURM_PROCID"} & os.environ.keys():
        sizes.append(os.environ.get("SLURM_STEP_NUM_TASKS", "1"))
    return max(
        [int(size) for size in sizes if size.isdecimal() and len(size) < 10], default=1
    )


def launched_first() -> bool:
    """Return whether this process is rank 0 according to the launcher's environment.

    The environment variables `RANKS` are read, without importing MPI; True without a
    launcher.
    """
    return next((os.environ[n] for n in RANKS if n in os.environ), "0") == "0"


def communicator() -> Communicator:
    """Return the MPI communicator of all ranks started; `ALONE` for a single process.

    Raises
    ------
    InputError
        if MPI sees another number of ranks than the launcher has started
    """
    ranks = launched_ranks()
    if ranks == 1:
        return ALONE
    comm = ALONE if alien_library() else world()
    if ranks != comm.size:
        why = "mpirun and mpi4py's MPI library do not belong together"
        if not has_pmi():
            why = "srun offered them no PMI, see srun --mpi=list: pmix for Open MPI, "
            why += "pmi2 for MPICH; or use mpirun"
        msg = f"the launcher started {ranks} ranks but MPI sees {comm.size}: {why}"
        raise InputError(msg)
    return comm


def rest_until_root(comm: Any) -> None:
    """Wait, nearly without using a core, until rank 0 has called this function, too.

    Every rank must call it, before a collective call of MPI in which it would otherwise
    keep a core busy while rank 0 still works.
    """
    if comm.rank == 0:
        for rank in range(1, comm.size):
            comm.send(None, dest=rank, tag=READY)
        return
    rest, longest = REST
    while not comm.Iprobe(source=0, tag=READY):
        time.sleep(rest)
        rest = min(2.0 * rest, longest)
    comm.recv(source=0, tag=READY)


def from_root(comm: Any, value: Any) -> Any:
    """Return the value that rank 0 passes, on every rank; the others sleep meanwhile.

    Parameters
    ----------
    comm : communicator of all ranks, each of which must call this function
    value : the value on rank 0; not used on other ranks
    """
    rest_until_root(comm)
    return comm.bcast(value, root=0)


def end_all(comm: Communicator, code: int) -> None:
    """End all ranks, once the launcher has read the output of this rank.

    After an abort, MPICH's mpirun discards output of a rank that it has not read yet,
    so the line with the reason would be lost.

    Parameters
    ----------
    comm : all ranks; for `ALONE` nothing is ended
    code : exit code
    """
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):
            stream.flush()
    end = time.monotonic() + HEARD_WITHIN
    while comm.size > 1 and any(map(_unread, (1, 2))) and time.monotonic() < end:
        time.sleep(0.01)
    comm.Abort(code)


def _unread(number: int) -> int:
    """Return how many bytes in a pipe its reader has not read yet; 0 if it is no pipe.

    number : file descriptor of the pipe, such as 1 for stdout
    """
    waiting = array.array("i", [0])
    try:
        if stat.S_ISFIFO(os.fstat(number).st_mode):
            fcntl.ioctl(number, termios.FIONREAD, waiting)
    except OSError:
        return 0
    return waiting[0]


def world() -> Comm:
    """Initialize MPI and return mpi4py's communicator of all ranks, `COMM_WORLD`.

    From now on this rank ends by itself if the process that started it dies.
    """
    from mpi4py import MPI

    _watch_launcher()
    return MPI.COMM_WORLD


@dataclass
class Launcher:
    """The process that started this rank, such as MPICH's proxy.

    If it is killed, for example for lack of memory, nobody ends its ranks: they would
    wait for ever in MPI's end, and keep their cores busy.

    Attributes
    ----------
    patience : time from its death until this rank ends, s
    number : its process number; 0: this process is no rank
    """

    patience: float = 30.0
    number: int = 0

    @property
    def is_dead(self) -> bool:
        """Whether it has ended, so that this process has another parent now."""
        return self.number not in (0, os.getppid())


launcher = Launcher()


@cache
def _watch_launcher() -> None:
    """Start the thread that ends this rank some time after its launcher has died.

    MPI is finalized by Python, so that the thread still runs meanwhile.
    """
    launcher.number = os.getppid()
    threading.Thread(target=_end_as_orphan, daemon=True).start()
    atexit.register(_finalize)


def _end_as_orphan() -> None:
    while not launcher.is_dead:
        time.sleep(LOOK_EVERY)
    time.sleep(launcher.patience)
    os._exit(STOPPED)


def _finalize() -> None:
    from mpi4py import MPI

    if MPI.Is_initialized() and not MPI.Is_finalized():
        MPI.Finalize()


def node_of(comm: Communicator) -> Communicator:
    """Return the communicator of those ranks of `comm` that run on the same node.

    All ranks of `comm` must call this function.
    """
    if isinstance(comm, Alone):
        return comm
    from mpi4py import MPI

    return comm.Split_type(MPI.COMM_TYPE_SHARED)


def mpirun() -> str:
    """Return the path of the mpirun that starts ranks here; "" if there is none.

    It is that on the path, else that beside this Python, as in a notebook whose
    environment is not activated.
    """
    beside = str(Path(sys.executable).parent)
    places = os.pathsep.join([os.environ.get("PATH", os.defpath), beside])
    found = (shutil.which(name, path=places) for name in ("mpirun", "mpiexec"))
    return next((path for path in found if path), "")


def library() -> str:
    """Return name and version of the MPI library that mpi4py has loaded.

    They are the first line of the library's version text.
    """
    from mpi4py import MPI

    return MPI.Get_library_version().splitlines()[0].strip("\x00 ")


def library_of(comm: Communicator) -> str:
    """Return name and version of the MPI library in use; for one process, ``none``."""
    return "none" if isinstance(comm, Alone) else library()


def family(text: str) -> str:
    """Return the MPI family that a version text names: a key of `FAMILIES`; else "".

    text : version text of an MPI library or launcher
    """
    low = text.lower()
    fits = (name for name, words in FAMILIES.items() if any(w in low for w in words))
    return next(fits, "")


def has_pmi() -> bool:
    """Return whether the launcher offers PMI, by which ranks find each other."""
    return any(name.startswith(PMI) for name in os.environ)


def alien_family() -> str:
    """Return the MPI family that would abort this process if it were initialized here.

    It is a key of `FAMILIES`, or "" if none would abort. MPICH aborts under Open MPI's
    mpirun; Open MPI aborts under an srun without PMI (``--mpi=none``), unless it was
    built with Slurm's PMI-1, which works with pmi2.
    """
    if "OMPI_COMM_WORLD_SIZE" in os.environ:
        return "MPICH"
    return "" if launched_ranks() == 1 or has_pmi() else "Open MPI"


def alien_library() -> str:
    """Return the name of mpi4py's MPI library if its start would abort this process.

    Otherwise return "". If one of the MPI families would abort under this launcher, the
    library's name is read without initializing MPI; a library of the other family is
    then initialized.
    """
    if not (alien := alien_family()):
        return ""
    without_mpi()
    from mpi4py import MPI

    if family(name := library()) == alien:
        return name
    if not MPI.Is_initialized():
        MPI.Init_thread()
        atexit.register(_finalize)
    return ""


def without_mpi() -> None:
    """Prevent later imports, such as that of a parallel h5py, from initializing MPI.

    A child process of a rank inherits the rank's environment; with MPI it would claim
    to be that rank.
    """
    import mpi4py

    mpi4py.rc.initialize = mpi4py.rc.finalize = False


def interpreter(module: str, *words: str) -> list[str]:
    """Return the command line of a new Python process that runs `main` of a module.

    The new process gets the ``sys.path`` of this one, so that another version of
    hpcwhirl in the working directory is not imported.

    Parameters
    ----------
    module : dotted name of a module of hpcwhirl that has a function `main`
    words : arguments of the process
    """
    path = ascii(sys.path)
    run = f"import sys; sys.path[:] = {path}; from {module} import main; main()"
    return [sys.executable, "-P", "-c", run, *words]


def fate(code: int) -> str:
    """Return how a process ended, such as "ended with exit code 1", for a message.

    code : return code as `subprocess` gives it: negative for a signal
    """
    if code >= 0:
        return f"ended with exit code {code}"
    hint = ", perhaps for lack of memory" if -code == signal.SIGKILL else ""
    return f"died of {signal.Signals(-code).name}{hint}"


@dataclass(frozen=True)
class Shard:
    """One of the N parts into which a campaign's cases are divided (``--shard I/N``).

    Each part is computed by a job of its own, without MPI between the jobs.

    Attributes
    ----------
    number : I, counted from 1
    of : N
    """

    number: int
    of: int

    def __str__(self) -> str:
        """Return the shard as the text ``I/N`` that the user gives."""
        return f"{self.number}/{self.of}"


def parse_shard(text: str) -> Shard:
    """Return the shard for the text ``I/N`` of the option ``--shard``.

    Raises
    ------
    InputError
        unless I and N are whole numbers with 1 <= I <= N <= `MOST_SHARDS`
    """
    found = re.fullmatch(r"([0-9]{1,19})/([0-9]{1,19})", text)
    shard = Shard(*map(int, found.groups())) if found else None
    if shard and 1 <= shard.number <= shard.of <= MOST_SHARDS:
        return shard
    msg = f"--shard must be I/N with 1 <= I <= N <= {MOST_SHARDS}, got {shown(text)}"
    raise InputError(msg)
