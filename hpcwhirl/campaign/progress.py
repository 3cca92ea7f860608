"""Progress of a campaign, for `hpcwhirl status`: read from the files of its directory.

These are the plan, the ranks' journals of ended cases, and their notes of cases that
are being computed.
"""

from __future__ import annotations

import itertools
import math
import time
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.arrays import Floats
from hpcwhirl.planner.planner import OK, Planner
from hpcwhirl.scene.batch_validation import end_times
from hpcwhirl.scene.table import listed
from hpcwhirl.scene.words import SHOWN, word_of
from hpcwhirl.store.directory.campaign_directory import STOP, Directory
from hpcwhirl.store.directory.completions import (
    SECONDS,
    CaseIndex,
    ended_in,
    is_plain,
    told_by,
)
from hpcwhirl.store.directory.heartbeats import Note
from hpcwhirl.store.directory.journal import Journals
from hpcwhirl.store.directory.manifest import Manifest
from hpcwhirl.store.directory.refined import (
    dropped_of,
    grown_plan,
    rows_of,
    superseded,
)
from hpcwhirl.store.reading.shares import words_of

# A rank counts as gone if none of its cases ended within this multiple of the longest
# computing time of a case, but at least within `LEAST_PATIENCE`, s.
PATIENCE = 3.0
LEAST_PATIENCE = 60.0
Words = NDArray[np.object_]


@dataclass(frozen=True)
class Computing:
    """What one rank computes now, as its note in the campaign's directory says.

    Attributes
    ----------
    rank : number of the rank
    host : name of its host
    cases : number of the case, or of several while kernels are compiled
    since : time at which it began, s since 1970; None if unknown
    seconds : time since then, s; None if unknown
    died : whether the process is known to have ended
    """

    rank: int
    host: str
    cases: list[int]
    since: float | None
    seconds: float | None
    died: bool


@dataclass(frozen=True)
class Progress:
    """How far a campaign is, as `hpcwhirl status` prints it.

    Attributes
    ----------
    cases, done, failed, left : numbers of all cases, of cases with a result, of cases
        that ended without a result, and of cases that have not ended
    ranks : number of ranks that finished a case recently
    rate : cases per hour of these ranks; None before the first case has ended
    eta : time left if these ranks go on at their rate, s; None if unknown
    kernel_share : share of these ranks' time spent in the kernel, up to their last
        case; `busy_fraction` in results also includes writing records
    stopped : `STOP` if that file exists, else why the last run stopped early, if known
    core_hours : kernel time spent, including cases computed twice, h
    core_hours_left : predicted kernel time of the cases left, h; None if unknown
    idle_for : time since the last case finished, s; None before the first
    words : {word: number of ended cases}, as maps show them: without cases whose word
        a confirming preset has superseded
    statuses : {status: number of ended cases}, as in results.h5
    running : what each rank computes now, the longest running first
    grows : whether refined cases may still be added
    dropped : number of cases left out because of a budget
    twins : numbers of twins: of those that cases have so far, of those with a result,
        and of those that ended without one
    """

    cases: int
    done: int
    failed: int
    left: int
    ranks: int
    rate: float | None
    eta: float | None
    kernel_share: float | None
    stopped: str
    core_hours: float
    core_hours_left: float | None
    idle_for: float | None
    words: dict[str, int]
    statuses: dict[str, int]
    running: list[Computing]
    grows: bool = False
    dropped: int = 0
    twins: tuple[int, int, int] = (0, 0, 0)


@dataclass(frozen=True)
class Worker:
    """What one rank has computed in one run, from its journal.

    Attributes
    ----------
    begun, ended : start of the rank, and end of its last case, s since 1970
    seconds : computing time of its cases, s
    work : number of time steps of its cases
    cases : number of its cases
    """

    begun: float
    ended: float
    seconds: float
    work: float
    cases: int

    @property
    def span(self) -> float:
        """Wall time from the rank's start to the end of its last case, s."""
        return max(self.ended - self.begun, 1e-9)


def worker_of(ended: Floats, seconds: Floats, work: Floats) -> Worker | None:
    """Return what the rank that wrote a journal has computed; None without times.

    A rank computes one case at a time: when a case ends, the rank has run for at least
    the computing time of all its cases so far. So each case gives an upper limit of the
    rank's starting time, and the earliest limit is taken.

    Parameters
    ----------
    ended : (records,), s since 1970, end of each case of the journal; NaN if unknown
    seconds : (records,), s, computing time of each case
    work : (records,), number of time steps of each case
    """
    timed = np.flatnonzero(np.isfinite(ended))
    if not len(timed):
        return None
    timed = timed[np.argsort(ended[timed], kind="stable")]
    begun = ended[timed] - np.cumsum(seconds[timed])
    return Worker(
        float(begun.min()),
        float(ended[timed[-1]]),
        float(seconds[timed].sum()),
        float(work[timed].sum()),
        len(timed),
    )


