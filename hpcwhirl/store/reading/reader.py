"""Reading `results.h5` back as an `xarray.Dataset`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcwhirl.errors import StoreError
from hpcwhirl.scene.words import ENUMS
from hpcwhirl.store.hdf5 import reading
from hpcwhirl.store.reading.results_file import attribute, results_of

if TYPE_CHECKING:
    import xarray

# of groups: what stands before their variables' names
GROUPS = {"performance": "", "cells": "cell_", "boundaries": "boundary_"}


def open_results(path: Path | str) -> xarray.Dataset:
    """Return a campaign's results with its performance figures merged in.

    Parameters
    ----------
    path : `results.h5`, the directory that holds it, or a file of `hpcwhirl run --out`

    Returns
    -------
    xarray.Dataset over `case` (and `time`, `xy`, ... where traces were kept), units
    and long names on every variable; words and texts are text. Numbers are read from
    the file when they are asked for, traces case by case with `isel`. Of a refined
    campaign also its cells and boundaries, `cell_...` and `boundary_...`

    Raises
    ------
    MissingFileError, StoreError
        where there is no such file, or it is damaged
    """
    return _opened(path, _with_words)


def open_coded(path: Path | str) -> xarray.Dataset:
    """Return results as `open_results`, but words as the numbers that stand for them.

    A number takes a byte a case, a word 40. `flag_meanings` has the words.
    """
    return _opened(path, lambda data: data)


def _opened(
    path: Path | str, finish: Callable[[xarray.Dataset], xarray.Dataset]
) -> xarray.Dataset:
    """Return the groups of a file merged, decoded and finished."""
    from hpcwhirl.store.reading.xarray_store import groups_of

    place = results_of(Path(path))
    with reading(place):
        found = groups_of(place, list(GROUPS))
        root = merged = found.pop("")
        try:
            for name, own in found.items():
                # its dimension `case` has its values in the root alone
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
    """Return the file's variables with texts as text; nothing is read."""
    import xarray

    for name, variable in data.variables.items():
        if variable.dtype.kind == "S":  # xarray decodes it when it is asked for
            data[name].attrs["_Encoding"] = "utf-8"
    data = xarray.decode_cf(data, mask_and_scale=False, decode_times=False)
    for attributes in (data.attrs, *(v.attrs for v in data.variables.values())):
        attributes.update({n: attribute(value) for n, value in attributes.items()})
    return data


def _with_words(data: xarray.Dataset) -> xarray.Dataset:
    """Return decoded results with words as text; the words are read from the file."""
    for name in ENUMS.keys() & data.variables.keys():
        data[name] = _named(data[name])
    return data


def _named(variable: xarray.DataArray) -> xarray.DataArray:
    """Return an enumeration, a byte a case, as words that compare with text."""
    named = variable.copy(data=words(variable))
    named.attrs = {n: v for n, v in variable.attrs.items() if n != "flag_values"}
    return named


def words(variable: xarray.DataArray) -> np.ndarray[Any, np.dtype[np.str_]]:
    """Return the words of a variable such as `regime`, (cases,) of str.

    Where xarray has masked a case (`xarray.Dataset.where`), the word is empty. Also
    takes the integers of a file that something else has opened, by their
    `flag_meanings`.
    """
    values = variable.to_numpy()
    if values.dtype.kind == "O":  # text, and NaN where xarray has masked it
        values = np.array([v if isinstance(v, str) else "" for v in values], str)
    if values.dtype.kind == "U":
        return values
    return np.asarray(np.take(*_places(variable, values)))


def shared_words(variable: xarray.DataArray) -> np.ndarray[Any, np.dtype[np.object_]]:
    """Return the words of a variable of `open_coded`, (cases,), each text stored once.

    A case takes 8 bytes here, 40 in `words`.
    """
    meanings, places = _places(variable, variable.to_numpy())
    return np.asarray(meanings.astype(object)[places])


def _places(
    variable: xarray.DataArray, values: np.ndarray[Any, Any]
) -> tuple[np.ndarray[Any, np.dtype[np.str_]], np.ndarray[Any, np.dtype[np.int64]]]:
    """Return the words of `flag_meanings`, "" last, and each case's place among them.

    values : numbers of the variable, NaN where xarray has masked a case
    """
    meanings = np.array([*str(variable.attrs["flag_meanings"]).split(), ""])
    codes = np.asarray(values, dtype=np.float64)
    if not np.nanmax(codes, initial=0.0) < len(meanings) - 1:
        msg = f"{variable.name} is damaged: it has a value that stands for no word"
        raise StoreError(msg)
    return meanings, np.where(np.isnan(codes), -1, codes).astype(np.int64)
