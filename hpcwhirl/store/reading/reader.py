"""Reading `results.h5` back as an `xarray.Dataset`."""

from __future__ import annotations

from collections import Counter
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from hpcwhirl.errors import MissingFileError, StoreError, shown
from hpcwhirl.scene.words import ENUMS
from hpcwhirl.store.hdf5 import DAMAGE, reading
from hpcwhirl.store.reading.shares import GROUP as TWINS
from hpcwhirl.store.schema import FORMAT

if TYPE_CHECKING:
    import xarray

# of groups: what stands before their variables' names
GROUPS = {"performance": "", "cells": "cell_", "boundaries": "boundary_"}


def check_file(path: Path) -> None:
    """Raise one clear line unless `path` is a whole results file of this format."""
    if path.parent.is_file():
        msg = f"{path.parent} is a file: the directory of a campaign is wanted"
        raise MissingFileError(msg)
    if not path.is_file():
        msg = f"no results file {path}: run or gather the campaign first"
        raise MissingFileError(msg)
    try:
        with h5py.File(path, "r") as file:
            found = file.attrs.get("format")
    except DAMAGE as failed:
        msg = f"{path} is not a whole HDF5 file: {failed}"
        raise StoreError(msg) from None
    if not np.array_equal(found, FORMAT):
        msg = f"{path} has format {shown(found)}, this program reads {FORMAT}"
        raise StoreError(msg)


def results_of(place: Path) -> Path:
    """Return the results file of a directory, or the file itself."""
    return place if place.is_file() else place / "results.h5"


def words_in(file: h5py.Group, name: str) -> np.ndarray[Any, np.dtype[np.str_]]:
    """Return the words of a variable by the file's own `flag_meanings`, (cases,).

    Raises
    ------
    StoreError
        where a value stands for no word
    """
    codes, meanings = file[name][:], file[name].attrs["flag_meanings"]
    known = np.array(np.bytes_(meanings).decode().split())
    if codes.size and not 0 <= codes.min() <= codes.max() < len(known):
        msg = f"{name} is damaged: it has a value that stands for no word"
        raise StoreError(msg)
    return np.asarray(known[codes])


def count_statuses(path: Path) -> dict[str, int]:
    """Return {status: cases}, `missing` among them, of a results file."""
    check_file(path)
    with reading(path), h5py.File(path, "r") as file:
        found = Counter(words_in(file, "status").tolist())
        return {name: found[name] for name in ENUMS["status"] if found[name]}


def has_contact(path: Path) -> bool:
    """Return whether blades touched in any case of a results file, or none ended."""
    with reading(path), h5py.File(path, "r") as file:
        ended = words_in(file, "status") == "ok"
        return bool((file["contacts"][:][ended] > 0).any() or not ended.any())


def count_failed_twins(path: Path) -> int:
    """Return how many cases that gave a result have a twin that gave none."""
    with reading(path), h5py.File(path, "r") as file:
        if TWINS not in file:
            return 0
        bad = np.isin(words_in(file[TWINS], "status"), ("failed", "timeout", "crashed"))
        return int((bad.any(axis=1) & (words_in(file, "status") == "ok")).sum())


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
    place = Path(path)
    place = place / "results.h5" if place.is_dir() else place
    check_file(place)
    with reading(place), ExitStack() as stack:
        with h5py.File(place, "r") as file:
            more = {n: front for n, front in GROUPS.items() if n in file}
        root = stack.enter_context(_group(place, None))
        merged = root
        for name, front in more.items():
            own = stack.enter_context(_group(place, name))
            # its dimension `case` has its values in the root alone
            own = own.drop_vars("case", errors="ignore")
            merged = merged.merge(own.rename({n: f"{front}{n}" for n in own.data_vars}))
        data = _decoded(merged.assign_attrs(root.attrs))
        data.set_close(stack.pop_all().close)
    return data


def _group(place: Path, name: str | None) -> xarray.Dataset:
    import xarray

    return xarray.open_dataset(place, engine="h5netcdf", group=name, decode_cf=False)


def _decoded(data: xarray.Dataset) -> xarray.Dataset:
    """Return the file's variables with words and texts as text, nothing else read."""
    import xarray

    for name, variable in data.variables.items():
        if variable.dtype.kind == "S":  # xarray decodes it when it is asked for
            data[name].attrs["_Encoding"] = "utf-8"
    data = xarray.decode_cf(data, mask_and_scale=False, decode_times=False)
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

    Where xarray has masked a case (`Dataset.where`), the word is empty. Also takes the
    integers of a file that something else has opened, by their `flag_meanings`.
    """
    values = variable.to_numpy()
    if values.dtype.kind == "O":  # text, and NaN where xarray has masked it
        values = np.array([v if isinstance(v, str) else "" for v in values], str)
    if values.dtype.kind == "U":
        return values
    meanings = np.array([*str(variable.attrs["flag_meanings"]).split(), ""])
    codes = np.asarray(values, dtype=np.float64)
    if not np.nanmax(codes, initial=0.0) < len(meanings) - 1:
        msg = f"{variable.name} is damaged: it has a value that stands for no word"
        raise StoreError(msg)
    return np.asarray(meanings[np.where(np.isnan(codes), -1, codes).astype(int)])
