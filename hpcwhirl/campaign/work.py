"""What is left of a campaign, and who is to do it: found once, by rank 0."""

from __future__ import annotations

import heapq
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from hpcwhirl.campaign.agenda import Agenda, Unit
from hpcwhirl.campaign.cost import Costs, costs_of
from hpcwhirl.campaign.design import Design
from hpcwhirl.campaign.growing import GrowingAgenda, Nominal, Wanted
from hpcwhirl.campaign.policy import Policy
from hpcwhirl.campaign.refined import RefinedDesign
from hpcwhirl.campaign.stages import Ended, Stages, Todo, ended_of
from hpcwhirl.launch import Communicator, Shard
from hpcwhirl.store.journal import Record, claim_run, is_whole, scan
from hpcwhirl.store.manifest import read_manifest
from hpcwhirl.store.measured import WHY_NOT
from hpcwhirl.store.running import crashes, forget_crashes
from hpcwhirl.store.states import drop_state, stored_states

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
    begun : {case: what is to do of it} of those that are begun, see `stages`
    """

    units: list[Unit]
    suspects: frozenset[int]
    mine: Collection[int]
    run: int
    extended: tuple[float, ...] = ()
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
    costs = costs_of(design)
    mine = share(costs.steps, policy.shard)
    ended = learn_ends(folder, design, costs, policy.retry)
    _tidy(folder, ended)
    stages = Stages(design, read_manifest(folder).extended)
    begun = stages.left(ended)
    left = [case for case in begun if case in mine]
    names = {case: stages.name(case, begun[case]) for case in left}
    alone = _suspects(folder, names)
    seconds = dict(zip(left, costs.predict(left), strict=True))
    order = sorted(set(left) - alone, key=lambda i: (-seconds[i], i))
    units: list[Unit] = [(case,) for case in order]
    last = range(len(units), len(units) + len(alone))
    units += [(case,) for case in sorted(alone)]
    begun = {case: todo for case, todo in begun.items() if todo != stages.whole()}
    run = claim_run(folder)
    work = Work(units, alone, mine, run, stages.extended, begun)
    return work, Agenda(units, costs, ranks, last)


def _found_refined(
    design: RefinedDesign, folder: Path, policy: Policy, ranks: int
) -> tuple[Work, Agenda]:
    """Return the work that is left of a refined campaign, so far."""
    word_of = design.refinement.word_of
    found = scan(folder, partial(_brief, folder, policy.retry))
    ended = {d: end for d, (end, _, again) in found.items() if not again}
    _tidy(folder, ended)
    nominal = Nominal(design, costs_of(design))
    words = {d: word_of(end._asdict()) for d, end in ended.items()}
    wanted = Wanted(design, words)
    left = wanted.begin()
    for address in wanted.growth.wanted:
        case = design.family.number(address)
        end, seconds, _ = found.get(design.digest(case), (None, 0.0, True))
        if end is not None and end.status == "ok":
            nominal.costs.learn([nominal.index(case)], seconds)
    count = crashes(folder)
    alone = frozenset(i for i in left if count[design.digest(i)] >= CRASHES)
    units: list[Unit] = [(case,) for case in left]
    last = [i for i, case in enumerate(left) if case in alone]
    mine = range(len(wanted.growth.wanted))
    work = Work(units, alone, mine, claim_run(folder))
    return work, GrowingAgenda(left, nominal, wanted.after, ranks, last)


def _brief(
    folder: Path, retry: Collection[str], record: Record
) -> tuple[Ended, float, bool]:
    """Return how a case ended, its seconds, and whether it is computed again."""
    end, status = ended_of(record), str(record["status"])
    seconds = record["performance"].get("seconds", math.nan)
    damaged = retry and status == "ok" and not is_whole(folder, record)
    damaged = damaged or (retry and WHY_NOT in record)
    return end, seconds, bool(status in retry or damaged)


def learn_ends(
    folder: Path, design: Design, costs: Costs, retry: Collection[str] = ()
) -> dict[str, Ended]:
    """Let costs learn from a directory; return {digest: how it ended} of what has.

    Parameters
    ----------
    folder, design : the campaign
    costs : of the design; learns the seconds of cases that gave a result
    retry : statuses to be computed again; if any, damaged traces are, too
    """
    found = scan(folder, partial(_brief, folder, retry))
    for case, name in enumerate(design.digests):
        if name in found and found[name][0].status == "ok":
            costs.learn([case], found[name][1])
    return {name: end for name, (end, _, again) in found.items() if not again}


def _tidy(folder: Path, ended: dict[str, Ended]) -> None:
    """Forget states and crashes of cases that have ended since.

    From those of cases that are open a longer run may go on.
    """
    for name in stored_states(folder) & ended.keys():  # killed before tidying
        if ended[name].status != "timeout" and not ended[name].is_open:
            drop_state(folder, name)
    forget_crashes(folder, set(ended))


def _suspects(folder: Path, names: Mapping[int, str]) -> frozenset[int]:
    """Return the cases that were in flight when processes died, twice.

    One of them may have killed its process. They are computed last, each in a process
    of its own: those that do it again are rows, the others were only bystanders.

    Parameters
    ----------
    folder : the campaign's directory
    names : {case: digest} of what is left
    """
    count = crashes(folder)
    return frozenset(case for case in names if count[names[case]] >= CRASHES)


def share(costs: Sequence[float], shard: Shard | None) -> Collection[int]:
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
    loads = [(0.0, number) for number in range(1, shard.of + 1)]
    mine = []
    for case in sorted(range(len(costs)), key=lambda i: (-costs[i], i)):
        load, number = loads[0]
        heapq.heapreplace(loads, (load + costs[case], number))
        if number == shard.number:
            mine.append(case)
    return frozenset(mine)
