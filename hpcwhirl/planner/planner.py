"""`Planner`, which returns the jobs of a campaign that are left, and its data types.

A job is one computation of a case or of one of its twins. A stage is one of its end
times: 0 the planned one, from 1 those of an extension.
"""

from __future__ import annotations

from array import array
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.refinement.words import NUMBERS, features_of
from hpcwhirl.scene.words import REGIMES, is_open, word_of

OK = "ok"  # status of a job that gave a result
# states of a case or twin; a state >= 0 is the number of its stage to be computed next
UNWANTED, FAILED, DONE = -3, -2, -1
Cases = NDArray[np.int64]


class Job(NamedTuple):
    """One computation of a campaign: a case or one of its twins, to one end time.

    Attributes
    ----------
    case : number of the case, which for a refined campaign includes its fidelity, see
        `refinement.rule.Family.number`
    twin : number of the twin, from 1; 0 for the case itself
    stage : 0: run to the planned end time; n: to the n-th end time of an extension
    """

    case: int
    twin: int = 0
    stage: int = 0


class Completion(NamedTuple):
    """How a job has ended: its status, and words and features of its motion.

    Attributes
    ----------
    status : status of the job's record, such as "ok" or "failed"
    outcome, regime, whirl : words of the result; "none" if there is none
    features : numbers that describe its motion, see `refinement.words.features_of`
    is_open : whether the regime may change in a longer run
    coarse_regime : regime of the coarser run; "none" without `solver.estimate`
    """

    status: str
    outcome: str = "none"
    regime: str = "none"
    whirl: str = "none"
    is_open: bool = False
    features: tuple[float, ...] = ()
    coarse_regime: str = "none"

    @property
    def is_ok(self) -> bool:
        """Whether the job has given a result."""
        return self.status == OK

    @property
    def word(self) -> str:
        """The regime, by which the planner compares cases; "" if there is none."""
        word = word_of(self.status, self.outcome, self.regime)
        return word if word in REGIMES else ""


def completion_of(record: Mapping[str, Any]) -> Completion:
    """Return how a job has ended, from its record in a journal.

    record : the record, as `campaign.evaluate` writes it
    """
    row = record.get("row") or {}
    status = str(record["status"])
    outcome, regime, whirl, coarse = (
        str(row.get(name, "none"))
        for name in ("outcome", "regime", "whirl", "coarse_regime")
    )
    told = row.keys() >= {*NUMBERS}
    features = features_of(row) if status == OK and told else ()
    still = status == OK and is_open(row)
    return Completion(status, outcome, regime, whirl, still, features, coarse)


class JobCode(NamedTuple):
    """Numbering of jobs: rank 0 sends another rank a whole number instead of a `Job`.

    Attributes
    ----------
    cases : upper bound of case numbers, exclusive
    twins : number of twins of a case
    """

    cases: int
    twins: int

    def encode(self, job: Job) -> int:
        """Return the number by which rank 0 sends a job to another rank."""
        return (job.stage * (1 + self.twins) + job.twin) * self.cases + job.case

    def decode(self, number: int) -> Job:
        """Return the job that rank 0 has sent as a number by `encode`."""
        rest, case = divmod(number, self.cases)
        stage, twin = divmod(rest, 1 + self.twins)
        return Job(case, twin, stage)


NONE = Completion("missing")  # how a job has ended that has not


