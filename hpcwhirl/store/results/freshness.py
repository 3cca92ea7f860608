"""Whether `results.h5` holds all that a directory does, without reading its journals.

The file tells, in its group `performance`, what it was gathered from: the plan, names,
sizes and times of the journals, of traces and of what ranks did. Where one of these is
another by now, or words were given anew, it is to be gathered again. So it is where its
own size and time are not those of a stamp beside it: something else has written in it.
A copy of a directory may have other times, which costs a gathering.
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
    """Return a digest of what results are gathered from; "" where none can be told."""
    told = [__version__, *ROW, *STATUS, *PERFORMANCE]
    try:
        told.append(hashlib.sha256(read_regular(folder / NAME)).hexdigest())
        for part, ending in PARTS.items():
            told += filter(None, map(_told, listed(folder / part, ending)))
    except (OSError, WhirlError):  # whoever reads it tells why
        return ""
    return hashlib.sha256(os.fsencode("\n".join(told))).hexdigest()


def _told(path: Path) -> str:
    """Return what tells a file; nothing of an empty one, as runs without work leave."""
    state = path.stat()
    if not state.st_size:
        return ""
    return f"{path.parent.name}/{path.name} {state.st_size} {state.st_mtime_ns}"


def stamp(path: Path) -> None:
    """Tell beside a results file that it is as gathering wrote it."""
    with suppress(WhirlError):  # which costs a gathering
        write_whole(path.parent / "runs" / STAMP, _told(path).encode())


def _is_stamped(path: Path) -> bool:
    try:
        return read_regular(path.parent / "runs" / STAMP) == _told(path).encode()
    except (OSError, WhirlError):
        return False


def is_current(path: Path, words: Mapping[str, float]) -> bool:
    """Return whether a results file is what gathering would write now.

    Parameters
    ----------
    path : `results.h5`
    words : {root attribute: threshold} by which words are given
    """
    try:
        with opened(path) as file:
            same = all(file.attrs.get(n) == limit for n, limit in words.items())
            known = bytes(file["performance"].attrs.get(SOURCE, b"")).decode()
        same = same and known != "" and _is_stamped(path)
        return bool(same and known == source_of(path.parent))
    except (WhirlError, KeyError, *DAMAGE):
        return False
