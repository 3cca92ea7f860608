"""Forecast of a campaign: its wall time on a number of ranks, and its bytes on disk.

The number of time steps follows from the inputs. The time of a step, the overhead of a
case beyond its steps, and the share of cases that end early are learned from the
finished cases in the directory, such as those of a pilot (a short trial run); if no
case has finished, the scheme's nominal time of a step is used. The range covers the
uncertainty of this sample and `APART`, the relative difference between two runs.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.arrays import Floats
from hpcwhirl.campaign.finalize import facts_of
from hpcwhirl.campaign.foresight.foreseen import Beyond, grown
from hpcwhirl.campaign.plan.cost import Costs, costs_of, time_steps
from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.campaign.simulate import simulate
from hpcwhirl.campaign.work import share
from hpcwhirl.errors import WhirlError
from hpcwhirl.launch import Shard
from hpcwhirl.planner.planner import Jobs
from hpcwhirl.scene import apply_settings
from hpcwhirl.scene.batch_validation import end_times
from hpcwhirl.scene.campaign_tables import Campaign
from hpcwhirl.scene.contact_laws import RIGID, rods_around
from hpcwhirl.scene.table import Cases
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.directory.completions import Ended, ended_in
from hpcwhirl.store.directory.heartbeats import begun
from hpcwhirl.store.directory.runs import COSTS, Runs
from hpcwhirl.store.results.layout import Bytes, bytes_of
from hpcwhirl.store.results.variables import DETAIL, LAW

# least share of its steps that a case counts as integrated, where the time of the
# whole case is extrapolated
LITTLE = 0.1
APART = 0.25  # relative difference of the times of two runs on a shared machine
ALONE = 2.0  # relative width of the range of times, upward, if one case has finished
LIKELY = 0.95  # probability with which a range of times holds, by Student's t
GUESSED = 2.0  # factor by which the number of refined cases may be wrong
# Times, s, on the machine where the program started in `LOADED` s: for connecting ranks
# and loading kernels; for gathering in total, per row and per byte of traces; for a
# map, and per case of it; for a page, and per case with traces on it.
LOADED, LAUNCHED, WARMED = 0.27, 0.6, 0.18
BESIDE = 1e-3  # s, assumed time of a case outside its kernel, before any has ended
GATHERED, A_ROW, A_BYTE = 0.1, 5e-5, 3e-9
DRAWN, A_CELL = 1.7, 4e-6
PAGE, A_RECORD = 0.07, 8e-4
RODS = ("engine.casing.layer_edge", "engine.rotor.radius", "engine.casing.layer_rods")
# inputs whose largest values, or a lost blade, need the largest samples of traces
MOST = ("engine.rotor.blades", "engine.casing.harmonics", "engine.rotor.lost_blade")
KEEPING = ("orbit", "full")  # values of output.traces that keep traces


@dataclass(frozen=True)
class Forecast:
    """Predicted computing time of the cases left in a campaign, and its disk space.

    Kernel time is time spent in the compiled integration. In a refined campaign, cases
    that follow from words are counted by `more`.

    Attributes
    ----------
    cases, left : number of planned cases, and of those without a result
    steps : number of time steps of the cases left, if none ends early
    seconds : kernel time of the cases left on one core, s; a case with `until =
        "decided"` counts up to the next time at which its regime is determined
    most : upper bound of `seconds`: no case ends early, every undecided one runs to
        `longest`
    range : lower and upper limit of `seconds`, by the scatter of finished cases; if
        there are none, nominal times with no step and with every step in contact
    computations : number of cases and twins left
    overhead : time of each computation outside its kernel, s
    before, after : {stage: s} of the stages before and after the cases, whose time does
        not depend on the number of ranks
    launch : time until several ranks are connected, s
    more : numbers of refined cases left: (expected, least, most); (0, 0, 0) if there
        are none
    beyond : number of refined cases that have ended
    finished : number of finished cases from which the forecast is learned
    longest : kernel time of the longest case, s
    disk : bytes of the whole campaign, if no case ends early
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
    finished: int
    longest: float
    disk: Bytes
    launch: float = 0.0
    more: tuple[int, int, int] = (0, 0, 0)
    beyond: int = 0

    def wall(self, ranks: int) -> tuple[float, tuple[float, float]]:
        """Return the predicted wall time on `ranks` ranks, and its range.

        Returns
        -------
        s; and (low, high), s
        """
        low, high = (self._wall(kernel, ranks) for kernel in self.range)
        if self.finished:
            low, high = low * (1.0 - APART), high * (1.0 + APART)
        return self._wall(self.seconds, ranks), (low, high)

    def _wall(self, kernel: float, ranks: int) -> float:
        alone = sum(self.before.values()) + sum(self.after.values())
        alone += self.launch if ranks > 1 else 0.0
        beside = self.overhead * self.computations
        return alone + max((kernel + beside) / ranks, self.longest)