class Ends:
    """How the jobs of the cases known beforehand have ended, many at once.

    Parameters
    ----------
    cases, twins, stages : numbers of cases, of twins of each, of later end times

    Attributes
    ----------
    table : the different ways in which jobs have ended
    codes : (cases, 1 + twins, 1 + stages), index in `table` of how each job has ended,
        see `Job`; -1: it has not
    """

    def __init__(self, cases: int = 0, twins: int = 0, stages: int = 0) -> None:
        self.table: list[Completion] = []
        self.codes = np.full((cases, 1 + twins, 1 + stages), -1, dtype=np.int32)
        self._code: dict[Completion, int] = {}

    def code(self, end: Completion) -> int:
        """Return the index in `table` of a way to end, which is added if it is new."""
        found = self._code.setdefault(end, len(self.table))
        if found == len(self.table):
            self.table.append(end)
        return found

    def column(self, name: str, codes: NDArray[np.int32]) -> NDArray[Any]:
        """Return a property of how jobs have ended, such as `is_ok`, (jobs,).

        name, codes : the property; (jobs,), indices in `table`
        """
        each = np.array([getattr(end, name) for end in [*self.table, NONE]])
        return np.asarray(each[codes])

    def find(self, job: Job) -> Completion | None:
        """Return how a job has ended; None if it has not."""
        if job.case >= len(self.codes):
            return None
        code = int(self.codes[job])
        return self.table[code] if code >= 0 else None


class Stages(NamedTuple):
    """The later end times of an extended campaign, to which undecided cases are run.

    Attributes
    ----------
    last : number of later end times; stage n is the run to the n-th
    passed : (cases,), how many of these end times are within the planned duration of
        each case; None: none is, for any case
    """

    last: int = 0
    passed: NDArray[np.int8] | None = None

    def after(self, case: int, stage: int) -> int | None:
        """Return the number of the stage that follows a stage of a case.

        None after the last stage. It is called for a case whose regime is still open.

        Parameters
        ----------
        case : row of the case in the planner
        stage : number of the stage that has ended
        """
        skipped = int(self.passed[case]) if self.passed is not None else 0
        following = max(stage, skipped) + 1
        return following if following <= self.last else None


class Jobs(NamedTuple):
    """Several jobs as three arrays with one entry for each job, (jobs,).

    Attributes
    ----------
    row : number of the job's case in the order in which the planner has got to know
        cases, see `Planner.cases`
    twin, stage : as in `Job`
    """

    row: Cases
    twin: Cases
    stage: Cases


class Followers(NamedTuple):
    """Cases and twins that must be computed because a case has ended.

    Attributes
    ----------
    cases : numbers of further cases
    twinned : numbers of those ended cases whose twins are to be computed
    """

    cases: Sequence[int] = ()
    twinned: Sequence[int] = ()


class Kind(Protocol):
    """A kind of campaign: which cases there are, and which follow from ended ones.

    The classes of `planner.kinds` have these attributes.

    Attributes
    ----------
    first : number of cases known beforehand; their numbers are 0 .. first - 1
    waiting : numbers of known cases that are computed only after `after` returned them
    grows : whether cases may follow from others, or wait for others
    """

    first: int
    waiting: Sequence[int]
    grows: bool

    def after(self, case: int, end: Completion) -> Followers:
        """Return the cases and twins that must be computed because a case has ended.

        Parameters
        ----------
        case : number of a case that has ended; each is passed at most once
        end : how its last stage with a result has ended, or its failure
        """


@runtime_checkable
class Whole(Kind, Protocol):
    """A kind of campaign whose cases are all known beforehand."""

    def after_all(
        self, over: NDArray[np.bool_], ends: NDArray[np.int32], known: Ends
    ) -> Cases:
        """Return the cases whose twins must be computed since some cases have ended.

        Parameters
        ----------
        over : (cases,), whether each case has ended, and has no further stage
        ends : (cases,), how it has ended, as an index in the table of `known`
        known : how jobs have ended
        """


