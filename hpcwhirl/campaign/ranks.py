"""Distribution of jobs over MPI ranks; rank 0 hands out jobs and computes, too.

The first units of work go out together. From then on messages are point to point: a
worker (any other rank) asks for its next units when it begins the units it has, so that
it need not wait, and reports in the same message what it has finished; rank 0 answers
between the slices of its own case. With many ranks or short cases an answer has several
units, see `WorkQueue.bundle`.

Every message is received: each question has one answer, and each worker ends only after
one HALT, which it gets when the campaign stops or has ended. Under `srun --mpi=pmi2`,
an unreceived message would make its sender hang in MPI_Finalize.
"""

from __future__ import annotations

import socket
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from hpcwhirl.campaign.stop import Stop
from hpcwhirl.campaign.work_queue import Answers, Questions, WorkQueue
from hpcwhirl.errors import MissingFileError, cases_told, say, twins_told
from hpcwhirl.launch import ALONE, Communicator
from hpcwhirl.store.directory.runs import Runs, Share

ASK, HUNGRY, BYE = "ask", "hungry", "bye"  # words in messages from worker to rank 0
WORK, HALT = 11, 12  # tags of messages from rank 0 to worker
IDLE = 1e-3  # s between checks for messages while there is nothing to do


# computes and journals a task, and returns its completion; its second argument is
# called between slices, and raises Stop on a stop request
Evaluate = Callable[[int, Callable[[], None]], Any]
Notice = Callable[[int, Any], None]
Unit = tuple[int, int]  # (number in the queue, task that is sent to a rank)
Done = tuple[int, Any, float]  # (number of a unit, its completion, its time, s)


@dataclass
class Tally:
    """How this rank has used its time in one run.

    Attributes
    ----------
    busy : time spent on computing and writing cases, s; on rank 0 without the time for
        answering workers
    span : time from the first units sent until all ranks have ended, s
    cases : number of computations finished here, including twins and longer runs
    seconds : time of the last computation, s
    beside : time of a computation outside the kernel, s: the median over this rank
    first : by how much that time was longer in this rank's first computation, s
    begun : start of the run, s, by `time.perf_counter`
    waits : function called repeatedly while this rank waits for others
    """

    busy: float = 0.0
    span: float = 0.0
    cases: int = 0
    seconds: float = 0.0
    beside: float = 0.0
    first: float = 0.0
    begun: float = field(default_factory=time.perf_counter)
    waits: Callable[[], None] = lambda: None

    @contextmanager
    def computing(self) -> Iterator[None]:
        """Measure the time of the computation in the block, even if it is stopped.

        A computation that is not stopped is counted in `cases`.
        """
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds = time.perf_counter() - start
            self.busy += self.seconds
        self.cases += 1

    def wait(self) -> None:
        """Let this rank wait for `IDLE` seconds, after calling `waits`."""
        self.waits()
        time.sleep(IDLE)

    def close(self) -> None:
        """Set `span` to the time since the first units were sent, s."""
        self.span = time.perf_counter() - self.begun


def map_ranks(
    queue: WorkQueue,
    evaluate: Evaluate,
    notice: Notice,
    stopping: Callable[[], bool],
    comm: Communicator,
    tally: Tally,
) -> bool:
    """Compute all units of work (jobs) on the ranks of `comm`; every rank must call.

    Parameters
    ----------
    queue : units to hand out; used on rank 0 only
    evaluate : computes a unit and writes its record, on the rank that calls it
    notice : called on rank 0 for every finished unit
    stopping : returns whether this process was asked to stop
    comm : communicator of all ranks
    tally : use of this rank's time, filled here

    Returns
    -------
    whether all units were computed, the same on every rank
    """
    complete = None
    if comm.rank == 0:
        root = _Root(queue, notice, stopping, comm, tally)
        comm.scatter([root.units(first) for first in queue.first()], root=0)
        complete = root.run(evaluate)
    else:
        _Worker(stopping, comm, tally).run(evaluate, comm.scatter(None, root=0))
    complete = bool(comm.bcast(complete, root=0))
    tally.close()
    return complete


