"""Read rows, traces and the plan of a results file by h5py, without xarray."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager
from functools import cached_property
from itertools import product
from pathlib import Path
from typing import Any, Self, overload

import h5py
import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import (
    InputError,
    MissingFileError,
    StoreError,
    legible,
    shown,
    unreadable,
)
from hpcwhirl.scene import Scene, apply_settings, input_names
from hpcwhirl.scene.input_names import full_name
from hpcwhirl.scene.quantities import (
    CHAOS,
    ESTIMATED,
    OVER_SPEED,
    PERFORMANCE,
    ROW,
    STATUS,
    TRACES,
)
from hpcwhirl.scene.units import written_in, written_units
from hpcwhirl.scene.words import ENUMS
from hpcwhirl.store.directory.campaign_directory import RESULTS
from hpcwhirl.store.directory.manifest import Manifest
from hpcwhirl.store.directory.refined import plan_of_results
from hpcwhirl.store.hdf5 import DAMAGE, FORMAT, reading
from hpcwhirl.store.reading.coded import Coded
from hpcwhirl.store.reading.shares import SHARE

Traces = dict[str, NDArray[np.float64]]
Row = dict[str, Any]
WHOLE = 1e-6  # tolerance of the end time, relative to the sampling interval
NETCDF = {"CLASS", "NAME", "DIMENSION_LIST", "REFERENCE_LIST", "_Netcdf4Dimid",
          "_Netcdf4Coordinates", "_NCProperties"}  # attributes of its own  # fmt: skip
AT_ONCE = 1 << 16  # cases of which a variable is read at once for the digest
BLOCK = 4_000_000  # bytes of traces read at once; a larger case is read alone


def results_of(place: Path) -> Path:
    """Return the path of the results file of a path that a user names.

    It is the path itself, or results.h5 in a directory; the file need not exist.

    place : path of results.h5, or of the directory that holds it
    """
    named = place.suffix == ".h5" and not place.is_dir()
    return place if named or place.is_file() else place / RESULTS


def opened(path: Path) -> h5py.File:
    """Open a results file, after checking that it is complete and of this format.

    Data that belong together must be read from one open file, since the file may be
    replaced by another one at any time.

    Raises
    ------
    MissingFileError, StoreError
        where the file does not exist or may not be read, or is damaged
    """
    if path.parent.is_file():
        msg = f"{path.parent} must be the directory of a campaign, but is a file"
        raise MissingFileError(msg)
    if not path.is_file():
        msg = f"no results file {path}: run or gather the campaign first"
        raise MissingFileError(msg)
    try:
        file = h5py.File(path, "r")
        found = file.attrs.get("format")
    except PermissionError as failed:
        raise unreadable(path, failed) from None
    except DAMAGE as failed:
        msg = f"{path} is not a whole HDF5 file: {failed}"
        if path.suffix == ".toml":
            how = f"hpcwhirl campaign {path}"
            msg = f"{path} is the file of a campaign, not its results: {how}"
        raise StoreError(msg) from None
    if not np.array_equal(found, FORMAT):
        file.close()
        msg = f"{path} has format {shown(found)}, this program reads {FORMAT}"
        raise StoreError(msg)
    return file


def attribute(value: Any) -> Any:
    """Return the value of an HDF5 attribute as a Python number or text.

    Bytes of a text that are not UTF-8 are escaped.
    """
    value = value.item() if isinstance(value, np.generic) else value
    if isinstance(value, str):
        value = value.encode("utf-8", "surrogateescape")
    if not isinstance(value, bytes):
        return value
    return legible(value.decode("utf-8", "backslashreplace"))


def attributes_of(data: h5py.Group | h5py.Dataset) -> dict[str, Any]:
    """Return {name: value} of a group's or variable's attributes, except netCDF's."""
    return {n: attribute(data.attrs[n]) for n in data.attrs if n not in NETCDF}


def words_in(file: h5py.Group, name: str) -> NDArray[np.str_]:
    """Return the words of a variable of a results file as text, (cases,).

    Parameters
    ----------
    file : the open file, or a group in it
    name : name of the variable
    """
    return np.asarray(coded_in(file, name))


def coded_in(file: h5py.Group, name: str, cases: slice = slice(None)) -> Coded:
    """Return the words of a variable of a results file as codes, (cases,).

    The words are those of the file's `flag_meanings`, since another version may have
    had other words.

    Parameters
    ----------
    file : the open file, or a group in it
    name : name of the variable
    cases : which cases to read

    Raises
    ------
    StoreError
        where a code has no word
    """
    codes, meanings = file[name][cases], file[name].attrs["flag_meanings"]
    return Coded.read(name, codes, np.bytes_(meanings).decode())


