"""Write other words into results.h5, determined again from its stored numbers.

`hpcwhirl classify` does this after a change of thresholds. The file is replaced as a
whole.
"""

from __future__ import annotations

import shutil
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import StoreError, WhirlError
from hpcwhirl.scene.quantities import CHAOS, ROW
from hpcwhirl.scene.words import ENUMS
from hpcwhirl.store.atomic import replacing, sweep
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.directory.owner import RESULTS, Asking
from hpcwhirl.store.hdf5 import DAMAGE, mark_words, reading, refusal, writing
from hpcwhirl.store.reading.coded import Coded, counted
from hpcwhirl.store.reading.results_file import coded_in, opened, words_in
from hpcwhirl.store.reading.shares import GROUP, shares, words_of
from hpcwhirl.store.results.cells import write_boundaries
from hpcwhirl.store.results.layout import codes_of

AT_ONCE = 1 << 15  # number of cases whose words are determined together
WORDS = ("outcome", "regime", "whirl")
MOTION = "motion"  # only in results of campaigns with output.chaos > 0
Word = tuple[str, ...]  # the words of one case
Words = tuple[NDArray[np.str_], ...]  # (cases,) each


def relabel(
    directory: Directory,
    name: Callable[[dict[str, Any]], Words],
    thresholds: Mapping[str, float],
    asking: Asking | None = None,
) -> Counter[tuple[Word, Word]]:
    """Determine the words of finished cases anew, and write them into results.h5.

    Parameters
    ----------
    directory : directory of the campaign
    name : function from {variable: (cases,)} to words, (cases,) each: of `WORDS`, and
        of `MOTION` if the variables of `CHAOS` are given
    thresholds : {name: value}, stored as root attributes
    asking : options of the claim, see `store.directory.owner.Asking`

    Returns
    -------
    {(old words, new words): number of cases}
    """
    path = directory.results
    opened(path).close()
    try:
        with directory.claims.make(RESULTS, asking) as own:
            sweep(directory.path, path.name)  # left by processes that died
            with replacing(path, own.check) as part:
                shutil.copyfile(path, part)
                changes = _renamed(part, name, thresholds)
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


def compared(
    directory: Directory, name: Callable[[dict[str, Any]], Words]
) -> Counter[tuple[Word, Word]]:
    """Return what `relabel` would change, {(old words, new words): number of cases}.

    directory, name : as for `relabel`
    """
    path, changes = directory.results, Counter[tuple[Word, Word]]()
    with reading(path), opened(path) as file:
        for start in range(0, len(file["status"]), AT_ONCE):
            some = slice(start, start + AT_ONCE)
            changes += _counted(*_compared(file, some, name))
    return changes


def _renamed(
    part: Path, name: Callable[[dict[str, Any]], Words], thresholds: Mapping[str, float]
) -> Counter[tuple[Word, Word]]:
    """Write new words, shares, thresholds and boundaries into a copy of results.h5.

    Parameters
    ----------
    part : the copy
    name : function that determines words, see `relabel`
    thresholds : {name: value}, stored as root attributes

    Returns
    -------
    {(old words, new words): number of cases}
    """
    with writing(part, "r+") as file:
        changes = _rename(file, name)
        if GROUP in file:
            _rename(file[GROUP], name)
            _share_anew(file)
        for limit, value in thresholds.items():
            file.attrs[f"threshold_{limit}"] = np.float64(value)
        write_boundaries(file)
    return changes


def _share_anew(file: h5py.File) -> None:
    """Compute and write again which share of each case's twins has which word.

    file : results file, opened for writing
    """
    own, theirs = (
        words_of(*(words_in(group, n) for n in ("status", "outcome", "regime")))
        for group in (file, file[GROUP])
    )
    for variable, values in shares(own, theirs).items():
        if variable in file:  # files of older versions have no majority
            file[variable][:] = values


def _rename(
    file: h5py.Group, name: Callable[[dict[str, Any]], Words]
) -> Counter[tuple[Word, Word]]:
    """Write the new words of all cases, or of all twins, into a results file.

    Parameters
    ----------
    file : root group of the results, or the group of the twins
    name : function that determines words, see `relabel`

    Returns
    -------
    {(old words, new words): number of cases or twins}
    """
    changes: Counter[tuple[Word, Word]] = Counter()
    for start in range(0, len(file["status"]), AT_ONCE):
        changes += _rename_some(file, slice(start, start + AT_ONCE), name)
    for variable in _variables(file):  # the file's codes may have had other meanings
        mark_words(file[variable], ENUMS[variable])
    return changes


def _rename_some(
    file: h5py.Group, cases: slice, name: Callable[[dict[str, Any]], Words]
) -> Counter[tuple[Word, Word]]:
    """Write the new words of some cases, or of their twins, into a results file.

    Parameters
    ----------
    file : root group of the results, or the group of the twins
    cases : which cases
    name : function that determines words, see `relabel`

    Returns
    -------
    {(old words, new words): number of cases or twins}
    """
    given, old, new = _compared(file, cases, name)
    for variable, was, now in zip(_variables(file), old, new, strict=True):
        codes = np.empty(was.code.shape, np.int8)
        codes[given] = codes_of(variable, now)
        codes[~given] = codes_of(variable, was[~given])
        file[variable][cases] = codes
    return _counted(given, old, new)


def _compared(
    file: h5py.Group, cases: slice, name: Callable[[dict[str, Any]], Words]
) -> tuple[NDArray[np.bool_], list[Coded], list[Coded]]:
    """Return which of some cases have a result, their words, and new ones of these.

    file, cases, name : as for `_rename_some`
    """
    given = coded_in(file, "status", cases).isin(["ok"])
    table = ROW | CHAOS if MOTION in file else ROW
    numeric = [n for n, v in table.items() if v.kind in {"f8", "i8"}]
    numbers = {n: file[n][cases][given] for n in numeric}
    stop = np.asarray(coded_in(file, "stop", cases)[given])
    new = list(map(Coded.of, name(numbers | {"stop": stop})))
    return given, [coded_in(file, n, cases) for n in _variables(file)], new


def _counted(
    given: NDArray[np.bool_], old: list[Coded], new: list[Coded]
) -> Counter[tuple[Word, Word]]:
    """Return {(old words, new words): number of cases}, see `_compared`."""
    both = counted([*(was[given] for was in old), *new])
    return Counter(
        {(each[: len(old)], each[len(old) :]): n for each, n in both.items()}
    )


def _variables(file: h5py.Group) -> tuple[str, ...]:
    """Return the variables with words that `classify` determines again.

    file : root group of the results, or the group of the twins
    """
    return (*WORDS, MOTION) if MOTION in file else WORDS
