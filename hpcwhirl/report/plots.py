"""Figures of one case: orbit of the centre and time traces."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.report.labels import axis_of, title_of
from hpcwhirl.report.saving import save
from hpcwhirl.scene.quantities import TRACES

Floats = NDArray[np.float64]
MOST_POINTS = 20_000


def draw_case(
    folder: Path, traces: Mapping[str, Floats], row: Mapping[str, Any]
) -> list[Path]:
    """Draw orbit.png and traces.png and return their paths.

    Parameters
    ----------
    folder : directory of the figures
    traces : `time` (n,), s; `centre` (n, 2), m, static frame; `energy`, `fed`,
        `lost` (n,), J; perhaps `tips` (n, N, 2), m
    row : numbers and words of the case
    """
    figures = {"orbit": draw_orbit(traces, row), "traces": draw_traces(traces, row)}
    return [save(figure, folder / f"{name}.png") for name, figure in figures.items()]


def draw_orbit(traces: Mapping[str, Floats], row: Mapping[str, Any]) -> Any:
    """Return the static-frame orbit: transient light, window dark, gap as a circle."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6, 6), layout="constrained")
    axes = figure.subplots()
    time, centre = traces["time"], 1e3 * traces["centre"]
    late = time > row["end_time"] - row["window"]
    axes.plot(*centre[~late].T, c="#9ecae1", lw=0.5, label="transient")
    axes.plot(*centre[late].T, c="#08306b", lw=0.6, label="window of the words")
    turn = np.linspace(0, 2 * np.pi, 200)
    gap = 1e3 * row["gap"]
    axes.plot(gap * np.cos(turn), gap * np.sin(turn), "k--", lw=0.8, label="gap")
    axes.set_aspect("equal", "datalim")
    axes.set(xlabel="$X_o$, mm (static frame)", ylabel="$Y_o$, mm", title=title_of(row))
    axes.legend(loc="upper right", fontsize=8)
    return figure


def draw_traces(traces: Mapping[str, Floats], row: Mapping[str, Any]) -> Any:
    """Return time traces: centre, energy and, if kept, the tips' extremes."""
    from matplotlib.figure import Figure

    tips = traces.get("tips")
    panels = 3 if tips is not None else 2
    figure = Figure(figsize=(9, 2.6 * panels), layout="constrained")
    axes = figure.subplots(panels, 1, sharex=True)
    step = max(1, len(traces["time"]) // MOST_POINTS)
    time = traces["time"][::step]
    for place, name in enumerate(("$X_o$", "$Y_o$")):
        axes[0].plot(time, 1e3 * traces["centre"][::step, place], lw=0.5, label=name)
    axes[0].set(ylabel="centre, mm (static)", title=title_of(row))
    for name in ("energy", "fed", "lost"):
        axes[1].plot(time, np.abs(traces[name][::step]), lw=0.8, label=name)
    moved = any(np.any(traces[name]) for name in ("energy", "fed", "lost"))
    axes[1].set(
        ylabel=f"{TRACES['energy'].unit} (absolute value)",
        yscale="log" if moved else "linear",
    )
    if tips is not None:
        for place, name in enumerate(("radial", "tangential")):
            peak = np.abs(1e3 * tips[::step, :, place]).max(axis=1)
            axes[2].plot(time, peak, lw=0.5, label=f"largest {name}")
        axes[2].set(ylabel="tips, mm (rotating)")
    for panel in axes:
        panel.axvline(row["end_time"] - row["window"], c="grey", ls=":", lw=0.8)
        panel.legend(loc="upper right", fontsize=8)
    axes[-1].set_xlabel(axis_of("time"))
    return figure
