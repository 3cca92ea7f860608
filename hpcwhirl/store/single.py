"""Files of one case and of one model."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.store.hdf5 import refusal, writing
from hpcwhirl.store.whole import replacing

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


def write_case(
    path: Path,
    scene_toml: str,
    row: Mapping[str, Any],
    traces: Mapping[str, NDArray[np.float64]],
) -> None:
    """Write the traces of one case; its row and scene are root attributes."""
    from hpcwhirl.store.schema import TRACES

    arrays = {"time": (traces["time"], "s", "time of the sample")}
    for name in traces.keys() & TRACES.keys():
        _, unit, meaning = TRACES[name]
        arrays[name] = (traces[name], unit, meaning)
    write_arrays(path, arrays, {"scene": scene_toml, **row})
