"""Run a campaign: find the jobs left, compute them on all ranks, gather the results.

`Session` has the steps of one invocation, by the command or from Python: rank 0
prepares the design, claims the directory, and makes or continues it; all ranks receive
what to run, or the error; all run; rank 0 finishes while it still holds the claim. If a
rank fails unexpectedly, all are ended, since the others would wait for it.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import ExitStack, closing, suppress
from dataclasses import dataclass, field, replace
from typing import Self, TypeVar

from hpcwhirl.campaign.begin import Policy, Prepared, asking_of, begin, owned
from hpcwhirl.campaign.compute import Checkpoints
from hpcwhirl.campaign.evaluate import Evaluator
from hpcwhirl.campaign.finalize import Ending, conclude
from hpcwhirl.campaign.machine import UnlikeError, compare
from hpcwhirl.campaign.measure import Measure
from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.campaign.progress import duration_text
from hpcwhirl.campaign.ranks import Tally, keep_shares, map_ranks
from hpcwhirl.campaign.stop import PILOT_OVER, Stop, Stopping, Watchdog
from hpcwhirl.campaign.work import Work, tidy_ends, work_of
from hpcwhirl.campaign.work_queue import JobQueue, WorkQueue
from hpcwhirl.campaign.worker_process import Child
from hpcwhirl.errors import WhirlError, cases_told, say, twins_told
from hpcwhirl.launch import (
    ALONE,
    Communicator,
    Shard,
    end_all,
    from_root,
    launcher,
    node_of,
    rest_until_root,
)
from hpcwhirl.planner.planner import Completion
from hpcwhirl.reduction.numbers import one_thread
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.directory.heartbeats import Running
from hpcwhirl.store.directory.journal import Journal
from hpcwhirl.store.directory.owner import Claim

PROGRESS_EVERY = 5.0  # s between progress lines, at first
PROGRESS_SHARE = 0.02  # later: time between lines as a share of the time spent so far
PROGRESS_RAREST = 300.0  # s, longest time between progress lines
T = TypeVar("T")


def run_campaign(
    design: Design,
    directory: Directory,
    comm: Communicator = ALONE,
    policy: Policy | None = None,
    stopping: Stopping | None = None,
    own: Claim | None = None,
) -> Ending:
    """Compute the cases left in a campaign on all ranks and gather its results.

    Every rank of `comm` must call this, after one of them has called `prepare`.

    Parameters
    ----------
    design, directory : the campaign's cases and its directory
    comm : communicator of all ranks
    policy : options of the run, such as limits and retries; the same on every rank
    stopping : handler of stop requests; None: a handler is made for this run
    own : rank 0's claim on the directory; None: a claim is made for this run

    Raises
    ------
    InputError
        if another run computes in the directory
    """
    policy = policy or Policy()
    node = node_of(comm)
    with ExitStack() as stack:
        stopping = stopping or stack.enter_context(Stopping())
        stack.enter_context(owned(directory, policy.shard, comm, stopping, own))
        stopping.watch(None if node.rank else directory.stop_file, policy.seconds)
        planned = work_of(design, directory, policy, comm)
        work, _ = planned
        try:
            if work.jobs:
                compare(
                    work.machines, directory.plan, comm, own, strict=policy.is_strict
                )
        except UnlikeError as refused:  # raised on every rank
            why = str(refused)
            return Ending(
                complete=False, cases=len(design.settings), reason=why, lasting=True
            )
        prepared = Prepared(design, directory, policy)
        complete, gave_up = _computed(prepared, planned, comm, node, stopping)
        stopping.settled = complete
        if complete:  # from now on signals are ignored
            asking = asking_of(stopping, take_over=policy.take_over)
            return conclude(design, directory, comm, work, asking)
        reasons = comm.allgather(stopping.reason)
    reason = next(filter(None, reasons), "")
    return Ending(
        complete=False, cases=len(design.settings), reason=reason,
        gave_up=gave_up, piloted=reason == PILOT_OVER,
    )  # fmt: skip


def _computed(
    prepared: Prepared,
    planned: tuple[Work, WorkQueue],
    comm: Communicator,
    node: Communicator,
    stopping: Stopping,
) -> tuple[bool, bool]:
    """Compute the jobs left in a campaign on all ranks.

    Parameters
    ----------
    prepared : the campaign's cases, its directory and the options of the run
    planned : what the run has to compute, and rank 0's queue of it
    comm, node : communicators of all ranks, and of the ranks on this node
    stopping : handler of stop requests of this process

    Returns
    -------
    whether all jobs ended; whether it stopped after `max_fails` failures
    """
    design, directory, policy, *_ = prepared
    work, queue = planned
    names = design.measure.variables if design.measure else ()
    checkpoints = Checkpoints(directory.states, policy.save_every, say)
    with (
        Journal(directory.journals, work.run, comm.rank, work.plan, names) as journal,
        Running(directory.notes, work.run, comm.rank) as running,
        closing(Child(directory.states, policy.save_every)) as child,
        one_thread(),
    ):
        evaluate = Evaluator(
            design, comm.rank, journal, running, checkpoints, child, policy, stopping,
            work.suspects, work.extended,
        )  # fmt: skip
        if work.jobs:
            _warm(evaluate, work, node)
        if policy.pilot is not None:  # a pilot's time begins here, after compiling
            stopping.pilot(policy.pilot)
        if comm.rank == 0:
            say(_begun(work, design, policy.shard))
        report = _Report(queue, policy.max_fails, stopping)
        tally = Tally(waits=evaluate.keep_due)
        complete = map_ranks(queue, evaluate, report, stopping, comm, tally)
        complete &= all(comm.allgather(evaluate.keep()))
        if complete and isinstance(queue, JobQueue):  # on rank 0
            tidy_ends(design, directory.states, queue.planner)
        tally.beside, tally.first = evaluate.costs_beside()
        if work.jobs:
            why = "" if complete else stopping.reason
            keep_shares(directory.runs, work.run, tally, comm, why, report.twins)
    return complete, report.gave_up


def _warm(evaluate: Evaluator, work: Work, node: Communicator) -> None:
    """Compile kernels on one rank of each node; the others wait, then read its cache.

    Parameters
    ----------
    evaluate : computes cases on this rank
    work : what the run has to compute
    node : communicator of the ranks on this node
    """
    if node.rank == 0:
        with suppress(Stop):  # the ranks will see the request, too
            evaluate.warm(work.kinds)
    rest_until_root(node)


def _begun(work: Work, design: Design, shard: Shard | None) -> str:
    """Return the first progress line: numbers of all, ended and isolated cases.

    Parameters
    ----------
    work : what the run has to compute
    design : the campaign's cases
    shard : part of the cases that this run computes; None: all
    """
    cases, so_far = len(design.settings), ""
    if design.grows and work.jobs:
        so_far = " so far, and further ones that their words require"
    of = f" of {cases} in shard {shard}" if shard else ""
    kept = len(work.mine) - work.cases
    already = f", {kept} already computed" if kept else ""
    alone = len(work.suspects)
    apart = f", {alone} isolated after two crashes" if alone else ""
    twins = f", {design.twins.told}" if design.twins and work.jobs else ""
    return f"{cases_told(len(work.mine))}{twins}{so_far}{of}{already}{apart}"


class _Report:
    """Prints progress lines of a run on stderr of rank 0, and counts failed cases.

    It is called for every finished unit of work.
    """

    def __init__(self, queue: WorkQueue, most: int | None, stopping: Stopping) -> None:
        self.queue, self.most, self.stopping = queue, most, stopping
        self.finished = self.failed = self.twins = 0
        self.start = self.last = time.monotonic()

    @property
    def gave_up(self) -> bool:
        """Whether the run stops because `max_fails` cases have failed in it."""
        return self.most is not None and self.failed >= self.most

    def __call__(self, unit: int, end: Completion) -> None:
        self.finished += 1
        self.twins += self.queue.is_twin(unit)
        self.failed += not end.is_ok
        if self.gave_up:
            noun = "cases or twins" if self.queue.twins else "cases"
            self.stopping.ask(f"{self.failed} {noun} without a result")
        now = time.monotonic()
        spent = now - self.start
        every = min(max(PROGRESS_EVERY, PROGRESS_SHARE * spent), PROGRESS_RAREST)
        if now - self.last < every and self.queue.left:
            return
        self.last = now
        left = self.queue.seconds_left() / self.queue.ranks
        bad = f", {self.failed} failed" if self.failed else ""
        noun = "cases and twins" if self.queue.twins else "cases"
        rate = f"{3600 * self.finished / max(spent, 1e-9):.4g} {noun}/h"
        so_far = " so far" if self.queue.may_grow else ""
        say(f"{self._done()}{so_far}{bad}, {rate}, {duration_text(left)} left")

    def _done(self) -> str:
        """Return as text how many of the cases, and of their twins, have ended."""
        twins, every = self.queue.twins, self.queue.known
        cases = f"{self.finished - self.twins} of {cases_told(every - twins)}"
        return f"{cases} and {self.twins} of {twins_told(twins)}" if twins else cases


@dataclass
class Session:
    """One invocation of a campaign on all ranks; used in a `with` statement.

    If this rank raises an exception in the block, all ranks are ended.

    Attributes
    ----------
    comm : communicator of all ranks
    stopping : handler of stop requests and signals
    tell : prints an exception of this rank and returns the exit code with which all
        ranks are then ended; None: exceptions are raised as usual, since no other rank
        waits
    code : exit code after an exception; None: there was none
    watchdog : ends ranks that hang after a stop request; None: no watchdog
    directory : the campaign's directory; None before this rank knows it
    claim : claim on the directory, which rank 0 holds while the campaign runs
    """

    comm: Communicator
    stopping: Stopping
    tell: Callable[[Session, BaseException], int] | None = None
    code: int | None = None
    watchdog: Watchdog | None = None
    directory: Directory | None = None
    claim: Claim | None = None
    _after: ExitStack = field(default_factory=ExitStack)

    def on_root(self, action: Callable[[], T]) -> T | WhirlError:
        """Call `action` on rank 0 only; return its value on every rank.

        Rank 0 gets the value itself, the others what was sent, which may lack parts
        that they do not need. A WhirlError that `action` raises is returned instead.
        """
        done: T | WhirlError | None = None
        if self.comm.rank == 0:
            try:
                done = action()
            except WhirlError as failed:
                done = failed
        told: T | WhirlError = from_root(self.comm, done)
        return told if done is None else done

    def run(
        self,
        prepare: Callable[[], Prepared],
        conclude: Callable[[Ending, Prepared], T],
        measure: Measure | None = None,
        begun: Callable[[Design], None] = lambda _: None,
    ) -> T | WhirlError:
        """Prepare, run and conclude a campaign; every rank must call this.

        Parameters
        ----------
        prepare : returns the campaign and the options of the run; called on rank 0
        conclude : called on rank 0 with the outcome of the run and the prepared
            campaign
        measure : the user's function on this rank
        begun : called on rank 0 when the directory is claimed and prepared

        Returns
        -------
        on every rank, the value of `conclude`, or the WhirlError that rank 0 raised
        before or after the run
        """
        with ExitStack() as stack:

            def opened() -> Prepared:
                prepared = prepare()
                own = replace(prepared.design, measure=measure)
                self.claim = begin(prepared._replace(design=own), self.stopping)
                stack.enter_context(self.claim)
                begun(prepared.design)
                return prepared

            prepared = self.on_root(opened)
            if isinstance(prepared, WhirlError):
                return prepared
            design, self.directory, policy, *_ = prepared
            if self.watchdog is not None:
                self.watchdog.seconds = launcher.patience = policy.patience
                if self.claim is not None:
                    self.watchdog.last = self.claim.release
            ending = run_campaign(
                replace(design, measure=measure),
                self.directory, self.comm, policy, self.stopping, self.claim,
            )  # fmt: skip
            return self.on_root(lambda: conclude(ending, prepared))

    def __enter__(self) -> Self:
        """Start the watchdog if `tell` is given, that is, if other ranks may wait."""
        if self.tell is not None:
            dog = Watchdog(self.stopping, Policy().patience, self.comm)
            self.watchdog = self._after.enter_context(dog)
        return self

    def __exit__(self, _: object, failed: BaseException | None, trace: object) -> bool:
        """End all ranks if this rank has raised an exception and `tell` is given."""
        with self._after:
            if failed is None or self.tell is None:
                return False
            self.code = self.tell(self, failed)
            end_all(self.comm, self.code)
            return True
