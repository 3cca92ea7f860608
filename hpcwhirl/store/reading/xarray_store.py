"""Let xarray read the variables of a results file quickly, and only when indexed.

xarray's reader of netCDF-4, h5netcdf, asks the file some twenty times about each of a
hundred variables, which took most of the time of opening results.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
from xarray import Variable
from xarray.backends import AbstractDataStore, BackendArray
from xarray.core import indexing

from hpcwhirl.store.reading.results_file import attributes_of, opened


class ResultsStore(AbstractDataStore):
    """The groups of a results file as one source of variables for xarray.

    The file is opened once: if each group were opened by path, the file could be
    replaced between two of them. Unpickling opens it again.

    Parameters
    ----------
    path : path of the file
    prefixes : {group: prefix of the names of its variables}, of groups that may be
        absent; axes have none, and the axis `case` is that of the root group

    Raises
    ------
    MissingFileError, StoreError
        if `path` is no complete results file of this format
    """

    def __init__(self, path: Path, prefixes: dict[str, str]) -> None:
        self.path, self.prefixes = path, prefixes
        self.file = opened(path)

    def get_attrs(self) -> dict[str, Any]:
        """Return {name: value} of the attributes of the file's root group."""
        return attributes_of(self.file)

    def get_variables(self) -> dict[str, Variable]:
        """Return {name: variable} of all groups; no numbers are read yet."""
        found = {n: self._variable(n) for n in _datasets(self.file)}
        for group in filter(self.file.__contains__, self.prefixes):
            for name in _datasets(self.file[group]):
                variable = self._variable(f"{group}/{name}")
                if variable.dims == (name,):
                    found.setdefault(name, variable)
                else:
                    found[self.prefixes[group] + name] = variable
        return found

    def _variable(self, place: str) -> Variable:
        """Return a variable of the file with the names of its axes and its attributes.

        place : path of the variable in the file
        """
        column = _Column(self, place)
        data = column.data
        axes = data.attrs.get("DIMENSION_LIST")
        names = [place] if axes is None else [_name_of(self.file, a[0]) for a in axes]
        dims = [name.rpartition("/")[2] for name in names]
        attributes = attributes_of(data)
        if data.dtype.kind == "S":  # decoded by xarray on access
            attributes["_Encoding"] = "utf-8"
        lazy = indexing.LazilyIndexedArray(column)
        return Variable(dims, lazy, attributes, {"source": self.file.filename})

    def close(self) -> None:
        """Close the results file."""
        self.file.close()

    def __reduce__(self) -> Any:
        """Return how to pickle the store: by path and prefixes, without open file."""
        return type(self), (self.path, self.prefixes)


class _Column(BackendArray):
    """A variable of an open results file, of which xarray reads the parts it indexes.

    Parameters
    ----------
    store : store of the open file
    place : path of the variable in the file
    """

    def __init__(self, store: ResultsStore, place: str) -> None:
        self.store, self.place, self.data = store, place, store.file[place]
        self.shape, self.dtype = self.data.shape, self.data.dtype

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Any:
        """Read those numbers of the variable that xarray's index selects."""
        able = indexing.IndexingSupport.OUTER_1VECTOR
        return indexing.explicit_indexing_adapter(
            key, self.shape, able, self.data.__getitem__
        )

    def __reduce__(self) -> Any:
        """Return how to pickle the variable: by its store and path, without HDF5's."""
        return type(self), (self.store, self.place)


def _datasets(group: h5py.Group) -> Iterator[str]:
    """Yield the names of the variables (HDF5 datasets) in a group of a results file."""
    for name in group:
        if group.get(name, getclass=True) is h5py.Dataset:
            yield name


def _name_of(file: h5py.File, axis: h5py.Reference) -> str:
    """Return the path of an axis in a results file, from an HDF5 reference to it."""
    return str(h5py.h5r.get_name(axis, file.id), "utf-8")
