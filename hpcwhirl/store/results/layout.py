"""Create `results.h5` with all dimensions, variables and attributes, still empty.

From this and the plan the size of a campaign's files is predicted.

The file is netCDF-4: every axis is a dimension scale. A refined campaign also has the
groups `cells` and `boundaries`, see `store.results.cells`.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import StoreError
from hpcwhirl.scene.quantities import (
    AXES,
    INPUTS,
    PERFORMANCE,
    ROW,
    SHARES,
    STATUS,
    TRACES,
    variable_name,
)
from hpcwhirl.scene.table import listed
from hpcwhirl.scene.units import Quantity
from hpcwhirl.scene.words import ENUMS
from hpcwhirl.store.directory.journal import Journals
from hpcwhirl.store.directory.manifest import MEASURE, Manifest
from hpcwhirl.store.directory.record import fields_of, header_of
from hpcwhirl.store.directory.refined import refined_quantities
from hpcwhirl.store.directory.runs import Share
from hpcwhirl.store.hdf5 import (
    FORMAT,
    define_axis,
    dtype,
    encode,
    mark_words,
    missing,
    tell,
    utf8,
)
from hpcwhirl.store.reading.coded import Coded
from hpcwhirl.store.reading.shares import GROUP, SHARE, SURE, TWIN, TWIN_ROW, TWINS_OF
from hpcwhirl.store.results.cells import define_cells
from hpcwhirl.store.results.contents import SOURCE, Contents, kept_of, sizes_of
from hpcwhirl.store.results.sampled import sample_attribute
from hpcwhirl.store.results.variables import (
    DETAIL,
    asked_quantities,
    measured_of,
)

LIBVER = ("v108", "v110")  # from 1.8 on attributes may exceed 64 kB
CHUNK = 1 << 20  # bytes, largest size of a compressed chunk, which is of one case
CONVENTIONS = "CF-1.11"  # 64-bit integers need 1.9
# Without date and host, so that the bits do not depend on them.
HISTORY = (
    "cases integrated and gathered by hpcwhirl, see version and command; "
    "words determined by the thresholds in threshold_*"
)
WORKER = "worker"  # dimension: the ranks of all runs


def swept_extra(plan: Manifest) -> dict[str, str]:
    """Return {variable: dotted name} of swept inputs that `ROW` does not have.

    Each gets a variable of its own in the results; `ROW` lists those of all results.
    """
    names = {variable_name(dotted): dotted for dotted in plan.swept}
    return {v: d for v, d in names.items() if v not in ROW}


def stored(value: float | str | list[float]) -> float | bytes:
    """Return a swept input's value as results.h5 stores it, words and lists as text."""
    if isinstance(value, list):
        value = json.dumps(value)
    return value.encode() if isinstance(value, str) else value


def _attach(data: h5py.Dataset, axes: Iterable[h5py.Dataset]) -> None:
    for place, axis in enumerate(axes):
        data.dims[place].attach_scale(axis)


def _define_table(
    group: h5py.Group, axes: Sequence[h5py.Dataset], table: dict[str, Quantity]
) -> None:
    shape = tuple(map(len, axes))
    for name, variable in table.items():
        kind = dtype(variable)
        # No fill value for text: with a fill value, netCDF-C overruns a buffer.
        fill = None if kind.kind == "S" else missing(variable)
        data = group.create_dataset(name, shape, kind, fillvalue=fill)
        tell(data, variable)
        if variable.kind == "enum":
            mark_words(data, ENUMS[name])
        _attach(data, axes)


def codes_of(name: str, words: Coded) -> NDArray[np.int8]:
    """Return the integer codes by which results.h5 stores words, (cases,).

    Parameters
    ----------
    name : the variable that has the words
    words : word of each case, with codes that may be those of another version

    Raises
    ------
    StoreError
        where this version does not know a word
    """
    own = {word: code for code, word in enumerate(ENUMS[name])}
    alien = words.counts().keys() - own.keys()
    if alien:
        msg = f"{name} has the word {min(alien)}, which this version does not know"
        raise StoreError(msg)
    return np.array([own.get(word, 0) for word in words.known], np.int8)[words.code]