class _Root:
    """Rank 0 of a run: hands out units of work (jobs) and computes some itself."""

    def __init__(
        self,
        queue: WorkQueue,
        notice: Notice,
        stopping: Callable[[], bool],
        comm: Any,
        tally: Tally,
    ) -> None:
        self.queue, self.tally = queue, tally
        self.questions = Questions(queue, comm.size)
        self.notice, self.stopping, self.comm = notice, stopping, comm
        self.at_work = set(range(1, comm.size))
        self.halted = False

    def run(self, evaluate: Evaluate) -> bool:
        try:
            while self.queue or self.queue.may_grow:
                self.between()
                if self.queue:
                    ((unit, task),) = self.units([self.queue.take()])
                    with self.tally.computing():
                        end = evaluate(task, self.while_busy)
                    self.done(unit, end, self.tally.seconds)
                elif self.queue.may_grow:  # running units may add others
                    self.tally.wait()
        except Stop:
            self.queue.drop()
        self.await_workers()
        return self.queue.left == 0

    def await_workers(self) -> None:
        """Answer messages of the other ranks until every one of them has ended.

        It is called when rank 0 has no more work or after a stop request.
        """
        while self.at_work:
            if not self.serve():
                self.tally.wait()
            if self.stopping() and not self.halted:
                self.halt()
        if not self.halted:
            self.dismiss()

    def done(self, unit: int, end: Any, seconds: float) -> None:
        self.queue.finished(unit, seconds)
        self.queue.hear(unit, end)
        self.notice(unit, end)

    def while_busy(self) -> None:
        """Answer messages of other ranks between slices of rank 0's computation.

        The time for this is not counted as part of that computation.
        """
        start = time.perf_counter()
        try:
            self.between()
        finally:
            self.tally.busy -= time.perf_counter() - start

    def between(self) -> None:
        """Answer messages of other ranks; stop them on request, and raise Stop."""
        self.serve()
        if self.stopping() and not self.halted:
            self.halt()
        if self.halted:
            raise Stop

    def halt(self) -> None:
        self.halted = True
        self.queue.drop()
        self.dismiss()

    def dismiss(self) -> None:
        """Send HALT to every other rank, even to those that have no more work."""
        for rank in range(1, self.comm.size):
            self.comm.send(None, dest=rank, tag=HALT)

    def serve(self) -> bool:
        """Answer all messages of workers that have arrived; return whether any had."""
        any_came = False
        while self.comm.Iprobe():
            any_came = True
            rank, word, finished, wish = self.comm.recv()
            if word == ASK:
                self.send(self.questions.ask(rank))
            elif word == HUNGRY:
                self.send(self.questions.hungry(rank))
            else:
                self.at_work.discard(rank)
            for one in finished:
                self.done(*one)
            if wish and not self.halted:  # the worker was asked to stop
                self.halt()
        self.send(self.questions.rest())
        return any_came

    def send(self, answers: Answers) -> None:
        for rank, units in answers:
            self.comm.send(self.units(units), dest=rank, tag=WORK)

    def units(self, numbers: list[int]) -> list[Unit]:
        """Return (number, task) of units of work; task: the job by `JobCode`.

        Workers get units in this form.

        numbers : numbers of the units in the queue
        """
        return [(number, self.queue.task(number)) for number in numbers]


class _Worker:
    """Any rank but 0 in a run: asks rank 0 for units of work, computes, and reports."""

    def __init__(self, stopping: Callable[[], bool], comm: Any, tally: Tally) -> None:
        self.stopping, self.comm, self.tally = stopping, comm, tally
        self.halted = False
        self.finished: list[Done] = []

    def run(self, evaluate: Evaluate, units: list[Unit]) -> None:
        try:
            while units and not self.halted:
                self.tell(ASK)
                for unit, task in units:
                    with self.tally.computing():
                        end = evaluate(task, self.between)
                    self.finished.append((unit, end, self.tally.seconds))
                    self.between()
                units = self.wait()
        except Stop:
            self.wait()  # a request is always open here: receive its answer
        self.tell(BYE)
        while not self.halted:
            self.tally.wait()
            self.look()

    def tell(self, word: str) -> None:
        """Send rank 0 what this worker wants, what it has finished, whether to stop.

        word : `ASK` for further units, `HUNGRY` if there is no unit left here, `BYE` at
            the end
        """
        told = self.comm.rank, word, self.finished, self.stopping()
        self.comm.send(told, dest=0)
        self.finished = []

    def wait(self) -> list[Unit]:
        """Wait for the next units of work from rank 0; return them, [] at the end."""
        asked = False
        while not self.comm.Iprobe(source=0, tag=WORK):
            if not asked:
                self.tell(HUNGRY)
                asked = True
            self.look()
            self.tally.wait()
        units: list[Unit] = self.comm.recv(source=0, tag=WORK)
        return units

    def look(self) -> None:
        if self.comm.Iprobe(source=0, tag=HALT):
            self.comm.recv(source=0, tag=HALT)
            self.halted = True

    def between(self) -> None:
        self.look()
        if self.halted or self.stopping():
            raise Stop


def keep_shares(
    runs: Runs,
    run: int,
    tally: Tally,
    comm: Communicator = ALONE,
    stopped: str = "",
    twins: int = 0,
) -> None:
    """Write and print, on rank 0, how all ranks used their time in a run.

    Parameters
    ----------
    runs : files of the campaign's runs
    run : number of this run
    tally : use of this rank's time
    comm : communicator of all ranks, each of which must call
    stopped : reason for an early stop of this rank; "": none
    twins : on rank 0, number of twins among all ranks' computations
    """
    own = {"rank": comm.rank, "host": socket.gethostname(), "cases": tally.cases}
    own |= {"busy": tally.busy, "span": tally.span}
    if tally.cases:
        own |= {"beside": tally.beside, "first": tally.first}
    gathered = comm.gather((own, stopped), root=0)
    if gathered is not None:
        shares = [share for share, _ in gathered]
        say(told(shares, twins))
        try:
            why = next((why for _, why in gathered if why), "")
            runs.write(run, shares, why)
        except MissingFileError as full:  # results do not need this file
            say(f"the ranks' times were not kept: {full}")


def told(shares: list[Share], twins: int = 0) -> str:
    """Return one line on a run: cases, time, cases per second, shares of busy time.

    shares, twins : use of time of each rank; number of their computations of twins
    """
    span = max(share["span"] for share in shares)
    busy = [share["busy"] / max(share["span"], 1e-9) for share in shares]
    every = sum(share["cases"] for share in shares)
    cases, noun = cases_told(every - twins), "cases"
    if twins:
        cases, noun = f"{cases} and {twins_told(twins)}", "cases and twins"
    ranks = f"{len(shares)} rank{'s' if len(shares) > 1 else ''}"
    least = f"{min(busy):.3f} to {max(busy):.3f}" if len(busy) > 1 else f"{busy[0]:.3f}"
    return (
        f"{cases} in {span:.1f} s on {ranks}: "
        f"{every / max(span, 1e-9):.3g} {noun}/s, busy fraction {least}"
    )
