"""Open regular files only, so that reading a file can neither block nor go on for ever.

Opening a FIFO without a writer blocks, and a device may have no end. Every file that is
named by a user or found in a campaign's directory is opened by these functions.
"""

from __future__ import annotations

import errno
import os
import stat
from contextlib import suppress
from pathlib import Path
from typing import Any

NOT_REGULAR = "not a regular file"
NOT_NEW = "{} is a link, or is not empty"


def open_regular(path: Path | str, mode: str = "rb", buffering: int = -1) -> Any:
    """Open a regular file as `open` does; symbolic links are followed.

    Raises
    ------
    OSError
        as `open`, and for a FIFO, a socket, a device or a directory
    """
    with suppress(FileNotFoundError):
        check_regular(path)  # before opening: opening a device may already act on it
    return open(path, mode, buffering, opener=_opener)


def _opener(path: str, flags: int) -> int:
    """Open a file without blocking on a FIFO; raise OSError unless the file is regular.

    This is the function that `open_regular` passes to `open` as `opener`.
    """
    handle = os.open(path, flags | os.O_NONBLOCK, 0o666)
    try:
        _refuse(os.fstat(handle), path)
    except BaseException:
        os.close(handle)
        raise
    return handle


def open_new(path: Path, mode: str = "ab") -> Any:
    """Open a file, unbuffered, that this process alone writes; it is made or empty.

    Neither a symbolic link nor a second name (hard link) of another file is written to:
    who may write in the folder could otherwise redirect the writes to any file of the
    owner of this process.

    Raises
    ------
    OSError
        as `open`; and for a link, a file with content, or no regular file
    """
    return open(path, mode, 0, opener=_new_opener)


def _new_opener(path: str, flags: int) -> int:
    """Open an empty file that has one name; the `opener` of `open_new`.

    The file is not truncated, since it is checked only once it is open.
    """
    flags &= ~os.O_TRUNC
    try:
        handle = os.open(path, flags | os.O_NOFOLLOW | os.O_NONBLOCK, 0o666)
    except OSError as failed:
        if failed.errno == errno.ELOOP:
            raise _not_new(path) from None
        raise
    try:
        state = os.fstat(handle)
        _refuse(state, path)
        if state.st_nlink != 1 or state.st_size:
            raise _not_new(path)  # noqa: TRY301 - the file is closed below
    except BaseException:
        os.close(handle)
        raise
    return handle


def _not_new(path: str) -> OSError:
    return OSError(errno.EEXIST, NOT_NEW.format(Path(path).name), path)


def check_regular(path: Path | str) -> int:
    """Return the size of a regular file in bytes; raise OSError if it is not regular.

    A missing file, a directory, a device, a FIFO and a socket are not regular.
    """
    try:
        state = os.stat(path)  # noqa: PTH116 - a name with NUL is an OSError here
    except ValueError as failed:
        raise OSError(errno.EINVAL, str(failed), str(path)) from None
    _refuse(state, path)
    return state.st_size


def read_regular(path: Path | str) -> bytes:
    """Return the bytes of a regular file; raise OSError for a FIFO or a device."""
    with open_regular(path) as file:
        data: bytes = file.read()
        return data


def _refuse(state: os.stat_result, path: Path | str) -> None:
    """Raise OSError if the status of a file says that the file is not a regular one.

    Parameters
    ----------
    state : status of the file from `os.stat`
    path : path of the file, for the message
    """
    if stat.S_ISDIR(state.st_mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if not stat.S_ISREG(state.st_mode):
        raise OSError(errno.EINVAL, NOT_REGULAR, str(path))
