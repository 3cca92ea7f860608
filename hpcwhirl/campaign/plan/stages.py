"""What cases are computed as: as planned, then for longer where they are undecided.

An extended campaign (`campaign --extend undecided --to S`) has a stage for each time it
was extended to: its cases that a longer run may decide are computed once more, as cases
of `until = "decided"` and this `longest`, from the states that were kept of them or
anew. Their rows stand in the journals under digests of their own, with that of the case
they are `of`; what stands there of earlier stages stays. A case that is decided stays
as it is. So what a campaign holds follows from its plan alone, which tells the times.

So do the twins of a case (`twins`), each as a case like any other, after it. Those of
cases at boundaries alone are computed when all cases have their words.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.scene import Scene, apply_settings, digest
from hpcwhirl.scene.files import is_whole
from hpcwhirl.scene.words import is_open
from hpcwhirl.store.directory.journal import Record, scan
from hpcwhirl.store.directory.neighbours import at_boundary
from hpcwhirl.store.directory.rows import regime_of

if TYPE_CHECKING:
    from hpcwhirl.campaign.plan.twins import Twins
    from hpcwhirl.case.resolve import Case

Todo = tuple[tuple[int, int], ...]  # of a case: (twin, or 0; stage to begin with)


class Ended(NamedTuple):
    """How a computation ended.

    Attributes
    ----------
    status, word : of its record; the regime, "" for none
    is_open : whether a longer run may tell what it does not
    of, twin, longest : which it was, see `Job.facts`
    outcome, regime, whirl : of its row, if it has one
    case : that it is said to be of, by its number in the plan of its time
    """

    status: str
    word: str
    is_open: bool
    of: str
    twin: int
    longest: float
    outcome: str = "none"
    regime: str = "none"
    whirl: str = "none"
    case: int = -1

    @property
    def is_planned(self) -> bool:
        """Whether it was that of a case itself, as the plan has it."""
        return self.twin == 0 and self.longest == 0.0

    @property
    def key(self) -> tuple[str, int, float]:
        """What it was the computation of."""
        return self.of, self.twin, self.longest


Known = Mapping[tuple[str, int, float], Ended]
Standing = tuple[int | None, Ended | None]  # stage to compute, None for none; last end


@dataclass(frozen=True)
class Left(Mapping[int, Todo]):
    """What is to do of the cases that are not at their end.

    Attributes
    ----------
    cases : they, ascending
    begun : {case: what is to do} of those of which not all is
    all_ : what is to do of the others
    """

    cases: NDArray[np.int64]
    begun: dict[int, Todo]
    all_: Todo

    def __len__(self) -> int:
        """Return their number."""
        return len(self.cases)

    def __iter__(self) -> Iterator[int]:
        """Yield them."""
        return map(int, self.cases)

    def __getitem__(self, case: int) -> Todo:
        """Return what is to do of one of them."""
        return self.begun.get(case, self.all_)


@dataclass(frozen=True)
class Job:
    """One computation of a case.

    Attributes
    ----------
    case : its number
    scene, digest : of what is computed
    before : digest of the stage before, whose last state it may go on from; "": none
    facts : that its record has beside: the digest of the case, number of the twin, s
    lasts : whether a longer one may follow: its last state is kept for that
    """

    case: int
    scene: Scene
    digest: str
    before: str = ""
    facts: dict[str, Any] = field(default_factory=dict)
    lasts: bool = False

    @property
    def is_planned(self) -> bool:
        """Whether it is the case itself, as the plan has it."""
        return not self.facts


class Stages:
    """The stages of each case of a design, and of its twins.

    Parameters
    ----------
    design : the campaign
    extended : s, times it was extended to, ascending
    """

    def __init__(self, design: Design, extended: Sequence[float] = ()) -> None:
        self.design, self.extended = design, tuple(extended)

    def __len__(self) -> int:
        """Return the number of cases."""
        return len(self.design.settings)

    def times(self, case: int) -> tuple[float, ...]:
        """Return the times, s, that a case is extended to while it is undecided."""
        if not self.extended:
            return ()
        last = self.design.scene(case).end_times[-1]
        return tuple(time for time in self.extended if time > last)

    def jobs(self, case: int, begun: int = 0, twin: int = 0) -> Iterator[Job]:
        """Yield the computations of a case or of a twin, from a stage on.

        The next is asked for only where the last one left the case open.
        """
        design, times = self.design, self.times(case)
        own = design.digest(case)
        scene, facts = design.scene(case), {}
        if twin and design.twins:
            content = design.contents[scene.engine.file]
            scene = design.twins.scene(scene, content, twin)
            facts = {"of": own, "twin": twin}
        first = before = self._digest(scene) if twin else own
        if begun == 0:
            yield Job(case, scene, first, facts=facts, lasts=bool(times))
        for stage, time in enumerate(times, 1):
            longer = apply_settings(scene, {"until": "decided", "longest": time})
            name = self._digest(longer)
            told = {"of": own} | facts | {"longest": time}
            if stage >= begun:
                yield Job(case, longer, name, before, told, lasts=stage < len(times))
            before = name

    def _digest(self, scene: Scene) -> str:
        return digest(scene, self.design.contents[scene.engine.file])

    def name(self, case: int, todo: Todo) -> str:
        """Return the digest of the first computation that is left of a case."""
        twin, stage = todo[0]
        if (twin, stage) == (0, 0):
            return self.design.digests[case]
        return next(self.jobs(case, stage, twin)).digest

    def whole(self) -> Todo:
        """Return what is to do of a case that has not begun."""
        twins = self.design.twins
        count = twins.count if twins and twins.of == "all" else 0
        return tuple((twin, 0) for twin in range(count + 1))

    @property
    def is_plain(self) -> bool:
        """Whether a case is one computation: none goes on, none has twins."""
        return not self.extended and self.design.twins is None

    def left(self, ends: Mapping[str, Ended]) -> Left:
        """Return what is to do of the cases that are not at their end.

        Parameters
        ----------
        ends : {digest: how it ended}
        """
        found = self._standings(ends)
        over = np.array([case for case, (todo, _) in found.items() if not todo], int)
        begun = {case: todo for case, (todo, _) in found.items() if todo}
        cases = np.delete(np.arange(len(self)), over)
        return Left(cases, begun, self.whole())

    def statuses(self, ends: Mapping[str, Ended]) -> list[str | None]:
        """Return how each case ended with all that is of it; None if it has not."""
        out: list[str | None] = [None] * len(self)
        for case, (todo, status) in self._standings(ends).items():
            out[case] = None if todo else status
        return out

    def _standings(self, ends: Mapping[str, Ended]) -> dict[int, tuple[Todo, str]]:
        """Return what is to do of each case that has begun, and the worst end so far.

        Of the others all is to do.
        """
        known = {end.key: end for end in ends.values()}
        digests = self.design.digests
        cases = {digests.find(end.of, end.case) for end in ends.values()} - {-1}
        own = {case: self._standing(case, 0, known) for case in sorted(cases)}
        twins = self.design.twins
        if twins is None:
            return {case: self._joined([one]) for case, one in own.items()}
        counts = self._twins_of(own, twins)
        return {case: self._with_twins(case, one, counts[case], known)
                for case, one in own.items()}  # fmt: skip

    def _twins_of(self, own: Mapping[int, Standing], twins: Twins) -> dict[int, int]:
        """Return how many twins each case has that has begun."""
        if twins.of != "boundary":
            return dict.fromkeys(own, twins.count)
        whole = len(own) == len(self) and all(at is None for at, _ in own.values())
        if not whole:
            return dict.fromkeys(own, 0)
        words = [end.word if end else "" for _, end in own.values()]
        edge = at_boundary(self.design.settings, self.design.swept, words)
        return {case: twins.count * int(edge[case]) for case in own}

    def _with_twins(
        self, case: int, own: Standing, count: int, known: Known
    ) -> tuple[Todo, str]:
        end = own[1]
        if end is not None and end.status != "ok" and own[0] is None:
            count = 0  # nothing is known that twins could tell more of
        each = (self._standing(case, twin, known) for twin in range(1, count + 1))
        return self._joined([own, *each])

    def _joined(self, found: Sequence[Standing]) -> tuple[Todo, str]:
        todo = tuple(
            (t, stage) for t, (stage, _) in enumerate(found) if stage is not None
        )
        bad = [end.status for _, end in found if end and end.status != "ok"]
        return todo, bad[0] if bad else "ok"

    def _standing(self, case: int, twin: int, known: Known) -> Standing:
        """Return the stage to compute next, None for none, and how the last ended."""
        own = self.design.digests[case]
        last: Ended | None = None
        for stage, time in enumerate((0.0, *self.times(case))):
            end = known.get((own, twin, time))
            if end is None:
                return stage, last
            last = end
            if not end.is_open:
                break
        return None, last


def ended_of(record: Record) -> Ended:
    """Return how the computation of a record ended."""
    row = record.get("row") or {}
    status, still = str(record["status"]), is_open(row)
    of, twin = str(record.get("of", record["digest"])), int(record.get("twin", 0))
    longest = float(record.get("longest", 0.0))
    outcome, regime, whirl = (
        str(row.get(name, "none")) for name in ("outcome", "regime", "whirl")
    )
    return Ended(
        status, regime_of(record), status == "ok" and still, of, twin, longest, outcome,
        regime, whirl, case_in(record),
    )  # fmt: skip


def case_in(record: Record) -> int:
    """Return the case that a record is said to be of, -1 where it says none."""
    case = record.get("case", -1)
    return case if is_whole(case) else -1


def statuses(stages: Stages, folder: Path) -> list[str | None]:
    """Return how each case of a directory ended; None if it has not."""
    return stages.statuses(scan(folder, ended_of))


def resolved(design: Design, job: Job) -> Case:
    """Return the case of a job."""
    if job.is_planned:
        return design.resolved(job.case)
    from hpcwhirl.case.resolve import resolve  # SciPy, for which help waits not

    return resolve(job.scene)