def computing(
    notes: Sequence[Note], digests: Sequence[str], ends: Mapping[str, float], now: float
) -> list[Computing]:
    """Return what each rank computes now: the cases in its note that have not ended.

    Parameters
    ----------
    notes : notes of all ranks and runs
    digests : digests of the plan's cases
    ends : {digest: time at which the case ended, s since 1970}
    now : present time, s since 1970
    """
    known, found = CaseIndex(digests), []
    for note in notes:
        begun = note.since or 0.0
        at_it = [d for d in note.digests if not ends.get(d, -math.inf) > begun]
        cases = [case for d in at_it if (case := known.find(d, -1)) >= 0]
        if cases:
            seconds = None if note.since is None else now - note.since
            found.append(
                Computing(
                    note.rank, note.host, cases, note.since, seconds, note.left_over
                )
            )
    return sorted(found, key=lambda one: -(one.seconds or 0.0))


def predicted_work(manifest: Manifest) -> Floats:
    """Return the number of time steps of each case of a plan, (cases,).

    Where the time step is not an input, it counts as 1 s.
    """
    table, base = manifest.table, manifest.base
    cases = np.arange(len(table))

    def get(name: str, default: float = 0.0) -> Any:
        column = table.column(name, base.get(name, default))
        return column.of(cases, np.array(listed(column.values), dtype=float))

    if get("solver.accuracy").any():
        return np.ones(len(table))
    return np.asarray(end_times(get) / get("solver.time_step", 1.0))


def active(workers: Sequence[Worker], longest: float) -> list[Worker]:
    """Return the ranks that seem to be working, since their last case ended recently.

    "Recently" is relative to the last case that ended on any rank.

    Parameters
    ----------
    workers : what all ranks have computed
    longest : computing time of the longest case, s
    """
    last = max((w.ended for w in workers), default=0.0)
    patience = max(LEAST_PATIENCE, PATIENCE * longest)
    return [w for w in workers if last - w.ended <= patience]


class Seen:
    """What the files of a campaign's directory say about its cases and ranks.

    Parameters
    ----------
    directory, manifest : the campaign's directory and its plan

    Attributes
    ----------
    manifest : plan with all cases that refinement has asked for so far
    work : (cases,), number of time steps of each case
    workers : what each rank has computed, if its journal has times
    open : (cases,), whether a job of a case or of its twins is left
    without : number of cases without a result, or that failed in an extension
    words, statuses : {word: number of cases}, see `Progress`
    twins : numbers of twins, see `Progress`
    ends : {digest: s since 1970} of the ended cases that heartbeats name
    spent, longest : time of all computations, and of the longest one, s
    """

    def __init__(self, directory: Directory, manifest: Manifest) -> None:
        journals, self.notes = directory.journals, directory.notes.all()
        planner = None
        if not is_plain(manifest):
            planner = ended_in(journals, manifest).planner()
            manifest = grown_plan(manifest, planner)
        self.manifest, self.work = manifest, predicted_work(manifest)
        self.workers: list[Worker] = []
        self.spent = self.longest = 0.0
        self.twins = 0, 0, 0
        status, word, last = self._read(journals)
        if planner is None:  # each case is one job
            self.open = status == ""
            over = ~self.open
            self._count(status[over].tolist(), word[over].tolist())
            self.without = int(((status != OK) & over).sum())
        else:
            self._plan(planner)
        known = CaseIndex(manifest.digests)
        named = {digest for note in self.notes for digest in note.digests}
        cases = {name: known.find(name, -1) for name in named}
        self.ends = {n: float(last[case]) for n, case in cases.items() if case >= 0}

    def _plan(self, planner: Planner) -> None:
        """Set what a campaign's planner tells: how cases have ended, what is left.

        A case that was computed again to confirm its word counts only in `statuses`.
        """
        rows, table = rows_of(self.manifest, planner), planner.known.table
        self.open = planner.open[rows]
        self.without = int((planner.failed_alone & ~planner.open).sum())
        self.twins = planner.count_twins()
        ended = planner.ends >= 0
        counts = ended.copy()
        counts[rows[superseded(self.manifest)]] = False
        words = [word_of(*table[end][:3]) for end in planner.ends[counts].tolist()]
        statuses = [table[end].status for end in planner.ends[ended].tolist()]
        self._count(statuses, words)

    def _read(self, journals: Journals) -> tuple[Words, Words, Floats]:
        """Read what each rank has computed, and how each case of the plan has ended.

        Returns
        -------
        status : (cases,), "": not ended
        word : (cases,), as `words_of` says
        last : (cases,), end, s since 1970; -inf: not ended
        """
        count = len(self.work)
        status, word = (np.full(count, "", dtype=object) for _ in range(2))
        last = np.full(count, -np.inf)
        each = told_by(journals, self.manifest.digests)
        for _, parts in itertools.groupby(each, key=lambda pair: pair[0].journal):
            columns = []
            for rows, numbers in parts:
                when, seconds = (rows.numbers(n, np.nan) for n in ("ended", SECONDS))
                columns.append((numbers, when, np.nan_to_num(seconds)))
                own, names = numbers >= 0, ("status", "row.outcome", "row.regime")
                stated, outcome, regimes = map(rows.words, names)
                status[numbers[own]] = stated[own]
                word[numbers[own]] = words_of(stated, outcome, regimes)[own]
                last[numbers[own]] = np.nan_to_num(when[own], nan=0.0)
            self._take(*map(np.concatenate, zip(*columns, strict=True)))
        return status, word, last

    def _take(self, case: NDArray[np.int64], ended: Floats, seconds: Floats) -> None:
        """Add what the rank that wrote one journal has computed.

        Parameters
        ----------
        case : (records,), number of each record's case in the plan, -1 for none
        ended, seconds : (records,), end, s since 1970, and computing time, s, of each
            record
        """
        work = np.zeros(len(case))
        work[case >= 0] = self.work[case[case >= 0]]
        worker = worker_of(ended, seconds, work)
        if worker is not None:
            self.workers.append(worker)
        self.spent += float(seconds.sum())
        self.longest = max(self.longest, float(seconds.max(initial=0.0)))

    def _count(self, statuses: Iterable[str], words: Iterable[str]) -> None:
        self.statuses, found = dict(Counter(statuses)), Counter(words)
        self.words = {word: found[word] for word in SHOWN if word in found}