class Planner:
    """The jobs left in a campaign, and those that follow from each job that ends.

    A case gets a row, the next number, when the planner gets to know it; arrays (rows,)
    have one entry for each case known so far.

    Parameters
    ----------
    kind : kind of the campaign
    twins : number of twins of a case that has twins
    stages : later end times of an extended campaign
    ends : how jobs have ended; those that have are not returned, only those that follow
        from them
    """

    def __init__(
        self,
        kind: Kind,
        twins: int = 0,
        stages: Stages = Stages(),  # noqa: B008 - immutable
        ends: Ends | None = None,
    ) -> None:
        self.kind, self.twins, self.stages = kind, twins, stages
        self.known = Ends() if ends is None else ends
        self._end = array("i")  # (rows,), see `ends`
        self._more: list[int] = []  # numbers of cases not known beforehand
        self._row: dict[int, int] = {}
        self._state = array("b")  # (rows, 1 + twins)
        self._add(kind.first)
        self._states[list(kind.waiting), 0] = UNWANTED
        if ends is not None:
            self._begin()

    @property
    def is_plain(self) -> bool:
        """Whether each case is one job, and no case follows from another."""
        return not (self.kind.grows or self.twins or self.stages.last)

    @property
    def ends(self) -> NDArray[np.int32]:
        """How the last stage with a result of each known case has ended, (rows,).

        It is an index in the table of `Ends`; -1: no stage has ended.
        """
        return np.frombuffer(self._end, np.int32)

    @property
    def cases(self) -> Sequence[int]:
        """The numbers of the cases known so far, in the order of their rows."""
        first = range(self.kind.first)
        return [*first, *self._more] if self._more else first

    def __len__(self) -> int:
        """Return the number of cases that the planner knows so far: of rows."""
        return self.kind.first + len(self._more)

    def row(self, case: int) -> int:
        """Return the row of a case (its position among the known cases) by number."""
        return case if case < self.kind.first else self._row[case]

    def number(self, row: int) -> int:
        """Return the number of the case in a row (position among the known cases)."""
        return row if row < self.kind.first else self._more[row - self.kind.first]

    def left(self) -> Jobs:
        """Return the jobs left to be computed, by row of the case and by twin."""
        state = self._states
        row, twin = np.nonzero(state >= 0)
        return Jobs(row, twin, state[row, twin].astype(np.int64))

    @property
    def waiting(self) -> Cases:
        """The rows of the known cases that are not wanted yet."""
        return np.flatnonzero(self._states[:, 0] == UNWANTED)

    def ahead(self) -> Jobs:
        """Return the jobs left, and the first job of each case that is not yet wanted.

        A case of a refined map is wanted only when the words of others ask for it; its
        first job is its computation as planned.
        """
        left, waits = self.left(), self.waiting
        if not len(waits):
            return left
        none = np.zeros_like(waits)
        return Jobs(*map(np.append, left, (waits, none, none)))

    @property
    def open(self) -> NDArray[np.bool_]:
        """Whether each known case, or one of its twins, has a job left, (rows,)."""
        state = self._states
        return np.asarray((state >= 0).any(axis=1) | (state[:, 0] == UNWANTED))

    @property
    def failed(self) -> NDArray[np.bool_]:
        """Whether each known case, or a twin, failed in its last stage, (rows,)."""
        return np.asarray((self._states == FAILED).any(axis=1))

    @property
    def failed_alone(self) -> NDArray[np.bool_]:
        """Whether each known case, twins apart, failed in its last stage, (rows,)."""
        return np.asarray(self._states[:, 0] == FAILED)

    @property
    def twinned(self) -> NDArray[np.bool_]:
        """Whether each known case has twins, by what has ended so far, (rows,)."""
        return np.asarray((self._states[:, 1:] != UNWANTED).any(axis=1))

    def count_twins(self) -> tuple[int, int, int]:
        """Return the numbers of twins by what has ended so far.

        These are the number of all, of those with a result, and of those without one.
        """
        state = self._states[:, 1:]
        counts = (state != UNWANTED, state == DONE, state == FAILED)
        all_of, done, failed = (int(one.sum()) for one in counts)
        return all_of, done, failed

    def complete(self, job: Job, end: Completion) -> list[Job]:
        """Record how a job has ended; return the jobs to compute because of it.

        If one of these has already ended, this is recorded, too, and the jobs that
        follow from it are returned instead.

        Parameters
        ----------
        job : the job
        end : how it has ended
        """
        left, todo = list[Job](), [(job, end)]
        while todo:
            for follower in self._followers(*todo.pop()):
                known = self.known.find(follower)
                if known is None:
                    left.append(follower)
                else:
                    todo.append((follower, known))
        return left

    @property
    def _states(self) -> NDArray[np.int8]:
        """State of each case and of its twins, (rows, 1 + twins), writable.

        Column 0 is the case; an entry >= 0 is the stage to be computed next, others are
        `UNWANTED`, `FAILED` and `DONE`. The array is a view: no row may be added while
        it exists.
        """
        return np.frombuffer(self._state, np.int8).reshape(len(self), 1 + self.twins)

    def _add(self, count: int) -> None:
        self._state.frombytes(bytes([0, *[UNWANTED % 256] * self.twins]) * count)
        self._end.frombytes(b"\xff" * (self._end.itemsize * count))

    def _begin(self) -> None:
        """Record how jobs have ended before; the cases of a grid all at once."""
        rows = self.left().row
        if isinstance(self.kind, Whole) and not self.kind.grows:
            self._walk(0, rows)
            over = self._states[:, 0] < 0
            twinned = self.kind.after_all(over, self.ends, self.known)
            for twin in range(1, 1 + self.twins):
                self._states[twinned, twin] = 0
                self._walk(twin, twinned)
            return
        for row in rows.tolist():
            job = Job(row)
            end = self.known.find(job)
            if end is not None:
                self.complete(job, end)

    def _walk(self, twin: int, rows: Cases) -> None:
        """Record how cases, or a twin of each, have ended, stage by stage.

        Parameters
        ----------
        twin : number of the twin; 0: the cases themselves
        rows : (m,), of the cases, whose stage 0 is wanted
        """
        stage, passed = np.zeros(len(rows), dtype=np.int64), self.stages.passed
        while len(rows):
            code = self.known.codes[rows, twin, stage]
            over = code >= 0
            rows, stage, code = rows[over], stage[over], code[over]
            ok, goes = (self.known.column(n, code) for n in ("is_ok", "is_open"))
            if not twin:
                last = self.ends[rows]
                self.ends[rows] = np.where(ok | (last < 0), code, last)
            self._states[rows, twin] = np.where(ok, DONE, FAILED)
            skipped = passed[rows] if passed is not None else 0
            stage = np.maximum(stage, skipped) + 1
            on = goes & (stage <= self.stages.last)
            rows, stage = rows[on], stage[on]
            self._states[rows, twin] = stage

    def _followers(self, job: Job, end: Completion) -> list[Job]:
        """Record how a job has ended; return all jobs that follow from it.

        Those that have already ended are returned, too.

        Parameters
        ----------
        job : the job
        end : how it has ended
        """
        row = self.row(job.case)
        at = row * (1 + self.twins) + job.twin
        if not job.twin and (end.is_ok or self._end[row] < 0):
            told = end if self.kind.grows else end._replace(features=())
            self._end[row] = self.known.code(told)
        stage = self.stages.after(job.case, job.stage) if end.is_open else None
        if stage is not None:
            self._state[at] = stage
            return [job._replace(stage=stage)]
        self._state[at] = DONE if end.is_ok else FAILED
        if job.twin:
            return []
        last = self.known.table[self._end[row]]
        cases, twinned = self.kind.after(job.case, last)
        return [*self._want(cases), *self._want_twins(twinned)]

    def _want(self, cases: Sequence[int]) -> list[Job]:
        for case in cases:
            if case < self.kind.first:  # a case that has waited
                self._state[case * (1 + self.twins)] = 0
            else:
                self._row[case] = len(self)
                self._more.append(case)
                self._add(1)
        return list(map(Job, cases))

    def _want_twins(self, cases: Sequence[int]) -> list[Job]:
        found = []
        for case in cases:
            at = self.row(case) * (1 + self.twins)
            for twin in range(1, 1 + self.twins):
                self._state[at + twin] = 0
                found.append(Job(case, twin))
        return found
