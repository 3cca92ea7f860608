"""The three streams of the program, also where they are closed or take nothing."""

from __future__ import annotations

import io
import os
import sys
from typing import Any

from hpcwhirl.errors import unwritable


class _Deaf(io.FileIO):
    """A stream that may take nothing: what it is told is lost, not the work."""

    def write(self, data: Any) -> int:
        """Write what can be written."""
        try:
            return super().write(data)
        except OSError:
            return memoryview(data).nbytes


class _Strict(io.FileIO):
    """What was asked for: that it cannot be written is an error of its own."""

    def write(self, data: Any) -> int:
        """Write some of the data, as any stream does."""
        try:
            return super().write(data)
        except BrokenPipeError:
            raise
        except OSError as failed:
            msg = f"cannot write stdout: {failed.strerror}"
            raise unwritable(msg, failed) from None


def stand_in() -> None:
    """Give closed streams a place, and let no progress line end the work.

    A closed descriptor 2 would be the next file's that is opened: messages would be
    written into a journal. A log on a full disk would end a campaign that could go on.
    """
    for number in (0, 1, 2):
        try:
            os.fstat(number)
        except OSError:
            free = os.open(os.devnull, os.O_RDWR)  # the lowest that is: this one
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


def flush_stdout() -> None:
    """Write what is left of stdout.

    Raises
    ------
    MissingFileError
        where it cannot be written; `BrokenPipeError` where nobody reads it
    """
    try:
        sys.stdout.flush()
    except OSError:
        # what is left is lost, and the end of the interpreter is not to try again
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        raise
