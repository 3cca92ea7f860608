"""What a results file will hold: the plan, where each record lies, the sizes needed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.refinement.boundary import EVIDENCE
from hpcwhirl.refinement.rule import rule_of
from hpcwhirl.scene.quantities import PERFORMANCE, ROW, STATUS, TRACES, variable_name
from hpcwhirl.scene.quantity import Quantity
from hpcwhirl.scene.words import REGIMES
from hpcwhirl.store.directory.blades import blade_quantities, tuned_cases
from hpcwhirl.store.directory.journal import Record, lines_at, read_at
from hpcwhirl.store.directory.lines import OWN, USUAL
from hpcwhirl.store.directory.manifest import Manifest
from hpcwhirl.store.directory.many import CASE, Chunk, Known, chunks, read
from hpcwhirl.store.directory.refined import columns_of, full_plan, with_twins
from hpcwhirl.store.directory.rows import place_of, regime_of
from hpcwhirl.store.directory.runs import Share, read_runs
from hpcwhirl.store.reading.shown import words_of
from hpcwhirl.store.results.current import source_of
from hpcwhirl.store.results.measured import bytes_measured, measured_of
from hpcwhirl.store.schema import dtype

FIELDS = ("row.sample_interval", "row.outcome", "row.regime")


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

    @cached_property
    def is_plain(self) -> bool:
        """Whether rows have no more than packed lines tell."""
        beside = self.blades or measured_of(self.plan) or self.plan.twins
        return not beside

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
    index = _Index(_begun(folder, say))
    contents = index.contents
    for chunk in chunks(folder, index.known, FIELDS):
        done, name = 0, chunk.journal.name
        for line, record in chunk.others:
            until = int(np.searchsorted(chunk.at, line))
            index.take_packed(chunk, slice(done, until))
            index.take(name, int(chunk.starts[line]), record)
            done = until
        index.take_packed(chunk, slice(done, None))
    contents.journals = list(index.journals)
    _tell_refined(contents)
    if contents.plan.twins:
        contents.twins[~with_twins(contents.plan, index.words.tolist())] = -1
    kinds = list({id(kind): kind for kind in index.traces.values()}.values())
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


class _Index:
    """Takes in records, the oldest first: of those of one case the last one counts.

    Parameters
    ----------
    contents : to be filled
    """

    def __init__(self, contents: Contents) -> None:
        self.contents, self.plan = contents, contents.plan
        self.known = Known(contents.plan.digests)
        self.journals: dict[str, int] = {}
        self.traces: dict[int, dict[str, Any]] = {}  # of a case
        self.stages: dict[tuple[int, int], int] = {}  # later than the first, see `rows`
        self.seen: dict[str, dict[str, Any]] = {}
        width = "U16" if contents.plan.twins.get("of") == "boundary" else "U0"
        self.words = np.full(contents.cases, "", dtype=width)

    def take_packed(self, chunk: Chunk, run: slice) -> None:
        """Take in packed lines, which are of cases as planned, without traces."""
        cases = chunk.fields[CASE][run]
        own = cases >= 0
        if self.stages:
            known = ((case, 0) in self.stages for case in cases.tolist())
            own &= ~np.fromiter(known, bool, len(cases))
        if not own.any():
            return
        interval, outcome, regime = (chunk.fields[n][run][own] for n in FIELDS)
        cases, journal = cases[own], chunk.journal.name
        number = self.journals.setdefault(journal, len(self.journals))
        contents, starts = self.contents, chunk.starts[chunk.at[run]][own]
        contents.place[cases] = np.column_stack([np.full(len(cases), number), starts])
        contents.interval[cases] = interval
        contents.samples[cases] = 0
        for case in self.traces.keys() & set(cases.tolist() if self.traces else ()):
            del self.traces[case]
        if self.words.itemsize:
            words = words_of(np.array(USUAL["status"]), outcome, regime)
            self.words[cases] = np.where(np.isin(words, list(REGIMES)), words, "")

    def take(self, journal: str, start: int, record: Record) -> None:
        """Take in a record."""
        name, twin, stage = place_of(record, self.plan)
        case = self.known.find(name, record.get("case"))
        if case < 0 or stage < self.stages.get((case, twin), 0):
            return
        if stage:
            self.stages[case, twin] = stage
        at = self.journals.setdefault(journal, len(self.journals)), start
        if twin:
            self.contents.twins[case, twin - 1] = at
            return
        contents = self.contents
        contents.place[case], self.words[case] = at, regime_of(record)
        row = record.get("row") or {}
        contents.interval[case] = row.get("sample_interval", np.nan)
        self.traces.pop(case, None)
        contents.samples[case] = 0
        if record.get("traces"):
            shapes = record["traces"]["shapes"]
            contents.samples[case] = shapes["time"][0]
            kind = {name: tuple(shape[1:]) for name, shape in shapes.items()}
            self.traces[case] = self.seen.setdefault(str(kind), kind)  # one, shared


def packed_of(
    contents: Contents, cases: range
) -> tuple[NDArray[np.int64], NDArray[Any], dict[int, Record]]:
    """Return what is known of some cases: of packed lines as columns.

    Returns
    -------
    at : (m,), those of the cases that have packed lines, by their place among these
    numbers : (m,), see `many`
    records : {case: its newest whole record}, of the others that have one
    """
    ats, parts, records = [], [], dict[int, Record]()
    for path, mine, starts in _places(contents, cases):
        own, numbers = read(lines_at(path, starts.tolist()))
        ats.append(mine[own])
        parts.append(numbers)
        rest = np.setdiff1d(np.arange(len(mine)), own, assume_unique=True)
        found = read_at(path, starts[rest].tolist())
        both = zip(mine[rest].tolist(), found, strict=True)
        records |= {cases.start + i: record for i, record in both}
    if not ats:
        return np.zeros(0, np.int64), np.zeros(0, OWN.dtype), records
    return np.concatenate(ats), np.concatenate(parts), records


def _places(
    contents: Contents, cases: range, twin: int = 0
) -> Iterator[tuple[Path, NDArray[np.int64], NDArray[np.int64]]]:
    """Yield (journal, which of the cases are there, bytes where their lines begin)."""
    own = contents.twins[:, twin - 1] if twin else contents.place
    place = own[cases.start : cases.stop]
    for number in np.unique(place[:, 0][place[:, 0] >= 0]):
        mine = np.flatnonzero(place[:, 0] == number)
        path = contents.folder / "journal" / contents.journals[number]
        yield path, mine, place[mine, 1]


def records_of(contents: Contents, cases: range, twin: int = 0) -> dict[int, Record]:
    """Return {case: its newest whole record}, or its twin's, of those that have one."""
    found: dict[int, Record] = {}
    for path, mine, starts in _places(contents, cases, twin):
        lines = read_at(path, starts.tolist())
        found |= {cases.start + int(i): r for i, r in zip(mine, lines, strict=True)}
    return found
