"""Figure of the loads of a shaft: forces of its supports, and torque of the drive."""

from __future__ import annotations

from typing import Any

import numpy as np

from hpcwhirl.report import palette
from hpcwhirl.report.canvas import axis_of, legend_below, new_figure, title_of
from hpcwhirl.report.figures.motions import MOST_POINTS
from hpcwhirl.scene.units import shown_in
from hpcwhirl.store.reading.results_file import Results


def draw_loads(cases: Results, case: int) -> Any:
    """Return a figure of the loads of a case's shaft over time.

    Above is the magnitude of each support's force, with its peak in the legend, below
    the torque of the drive. Of many samples, those drawn include the largest force, and
    the least and the largest torque, of each interval.
    """
    traces, row = cases.traces(case), cases.rows[case]
    (unit, factor), (turning, scaled) = shown_in("N"), shown_in("N m")
    names = str(cases["support_names"][case]).split("; ")
    sizes = factor * np.linalg.norm(traces["support_force"], axis=2)[:, : len(names)]
    torque = scaled * traces["shaft_torque"]
    figure, (forces, below) = new_figure((11, 7), 2)
    step = max(1, len(torque) // MOST_POINTS)
    starts = np.arange(0, len(torque), step)
    time = traces["time"][starts]
    for place, (name, size) in enumerate(zip(names, sizes.T, strict=True)):
        look = palette.spaced(place, len(names), len(time)) | {"lw": 0.8}
        told = f"{name}: at most {size.max(initial=0.0):.4g} {unit}"
        largest = np.maximum.reduceat(size, starts)
        forces.plot(time, largest, **look, label=told)
    ends = (part.reduceat(torque, starts) for part in (np.fmin, np.fmax))
    below.fill_between(time, *ends, color=palette.INK, lw=0.8)
    forces.set(ylabel=f"force on the rotor, {unit}", xlabel=axis_of("time"))
    below.set(ylabel=f"torque of the drive, {turning}", xlabel=axis_of("time"))
    legend_below(figure, forces)
    figure.suptitle(f"Loads of the shaft. {title_of(row)}")
    return figure
