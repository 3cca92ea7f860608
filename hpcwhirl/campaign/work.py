"""What is left of a campaign, and who is to do it: found once, by rank 0."""

from __future__ import annotations

import heapq
from array import array
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.campaign.agenda import Agenda, Singles, Unit
from hpcwhirl.campaign.growing import GrowingAgenda, Nominal, Wanted
from hpcwhirl.campaign.plan.cost import Costs, costs_of
from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.campaign.plan.ends import brief, ends_of
from hpcwhirl.campaign.plan.refined import RefinedDesign
from hpcwhirl.campaign.plan.stages import Ended, Stages, Todo
from hpcwhirl.campaign.policy import Policy
from hpcwhirl.launch import Communicator, Shard
from hpcwhirl.store.directory.journal import claim_run, scan
from hpcwhirl.store.directory.manifest import read_manifest
from hpcwhirl.store.directory.running import crashes, forget_crashes
from hpcwhirl.store.directory.states import drop_state, stored_states

CRASHES = 2  # of processes that a case was in flight at, from when on it is isolated


@dataclass(frozen=True)
class Work:
    """What one run of a campaign is to do; the same on every rank.

    Attributes
    ----------
    units : cases that are handed out together
    suspects : cases to be isolated: in flight when two processes died
    mine : all cases that this run is asked for, those of its shard
    run : its number
    extended : s, to what undecided cases go on, see `stages`
    plan : identity of the cases, by which their numbers are known
    begun : {case: what is to do of it} of those that are begun, see `stages`
    """

    units: Sequence[Unit]
    suspects: frozenset[int]
    mine: Sequence[int]
    run: int
    extended: tuple[float, ...] = ()
    plan: str = ""
    begun: Mapping[int, Todo] = field(default_factory=dict)


def work_of(
    design: Design, folder: Path, policy: Policy, comm: Communicator
) -> tuple[Work, Agenda]:
    """Return the work of all ranks and what this one hands out: all, or nothing."""
    work, agenda = None, Agenda([], Costs.unknown())
    if comm.rank == 0:
        work, agenda = _found(design, folder, policy, comm.size)
    return comm.bcast(work, root=0), agenda


def _found(
    design: Design, folder: Path, policy: Policy, ranks: int
) -> tuple[Work, Agenda]:
    """Return the work that is left in a directory, the longest first."""
    if isinstance(design, RefinedDesign):
        return _found_refined(design, folder, policy, ranks)
    costs, asked = costs_of(design), stored_states(folder) | crashes(folder).keys()
    mine = share(costs.steps, policy.shard)
    stages = Stages(design, read_manifest(folder).extended)
    ends = ends_of(folder, stages, policy.retry, asked if stages.is_plain else None)
    costs.learn_all(ends.seconds)
    _tidy(folder, ends.told)
    left, begun = ends.left(stages), {}
    if not stages.is_plain:
        begun = {c: todo for c, todo in left.begun.items() if todo != stages.whole()}
    cases = left.cases
    if policy.shard:
        cases = cases[np.isin(cases, np.asarray(mine))]
    alone = _suspects(folder, stages, begun, cases)
    cases = cases[~np.isin(cases, list(alone))] if alone else cases
    units = Singles(np.concatenate([cases, np.array(sorted(alone), dtype=np.int64)]))
    last = range(len(cases), len(units))
    run = claim_run(folder)
    plan = design.digests.identity
    work = Work(units, alone, mine, run, stages.extended, plan, begun)
    return work, Agenda(units, costs, ranks, last)


def _found_refined(
    design: RefinedDesign, folder: Path, policy: Policy, ranks: int
) -> tuple[Work, Agenda]:
    """Return the work that is left of a refined campaign, so far."""
    word_of = design.refinement.word_of
    found = scan(folder, partial(brief, folder, policy.retry))
    ended = {d: end for d, (end, _, again) in found.items() if not again}
    _tidy(folder, ended)
    nominal = Nominal(design, costs_of(design))
    words = {d: word_of(end._asdict()) for d, end in ended.items()}
    twins = {(end.of, end.twin) for end in ended.values() if end.twin}
    wanted = Wanted(design, words, twins)
    left = wanted.begin()
    for address in wanted.growth.wanted:
        case = design.family.number(address)
        end, seconds, _ = found.get(design.digest(case), (None, 0.0, True))
        if end is not None and end.status == "ok":
            nominal.costs.learn([nominal.index(case)], seconds)
    count = crashes(folder)
    asked = left if count else []  # each twin's digest takes a moment
    names = ((design.split(i)[0], _digest(design, i)) for i in asked)
    alone = frozenset(case for case, name in names if count[name] >= CRASHES)
    units: list[Unit] = [design.split(i)[:1] for i in left]
    last = [i for i, (case,) in enumerate(units) if case in alone]
    each = design.kin.count if design.kin else 0
    mine = range(len(wanted.growth.wanted) + each * len(wanted.growth.twinned))
    work = Work(units, alone, mine, claim_run(folder))
    return work, GrowingAgenda(left, nominal, wanted.after, ranks, last)


def _digest(design: RefinedDesign, number: int) -> str:
    """Return the digest of a case or of a twin by its number."""
    case, twin = design.split(number)
    return design.twin(number).digest if twin else design.digest(case)


def _tidy(folder: Path, ended: Mapping[str, Ended]) -> None:
    """Forget states and crashes of cases that have ended since.

    From those of cases that are open a longer run may go on.
    """
    for name in stored_states(folder) & ended.keys():  # killed before tidying
        if ended[name].status != "timeout" and not ended[name].is_open:
            drop_state(folder, name)
    forget_crashes(folder, set(ended))


def _suspects(
    folder: Path, stages: Stages, begun: Mapping[int, Todo], left: NDArray[np.int64]
) -> frozenset[int]:
    """Return the cases that were in flight when processes died, twice.

    One of them may have killed its process. They are computed last, each in a process
    of its own: those that do it again are rows, the others were only bystanders.

    Parameters
    ----------
    folder, stages : of the campaign
    begun : {case: what is to do} of those left that have begun
    left : cases
    """
    own = {stages.name(case, todo): case for case, todo in begun.items()}
    digests, found = stages.design.digests, set()
    for name, count in crashes(folder).items():
        case = own[name] if name in own else digests.find(name)
        if count >= CRASHES and (name in own or case not in begun):
            found.add(case)
    return frozenset(found & set(left[np.isin(left, list(found))].tolist()))


def share(
    costs: Sequence[float] | NDArray[np.float64], shard: Shard | None
) -> Sequence[int]:
    """Return the cases of a shard; without one, all.

    The dearest case first, each to the shard that has least so far: loads differ by at
    most one case. It depends on the costs of all cases alone, never on what has been
    computed, so that every shard finds its own share without asking.

    Parameters
    ----------
    costs : (n,), predicted cost of each case, any unit
    shard : whose cases to return
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
