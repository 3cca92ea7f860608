"""Journals and traces to `results.h5`: by one process, or by all through MPI-IO.

Both writers define the same file with the same calls; they differ in who writes which
cases. The file is netCDF-4: every axis is a dimension scale. It is written under a
temporary name, synced and renamed.
"""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from hpcwhirl.errors import MissingFileError, WhirlError
from hpcwhirl.scene import Scene, apply_settings, input_names
from hpcwhirl.store.journal import Record, read_records, read_traces
from hpcwhirl.store.plan import Plan, read_plan
from hpcwhirl.store.schema import (
    ENUMS,
    FORMAT,
    PERFORMANCE,
    ROW,
    STATUS,
    TRACES,
    Variable,
    dtype,
    encode,
    missing,
)

RESULTS = "results.h5"


def has_mpi_io() -> bool:
    """Return whether h5py was built with parallel HDF5."""
    return bool(h5py.get_config().mpi)


def gather(folder: Path, facts: Mapping[str, str | float], comm: Any = None) -> Path:
    """Write `results.h5` of a campaign directory and return its path.

    Parameters
    ----------
    folder : the campaign's directory
    facts : further root attributes
    comm : an MPI communicator; with parallel HDF5 all its ranks write, otherwise
        its first. Every rank must call. None: this process writes

    Raises
    ------
    MissingFileError, StoreError
        on every rank, where one of them cannot read or write; an older file stays
    """
    size = comm.size if comm is not None else 1
    rank = comm.rank if comm is not None else 0
    parallel = size > 1 and has_mpi_io()
    final, part = folder / RESULTS, folder / (RESULTS + ".part")
    content = _agreed(partial(_Content, folder) if rank == 0 else None, part, comm)
    write = publish = None
    if parallel or rank == 0:
        told = {**facts, "gather": _how(parallel, size)}
        content = comm.bcast(content, root=0) if parallel else content
        write = partial(_write_file, part, content, told, comm if parallel else None)
    _agreed(write, part, comm)
    if rank == 0:
        publish = partial(_publish, part, final)
    _agreed(publish, part, comm)
    return final


def _agreed(action: Callable[[], Any] | None, part: Path, comm: Any) -> Any:
    """Return what `action` does here; the error of one rank is raised on all."""
    value: Any = None
    error: Exception | None = None
    try:
        value = action() if action else None
    except WhirlError as failed:
        error = failed
    except (OSError, RuntimeError) as failed:  # HDF5 may say either, in many lines
        told = getattr(failed, "strerror", None) or str(failed)
        error = MissingFileError(
            f"cannot write {part.with_suffix('')}: {told.splitlines()[0]}"
        )
    except Exception as failed:  # noqa: BLE001 - raised below
        error = RuntimeError(f"{type(failed).__name__}: {failed}")
        error.__cause__ = failed
    errors = comm.allgather(error) if comm is not None else []
    for found in (error, *errors):
        if found is not None:
            with contextlib.suppress(OSError):
                part.unlink(missing_ok=True)
            raise found
    return value


def _write_file(
    part: Path, content: _Content, facts: Mapping[str, str | float], comm: Any
) -> None:
    """Write the whole file alone, or with `comm` each rank its share of the cases."""
    options = {"driver": "mpio", "comm": comm} if comm is not None else {}
    rank, size = (comm.rank, comm.size) if comm is not None else (0, 1)
    with h5py.File(part, "w", libver=("earliest", "v110"), **options) as file:
        _define(file, content, facts)
        _fill(file, content, range(rank, content.cases, size))


def _how(parallel: bool, size: int) -> str:  # noqa: FBT001
    return f"MPI-IO by {size} ranks" if parallel else "serial"


def _publish(part: Path, final: Path) -> None:
    with part.open("rb+") as file:
        os.fsync(file.fileno())
    part.replace(final)


class _Content:
    """Plan, records and the sizes they ask for."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.plan: Plan = read_plan(folder)
        known = read_records(folder)
        self.records: list[Record | None] = [known.get(d) for d in self.plan.digests]
        self.cases = len(self.records)
        blocks = [r["traces"] for r in self.records if r and r.get("traces")]
        self.shapes: dict[str, list[int]] = {}
        for block in blocks:
            for name, shape in block["shapes"].items():
                old = self.shapes.get(name, [0] * len(shape))
                self.shapes[name] = [max(a, b) for a, b in zip(old, shape, strict=True)]
        self.interval = self._common_interval()

    def _common_interval(self) -> float | None:
        found = {
            r["row"]["sample_interval"] for r in self.records if r and r.get("row")
        }
        return found.pop() if len(found) == 1 else None

    @property
    def sample_axis(self) -> str:
        """Name of the trace axis: `time` if all cases share it, else `sample`."""
        return "time" if self.interval is not None else "sample"


def variable_name(dotted: str) -> str:
    """Return the variable of a swept input: its own name, or with its table's."""
    leaf = dotted.rsplit(".", 1)[-1]
    if leaf in ROW:
        return leaf
    return "_".join(p for p in dotted.split(".") if p not in {"engine", "solver"})


def _swept_extra(plan: Plan) -> dict[str, str]:
    """Return {variable: dotted name} of swept inputs that no row has."""
    names = {variable_name(dotted): dotted for dotted in plan.swept}
    return {v: d for v, d in names.items() if v not in ROW}


def _stored(value: float | str | list[float]) -> float | bytes:
    """Return a swept value as it is stored: words and lists as text."""
    if isinstance(value, list):
        value = json.dumps(value)
    return value.encode() if isinstance(value, str) else value


def _axis(file: h5py.File, name: str, values: Iterable[Any], meaning: str) -> None:
    data = file.create_dataset(name, data=np.asarray(values))
    data.attrs["long_name"] = np.bytes_(meaning)
    data.make_scale(name)


