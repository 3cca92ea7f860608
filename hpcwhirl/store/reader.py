"""Reading `results.h5` back as an `xarray.Dataset`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from hpcwhirl.errors import MissingFileError, StoreError, shown
from hpcwhirl.store.hdf5 import DAMAGE, reading
from hpcwhirl.store.schema import ENUMS, FORMAT

if TYPE_CHECKING:
    import xarray


def check_file(path: Path) -> None:
    """Raise one clear line unless `path` is a whole results file of this format."""
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


def count_statuses(path: Path) -> dict[str, int]:
    """Return {status: cases}, `missing` among them, of a results file."""
    check_file(path)
    with reading(path), h5py.File(path, "r") as file:
        found = np.bincount(file["status"][:], minlength=len(ENUMS["status"]))
        names = zip(ENUMS["status"], found, strict=True)
        return {name: int(n) for name, n in names if n}


def open_results(path: Path | str) -> xarray.Dataset:
    """Return a campaign's results with its performance figures merged in.

    Parameters
    ----------
    path : `results.h5`, or the directory that holds it

    Returns
    -------
    xarray.Dataset over `case` (and `time`, `xy`, ... where traces were kept), units
    and long names on every variable; words are integers with `flag_meanings`, see
    `words`

    Raises
    ------
    MissingFileError, StoreError
        where there is no such file, or it is damaged
    """
    import xarray

    place = Path(path)
    place = place / "results.h5" if place.is_dir() else place
    check_file(place)
    options: dict[str, Any] = {"engine": "h5netcdf", "mask_and_scale": False}
    with reading(place):
        with xarray.open_dataset(place, **options) as root:
            data = root.load()
        with xarray.open_dataset(place, group="performance", **options) as speed:
            merged = data.merge(speed.load(), combine_attrs="override")
    names = str(merged.attrs.get("coordinates", "")).split()
    return merged.set_coords([n for n in names if n in merged])


def words(variable: xarray.DataArray) -> np.ndarray[Any, np.dtype[np.str_]]:
    """Return the words of an enumeration such as `regime`, (cases,) of str.

    Where xarray has masked a case (`Dataset.where`), the word is empty.
    """
    meanings = np.array([*str(variable.attrs["flag_meanings"]).split(), ""])
    values = np.asarray(variable.to_numpy(), dtype=np.float64)
    if not np.nanmax(values, initial=0.0) < len(meanings) - 1:
        msg = f"{variable.name} is damaged: it has a value that stands for no word"
        raise StoreError(msg)
    return np.asarray(meanings[np.where(np.isnan(values), -1, values).astype(int)])
