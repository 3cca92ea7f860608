"""Hand cases out over MPI ranks; rank 0 computes too. A serial twin does the same.

Messages are point to point. A worker asks for its next case when it begins one, so
that it does not wait; rank 0 answers between the slices of its own case.
"""

from __future__ import annotations

import os
import time
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any, Protocol

from hpcwhirl.errors import InputError

ASK, DONE, BYE = 1, 2, 3  # worker to rank 0
WORK, HALT = 11, 12  # rank 0 to worker
NOTHING = -1
IDLE = 1e-3  # s between looks while there is nothing to do
LAUNCHERS = ("PMI_SIZE", "OMPI_COMM_WORLD_SIZE", "MPI_LOCALNRANKS", "PMIX_SIZE")


class Stop(Exception):  # noqa: N818
    """Raised between slices when this process has been asked to end."""


class Evaluate(Protocol):
    """Computes and keeps one unit of work; returns the statuses of its cases."""

    def __call__(self, unit: int, between_slices: Callable[[], None]) -> list[str]:
        """Return the status of each case; let `Stop` through."""


Notice = Callable[[int, list[str]], None]


def launched_ranks() -> int:
    """Return how many ranks a launcher says there are, without importing MPI."""
    sizes = [os.environ[name] for name in LAUNCHERS if name in os.environ]
    if {"PMIX_RANK", "PMI_RANK", "SLURM_PROCID"} & os.environ.keys():
        sizes.append(os.environ.get("SLURM_STEP_NUM_TASKS", "1"))
    return max([int(size) for size in sizes if size.isdigit()], default=1)


def communicator() -> Any:
    """Return COMM_WORLD under a launcher of several ranks, else None without MPI."""
    ranks = launched_ranks()
    if ranks == 1:
        return None
    from mpi4py import MPI

    if ranks != MPI.COMM_WORLD.size:
        msg = (
            f"the launcher started {ranks} ranks but MPI sees {MPI.COMM_WORLD.size}: "
            "mpirun and mpi4py's MPI library do not belong together"
        )
        raise InputError(msg)
    return MPI.COMM_WORLD


def map_serial(
    order: Sequence[int],
    evaluate: Evaluate,
    notice: Notice,
    stopping: Callable[[], bool],
) -> bool:
    """Evaluate the units one after the other; return whether all were."""

    def between() -> None:
        if stopping():
            raise Stop

    try:
        for case in order:
            between()
            notice(case, evaluate(case, between))
    except Stop:
        return False
    return True


def map_ranks(
    order: Sequence[int],
    evaluate: Evaluate,
    notice: Notice,
    stopping: Callable[[], bool],
    comm: Any,
) -> bool:
    """Evaluate the units on all ranks of `comm`; every rank must call.

    Parameters
    ----------
    order : units, the longest first; rank 0's counts
    evaluate : computes and keeps a unit on the rank that calls it
    notice : told on rank 0 of every finished unit
    stopping : whether this process has been asked to end
    comm : MPI communicator

    Returns
    -------
    whether all units were evaluated, the same on every rank
    """
    if comm.size == 1:
        return map_serial(order, evaluate, notice, stopping)
    if comm.rank == 0:
        complete = _Root(order, notice, stopping, comm).run(evaluate)
    else:
        _Worker(stopping, comm).run(evaluate)
        complete = None
    return bool(comm.bcast(complete, root=0))


class _Root:
    """Rank 0: hands out, computes, counts."""

    def __init__(
        self,
        order: Sequence[int],
        notice: Notice,
        stopping: Callable[[], bool],
        comm: Any,
    ) -> None:
        from mpi4py import MPI

        self.queue = deque(order)
        self.left = len(order)
        self.notice, self.stopping, self.comm = notice, stopping, comm
        self.at_work = set(range(1, comm.size))
        self.halted = False
        self.status = MPI.Status()

    def run(self, evaluate: Evaluate) -> bool:
        try:
            while self.queue:
                self.between()
                if self.queue:
                    case = self.queue.popleft()
                    self.done(case, evaluate(case, self.between))
        except Stop:
            self.queue.clear()
        while self.at_work:
            if not self.serve():
                time.sleep(IDLE)
            if self.stopping() and not self.halted:
                self.halt()
        return self.left == 0

    def done(self, unit: int, statuses: list[str]) -> None:
        self.left -= 1
        self.notice(unit, statuses)

    def between(self) -> None:
        """Serve messages; pass a wish to stop on to every worker, then obey it."""
        self.serve()
        if self.stopping() and not self.halted:
            self.halt()
        if self.halted:
            raise Stop

    def halt(self) -> None:
        self.halted = True
        self.queue.clear()
        for rank in self.at_work:
            self.comm.send(None, dest=rank, tag=HALT)

    def serve(self) -> bool:
        """Answer every message that has come in; return whether there was one."""
        any_came = False
        while self.comm.Iprobe(status=self.status):
            any_came = True
            rank, tag = self.status.Get_source(), self.status.Get_tag()
            content = self.comm.recv(source=rank, tag=tag)
            if tag == ASK:
                case = self.queue.popleft() if self.queue else NOTHING
                self.comm.send(case, dest=rank, tag=WORK)
            elif tag == DONE:
                self.done(*content)
            elif tag == BYE:
                self.at_work.discard(rank)
                if content and not self.halted:  # the worker was asked to stop
                    self.halt()
        return any_came


class _Worker:
    """Any other rank: asks ahead, computes, reports."""

    def __init__(self, stopping: Callable[[], bool], comm: Any) -> None:
        self.stopping, self.comm = stopping, comm
        self.halted = False

    def run(self, evaluate: Evaluate) -> None:
        self.comm.send(None, dest=0, tag=ASK)
        case = self.wait()
        try:
            while case != NOTHING and not self.halted:
                self.comm.send(None, dest=0, tag=ASK)
                status = evaluate(case, self.between)
                self.comm.send((case, status), dest=0, tag=DONE)
                case = self.wait()
        except Stop:
            self.wait()  # the answer to the question asked ahead
        self.comm.send(self.stopping(), dest=0, tag=BYE)

    def wait(self) -> int:
        """Return the answer to a question, leaving the core alone meanwhile."""
        while not self.comm.Iprobe(source=0, tag=WORK):
            self.look()
            time.sleep(IDLE)
        return int(self.comm.recv(source=0, tag=WORK))

    def look(self) -> None:
        if self.comm.Iprobe(source=0, tag=HALT):
            self.comm.recv(source=0, tag=HALT)
            self.halted = True

    def between(self) -> None:
        self.look()
        if self.halted or self.stopping():
            raise Stop
