"""Cases that begin where others have ended: the motion that they begin with.

The motion is a function of the case's inputs alone: its `history` says through which
cases it was reached. A campaign keeps the motion in which each case of a branch has
ended until the next one has ended, too; where it is lost, the cases before are
integrated again, with the same result.

A case that diverges, that does not run to its end or cannot be integrated leaves no
motion: the next one begins anew, with its pulse.
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
    """Where the motions are kept in which cases have ended."""

    def read(self, digest: str) -> tuple[bool, Motion | None]:
        """Return whether a case is known to have ended, and in which motion."""

    def keep(self, digest: str, motion: Motion | None) -> None:
        """Keep the motion in which a case has ended, None for none."""


class NoEnds:
    """Keeps nothing."""

    def read(self, _: str) -> tuple[bool, Motion | None]:
        """Return that nothing is known."""
        return False, None

    def keep(self, digest: str, motion: Motion | None) -> None:
        """Keep nothing."""


def end_of(row: Mapping[str, Any], march: March) -> Motion | None:
    """Return the motion in which a case has ended, None if nothing goes on from it.

    row : its result, see `campaign.simulate.Result`
    """
    lost = row["outcome"] != "completed" or row["regime"] == "divergent"
    return None if lost else march.motion()


def begun(
    case: Case,
    march: Callable[[Case, Motion | None], Ended],
    ends: Ends,
) -> Begin:
    """Return a case as it is integrated, and the motion that it begins with.

    Parameters
    ----------
    case : the case
    march : integrates a case from a motion to its end; returns row and last march
    ends : where the motions are kept in which cases have ended
    """
    left, motion, scene = list[Scene](), None, case.given
    while (before := case_before(scene)) is not None:
        known, motion = ends.read(digest(before))
        if known:
            break
        left.append(before)
        scene = before
    for before in reversed(left):
        motion = _ended(before, motion, march)
        ends.keep(digest(before), motion)
    return _going_on(case, motion), motion


def _going_on(case: Case, motion: Motion | None) -> Case:
    return Case(case.given, case.own, goes_on=True) if motion is not None else case


def _ended(
    scene: Scene,
    motion: Motion | None,
    march: Callable[[Case, Motion | None], Ended],
) -> Motion | None:
    try:
        return end_of(*march(_going_on(resolve(scene), motion), motion))
    except InputError:  # it failed as a row
        return None
