"""Figure of a layer on the casing that wears: its depth over angle and time."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hpcwhirl.analysis.wear import lobes_of
from hpcwhirl.dynamics.layer import rods_of
from hpcwhirl.errors import InputError
from hpcwhirl.report.labels import axis_of, title_of
from hpcwhirl.store.reading.results_file import Results

MICRO = 1e6  # micrometres in a metre
MOST_ROWS = 400  # largest number of rows of the map, along time


def draw_wear(cases: Results, case: int) -> Any:
    """Return the figure of worn depth over the angle: at the end, and over time."""
    traces, row = cases.traces(case), cases.rows[case]
    depth = MICRO * traces["worn"][:, : rods_of(cases.scene(case))]
    if not np.nan_to_num(depth[-1]).any():
        msg = "no rod of the layer was worn"
        raise InputError(msg)
    edges = np.linspace(0.0, 360.0, depth.shape[1] + 1)
    figure = Figure(figsize=(9, 7), layout="constrained")
    final, over = figure.subplots(2, 1, sharex=True)
    final.stairs(depth[-1], edges, fill=True, color="0.6")
    final.set_ylabel("worn depth at the end, µm")
    final.set_title(
        f"Wear of the casing, strongest harmonic {lobes_of(depth[-1])}\n{title_of(row)}"
    )
    rows = slice(None, None, -(-len(depth) // MOST_ROWS))
    mesh = over.pcolormesh(
        0.5 * (edges[:-1] + edges[1:]), traces["time"][rows], depth[rows],
        cmap="viridis_r", shading="nearest",
    )  # fmt: skip
    figure.colorbar(mesh, ax=over, label="worn depth, µm")
    over.set(xlabel="angle on the casing, °", ylabel=axis_of("time"))
    over.set_xticks(np.arange(0, 361, 60))
    return figure
