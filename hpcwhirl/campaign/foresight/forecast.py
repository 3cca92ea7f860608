"""What a campaign will cost, before it runs: time on so many ranks, bytes on disk.

Steps are counted; what a step takes is measured, and so is what a case takes beside
them and how many cases end before their time: some are computed to their end, see
`rehearsal`. The range is that of what those cases tell of all others, and of machines:
`APART` between one run and the next.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.campaign.finalize import facts_of
from hpcwhirl.campaign.foresight.foreseen import Beyond, grown
from hpcwhirl.campaign.foresight.rehearsal import (
    Rehearsal,
    drawn,
    learned_of,
    rehearse,
)
from hpcwhirl.campaign.plan.cost import Costs, costs_of, time_steps
from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.campaign.simulate import simulate
from hpcwhirl.campaign.work import share
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import WhirlError
from hpcwhirl.launch import Shard
from hpcwhirl.planner.planner import Jobs
from hpcwhirl.scene import apply_settings
from hpcwhirl.scene.batch_validation import end_times
from hpcwhirl.scene.campaign_tables import MOST_ON_PAGE
from hpcwhirl.store.directory.blades import DETAIL
from hpcwhirl.store.directory.completions import Ended, ended_in
from hpcwhirl.store.directory.process import begun
from hpcwhirl.store.directory.runs import read_runs
from hpcwhirl.store.results.contents import sizes_of
from hpcwhirl.store.results.sizes import Bytes, bytes_of

PROBE = 0.03  # s of computing a probe
FIRST = 2000  # steps of its first slice
KINDS = 12  # of scheme, engine, eta and step that are probed at most
REHEARSED = 0.1  # of what all may take, is spent on computing some
LEAST, MOST = 0.5, 20.0  # s of that
APART = 0.1  # relative, between one run and the next
SIDES = 2.0  # standard errors of a range
GUESSED = 2.0  # times more or fewer cases may follow from words than a few tell
# s on the machine where `LOADED` s passed until the program had begun: of all, a row, a
# byte of traces; of a map, a case of it; of a page, a case with traces on it
LOADED, LAUNCHED, WARMED = 0.27, 0.6, 0.18
GATHERED, A_ROW, A_BYTE = 0.1, 5e-5, 3e-9
DRAWN, A_CELL = 1.7, 4e-6
PAGE, A_RECORD = 0.07, 8e-4
KEEPING = ("orbit", "full")  # details with traces
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Forecast:
    """What is left of a campaign.

    Attributes
    ----------
    cases, left : all, and those without a result; of those that words will ask for,
        see `more`
    steps : of those that are left, if they run to their end
    seconds : of one core in the kernel for them; of those that go on while they are
        undecided, to the next time that their word is asked for
    most : the same if all run to their end, and those that are undecided for as long as
        they may
    range : least and most of `seconds` by what was measured
    computations : how many there are, of cases and twins
    overhead : s of a core for each beside its kernel
    before, after : {what: s} that no further rank makes shorter
    launch : s until ranks know each other, where there are several
    more : cases that words ask for, or may, and that have not ended: as many as those
        of the nearest known cases would, least, most; (0, 0, 0) where there are none
    beyond : cases beyond the coarse level that have ended
    probed, rehearsed, finished : cases that the cost is learned from: marched for
        `PROBE` seconds, computed to their end, or finished in the directory before
    longest : s of the longest case
    compiled : whether kernels had to be compiled here
    disk : of the whole campaign, if no case ends early
    """

    cases: int
    left: int
    steps: float
    seconds: float
    most: float
    range: tuple[float, float]
    computations: float
    overhead: float
    before: dict[str, float]
    after: dict[str, float]
    probed: int
    rehearsed: int
    finished: int
    longest: float
    compiled: bool
    disk: Bytes
    launch: float = 0.0
    more: tuple[int, int, int] = (0, 0, 0)
    beyond: int = 0

    def wall(self, ranks: int) -> tuple[float, float, float]:
        """Return the seconds that the campaign takes on so many ranks: usual, range."""
        alone = sum(self.before.values()) + sum(self.after.values())
        alone += self.launch if ranks > 1 else 0.0
        beside = self.overhead * self.computations
        usual, low, high = (
            alone + max((kernel + beside) / ranks, self.longest)
            for kernel in (self.seconds, *self.range)
        )
        return usual, low * (1.0 - APART), high * (1.0 + APART)


def forecast(
    design: Design,
    folder: Path,
    shard: Shard | None = None,
    extended: Sequence[float] = (),
    stopping: Callable[[], bool] = lambda: False,
    loaded: float | None = None,
) -> Forecast:
    """Return what is left to compute of a design, and the bytes it will all take.

    Parameters
    ----------
    design : the campaign
    folder : its directory; if it has finished cases, they are learned from
    shard : whose cases alone are counted
    extended : s, to what undecided cases go on
    stopping : whether to compute no more cases for it
    loaded : s that this process took to begin, before it read its inputs; None: all
        the time that it has been there
    """
    since, step = age(), time_steps(design)
    pace = _pace(since if loaded is None else loaded)
    costs, longest = costs_of(design, step), longest_of(design, extended)
    mine = share(costs.steps, shard)
    plan = replace(design.manifest(), extended=list(extended))
    ended = ended_in(folder, plan)
    costs.learn_all(ended.seconds)
    left, spans = spans_of(design, ended, longest, mine)
    before = {"start": since, "plan": age() - since}
    finished = int(np.isfinite(costs.factor).sum())
    known = float(costs.predict(left) @ spans[:, 0])
    budget = 0.0 if finished else _budget(design, known)
    asked = design, folder, drawn(left), budget, stopping
    tried = rehearse(*asked) if left else Rehearsal()
    probed = 0 if finished else sum(_probe(design, c, costs) for c in _probes(design))
    learned, whole, error = learned_of(costs, tried)
    most = float(whole.predict(left) @ spans[:, 1])
    each = learned.predict(left)
    seconds = float(each @ spans[:, 0])
    overhead = _overhead(folder, costs) if finished else tried.overhead
    warm = WARMED * pace if tried.compiled else tried.warm
    before |= {"kernels": warm, "models": tried.first}
    found = Forecast(
        cases=len(mine),
        left=len(left),
        steps=float(np.asarray(costs.steps)[left] @ spans[:, 0]),
        seconds=seconds,
        most=most,
        range=_range(seconds, most, error, tried),
        computations=float(spans[:, 0].sum()),
        overhead=overhead,
        before=before,
        after=_after(len(mine), 0, pace),
        probed=probed,
        rehearsed=len(tried.seconds),
        finished=finished,
        longest=float((each * spans[:, 0]).max(initial=0.0)),
        compiled=tried.compiled,
        disk=_disk(design, longest, step),
        launch=LAUNCHED * pace,
    )
    if design.grows:
        found = _with_more(found, grown(design, ended, tried, _mean(found)))
    traces = found.disk.traces * (1.0 + found.more[0] / max(found.cases, 1))
    return replace(found, after=_after(found.cases + found.more[0], int(traces), pace))


def _budget(design: Design, seconds: float) -> float:
    """Return for how many seconds cases are computed, of a campaign of so many."""
    grown = design.most / max(len(design.settings), 1)
    return min(max(REHEARSED * seconds * grown, LEAST), MOST)


def age() -> float:
    """Return for how many seconds this process has been there."""
    ticks = begun(os.getpid())
    if ticks is None:  # no Linux
        return time.process_time()
    return time.clock_gettime(time.CLOCK_BOOTTIME) - ticks / os.sysconf("SC_CLK_TCK")


def _pace(loaded: float) -> float:
    """Return how long this machine takes over the one that constants are of."""
    return min(max(loaded / LOADED, 0.3), 10.0)


def _after(rows: int, traces: int, pace: float) -> dict[str, float]:
    """Return the seconds of what follows the last case."""
    page = PAGE + (A_RECORD * rows if traces else 0.0) if rows <= MOST_ON_PAGE else 0.0
    every = {
        "gather": GATHERED + A_ROW * rows + A_BYTE * traces,
        "map": DRAWN + A_CELL * rows,
        "page": page,
    }
    return {name: seconds * pace for name, seconds in every.items()}


def _range(
    seconds: float, most: float, error: float, tried: Rehearsal
) -> tuple[float, float]:
    """Return least and most seconds by what was measured."""
    if not tried.seconds and tried.reached < 1.0:  # no case has come to its end
        return seconds * tried.reached, most
    low = seconds * max(1.0 - SIDES * error, 0.0)
    return max(low, sum(tried.seconds.values())), seconds * (1.0 + SIDES * error)


def _overhead(folder: Path, costs: Costs) -> float:
    """Return the seconds beside its kernel that a case of earlier runs took."""
    shares = read_runs(folder)
    count = sum(int(each["cases"]) for each in shares)
    if not count:
        return 0.0
    known = np.isfinite(costs.factor)
    mean = float((costs.factor * costs.nominal)[known].mean())
    return max(sum(float(each["busy"]) for each in shares) / count - mean, 0.0)


def _mean(found: Forecast) -> float:
    """Return the mean seconds of what is left of the coarse level."""
    return found.seconds / max(found.computations, 1.0)


def _with_more(found: Forecast, beyond: Beyond) -> Forecast:
    """Return a forecast with the cases beyond the coarse ones."""
    low, high = found.range
    spread = GUESSED if beyond.guessed else 1.0
    least = beyond.count - beyond.guessed + int(beyond.guessed / spread)
    most = beyond.count - beyond.guessed + math.ceil(beyond.guessed * spread)
    return replace(
        found,
        steps=found.steps + beyond.steps,
        seconds=found.seconds + beyond.seconds,
        range=(low + beyond.seconds / spread, high + beyond.seconds * spread),
        most=found.most + beyond.most_seconds,
        computations=found.computations + beyond.count,
        more=(beyond.count, least, min(most, beyond.most)),
        beyond=beyond.ended,
    )


def longest_of(design: Design, extended: Sequence[float]) -> Floats:
    """Return how long each case is marched at most, over its time, (cases,)."""
    columns, out = design.columns, np.ones(len(design.settings))
    for cases, last in zip(columns.chunks(), columns.last_ends(), strict=True):
        longest = np.maximum(last, max(extended, default=0.0))
        out[cases] = longest / end_times(columns.all(cases))
    return out


def spans_of(
    design: Design, ended: Ended, longest: Floats, mine: Sequence[int]
) -> tuple[list[int], Floats]:
    """Return the coarse cases of which something is left, and for how long each.

    Parameters
    ----------
    design, ended : of the campaign
    longest : see `longest_of`
    mine : the cases to be looked at

    Returns
    -------
    cases : ascending
    spans : (cases, 2), how long each and its twins are marched at least, at most, over
        its time; of a refined campaign without twins
    """
    planner, twins = ended.planner(), design.twins
    jobs = planner.left()
    own = (jobs.row < planner.kind.first) & ((jobs.twin == 0) | (not design.grows))
    if len(mine) < planner.kind.first:
        own &= np.isin(jobs.row, np.asarray(mine))
    jobs = Jobs(*(one[own] for one in jobs))
    least, most = np.ones(len(jobs.row)), longest[jobs.row]
    for place in np.flatnonzero(jobs.stage).tolist():
        at = int(jobs.row[place]), int(jobs.stage[place])
        least[place], most[place] = _span(design, ended.plan.extended, *at)
    if twins and not design.grows:  # which follow
        first = jobs.twin == 0
        least[first] *= 1 if twins.is_late else 1 + twins.count
        most[first] *= 1 + twins.count
    cases, number = np.unique(jobs.row, return_inverse=True)
    each = [np.bincount(number, span, len(cases)) for span in (least, most)]
    return cases.tolist(), np.column_stack(each)


def _span(
    design: Design, extended: Sequence[float], case: int, stage: int
) -> tuple[float, float]:
    """Return how long a case is marched from a later stage on, at least, at most."""
    ends = design.scene(case).end_times
    before = max([ends[-1], *extended[: stage - 1]])
    soon = min(2.0 * before, extended[stage - 1])
    return (soon - before) / ends[0], (extended[-1] - before) / ends[0]


def _probes(design: Design) -> list[int]:
    """Return the cases to measure: the first, middle and last of each kind."""
    columns, own = design.columns, ("solver.scheme", "solver.modes", "solver.time_step")
    kind = columns.labels(n for n in columns.columns if "engine." in n or n in own)
    first = np.sort(np.unique(kind, return_index=True)[1])
    chosen: set[int] = set()
    for place in np.linspace(0, len(first) - 1, min(KINDS, len(first))).round():
        cases = np.flatnonzero(kind == kind[first[int(place)]])
        chosen |= {int(cases[i]) for i in (0, len(cases) // 2, -1)}
    return sorted(chosen)


def _probe(design: Design, case: int, costs: Costs) -> bool:
    """March a case for a moment and learn; return whether it could be marched."""
    try:
        resolved = design.resolved(case)
        march = March(resolved)
        march.advance(1)  # compiles
        march.seconds, size = 0.0, FIRST
        while march.seconds < PROBE and not march.done:
            march.advance(size)
            size *= 2
    except WhirlError:  # it will fail as a row
        return False
    step = march.seconds / max(march.steps - 1, 1)
    costs.learn([case], step * resolved.steps)
    return True


def _disk(design: Design, longest: Floats, step: Floats) -> Bytes:
    """Return the bytes of the campaign, if every case runs to its longest end."""
    columns = design.columns
    samples = np.zeros(len(design.settings), dtype=np.int64)
    intervals = np.full(len(design.settings), np.nan)
    for cases in columns.chunks():
        get = columns.all(cases)
        asked = end_times(get), step[cases], get("output.interval")
        count, intervals[cases] = _sampling(*asked)
        kept = np.isin(get(DETAIL), KEEPING)
        samples[cases] = np.where(kept, longest[cases] * count, 0.0)
    sizes = sizes_of(_kinds(design))
    return bytes_of(design.manifest(), samples, intervals, sizes, facts_of(design))


def _sampling(end: Floats, step: Floats, interval: Any) -> tuple[Floats, Floats]:
    """Return samples and the seconds between them, see `case.limits.step_counts`.

    They are 0 and NaN where there is no step: those cases will fail as rows.
    """
    total = np.maximum(1.0, np.ceil(end / step - 1e-9))
    stride = np.maximum(1.0, np.rint(np.minimum(interval / step, total)))
    return np.nan_to_num(total // stride), stride * step


def _kinds(design: Design) -> list[dict[str, tuple[int, ...]]]:
    """Return {trace: shape without samples} of the cases with most in their traces."""
    detail, found = design.columns.values(DETAIL), []
    for case in sorted(_widest(design, detail)):
        scene = design.scene(case)
        step = scene.solver.time_step
        short = {"duration": 20 * step, "revolutions": 0.0, "interval": step}
        try:
            traces = simulate(apply_settings(scene, short)).traces
        except WhirlError:  # it will fail as a row
            continue
        found.append({name: values.shape[1:] for name, values in traces.items()})
    return found


def _widest(design: Design, detail: NDArray[Any]) -> set[int]:
    """Return, of each detail with traces, the cases of most blades and harmonics."""
    found = set[int]()
    for word in KEEPING:
        cases = np.flatnonzero(detail == word)
        for name in ("engine.rotor.blades", "engine.casing.harmonics"):
            if len(cases):
                found.add(int(cases[design.columns.values(name)[cases].argmax()]))
    return found