def forecast(
    design: Design,
    directory: Directory,
    shard: Shard | None = None,
    extended: Sequence[float] = (),
    started: float | None = None,
    loaded: float | None = None,
) -> Forecast:
    """Return the forecast of a campaign's computing time and disk space.

    Parameters
    ----------
    design : the campaign's cases
    directory : the campaign's directory; times are learned from its finished cases
    shard : shard whose cases count; None: all cases
    extended : end times to which undecided cases are extended, s
    started, loaded : time from the start of this process until its inputs were checked,
        and until it began to read its inputs, s; None: the age of the process
    """
    since, step = age(), time_steps(design)
    started = since if started is None else started
    pace = _pace(started if loaded is None else loaded)
    longest = longest_of(design, extended)
    disk = _disk(design, longest, step)  # first, while few arrays over cases are held
    costs = costs_of(design, step)
    mine = share(costs.steps, shard)
    plan = replace(design.manifest(), extended=list(extended))
    ended = ended_in(directory.journals, plan)
    costs.learn_all(ended.seconds)
    left, spans = spans_of(design, ended, longest, mine)
    known = costs.factor[np.isfinite(costs.factor)]
    to_end, most = _to_their_end(ended, costs).predict(left) @ spans
    each = costs.predict(left) * spans[:, 0]
    seconds, slowest = float(each.sum()), float(each.max(initial=0.0))
    del each
    if len(known):
        span = _range(seconds, known, float(to_end))
    else:
        span = _nominal_range(design, step, (left, spans[:, 0]))
    overhead, first = _beside(directory.runs, pace)
    found = Forecast(
        cases=len(mine),
        left=len(left),
        steps=float(np.asarray(costs.steps)[left] @ spans[:, 0]),
        seconds=seconds,
        most=float(most),
        range=span,
        computations=float(spans[:, 0].sum()),
        overhead=overhead,
        before={"start": started, "plan": age() - since, "kernels": WARMED * pace,
                "models": first},
        after={},
        finished=len(known),
        longest=slowest,
        disk=disk,
        launch=LAUNCHED * pace,
    )  # fmt: skip
    if design.grows:
        found = _with_more(found, grown(design, ended, _mean(found)))
    traces = found.disk.traces * (1.0 + found.more[0] / max(found.cases, 1))
    rows = found.cases + found.more[0]
    return replace(found, after=_after(rows, int(traces), pace, design.rules))


def age() -> float:
    """Return the time since this process was started, s, part of the forecast."""
    ticks = begun(os.getpid())
    if ticks is None:  # not Linux
        return time.process_time()
    return time.clock_gettime(time.CLOCK_BOOTTIME) - ticks / os.sysconf("SC_CLK_TCK")


def _pace(loaded: float) -> float:
    """Return how much slower this machine is than the one of this module's times.

    loaded : time from the start of this process until it began to read its inputs, s
    """
    return min(max(loaded / LOADED, 0.3), 10.0)


def _after(rows: int, traces: int, pace: float, rules: Campaign) -> dict[str, float]:
    """Return {stage: predicted time, s} of the stages after the cases.

    These are gathering, and drawing the map and writing the page if asked for.

    Parameters
    ----------
    rows : number of cases
    traces : bytes of their traces
    pace : how much slower this machine is, see `_pace`
    rules : table [campaign], which says whether there are map and page
    """
    every = {
        "gather": GATHERED + A_ROW * rows + A_BYTE * traces,
        "map": DRAWN + A_CELL * rows,
        "page": PAGE + (A_RECORD * rows if traces else 0.0),
    }
    stages = {"gather"} | rules.pictures(rows)
    return {name: seconds * pace for name, seconds in every.items() if name in stages}


def _range(seconds: float, factors: Floats, whole: float) -> tuple[float, float]:
    """Return the lower and upper limit of the predicted time of the cases left, s.

    The limits follow from the scatter of finished cases; of few cases, the scatter
    itself is uncertain. The upper limit also counts cases that run to their end, unlike
    those that have finished: of n cases none is such a one with probability (1 - u)^n
    if their share is u.

    Parameters
    ----------
    seconds : the predicted time, s
    factors : (finished cases,), measured time of each over its nominal time
    whole : the predicted time if no case ends early, s
    """
    from scipy.special import stdtrit  # needed where cases have finished only

    wide, count = ALONE, len(factors)
    if count > 1 and factors.any():
        sides = float(stdtrit(count - 1, 0.5 + 0.5 * LIKELY))
        wide = sides * float(factors.std(ddof=1) / factors.mean()) / math.sqrt(count)
    unseen = 1.0 - (1.0 - LIKELY) ** (1.0 / count)
    most = max(seconds * (1.0 + wide), seconds + unseen * (whole - seconds))
    return seconds * max(1.0 - wide, 0.0), most


