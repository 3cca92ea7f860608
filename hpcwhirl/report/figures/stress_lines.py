"""Figure of the stress at named points of the blades, over time and blade."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from hpcwhirl.case.resolve import resolve
from hpcwhirl.errors import InputError
from hpcwhirl.report.figures.frequencies import legend_below
from hpcwhirl.report.figures.motions import MOST_POINTS, in_window
from hpcwhirl.report.labels import axis_of, title_of
from hpcwhirl.store.reading.results_file import Results

MEGA = 1e-6  # MPa in a Pa
MOST_LINES = 10  # points that are drawn, those with the largest stress


def draw_stress(cases: Results, case: int, *, transient: bool = False) -> Any:
    """Return a figure of the stress at named points: over time, and largest by blade.

    Over time, each point is shown on the blade on which |stress| is largest there.
    """
    traces, row = cases.traces(case), cases.rows[case]
    own = resolve(cases.scene(case)).model.rotor.stress
    if own is None or len(own.names) != traces["stress"].shape[2]:
        msg = "engine.file has changed: it now has other named points"
        raise InputError(msg)
    shown = in_window(traces["time"], row) | transient
    time, stress = traces["time"][shown], MEGA * traces["stress"][shown]
    most = np.abs(stress).max(axis=0)  # (N, P)
    order = np.argsort(-most.max(axis=0), kind="stable")[:MOST_LINES]
    step = max(1, len(time) // MOST_POINTS)
    figure = Figure(figsize=(11, 7.5), layout="constrained")
    over, around = figure.subplots(2, 1)
    for point in order.tolist():
        blade = int(most[:, point].argmax())
        told = f"{own.names[point]}: {most[blade, point]:.4g} MPa, blade {blade}"
        over.plot(time[::step], stress[::step, blade, point], lw=0.7, label=told)
        around.plot(most[:, point], ".-", lw=0.7)
    kind = "von Mises stress" if own.rows.shape[2] > 1 else "stress"
    over.set(xlabel=axis_of("time"), ylabel=f"{kind}, MPa\n(each on its blade)")
    around.set(xlabel="blade", ylabel=f"largest {kind}, MPa\n(in size, in any sample)")
    around.xaxis.set_major_locator(MaxNLocator(integer=True))
    legend_below(figure, over)
    left = len(own.names) - len(order)
    few = f", the {MOST_LINES} largest of {len(own.names)} points" if left else ""
    figure.suptitle(f"Stress of the vibration{few}. {title_of(row)}")
    return figure
