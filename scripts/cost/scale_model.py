"""A discrete-event model of a campaign's ranks, with hpcwhirl's own policy in it.

Rank 0 computes in slices and serves what has come in between them; a worker asks ahead
when it begins what it has. Times of messages and cases are given, all in s.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.campaign.plan.cost import Costs
from hpcwhirl.campaign.ranks import IDLE
from hpcwhirl.campaign.work_queue import Answers, Questions, WorkQueue
from hpcwhirl.dynamics.march import SLICE_SECONDS

Floats = NDArray[np.float64]
ASKS, HUNGRY, ENDS = range(3)


@dataclass(frozen=True)
class Times:
    """What is measured: serving a message on rank 0, its way, a unit told in it, s."""

    serve: float
    way: float
    slice_: float = SLICE_SECONDS
    idle: float = IDLE / 2  # mean wait between looks
    told: float = 3e-6


@dataclass
class Outcome:
    """Seconds from the first hand-out to the end, and each rank's computing."""

    span: float
    busy: Floats
    messages: int = 0

    @property
    def efficiency(self) -> float:
        """Computing over the ranks' time."""
        return float(self.busy.sum() / (self.span * len(self.busy)))


@dataclass
class _Worker:
    """A rank as rank 0 cannot see it: when it will have nothing left to do."""

    free: float = 0.0
    question: int = 0  # that is open, or was answered last
    answered: int = -1
    when: float = 0.0  # the last answer came
    done: list[int] = field(default_factory=list)


class Model:
    """One campaign: its ranks, what is on its way, and rank 0's clock.

    Parameters
    ----------
    seconds : (cases,), that each case takes
    costs : what the queue knows of them beforehand; learns as in a campaign
    ranks : that share them
    times : of messages and slices
    """

    def __init__(self, seconds: Floats, costs: Costs, ranks: int, times: Times) -> None:
        self.seconds, self.times, self.ranks = seconds, times, ranks
        self.queue = WorkQueue(range(len(seconds)), costs, ranks)
        self.questions = Questions(self.queue, ranks)
        self.workers = [_Worker() for _ in range(ranks)]
        self.busy, self.now = np.zeros(ranks), 0.0
        self.post: list[tuple[float, int, int, int, int]] = []
        self.posted = self.served = 0
        self.at_work, self.last = ranks - 1, 0.0

    def run(self) -> Outcome:
        """Return how the campaign goes."""
        self._deliver(list(enumerate(self.queue.first()))[1:])
        unit, left = -1, 0.0
        while self.at_work or self.queue or left > 0.0:
            self._serve()
            if left <= 0.0 and unit >= 0:
                self.queue.finished(unit, self.seconds[unit])
                unit = -1
            if unit < 0 and self.queue:
                unit = self.queue.take()
                left = float(self.seconds[unit])
            left -= self._pass(left)
        return Outcome(max(self.now, self.last), self.busy, self.served)

    def _pass(self, left: float) -> float:
        """Compute until a message waits at the end of a slice, or wait for one."""
        to_come = self.post[0][0] - self.now if self.post else np.inf
        if left <= 0.0:
            if self.post:
                self.now = max(self.now, self.post[0][0]) + self.times.idle
            return 0.0
        slices = max(np.ceil(to_come / self.times.slice_), 1.0)
        part = float(min(slices * self.times.slice_, left))
        self.now += part
        self.busy[0] += part
        return part

    def _serve(self) -> None:
        while self.post and self.post[0][0] <= self.now:
            _, _, kind, rank, question = heapq.heappop(self.post)
            worker = self.workers[rank]
            answered = worker.answered >= question
            if kind == HUNGRY and answered and worker.when <= worker.free:
                continue  # it never had to send this one
            self.now += self.times.serve + self.times.told * len(worker.done)
            self.served += 1
            if kind == ENDS:
                self.at_work -= 1
            elif kind == ASKS:
                self._deliver(self.questions.ask(rank))
            elif not answered:
                self._deliver(self.questions.hungry(rank))
            for case in worker.done:
                self.queue.finished(case, self.seconds[case])
            worker.done = []
        self._deliver(self.questions.rest())

    def _deliver(self, answers: Answers) -> None:
        for rank, units in answers:
            worker = self.workers[rank]
            worker.answered = worker.question
            worker.when = self.now + self.times.way
            waited = worker.when > worker.free
            start = worker.when + self.times.idle if waited else worker.free
            if not units:
                self._send(start, ENDS, rank)
                self.last = max(self.last, start)
                continue
            spent = float(self.seconds[units].sum())
            self.busy[rank] += spent
            worker.free, worker.done = start + spent, worker.done + units
            worker.question += 1
            self._send(start, ASKS, rank)
            self._send(worker.free, HUNGRY, rank)

    def _send(self, when: float, kind: int, rank: int) -> None:
        self.posted += 1
        question = self.workers[rank].question
        item = (when + self.times.way, self.posted, kind, rank, question)
        heapq.heappush(self.post, item)


def static_split(seconds: Floats, ranks: int) -> Outcome:
    """Return how contiguous blocks of cases go, decided beforehand."""
    starts = np.arange(ranks + 1) * len(seconds) // ranks
    sums = np.concatenate([[0.0], np.cumsum(seconds)])
    busy = np.diff(sums[starts])
    return Outcome(float(busy.max()), busy)


def dedicated_master(
    seconds: Floats, expected: Floats, ranks: int, times: Times
) -> Outcome:
    """Return how a rank that only hands out goes, the longest expected case first."""
    busy, now, end = np.zeros(ranks), 0.0, 0.0
    asking = [(times.way, rank) for rank in range(1, ranks)]
    for case in np.argsort(-expected, kind="stable"):
        came, rank = heapq.heappop(asking)
        now = max(now, came) + times.serve
        free = now + times.way + float(seconds[case])
        busy[rank] += seconds[case]
        end = max(end, free)
        heapq.heappush(asking, (free + times.way, rank))
    return Outcome(end, busy, len(seconds))
