"""Put other words beside stored evidence, replacing the file whole or not at all."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import StoreError, WhirlError
from hpcwhirl.scene.quantities import ROW
from hpcwhirl.store.atomic import replacing
from hpcwhirl.store.directory.owner import RESULTS, Asking, claimed
from hpcwhirl.store.hdf5 import DAMAGE, reading, refusal, writing
from hpcwhirl.store.reading.reader import check_file, words_in
from hpcwhirl.store.reading.shares import GROUP, shares
from hpcwhirl.store.reading.shown import words_of
from hpcwhirl.store.results.cells import write_boundaries
from hpcwhirl.store.results.layout import write_words

WORDS = ("outcome", "regime", "whirl")
Word = tuple[str, str, str]  # of one case
Words = tuple[NDArray[np.str_], NDArray[np.str_], NDArray[np.str_]]  # of all


def relabel(
    path: Path,
    name: Callable[[dict[str, Any]], Words],
    thresholds: Mapping[str, float],
    asking: Asking | None = None,
) -> list[tuple[Word, Word]]:
    """Name every finished case anew; return (old, new) words of each.

    Parameters
    ----------
    path : `results.h5`
    name : words of numbers, each (cases,)
    thresholds : kept as root attributes
    asking : who is told what is waited for: what another process writes
    """
    check_file(path)
    try:
        with claimed(path.parent, RESULTS, asking), replacing(path) as part:
            shutil.copyfile(path, part)
            with writing(part, "r+") as file:
                changes = _rename(file, name)
                if GROUP in file:
                    _rename(file[GROUP], name)
                    _share_anew(file)
                for limit, value in thresholds.items():
                    file.attrs[f"threshold_{limit}"] = np.float64(value)
                write_boundaries(file, dict(file.attrs))
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


def _share_anew(file: h5py.File) -> None:
    """Write the shares of words that twins give by now."""
    own, theirs = (
        words_of(*(words_in(group, n) for n in ("status", "outcome", "regime")))
        for group in (file, file[GROUP])
    )
    for variable, values in shares(own, theirs).items():
        file[variable][:] = values


def _rename(
    file: h5py.Group, name: Callable[[dict[str, Any]], Words]
) -> list[tuple[Word, Word]]:
    """Write new words of finished cases, and the table that says what codes mean."""
    given = words_in(file, "status") == "ok"
    numeric = [n for n, v in ROW.items() if v.kind in {"f8", "i8"}]
    numbers = {n: file[n][:][given] for n in numeric}
    new = name(numbers | {"stop": words_in(file, "stop")[given]})
    old = [words_in(file, variable) for variable in WORDS]
    for variable, was, now in zip(WORDS, old, new, strict=True):
        words = was.copy().astype(object)
        words[given] = now
        write_words(file[variable], words.ravel().tolist())
    before, after = (
        zip(*(column.tolist() for column in columns), strict=True)
        for columns in ([was[given] for was in old], new)
    )
    return list(zip(before, after, strict=True))
