"""Listing the files of a campaign's directory by the numbers in their names."""

from __future__ import annotations

import os
import re
from pathlib import Path

from hpcwhirl.errors import MissingFileError

NUMBERED = re.compile(r"(\d{1,9})(?:-(\d{1,9}))?\.[a-z0-9]+", re.ASCII)


def listed(folder: Path, ending: str) -> list[Path]:
    """Return the files of a directory sorted by run and rank; [] if it does not exist.

    Runs and ranks are compared as numbers, since as text 10000 comes before 9999. Names
    without numbers come first.

    Parameters
    ----------
    folder : one of the directories of a campaign
    ending : ending of the file names, e.g. ``.log``

    Raises
    ------
    MissingFileError
        where the directory cannot be listed, which must not be taken for an empty one
    """
    try:
        names = os.listdir(folder)  # noqa: PTH208 - glob is silent where it may not look
    except FileNotFoundError as failed:
        if not os.path.lexists(folder):
            return []
        raise unreadable(folder, failed) from None  # a broken link
    except OSError as failed:
        raise unreadable(folder, failed) from None
    found = (folder / name for name in names if name.endswith(ending))
    return sorted(found, key=_order)


def run_of(path: Path) -> int:
    """Return the run number in the name of a file, 0 for none."""
    return _order(path)[0]


def unreadable(path: Path, failed: OSError) -> MissingFileError:
    """Return the error for an existing file that cannot be read."""
    return MissingFileError(f"cannot read {path}: {failed.strerror or failed}")


def _order(path: Path) -> tuple[int, int, str]:
    number = NUMBERED.fullmatch(path.name)
    if number is None:
        return 0, 0, path.name
    return int(number[1]), int(number[2] or 0), path.name
