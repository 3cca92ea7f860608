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

from hpcwhirl.campaign.design import Design
from hpcwhirl.scene import Scene, apply_settings, digest
from hpcwhirl.scene.words import is_open
from hpcwhirl.store.journal import Record, scan
from hpcwhirl.store.neighbours import at_boundary
from hpcwhirl.store.rows import word_of

if TYPE_CHECKING:
    from hpcwhirl.case.resolve import Case

Todo = tuple[tuple[int, int], ...]  # of a case: (twin, or 0; stage to begin with)


class Ended(NamedTuple):
    """How a computation ended.

    Attributes
    ----------
    status, word : of its record; the regime, or another outcome's word
    is_open : whether a longer run may tell what it does not
    of, twin, longest : which it was, see `Job.facts`
    outcome, regime, whirl : of its row, if it has one
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

    @property
    def key(self) -> tuple[str, int, float]:
        """What it was the computation of."""
        return self.of, self.twin, self.longest


Known = Mapping[tuple[str, int, float], Ended]
Standing = tuple[int | None, Ended | None]  # stage to compute, None for none; last end


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
        return len(self.design.scenes)

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

    def left(self, ends: Mapping[str, Ended]) -> dict[int, Todo]:
        """Return what is to do of the cases that are not at their end.

        Parameters
        ----------
        ends : {digest: how it ended}
        """
        found = self._standings(ends)
        return {case: todo for case, (todo, _) in enumerate(found) if todo}

    def statuses(self, ends: Mapping[str, Ended]) -> list[str | None]:
        """Return how each case ended with all that is of it; None if it has not."""
        found = self._standings(ends)
        return [None if todo else status for todo, status in found]

    def _standings(self, ends: Mapping[str, Ended]) -> list[tuple[Todo, str]]:
        """Return of each case what is to do, and how it ended, the worst it did."""
        known = {end.key: end for end in ends.values()}
        own = [self._standing(case, 0, known) for case in range(len(self))]
        twins = self.design.twins
        if twins is None:
            return [self._joined([one]) for one in own]
        counts = [twins.count] * len(self)
        if twins.of == "boundary":
            words = [end.word if end else "" for _, end in own]
            whole = all(stage is None for stage, _ in own)
            settings, swept = self.design.settings, self.design.swept
            edge = at_boundary(settings, swept, words) & whole
            counts = (twins.count * edge).tolist()
        return [self._with_twins(case, own[case], counts[case], known)
                for case in range(len(self))]  # fmt: skip

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
    words = [str(row.get(name, "none")) for name in ("outcome", "regime", "whirl")]
    return Ended(
        status, word_of(record), status == "ok" and still, of, twin, longest, *words
    )


def statuses(stages: Stages, folder: Path) -> list[str | None]:
    """Return how each case of a directory ended; None if it has not."""
    return stages.statuses(scan(folder, ended_of))


def resolved(design: Design, job: Job) -> Case:
    """Return the case of a job."""
    if job.is_planned:
        return design.resolved(job.case)
    from hpcwhirl.case.resolve import resolve  # SciPy, for which help waits not

    return resolve(job.scene)
