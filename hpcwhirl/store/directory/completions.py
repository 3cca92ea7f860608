"""Which jobs of a campaign have ended, read from the journals in its directory.

`Ended` holds them, and makes the planner of the jobs left. Journals are read as arrays,
each record with the number of its case (`told_by`), never record by record.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.planner.kinds import Chains, Folds, Grid, Refined, cases_before
from hpcwhirl.planner.planner import (
    OK,
    Completion,
    Ends,
    Job,
    Kind,
    Planner,
    Stages,
    completion_of,
)
from hpcwhirl.refinement.rule import Family, rule_of
from hpcwhirl.refinement.words import ATTRACTOR
from hpcwhirl.scene.batch_validation import Many
from hpcwhirl.scene.digests import CaseDigests, starts_of
from hpcwhirl.scene.quantities import WHOLE
from hpcwhirl.store.directory.journal import Journals
from hpcwhirl.store.directory.manifest import Manifest, digests_of
from hpcwhirl.store.directory.reader import Rows

SECONDS = "performance.seconds"
# words that tell how a job has ended, of the table `row` and all by their full names
OF_ROW = ("outcome", "regime", "whirl", "stop", "coarse_regime")
WORDS = ("status", *(f"row.{name}" for name in OF_ROW))
DIGEST = re.compile("[0-9a-f]{64}")
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


def _planned_in(rows: Rows) -> NDArray[np.bool_]:
    """Return for each record whether its job is a case to its planned duration.

    Returns (records,); it is False for a twin and for a longer run of an extension.

    rows : some records of a journal
    """
    return np.asarray(
        (rows.numbers("twin", 0) == 0) & (rows.numbers("longest", 0.0) == 0)
    )


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
        yield rows, np.where(_planned_in(rows), known.cases_of(rows), -1)


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


def _twins(plan: Manifest) -> int:
    """Return the number of twins that a case of a plan may have."""
    return int(plan.twins.get("count", 0))


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


class FurtherEnds(Ends):
    """How the jobs of a refined campaign have ended, of its further cases, too.

    Attributes
    ----------
    further : {digest of a case, twin and stage: index in `table`}
    taken : {digest of a case: its computing time, s}
    """

    def __init__(self, plan: Manifest) -> None:
        super().__init__(len(plan.digests), _twins(plan), len(plan.extended))
        self.family = family_of(plan)
        self.digest = digest_of(plan, self.family)
        self.further: dict[tuple[bytes, int, int], int] = {}
        self.taken: dict[bytes, float] = {}

    def find(self, job: Job) -> Completion | None:
        """Return how a job has ended; None if it has not."""
        if job.case < len(self.codes):
            return super().find(job)
        if not self.further:
            return None
        digest = bytes.fromhex(self.digest(job.case))
        code = self.further.get((digest, job.twin, job.stage), -1)
        return self.table[code] if code >= 0 else None


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
    told : {digest of a job: how it has ended}, of the digests that were asked for
    ends : how each job has ended
    """

    plan: Manifest
    over: NDArray[np.bool_]
    ok: NDArray[np.bool_]
    seconds: NDArray[np.float64]
    marched: NDArray[np.float64]
    told: dict[str, Completion]
    ends: Ends

    @classmethod
    def nothing(cls, plan: Manifest) -> Ended:
        """Return the state of a plan of which no job has ended yet."""
        count = len(plan.digests)
        over, ok = np.zeros((2, count), dtype=bool)
        seconds, steps = np.full((2, count), np.nan)
        of_grid = Ends(count, _twins(plan), len(plan.extended))
        ends = FurtherEnds(plan) if plan.refine else of_grid
        return cls(plan, over, ok, seconds, steps, {}, ends)

    def planner(self) -> Planner:
        """Return the planner of the jobs left in the campaign."""
        plan = self.plan
        return Planner(self._kind(), _twins(plan), stages_of(plan), self.ends)

    def _kind(self) -> Kind:
        plan, ends = self.plan, self.ends
        chained = "history" in plan.table.names
        if isinstance(ends, FurtherEnds):
            if chained:
                return Folds(ends.family, cases_before(plan.settings), ends.digest)
            return Refined(ends.family, plan.twins, ends.digest)
        if chained:
            return Chains(cases_before(plan.settings))
        return Grid(plan.settings, plan.swept, plan.digests, plan.twins)

    def seconds_of(self, case: int) -> float:
        """Return the computing time of a case to its planned duration, s; NaN if none.

        case : number of the case
        """
        if case < len(self.seconds):
            return float(self.seconds[case])
        ends = self.ends
        if not isinstance(ends, FurtherEnds):
            raise TypeError
        return ends.taken.get(bytes.fromhex(ends.digest(case)), math.nan)

    def take(
        self, rows: Rows, cases: Cases, asked: Asked, again: NDArray[np.bool_]
    ) -> None:
        """Enter how jobs have ended from their records; the oldest ones come first.

        Parameters
        ----------
        rows : some records of a journal
        cases : (records,), number of each record's case; -1: not of the plan
        asked : the jobs that `told` must have
        again : (records,), whether the job must be computed again: it counts as not
            done
        """
        code = np.where(again, -1, self._codes(rows))
        twin, stage = rows.numbers("twin", 0), stages_in(rows, self.plan)
        there = (twin >= 0) & (twin <= _twins(self.plan)) & (stage >= 0)
        at = np.flatnonzero(there & (cases >= 0))
        self.ends.codes[cases[at], twin[at].astype(np.int64), stage[at]] = code[at]
        own = np.flatnonzero(_planned_in(rows) & (cases >= 0))
        case, ok = cases[own], rows.words("status") == OK
        seconds = np.where(ok, rows.numbers(SECONDS, np.nan), np.nan)
        self.over[case], self.ok[case] = ~again[own], ok[own]
        self.seconds[case] = seconds[own]
        self.marched[case] = np.where(ok, marched_in(rows), np.nan)[own]
        for name, record in asked.among(rows):
            self.told.pop(name, None)
            if code[record] >= 0 and there[record]:
                self.told[name] = self.ends.table[int(code[record])]
        if isinstance(self.ends, FurtherEnds):
            own = np.flatnonzero(there & (cases < 0))
            names, of = rows.slots["digest"].copy(), rows.has("of")
            if of.any():
                names[of] = rows.slots["of"][of]
            each = (part[own].tolist() for part in (names, twin, stage, code, seconds))
            for name, one, time, how, taken in zip(*each, strict=True):
                self.ends.further[name, int(one), time] = how
                if not one and not time:
                    self.ends.taken[name] = taken

    def _codes(self, rows: Rows) -> NDArray[np.int64]:
        """Return how the job of each record has ended, (records,), as in `Ends`.

        rows : some records of a journal
        """
        key, lists = np.zeros(len(rows), dtype=np.int64), []
        for name in WORDS:
            codes, words = rows.codes(name)
            key = key * len(words) + codes
            lists.append(words)
        kinds, number = np.unique(key, return_inverse=True)
        places = np.unravel_index(kinds, tuple(map(len, lists)))
        each = ([words[i] for i in at] for words, at in zip(lists, places, strict=True))
        ends = [
            completion_of(
                {"status": status, "row": dict(zip(OF_ROW, row, strict=True))}
            )
            for status, *row in zip(*each, strict=True)
        ]
        ways = [self.ends.code(end) for end in ends]
        out = np.array(ways, dtype=np.int64)[number]
        odd = {n for name in WORDS for n in rows.others.get(name, {})}
        of_motion = self.plan.refine.get("words") == ATTRACTOR
        for record in range(len(rows)) if of_motion else odd:
            end = completion_of(rows.record(record))
            out[record] = self.ends.code(
                end if of_motion else end._replace(features=())
            )
        return out


