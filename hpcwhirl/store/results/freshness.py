"""Whether `results.h5` is up to date, known without reading the journals.

The group `performance` of the file stores its sources: the plan, and names, sizes and
times of journals, traces and `runs/`. The file must be gathered again if one of these
or the thresholds of the words have changed, or if size and time of `results.h5` differ
from those in the stamp file, because another program has written to it.
Copying a directory may change times, which costs one gathering.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from hpcwhirl import __version__
from hpcwhirl.errors import WhirlError
from hpcwhirl.safe_open import read_regular
from hpcwhirl.scene.quantities import PERFORMANCE, ROW, STATUS
from hpcwhirl.store.atomic import write_whole
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.hdf5 import DAMAGE
from hpcwhirl.store.reading.results_file import opened

SOURCE = "gathered_from"  # attribute of the group `performance`
STAMP = "results.stamp"  # in `runs`


def source_of(directory: Directory) -> str:
    """Return a digest of the files that results are gathered from, "" if unknown."""
    told = [__version__, *ROW, *STATUS, *PERFORMANCE]
    try:
        told.append(hashlib.sha256(read_regular(directory.plan.path)).hexdigest())
        journals = directory.journals
        files = [*journals.files(), *journals.trace_files(), *directory.runs.files()]
        told += filter(None, map(_told, files))
    except (OSError, WhirlError):  # the error is raised when the file is read
        return ""
    return hashlib.sha256(os.fsencode("\n".join(told))).hexdigest()


def _told(path: Path) -> str:
    """Return name, size and time of a file as text; "" for an empty file."""
    state = path.stat()
    if not state.st_size:
        return ""
    return f"{path.parent.name}/{path.name} {state.st_size} {state.st_mtime_ns}"


def stamp(directory: Directory) -> None:
    """Write the stamp (size and time) of results that were just gathered."""
    with suppress(WhirlError):  # without a stamp, results are gathered again
        write_whole(directory.runs.place / STAMP, _told(directory.results).encode())


def _is_stamped(directory: Directory) -> bool:
    try:
        found = read_regular(directory.runs.place / STAMP)
        return found == _told(directory.results).encode()
    except (OSError, WhirlError):
        return False


def is_current(directory: Directory, words: Mapping[str, float]) -> bool:
    """Return whether gathering again would write the same results file.

    words : {root attribute: threshold} in use
    """
    try:
        with opened(directory.results) as file:
            same = all(file.attrs.get(n) == limit for n, limit in words.items())
            known = bytes(file["performance"].attrs.get(SOURCE, b"")).decode()
        same = same and known != "" and _is_stamped(directory)
        return bool(same and known == source_of(directory))
    except (WhirlError, KeyError, *DAMAGE):
        return False
