"""What a results file will be gathered from: plan, places of records, sizes of axes.

Whether an existing `results.h5` is up to date is known without reading the journals:
the group `performance` of the file stores its sources: the plan, and names, sizes and
times of journals, traces and `runs/`. The file must be gathered again if one of these
or the thresholds of the words have changed, or if size and time of `results.h5` differ
from those in the stamp file, because another program has written to it. Copying a
directory may change times, which costs one gathering.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl import __version__
from hpcwhirl.errors import WhirlError
from hpcwhirl.refinement.rule import rule_of
from hpcwhirl.refinement.words import ATTRACTOR, NUMBERS
from hpcwhirl.safe_open import read_regular
from hpcwhirl.scene.quantities import PERFORMANCE, ROW, STATUS, TRACES, variable_name
from hpcwhirl.scene.units import Quantity
from hpcwhirl.scene.words import REGIMES
from hpcwhirl.store.atomic import Say, write_whole
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.directory.completions import CaseIndex, stages_in
from hpcwhirl.store.directory.journal import Journals
from hpcwhirl.store.directory.manifest import Manifest
from hpcwhirl.store.directory.reader import Rows, rows_at, samples_of
from hpcwhirl.store.directory.record import Header
from hpcwhirl.store.directory.refined import columns_of, full_plan, with_twins
from hpcwhirl.store.directory.runs import Share
from hpcwhirl.store.hdf5 import DAMAGE, dtype
from hpcwhirl.store.reading.results_file import opened
from hpcwhirl.store.reading.shares import words_of
from hpcwhirl.store.results.variables import asked_quantities, measured_of, tuned_cases

NAMED = ("status", "row.outcome", "row.regime")  # fields that decide the word of a case
SOURCE = "gathered_from"  # attribute of the group `performance`
STAMP = "results.stamp"  # in `runs`


@dataclass
class Contents:
    """What results are gathered from: plan, where records are, and sizes of traces.

    It takes some 50 bytes for each case.

    Attributes
    ----------
    journals, plan : journals and plan of the campaign
    files : (file, header) of each journal
    place : (cases, 1 + twins, 2), for each case and twin: index in `files` of the
        journal, -1 without a record, and first byte of the record
    samples : (cases,), number of samples of the traces
    sizes : {axis: largest size in any case}, axes of traces other than samples
    kept : names of the traces of any case, in the order of `TRACES`
    interval : (cases,), s between samples, NaN without samples
    shares : use of time of each rank of each run
    columns : {variable: (cases,)}, additional variables of a refined campaign
    found : {variable: (cases,)}, words and refined inputs of a refined campaign
    source : digest of the files read, see `source_of`
    """

    journals: Journals
    plan: Manifest
    files: list[tuple[Path, Header]] = field(default_factory=list)
    place: NDArray[np.int64] = field(init=False)
    samples: NDArray[np.int64] = field(init=False)
    interval: NDArray[np.float64] = field(init=False)
    sizes: dict[str, int] = field(default_factory=dict)
    kept: tuple[str, ...] = ()
    shares: list[Share] = field(default_factory=list)
    columns: dict[str, NDArray[Any]] = field(default_factory=dict)
    found: dict[str, NDArray[Any]] = field(default_factory=dict)
    source: str = ""

    def __post_init__(self) -> None:
        self.place = np.full((self.cases, 1 + self.twins, 2), -1)
        self.samples = np.zeros(self.cases, dtype=np.int64)
        self.interval = np.full(self.cases, np.nan)

    @property
    def cases(self) -> int:
        """Number of cases in the results."""
        return len(self.plan.digests)

    @property
    def twins(self) -> int:
        """Number of twins of each case that has twins."""
        return int(self.plan.twins.get("count", 0))

    @cached_property
    def asked(self) -> dict[str, Quantity]:
        """{variable: unit and meaning} of variables that only some inputs ask for."""
        return asked_quantities(self.plan)

    @cached_property
    def tuned(self) -> dict[int, int]:
        """{case: the case with equal blades that has the same other inputs}."""
        return tuned_cases(self.plan)

    @property
    def common_interval(self) -> float | None:
        """Time between samples of traces, s, if the same in all cases; else None."""
        found = np.unique(self.interval[np.isfinite(self.interval)])
        return float(found[0]) if len(found) == 1 else None

    def trace_shapes(self) -> dict[str, tuple[int, ...]]:
        """Return {trace: shape of its array for one case} in the results.

        Shorter traces are padded to the longest.
        """
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
        """Bytes of numbers and traces: a lower limit of the size of results.h5."""
        row, own = (
            sum(dtype(quantity).itemsize for quantity in table.values())
            for table in (ROW | STATUS | PERFORMANCE, measured_of(self.plan))
        )
        each = row * (1 + self.twins) + own + 8 * len(self.asked)
        return int(self.cases * (each + self.bytes_of_traces()))

    def bytes_of_traces(self) -> int:
        """Return the bytes that the traces of one case take in the results."""
        return sum(8 * int(np.prod(shape)) for shape in self.trace_shapes().values())


def kept_of(kinds: Sequence[Mapping[str, tuple[int, ...]]]) -> tuple[str, ...]:
    """Return the names of the traces of any kind of case, in the order of `TRACES`.

    kinds : {trace: its shape without the axis of samples}, for each kind of case
    """
    return tuple(name for name in TRACES if any(name in kind for kind in kinds))


def sizes_of(kinds: Iterable[Mapping[str, tuple[int, ...]]]) -> dict[str, int]:
    """Return the largest size of each axis of traces, other than samples.

    kinds : {trace: its shape without the axis of samples}, for each kind of case
    """
    sizes: dict[str, int] = {}
    for kind in kinds:
        for name in kind.keys() & TRACES.keys():
            for axis, size in zip(TRACES[name].axes, kind[name], strict=True):
                sizes[axis] = max(sizes.get(axis, 0), size)
    return sizes


def contents_of(directory: Directory, say: Say | None = None) -> Contents:
    """Return what results are gathered from, after reading the journals once.

    Parameters
    ----------
    directory : the campaign's directory
    say : prints one line about damaged files on which no result depends; None: silent
    """
    source = source_of(directory)  # first, so that later changes are noticed
    shares, plan = directory.runs.shares(say), full_plan(directory)
    contents = Contents(directory.journals, plan, shares=shares, source=source)
    index = _Index(contents)
    for rows in directory.journals.rows():
        index.take(rows)
    contents.columns = columns_of(contents.plan)
    if contents.columns:
        contents.found = _spoken(contents)
    if contents.plan.twins:
        contents.place[~with_twins(contents.plan, index.words.tolist()), 1:] = -1
    kinds = [index.kinds[number] for number in np.unique(index.kind) if number >= 0]
    contents.kept = kept_of(kinds)
    contents.sizes = sizes_of(kinds)
    return contents


def _spoken(contents: Contents) -> dict[str, NDArray[Any]]:
    """Return what the boundaries of a refined map follow from, {variable: (cases,)}.

    These are status, outcome, regime, whirl, the refined inputs and, where attractors
    are compared, their numbers; cases without a record are "missing".
    """
    plan, kinds = contents.plan, ("status", "outcome", "regime", "whirl")
    out: dict[str, NDArray[Any]] = {}
    for name in kinds:
        out[name] = np.full(contents.cases, "missing" if name == "status" else "none")
        out[name] = out[name].astype("U16")
    rule = rule_of(plan.refine)
    for name in rule.over:
        values = [row[name] for row in plan.settings]
        out[variable_name(name)] = np.array(values, dtype=float)
    numbers = NUMBERS if rule.words == ATTRACTOR else ()
    out |= {name: np.zeros(contents.cases) for name in numbers}
    for at, rows in parts_of(contents, range(contents.cases)):
        for name in kinds:
            own = rows.words(name if name == "status" else f"row.{name}")
            out[name][at] = own
        for name in numbers:
            out[name][at] = rows.numbers(f"row.{name}", 0.0)
    return out


class _Index:
    """Finds the newest record of each case and twin; enters its place in `Contents`.

    For an extended case, the newest record of the longest run with a result is taken.

    Parameters
    ----------
    contents : object that `take` fills
    """

    def __init__(self, contents: Contents) -> None:
        self.contents, self.plan = contents, contents.plan
        self.known = CaseIndex(contents.plan.digests)
        self.stages = np.zeros(contents.place.shape[:2], dtype=np.int8)
        self.kinds: list[dict[str, tuple[int, ...]]] = []  # distinct sets of traces
        self.kind = np.full(contents.cases, -1)  # index into kinds, of each case
        late = contents.plan.twins.get("of") in ("boundary", "even")
        width = "U16" if late else "U0"
        self.words = np.full(contents.cases, "", dtype=width)

    def take(self, rows: Rows) -> None:
        """Enter the file positions of a batch of records as the newest of their cases.

        rows : the records, newer than those entered before
        """
        contents, case = self.contents, self.known.cases_of(rows)
        twin, stage = rows.numbers("twin", 0), stages_in(rows, self.plan)
        good = (case >= 0) & (twin >= 0) & (twin <= contents.twins)
        good &= (stage == 0) | ((stage > 0) & (rows.words("status") == "ok"))
        which = np.flatnonzero(good)
        which = which[stage[which] >= self.stages[case[which], twin[which]]]
        which = which[np.argsort(stage[which], kind="stable")]
        key = case[which] * (1 + contents.twins) + twin[which]
        which = which[_last(key)]
        if not len(which):
            return
        rows, case, twin = rows.take(which), case[which], twin[which]
        self.stages[case, twin] = stage[which]
        contents.place[case, twin, 0] = self._number(rows)
        contents.place[case, twin, 1] = rows.starts
        own = np.flatnonzero(twin == 0)
        self._take_cases(case[own], rows.take(own))

    def _number(self, rows: Rows) -> int:
        """Return the index in `Contents.files` of the journal that has the records.

        The journal is appended unless it is the last: successive records of one journal
        get one index.
        """
        files = self.contents.files
        if not files or files[-1][0] != rows.journal:
            files.append((rows.journal, rows.header))
        return len(files) - 1

    def _take_cases(self, case: NDArray[np.int64], rows: Rows) -> None:
        """Note, from journal records, what the results file will hold of some cases.

        For each case: how many samples its traces have, the dimensions of their arrays,
        and the case's words.

        Parameters
        ----------
        case : (records,), number of each record's case
        rows : the records, each the stored result of one case
        """
        contents = self.contents
        contents.interval[case] = rows.numbers("row.sample_interval", np.nan)
        contents.samples[case], self.kind[case] = 0, -1
        for record in np.flatnonzero(rows.has_any("traces")).tolist():
            text = rows.texts[record]
            contents.samples[case[record]] = samples_of(text) or 0
            shapes = text["traces"]["shapes"].items()
            kind = {name: tuple(shape[1:]) for name, shape in shapes}
            if kind not in self.kinds:
                self.kinds.append(kind)
            self.kind[case[record]] = self.kinds.index(kind)
        if self.words.itemsize:
            words = words_of(*(rows.words(name).astype(str) for name in NAMED))
            self.words[case] = np.where(np.isin(words, list(REGIMES)), words, "")


def _last(keys: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the indices at which each different key occurs last, ascending.

    keys : (n,), for example one number for each case and twin
    """
    _, behind = np.unique(keys[::-1], return_index=True)
    return np.sort(len(keys) - 1 - behind)


