"""How many bytes a campaign will take, from its plan and its samples alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from hpcwhirl.scene.quantities import BLADES, ROW, TRACES
from hpcwhirl.scene.table import listed
from hpcwhirl.scene.words import ENUMS
from hpcwhirl.store.directory.blades import DETAIL, details_of
from hpcwhirl.store.directory.lines import OWN, Record, line_of
from hpcwhirl.store.directory.manifest import Manifest
from hpcwhirl.store.directory.runs import Share
from hpcwhirl.store.results.blocks import row_of
from hpcwhirl.store.results.contents import Contents
from hpcwhirl.store.results.layout import LIBVER, define

MORE = ("tips", "blade_impulse", "casing")  # what `full` keeps beyond `orbit`
TYPICAL = {"f8": 1 / 7, "i8": 1000, "S16": "modal"}  # in the usual number of digits

ONE_RANK: Share = {
    "run": 1,
    "rank": 0,
    "host": "",
    "cases": 0,
    "busy": 0.0,
    "span": 1.0,
}


@dataclass(frozen=True)
class Bytes:
    """Bytes on disk of a whole campaign, if every case runs to its end.

    Attributes
    ----------
    journal, traces : of the directories of these names
    results : of `results.h5`
    """

    journal: int
    traces: int
    results: int

    @property
    def total(self) -> int:
        """All of them together."""
        return self.journal + self.traces + self.results


def bytes_of(
    plan: Manifest,
    samples: NDArray[np.int64],
    intervals: NDArray[np.float64],
    sizes: Mapping[str, int],
    facts: Mapping[str, str | float],
) -> Bytes:
    """Return the bytes that a campaign will take.

    Parameters
    ----------
    plan : of the campaign
    samples : (cases,), of the traces of each case; 0 for `summary`
    intervals : (cases,), s, between the samples of each case
    sizes : {axis: most of it}, of what traces have beside samples
    facts : root attributes of the results
    """
    contents = Contents(Path(), plan, sizes=dict(sizes), shares=[ONE_RANK])
    contents.samples[:], contents.interval[:] = samples, intervals
    details = details_of(plan)
    if samples.any():
        wanted = [n for n in TRACES if "full" in details or n not in MORE]
        contents.kept = tuple(n for n in wanted if {*TRACES[n].axes} <= sizes.keys())
    widths = {
        n: int(np.prod([sizes[a] for a in TRACES[n].axes])) for n in contents.kept
    }
    detail = plan.table.column(DETAIL, plan.base[DETAIL])
    is_full = np.array([value == "full" for value in listed(detail.values)])
    full = detail.of(np.arange(contents.cases), is_full)
    always = 1 + sum(width for name, width in widths.items() if name not in MORE)
    more = sum(width for name, width in widths.items() if name in MORE)
    return Bytes(
        journal=len(OWN.head)
        + contents.cases * _record_bytes(contents, widths)
        + contents.twins[..., 0].size * _record_bytes(contents, {}),
        traces=int(8 * (samples * (always + more * full)).sum()),
        results=results_bytes(contents, facts),
    )


def _record_bytes(contents: Contents, widths: dict[str, int]) -> int:
    """Return the bytes of a line of the journal, a usual one."""
    row: dict[str, Any] = {name: TYPICAL.get(v.kind) for name, v in ROW.items()}
    row |= {name: words[1] for name, words in ENUMS.items() if name in row}
    known = row_of(contents.plan, 0, None) if contents.cases else {}
    row |= dict.fromkeys(contents.blades.keys() & BLADES.keys(), TYPICAL["f8"])
    row |= {n: float(v) if ROW[n].kind == "f8" else v for n, v in known.items()}
    record: Record = {"case": contents.cases, "digest": "0" * 64, "status": "ok"}
    record |= {"message": "", "ended": 1 / 7, "row": row}
    spent = {"rank": 0, "host": "node0000", "seconds": 1 / 7}
    record["performance"] = spent | {"microseconds_per_step": 1 / 7}
    if widths:
        shapes = {
            name: [10_000, width] for name, width in {"time": 1, **widths}.items()
        }
        block = {"file": "0001-00000.bin", "offset": 10**9, "bytes": 10**6}
        record["traces"] = block | {"crc": 10**9, "shapes": shapes}
    return len(line_of(record))


def results_bytes(contents: Contents, facts: Mapping[str, str | float]) -> int:
    """Return the size of `results.h5`: its head, defined in memory, and its values."""
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
