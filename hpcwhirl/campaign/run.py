"""A campaign from design to results: continue, distribute, keep, gather."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
from pathlib import Path

from hpcwhirl.campaign.agenda import Agenda
from hpcwhirl.campaign.checkpoints import Checkpoints
from hpcwhirl.campaign.design import Design
from hpcwhirl.campaign.ending import Ending, conclude
from hpcwhirl.campaign.evaluate import Desk, Evaluator
from hpcwhirl.campaign.isolate import Child
from hpcwhirl.campaign.log import say
from hpcwhirl.campaign.owning import owned
from hpcwhirl.campaign.policy import Policy
from hpcwhirl.campaign.progress import duration_text
from hpcwhirl.campaign.ranks import Stop, Tally, map_ranks
from hpcwhirl.campaign.stop import Stopping, breakable
from hpcwhirl.campaign.time_use import keep_shares
from hpcwhirl.campaign.work import Work, work_of
from hpcwhirl.case.plan import folds_of
from hpcwhirl.dynamics.lanes import Lanes
from hpcwhirl.dynamics.march import March
from hpcwhirl.launch import ALONE, Communicator, Shard, node_of
from hpcwhirl.store.journal import Journal
from hpcwhirl.store.owner import Claim
from hpcwhirl.store.running import Running

PROGRESS_EVERY = 5.0  # s, at first
PROGRESS_SHARE = 0.02  # of the time spent so far, later
PROGRESS_RAREST = 300.0  # s


def run_campaign(
    design: Design,
    folder: Path,
    comm: Communicator = ALONE,
    policy: Policy | None = None,
    stopping: Stopping | None = None,
    own: Claim | None = None,
) -> Ending:
    """Integrate what is left of a campaign and gather its results.

    Every rank of `comm` must call; `prepare` has been called by one.

    Parameters
    ----------
    design : the campaign
    folder : its directory
    comm : of all ranks
    policy : limits, retries, isolation; the same on every rank
    stopping : that has taken over the signals already; None: while this runs
    own : rank 0's claim on the directory; None: one is made while this runs

    Raises
    ------
    InputError
        where another run computes there
    """
    policy = policy or Policy()
    node = node_of(comm)
    with ExitStack() as stack:
        stopping = stopping or stack.enter_context(Stopping())
        stack.enter_context(owned(folder, policy.shard, comm, stopping, own))
        stopping.watch(None if node.rank else folder, policy.seconds)
        work, agenda = work_of(design, folder, policy, comm)
        with _desk(folder, work, comm, policy, stopping) as desk:
            complete, gave_up = _compute(design, work, desk, comm, node, agenda)
        stopping.settled = complete
        if complete:  # a signal does not interrupt what is left to do
            return conclude(design, folder, comm, work, stopping)
        reasons = comm.allgather(stopping.reason)
    return Ending(
        complete=False, cases=len(design.scenes), failed=0, results=None,
        reason=next(filter(None, reasons), ""), gave_up=gave_up,
    )  # fmt: skip


@contextmanager
def _desk(
    folder: Path, work: Work, comm: Communicator, policy: Policy, stopping: Stopping
) -> Iterator[Desk]:
    """Open what this rank works with."""
    rank = comm.rank
    checkpoints = Checkpoints(folder, policy.save_every, say)
    child = Child(folder, policy.save_every)
    with (
        Journal(folder, work.run, rank) as journal,
        Running(folder, work.run, rank) as running,
        closing(child),
    ):
        yield Desk(
            rank, journal, running, checkpoints, child, policy, stopping, work.suspects
        )


def _compute(
    design: Design,
    work: Work,
    desk: Desk,
    comm: Communicator,
    node: Communicator,
    agenda: Agenda,
) -> tuple[bool, bool]:
    """Do the work on all ranks; return whether all is done and whether it gave up."""
    if work.units:
        _warm(design, work, desk, node)
    if desk.rank == 0:
        say(_begun(work, len(design.scenes), desk.policy.shard))
    report = _Report(agenda, desk)
    evaluate = Evaluator(design, work.units, desk)
    tally = Tally()
    complete = map_ranks(agenda, evaluate, report, desk.stopping, comm, tally)
    if work.units:
        why = "" if complete else desk.stopping.reason
        keep_shares(desk.journal.folder, work.run, tally, comm, why)
    return complete, report.gave_up


def _warm(design: Design, work: Work, desk: Desk, node: Communicator) -> None:
    """Fill numba's cache on one rank a node, then let the others read it."""
    if node.rank == 0:
        with suppress(Stop):  # the ranks will see it, too
            _compile(design, work, desk)
    node.Barrier()


def _kinds(design: Design, work: Work) -> list[int]:
    """Return a case of each kernel that the work needs, the first of its kind."""
    kinds = {}
    left = [c for unit in work.units for c in unit if c not in work.suspects]
    for case in reversed(left):
        scene = design.scenes[case]
        kinds[scene.solver.scheme, folds_of(scene)] = case
    return list(kinds.values())


def _compile(design: Design, work: Work, desk: Desk) -> None:
    """Take a step of a case of each scheme, and of a batch if there is one."""

    def between() -> None:
        if desk.stopping():
            raise Stop

    cases = _kinds(design, work)
    desk.running.begin(design.digest(case) for case in cases)
    if desk.policy.isolate:
        desk.child.warm([design.scenes[case] for case in cases], between)
        return
    batch = next((unit for unit in work.units if len(unit) > 1), None)
    with breakable(between):
        for case in cases:
            try:
                March(design.resolved(case)).advance(1)
            except Stop:
                raise
            except Exception:  # noqa: BLE001 - it will fail as a row
                continue
        if batch is not None:
            march = March(design.resolved(batch[0]))
            group = Lanes(march)
            group.load(0, march)
            group.advance(1)


def _begun(work: Work, cases: int, shard: Shard | None) -> str:
    """Return how many cases there are, and what of them is not to be computed."""
    of = f" of {cases} in shard {shard}" if shard else ""
    kept = len(work.mine) - sum(map(len, work.units))
    already = f", {kept} already there" if kept else ""
    alone = len(work.suspects)
    apart = f", {alone} of two crashes apart" if alone else ""
    return f"{len(work.mine)} cases{of}{already}{apart}"


class _Report:
    """Plain progress lines on rank 0's stderr, which alone is told of units."""

    def __init__(self, agenda: Agenda, desk: Desk) -> None:
        self.desk, self.agenda = desk, agenda
        self.total = sum(map(len, agenda.units))
        self.finished = self.failed = 0
        self.start = self.last = time.monotonic()

    @property
    def gave_up(self) -> bool:
        """Whether there were more failures on this call than allowed."""
        most = self.desk.policy.max_fails
        return most is not None and self.failed >= most

    def __call__(self, unit: int, statuses: list[str]) -> None:
        del unit
        self.finished += len(statuses)
        self.failed += sum(status != "ok" for status in statuses)
        if self.gave_up:
            self.desk.stopping.ask(f"{self.failed} cases without a result")
        now = time.monotonic()
        spent = now - self.start
        every = min(max(PROGRESS_EVERY, PROGRESS_SHARE * spent), PROGRESS_RAREST)
        if now - self.last < every and self.finished < self.total:
            return
        self.last = now
        left = self.agenda.seconds_left() / self.agenda.ranks
        bad = f", {self.failed} failed" if self.failed else ""
        rate = f"{3600 * self.finished / max(spent, 1e-9):.4g} cases/h"
        progress = f"{self.finished} of {self.total} cases{bad}, {rate}"
        say(f"{progress}, {duration_text(left)} left")