def parts_of(
    contents: Contents, cases: Sequence[int], twin: int = 0
) -> Iterator[tuple[NDArray[np.int64], Rows]]:
    """Read the records of some cases, or of their twins, one journal at a time.

    Parameters
    ----------
    contents : what results are gathered from
    cases : numbers of the cases
    twin : number of the twin; 0: the cases themselves

    Yields
    ------
    indices into `cases` of the cases with a record in that journal; their records
    """
    place = contents.place[np.asarray(cases, dtype=np.int64), twin]
    for number in np.unique(place[:, 0][place[:, 0] >= 0]).tolist():
        mine = np.flatnonzero(place[:, 0] == number)
        path, header = contents.files[number]
        yield mine, rows_at(path, header, place[mine, 1])


def source_of(directory: Directory) -> str:
    """Return a text that changes when a file from which results are gathered changes.

    It is a digest of the plan, and of names, sizes and times of the other files; "" if
    one of them cannot be read.
    """
    told = [__version__, *ROW, *STATUS, *PERFORMANCE]
    try:
        told.append(hashlib.sha256(read_regular(directory.plan.path)).hexdigest())
        journals = directory.journals
        files = [*journals.files(), *journals.trace_files(), *directory.runs.files()]
        told += filter(None, map(_told, files))
    except (OSError, WhirlError):  # the error is raised when the file is read
        return ""
    return hashlib.sha256(os.fsencode("\n".join(told))).hexdigest()


