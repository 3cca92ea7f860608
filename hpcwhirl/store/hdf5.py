"""Writing HDF5 files such that a full disk is an error and not a crash.

HDF5 writes much of a file when its objects are closed, possibly by the garbage
collector. A failure there is not reported: the library keeps the object, tries again at
the end of the process, and crashes. So failures are hidden from it: every write
pretends to succeed, and the first error is raised after the file, useless by then, is
closed.
"""

from __future__ import annotations

import io
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import MissingFileError, StoreError, WhirlError, unwritable

DAMAGE = (OSError, RuntimeError, LookupError, TypeError, ValueError, AttributeError)


def utf8(text: str) -> NDArray[np.bytes_]:
    """Return text as an attribute of fixed length, marked as UTF-8.

    NetCDF, h5netcdf and h5py read such text, and parallel HDF5 can write it.
    """
    data = text.encode()
    return np.array(data, dtype=h5py.string_dtype("utf-8", max(len(data), 1)))


class _Patient(io.FileIO):
    """A file whose writes always seem to succeed; it keeps the first error."""

    failed: OSError | None = None

    def write(self, data: Any) -> int:
        """Write some bytes or keep the error; return their number in any case."""
        left = memoryview(data).cast("B")
        size = len(left)
        try:
            while left and self.failed is None:
                left = left[super().write(left) :]
        except OSError as failed:
            self.failed = failed
        return size

    def truncate(self, size: int | None = None) -> int:
        """Set the file's size or keep the error; return the size."""
        try:
            return super().truncate(size)
        except OSError as failed:
            self.failed = self.failed or failed
            return size or 0


@contextmanager
def writing(path: Path, mode: str = "w", **options: Any) -> Iterator[h5py.File]:
    """Open an HDF5 file for the block; flush and close it at the end.

    options : further arguments of `h5py.File`

    Raises
    ------
    OSError, RuntimeError
        where a write failed, as on a full disk; the file is closed and useless then
    """
    if "driver" in options:  # MPI-IO needs the path, not a Python file
        with h5py.File(path, mode, **options) as file:
            yield file
            file.flush()
        return
    with _Patient(path, "w+" if mode == "w" else "r+") as disk:
        try:
            with h5py.File(disk, mode, **options) as file:
                yield file
                file.flush()
        finally:
            if disk.failed is not None:  # the cause of whatever the library reports
                raise disk.failed


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Turn errors of reading a damaged file, inside the block, into a one-line error.

    Raises
    ------
    StoreError
        naming the file
    """
    try:
        yield
    except WhirlError:
        raise
    except DAMAGE as failed:
        said = str(failed).splitlines()
        why = said[0] if said else type(failed).__name__
        msg = f"{path} is damaged: {why}"
        raise StoreError(msg) from None


def refusal(path: Path, failed: Exception) -> MissingFileError:
    """Return the error of a file that could not be written, in one line."""
    chain: list[BaseException] = [failed]
    while (before := chain[-1].__cause__ or chain[-1].__context__) is not None:
        chain.append(before)
    number = next(filter(None, map(_number, chain)), 0)
    why = os.strerror(number) if number else str(failed).splitlines()[0]
    return unwritable(f"cannot write {path}: {why}", number)


def _number(failed: BaseException) -> int:
    """Return the errno of an error, which HDF5 hides in its text; 0 for none."""
    found = re.search(r"errno = (\d+)", str(failed))
    return getattr(failed, "errno", None) or (int(found[1]) if found else 0)