def _nominal_range(
    design: Design, step: Floats, left: tuple[Cases, Floats]
) -> tuple[float, float]:
    """Return the nominal times of the cases left, s: never and always in contact.

    Parameters
    ----------
    design : the campaign's cases
    step : (cases,), s, time step of each case
    left : numbers of the cases left; and the simulated time left of each over its end
        time
    """
    cases, spans = left
    low, high = (
        float(costs_of(design, step, share).nominal[cases] @ spans)
        for share in (0.0, 1.0)
    )
    return low, high


def _to_their_end(ended: Ended, costs: Costs) -> Costs:
    """Return the costs of cases if all of them ran to their end times.

    A certificate (a proof that blades no longer touch) ended some finished cases early;
    their measured times are scaled up to the end time.

    Parameters
    ----------
    ended : completed jobs
    costs : costs learned from them
    """
    if not np.isfinite(costs.factor).any():
        return costs
    whole = Costs(costs.nominal, costs.places, costs.steps)
    part = ended.marched / np.maximum(np.asarray(costs.steps), 1.0)
    whole.learn_all(ended.seconds / np.maximum(part, LITTLE))
    return whole


def _beside(runs: Runs, pace: float) -> tuple[float, float]:
    """Return the time of a case outside its kernel, s, and the first case's extra time.

    Both are those of the last run that recorded them; nominal if no run has.

    Parameters
    ----------
    runs : files of the campaign's runs
    pace : how much slower this machine is, see `_pace`
    """
    shares = [share for share in runs.shares() if "beside" in share]
    last = [share for share in shares if share["run"] == shares[-1]["run"]]
    if not last:
        return BESIDE * pace, 0.0
    usual, first = ([float(share[name]) for share in last] for name in COSTS)
    return float(np.median(usual)), float(np.median(first))


def _mean(found: Forecast) -> float:
    """Return the mean computing time of the coarse cases still to compute, s.

    Coarse cases are those of [sweep].

    found : forecast of these cases
    """
    return found.seconds / max(found.computations, 1.0)


def _with_more(found: Forecast, beyond: Beyond) -> Forecast:
    """Return a forecast to which the refined cases of a campaign are added.

    Parameters
    ----------
    found : forecast of the coarse cases (those of [sweep])
    beyond : number and cost of the refined cases
    """
    spread = GUESSED if beyond.guessed else 1.0
    least = beyond.count - beyond.guessed + int(beyond.guessed / spread)
    most = beyond.count - beyond.guessed + math.ceil(beyond.guessed * spread)
    low, high = found.range
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
    """Return each case's longest possible end time divided by its first, (cases,).

    Parameters
    ----------
    design : the campaign's cases
    extended : end times to which undecided cases are extended, s
    """
    columns, out = design.columns, np.ones(len(design.settings))
    for cases, last in zip(columns.chunks(), columns.last_ends(), strict=True):
        longest = np.maximum(last, max(extended, default=0.0))
        out[cases] = longest / end_times(columns.all(cases))
    return out


def spans_of(
    design: Design, ended: Ended, longest: Floats, mine: Sequence[int]
) -> tuple[Cases, Floats]:
    """Return the coarse cases with jobs left, and how long these jobs will simulate.

    Coarse cases are those of [sweep], without refined ones.

    Parameters
    ----------
    design : the campaign's cases
    ended : its completed jobs
    longest : (cases,), longest end time of each case over its first one
    mine : numbers of the cases to consider

    Returns
    -------
    cases : numbers of the cases, ascending
    spans : (cases, 2), least and largest simulated time of the jobs left of each case
        and its twins, over its end time; without twins in a refined campaign
    """
    planner, twins = ended.planner(), design.twins
    jobs = planner.ahead()
    own = (jobs.row < planner.kind.first) & ((jobs.twin == 0) | (not design.grows))
    if len(mine) < planner.kind.first:
        own &= np.isin(jobs.row, np.asarray(mine))
    if not own.all():  # a million cases: without a copy of each
        jobs = Jobs(*(one[own] for one in jobs))
    least, most = np.ones(len(jobs.row)), longest[jobs.row]
    later = np.flatnonzero(jobs.stage)
    if len(later):
        own = jobs.row[later], jobs.stage[later]
        least[later], most[later] = _spans(design, ended.plan.extended, *own)
    if twins and not design.grows:  # twins follow later
        first = jobs.twin == 0
        least[first] *= 1 if twins.is_late else 1 + twins.count
        most[first] *= 1 + twins.count
    if (np.diff(jobs.row) > 0).all():  # one job each
        return jobs.row, np.column_stack([least, most])
    cases, number = np.unique(jobs.row, return_inverse=True)
    each = [np.bincount(number, span, len(cases)) for span in (least, most)]
    return cases, np.column_stack(each)


