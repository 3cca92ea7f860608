"""Predict the size of a campaign's files, from its plan and numbers of samples."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from hpcwhirl.scene.quantities import TRACES
from hpcwhirl.scene.table import listed
from hpcwhirl.store.directory.journal import Journals
from hpcwhirl.store.directory.manifest import MEASURE, Manifest
from hpcwhirl.store.directory.record import fields_of, header_of
from hpcwhirl.store.directory.runs import Share
from hpcwhirl.store.results.contents import Contents
from hpcwhirl.store.results.layout import LIBVER, define
from hpcwhirl.store.results.variables import DETAIL, details_of

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
    sizes: Mapping[str, int],
    facts: Mapping[str, str | float],
) -> Bytes:
    """Return the predicted bytes on disk of a campaign.

    Parameters
    ----------
    plan : plan of the campaign
    samples : (cases,), number of samples of each case; 0: no traces are kept
    intervals : (cases,), s, interval between samples
    sizes : {axis: largest size}, axes of traces other than samples
    facts : root attributes of the results
    """
    contents = Contents(Journals(Path()), plan, sizes=dict(sizes), shares=[ONE_RANK])
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
