"""What a finished campaign holds, column by column, and its traces case by case."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import StoreError
from hpcwhirl.scene.quantities import PERFORMANCE, ROW, STATUS, TRACES
from hpcwhirl.scene.words import ENUMS
from hpcwhirl.store.directory.refined import plan_of_results
from hpcwhirl.store.hdf5 import reading
from hpcwhirl.store.reading.cases import WHOLE
from hpcwhirl.store.reading.reader import check_file, words_in

Traces = dict[str, NDArray[np.float64]]
BLOCK = 4_000_000  # bytes of traces read at once, or those of one case


class Excerpt:
    """The columns of a campaign's results; no trace is read until asked for.

    Parameters
    ----------
    folder
        directory of a finished campaign

    Attributes
    ----------
    path : its `results.h5`
    plan : its plan
    columns : {variable: (cases,)}, words and texts as `str`
    facts : root attributes
    kept : names of the traces there are
    """

    def __init__(self, folder: Path) -> None:
        self.path = folder / "results.h5"
        check_file(self.path)
        self.plan = plan_of_results(self.path)
        with reading(self.path), h5py.File(self.path, "r") as file:
            self.facts = {n: _plain(v) for n, v in file.attrs.items()}
            self.columns = _columns(file)
            self.kept = tuple(n for n in TRACES if n in file)
        if any(len(c) != len(self) for c in self.columns.values()):
            msg = f"{self.path} and its campaign.json differ: gather the campaign again"
            raise StoreError(msg)

    def __len__(self) -> int:
        """Return the number of cases."""
        return len(self.plan.digests)

    def settings(self, case: int) -> dict[str, Any]:
        """Return {dotted input: value} of all inputs of a case."""
        return self.plan.base | self.plan.settings[case]

    def traces(
        self, cases: Sequence[int], names: Sequence[str]
    ) -> Iterator[tuple[int, Traces]]:
        """Yield (case, its traces and their `time`), a few cases in memory at a time.

        Parameters
        ----------
        cases : that gave a result, ascending
        names : of the traces wanted, all of them kept
        """
        if not len(cases):  # there may be no traces at all
            return
        with reading(self.path), h5py.File(self.path, "r") as file:
            yield from self._read({n: file[n] for n in names}, cases)

    def _read(
        self, data: dict[str, h5py.Dataset], cases: Sequence[int]
    ) -> Iterator[tuple[int, Traces]]:
        interval, end = self.columns["sample_interval"], self.columns["end_time"]
        each = sum(8 * int(np.prod(d.shape[1:])) for d in data.values())
        for block in _blocks(cases, max(BLOCK // max(each, 1), 1)):
            read = {n: d[block[0] : block[-1] + 1] for n, d in data.items()}
            for case in block:
                count = int(end[case] / interval[case] + WHOLE)
                own = {n: r[case - block[0], :count] for n, r in read.items()}
                yield case, {"time": (1.0 + np.arange(count)) * interval[case]} | own

    def digest(self) -> str:
        """Return a digest of rows and thresholds: another one after `classify`."""
        found = hashlib.sha256()
        for name in sorted(ROW | STATUS):
            found.update(self.columns[name].tobytes())
        limits = {n: v for n, v in self.facts.items() if n.startswith("threshold_")}
        found.update(repr(sorted(limits.items())).encode())
        return found.hexdigest()


def _blocks(cases: Sequence[int], most: int) -> Iterator[list[int]]:
    """Yield runs of neighbours that span at most `most` cases."""
    block: list[int] = []
    for case in cases:
        if block and (case - block[0] >= most or case - block[-1] > 2):
            yield block
            block = []
        block.append(case)
    if block:
        yield block


def _plain(value: Any) -> str | float:
    """Return an attribute as text or number."""
    value = value.item() if hasattr(value, "item") else value
    return value.decode(errors="replace") if isinstance(value, bytes) else value


def _columns(file: h5py.File) -> dict[str, NDArray[Any]]:
    columns = {n: file[n][:] for n in ROW | STATUS}
    columns |= {n: file["performance"][n][:] for n in PERFORMANCE}
    for name, column in columns.items():
        if name in ENUMS:
            columns[name] = words_in(file, name)
        elif column.dtype.kind == "S":
            columns[name] = np.char.decode(column, errors="replace")
    return columns
