"""Opening regular files only: what may wait for ever, or never end, is refused.

A FIFO that nobody writes to hangs who opens it, and a device may have no end. Every
file that a user or a campaign's directory names is opened here.
"""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path
from typing import BinaryIO

NOT_REGULAR = "not a regular file"
FLAGS = {
    "rb": os.O_RDONLY,
    "rb+": os.O_RDWR,
    "ab": os.O_WRONLY | os.O_APPEND | os.O_CREAT,
    "wb": os.O_WRONLY | os.O_CREAT,  # emptied once it is known to be regular
}


def open_regular(path: Path | str, mode: str = "rb") -> BinaryIO:
    """Return an open regular file, unbuffered where it is to be written.

    Parameters
    ----------
    path : of the file; a link to one is followed
    mode : one of `FLAGS`, as of `open`

    Raises
    ------
    OSError
        as `open`; and where it is a FIFO, a socket, a device or a directory
    """
    try:
        check_regular(path)  # opening a device may do something
    except FileNotFoundError:
        if mode.startswith("r"):
            raise
    flags = FLAGS[mode] | os.O_NONBLOCK | os.O_CLOEXEC  # never wait for a FIFO's end
    handle = os.open(path, flags, 0o666)
    try:
        _refuse(os.fstat(handle), path)
        if mode == "wb":
            os.ftruncate(handle, 0)
        return os.fdopen(handle, mode, buffering=-1 if mode == "rb" else 0)
    except BaseException:
        os.close(handle)
        raise


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
        return file.read()


def _refuse(state: os.stat_result, path: Path | str) -> None:
    """Raise OSError where a state is not of a regular file."""
    if stat.S_ISDIR(state.st_mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if not stat.S_ISREG(state.st_mode):
        raise OSError(errno.EINVAL, NOT_REGULAR, str(path))
