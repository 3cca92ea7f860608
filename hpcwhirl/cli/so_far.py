"""Results of a campaign that runs, or was stopped, read from its journals."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from hpcwhirl.errors import WhirlError, say

if TYPE_CHECKING:
    from hpcwhirl.store.directory.campaign_directory import Directory

MISSING = "missing"  # status of a case that has not ended


def gathered_so_far(folder: Path, *, quiet: bool = False) -> None:
    """Gather results.h5 where it is missing, or lacks cases that have ended since.

    A line on stderr tells how many cases it has. Complete results, and those changed
    since they were gathered, as by `hpcwhirl classify`, are left alone.

    folder : directory of a campaign, or a results file, which is left alone
    quiet : print no line
    """
    from hpcwhirl import __version__
    from hpcwhirl.analysis.regimes import threshold_facts
    from hpcwhirl.store.directory.campaign_directory import Directory
    from hpcwhirl.store.reading.results_file import count_statuses
    from hpcwhirl.store.results.gather import gather

    directory = Directory(folder)
    if not (folder.is_dir() and directory.plan.path.is_file()):
        return
    words = threshold_facts()
    if not _lags(directory, words):
        return
    try:
        gather(directory, {"version": __version__, **words})
        statuses = count_statuses(directory.results)
    except WhirlError:
        if directory.results.exists():  # of another user: the older ones
            return
        raise
    if statuses.get(MISSING) and not quiet:
        cases = sum(statuses.values())
        say(f"{cases - statuses[MISSING]} of {cases} cases have ended so far")


def _lags(directory: Directory, words: Mapping[str, float]) -> bool:
    """Return whether results are missing, or older than the journals of other cases.

    words : {root attribute: threshold} in use
    """
    from hpcwhirl.store.reading.results_file import count_statuses
    from hpcwhirl.store.results.contents import is_current, is_stamped

    if not directory.results.exists():
        return bool(directory.journals.files())
    if not is_stamped(directory) or is_current(directory, words):
        return False
    try:
        return count_statuses(directory.results).get(MISSING, 0) > 0
    except WhirlError:  # told by who reads it
        return False
