"""A results file for xarray, opened once, so that all groups come from one file.

If each group were opened by path, the file could be replaced between two of them. The
file has a few dozen variables in each group; xarray's own stores look each of them up
some twenty times, which would take longer than all else that a map needs.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import xarray
from xarray.backends import BackendArray
from xarray.backends.locks import HDF5_LOCK
from xarray.core.indexing import (
    CopyOnWriteArray,
    IndexingSupport,
    LazilyIndexedArray,
    MemoryCachedArray,
    explicit_indexing_adapter,
)

from hpcwhirl.store.reading.results_file import opened

OF_SCALES = "CLASS", "NAME", "REFERENCE_LIST", "DIMENSION_LIST"  # HDF5's own attributes


class _OneFile:
    """An open results file; unpickling opens it again."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.hdf5 = opened(path)

    def close(self) -> None:
        """Close the file."""
        self.hdf5.close()

    def __getstate__(self) -> Path:
        return self.path

    def __setstate__(self, path: Path) -> None:
        self.__init__(path)  # type: ignore[misc]


class _Stored(BackendArray):
    """A variable of a file, read on access."""

    def __init__(self, file: _OneFile, data: h5py.Dataset) -> None:
        self.file, self.name = file, data.name
        self.shape, self.dtype = data.shape, data.dtype

    def __getitem__(self, key: Any) -> Any:
        how = IndexingSupport.OUTER_1VECTOR
        return explicit_indexing_adapter(key, self.shape, how, self._read)

    def _read(self, key: Any) -> Any:
        with HDF5_LOCK:
            return self.file.hdf5[self.name][key]


def groups_of(path: Path, known: list[str]) -> dict[str, xarray.Dataset]:
    """Return {"": root group, name: group} for those groups that exist, undecoded.

    Closing the root closes the file.

    Raises
    ------
    MissingFileError, StoreError
        if there is no complete results file of this format
    """
    file = _OneFile(path)
    there = [name for name in known if name in file.hdf5]
    found = {name: _dataset(file, file.hdf5[name or "/"]) for name in ("", *there)}
    found[""].set_close(file.close)
    return found


def _dataset(file: _OneFile, group: h5py.Group) -> xarray.Dataset:
    variables = {
        name: _variable(file, data)
        for name, data in group.items()
        if isinstance(data, h5py.Dataset)
    }
    return xarray.Dataset(variables, attrs=_attributes(group))


def _variable(file: _OneFile, data: h5py.Dataset) -> xarray.Variable:
    """Return a variable with the names of its axes, which are dimension scales."""
    axes: tuple[str, ...] = (data.name.rpartition("/")[2],)  # a scale's own
    if "DIMENSION_LIST" in data.attrs:
        scales = data.attrs["DIMENSION_LIST"]
        paths = [h5py.h5r.get_name(one[0], data.id).decode() for one in scales]
        axes = tuple(path.rpartition("/")[2] for path in paths)
    told = {"source": str(file.path), "chunksizes": data.chunks}
    if data.chunks:  # what writes the file anew keeps them
        told |= {"zlib": data.compression == "gzip", "shuffle": data.shuffle}
        told |= {"complevel": data.compression_opts or 0}
        told |= {"preferred_chunks": dict(zip(axes, data.chunks, strict=True))}
    lazy: Any = LazilyIndexedArray(_Stored(file, data))
    kept: Any = MemoryCachedArray(CopyOnWriteArray(lazy))  # type: ignore[no-untyped-call]
    return xarray.Variable(axes, kept, _attributes(data), told)


def _attributes(owner: h5py.HLObject) -> dict[str, Any]:
    """Return attributes but those of dimension scales, a value alone as a scalar."""
    found = {}
    for name in owner.attrs:
        if name not in OF_SCALES:
            value = owner.attrs[name]
            if isinstance(value, np.ndarray) and value.size == 1:
                value = value.item() if value.dtype.kind in "SO" else value.flat[0]
            if isinstance(value, bytes):
                value = value.decode("utf-8", "surrogateescape")
            found[name] = value
    return found
