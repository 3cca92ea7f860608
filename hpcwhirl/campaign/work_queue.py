"""Rank 0's queue of units of work, and the requests of workers that it must answer.

A unit is one job; the unit with the longest predicted time is handed out first.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Collection, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.campaign.plan.cost import Costs
from hpcwhirl.planner.planner import Completion, Job, JobCode, Jobs, Planner

# largest number of units left at which the queue is sorted again when predictions
# improve; it takes 30 ms, in which rank 0 does not answer
SORTED_ANEW = 20_000
EVERY = 8  # the queue is sorted again after 1/EVERY of the units left have finished
# An answer to a worker gets units until their predicted time is `SHORTEST`, s, or
# `A_RANK`, s, times the number of ranks (some 20 answers of rank 0), if that is more.
SHORTEST = 0.05
A_RANK = 1e-3
MOST = 128  # largest number of units in an answer, so that MPI sends it eagerly
# s per rank, predicted time (two answers of rank 0) that an answer to a worker has
# even if it is more than its fair share, see `FAIR`
LEAST_A_RANK = 1e-4
FASTEST = 1e-4  # s, predicted time that every unit has at least
FAIR = 4  # an answer has at most 1/FAIR of an even share of the units left
GOLDEN = 0.6180339887498949
LAST = 0  # priority of units that are handed out after all others
Answers = list[tuple[int, list[int]]]  # (rank, its next units) each
Cases = NDArray[np.int64]
USUAL = 1  # priority of a job
FOLLOWING = 2  # priority of refined cases, from which others may follow


def scattered(count: int) -> NDArray[np.int64]:
    """Return 0 .. count - 1 in an order in which the first few already span the range.

    Every part of the order is spread evenly over the numbers: successive ones differ,
    modulo count, by about 0.618 count, coprime to count.
    """
    step = max(round(GOLDEN * count), 1)
    while math.gcd(step, count) > 1:
        step += 1
    return np.asarray(np.arange(count) * step % max(count, 1))


class Order(NamedTuple):
    """Order in which units of work are handed out.

    Attributes
    ----------
    last : numbers of units that are handed out after all others
    even : whether the first units are spread evenly over all cases; otherwise the
        longest goes first
    """

    last: Collection[int] = ()
    even: bool = False


LONGEST_FIRST = Order()


class WorkQueue:
    """The units of work of a campaign, handed out by predicted time, the longest first.

    Units with equal prediction are handed out in scattered order, so that those
    computed first represent all.

    Parameters
    ----------
    rows : (units,), index in `costs` of each unit's case
    costs : predicted computing times of the cases; improved with every finished unit
    ranks : number of ranks that share the work
    order : order in which units are handed out
    """

    def __init__(
        self,
        rows: Sequence[int] | Cases,
        costs: Costs,
        ranks: int = 1,
        order: Order = LONGEST_FIRST,
    ) -> None:
        self.costs, self.ranks, self.even = costs, ranks, order.even
        self.hold = max(SHORTEST, A_RANK * ranks)
        self.least = LEAST_A_RANK * ranks
        self.rows, self.predicted = array("q"), array("d")
        self.unfinished, self.turn = array("b"), array("b")
        self.queue = array("q")  # units are handed out from its end
        self.dropped = False
        self.left = 0
        self.told = self.took = 0.0  # s, predicted and actual time of finished units
        self.stale = True  # whether predictions do not use finished units yet
        self.learned = 0
        turn = np.ones(len(rows), dtype=np.int8)  # the highest priority goes out first
        turn[list(order.last)] = LAST
        own = np.asarray(rows, dtype=np.int64)
        self.add(own, turn, costs.predict(own))

    def expected(self, rows: Cases) -> NDArray[np.float64]:
        """Return the predicted time of one more unit of each of m cases, (m,), s.

        rows : (m,), indices of the cases in `costs`
        """
        grown = self.took / self.told if self.told > 0.0 else 1.0
        factor = self.costs.factor[rows]
        factor[np.isnan(factor)] = grown
        return np.asarray(factor * self.costs.nominal[rows])

    def add(
        self, rows: Cases, turn: NDArray[np.int8], predicted: NDArray[np.float64]
    ) -> None:
        """Add m units of work, to be handed out next; if the order is even, last.

        Parameters
        ----------
        rows : (m,), index in `costs` of each unit's case
        turn : (m,), priority of each unit; higher ones go out first
        predicted : (m,), predicted time of each unit, s
        """
        first, count = len(self.rows), len(rows)
        if not count:
            return
        self.rows.frombytes(rows.tobytes())
        self.predicted.frombytes(predicted.tobytes())
        self.unfinished.frombytes(bytes([1]) * count)
        self.turn.frombytes(turn.tobytes())
        self.left += count
        if self.dropped:
            return
        added = array("q", self._ordered(np.arange(first, first + count)))
        if self.even:
            self.queue = added + self.queue
        else:
            self.queue.extend(added)

    def __len__(self) -> int:
        """Return the number of units that have not been handed out."""
        return len(self.queue)

    def take(self) -> int:
        """Return the number of the next unit, removed from the queue, for rank 0."""
        return self.queue.pop()

    def bundle(self, most_units: int = MOST) -> list[int]:
        """Remove the next units for one answer to a worker; return their numbers.

        An answer has one unit, or as many short units as keep the worker busy while
        rank 0 answers all other workers; none if the queue is empty.

        Parameters
        ----------
        most_units : largest number of units
        """
        most = min(MOST, max(len(self.queue) // (FAIR * self.ranks), 1))
        out: list[int] = []
        seconds = 0.0
        while (
            self.queue
            and len(out) < most_units
            and (seconds < self.least or (len(out) < most and seconds < self.hold))
        ):
            seconds += max(float(self.predicted[self.queue[-1]]), FASTEST)
            out.append(self.queue.pop())
        return out

    def first(self) -> list[list[int]]:
        """Return the numbers of the first units of each rank, at most an even share.

        Rank 0 gets none, since it takes units one by one.
        """
        even = min(MOST, max(len(self.queue) // self.ranks, 1))
        return [[], *(self.bundle(even) for _ in range(self.ranks - 1))]

    @property
    def may_grow(self) -> bool:
        """Whether units that are being computed may add further units to the queue."""
        return False

    def task(self, unit: int) -> int:
        """Return the number that is sent to a rank so that it computes a unit.

        In this class it is the unit's own number.
        """
        return unit

    @property
    def known(self) -> int:
        """Number of all units known so far: ended, handed out or still to come."""
        return len(self.rows)

    @property
    def twins(self) -> int:
        """Number of units that compute a twin; in this class there are none."""
        return 0

    def is_twin(self, unit: int) -> bool:  # noqa: ARG002 - a subclass uses it
        """Return whether a unit computes a twin; in this class none does."""
        return False

    def hear(self, unit: int, end: Any) -> None:
        """Do nothing: in this class no units follow from how others have ended."""

    def drop(self) -> None:
        """Empty the queue: no unit is handed out any more, nor any added later."""
        self.dropped = True
        del self.queue[:]

    def finished(self, unit: int, seconds: float) -> None:
        """Record that a unit has ended, after `seconds`; sort the queue now and then.

        Predicted times are improved by the actual time, which may change the order.
        """
        self.unfinished[unit] = False
        self.told += self.predicted[unit]
        self.took += seconds
        self.costs.learn(self.rows[unit], seconds)
        self.learned += 1
        self.left -= 1
        if self.queue and self.learned * EVERY >= self.left <= SORTED_ANEW:
            self._sort_anew()

    def _sort_anew(self) -> None:
        begun = np.flatnonzero(np.frombuffer(self.unfinished, bool))
        rows = np.frombuffer(self.rows, np.int64)[begun]
        np.frombuffer(self.predicted)[begun] = self.costs.predict(rows)
        if not self.even:
            self.queue = array("q", self._ordered(np.array(self.queue)))
        self.stale, self.learned = False, 0

    def seconds_left(self) -> float:
        """Return the predicted time of all unfinished units on one core, s."""
        missed = self.took / self.told if self.told > 0.0 and self.stale else 1.0
        still = np.frombuffer(self.unfinished, bool)
        return float(np.frombuffer(self.predicted)[still].sum()) * missed

    def _ordered(self, chosen: np.ndarray) -> bytes:
        """Return units of work in reverse order of handing out, as int64 bytes.

        chosen : numbers of units
        """
        order = scattered(len(chosen))
        turn, seconds = np.frombuffer(self.turn, np.int8), np.frombuffer(self.predicted)
        keys = (turn,) if self.even else (seconds, turn)
        for key in (each[chosen] for each in keys):
            if len(key) and (key != key[0]).any():
                order = order[np.argsort(key[order], kind="stable")]
        return np.asarray(chosen[order], dtype=np.int64).tobytes()


class Questions:
    """Requests of the workers for units of work, and which of them to answer when.

    It only decides: it sends no message and reads no clock. A worker asks in advance
    and is answered at once. Only the last units, one for each rank, are reserved for
    workers without work; otherwise a unit could wait behind the long case of a busy
    rank while other ranks idle.

    Parameters
    ----------
    queue : units to hand out
    ranks : number of ranks, including rank 0
    """

    def __init__(self, queue: WorkQueue, ranks: int) -> None:
        self.queue, self.ranks = queue, ranks
        self.open: dict[int, None] = {}  # ranks in the order of their requests
        self.idle: dict[int, None] = {}  # those ranks of `open` that have no work

    def ask(self, rank: int) -> Answers:
        """Record that a rank asks for units in advance; return the answers to send now.

        An answer is (rank, numbers of its next units).
        """
        self.open[rank] = None
        return self._answer(rank) if len(self.queue) > self.ranks else self.rest()

    def hungry(self, rank: int) -> Answers:
        """Record that a rank has run out of units; return the answers to send now.

        An answer is (rank, numbers of its next units). This rank gets none if its
        request has been answered already.
        """
        if rank in self.open:
            self.idle[rank] = None
        return self.rest()

    def rest(self) -> Answers:
        """Return the answers to send now to ranks without work.

        An answer is (rank, numbers of its next units). Once no unit is left, all open
        requests are answered by an empty list.
        """
        due: Answers = []
        while self.queue and self.idle:
            due += self._answer(next(iter(self.idle)))
        if self.queue or self.queue.may_grow:
            return due
        waiting, self.open, self.idle = list(self.open), {}, {}
        return due + [(rank, []) for rank in waiting]

    def _answer(self, rank: int) -> Answers:
        del self.open[rank]
        self.idle.pop(rank, None)
        return [(rank, self.queue.bundle())]


class JobQueue(WorkQueue):
    """A work queue whose units are jobs; an ended job may add the jobs that follow.

    Those are handed out next.

    Parameters
    ----------
    planner : is told how jobs end and returns the jobs that follow
    jobs : jobs that are left
    code : numbering of the jobs, by which they are sent to ranks
    costs : predicted computing times of the planner's cases
    ranks : number of ranks that share the work
    order : order in which jobs are handed out; its `last` holds case numbers
    """

    def __init__(
        self,
        planner: Planner,
        jobs: Jobs,
        code: JobCode,
        costs: Costs,
        ranks: int = 1,
        order: Order = LONGEST_FIRST,
    ) -> None:
        self.planner, self.code, self.apart = planner, code, order.last
        self.twin, self.stage = array("h"), array("b")
        costs.cover(planner)
        super().__init__((), costs, ranks, Order(even=order.even))
        self._keep(jobs, costs.predict(jobs.row))

    @property
    def may_grow(self) -> bool:
        """Whether jobs that are being computed may lead to further jobs."""
        return self.left > 0 and not self.dropped and not self.planner.is_plain

    @property
    def known(self) -> int:
        """Number of all jobs known so far, with those of branches that wait."""
        return len(self.rows) + len(self.planner.waiting)

    def seconds_left(self) -> float:
        """Return the predicted time of all unfinished units on one core, s.

        Cases of branches that wait for others are included.
        """
        waiting = self.costs.predict(self.planner.waiting)
        return super().seconds_left() + float(waiting.sum())

    @property
    def twins(self) -> int:
        """Number of units that compute a twin."""
        return int(np.count_nonzero(np.frombuffer(self.twin, np.int16)))

    def is_twin(self, unit: int) -> bool:
        """Return whether a unit computes a twin; unit : its number."""
        return self.twin[unit] > 0

    def job(self, unit: int) -> Job:
        """Return the job of a unit: case, twin and stage."""
        case = self.planner.number(self.rows[unit])
        return Job(case, self.twin[unit], self.stage[unit])

    def task(self, unit: int) -> int:
        """Return the number, by `JobCode`, that a rank is sent to compute a job.

        unit : number of the job in the queue
        """
        return self.code.encode(self.job(unit))

    def hear(self, unit: int, end: Completion) -> None:
        """Record how the job of a unit has ended, and add the jobs that follow.

        Parameters
        ----------
        unit : number of the unit
        end : how its job has ended
        """
        following = self.planner.complete(self.job(unit), end)
        if not following:
            return
        self.costs.cover(self.planner)
        row = [self.planner.row(job.case) for job in following]
        _, twin, stage = zip(*following, strict=True)
        jobs = Jobs(*(np.array(one, dtype=np.int64) for one in (row, twin, stage)))
        self._keep(jobs, self.expected(jobs.row))

    def _keep(self, jobs: Jobs, predicted: np.ndarray) -> None:
        self.twin.frombytes(jobs.twin.astype(np.int16).tobytes())
        self.stage.frombytes(jobs.stage.astype(np.int8).tobytes())
        beyond = (jobs.row >= self.planner.kind.first) & (jobs.twin == 0)
        turn = np.where(beyond, FOLLOWING, USUAL).astype(np.int8)
        if self.apart:
            apart = [self.planner.row(case) for case in self.apart]
            turn[np.isin(jobs.row, apart)] = LAST
        self.add(jobs.row, turn, predicted)
