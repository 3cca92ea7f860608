"""One case of a campaign, from where it was left to its end or to a stop."""

from __future__ import annotations

from collections.abc import Callable

from hpcwhirl.campaign.checkpoints import Checkpoints
from hpcwhirl.campaign.simulate import Course, Result
from hpcwhirl.campaign.stop import Stop, breakable
from hpcwhirl.case.resolve import Case
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import CaseError, one_line, text_of
from hpcwhirl.scene.words import is_open


class LateError(CaseError):
    """A case has computed longer than it may."""


class DiedError(CaseError):
    """The process of a case died."""


class FailedError(CaseError):
    """A case failed in a process of its own, which has printed the reason."""


def late(march: March, limit: float) -> LateError:
    """Return the error of a case that has been computed longer than `limit`, s."""
    share = march.steps / march.total
    return LateError(
        f"more than {limit:g} s of computing, {share:.1%} of the case: a greater "
        "--case-limit with --retry timeout goes on from there"
    )


def message_of(failed: Exception) -> str:
    """Return the one line that tells why a case failed."""
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
    """Integrate a case, its state kept now and then, at a stop and at its limit.

    Parameters
    ----------
    case, digest : the case, and the name of its state
    checkpoints : where its state is kept and may be found; not dropped here
    limit : s of computing that the case may take, all runs together
    between : called between slices; may raise `Stop`
    keep : whether the last state of a case that a longer run may decide is kept

    Raises
    ------
    LateError
        beyond the limit
    """
    with breakable(between):
        course = Course(case, keep=keep)
        if not course.march.is_compiled:
            course.march.advance(0)
    course.march.seconds = 0.0
    checkpoints.set_out(digest, course)

    def guard() -> None:
        march = course.march
        if march.seconds > limit and not march.done:
            raise late(march, limit)
        if checkpoints.is_due(digest, march):
            checkpoints.save(digest, march)
        between()

    try:
        result = course.run(guard)
    except (Stop, LateError):
        checkpoints.save(digest, course.march)
        raise
    if keep and is_open(result.row) and course.last is not None:
        checkpoints.keep(digest, course.march, course.last)
    return result
