"""Which jobs of a campaign have ended, read from the journals in its directory.

`Ended` holds them, and makes the planner of the jobs left. Journals are read as arrays,
each record with the number of its case (`told_by`); where an extension, twins or
refined cases need more, record by record (`ended_of`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.planner.kinds import Chains, Folds, Grid, Refined, cases_before
from hpcwhirl.planner.planner import (
    OK,
    Completion,
    Job,
    Kind,
    Planner,
    Stages,
    completion_of,
)
from hpcwhirl.refinement.rule import Family, rule_of
from hpcwhirl.scene.batch_validation import Many
from hpcwhirl.scene.digests import CaseDigests
from hpcwhirl.scene.quantities import WHOLE
from hpcwhirl.scene.words import OPEN
from hpcwhirl.store.directory.journal import Journals
from hpcwhirl.store.directory.manifest import Manifest, digests_of
from hpcwhirl.store.directory.reader import Rows
from hpcwhirl.store.directory.record import Record

SECONDS = "performance.seconds"
MARCHED = ("row.steps", "row.certificate", "row.duration")
Cases = NDArray[np.int64]


def marched(steps: Any, certificate: Any, duration: Any) -> NDArray[np.float64]:
    """Return the number of time steps that each run has really integrated, (rows,).

    A run with a certificate (a proof that no blade can touch again) was integrated
    until then, others to the end.

    Parameters
    ----------
    steps : (rows,), number of time steps that the whole duration has
    certificate : (rows,), s, time from which the motion is known in closed form; -1:
        never
    duration : (rows,), s, simulated time of the whole run
    """
    with np.errstate(all="ignore"):  # a record may hold any numbers
        share = np.where(certificate < 0.0, 1.0, np.divide(certificate, duration))
        return np.asarray(steps * share)


def marched_in(rows: Rows) -> NDArray[np.float64]:
    """Return the number of time steps integrated for each record, (records,).

    It is NaN where unknown; see `marched`.

    rows : some records of a journal
    """
    return marched(*(rows.numbers(name, np.nan) for name in MARCHED))


def open_in(rows: Rows) -> NDArray[np.bool_]:
    """Return for each record whether a longer run may change its regime, (records,).

    rows : some records of a journal
    """
    status, regime, stop = map(rows.words, ("status", "row.regime", "row.stop"))
    still = np.logical_or.reduce([regime == word for word in OPEN])
    return np.asarray(still & (status == "ok") & (stop == "end"))


def told_by(journals: Journals, digests: Sequence[str]) -> Iterator[tuple[Rows, Cases]]:
    """Yield the records of all journals in batches, each record with its case's number.

    The oldest records come first. The number is that in the plan; it is -1 for a twin,
    a longer run of an extension and a case of another plan.

    Parameters
    ----------
    journals : journals of a campaign
    digests : digests of the planned cases

    Yields
    ------
    a batch of records; and the numbers of their cases, (records,)
    """
    known = CaseIndex(digests)
    for rows in journals.rows():
        planned = (rows.numbers("twin", 0) == 0) & (rows.numbers("longest", 0.0) == 0)
        yield rows, np.where(planned, known.cases_of(rows), -1)


class CaseIndex:
    """Finds the number of a planned case by the case's digest.

    Parameters
    ----------
    digests : digest of each case of a plan, in the order of its cases
    """

    def __init__(self, digests: Sequence[str]) -> None:
        self.digests, self._case_of = digests, dict[str, int]()
        if not isinstance(digests, CaseDigests):
            self._case_of = {name: case for case, name in enumerate(digests)}

    def find(self, name: str, hint: Any = -1) -> int:
        """Return the number of the case that has a digest; -1 if there is no such case.

        Parameters
        ----------
        name : the digest
        hint : number of the case to try first
        """
        place = hint if isinstance(hint, int) else -1
        if isinstance(self.digests, CaseDigests):
            return self.digests.find(name, place)
        if 0 <= place < len(self.digests) and self.digests[place] == name:
            return place
        return self._case_of.get(name, -1)

    def find_all(self, words: NDArray[Any], hints: Cases) -> Cases:
        """Return the number of the case that has each of m digests, (m,); -1 for none.

        Parameters
        ----------
        words : (m,), digests of 32 bytes
        hints : (m,), number of the case to try first for each digest
        """
        if isinstance(self.digests, CaseDigests):
            return self.digests.find_all(words, hints)
        names = [bytes(word).hex() for word in words]
        both = zip(names, hints.tolist(), strict=True)
        return np.array([self.find(*pair) for pair in both], np.int64)

    def cases_of(self, rows: Rows) -> Cases:
        """Return the number of each record's case, (records,); -1: none.

        The record of a twin belongs to the case that is perturbed.

        If the journal's case numbers refer to this plan, these numbers are returned,
        and no digests are compared.

        rows : some records of a journal
        """
        case, plan = rows.numbers("case", -1), rows.header.plan
        if isinstance(self.digests, CaseDigests) and plan == self.digests.identity:
            inside = (case >= 0) & (case < len(self.digests))
            return np.where(inside, case, -1)
        of, found = rows.has("of"), np.full(len(rows), -1)
        for name, has in (("digest", rows.has("digest") & ~of), ("of", of)):
            if has.any():
                found[has] = self.find_all(rows.slots[name][has], case[has])
        for name in ("digest", "of"):
            for record, value in rows.others.get(name, {}).items():
                found[record] = self.find(str(value), int(case[record]))
        return found


class Place(NamedTuple):
    """What a record in a journal is the result of: a case or twin, and the end time.

    Attributes
    ----------
    of : digest of the case
    twin : number of the twin; 0: the case itself
    stage : 0: run to the planned end time; n: to the n-th end time of an extension
    """

    of: str
    twin: int
    stage: int


def job_of(record: Record, plan: Manifest) -> Place:
    """Return which case, twin and stage a record is the result of.

    The stage is -1 if the plan has no such job.
    """
    of, twin = str(record.get("of", record.get("digest", ""))), record.get("twin", 0)
    time = record.get("longest", 0.0)
    if not isinstance(twin, int) or not 0 <= twin <= plan.twins.get("count", 0):
        return Place("", 0, -1)
    times = _times(plan)
    return Place(of, twin, times.index(time) if time in times else -1)


def stages_in(rows: Rows, plan: Manifest) -> NDArray[np.int64]:
    """Return the stage to which each record belongs, (records,); -1: none of the plan.

    Stage 0 is the run to the planned end time, n that to the n-th end time of an
    extension.

    Parameters
    ----------
    rows : some records of a journal
    plan : plan of the campaign
    """
    time, stages = rows.numbers("longest", 0.0), np.full(len(rows), -1)
    for stage, ends in enumerate(_times(plan)):
        stages[time == ends] = stage
    return stages


def _times(plan: Manifest) -> list[float]:
    """Return the end time of each stage of a plan, s; 0.0 for the planned duration.

    Later stages are the longer runs of an extension.
    """
    return [0.0, *plan.extended]


def family_of(plan: Manifest) -> Family:
    """Return all cases that a refined campaign may have, from its plan."""
    return Family(rule_of(plan.refine), plan.settings, WHOLE)


def digest_of(plan: Manifest, family: Family) -> Callable[[int], str]:
    """Return a function that gives the digest of a refined campaign's case by number.

    Parameters
    ----------
    plan : plan of the campaign
    family : all cases that it may have
    """
    find = digests_of(plan)
    known = dict(enumerate(plan.digests))

    def digest(case: int) -> str:
        if case not in known:
            known[case] = find.planned(family.settings(family.address(case)))
        return known[case]

    return digest


@dataclass(frozen=True)
class Ended:
    """The jobs of a campaign that have ended, and how, from its journals.

    Attributes
    ----------
    plan : plan of the campaign
    over, ok : (cases,), whether each case of the plan (in a refined plan, each coarse
        case) has ended at its planned duration, and whether it gave a result
    seconds, marched : (cases,), computing time, s, and number of integrated time steps;
        NaN for cases without a result
    told : {digest of a job: how it has ended}; if each case is one job (`is_plain`),
        only for the digests passed to `ended_in` as `asked`
    places : {case, twin and stage: how that job has ended}; empty if `is_plain`
    taken : {digest: computing time, s} of cases at their planned duration
    """

    plan: Manifest
    over: NDArray[np.bool_]
    ok: NDArray[np.bool_]
    seconds: NDArray[np.float64]
    marched: NDArray[np.float64]
    told: dict[str, Completion]
    places: dict[Place, Completion]
    taken: dict[str, float]

    @classmethod
    def nothing(cls, plan: Manifest) -> Ended:
        """Return the state of a plan of which no job has ended yet."""
        count = len(plan.digests)
        over, ok = np.zeros((2, count), dtype=bool)
        seconds, steps = np.full((2, count), np.nan)
        return cls(plan, over, ok, seconds, steps, {}, {}, {})

    def planner(self) -> Planner:
        """Return the planner of the jobs left in the campaign."""
        plan = self.plan
        kind, find = self._refined() if plan.refine else self._grid()
        if is_plain(plan):
            planner = Planner(kind)
            planner.complete_plain(self.over, self.ok)
            return planner
        return Planner(kind, int(plan.twins.get("count", 0)), stages_of(plan), find)

    def _grid(self) -> tuple[Kind, Callable[[Job], Completion | None]]:
        plan, known = self.plan, CaseIndex(self.plan.digests)
        jobs = {
            Job(known.find(of), twin, stage): end
            for (of, twin, stage), end in self.places.items()
        }
        if "history" in plan.table.names:
            return Chains(cases_before(plan.settings)), jobs.get
        return Grid(plan.settings, plan.swept, plan.digests, plan.twins), jobs.get

    def _refined(self) -> tuple[Kind, Callable[[Job], Completion | None]]:
        family = family_of(self.plan)
        digest = digest_of(self.plan, family)

        def find(job: Job) -> Completion | None:
            return self.places.get(Place(digest(job.case), job.twin, job.stage))

        if "history" in self.plan.table.names:
            return Folds(family, cases_before(self.plan.settings), digest), find
        return Refined(family, self.plan.twins, digest), find

    def take(self, record: Record, case: int, *, again: bool) -> None:
        """Enter how a job has ended from its record; records must come oldest first.

        Parameters
        ----------
        record : the record
        case : number of its case; -1 for twins, longer runs and cases of other plans
        again : whether the record's job must be computed again: it counts as not done
        """
        name, end = record["digest"], completion_of(record)
        place = job_of(record, self.plan)
        self.told.pop(name, None)
        self.places.pop(place, None)
        if not again and place.stage >= 0:
            self.told[name] = self.places[place] = end
        seconds = float(record.get("performance", {}).get("seconds", math.nan))
        if end.is_ok and not place.twin and not place.stage:
            self.taken[name] = seconds
        if case >= 0:
            self.over[case], self.ok[case] = not again, end.is_ok
            self.seconds[case] = seconds if end.is_ok else math.nan
            row = record.get("row", {}) if end.is_ok else {}
            told = (row.get(name.removeprefix("row."), math.nan) for name in MARCHED)
            self.marched[case] = marched(*told)


def stages_of(plan: Manifest) -> Stages:
    """Return the later end times of an extended campaign, as the planner needs them.

    They are their number, and how many of them each case's planned duration passes.
    """
    if not plan.extended:
        return Stages()
    columns = Many(digests_of(plan).base, plan.table)
    last = np.concatenate(list(columns.last_ends()))
    passed = np.searchsorted(plan.extended, last, side="right")
    return Stages(len(plan.extended), passed.astype(np.int8))


def is_plain(plan: Manifest) -> bool:
    """Return whether each case of a plan is one job, and none follows from another.

    Such a plan has no twins, extension, refinement or branches.
    """
    chained = "history" in plan.table.names
    return not (plan.refine or plan.twins or plan.extended or chained)


def ended_in(
    journals: Journals,
    plan: Manifest,
    asked: Collection[str] = (),
    again: Callable[[Record], bool] | None = None,
) -> Ended:
    """Return which jobs of a campaign have ended, from the journals in its directory.

    Parameters
    ----------
    journals, plan : journals and plan of the campaign
    asked : digests of jobs that `Ended.told` must have
    again : returns whether the job of a record must be computed again; None: never
    """
    if is_plain(plan) and again is None:
        known = CaseIndex(plan.digests)
        cases = {name: known.find(name) for name in asked}
        if min(cases.values(), default=0) >= 0:
            return _by_columns(journals, plan, cases)
    return ended_of(plan, journals.records(), again)


def ended_of(
    plan: Manifest,
    records: Iterable[Record],
    again: Callable[[Record], bool] | None = None,
) -> Ended:
    """Return which jobs of a plan have ended, from records in the order of their age.

    Parameters
    ----------
    plan : plan of the campaign
    records : records of its journals, the oldest first
    again : returns whether the job of a record must be computed again; None: never
    """
    ended, known = Ended.nothing(plan), CaseIndex(plan.digests)
    for record in records:
        planned = not record.get("twin") and not record.get("longest")
        case = known.find(record["digest"], record.get("case")) if planned else -1
        ended.take(record, case, again=again is not None and again(record))
    return ended


def _by_columns(journals: Journals, plan: Manifest, asked: Mapping[str, int]) -> Ended:
    """Return which jobs have ended in a plan without twins, refinement and extension.

    The journals are read as arrays, without one object per record.

    Parameters
    ----------
    journals, plan : journals and plan of the campaign
    asked : {digest: case} of the jobs that `Ended.told` must have
    """
    ended = Ended.nothing(plan)
    names = {case: name for name, case in asked.items()}
    numbers = np.array(list(names), dtype=np.int64)
    for rows, cases in told_by(journals, plan.digests):
        own = np.flatnonzero(cases >= 0)
        case, status = cases[own], rows.words("status")[own]
        ok = status == OK
        ended.over[case], ended.ok[case] = True, ok
        ended.seconds[case] = np.where(ok, rows.numbers(SECONDS, np.nan)[own], np.nan)
        ended.marched[case] = np.where(ok, marched_in(rows)[own], np.nan)
        asked_for = np.flatnonzero(np.isin(case, numbers))
        still = open_in(rows)[own[asked_for]] if len(asked_for) else ()
        for place, is_open in zip(asked_for, still, strict=True):
            end = Completion(str(status[place]), is_open=bool(is_open))
            ended.told[names[int(case[place])]] = end
    return ended
