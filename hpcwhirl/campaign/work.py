"""The jobs that one run of a campaign has to compute, planned by rank 0."""

from __future__ import annotations

import heapq
import math
from array import array
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.campaign.begin import Policy
from hpcwhirl.campaign.compute import computation, digest_in
from hpcwhirl.campaign.machine import machine_facts
from hpcwhirl.campaign.plan.cost import Costs, RefinedCosts, costs_of
from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.campaign.work_queue import JobQueue, Order, WorkQueue
from hpcwhirl.case.plan import FOLDING
from hpcwhirl.launch import Communicator, Shard, from_root
from hpcwhirl.planner.planner import OK, Completion, Job, Jobs, Planner
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.directory.completions import Ended, ended_in
from hpcwhirl.store.directory.journal import Journals
from hpcwhirl.store.directory.reader import Rows
from hpcwhirl.store.directory.states import States
from hpcwhirl.store.results.variables import WHY_NOT

CRASHES = 2  # a case is isolated after this number of processes died computing it


@dataclass(frozen=True)
class Work:
    """What one run of a campaign has to compute; the same on every rank.

    Attributes
    ----------
    jobs : number of jobs left, as known at the start
    cases : number of cases with such jobs
    kinds : for each kernel that the cases left may need, the number of one case that
        uses it
    suspects : numbers of cases to isolate, since they were being computed when two
        processes died
    mine : numbers of all cases of this run's shard
    run : number of the run
    extended : end times to which undecided cases are extended, s
    plan : identity of the plan to which case numbers refer; "" for a refined campaign
    machines : facts of the kinds of machines that have computed, see `campaign.machine`
    """

    jobs: int
    cases: int
    kinds: Sequence[int]
    suspects: frozenset[int]
    mine: Sequence[int]
    run: int
    extended: tuple[float, ...] = ()
    plan: str = ""
    machines: Sequence[Mapping[str, str]] = ()


def work_of(
    design: Design, directory: Directory, policy: Policy, comm: Communicator
) -> tuple[Work, WorkQueue]:
    """Return what this run has to compute, on every rank, and rank 0's queue of it.

    The queue is empty on other ranks.

    Parameters
    ----------
    design, directory : the campaign's cases and its directory
    policy : options of this run
    comm : communicator of all ranks, each of which must call
    """
    work, queue = None, WorkQueue([], Costs.unknown())
    if comm.rank == 0:
        work, queue = _planned(design, directory, policy, comm.size)
    return from_root(comm, work), queue


def _planned(
    design: Design, directory: Directory, policy: Policy, ranks: int
) -> tuple[Work, WorkQueue]:
    """Return what this run has to compute and its queue, from the campaign's directory.

    Saved states and notes of cases that have ended are removed.

    Parameters
    ----------
    design, directory : the campaign's cases and its directory
    policy : options of this run
    ranks : number of ranks that share the work
    """
    stored = directory.plan.read()
    extended, machines = stored.extended, stored.machines or [machine_facts()]
    plan = replace(design.manifest(), extended=extended)
    states, notes, journals = directory.states, directory.notes, directory.journals
    asked = states.names() | notes.crashes().keys()
    again = partial(is_again, journals, policy.retry) if policy.retry else None
    ended = ended_in(journals, plan, asked, again)
    planner = ended.planner()
    _tidy(design, states, ended.told, planner)
    notes.forget(set(ended.told))
    jobs, costs = planner.left(), Costs.unknown()
    mine: Sequence[int] = range(len(design.settings))
    if len(jobs.row) or policy.shard:  # costs need the model of each kind of case
        costs = costs_of(design)
        mine = share(costs.steps, policy.shard)
        costs = _learned(design, costs, ended, planner)
    if policy.shard:
        jobs = Jobs(*(one[np.isin(jobs.row, np.asarray(mine))] for one in jobs))
    alone = _suspects(notes.crashes(), design, planner, jobs, extended)
    kinds = [case for case in _kinds(design, planner, jobs) if case not in alone]
    order = Order(alone, even=policy.pilot is not None)
    queue = JobQueue(planner, jobs, design.code, costs, ranks, order)
    if design.grows:
        mine = range(len(planner))
    identity = "" if design.grows else design.digests.identity
    times, run = tuple(extended), journals.claim_run()
    still = planner.open[np.asarray(mine)] if policy.shard else planner.open
    cases = int(still.sum())
    work = Work(
        len(queue), cases, kinds, alone, mine, run, times, identity, machines
    )  # fmt: skip
    return work, queue


def _learned(design: Design, costs: Costs, ended: Ended, planner: Planner) -> Costs:
    """Return predicted computing times of all cases, improved by those of ended cases.

    Parameters
    ----------
    design : the campaign's cases
    costs : predictions for the cases of the design, without refined ones
    ended : completed jobs with their computing times
    planner : knows all cases, refined ones included
    """
    costs.learn_all(ended.seconds)
    if not design.grows:
        return costs
    costs = RefinedCosts(design, costs)
    costs.cover(planner)
    for row in range(planner.kind.first, len(planner)):
        seconds = ended.seconds_of(planner.number(row))
        if not math.isnan(seconds):
            costs.learn(row, seconds)
    return costs


