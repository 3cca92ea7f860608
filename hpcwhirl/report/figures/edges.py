"""Figure of the motion on the edge between two words, and of motions that leave it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from hpcwhirl.report.figures.motions import DARK, draw_orbit, unit_of
from hpcwhirl.report.labels import value_of
from hpcwhirl.scene.words import REGIMES

if TYPE_CHECKING:
    from hpcwhirl.campaign.edge import Edge
    from hpcwhirl.scene import Scene

SETTLED = 0.5  # last fraction of the motion, whose orbit is drawn
ROOM = 3.0  # ratio of the end of the axis of radii to the largest radius on the edge


def edge_figure(scene: Scene, found: Edge) -> Any:
    """Return the figure of an edge: radius over time, and the static-frame orbit."""
    figure = Figure(figsize=(11, 4.8), layout="constrained")
    axes, plane = figure.subplots(1, 2, width_ratios=[1.4, 1.0])
    radius = np.hypot(*found.centre.T)
    most = ROOM * float(radius.max(initial=0.0))
    factor, unit = unit_of(most)
    for name, side in (("low", found.low), ("high", found.high)):
        look = REGIMES[side.word] if side.word in REGIMES else REGIMES["undecided"]
        axes.plot(side.time, factor * side.radius, c=look.stroke, lw=0.7, gid=name,
                  label=f"leaves the edge: {look.told}")  # fmt: skip
    axes.plot(found.time, factor * radius, c=DARK, lw=0.9, label="edge", gid="edge")
    axes.axhline(factor * scene.gap, color="black", ls="--", lw=0.8, label="gap")
    for start in found.time[1:][np.diff(found.pieces) != 0]:
        axes.axvline(start, ymax=0.02, color="black", lw=0.5)
    axes.set(xlabel="t, s", ylabel=f"distance of the centre from its rest, {unit}",
             ylim=(0.0, factor * most))  # fmt: skip
    axes.legend(fontsize=8, loc="upper left")
    late = np.arange(len(radius)) >= (1.0 - SETTLED) * len(radius)
    draw_orbit(plane, found.centre, late, scene.gap, transient=False)
    told = plane.get_label()
    plane.set(xlabel=f"$X_o$, {told} (static frame)", ylabel=f"$Y_o$, {told}")
    names = ("speed", "nodal_diameter", "gap", "friction")
    at = ", ".join(value_of(name, getattr(scene, name)) for name in names)
    text = f"{scene.engine.name}: {at}\nedge between {found.low.word} and "
    figure.suptitle(text + found.high.word, fontsize=10, parse_math=False)
    return figure
