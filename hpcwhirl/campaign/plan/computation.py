"""The integration that a job requires, and the entries of the job's record."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.planner.jobs import Job
from hpcwhirl.scene import Scene, apply_settings, case_before, digest

if TYPE_CHECKING:
    from hpcwhirl.case.resolve import Case


@dataclass(frozen=True)
class Computation:
    """The integration that a job requires.

    Attributes
    ----------
    job : the job
    scene, digest : the scene to integrate, and its digest
    before : digest of the preceding stage, whose last state is continued; "": none
    facts : further entries of the record: digest of the case, number of the twin, end
        time, s
    lasts : whether the last state is saved, since a longer run may continue from it
    follows : digest of the case whose last motion is the initial one; "": none
    """

    job: Job
    scene: Scene
    digest: str
    before: str = ""
    facts: dict[str, Any] = field(default_factory=dict)
    lasts: bool = False
    follows: str = ""


def computation(
    design: Design, job: Job, extended: Sequence[float] = ()
) -> Computation:
    """Return the computation that a job requires.

    Parameters
    ----------
    design, job : design of the campaign, and one of its jobs
    extended : end times of the extensions, s, ascending
    """
    scene, own = design.scene(job.case), design.digest(job.case)
    last, name, facts = scene.end_times[-1], own, dict[str, Any]()
    content = design.contents[scene.engine.file]
    if job.twin and design.twins:
        scene = design.twins.scene(scene, content, job.twin)
        name, facts = digest(scene, content), {"of": own, "twin": job.twin}
    lasts = any(time > last for time in extended[job.stage :])
    if not job.stage:
        last_one = case_before(scene)
        follows = digest(last_one, content) if last_one else ""
        return Computation(job, scene, name, facts=facts, lasts=lasts, follows=follows)

    def longer(time: float) -> Scene:
        return apply_settings(scene, {"until": "decided", "longest": time})

    time, earlier = extended[job.stage - 1], extended[: job.stage - 1]
    shorter = [t for t in earlier if t > last]
    before = digest(longer(shorter[-1]), content) if shorter else name
    facts = {"of": own} | facts | {"longest": time}
    scene = longer(time)
    return Computation(job, scene, digest(scene, content), before, facts, lasts)


def resolved(design: Design, computed: Computation) -> Case:
    """Return the resolved case that a computation integrates."""
    if not computed.facts:
        return design.resolved(computed.job.case)
    from hpcwhirl.case.resolve import resolve  # imports SciPy, too slow for --help

    return resolve(computed.scene)
