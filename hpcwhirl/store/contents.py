"""What a results file will hold: the plan, where each record lies, the sizes needed."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.refinement.boundary import EVIDENCE
from hpcwhirl.refinement.rule import rule_of
from hpcwhirl.scene.quantities import PERFORMANCE, ROW, STATUS, TRACES, variable_name
from hpcwhirl.store.journal import Record, read_at, whole_records
from hpcwhirl.store.manifest import Manifest
from hpcwhirl.store.measured import bytes_measured
from hpcwhirl.store.refined import columns_of, full_plan
from hpcwhirl.store.rows import stage_of
from hpcwhirl.store.runs import Share, read_runs
from hpcwhirl.store.schema import dtype


@dataclass
class Contents:
    """Index of a campaign: some 50 bytes a case, whatever its traces.

    Attributes
    ----------
    folder, plan : the campaign
    journals : their names
    place : (cases, 2), number of the journal, -1 for none, and byte of the record
    samples : (cases,), of its traces
    sizes : {axis: most that any case has of it}, of what traces have beside samples
    kept : names of the traces that any case has, in the order of `TRACES`
    interval : (cases,), s between samples, NaN for none
    shares : what each rank of each run did
    columns : {variable: (cases,)}, of the cases of a refined campaign
    found : {variable: (cases,)}, words and evidence of the same
    """

    folder: Path
    plan: Manifest
    journals: list[str] = field(default_factory=list)
    place: NDArray[np.int64] = field(init=False)
    samples: NDArray[np.int64] = field(init=False)
    interval: NDArray[np.float64] = field(init=False)
    sizes: dict[str, int] = field(default_factory=dict)
    kept: tuple[str, ...] = ()
    shares: list[Share] = field(default_factory=list)
    columns: dict[str, NDArray[Any]] = field(default_factory=dict)
    found: dict[str, NDArray[Any]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.place = np.full((self.cases, 2), -1)
        self.samples = np.zeros(self.cases, dtype=np.int64)
        self.interval = np.full(self.cases, np.nan)

    @property
    def cases(self) -> int:
        """Number of cases."""
        return len(self.plan.digests)

    @property
    def common_interval(self) -> float | None:
        """Seconds between samples where all cases share them, else None."""
        found = np.unique(self.interval[np.isfinite(self.interval)])
        return float(found[0]) if len(found) == 1 else None

    @property
    def sample_axis(self) -> str:
        """Name of the trace axis: `time` if all cases share it, else `sample`."""
        return "time" if self.common_interval is not None else "sample"

    def trace_shapes(self) -> dict[str, tuple[int, ...]]:
        """Return {trace: shape of one case, padded to the longest}."""
        longest = int(self.samples.max(initial=0))
        shapes = {
            name: (longest, *(self.sizes[axis] for axis in TRACES[name].axes))
            for name in self.kept
        }
        if self.kept and self.common_interval is None:
            shapes["time"] = (longest,)
        return shapes

    @property
    def size(self) -> int:
        """Bytes of rows and traces, the least that the file will have."""
        tables = (ROW | STATUS | PERFORMANCE).values()
        row = sum(dtype(quantity).itemsize for quantity in tables)
        row += bytes_measured(self.plan)
        return self.cases * (row + self.bytes_of_traces())

    def bytes_of_traces(self) -> int:
        """Return the bytes that the traces of one case take."""
        return sum(8 * int(np.prod(shape)) for shape in self.trace_shapes().values())


def sizes_of(kinds: Iterable[dict[str, tuple[int, ...]]]) -> dict[str, int]:
    """Return {axis: most of it}, from {trace: shape without samples} of some cases."""
    sizes: dict[str, int] = {}
    for kind in kinds:
        for name in kind.keys() & TRACES.keys():
            for axis, size in zip(TRACES[name].axes, kind[name], strict=True):
                sizes[axis] = max(sizes.get(axis, 0), size)
    return sizes


def contents_of(folder: Path, say: Callable[[str], None] | None = None) -> Contents:
    """Return the index of a campaign directory; reads its journals once.

    Parameters
    ----------
    folder : the campaign's directory
    say : told what is left out that no result depends on
    """
    contents = Contents(folder, full_plan(folder), shares=read_runs(folder, say))
    case_of = {digest: case for case, digest in enumerate(contents.plan.digests)}
    numbers: dict[str, int] = {}
    traces: dict[int, dict[str, Any]] = {}
    shapes_seen: dict[str, dict[str, Any]] = {}
    rank: dict[int, int] = {}  # of the stage that a case's row is of, see `stage_of`
    for path, start, record in whole_records(folder):
        stage, name = stage_of(record, contents.plan)
        case = case_of.get(name)
        if case is None or stage < rank.get(case, 0):
            continue
        if stage:
            rank[case] = stage
        contents.place[case] = numbers.setdefault(path.name, len(numbers)), start
        row = record.get("row") or {}
        contents.interval[case] = row.get("sample_interval", np.nan)
        traces.pop(case, None)
        contents.samples[case] = 0
        if record.get("traces"):
            shapes = record["traces"]["shapes"]
            contents.samples[case] = shapes["time"][0]
            kind = {name: tuple(shape[1:]) for name, shape in shapes.items()}
            traces[case] = shapes_seen.setdefault(str(kind), kind)  # one, shared
    contents.journals = list(numbers)
    contents.columns = columns_of(contents.plan)
    if contents.columns:
        contents.found = _found(contents)
    kinds = list({id(kind): kind for kind in traces.values()}.values())
    contents.kept = tuple(n for n in TRACES if any(n in kind for kind in kinds))
    contents.sizes = sizes_of(kinds)
    return contents


def _found(contents: Contents) -> dict[str, NDArray[Any]]:
    """Return what the boundaries of a refined campaign are found from, by variable."""
    plan, kinds = contents.plan, ("status", "outcome", "regime", "whirl")
    out: dict[str, NDArray[Any]] = {}
    for name in kinds:
        out[name] = np.full(contents.cases, "missing" if name == "status" else "none")
        out[name] = out[name].astype("U16")
    for name in EVIDENCE:
        out[name] = np.full(contents.cases, np.nan)
    for name in rule_of(plan.refine).over:
        values = [row[name] for row in plan.settings]
        out[variable_name(name)] = np.array(values, dtype=float)
    for case, record in records_of(contents, range(contents.cases)).items():
        out["status"][case] = record["status"]
        for name, value in (record.get("row") or {}).items():
            if name in (*kinds, *EVIDENCE):
                out[name][case] = value
    return out


def records_of(contents: Contents, cases: range) -> dict[int, Record]:
    """Return {case: its newest whole record} of those that have one."""
    place = contents.place[cases.start : cases.stop]
    found: dict[int, Record] = {}
    for number in np.unique(place[:, 0][place[:, 0] >= 0]):
        mine = np.flatnonzero(place[:, 0] == number)
        path = contents.folder / "journal" / contents.journals[number]
        lines = read_at(path, [int(place[i, 1]) for i in mine])
        found |= {cases.start + int(i): r for i, r in zip(mine, lines, strict=True)}
    return found
