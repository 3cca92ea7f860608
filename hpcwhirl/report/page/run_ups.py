"""Cases whose speed changes, on the page: speed over time, words, and a waterfall.

A waterfall is the spectrum of the centre over time, as in `figures --kind waterfall`:
one byte for each line, the logarithm of its ratio to the largest one.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping
from typing import Any

import numpy as np

from hpcwhirl.analysis import whirl
from hpcwhirl.analysis.over_speed import spells_of
from hpcwhirl.arrays import Floats
from hpcwhirl.case.speed import law_of, speed_at
from hpcwhirl.report.page.thin import at_most
from hpcwhirl.scene import Scene
from hpcwhirl.store.reading.results_file import Results

POINTS = 200  # of the speed over time
COLUMNS, ROWS = 90, 96  # of a waterfall
DECADES = 4  # from the largest line to the least that is shown
REACH = 3.0  # end of the frequency axis / largest speed
MOST = 200  # cases with a waterfall
SPELLS = "words_over_speed"


def run_ups_of(results: Results) -> dict[int, Any]:
    """Return {case: what the page shows of its changing speed}, {} if none changes.

    Each has "time" and "speed", (n,), s and rad/s; "spells", as in
    `analysis.over_speed.Spell`; for cases that kept their orbit also "waterfall".
    """
    if SPELLS not in results:
        return {}
    told = results[SPELLS]
    found = {}
    for case in results.finished():
        scene = results.scene(case)
        if told[case] and law_of(scene) is not None:
            found[case] = _speeds(scene, float(results["end_time"][case]))
            found[case]["spells"] = [tuple(s) for s in spells_of(str(told[case]))]
    if "centre" in results.kept:
        some = at_most([*found], MOST)
        for case, traces in results.each_traces(some, ("centre",)):
            found[case] |= _waterfall(results.scene(case), traces)
    return found


def _speeds(scene: Scene, end: float) -> dict[str, Any]:
    """Return times, s, and the speeds then, rad/s, from 0 to the end of a run."""
    time = np.linspace(0.0, end, POINTS)
    return {"time": time.tolist(), "speed": speed_at(scene, time).tolist()}


def _waterfall(scene: Scene, traces: Mapping[str, Floats]) -> dict[str, Any]:
    """Return {"waterfall": ...} of a case, {} without enough samples.

    It has "from" and "to", s; "reach", rad/s; "top", m, the largest line; "columns";
    and "data", a byte for each line, by frequency from -reach up, then by time.
    """
    time, centre = traces["time"], traces["centre"]
    if len(time) < 2 * whirl.FEWEST or not np.isfinite(centre).all():
        return {}
    speeds = np.abs(speed_at(scene, time))
    turn = 2 * np.pi / float(speeds.mean() or 1.0)
    orbit = centre @ np.array([1.0, 1j])
    middles, omega, lines = whirl.spectra_over(time, orbit, turn, COLUMNS)
    reach = min(REACH * float(speeds.max()), float(np.abs(omega).max()))
    edges = np.linspace(-reach, reach, ROWS + 1)
    table = np.array([whirl.pooled(omega, one, edges) for one in lines]).T
    top = float(np.nanmax(table, initial=0.0))
    with np.errstate(divide="ignore"):
        level = 1 + np.log10(np.nan_to_num(table) / (top or 1.0)) / DECADES
    codes = np.rint(255 * np.clip(level, 0.0, 1.0)).astype(np.uint8)
    return {"waterfall": {
        "from": float(middles[0]), "to": float(middles[-1]), "reach": reach,
        "columns": len(middles), "rows": ROWS, "top": top, "decades": DECADES,
        "data": base64.b64encode(codes.tobytes()).decode(),
    }}  # fmt: skip
