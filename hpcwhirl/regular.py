"""Opening regular files only: what may wait for ever, or never end, is refused.

A FIFO that nobody writes to hangs who opens it, and a device may have no end. Every
file that a user or a campaign's directory names is opened here.
"""

from __future__ import annotations

import errno
import os
import stat
from contextlib import suppress
from pathlib import Path
from typing import Any

NOT_REGULAR = "not a regular file"


def open_regular(path: Path | str, mode: str = "rb", buffering: int = -1) -> Any:
    """Return an open regular file, as `open` does; a link to one is followed.

    Raises
    ------
    OSError
        as `open`; and where it is a FIFO, a socket, a device or a directory
    """
    with suppress(FileNotFoundError):
        check_regular(path)  # opening a device may do something
    return open(path, mode, buffering, opener=_opener)


def _opener(path: str, flags: int) -> int:
    """Open without waiting for a FIFO's other end; refuse what is not regular."""
    handle = os.open(path, flags | os.O_NONBLOCK, 0o666)
    try:
        _refuse(os.fstat(handle), path)
    except BaseException:
        os.close(handle)
        raise
    return handle


def check_regular(path: Path | str) -> int:
    """Return the bytes of a regular file; raise OSError for anything else."""
    try:
        state = os.stat(path)  # noqa: PTH116 - a name with NUL is an OSError here
    except ValueError as failed:
        raise OSError(errno.EINVAL, str(failed), str(path)) from None
    _refuse(state, path)
    return state.st_size


def read_regular(path: Path | str) -> bytes:
    """Return what a regular file holds."""
    with open_regular(path) as file:
        data: bytes = file.read()
        return data


def _refuse(state: os.stat_result, path: Path | str) -> None:
    """Raise OSError where a state is not of a regular file."""
    if stat.S_ISDIR(state.st_mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if not stat.S_ISREG(state.st_mode):
        raise OSError(errno.EINVAL, NOT_REGULAR, str(path))
