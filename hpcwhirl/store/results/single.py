"""HDF5 files of one model: named arrays with units, and facts as attributes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from hpcwhirl.scene.quantities import ARRAYS
from hpcwhirl.store.atomic import make_folders, replacing
from hpcwhirl.store.hdf5 import refusal, writing

Arrays = Mapping[str, NDArray[Any]]


def write_arrays(path: Path, arrays: Arrays, facts: Mapping[str, Any]) -> None:
    """Write arrays with unit and meaning, and facts as root attributes.

    Parameters
    ----------
    path : file to write; on failure an older file stays
    arrays : {path in the file such as `rotor/mass`: array}; its unit and meaning are
        those of the last part of the path in `scene.quantities.ARRAYS`
    facts : {attribute: text or number}
    """
    try:
        make_folders(path.parent)
        with replacing(path) as part, writing(part) as file:
            for name, array in arrays.items():
                told = ARRAYS[name.rpartition("/")[2]]
                data = file.create_dataset(name, data=array)
                data.attrs["units"], data.attrs["long_name"] = told.unit, told.meaning
            for name, value in facts.items():
                file.attrs[name] = value
    except (OSError, RuntimeError) as failed:  # HDF5 raises either, with many lines
        raise refusal(path, failed) from None