def progress_of(directory: Directory, now: float | None = None) -> Progress:
    """Return how far a campaign is, for `hpcwhirl status`, from its directory.

    Parameters
    ----------
    directory : the campaign's directory
    now : present time, s since 1970; None: this moment

    Raises
    ------
    MissingFileError, StoreError
        if `directory` is no campaign's directory, or its plan is damaged
    """
    now = time.time() if now is None else now
    seen = Seen(directory, directory.plan.read())
    manifest, work = seen.manifest, seen.work
    workers = active(seen.workers, seen.longest)
    left_work = float(work[seen.open].sum())
    pace, span = sum(w.work / w.span for w in workers), sum(w.span for w in workers)
    done_work = sum(w.work for w in seen.workers)
    last = max((w.ended for w in seen.workers), default=None)
    left, spent = int(seen.open.sum()), seen.spent
    at_it = computing(seen.notes, manifest.digests, seen.ends, now)
    return Progress(
        cases=len(work),
        done=len(work) - left - seen.without,
        failed=seen.without,
        left=left,
        ranks=len(workers),
        rate=3600 * sum(w.cases / w.span for w in workers) if workers else None,
        eta=left_work / pace if pace else (0.0 if not left else None),
        kernel_share=sum(w.seconds for w in workers) / span if workers else None,
        stopped=stopped(directory, left, at_it),
        core_hours=spent / 3600,
        core_hours_left=left_work * spent / done_work / 3600 if done_work else None,
        idle_for=now - last if last else None,
        words=seen.words,
        statuses=seen.statuses,
        running=at_it,
        grows=bool(manifest.refine) and left > 0,
        dropped=dropped_of(manifest),
        twins=seen.twins,
    )


def stopped(directory: Directory, left: int, running: Sequence[Computing]) -> str:
    """Return why a campaign has stopped: `STOP` if that file exists, else as stored.

    It is "" after a kill, of which nothing is stored, and while a run is active.

    Parameters
    ----------
    directory : the campaign's directory
    left : number of cases left
    running : what the ranks compute now
    """
    if directory.stop_file.exists():
        return STOP
    if not left or any(not one.died for one in running):
        return ""
    told = directory.runs.why_stopped(directory.journals.next_run() - 1)
    return f"{STOP}, removed since" if told.endswith(f"{STOP} is there") else told


def duration_text(seconds: float) -> str:
    """Return a duration as text: ``42 s``, ``3 min``, ``5 h 20 min``."""
    whole = round(seconds)
    if whole < 120:
        return f"{whole} s"
    hours, minutes = divmod(round(seconds / 60), 60)
    return f"{hours} h {minutes:02d} min" if hours else f"{minutes} min"
