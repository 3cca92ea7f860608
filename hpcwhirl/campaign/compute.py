"""Integrate the case of one job, up to its end, its time limit or a stop request.

A job is a case or one of its twins, run to its planned end time or to a longer one.
Its state is saved at intervals of computing time and at a stop, so that it can continue
from there. In a branch, the last motion of a finished case is saved, too, since the
next case begins with it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.campaign.simulate import Course, Ended, Result, begun, end_of
from hpcwhirl.campaign.stop import Stop, breakable
from hpcwhirl.case.resolve import Case, resolve
from hpcwhirl.dynamics.bodies.motion import Motion
from hpcwhirl.dynamics.march import March
from hpcwhirl.dynamics.snapshot import (
    CODE,
    Arrays,
    fingerprint,
    restore,
    snapshot,
    steps_of,
)
from hpcwhirl.errors import CaseError, MissingFileError, StoreError, one_line, text_of
from hpcwhirl.planner.planner import Job
from hpcwhirl.scene import Scene, apply_settings, case_before, digest
from hpcwhirl.scene.words import is_open
from hpcwhirl.store.atomic import Say
from hpcwhirl.store.directory.record import Record
from hpcwhirl.store.directory.states import States

FITS = "model, kernel or compiler"  # what a fingerprint identifies, for messages
END = "-end"  # ending of the name of a case's last motion
# Fingerprint of a stored last motion, whose round-off depends on the code.
MOTIONS = f"motion by {CODE}"


def end_name(digest: str) -> str:
    """Return the name under which the last motion of a case is stored in `States`.

    digest : digest of the case
    """
    return f"{digest}{END}"


def digest_in(name: str) -> str:
    """Return the digest of the case whose last motion has a name, else "".

    name : name in `States`, see `end_name`
    """
    return name.removesuffix(END) if name.endswith(END) else ""


class Checkpoints:
    """Saves and restores the states of unfinished cases, in a campaign's directory.

    In all methods `digest` is the digest of the case, under which its state is stored.

    Parameters
    ----------
    states : files of the saved states of the campaign
    every : computing time of a case between two checkpoints, s
    say : function that prints one line about a state that is unusable or not written
    """

    def __init__(self, states: States, every: float, say: Say) -> None:
        self.states, self.every, self.say = states, every, say
        self.kept = self.states.names()  # the directory is listed only once
        self.mute = False
        # {digest: computing time of the case when its state was saved, s}
        self.saved: dict[str, float] = {}

    def set_out(self, digest: str, course: Course) -> None:
        """Continue the integration of a case from the case's saved state.

        Without a saved state that fits, the integration begins anew.

        course : the integration to one or several end times; the saved state may be
            from the integration to any of these
        """
        try:
            arrays = self.states.read(digest, {}) if digest in self.kept else {}
        except StoreError:  # printed below
            arrays = {}
        if arrays:
            course.set_out(*steps_of(arrays))
        self.take_up(digest, course.march)
        if course.march.steps == 0 and course.number:
            course.set_out(0, 0)

    def take_up(self, digest: str, march: March) -> None:
        """Set the integration of a case to its saved state, if that state fits it.

        march : the integration, before its first step; unchanged if no saved state fits
        """
        self.saved[digest] = 0.0
        if digest not in self.kept:
            return
        try:
            arrays = self._arrays(digest, march)
            if arrays is not None and not restore(march, arrays):
                msg = f"the saved state of case {digest[:12]} has unsuitable arrays"
                raise StoreError(msg)  # noqa: TRY301 - printed below
        except StoreError as failed:
            self.say(f"{failed}: the case starts anew")
            self.drop(digest)
        self.saved[digest] = march.seconds

    def _arrays(self, digest: str, march: March) -> Arrays | None:
        """Return {name: array} of a case's saved state; None if none is saved.

        If load and engine repeat around the circumference, only one sector is
        integrated as long as all move alike (fold). The state may be that of one sector
        or of all; the integration `march` is changed to what the state has.
        """
        try:
            return self.states.read(digest, {FITS: fingerprint(march)})
        except StoreError:
            if march.lean.model.folds == 1:
                raise
        march.unfold()  # the case may have been unfolded before it was saved
        try:
            return self.states.read(digest, {FITS: fingerprint(march)})
        except StoreError:
            march.fold()
            raise

    def is_due(self, digest: str, march: March) -> bool:
        """Return whether it is time to save the state of a case again.

        march : integration of the case
        """
        return march.seconds - self.saved[digest] >= self.every

    def save(self, digest: str, march: March) -> None:
        """Save the present state of a case; if that fails, print why, once, and go on.

        march : integration of the case
        """
        self.saved[digest] = march.seconds
        if march.steps:
            self.keep_state(digest, march, snapshot(march))

    def keep_state(self, digest: str, march: March, arrays: Arrays) -> None:
        """Save a given state of an integration, `march`, as the state of its case.

        arrays : the state, the present one of `march` or an earlier one
        """
        self._write(digest, {FITS: fingerprint(march)}, arrays)

    def keep(self, digest: str, motion: Motion | None) -> None:
        """Save the last motion of a case, with which the next case of a branch begins.

        motion : the last motion; None: no other case can begin with it
        """
        arrays: Arrays = {}
        if motion is not None:
            arrays = {n: np.atleast_1d(part) for n, part in motion._asdict().items()}
        self._write(end_name(digest), {FITS: MOTIONS}, arrays)

    def read(self, digest: str) -> tuple[bool, Motion | None]:
        """Return the stored last motion of a case of a branch, if any.

        Returns
        -------
        whether the end of the case is stored; and its last motion, None if no end is
        stored or no case can continue from it
        """
        try:  # any rank may have saved it
            arrays = self.states.read(end_name(digest), {FITS: MOTIONS})
        except StoreError as failed:
            self.say(f"{failed}: the preceding cases are integrated again")
            return False, None
        if not arrays:
            return arrays is not None, None
        parts = {name: array.copy() for name, array in arrays.items()}
        angle = float(parts.pop("angle")[0])
        return True, Motion(**parts, angle=angle)

    def drop_end(self, digest: str) -> None:
        """Remove the stored last motion of a case; do nothing for the digest ""."""
        if digest:
            self.states.drop(end_name(digest))

    def _write(self, digest: str, belongs: Record, arrays: Arrays) -> None:
        try:
            self.states.write(digest, belongs, arrays)
            self.kept.add(digest)
        except MissingFileError as failed:
            if not self.mute:
                self.say(f"{failed}: if the run stops now, this case starts anew")
            self.mute = True

    def hand_over(self, digest: str, after: str) -> None:
        """Copy the saved state of case `digest` to case `after`, a longer run of it.

        Nothing is copied if case `after` has a saved state already.
        """
        if digest and after not in self.kept:
            with suppress(MissingFileError):  # the case can start anew
                if self.states.hand_over(digest, after):  # any rank may have saved it
                    self.kept |= {digest, after}

    def drop(self, digest: str) -> None:
        """Remove the saved state of a case that has ended and needs it no longer."""
        self.saved.pop(digest, None)
        if digest in self.kept:
            self.kept.discard(digest)
            self.states.drop(digest)


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