def is_again(
    journals: Journals, retry: Collection[str], rows: Rows
) -> NDArray[np.bool_]:
    """Return for each record whether its job must be computed again, (records,).

    Parameters
    ----------
    journals : journals of the campaign, by which traces are checked
    retry : statuses to compute again; cases with damaged traces, or for which the
        user's function returned no numbers, are computed again, too
    rows : some records of a journal
    """
    status = rows.words("status")
    again = np.logical_or.reduce([status == word for word in retry])
    again[list(rows.others.get(WHY_NOT, {}))] = True
    traced = rows.has_any("traces") & (status == OK) & ~again
    for record in np.flatnonzero(traced).tolist():
        again[record] = not journals.is_whole(rows.record(record))
    return np.asarray(again)


def _kinds(design: Design, planner: Planner, jobs: Jobs) -> list[int]:
    """Return the number of one case for each kernel that the jobs left need."""
    rows = np.unique(jobs.row)
    coarse = rows[rows < planner.kind.first]
    beyond: dict[tuple[int, int], int] = {}
    for case in map(planner.number, rows[len(coarse) :].tolist()):
        address = design.family.address(case)
        beyond.setdefault((address.fidelity, address.panel), case)
    return [*design.columns.first_of(coarse, FOLDING), *beyond.values()]


def _tidy(
    design: Design, states: States, ended: Mapping[str, Completion], planner: Planner
) -> None:
    """Remove saved states of ended cases, except timeouts and undecided cases.

    Runs that were killed leave such states.

    Parameters
    ----------
    design, planner : the campaign's cases and its planner
    states : files of the saved states
    ended : {digest of a computation: how it ended}
    """
    tidy_ends(design, states, planner)
    for name in states.names() & ended.keys():  # left by a killed process
        if ended[name].status != "timeout" and not ended[name].is_open:
            states.drop(name)


def tidy_ends(design: Design, states: States, planner: Planner) -> None:
    """Remove stored last motions with which no case left of a branch begins.

    A process that is killed between the record of a case and the removal of the motion
    with which the case began leaves such. The last motion of a branch stays, since a
    longer sweep continues from it, and so does that before a failed case.

    Parameters
    ----------
    design, planner : the campaign's cases and its planner
    states : files of the saved states
    """
    if design.grows or not design.is_branched:
        return
    needed = planner.open | planner.failed
    for name in states.names():
        digest = digest_in(name)
        case = design.digests.find(digest) if digest else -1
        following = case + 1
        if case < 0 or following == len(needed) or needed[following]:
            continue
        if computation(design, Job(following, 0, 0)).follows == digest:
            states.drop(name)


def _suspects(
    died: Mapping[str, int],
    design: Design,
    planner: Planner,
    jobs: Jobs,
    extended: Sequence[float],
) -> frozenset[int]:
    """Return the cases that were being computed when two processes died.

    Such cases may have killed the processes. They are computed last, each in a process
    of its own: a case that kills its process again is `crashed`; others get a result.

    Parameters
    ----------
    died : {digest: number of processes that died while computing the case}
    design, planner : the campaign's cases and its planner
    jobs : jobs that are left
    extended : end times of the extensions, s
    """
    names = {name for name, count in died.items() if count >= CRASHES}
    if not names:
        return frozenset()
    found = {name: design.digests.find(name) for name in names}
    left = set(jobs.row[(jobs.twin == 0) & (jobs.stage == 0)].tolist())
    alone = {case for case in found.values() if case in left}
    names = {name for name, case in found.items() if case < 0}
    first = planner.kind.first
    later = (jobs.twin > 0) | (jobs.stage > 0) | (jobs.row >= first)
    for row, twin, stage in zip(*(one[later].tolist() for one in jobs), strict=True):
        if not names:
            break
        job = Job(planner.number(row), twin, stage)
        if computation(design, job, extended).digest in names:
            alone.add(job.case)
    return frozenset(alone)


def share(
    costs: Sequence[float] | NDArray[np.float64], shard: Shard | None
) -> Sequence[int]:
    """Return the numbers of the cases that a shard computes; of all without a shard.

    Cases are assigned in order of decreasing cost, each to the shard with the least
    load so far, so that loads differ by at most one case. The result depends only on
    the costs of all cases, not on what has been computed, so every shard finds its
    share by itself.

    Parameters
    ----------
    costs : (n,), predicted cost of each of n cases, any unit
    shard : the shard; None: the campaign is not divided
    """
    if shard is None:
        return range(len(costs))
    each = np.asarray(costs, dtype=float)
    loads = [(0.0, number) for number in range(1, shard.of + 1)]
    mine = []
    order = np.lexsort((np.arange(len(each)), -each))
    for case, cost in zip(order.tolist(), each[order].tolist(), strict=True):
        load, number = loads[0]
        heapq.heapreplace(loads, (load + cost, number))
        if number == shard.number:
            mine.append(case)
    return array("q", sorted(mine))
