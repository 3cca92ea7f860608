"""Probe of a campaign's directory from all ranks: sharing, locks, exclusive files."""

from __future__ import annotations

import fcntl
import os
import shutil
import uuid
from pathlib import Path
from typing import Any

from hpcwhirl.launch import ALONE, Communicator

Facts = dict[str, Any]


def filesystem(path: Path, mounts: str) -> str:
    """Return the type of a path's file system, such as ``nfs4``; empty if unknown.

    Parameters
    ----------
    path : absolute path
    mounts : content of /proc/mounts
    """
    best, kind = "", ""
    for line in mounts.splitlines():
        fields = line.split()
        if len(fields) < 3:
            continue
        point = fields[1].replace("\\040", " ")
        inside = path == Path(point) or Path(point) in path.parents
        if inside and len(point) >= len(best):
            best, kind = point, fields[2]
    return kind


def place_facts(folder: Path, comm: Communicator = ALONE) -> Facts:
    """Probe a directory from this rank; collective over `comm`.

    Rank 0 removes the probe files, whose names are unique.

    Returns
    -------
    dict with the keys
        writable : whether this rank may write there
        seen : whether this rank sees a file that rank 0 has created
        locks : ``held`` if rank 0's lock keeps this rank out, ``not held``, or the
            system's error
        exclusive : whether this rank created the file that only one rank can create
        free : free space, bytes; None: unknown
        filesystem : type of the file system; empty: unknown
    """
    name = comm.bcast(f".hpcwhirl-doctor-{uuid.uuid4().hex}", root=0)
    held, facts = None, _usage(folder)
    if comm.rank == 0:
        held, facts["locks"] = _held(folder / name)
    comm.Barrier()
    facts["seen"] = (folder / name).exists()
    if comm.rank != 0 or comm.size == 1:
        facts["locks"] = _tried(folder / name, facts.get("locks", ""))
    facts["exclusive"] = _exclusive(folder / f"{name}-once")
    comm.Barrier()
    if held is not None:
        held.close()
    if comm.rank == 0:
        for path in (folder / name, folder / f"{name}-once"):
            path.unlink(missing_ok=True)
    return facts


def _usage(folder: Path) -> Facts:
    try:
        mounts = Path("/proc/mounts").read_text(encoding="utf-8")
    except OSError:
        mounts = ""
    try:
        free: int | None = shutil.disk_usage(folder).free
    except OSError:
        free = None
    return {
        "writable": folder.is_dir() and os.access(folder, os.W_OK | os.X_OK),
        "free": free,
        "filesystem": filesystem(folder.resolve(), mounts),
    }


def _held(path: Path) -> tuple[Any, str]:
    """Create a file and lock it as HDF5 does; return it and ``held`` or the error."""
    try:
        file = path.open("w", encoding="utf-8")
    except OSError as failed:
        return None, str(failed.strerror)
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as failed:
        return file, str(failed.strerror)
    return file, "held"


def _tried(path: Path, state: str) -> str:
    """Try to take the lock that rank 0 holds; return ``held`` if that is refused.

    Parameters
    ----------
    path : the locked file
    state : what `_held` returned to this rank; "" on ranks that did not call it. An
        error is returned unchanged, without a try
    """
    if state and state != "held":
        return state
    try:
        with path.open("r+", encoding="utf-8") as file:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return "held"
    except OSError as failed:
        return str(failed.strerror)
    return "not held"


def _exclusive(path: Path) -> bool:
    try:
        path.touch(exist_ok=False)
    except OSError:
        return False
    return True