class Results:
    """An open results file: `results[name]` is a variable, (cases,), read on access.

    The file is opened once, so that rows and traces belong together; a `with` statement
    closes it.

    Parameters
    ----------
    place
        `results.h5`, or the directory of a finished campaign

    Attributes
    ----------
    path : path of the file
    file : the open file
    attrs : root attributes
    kept : names of the traces in the file; empty if none were kept
    """

    def __init__(self, place: Path) -> None:
        self.path = results_of(place)
        self.file = opened(self.path)
        self._columns: dict[str, NDArray[Any]] = {}
        with reading(self.path):
            self.attrs = attributes_of(self.file)
            self.kept = tuple(n for n in TRACES if n in self.file)
            self._count = len(self.file["status"])
            lacking = [n for n in (*ROW, *STATUS, *PERFORMANCE) if n not in self]
        if lacking:
            raise StoreError(f"{self.path} is damaged: it has no {lacking[0]}")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *failed: object) -> None:
        self.file.close()

    def __len__(self) -> int:
        """Return the number of cases in the results."""
        return self._count

    def __contains__(self, name: object) -> bool:
        """Return whether the results have a variable of this name."""
        return str(name) in self._group(str(name))

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return a variable with one value per case, (cases,); words as `str`."""
        if name not in self._columns:
            group = self._group(name)
            with reading(self.path):
                column: Any = words_in(group, name) if name in ENUMS else group[name][:]
            if column.dtype.kind == "S":
                column = np.char.decode(column, errors="replace")
            self._columns[name] = column
        return self._columns[name]

    def _group(self, name: str) -> h5py.Group:
        return self.file["performance"] if name in PERFORMANCE else self.file

    @cached_property
    def plan(self) -> Manifest:
        """The plan of the campaign, with its cases in the order of the results."""
        with reading(self.path):
            plan = plan_of_results(self.path, self.file)
        if len(plan.digests) != len(self):
            msg = f"{self.path} and its campaign.json differ: gather the campaign again"
            raise StoreError(msg)
        return plan

    @cached_property
    def rows(self) -> Rows:
        """Numbers, words and status of each case, as a sequence of {name: value}."""
        over = {name for name in OVER_SPEED if name in self}
        return Rows({name: self[name] for name in (*ROW, *STATUS, *over)})

    def settings(self, case: int) -> dict[str, Any]:
        """Return {dotted input: value} of all inputs of a case, from the plan."""
        return self.plan.base | self.plan.settings[case]

    def value(self, case: int, name: str) -> Any:
        """Return the value of one input of a case.

        Parameters
        ----------
        case : number of the case
        name : short or dotted name of the input
        """
        return self.settings(case)[full_name(name)]

    def scene(self, case: int) -> Scene:
        """Return the scene of a case, with the inputs that the plan has."""
        known, given = input_names(), self.settings(case)
        return apply_settings(Scene(), {n: v for n, v in given.items() if n in known})

    @property
    def sizes(self) -> dict[str, int]:
        """Number of cases, by the name that it has in a dataset: {"case": cases}."""
        return {"case": len(self)}

    def finished(self) -> list[int]:
        """Return the numbers of the cases that gave a result."""
        return [int(i) for i in np.flatnonzero(self["status"] == "ok")]

    def slices(self) -> list[list[int]]:
        """Return groups of finished cases that differ in speed only.

        The cases of a group are ordered by speed.
        """
        found: dict[str, list[int]] = {}
        for case in self.finished():
            key = json.dumps(self._others(case), sort_keys=True)
            found.setdefault(key, []).append(case)
        return [sorted(line, key=self["speed"].__getitem__) for line in found.values()]

    def like(self, case: int) -> list[int]:
        """Return the finished cases that differ from a case in speed only.

        They are ordered by speed, and include the case itself.
        """
        return next(line for line in self.slices() if case in line)

    def others(self, case: int, sign: str = " = ", but: Sequence[str] = ()) -> str:
        """Return a case's swept inputs as text for titles, without speed and history.

        Parameters
        ----------
        case : number of the case
        sign : text between name and value
        but : names of further inputs to leave out
        """
        own = ((n.rsplit(".", 1)[-1], v) for n, v in self._others(case).items())
        return ", ".join(f"{name}{sign}{v}" for name, v in own if name not in but)

    def _others(self, case: int) -> dict[str, Any]:
        settings = self.plan.settings[case]
        return {n: v for n, v in settings.items() if n not in ("speed", "history")}

    def traces(self, case: int) -> Traces:
        """Read the traces of a case, {name: array}, including `time`.

        Raises
        ------
        InputError
            where the case gave no result or its campaign kept no traces
        """
        status = self["status"][case]
        if status != "ok" or not self.kept:
            msg = f"case {case} of {self.path.parent} has no traces: status {status}"
            raise InputError(msg + f", kept: {', '.join(self.kept) or 'none'}")
        ((_, found),) = self.each_traces([case], self.kept)
        return found

    def each_traces(
        self, cases: Sequence[int], names: Sequence[str]
    ) -> Iterator[tuple[int, Traces]]:
        """Yield the number and the traces of each given case, including `time`.

        Few cases are in memory at a time.

        Parameters
        ----------
        cases : numbers of cases that gave a result, ascending
        names : traces to read, all of them in `kept`
        """
        if not len(cases):  # the file may have no traces
            return
        interval, end = self["sample_interval"], self["end_time"]
        with reading(self.path):
            data = {name: self.file[name] for name in names}
            each = sum(8 * int(np.prod(d.shape[1:])) for d in data.values())
            for block in _blocks(cases, max(BLOCK // max(each, 1), 1)):
                read = {n: d[block[0] : block[-1] + 1] for n, d in data.items()}
                for case in block:
                    count = int(end[case] / interval[case] + WHOLE)
                    own = {n: r[case - block[0], :count] for n, r in read.items()}
                    time = (1.0 + np.arange(count)) * interval[case]
                    yield case, {"time": time} | own

    def digest(self, *, thresholds: bool = True) -> str:
        """Return a text that changes when `classify` changes words or thresholds.

        It is the SHA-256 of the file's numbers, words and thresholds, without traces.

        thresholds : False: of numbers and words alone
        """
        found = hashlib.sha256()
        names = sorted(n for n in ROW | STATUS | SHARE | CHAOS | ESTIMATED if n in self)
        with reading(self.path):  # in parts: all variables take 1 kB a case
            for name, start in product(names, range(0, len(self), AT_ONCE)):
                cases = slice(start, start + AT_ONCE)
                if name in ENUMS:  # as text: codes may be another version's
                    words = coded_in(self.file, name, cases)
                    found.update(np.asarray(words, "S16").tobytes())
                else:
                    found.update(self.file[name][cases].tobytes())
        if not thresholds:
            return found.hexdigest()
        limits = {n: v for n, v in self.attrs.items() if n.startswith("threshold_")}
        found.update(repr(sorted(limits.items())).encode())
        return found.hexdigest()


class Rows(Sequence[Row]):
    """Sequence of {variable: value} of each case, made on access from arrays.

    columns : {variable: (cases,)}
    """

    def __init__(self, columns: dict[str, NDArray[Any]]) -> None:
        self.columns = columns

    def __len__(self) -> int:
        """Return the number of cases in the results."""
        return len(self.columns["status"])

    @overload
    def __getitem__(self, case: int) -> Row: ...
    @overload
    def __getitem__(self, case: slice) -> list[Row]: ...
    def __getitem__(self, case: int | slice) -> Any:
        """Return {name: value} of a case, or a list of them for a slice."""
        if isinstance(case, slice):
            return [self[i] for i in range(*case.indices(len(self)))]
        return {name: column[case].item() for name, column in self.columns.items()}


def _blocks(cases: Sequence[int], most: int) -> Iterator[list[int]]:
    """Yield groups of case numbers that lie close together, to be read in one go.

    Parameters
    ----------
    cases : numbers of cases, ascending
    most : largest number of successive cases from the first to the last of a group
    """
    block: list[int] = []
    for case in cases:
        if block and (case - block[0] >= most or case - block[-1] > 2):
            yield block
            block = []
        block.append(case)
    if block:
        yield block


def count_statuses(path: Path) -> dict[str, int]:
    """Return {status: number of cases that have it} of a results file.

    Cases that are missing have the status `missing`.
    """
    with Results(path) as results, reading(path):
        found = coded_in(results.file, "status").counts()
        return {name: found[name] for name in ENUMS["status"] if name in found}


def has_contact(path: Path) -> bool:
    """Return whether blades touched the casing in any case of a results file.

    True if no case has ended.
    """
    with Results(path) as results, reading(path):
        ended = coded_in(results.file, "status").isin(["ok"])
        return bool((results["contacts"][ended] > 0).any() or not ended.any())


def units_of(results: Path) -> tuple[str, ...]:
    """Return the units of a campaign's file that its results name; () for none."""
    with Results(results) as found:
        return tuple(filter(None, str(found.attrs.get("units", "")).split(",")))


def in_their_units(results: Path) -> AbstractContextManager[None]:
    """Return a context in which results are shown in the units of the campaign's file.

    Units that the caller has set come before those that the results name.
    """
    return written_in(written_units() or units_of(results))
