"""Open `results.h5` as an `xarray.Dataset`, with words instead of codes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcwhirl.errors import InputError, shown
from hpcwhirl.scene.words import ENUMS
from hpcwhirl.store.hdf5 import reading
from hpcwhirl.store.reading.coded import Coded
from hpcwhirl.store.reading.results_file import results_of

if TYPE_CHECKING:
    import xarray

# {group: prefix of its variables' names}
GROUPS = {"performance": "", "cells": "cell_", "boundaries": "boundary_"}


def open_results(path: Path | str) -> xarray.Dataset:
    """Return a campaign's results as one dataset, including computing times.

    Parameters
    ----------
    path : `results.h5`, the directory that holds it, or a file of `hpcwhirl run --out`

    Returns
    -------
    xarray.Dataset over `case` (and `time`, `xy`, ... if traces were kept), with units
    and long names on every variable; words and texts are strings. Numbers are read from
    the file on access, traces case by case with `isel`. A refined campaign also has its
    cells and boundaries, `cell_...` and `boundary_...`

    Raises
    ------
    MissingFileError, StoreError
        if the file does not exist, or is damaged
    """
    return _opened(path, _with_words)


def open_coded(path: Path | str) -> xarray.Dataset:
    """Return results as `open_results` does, but with codes for words, to save memory.

    A code takes 1 byte for each case, a word 40. `flag_meanings` lists the words.
    """
    return _opened(path, lambda data: data)


def _opened(
    path: Path | str, finish: Callable[[xarray.Dataset], xarray.Dataset]
) -> xarray.Dataset:
    """Return all groups of a results file as one dataset, changed by `finish`.

    Parameters
    ----------
    path : the file, or the directory that holds it
    finish : function from the dataset, with codes for words, to the one returned
    """
    import xarray

    from hpcwhirl.store.reading.xarray_store import ResultsStore

    place = results_of(Path(path))
    with reading(place):
        store = ResultsStore(place, GROUPS)
        try:
            data = xarray.open_dataset(store, mask_and_scale=False, decode_times=False)
            data = finish(data)
        except BaseException:
            store.close()
            raise
    data.set_close(store.close)
    return data


def _with_words(data: xarray.Dataset) -> xarray.Dataset:
    """Return results with words instead of their integer codes.

    The codes are read from the file now.
    """
    named = {}
    for name in ENUMS.keys() & data.variables.keys():
        coded = data.variables[name]
        told = {n: v for n, v in coded.attrs.items() if n != "flag_values"}
        named[name] = (coded.dims, words(data[name]), told)
    return data.assign(named)


def words(variable: xarray.DataArray) -> np.ndarray[Any, np.dtype[np.str_]]:
    """Return the word of each case, from a variable such as `regime`, (cases,) of str.

    The word is "" where xarray has masked a case (`xarray.Dataset.where`). Integer
    codes, as in a file opened by xarray alone, are converted by `flag_meanings`.

    variable : a variable of results
    """
    if not hasattr(variable, "to_numpy"):
        msg = "words takes a variable of results, as words(data.regime), got "
        raise InputError(msg + shown(variable))
    values = variable.to_numpy()
    if values.dtype.kind not in "UO" and "flag_meanings" not in variable.attrs:
        msg = f"words takes a variable that has words, as regime, got {variable.name}"
        raise InputError(f"{msg} of numbers")
    return values if values.dtype.kind == "U" else np.asarray(coded(variable), str)


def coded(variable: xarray.DataArray) -> Coded:
    """Return the words of a variable such as `regime` as codes, (cases,).

    The words are those that `words` returns.

    variable : a variable of results
    """
    values = variable.to_numpy()
    if values.dtype.kind == "O":  # text, and NaN where xarray has masked a case
        values = np.array([v if isinstance(v, str) else "" for v in values], str)
    if values.dtype.kind == "U":
        return Coded.of(values)
    meanings = str(variable.attrs["flag_meanings"])
    return Coded.read(str(variable.name), values, meanings)
