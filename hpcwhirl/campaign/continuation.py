"""Cases that begin with the last motion of another case.

This motion depends on the case's inputs only: its `history` names the preceding cases.
A campaign stores the last motion of each case of a branch until the next case has
ended, too. If it is lost, the preceding cases are integrated again, with the same
result.

A case that diverges, that does not run to its end, or that cannot be integrated leaves
no motion: the next one begins anew, with its pulse.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol

from hpcwhirl.case.resolve import Case, resolve
from hpcwhirl.dynamics.march import March
from hpcwhirl.dynamics.motion import Motion
from hpcwhirl.errors import InputError
from hpcwhirl.scene import Scene, case_before, digest

Begin = tuple[Case, Motion | None]
Ended = tuple[Mapping[str, Any], March]


class Ends(Protocol):
    """Storage of the last motions of cases."""

    def read(self, digest: str) -> tuple[bool, Motion | None]:
        """Return (whether a case is known to have ended, its last motion).

        The motion is None if the case has not ended or no case can continue from it.
        """

    def keep(self, digest: str, motion: Motion | None) -> None:
        """Store the last motion of a case; None: no case can continue from it."""


def end_of(row: Mapping[str, Any], march: March) -> Motion | None:
    """Return the last motion of a case, None if no case can continue from it.

    row : result of the case, see `campaign.simulate.Result`
    """
    lost = row["outcome"] != "completed" or row["regime"] == "divergent"
    return None if lost else march.motion()


def begun(
    case: Case, march: Callable[[Case, Motion | None], Ended], ends: Ends | None = None
) -> Begin:
    """Return the case to be integrated, and the motion with which it begins.

    Parameters
    ----------
    case : the case
    march : function that integrates a case from a motion to its end and returns its row
        and last march
    ends : storage of the last motions of cases; None: preceding cases are integrated
    """
    left, motion, scene = list[Scene](), None, case.given
    while (before := case_before(scene)) is not None:
        known, motion = ends.read(digest(before)) if ends else (False, None)
        if known:
            break
        left.append(before)
        scene = before
    for before in reversed(left):
        motion = _ended(before, motion, march)
        if ends is not None:
            ends.keep(digest(before), motion)
    return _going_on(case, motion), motion


def _going_on(case: Case, motion: Motion | None) -> Case:
    return Case(case.given, case.own, goes_on=True) if motion is not None else case


def _ended(
    scene: Scene, motion: Motion | None, march: Callable[[Case, Motion | None], Ended]
) -> Motion | None:
    try:
        return end_of(*march(_going_on(resolve(scene), motion), motion))
    except InputError:  # the preceding case failed
        return None
