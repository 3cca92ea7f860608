"""What cases are computed as: as planned, then for longer where they are undecided.

An extended campaign (`campaign --extend undecided --to S`) has a stage for each time it
was extended to: its cases that a longer run may decide are computed once more, as cases
of `until = "decided"` and this `longest`, from the states that were kept of them or
anew. Their rows stand in the journals under digests of their own, with that of the case
they are `of`; what stands there of earlier stages stays. A case that is decided stays
as it is. So what a campaign holds follows from its plan alone, which tells the times.
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

if TYPE_CHECKING:
    from hpcwhirl.case.resolve import Case


class End(NamedTuple):
    """How a case ended, whether a longer run may tell what it does not, its words."""

    status: str
    is_open: bool = False
    outcome: str = "none"
    regime: str = "none"
    whirl: str = "none"


@dataclass(frozen=True)
class Job:
    """One computation of a case.

    Attributes
    ----------
    case : its number
    scene, digest : of what is computed
    before : digest of the stage before, whose last state it may go on from; "": none
    facts : that its record has beside
    lasts : whether a longer one may follow: its last state is kept for that
    """

    case: int
    scene: Scene
    digest: str
    before: str = ""
    facts: dict[str, Any] = field(default_factory=dict)
    lasts: bool = False


class Stages:
    """The stages of each case of a design.

    Parameters
    ----------
    design : the campaign
    extended : s, times it was extended to, ascending
    """

    def __init__(self, design: Design, extended: Sequence[float] = ()) -> None:
        self.design, self.extended = design, tuple(extended)

    def times(self, case: int) -> tuple[float, ...]:
        """Return the times, s, that a case is extended to while it is undecided."""
        if not self.extended:
            return ()
        last = self.design.scene(case).end_times[-1]
        return tuple(time for time in self.extended if time > last)

    def scene(self, case: int, time: float) -> Scene:
        """Return the scene of a case that goes on to some time while undecided."""
        return apply_settings(
            self.design.scene(case), {"until": "decided", "longest": time}
        )

    def jobs(self, case: int, begun: int = 0) -> Iterator[Job]:
        """Yield the computations of a case from a stage on; all but the first if open.

        The next is asked for only where the last one left the case open.
        """
        design, times = self.design, self.times(case)
        first = before = design.digest(case)
        if begun == 0:
            yield Job(case, design.scene(case), first, lasts=bool(times))
        for stage, time in enumerate(times, 1):
            scene = self.scene(case, time)
            name = digest(scene, design.contents[scene.engine.file])
            facts = {"of": first, "longest": time}
            if stage >= begun:
                yield Job(case, scene, name, before, facts, lasts=stage < len(times))
            before = name

    def name(self, case: int, stage: int) -> str:
        """Return the digest of a stage of a case."""
        if stage == 0:
            return self.design.digests[case]
        return next(self.jobs(case, stage)).digest

    def left(self, ends: Mapping[str, End]) -> dict[int, int]:
        """Return {case: stage to begin with} of the cases that are not at their end."""
        found = ((case, self.standing(case, ends)) for case in range(len(self)))
        return {case: stage for case, (stage, _) in found if stage is not None}

    def standing(self, case: int, ends: Mapping[str, End]) -> tuple[int | None, str]:
        """Return (the stage to compute, "") of a case, or (None, how it ended)."""
        end = ends.get(self.design.digests[case])
        if end is None or not (end.is_open and self.extended):
            return (0, "") if end is None else (None, end.status)
        for stage, job in enumerate(self.jobs(case, 1), 1):
            end = ends.get(job.digest)
            if end is None:
                return stage, ""
            if not end.is_open:
                break
        return None, end.status

    def __len__(self) -> int:
        """Return the number of cases."""
        return len(self.design.digests)


def end_of(record: Record) -> End:
    """Return how the case of a record ended."""
    row = record.get("row") or {}
    words = [str(row.get(name, "none")) for name in ("outcome", "regime", "whirl")]
    status = str(record["status"])
    return End(status, status == "ok" and is_open(row), *words)


def statuses(stages: Stages, folder: Path) -> list[str | None]:
    """Return how each case ended, at its last stage; None if it has not."""
    ends = scan(folder, end_of)
    found = (stages.standing(case, ends) for case in range(len(stages)))
    return [None if stage is not None else status for stage, status in found]


def resolved(design: Design, job: Job) -> Case:
    """Return the case of a job."""
    if not job.before:
        return design.resolved(job.case)
    from hpcwhirl.case.resolve import resolve  # SciPy, for which help waits not

    return resolve(job.scene)