def _attach(data: h5py.Dataset, root: h5py.File, axes: tuple[str, ...]) -> None:
    for place, axis in enumerate(axes):
        data.dims[place].attach_scale(root[axis])


def _define_cases(
    group: h5py.Group, root: h5py.File, table: dict[str, Variable], cases: int
) -> None:
    for name, variable in table.items():
        kind = dtype(name, variable)
        # No fill value for text: netCDF-C overruns its buffer where one is set.
        fill = None if variable.kind == "text" else missing(variable)
        data = group.create_dataset(name, (cases,), kind, fillvalue=fill)
        data.attrs["units"] = np.bytes_(variable.unit)
        data.attrs["long_name"] = np.bytes_(variable.meaning)
        if variable.kind == "enum":
            data.attrs["flag_values"] = np.arange(len(ENUMS[name]), dtype="i1")
            data.attrs["flag_meanings"] = np.bytes_(" ".join(ENUMS[name]))
        _attach(data, root, ("case",))


def _define(
    file: h5py.File, content: _Content, facts: Mapping[str, str | float]
) -> None:
    plan = content.plan
    head = {"Conventions": "CF-1.8", "title": f"hpcwhirl campaign, {plan.engine}"}
    for name, value in {**head, **facts}.items():
        stored = value.encode() if isinstance(value, str) else value
        file.attrs[name] = np.asarray(stored)[()]
    file.attrs["format"] = np.int64(FORMAT)
    _axis(file, "case", np.arange(content.cases, dtype="i8"), "case of the campaign")
    _define_cases(file, file, ROW | STATUS, content.cases)
    for name, dotted in _swept_extra(plan).items():
        values = [_stored(row.get(dotted, plan.base[dotted])) for row in plan.settings]
        texts = [len(value) for value in values if isinstance(value, bytes)]
        kind = f"S{max(64, *texts)}" if texts else "f8"
        data = file.create_dataset(name, (content.cases,), kind)
        data.attrs["long_name"] = np.bytes_(f"swept input {dotted}")
        _attach(data, file, ("case",))
    inputs = [variable_name(dotted) for dotted in plan.swept]
    file.attrs["swept"] = np.bytes_(" ".join(inputs))
    coordinates = dict.fromkeys(["speed", "nodal_diameter", "gap", "friction", *inputs])
    file.attrs["coordinates"] = np.bytes_(" ".join(coordinates))
    _define_cases(file.create_group("performance"), file, PERFORMANCE, content.cases)
    if content.shapes:
        _define_traces(file, content)


def _define_traces(file: h5py.File, content: _Content) -> None:
    axis, shapes = content.sample_axis, content.shapes
    samples = shapes["time"][0]
    if content.interval is not None:
        times = (1 + np.arange(samples)) * content.interval
        _axis(file, "time", times, "time of the sample")
        file["time"].attrs["units"] = np.bytes_("s")
    else:
        _axis(file, "sample", np.arange(samples, dtype="i8"), "number of the sample")
    _axis(file, "xy", np.arange(2, dtype="i8"), "0: X_o, 1: Y_o")
    if "tips" in shapes:
        _axis(file, "blade", np.arange(shapes["tips"][1], dtype="i8"), "blade")
        _axis(file, "component", np.arange(2, dtype="i8"), "0: radial, 1: tangential")
    wanted = {n: TRACES[n] for n in shapes if n in TRACES}
    if content.interval is None:
        wanted["time"] = ((), "s", "time of the sample")
    for name, (further, unit, meaning) in wanted.items():
        size = (content.cases, samples, *shapes[name][1:])
        data = file.create_dataset(name, size, "f8", fillvalue=np.nan)
        data.attrs["units"] = np.bytes_(unit)
        data.attrs["long_name"] = np.bytes_(meaning)
        data.attrs["_FillValue"] = np.float64(np.nan)
        _attach(data, file, ("case", axis, *further))


def _fill(file: h5py.File, content: _Content, mine: Iterable[int]) -> None:
    """Write the cases `mine`, one after the other; memory is that of one case."""
    extra = _swept_extra(content.plan)
    for case in mine:
        for name, dotted in extra.items():
            value = content.plan.settings[case].get(dotted, content.plan.base[dotted])
            file[name][case] = _stored(value)
        record = content.records[case]
        status = record["status"] if record else "missing"
        message = record["message"] if record else "not computed yet"
        _write(file, STATUS, case, {"status": status, "message": message})
        row = (record or {}).get("row") or _inputs_of(content.plan, case)
        _write(file, ROW, case, row)
        if record:
            _write(file["performance"], PERFORMANCE, case, record["performance"])
            if record.get("traces"):
                _write_traces(file, content, case, record["traces"])


def _inputs_of(plan: Plan, case: int) -> dict[str, Any]:
    """Return what is known of a case without a result: its inputs.

    Its duration is the one that a result would show, in seconds.
    """
    values, known = plan.base | plan.settings[case], input_names()
    short = {variable_name(dotted): value for dotted, value in values.items()}
    scene = apply_settings(Scene(), {n: v for n, v in values.items() if n in known})
    short["duration"] = scene.end_time
    return {name: short[name] for name in ROW if name in short}


def _write(
    group: h5py.Group, table: dict[str, Variable], case: int, row: dict[str, Any]
) -> None:
    for name, variable in table.items():
        value = encode(name, variable, row[name]) if name in row else missing(variable)
        group[name][case] = value


def _write_traces(file: h5py.File, content: _Content, case: int, block: Record) -> None:
    for name, values in read_traces(content.folder, block).items():
        if name in TRACES or (name == "time" and content.interval is None):
            file[name][(case, *map(slice, values.shape))] = values
