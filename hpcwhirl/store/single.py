"""Files of one model."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from hpcwhirl.store.atomic import replacing
from hpcwhirl.store.hdf5 import refusal, writing

Arrays = Mapping[str, tuple[NDArray[Any], str, str]]


def write_arrays(path: Path, arrays: Arrays, facts: Mapping[str, Any]) -> None:
    """Write arrays with unit and meaning, and facts as root attributes.

    Parameters
    ----------
    path : file to replace, whole or not at all
    arrays : {name, with groups by '/': (array, unit, long name)}
    facts : {attribute: text or number}
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as part, writing(part) as file:
            for name, (array, unit, meaning) in arrays.items():
                data = file.create_dataset(name, data=array)
                data.attrs["units"], data.attrs["long_name"] = unit, meaning
            for name, value in facts.items():
                file.attrs[name] = value
    except (OSError, RuntimeError) as failed:  # HDF5 may say either, in many lines
        raise refusal(path, failed) from None
