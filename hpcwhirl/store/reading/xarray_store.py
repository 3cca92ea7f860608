"""A results file for xarray, opened once, so that all groups come from one file.

If each group were opened by path, the file could be replaced between two of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5netcdf
import xarray
from xarray.backends import FileManager, H5NetCDFStore

from hpcwhirl.store.reading.results_file import opened


class _OneFile(FileManager[Any]):
    """File manager of xarray for one open file; unpickling opens the file again."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._hdf5 = opened(path)
        self._netcdf = h5netcdf.File(self._hdf5, "r")

    def acquire(self, needs_lock: bool = True) -> Any:  # noqa: FBT001, FBT002 - xarray's
        """Return the open file."""
        del needs_lock
        return self._netcdf

    @contextmanager
    def acquire_context(self, needs_lock: bool = True) -> Iterator[Any]:  # noqa: FBT001, FBT002
        """Yield the open file."""
        yield self.acquire(needs_lock)

    def close(self, needs_lock: bool = True) -> None:  # noqa: FBT001, FBT002
        """Close the file."""
        del needs_lock
        self._netcdf.close()
        self._hdf5.close()

    def __getstate__(self) -> Path:
        return self.path

    def __setstate__(self, path: Path) -> None:
        self.__init__(path)  # type: ignore[misc]


def groups_of(path: Path, known: list[str]) -> dict[str, xarray.Dataset]:
    """Return {"": root group, name: group} for those groups that exist, undecoded.

    Closing the root closes the file.

    Raises
    ------
    MissingFileError, StoreError
        if `path` is no complete results file of this format
    """
    file = _OneFile(path)
    there = [name for name in known if name in file.acquire().groups]
    found = {
        name: xarray.open_dataset(
            H5NetCDFStore(file, group=name or None, mode="r"), decode_cf=False
        )
        for name in ("", *there)
    }
    found[""].set_close(file.close)
    return found