def define(
    file: h5py.File,
    contents: Contents,
    facts: Mapping[str, str | float],
    compress: int = 0,
) -> None:
    """Define all variables and attributes of results.h5; cases are written later.

    Parameters
    ----------
    file : file opened for writing, by one process or by all
    contents : what results are gathered from
    facts : further root attributes
    compress : gzip level of traces, 0: not compressed
    """
    plan = contents.plan
    _define_head(file, plan, facts)
    define_axis(file, "case", contents.cases)
    case = [file["case"]]
    _define_table(file, case, ROW | STATUS)
    for name, dotted in swept_extra(plan).items():
        column = plan.table.column(dotted, plan.base[dotted])
        values = [stored(value) for value in listed(column.values)]
        texts = [len(value) for value in values if isinstance(value, bytes)]
        kind = f"S{max(64, *texts)}" if texts else "f8"
        data = file.create_dataset(name, (contents.cases,), kind)
        tell(data, INPUTS[dotted])
        _attach(data, case)
    _define_table(file, case, refined_quantities(plan))
    _define_table(file, case, asked_quantities(plan) | measured_of(plan))
    if contents.plan.twins:
        _define_twins(file, contents)
    performance = file.create_group("performance")
    performance.attrs[SOURCE] = utf8(contents.source)
    _define_table(performance, case, PERFORMANCE)
    if contents.shares:
        _define_shares(performance, contents.shares)
    if contents.found:
        define_cells(file, plan, contents.found | contents.columns)
    if contents.kept:
        _define_traces(file, contents, compress)


def _define_twins(file: h5py.File, contents: Contents) -> None:
    """Define the variables of twins, and of the shares of their words, in results.h5.

    Parameters
    ----------
    file : file opened for writing
    contents : what results are gathered from
    """
    twins = contents.plan.twins
    file.attrs[SURE] = np.float64(twins["sure"])
    file.attrs[TWINS_OF] = utf8(twins["of"])
    for name in ("count", "seed"):
        file.attrs[f"twins_{name}"] = np.int64(twins.get(name, 0))
    file.attrs["twins_spread"] = utf8(json.dumps(twins["spread"]))
    _define_table(file, [file["case"]], SHARE)
    group = file.create_group(GROUP)
    define_axis(group, TWIN, np.arange(1, twins["count"] + 1))
    _define_table(group, (file["case"], group[TWIN]), TWIN_ROW)


def _define_head(
    file: h5py.File, plan: Manifest, facts: Mapping[str, str | float]
) -> None:
    head = {
        "Conventions": CONVENTIONS,
        "title": f"hpcwhirl campaign, {plan.engine}",
        "history": HISTORY,
        "units": ",".join(plan.units),
    }
    if plan.machines:
        head["machines"] = "\n".join(map(_machine_told, plan.machines))
    for name, value in {**head, **facts, **sample_attribute(plan)}.items():
        file.attrs[name] = utf8(value) if isinstance(value, str) else value
    file.attrs["format"] = np.int64(FORMAT)
    inputs = [variable_name(dotted) for dotted in plan.swept]
    file.attrs["swept"] = utf8(" ".join(inputs))
    coordinates = dict.fromkeys(["speed", "nodal_diameter", "gap", "friction", *inputs])
    file.attrs["coordinates"] = utf8(" ".join(coordinates))


def _machine_told(facts: Mapping[str, str]) -> str:
    """Return the facts of one kind of machine, see `campaign.machine`, as one line."""
    return "; ".join(f"{name}: {text}" for name, text in facts.items())


def _define_shares(group: h5py.Group, shares: list[Share]) -> None:
    """Define and write the variables that say how ranks used their time.

    Parameters
    ----------
    group : group `performance` of results.h5
    shares : use of time of each rank
    """
    define_axis(group, WORKER, len(shares))
    _define_table(group, [group[WORKER]], SHARES)
    values = {name: [share[name.removeprefix("worker_")] for share in shares]
              for name in SHARES if name != "busy_fraction"}  # fmt: skip
    values["busy_fraction"] = [
        s["busy"] / s["span"] if s["span"] else 0.0 for s in shares
    ]
    for name, column in values.items():
        kind = dtype(SHARES[name])
        group[name][:] = np.array([encode(name, SHARES[name], v) for v in column], kind)


