"""The directory of a campaign, as an object that knows the files in it."""

from __future__ import annotations

import os
from pathlib import Path

from hpcwhirl.errors import InputError, MissingFileError
from hpcwhirl.store.atomic import keep_names, sweep
from hpcwhirl.store.directory.heartbeats import Notes
from hpcwhirl.store.directory.journal import Journals
from hpcwhirl.store.directory.manifest import NAME, PlanFile
from hpcwhirl.store.directory.owner import Claims
from hpcwhirl.store.directory.runs import Runs
from hpcwhirl.store.directory.states import States

RESULTS, PAGE = "results.h5", "report.html"
STOP = "STOP"  # a file that a user makes


class Directory:
    """The directory of a campaign, and access to the files in it; it need not exist.

    The object is made where a user names a path; functions take the object, or the part
    that they need.

    Attributes
    ----------
    path : path of the directory
    plan : file of the plan, campaign.json
    journals : journals and traces of all runs
    states : saved states of unfinished cases
    notes : notes of the cases that ranks compute now
    runs : how the ranks of each run used their time
    claims : claims of the processes that compute or gather here
    results, page : paths of results.h5 and of the page report.html
    stop_file : path of the file STOP; if a user makes it, the campaign stops
    """

    def __init__(self, path: Path) -> None:
        self.path, self.plan, self.journals = path, PlanFile(path), Journals(path)
        self.states, self.notes = States(path), Notes(path)
        self.runs, self.claims = Runs(path), Claims(path)
        self.results, self.page = path / RESULTS, path / PAGE
        self.stop_file = path / STOP

    def __str__(self) -> str:
        return str(self.path)

    def sweep(self, older: float) -> None:
        """Remove incomplete files that runs which died have left in the directory.

        older : only files last written before this time, s since 1970 by the clock of
            the file system
        """
        for place in (self.states.place, self.runs.place):
            sweep(place, older=older)
        sweep(self.path, NAME, older)
        self.notes.sweep(older)

    def check_usable(self) -> None:
        """Raise InputError if a user's path cannot be a campaign's directory.

        It must be writable, or its nearest existing parent if it does not exist.
        """
        place = Path(os.path.realpath(self.path))  # resolve raises for circular links
        if place.exists() and not place.is_dir():
            raise InputError(f"--out must be a directory, got the file {self}")
        while not os.path.lexists(place):
            place = place.parent
        if not place.is_dir() or not os.access(place, os.W_OK | os.X_OK):
            raise InputError(f"--out {self}: {place} cannot be written")

    def put_aside(self) -> Directory | None:
        """Rename the directory by adding a number, since the campaign starts over.

        Without a plan in the directory, nothing is renamed.

        Returns
        -------
        the renamed directory; None if nothing was renamed

        Raises
        ------
        InputError, MissingFileError
            if the directory is the working directory, or cannot be renamed
        """
        if not self.plan.path.exists():
            return None
        place = self.path.resolve()
        if Path.cwd().is_relative_to(place):
            msg = f"--fresh: --out must not be the working directory, got {self}"
            raise InputError(msg)
        number = 1
        while os.path.lexists(aside := place.with_name(f"{place.name}.{number}")):
            number += 1
        try:
            place.rename(aside)
            keep_names(place.parent)
        except OSError as failed:
            msg = f"--fresh: cannot rename {self} to {aside}: {failed.strerror}"
            raise MissingFileError(msg) from None
        return Directory(aside)
