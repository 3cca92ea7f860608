"""Standard streams of the program that survive closed descriptors and full disks."""

from __future__ import annotations

import io
import os
import sys
from typing import Any

from hpcwhirl.errors import PASSING, unwritable


class _Deaf(io.FileIO):
    """Raw stream whose writes never fail: data that cannot be written are dropped."""

    def write(self, data: Any) -> int:
        """Write data, or drop them if that fails."""
        try:
            return super().write(data)
        except OSError:
            return memoryview(data).nbytes


class _Strict(io.FileIO):
    """Raw stdout; a failed write is a MissingFileError, but a closed pipe is not."""

    def write(self, data: Any) -> int:
        """Write some of the data and return the number of bytes, like `io.FileIO`."""
        try:
            return super().write(data)
        except BrokenPipeError:
            raise
        except OSError as failed:
            msg = f"cannot write stdout: {failed.strerror}"
            raise unwritable(msg, failed) from None


def stand_in() -> None:
    """Open closed standard descriptors, and replace stdout and stderr.

    If descriptor 2 were closed, the next file opened would get that number, and a
    journal would receive messages. Errors of stderr are ignored: a log on a full disk
    must not end a campaign.
    """
    for number in (0, 1, 2):
        try:
            os.fstat(number)
        except OSError:
            free = os.open(os.devnull, os.O_RDWR)  # gets the lowest free number: this
            os.set_inheritable(free, True)  # noqa: FBT003
    words = sys.stdout.encoding if sys.stdout is not None else "utf-8"
    strict = _Strict(1, "wb", closefd=False)
    sys.stdout = io.TextIOWrapper(
        io.BufferedWriter(strict), words, "backslashreplace",
        line_buffering=strict.isatty(),
    )  # fmt: skip
    words = sys.stderr.encoding if sys.stderr is not None else "utf-8"
    sys.stderr = io.TextIOWrapper(
        _Deaf(2, "wb", closefd=False),
        words, "backslashreplace", line_buffering=True, write_through=True,
    )  # fmt: skip


def _tell_late(number: int) -> None:
    """Raise MissingFileError for a full disk that a file server reports only at close.

    Closing a duplicate of the descriptor makes the server report it, and leaves the
    stream open.
    """
    try:
        os.close(os.dup(number))
    except OSError as failed:
        if failed.errno in PASSING:
            msg = f"cannot write stdout: {failed.strerror}"
            raise unwritable(msg, failed) from None


def flush_stdout() -> None:
    """Flush stdout.

    Raises
    ------
    MissingFileError
        if stdout cannot be written
    BrokenPipeError
        if the reader of stdout has closed the pipe
    """
    try:
        sys.stdout.flush()
        _tell_late(1)
    except OSError:
        # the buffer is lost; the interpreter must not try to flush it again at its end
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        raise