def _spans(
    design: Design,
    extended: Sequence[float],
    cases: NDArray[np.int64],
    stages: NDArray[np.int64],
) -> tuple[Floats, Floats]:
    """Return the least and largest simulated time of extensions left, (jobs,) each.

    Both are divided by the first end time of the case. Least: the case is decided at
    the next time at which its word is determined; largest: never.

    Parameters
    ----------
    extended : end times of the extensions, s
    cases, stages : (jobs,), numbers of the cases; for each, number of the extension
        that is computed next, from 1
    """
    columns, (first, last) = design.columns, np.zeros((2, len(design.settings)))
    for part, ends in zip(columns.chunks(), columns.last_ends(), strict=True):
        first[part], last[part] = end_times(columns.all(part)), ends
    times = np.array([0.0, *extended])
    before = np.maximum(last[cases], times[stages - 1])
    soon = np.minimum(2.0 * before, times[stages])
    return (soon - before) / first[cases], (times[-1] - before) / first[cases]


def _disk(design: Design, longest: Floats, step: Floats) -> Bytes:
    """Return the bytes of the campaign if every case runs to its longest end time.

    Parameters
    ----------
    design : the campaign's cases
    longest : (cases,), longest end time of each case over its first one
    step : (cases,), s, time step of each case
    """
    columns = design.columns
    samples = np.zeros(len(design.settings), dtype=np.int64)
    intervals = np.full(len(design.settings), np.nan)
    for cases in columns.chunks():
        get = columns.all(cases)
        asked = end_times(get), step[cases], get("output.interval")
        count, intervals[cases] = _sampling(*asked)
        kept = np.isin(get(DETAIL), KEEPING)
        samples[cases] = np.where(kept, longest[cases] * count, 0.0)
    kinds = _kinds(design)
    return bytes_of(design.manifest(), samples, intervals, kinds, facts_of(design))


def _sampling(end: Floats, step: Floats, interval: Any) -> tuple[Floats, Floats]:
    """Return the number of samples in each case's traces, and their interval, s.

    Both (cases,); 0 and NaN for a case that has no time step and will fail. The numbers
    are those of `case.limits.step_counts`.

    Parameters
    ----------
    end : (cases,), s, end time of each case
    step : (cases,), s, its time step
    interval : (cases,) or one number, s, interval of samples that the user asks for
    """
    total = np.maximum(1.0, np.ceil(end / step - 1e-9))
    stride = np.maximum(1.0, np.rint(np.minimum(interval / step, total)))
    return np.nan_to_num(total // stride), stride * step


def _kinds(design: Design) -> list[dict[str, tuple[int, ...]]]:
    """Return {trace: shape of one sample} for those cases with the largest samples.

    Each is found by simulating the case for 20 steps.
    """
    detail, found = design.columns.values(DETAIL), []
    for case in sorted(_widest(design, detail)):
        scene = design.scene(case)
        step = scene.solver.time_step
        short = {"duration": 20 * step, "revolutions": 0.0, "interval": step}
        try:
            traces = simulate(apply_settings(scene, short)).traces
        except WhirlError:  # this case will fail
            continue
        found.append({name: values.shape[1:] for name, values in traces.items()})
    return found


def _widest(design: Design, detail: NDArray[Any]) -> set[int]:
    """Return the numbers of the cases with the largest samples of traces.

    For each value of `output.traces` these are the cases with the most blades,
    harmonics or rods of a wearing layer, and one that loses a blade.

    Parameters
    ----------
    design : the campaign's cases
    detail : (cases,), value of `output.traces` of each case
    """
    found, laws = set[int](), design.columns.values(LAW)
    for word in KEEPING:
        cases = np.flatnonzero(detail == word)
        for name in MOST:
            if len(cases):
                found.add(int(cases[design.columns.values(name)[cases].argmax()]))
        worn = cases[laws[cases] != RIGID]
        if len(worn):
            of = (design.columns.values(name)[worn] for name in RODS)
            found.add(int(worn[rods_around(*of).argmax()]))
    return found
