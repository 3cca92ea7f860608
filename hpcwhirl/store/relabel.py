"""Put other words beside stored evidence, replacing the file whole or not at all."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from hpcwhirl.errors import StoreError, WhirlError
from hpcwhirl.store.atomic import replacing
from hpcwhirl.store.hdf5 import DAMAGE, reading, refusal, writing
from hpcwhirl.store.owner import RESULTS, Asking, claimed
from hpcwhirl.store.reader import check_file
from hpcwhirl.store.schema import ENUMS, ROW

WORDS = ("outcome", "regime", "whirl")
Words = tuple[str, str, str]


def relabel(
    path: Path,
    name: Callable[[dict[str, Any]], Words],
    thresholds: Mapping[str, float],
    asking: Asking | None = None,
) -> list[tuple[Words, Words]]:
    """Name every finished case anew; return (old, new) words of each.

    Parameters
    ----------
    path : `results.h5`
    name : words of a row of numbers
    thresholds : kept as root attributes
    asking : who is told what is waited for: what another process writes
    """
    check_file(path)
    try:
        with claimed(path.parent, RESULTS, asking), replacing(path) as part:
            shutil.copyfile(path, part)
            with writing(part, "r+") as file:
                changes = _rename(file, name)
                for limit, value in thresholds.items():
                    file.attrs[f"threshold_{limit}"] = np.float64(value)
    except WhirlError:
        raise
    except KeyError as failed:
        msg = f"{path} is not a campaign's results: {failed.args[0]}"
        raise StoreError(msg) from None
    except DAMAGE as failed:
        if isinstance(failed, OSError) and failed.errno:
            raise refusal(path, failed) from None
        with reading(path):
            raise
    return changes


def _rename(
    file: h5py.File, name: Callable[[dict[str, Any]], Words]
) -> list[tuple[Words, Words]]:
    numeric = [n for n, v in ROW.items() if v.kind in {"f8", "i8"}]
    columns: dict[str, Any] = {n: file[n][:] for n in numeric}
    for word in (*WORDS, "stop"):
        columns[word] = np.array(ENUMS[word])[file[word][:]]
    given = np.flatnonzero(file["status"][:] == ENUMS["status"].index("ok"))
    changes = []
    for case in given.tolist():
        row = {n: values[case].item() for n, values in columns.items()}
        old: Words = (row["outcome"], row["regime"], row["whirl"])
        changes.append((old, name(row)))
    for place, word in enumerate(WORDS):
        codes = file[word][:]
        codes[given] = [ENUMS[word].index(new[place]) for _, new in changes]
        file[word][:] = codes
    return changes
