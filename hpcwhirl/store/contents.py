"""What a results file will hold: the plan, where each record lies, the sizes needed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.refinement.boundary import EVIDENCE
from hpcwhirl.refinement.rule import rule_of
from hpcwhirl.scene.quantities import PERFORMANCE, ROW, STATUS, TRACES, variable_name
from hpcwhirl.scene.quantity import Quantity
from hpcwhirl.store.blades import blade_quantities, tuned_cases
from hpcwhirl.store.current import source_of
from hpcwhirl.store.journal import Record, read_at, whole_records
from hpcwhirl.store.manifest import Manifest
from hpcwhirl.store.measured import bytes_measured
from hpcwhirl.store.neighbours import at_boundary
from hpcwhirl.store.refined import columns_of, full_plan
from hpcwhirl.store.rows import place_of, word_of
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
    twins : (cases, twins, 2), the same of the twins of each case
    samples : (cases,), of its traces
    sizes : {axis: most that any case has of it}, of what traces have beside samples
    kept : names of the traces that any case has, in the order of `TRACES`
    interval : (cases,), s between samples, NaN for none
    shares : what each rank of each run did
    columns : {variable: (cases,)}, of the cases of a refined campaign
    found : {variable: (cases,)}, words and evidence of the same
    source : what this was read from, see `current`
    """

    folder: Path
    plan: Manifest
    journals: list[str] = field(default_factory=list)
    place: NDArray[np.int64] = field(init=False)
    twins: NDArray[np.int64] = field(init=False)
    samples: NDArray[np.int64] = field(init=False)
    interval: NDArray[np.float64] = field(init=False)
    sizes: dict[str, int] = field(default_factory=dict)
    kept: tuple[str, ...] = ()
    shares: list[Share] = field(default_factory=list)
    columns: dict[str, NDArray[Any]] = field(default_factory=dict)
    found: dict[str, NDArray[Any]] = field(default_factory=dict)
    source: str = ""

    def __post_init__(self) -> None:
        self.place = np.full((self.cases, 2), -1)
        count = int(self.plan.twins.get("count", 0))
        self.twins = np.full((self.cases, count, 2), -1)
        self.samples = np.zeros(self.cases, dtype=np.int64)
        self.interval = np.full(self.cases, np.nan)

    @property
    def cases(self) -> int:
        """Number of cases."""
        return len(self.plan.digests)

    @cached_property
    def blades(self) -> dict[str, Quantity]:
        """Variables of blades."""
        return blade_quantities(self.plan)

    @cached_property
    def tuned(self) -> dict[int, int]:
        """The tuned case beside each one that has such a one."""
        return tuned_cases(self.plan)

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
        each = row * (1 + self.twins.shape[1])
        each += bytes_measured(self.plan) + 8 * len(self.blades)
        return int(self.cases * (each + self.bytes_of_traces()))

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
    contents = _begun(folder, say)
    case_of = {digest: case for case, digest in enumerate(contents.plan.digests)}
    numbers: dict[str, int] = {}
    traces: dict[int, dict[str, Any]] = {}
    shapes_seen: dict[str, dict[str, Any]] = {}
    words = np.full(contents.cases, "", dtype="U16")
    for place, start, record in _counted(contents, case_of):
        at = numbers.setdefault(place.file, len(numbers)), start
        if place.twin:
            contents.twins[place.case, place.twin - 1] = at
            continue
        case = place.case
        contents.place[case], words[case] = at, word_of(record)
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
    _tell_refined(contents)
    plan = contents.plan
    if plan.twins.get("of") == "boundary":
        contents.twins[~at_boundary(plan.settings, plan.swept, words.tolist())] = -1
    kinds = list({id(kind): kind for kind in traces.values()}.values())
    contents.kept = tuple(n for n in TRACES if any(n in kind for kind in kinds))
    contents.sizes = sizes_of(kinds)
    return contents


def _begun(folder: Path, say: Callable[[str], None] | None) -> Contents:
    source = source_of(folder)  # before it is read: what comes later is not in it
    shares = read_runs(folder, say)
    return Contents(folder, full_plan(folder), shares=shares, source=source)


def _tell_refined(contents: Contents) -> None:
    """Add what the results of a refined campaign have beside."""
    contents.columns = columns_of(contents.plan)
    if contents.columns:
        contents.found = _evidence(contents)


def _evidence(contents: Contents) -> dict[str, NDArray[Any]]:
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


class _Found(NamedTuple):
    """Of what a record of a journal is."""

    case: int
    twin: int
    file: str


def _counted(
    contents: Contents, case_of: Mapping[str, int]
) -> Iterator[tuple[_Found, int, Record]]:
    """Yield of what, byte, record; of those of one case or twin the last one counts."""
    stages: dict[tuple[int, int], int] = {}  # later ones than the first, see `rows`
    for path, start, record in whole_records(contents.folder):
        name, twin, stage = place_of(record, contents.plan)
        case = case_of.get(name)
        if case is not None and stage >= stages.get((case, twin), 0):
            if stage:
                stages[case, twin] = stage
            yield _Found(case, twin, path.name), start, record


def records_of(contents: Contents, cases: range, twin: int = 0) -> dict[int, Record]:
    """Return {case: its newest whole record}, or its twin's, of those that have one."""
    own = contents.twins[:, twin - 1] if twin else contents.place
    place = own[cases.start : cases.stop]
    found: dict[int, Record] = {}
    for number in np.unique(place[:, 0][place[:, 0] >= 0]):
        mine = np.flatnonzero(place[:, 0] == number)
        path = contents.folder / "journal" / contents.journals[number]
        lines = read_at(path, [int(place[i, 1]) for i in mine])
        found |= {cases.start + int(i): r for i, r in zip(mine, lines, strict=True)}
    return found
