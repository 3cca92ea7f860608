"""Loads of the shaft on the page: force of each support, and torque of the drive.

Of many samples a case has the largest force of each interval, and the least and the
largest torque, so that no peak is lost.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping
from typing import Any

import numpy as np

from hpcwhirl.arrays import Floats
from hpcwhirl.report.page.thin import at_most, cuts_of, spans_of
from hpcwhirl.store.reading.results_file import Results

NEEDED = ("support_force", "shaft_torque")
POINTS = 160  # intervals of a run
MOST = 200  # cases with loads


def loads_of(results: Results) -> dict[int, Any]:
    """Return {case: what the page shows of its loads}, {} where none were kept.

    Each has "supports", their names; "count", of intervals; and "data", (supports + 2,
    count) numbers of single precision: the largest force of each support, N, then the
    least and the largest torque of the drive, N m.
    """
    if not set(NEEDED) <= set(results.kept):
        return {}
    some = at_most(results.finished(), MOST)
    found = {}
    for case, traces in results.each_traces(some, NEEDED):
        names = str(results["support_names"][case])
        if names and len(traces["time"]):
            found[case] = _loads(names.split("; "), traces)
    return found


def _loads(names: list[str], traces: Mapping[str, Floats]) -> dict[str, Any]:
    """Return the loads of a case as data for the page.

    names, traces : of its supports; `time` and `NEEDED`
    """
    cuts = cuts_of(len(traces["time"]), POINTS)
    forces = np.linalg.norm(traces["support_force"], axis=2)[:, : len(names)]
    torque = spans_of(traces["shaft_torque"], len(cuts)).reshape(2, -1)
    rows = [*np.fmax.reduceat(forces, cuts, axis=0).T, *torque]
    with np.errstate(over="ignore"):  # of a diverged run, finite values are shown
        data = np.array(rows, "<f4").tobytes()
    return {
        "supports": names,
        "count": len(cuts),
        "data": base64.b64encode(data).decode(),
    }
