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
        self.axes: dict[int, str] = {}  # {address in the file: path in the file}

    def get_attrs(self) -> dict[str, Any]:
        """Return {name: value} of the attributes of the file's root group."""
        return attributes_of(self.file)

    def get_variables(self) -> dict[str, Variable]:
        """Return {name: variable} of all groups; no values are read yet."""
        found = {n: self._variable(n, data) for n, data in _datasets(self.file)}
        for group in filter(self.file.__contains__, self.prefixes):
            for name, data in _datasets(self.file[group]):
                variable = self._variable(f"{group}/{name}", data)
                if variable.dims == (name,):
                    found.setdefault(name, variable)
                else:
                    found[self.prefixes[group] + name] = variable
        return found

    def _variable(self, place: str, data: h5py.Dataset) -> Variable:
        """Return a variable with its axes' names and its attributes.

        place, data : its path in the file, and what is there
        """
        axes = data.attrs.get("DIMENSION_LIST")
        names = [place] if axes is None else [self._name_of(a[0]) for a in axes]
        dims = [name.rpartition("/")[2] for name in names]
        attributes = attributes_of(data)
        if data.dtype.kind == "S":  # decoded by xarray on access
            attributes["_Encoding"] = "utf-8"
        lazy = indexing.LazilyIndexedArray(_Column(self, place, data))
        return Variable(dims, lazy, attributes, {"source": self.file.filename})

    def _name_of(self, axis: h5py.Reference) -> str:
        """Return the path in the file of an axis, given by an HDF5 reference to it.

        HDF5 searches the file for it, so each is asked for once.
        """
        found = h5py.h5r.dereference(axis, self.file.id)
        address = h5py.h5o.get_info(found).addr
        if address not in self.axes:
            name = h5py.h5r.get_name(axis, self.file.id)
            self.axes[address] = str(name, "utf-8")
        return self.axes[address]

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

    def __init__(
        self, store: ResultsStore, place: str, data: h5py.Dataset | None = None
    ) -> None:
        self.store, self.place = store, place
        self.data = store.file[place] if data is None else data
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


def _datasets(group: h5py.Group) -> Iterator[tuple[str, h5py.Dataset]]:
    """Yield the names and HDF5 datasets, the variables, in a group."""
    for name, data in group.items():
        if isinstance(data, h5py.Dataset):
            yield name, data
