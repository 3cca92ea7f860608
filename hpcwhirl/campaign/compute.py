"""Integrate the case of one job, up to its end, its time limit or a stop request.

A job is a case or one of its twins, run to its planned end time or to a longer one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from hpcwhirl.campaign.checkpoints import Checkpoints
from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.campaign.simulate import Course, Ended, Result, begun, end_of
from hpcwhirl.campaign.stop import Stop, breakable
from hpcwhirl.case.resolve import Case, resolve
from hpcwhirl.dynamics.march import March
from hpcwhirl.dynamics.motion import Motion
from hpcwhirl.errors import CaseError, one_line, text_of
from hpcwhirl.planner.planner import Job
from hpcwhirl.scene import Scene, apply_settings, case_before, digest
from hpcwhirl.scene.words import is_open


class LateError(CaseError):
    """Raised where a case has used up its computing time (`case_limit`)."""


class DiedError(CaseError):
    """Raised where the separate process that computed an isolated case has died."""


class FailedError(CaseError):
    """Raised where an isolated case failed in its own process, which printed why."""


def late(march: March, limit: float) -> LateError:
    """Return the exception for a case whose computing time has exceeded its limit.

    Parameters
    ----------
    march : integration of the case
    limit : the limit, s
    """
    share = march.steps / march.total
    return LateError(
        f"more than {limit:g} s of computing, {share:.1%} of the case done: a greater "
        "--case-limit with --retry timeout continues from there"
    )


def message_of(failed: Exception) -> str:
    """Return one line that says why a case failed, for its record.

    failed : the exception that ended the case
    """
    told = isinstance(failed, CaseError)
    text = str(failed) if told else text_of(failed)
    return one_line(text.splitlines()[0])


def compute(
    case: Case,
    digest: str,
    checkpoints: Checkpoints,
    limit: float,
    between: Callable[[], None],
    *,
    keep: bool = False,
) -> Result:
    """Integrate a case; save its state at intervals, at a stop and at its time limit.

    Parameters
    ----------
    case : the case
    digest : digest under which the state of the case is stored
    checkpoints : storage of saved states; the caller removes the state afterwards
    limit : longest computing time of the case in all runs together, s; compiling does
        not count
    between : called between slices of the integration; may raise `Stop`
    keep : whether the last state is saved if the regime may change in a longer run

    Raises
    ------
    LateError
        if the computing time exceeds `limit`
    """

    def before(case: Case, start: Motion | None) -> Ended:
        course = _compiled(case, start, between, keep=False)
        result = course.run(lambda: _within(course, limit, between), measure=False)
        return result.row, course.march

    case, start = begun(case, before, checkpoints)
    course = _compiled(case, start, between, keep=keep)
    checkpoints.set_out(digest, course)

    def guard() -> None:
        march = course.march
        _within(course, limit, lambda: None)
        if checkpoints.is_due(digest, march):
            checkpoints.save(digest, march)
        between()

    try:
        result = course.run(guard)
    except (Stop, LateError):
        checkpoints.save(digest, course.march)
        raise
    if keep and is_open(result.row) and course.last is not None:
        checkpoints.keep_state(digest, course.march, course.last)
    if case.given.branch:
        checkpoints.keep(digest, end_of(result.row, course.march))
    return result


def _compiled(
    case: Case, start: Motion | None, between: Callable[[], None], *, keep: bool
) -> Course:
    """Return a case's integration before its first step, with its kernels compiled.

    Parameters
    ----------
    case : the case
    start : motion with which it begins; None: at rest
    between : called while kernels compile; may raise `Stop`
    keep : whether the last state is stored, so that a longer run may continue from it
    """
    with breakable(between):
        course = Course(case, start, keep=keep)
        course.march.warm()
    return course


def _within(course: Course, limit: float, between: Callable[[], None]) -> None:
    """Raise LateError if a case exceeds its computing time; else call `between`.

    Parameters
    ----------
    course : integration of the case
    limit : longest computing time, s
    between : called between slices of the integration; may raise `Stop`
    """
    if course.seconds > limit and not course.done:
        raise late(course.march, limit)
    between()


@dataclass(frozen=True)
class Computation:
    """What must be integrated for one job of a campaign, and entries of its record.

    Attributes
    ----------
    job : the job: a case or one of its twins, to its planned end time (stage 0) or to a
        later one of an extension
    scene, digest : the scene to integrate, and its digest
    before : digest of the shorter run of the same case whose last state is continued;
        "": there is none
    facts : further entries of the job's record: digest of the case, number of the twin,
        end time, s
    lasts : whether the last state is saved, since a longer run may continue from it
    follows : digest of the case whose last motion is the initial one of this case, in a
        branch; "": the case begins with its pulse
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
    """Return what must be integrated for a job: scene, digests, entries of its record.

    Parameters
    ----------
    design : the campaign's cases
    job : one of its jobs
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
    """Return the `Case` (scene with model, plan and time step) that a job integrates.

    Parameters
    ----------
    design : the campaign's cases
    computed : what the job requires
    """
    if not computed.facts:
        return design.resolved(computed.job.case)
    return resolve(computed.scene)
