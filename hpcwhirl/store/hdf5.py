"""Opening an HDF5 file to write it, such that a full disk is an error and no crash.

HDF5 writes much of a file as it is closed. Where that fails, the library keeps the
file, tries again as the process ends, and crashes: results are lost in a segmentation
fault. So everything is flushed while an error can still be told, and after an error
what is left goes to memory instead, with which the file can be closed.
"""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py


@contextmanager
def writing(path: Path, mode: str = "w", **options: Any) -> Iterator[h5py.File]:
    """Open a file, write it, flush and close it; options : of `h5py.File`.

    Raises
    ------
    OSError, RuntimeError
        where the disk takes no more; the file is closed and useless then
    """
    with h5py.File(path, mode, **options) as file:
        try:
            yield file
            file.flush()
        except BaseException:
            if "driver" not in options:
                _divert(file)
            raise


def reason(failed: Exception) -> str:
    """Return in a few words why a file could not be written; HDF5 tells many lines."""
    text = str(failed)
    found = re.search(r"errno = (\d+)", text)
    number = getattr(failed, "errno", None) or (int(found[1]) if found else 0)
    return os.strerror(number) if number else text.splitlines()[0]


def _divert(file: h5py.File) -> None:
    """Let all that HDF5 writes to an open file from now on go to memory."""
    own = file.id.get_vfd_handle()
    if hasattr(os, "memfd_create"):
        other = os.memfd_create("hpcwhirl")
        os.dup2(other, own)
        os.close(other)
        return
    with tempfile.TemporaryFile() as other_file:
        os.dup2(other_file.fileno(), own)
