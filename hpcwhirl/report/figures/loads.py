"""Figure of the loads of a shaft: forces of its supports, and torque of the drive."""

from __future__ import annotations

from typing import Any

import numpy as np

from hpcwhirl.report import palette
from hpcwhirl.report.canvas import axis_of, legend_below, new_figure, title_of
from hpcwhirl.report.figures.motions import MOST_POINTS
from hpcwhirl.store.reading.results_file import Results

KILO = 1e-3


def draw_loads(cases: Results, case: int) -> Any:
    """Return a figure of the loads of a case's shaft over time.

    Above is the magnitude of each support's force, with its peak in the legend, below
    the torque of the drive. Of many samples, those drawn include the largest of each
    interval.
    """
    traces, row = cases.traces(case), cases.rows[case]
    sizes = KILO * np.hypot(*np.moveaxis(traces["support_force"], 2, 0))
    torque, names = (
        traces["shaft_torque"],
        str(cases["support_names"][case]).split("; "),
    )
    figure, (forces, below) = new_figure((11, 7), 2)
    step = max(1, len(torque) // MOST_POINTS)
    time = traces["time"][::step]
    for place, (name, size) in enumerate(zip(names, sizes.T, strict=True)):
        look = palette.spaced(place, len(names), len(time)) | {"lw": 0.8}
        told = f"{name}: at most {size.max(initial=0.0):.4g} kN"
        largest = np.maximum.reduceat(size, np.arange(0, len(size), step))
        forces.plot(time, largest, **look, label=told)
    below.plot(time, torque[::step], c=palette.INK, lw=0.8)
    forces.set(ylabel="force on the rotor, kN", xlabel=axis_of("time"))
    below.set(ylabel="torque of the drive, N m", xlabel=axis_of("time"))
    legend_below(figure, forces)
    figure.suptitle(f"Loads of the shaft. {title_of(row)}")
    return figure
