"""Checkpoints: save the states of unfinished cases, and continue cases from them.

A state is saved at intervals of computing time and at a stop. In a branch, the last
motion of a finished case is saved, too, since the next case begins with it.
"""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from hpcwhirl.campaign.simulate import Course
from hpcwhirl.dynamics.march import March
from hpcwhirl.dynamics.motion import Motion
from hpcwhirl.dynamics.snapshot import (
    CODE,
    Arrays,
    fingerprint,
    restore,
    snapshot,
    steps_of,
)
from hpcwhirl.errors import MissingFileError, StoreError
from hpcwhirl.store.atomic import Say
from hpcwhirl.store.directory.record import Record
from hpcwhirl.store.directory.states import States

FITS = "model, kernel or compiler"  # what a fingerprint identifies, for messages
# Fingerprint of a stored last motion, whose round-off depends on the code.
MOTIONS = f"motion by {CODE}"


def end_name(digest: str) -> str:
    """Return the name under which the last motion of a case is stored in `States`.

    digest : digest of the case
    """
    return f"{digest}-end"


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
