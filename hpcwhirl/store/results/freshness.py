"""Whether `results.h5` is up to date, known without reading the journals.

The group `performance` of the file stores from what it was gathered: the plan, and
names, sizes and times of journals, traces and `runs/`. The file must be gathered again
if one of these or the thresholds of the words have changed, or if its own size and time
differ from those in the stamp file, since another program has then written to it.
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
from hpcwhirl.store.directory.listing import listed
from hpcwhirl.store.directory.manifest import NAME
from hpcwhirl.store.hdf5 import DAMAGE
from hpcwhirl.store.reading.results_file import opened

SOURCE = "gathered_from"  # attribute of the group `performance`
STAMP = "results.stamp"  # in `runs`
PARTS = {"journal": ".log", "traces": ".bin", "runs": ".json"}


def source_of(folder: Path) -> str:
    """Return a digest of the files that results are gathered from, "" if unknown."""
    told = [__version__, *ROW, *STATUS, *PERFORMANCE]
    try:
        told.append(hashlib.sha256(read_regular(folder / NAME)).hexdigest())
        for part, ending in PARTS.items():
            told += filter(None, map(_told, listed(folder / part, ending)))
    except (OSError, WhirlError):  # the error is raised when the file is read
        return ""
    return hashlib.sha256(os.fsencode("\n".join(told))).hexdigest()


def _told(path: Path) -> str:
    """Return name, size and time of a file as text; "" for an empty file."""
    state = path.stat()
    if not state.st_size:
        return ""
    return f"{path.parent.name}/{path.name} {state.st_size} {state.st_mtime_ns}"


def stamp(path: Path) -> None:
    """Write the stamp (size and time) of a results file that was just gathered."""
    with suppress(WhirlError):  # without a stamp it is gathered again
        write_whole(path.parent / "runs" / STAMP, _told(path).encode())


def _is_stamped(path: Path) -> bool:
    try:
        return read_regular(path.parent / "runs" / STAMP) == _told(path).encode()
    except (OSError, WhirlError):
        return False


def is_current(path: Path, words: Mapping[str, float]) -> bool:
    """Return whether gathering again would write the same results file.

    Parameters
    ----------
    path : `results.h5`
    words : {root attribute: threshold} in use
    """
    try:
        with opened(path) as file:
            same = all(file.attrs.get(n) == limit for n, limit in words.items())
            known = bytes(file["performance"].attrs.get(SOURCE, b"")).decode()
        same = same and known != "" and _is_stamped(path)
        return bool(same and known == source_of(path.parent))
    except (WhirlError, KeyError, *DAMAGE):
        return False