def _define_traces(file: h5py.File, contents: Contents, compress: int) -> None:
    samples, shapes = int(contents.samples.max()), contents.trace_shapes()
    axis, interval = "sample", contents.common_interval
    if interval is not None:  # all cases share their times
        axis = "time"
        define_axis(file, axis, (1 + np.arange(samples)) * interval)
    else:
        define_axis(file, axis, samples)
    for name in dict.fromkeys(n for kept in contents.kept for n in TRACES[kept].axes):
        define_axis(file, name, contents.sizes[name])
    known = TRACES | {"time": AXES["time"]}
    for name, shape in shapes.items():
        whole = (contents.cases, *shape)
        # every value is written, so filling the file first would be wasted
        options = {"fillvalue": np.nan, "fill_time": "never"} | _chunks(shape, compress)
        data = file.create_dataset(name, whole, "f8", **options)
        tell(data, known[name])
        data.attrs["_FillValue"] = np.float64(np.nan)
        _attach(data, map(file.get, ("case", axis, *known[name].axes)))


def _chunks(shape: tuple[int, ...], compress: int) -> dict[str, Any]:
    """Return h5py's options for the chunks and compression of a trace.

    A chunk has data of one case only.

    Parameters
    ----------
    shape : shape of the trace of one case
    compress : gzip level; 0: neither chunks nor compression
    """
    if not compress or not all(shape):
        return {}
    samples = min(shape[0], max(CHUNK // (8 * int(np.prod(shape[1:]))), 1))
    packed = {"compression": "gzip", "compression_opts": compress, "shuffle": True}
    return {"chunks": (1, samples, *shape[1:]), **packed}


NAME = "0001-00000.bin"  # example of a trace file's name in a journal's header
# traces that `full` keeps in addition to those of `orbit`
MORE = (
    "tips", "blade_impulse", "point_tips", "point_impulse", "casing", "stress", "worn",
)  # fmt: skip
ONE_RANK: Share = {
    "run": 1, "rank": 0, "host": "", "cases": 0, "busy": 0.0, "span": 1.0,
}  # fmt: skip


@dataclass(frozen=True)
class Bytes:
    """Predicted bytes on disk of a campaign, if every case runs to its end.

    Attributes
    ----------
    journal, traces : bytes in the directories of these names
    results : bytes of `results.h5`
    """

    journal: int
    traces: int
    results: int

    @property
    def total(self) -> int:
        """Bytes of journals, traces and results together."""
        return self.journal + self.traces + self.results


def bytes_of(
    plan: Manifest,
    samples: NDArray[np.int64],
    intervals: NDArray[np.float64],
    kinds: Sequence[Mapping[str, tuple[int, ...]]],
    facts: Mapping[str, str | float],
) -> Bytes:
    """Return the predicted bytes on disk of a campaign.

    Parameters
    ----------
    plan : plan of the campaign
    samples : (cases,), number of samples of each case; 0: no traces are kept
    intervals : (cases,), s, interval between samples
    kinds : {trace: shape of one sample} of each kind of case that keeps traces
    facts : root attributes of the results
    """
    sizes = sizes_of(kinds)
    contents = Contents(Journals(Path()), plan, sizes=sizes, shares=[ONE_RANK])
    contents.samples[:], contents.interval[:] = samples, intervals
    if samples.any():
        contents.kept = kept_of(kinds)
    widths = {
        n: int(np.prod([sizes[a] for a in TRACES[n].axes])) for n in contents.kept
    }
    detail = plan.table.column(DETAIL, plan.base[DETAIL])
    is_full = np.array([value == "full" for value in listed(detail.values)])
    full = detail.of(np.arange(contents.cases), is_full)
    always = 1 + sum(width for name, width in widths.items() if name not in MORE)
    more = sum(width for name, width in widths.items() if name in MORE)
    header, head = header_of("0" * 32, NAME, fields_of(plan.base.get(MEASURE) or ()))
    text = int(samples.any())  # a slot of text with the shapes of traces
    return Bytes(
        journal=len(head)
        + contents.cases * header.layout.size * (1 + text + contents.twins),
        traces=int(8 * (samples * (always + more * full)).sum()),
        results=results_bytes(contents, facts),
    )


def results_bytes(contents: Contents, facts: Mapping[str, str | float]) -> int:
    """Return the predicted size of `results.h5`, bytes, with its metadata.

    The metadata are built in memory.

    Parameters
    ----------
    contents : what results are gathered from
    facts : root attributes
    """
    memory: dict[str, Any] = {"driver": "core", "backing_store": False}
    with h5py.File("forecast", "w", libver=LIBVER, **memory, block_size=512) as file:
        define(file, contents, facts)
        rest = 0

        def add(_name: str, item: object) -> None:
            nonlocal rest
            if isinstance(item, h5py.Dataset) and not item.id.get_storage_size():
                rest += item.nbytes

        file.visititems(add)
        file.flush()
        return int(file.id.get_filesize()) + rest
