"""Reading `results.h5` back as an `xarray.Dataset`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcwhirl.errors import StoreError
from hpcwhirl.scene.words import ENUMS
from hpcwhirl.store.hdf5 import reading
from hpcwhirl.store.reading.coded import Coded
from hpcwhirl.store.reading.results_file import attribute, results_of

if TYPE_CHECKING:
    import xarray

# {group: prefix of its variables' names}
GROUPS = {"performance": "", "cells": "cell_", "boundaries": "boundary_"}


def open_results(path: Path | str) -> xarray.Dataset:
    """Return a campaign's results with its performance figures merged in.

    Parameters
    ----------
    path : `results.h5`, the directory that holds it, or a file of `hpcwhirl run --out`

    Returns
    -------
    xarray.Dataset over `case` (and `time`, `xy`, ... if traces were kept), with units
    and long names on every variable; words and texts are strings. Numbers are read from
    the file on access, traces case by case with `isel`. A refined campaign also has
    its cells and boundaries, `cell_...` and `boundary_...`

    Raises
    ------
    MissingFileError, StoreError
        if the file does not exist, or is damaged
    """
    return _opened(path, _with_words)


def open_coded(path: Path | str) -> xarray.Dataset:
    """Return results as `open_results` does, but with integer codes instead of words.

    A code takes 1 byte for each case, a word 40. `flag_meanings` lists the words.
    """
    return _opened(path, lambda data: data)


def _opened(
    path: Path | str, finish: Callable[[xarray.Dataset], xarray.Dataset]
) -> xarray.Dataset:
    """Return the groups of a file, decoded, passed through `finish`, and merged."""
    from hpcwhirl.store.reading.xarray_store import groups_of

    place = results_of(Path(path))
    with reading(place):
        found = groups_of(place, list(GROUPS))
        root = merged = found.pop("")
        try:
            for name, own in found.items():
                # only the root group has the values of the dimension `case`
                more = own.drop_vars("case", errors="ignore")
                front = {n: f"{GROUPS[name]}{n}" for n in more.data_vars}
                merged = merged.merge(more.rename(front))
            data = finish(_decoded(merged.assign_attrs(root.attrs)))
        except BaseException:
            root.close()
            raise
    data.set_close(root.close)
    return data


def _decoded(data: xarray.Dataset) -> xarray.Dataset:
    """Return the file's variables, bytes decoded to text on access; nothing is read."""
    import xarray

    for name, variable in data.variables.items():
        if variable.dtype.kind == "S":  # decoded by xarray on access
            data[name].attrs["_Encoding"] = "utf-8"
    data = xarray.decode_cf(data, mask_and_scale=False, decode_times=False)
    for attributes in (data.attrs, *(v.attrs for v in data.variables.values())):
        attributes.update({n: attribute(value) for n, value in attributes.items()})
    return data


def _with_words(data: xarray.Dataset) -> xarray.Dataset:
    """Return decoded results with words instead of codes, which are read now."""
    for name in ENUMS.keys() & data.variables.keys():
        named = data[name].copy(data=words(data[name]))
        named.attrs.pop("flag_values", None)
        data[name] = named
    return data


def words(variable: xarray.DataArray) -> np.ndarray[Any, np.dtype[np.str_]]:
    """Return the words of a variable such as `regime`, (cases,) of str.

    The word is "" where xarray has masked a case (`xarray.Dataset.where`). Integer
    codes, as in a file opened by xarray alone, are converted by `flag_meanings`.
    """
    values = variable.to_numpy()
    return values if values.dtype.kind == "U" else np.asarray(coded(variable), str)


def coded(variable: xarray.DataArray) -> Coded:
    """Return the words of a variable, (cases,), as `words` does, by codes."""
    values = variable.to_numpy()
    if values.dtype.kind == "O":  # text, and NaN where xarray has masked a case
        values = np.array([v if isinstance(v, str) else "" for v in values], str)
    if values.dtype.kind == "U":
        return Coded.of(values)
    meanings = (*str(variable.attrs["flag_meanings"]).split(), "")
    codes = np.asarray(values, dtype=np.float32)  # NaN where xarray has masked a case
    if not np.nanmax(codes, initial=0.0) < len(meanings) - 1:
        raise StoreError(f"{variable.name} is damaged: it has a code without a word")
    last = len(meanings) - 1
    return Coded(meanings, np.where(np.isnan(codes), last, codes).astype(np.int8))
