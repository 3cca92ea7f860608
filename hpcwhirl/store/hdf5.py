"""Opening an HDF5 file to write it, such that a full disk is an error and no crash.

HDF5 writes much of a file as its objects are closed, which may be when Python forgets
them: a failure there reaches nobody, the library keeps the object, tries again as the
process ends, and crashes. So it never sees one: what the disk does not take is let
pass, and the first refusal is raised once the file, useless by then, is closed.
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
    """Return text as an attribute keeps it: UTF-8, said to be so, of fixed length.

    NetCDF, h5netcdf and h5py read it, and parallel HDF5 writes it.
    """
    data = text.encode()
    return np.array(data, dtype=h5py.string_dtype("utf-8", max(len(data), 1)))


class _Patient(io.FileIO):
    """A file that takes everything, and remembers what the disk did not take."""

    failed: OSError | None = None

    def write(self, data: Any) -> int:
        """Write all, or remember why not; return the bytes that were to be written."""
        left = memoryview(data).cast("B")
        size = len(left)
        try:
            while left and self.failed is None:
                left = left[super().write(left) :]
        except OSError as failed:
            self.failed = failed
        return size

    def truncate(self, size: int | None = None) -> int:
        """Set the size, or remember why not."""
        try:
            return super().truncate(size)
        except OSError as failed:
            self.failed = self.failed or failed
            return size or 0


@contextmanager
def writing(path: Path, mode: str = "w", **options: Any) -> Iterator[h5py.File]:
    """Open a file, write it, flush and close it; options : of `h5py.File`.

    Raises
    ------
    OSError, RuntimeError
        where the disk takes no more; the file is closed and useless then
    """
    if "driver" in options:  # MPI-IO writes by itself
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
            if disk.failed is not None:  # whatever it has led to in the library
                raise disk.failed


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Tell in one line what reading a damaged file leads to, which may be anything.

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
    """Return in a line why a file could not be written; HDF5 tells many lines."""
    chain: list[BaseException] = [failed]
    while (before := chain[-1].__cause__ or chain[-1].__context__) is not None:
        chain.append(before)
    number = next(filter(None, map(_number, chain)), 0)
    why = os.strerror(number) if number else str(failed).splitlines()[0]
    return unwritable(f"cannot write {path}: {why}", number)


def _number(failed: BaseException) -> int:
    """Return the system's number of an error, 0 for none; HDF5 tells it in words."""
    found = re.search(r"errno = (\d+)", str(failed))
    return getattr(failed, "errno", None) or (int(found[1]) if found else 0)
