"""Some cases of a campaign computed beforehand, all the way, to know what they take.

They are computed and kept as the campaign would, in a directory beside its own that is
removed again: what a case needs beside its kernel, and whether it ends before its time
(proved at rest, or beyond the amplitude limit), no plan tells.
"""

from __future__ import annotations

import math
import tempfile
import time
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.campaign.evaluate import MOST_TOLD, Evaluator
from hpcwhirl.campaign.plan.cost import Costs
from hpcwhirl.campaign.policy import Policy
from hpcwhirl.campaign.stop import Stop, Stopping
from hpcwhirl.campaign.work import Work
from hpcwhirl.campaign.work_queue import scattered
from hpcwhirl.case.plan import FOLDING
from hpcwhirl.dynamics.cache import cache_facts
from hpcwhirl.dynamics.snapshot import steps_of
from hpcwhirl.errors import WhirlError
from hpcwhirl.launch import ALONE
from hpcwhirl.planner.jobs import Job
from hpcwhirl.store.directory.completions import Ended
from hpcwhirl.store.directory.journal import read_records
from hpcwhirl.store.directory.record import Record
from hpcwhirl.store.directory.states import read_state, stored_states

if TYPE_CHECKING:
    from hpcwhirl.campaign.plan.design import Design

MOST = 256  # cases
LITTLE = 0.1  # share of a run, of which less tells nothing of the rest


@dataclass
class Rehearsal:
    """What was learned.

    Attributes
    ----------
    seconds : {case: s in the kernel} of those that came to their end, the mean of it
        and its twins
    rows : {case: row} of the same
    overhead : s of each beside its kernel, of a usual one
    first : s that the first took more than that: models, caches
    warm : s until its kernels were there
    compiled : whether they had to be compiled; the campaign will find them
    reached : share of its steps that the first case got to that was cut off, 1: none
    """

    seconds: dict[int, float] = field(default_factory=dict)
    rows: dict[int, Record] = field(default_factory=dict)
    overhead: float = 0.0
    first: float = 0.0
    warm: float = 0.0
    compiled: bool = False
    reached: float = 1.0


def drawn(cases: Sequence[int]) -> list[int]:
    """Return cases that lie evenly over all, however many of them are taken."""
    return [cases[place] for place in scattered(len(cases))[:MOST].tolist()]


def rehearse(
    design: Design, folder: Path, cases: Sequence[int], seconds: float,
    stopping: Callable[[], bool],
) -> Rehearsal:  # fmt: skip
    """Compute cases one after the other, for some seconds.

    The one that is on its way then has as long again to end. Where words ask for
    further cases, those are computed next.

    Parameters
    ----------
    design : of the campaign
    folder : its directory, which need not be there and stays as it is
    cases : in the order to be taken
    seconds : s, to compute
    stopping : whether to end at once
    """
    out = Rehearsal()
    place = folder.absolute()
    while not place.is_dir():
        place = place.parent
    with tempfile.TemporaryDirectory(prefix=".hpcwhirl-", dir=place) as scratch:
        spent = _compute(design, Path(scratch), cases, (seconds, stopping), out)
        found = read_records(Path(scratch))
        out.reached = _reached(Path(scratch))
    beside = []
    for case, elapsed in spent.items():
        of_case = [one for one in found.values() if one["case"] == case]
        if not of_case or any(one["status"] != "ok" for one in of_case):
            continue
        each = [float(one["performance"]["seconds"]) for one in of_case]
        out.seconds[case] = float(np.mean(each))
        beside.append((elapsed - sum(each)) / len(each))
        out.rows[case] = next(one["row"] for one in of_case if "twin" not in one)
    if beside:
        out.overhead = float(np.median(beside))
        out.first = max(beside[0] - out.overhead, 0.0)
    return out


class _Until(Stopping):
    """Ends what is computed here at a time, or where the whole call is to end."""

    def __init__(self, asked: Callable[[], bool]) -> None:
        super().__init__()
        self.asked = asked

    def __call__(self) -> bool:
        """Return whether it is to end."""
        return self.asked() or super().__call__()


def _compute(
    design: Design,
    scratch: Path,
    cases: Sequence[int],
    until: tuple[float, Callable[[], bool]],
    out: Rehearsal,
) -> dict[int, float]:
    """Compute cases; return the seconds that each has taken with all that is of it."""
    from hpcwhirl.campaign.run import desk_of  # which tells what it will cost

    seconds, asked = until
    spent: dict[int, float] = {}
    queue = deque(map(Job, cases))
    planner = Ended.nothing(design.manifest()).planner()
    work = Work(len(cases), len(cases), cases, frozenset(), cases, 1)
    stopping = _Until(asked)
    with desk_of(scratch, work, ALONE, Policy(), stopping) as desk, suppress(Stop):
        evaluate = Evaluator(design, desk)
        evaluate.told = MOST_TOLD  # the campaign will tell what fails
        begun, before = time.perf_counter(), cache_facts()["cache_kernels"]
        evaluate.warm(design.columns.first_of(np.array(cases), FOLDING))
        out.warm = time.perf_counter() - begun
        out.compiled = cache_facts()["cache_kernels"] > before
        begun = time.perf_counter()
        stopping.watch(None, 2.0 * seconds)
        for _ in range(MOST):
            start = time.perf_counter()
            if not queue or start - begun > seconds:
                break
            job = queue.popleft()
            end = evaluate(design.code.encode(job), stopping.check)
            elapsed = time.perf_counter() - start
            spent[job.case] = spent.get(job.case, 0.0) + elapsed
            following = planner.complete(job, end)
            queue.extend(each for each in following if each.case != job.case)
            queue.extendleft(each for each in following if each.case == job.case)
    return spent


def _reached(scratch: Path) -> float:
    """Return the share of its steps that the case got to that was cut off."""
    for digest in stored_states(scratch):
        with suppress(WhirlError):
            arrays = read_state(scratch, digest, {})
            if arrays:
                steps, total = steps_of(arrays)
                return steps / max(total, 1)
    return 1.0


def learned_of(costs: Costs, tried: Rehearsal) -> tuple[Costs, Costs, float]:
    """Return what cases cost, if none ended early, and the first's relative error.

    A case that ends early is expected where those that were computed nearest to it do.
    """
    if not tried.seconds:
        return costs, costs, _error(costs.factor[np.isfinite(costs.factor)])
    rate = costs.predict(np.arange(len(costs.nominal)))
    own, whole = (Costs(rate, costs.places, costs.steps) for _ in range(2))
    for case, seconds in tried.seconds.items():
        if case < len(rate):  # others follow from words
            own.learn([case], seconds)
    for case, row in tried.rows.items():
        if case < len(rate):
            whole_run = tried.seconds[case] / max(_marched(row, costs, case), LITTLE)
            whole.learn([case], max(whole_run, float(rate[case])))
    return own, whole, _error(own.factor[np.isfinite(own.factor)])


def _marched(row: Record, costs: Costs, case: int) -> float:
    """Return the steps that a case made, of those to its first end."""
    part = float(row["steps"]) / max(costs.steps[case], 1.0)
    if row["certificate"] < 0.0:
        return part
    return part * float(row["certificate"]) / float(row["duration"])  # the rest: none


def _error(shares: NDArray[np.float64]) -> float:
    """Return the standard error of a mean, over it; of one value, all of it."""
    if len(shares) < 2 or not shares.any():
        return 1.0
    return float(shares.std(ddof=1) / shares.mean() / math.sqrt(len(shares)))
