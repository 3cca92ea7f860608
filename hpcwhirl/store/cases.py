"""A campaign directory case by case: its rows at once, traces one case at a time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import InputError, StoreError
from hpcwhirl.scene import Scene, apply_settings, input_names
from hpcwhirl.scene.files import resolve
from hpcwhirl.store.hdf5 import reading
from hpcwhirl.store.plan import read_plan
from hpcwhirl.store.reader import check_file
from hpcwhirl.store.schema import ENUMS, ROW, STATUS, TRACES

Traces = dict[str, NDArray[np.float64]]


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
        self._plan = read_plan(folder)
        with reading(self.path), h5py.File(self.path, "r") as file:
            table = ROW | STATUS
            lacking = [name for name in table if name not in file]
            if lacking:
                msg = f"{self.path} is damaged: it has no {lacking[0]}"
                raise StoreError(msg)
            columns = {n: file[n][:] for n in table}
            self.kept = tuple(n for n in TRACES if n in file)
            for name in columns.keys() & ENUMS.keys():
                columns[name] = np.array(ENUMS[name])[columns[name]]
        count = len(self._plan.digests)
        if any(len(column) != count for column in columns.values()):
            msg = f"{self.path} and its campaign.json differ: gather the campaign again"
            raise StoreError(msg)
        self.rows = [{n: c[i].item() for n, c in columns.items()} for i in range(count)]

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
        dotted = resolve(name)
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
            count = round(row["end_time"] / row["sample_interval"])
            out: Traces = {"time": (1.0 + np.arange(count)) * row["sample_interval"]}
            for name in self.kept:
                out[name] = file[name][case, :count]
        return out

    def like(self, case: int) -> list[int]:
        """Return the finished cases that differ from one in speed alone, by speed."""
        own = self._others(case)
        same = [
            i for i, row in enumerate(self.rows)
            if row["status"] == "ok" and self._others(i) == own
        ]  # fmt: skip
        return sorted(same, key=lambda i: float(self.rows[i]["speed"]))

    def _others(self, case: int) -> dict[str, Any]:
        settings = self._plan.settings[case]
        return {n: v for n, v in settings.items() if n != "speed"}

    def others(self, case: int) -> str:
        """Return the swept inputs of a case but its speed, for a title."""
        parts = (f"{n.rsplit('.', 1)[-1]} = {v}" for n, v in self._others(case).items())
        return ", ".join(parts)