def _told(path: Path) -> str:
    """Return name, size and time of a file as text; "" for an empty file.

    `source_of` and the stamp use it to notice changes.
    """
    state = path.stat()
    if not state.st_size:
        return ""
    return f"{path.parent.name}/{path.name} {state.st_size} {state.st_mtime_ns}"


def stamp(directory: Directory) -> None:
    """Write size and time of the results just gathered into the file of the stamp.

    Another program that writes to results.h5 is noticed by it.
    """
    with suppress(WhirlError):  # without a stamp, results are gathered again
        told = _told(directory.results).encode()
        write_whole(directory.runs.place / STAMP, told, parents=False)


def is_stamped(directory: Directory) -> bool:
    """Return whether results.h5 is as it was gathered: nobody has changed it since."""
    try:
        found = read_regular(directory.runs.place / STAMP)
        return found == _told(directory.results).encode()
    except (OSError, WhirlError):
        return False


def is_current(directory: Directory, words: Mapping[str, float]) -> bool:
    """Return whether results.h5 is up to date, so that it need not be gathered again.

    Parameters
    ----------
    directory : the campaign's directory
    words : {root attribute: threshold} in use
    """
    try:
        with opened(directory.results) as file:
            same = all(file.attrs.get(n) == limit for n, limit in words.items())
            known = bytes(file["performance"].attrs.get(SOURCE, b"")).decode()
        same = same and known != "" and is_stamped(directory)
        return bool(same and known == source_of(directory))
    except (WhirlError, KeyError, *DAMAGE):
        return False
