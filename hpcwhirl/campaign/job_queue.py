"""The queue of jobs handed out to ranks, including jobs that follow from others."""

from __future__ import annotations

from array import array

import numpy as np

from hpcwhirl.campaign.plan.cost import Costs
from hpcwhirl.campaign.work_queue import LAST, LONGEST_FIRST, Order, WorkQueue
from hpcwhirl.planner.jobs import Completion, Job, JobCode
from hpcwhirl.planner.planner import Jobs, Planner

USUAL = 1  # priority of a job
FOLLOWING = 2  # priority of refined cases, from which others may follow


class JobQueue(WorkQueue):
    """A work queue of jobs; those that follow from a completion are handed out next.

    Parameters
    ----------
    planner : takes completions and returns the jobs that follow
    jobs : jobs that are left
    code : numbering of the jobs, by which they are sent to ranks
    costs : predicted costs of the planner's rows
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
        """Whether running jobs may lead to further jobs."""
        return self.left > 0 and not self.dropped and not self.planner.is_plain

    def job(self, unit: int) -> Job:
        """Return the job (case, twin, stage) of a unit."""
        case = self.planner.number(self.rows[unit])
        return Job(case, self.twin[unit], self.stage[unit])

    def task(self, unit: int) -> int:
        """Return the number of the job of a unit, as sent to a rank."""
        return self.code.encode(self.job(unit))

    def hear(self, unit: int, end: Completion) -> None:
        """Record the completion of a job, and add the jobs that follow from it."""
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