class Asked:
    """Digests of some jobs, found among those of many records.

    names : the digests, hexadecimal
    """

    def __init__(self, names: Collection[str]) -> None:
        self.names = {name for name in names if DIGEST.fullmatch(name)}
        self._starts = [int(name[:16], 16) for name in self.names]

    def among(self, rows: Rows) -> Iterator[tuple[str, int]]:
        """Yield the digest of a job that was asked for, and its record's index.

        rows : some records of a journal
        """
        if not self.names:
            return
        words, has = rows.slots["digest"], rows.has("digest")
        like = np.isin(starts_of(words), np.array(self._starts, np.uint64))
        for record in np.flatnonzero(like & has).tolist():
            name = bytes(words[record]).hex()
            if name in self.names:
                yield name, record


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
    again: Callable[[Rows], NDArray[np.bool_]] | None = None,
) -> Ended:
    """Return which jobs of a campaign have ended, from the journals in its directory.

    The journals are read as arrays, without one object per record.

    Parameters
    ----------
    journals, plan : journals and plan of the campaign
    asked : digests of jobs that `Ended.told` must have
    again : returns for each record whether its job must be computed again, (records,);
        None: never
    """
    ended, known, few = Ended.nothing(plan), CaseIndex(plan.digests), Asked(asked)
    for rows in journals.rows():
        anew = np.zeros(len(rows), bool) if again is None else again(rows)
        ended.take(rows, known.cases_of(rows), few, anew)
    return ended
