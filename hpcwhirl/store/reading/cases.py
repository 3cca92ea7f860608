"""A campaign directory case by case: its rows at once, traces one case at a time."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, overload

import h5py
import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import InputError, StoreError
from hpcwhirl.scene import Scene, apply_settings, input_names
from hpcwhirl.scene.files import full_name
from hpcwhirl.scene.quantities import ROW, STATUS, TRACES, variable_name
from hpcwhirl.scene.words import ENUMS
from hpcwhirl.store.directory.refined import plan_of_results
from hpcwhirl.store.hdf5 import reading
from hpcwhirl.store.reading.reader import check_file, words_in

WHOLE = 1e-6  # of an interval: a sample so near the end is there
Traces = dict[str, NDArray[np.float64]]


def plain(value: Any) -> Any:
    """Return an input as a number or as the text that a results file has of it."""
    return json.dumps(value) if isinstance(value, list) else value


class Rows(Sequence[dict[str, Any]]):
    """Rows of columns, each made when it is asked for.

    Parameters
    ----------
    columns
        {name: (cases,)}
    """

    def __init__(self, columns: dict[str, NDArray[Any]]) -> None:
        self.columns = columns

    def __len__(self) -> int:
        """Return the number of cases."""
        return len(self.columns["status"])

    @overload
    def __getitem__(self, case: int) -> dict[str, Any]: ...
    @overload
    def __getitem__(self, case: slice) -> list[dict[str, Any]]: ...
    def __getitem__(self, case: int | slice) -> Any:
        """Return numbers and words of a case by the names of `ROW`."""
        if isinstance(case, slice):
            return [self[i] for i in range(*case.indices(len(self)))]
        return {n: column[case].item() for n, column in self.columns.items()}


class Cases:
    """What a finished campaign keeps.

    Parameters
    ----------
    folder
        directory of the campaign

    Attributes
    ----------
    rows : one for each case: numbers and words by the names of `ROW`, and `status`
    kept : names of the traces there are; empty for `summary`
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.path = folder / "results.h5"
        check_file(self.path)
        self._plan = plan_of_results(self.path)
        with reading(self.path), h5py.File(self.path, "r") as file:
            table = ROW | STATUS
            lacking = [name for name in table if name not in file]
            if lacking:
                msg = f"{self.path} is damaged: it has no {lacking[0]}"
                raise StoreError(msg)
            columns = {
                n: words_in(file, n) if n in ENUMS else file[n][:] for n in table
            }
            self.kept = tuple(n for n in TRACES if n in file)
        count = len(self._plan.digests)
        if any(len(column) != count for column in columns.values()):
            msg = f"{self.path} and its campaign.json differ: gather the campaign again"
            raise StoreError(msg)
        self.rows = Rows(columns)

    def __len__(self) -> int:
        """Return the number of cases."""
        return len(self.rows)

    def scene(self, case: int) -> Scene:
        """Return the scene of a case, from the plan."""
        known = input_names()
        given = self._plan.base | self._plan.settings[case]
        return apply_settings(Scene(), {n: v for n, v in given.items() if n in known})

    def value(self, case: int, name: str) -> Any:
        """Return an input of a case by its name or its full dotted name."""
        dotted = full_name(name)
        return self._plan.settings[case].get(dotted, self._plan.base[dotted])

    def traces(self, case: int) -> Traces:
        """Return the traces of a case as `campaign.case.Result` has them.

        Raises
        ------
        InputError
            where the case gave no result or its campaign kept no traces
        """
        row = self.rows[case]
        if row["status"] != "ok" or not self.kept:
            msg = f"case {case} of {self.folder} has no traces: status {row['status']}"
            raise InputError(msg + f", kept: {', '.join(self.kept) or 'none'}")
        with reading(self.path), h5py.File(self.path, "r") as file:
            # a run that stopped did so between two samples
            count = int(row["end_time"] / row["sample_interval"] + WHOLE)
            out: Traces = {"time": (1.0 + np.arange(count)) * row["sample_interval"]}
            for name in self.kept:
                out[name] = file[name][case, :count]
        return out

    def like(self, case: int) -> list[int]:
        """Return the finished cases that differ from one in speed alone, by speed."""
        own, speeds = self._others(case), self.rows.columns["speed"]
        same = [i for i in self.finished() if self._others(i) == own]
        return sorted(same, key=lambda i: float(speeds[i]))

    def slices(self) -> list[list[int]]:
        """Return the finished cases, those alike but for speed together, by speed."""
        found: dict[str, list[int]] = {}
        for case in self.finished():
            key = json.dumps(self._others(case), sort_keys=True)
            found.setdefault(key, []).append(case)
        speeds = self.rows.columns["speed"]
        return [sorted(line, key=lambda i: float(speeds[i])) for line in found.values()]

    def finished(self) -> list[int]:
        """Return the cases that gave a result."""
        found = np.flatnonzero(self.rows.columns["status"] == "ok")
        return [int(i) for i in found]

    def inputs(self) -> dict[str, NDArray[Any]]:
        """Return {variable: (cases,)} of the swept inputs, as the file names them."""
        swept = {variable_name(dotted): dotted for dotted in self._plan.swept}
        base, settings = self._plan.base, self._plan.settings
        return {
            name: np.array([plain(row.get(dotted, base[dotted])) for row in settings])
            for name, dotted in swept.items()
        }

    def _others(self, case: int) -> dict[str, Any]:
        settings = self._plan.settings[case]
        return {n: v for n, v in settings.items() if n != "speed"}

    def others(self, case: int, sign: str = " = ", but: Sequence[str] = ()) -> str:
        """Return the swept inputs of a case but its speed, for a title or a name."""
        own = ((n.rsplit(".", 1)[-1], v) for n, v in self._others(case).items())
        return ", ".join(f"{name}{sign}{v}" for name, v in own if name not in but)
