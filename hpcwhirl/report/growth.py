"""Why motion grows: measured rates beside those of closed contacts, and what feeds."""

from __future__ import annotations

from typing import Any

import numpy as np

from hpcwhirl.analysis.stability import SLOW, growth_of_diameter
from hpcwhirl.case.resolve import resolve
from hpcwhirl.errors import InputError
from hpcwhirl.report.labels import axis_of
from hpcwhirl.report.sweeps import heading, regime_legend, shown_word
from hpcwhirl.scene.quantities import ROW
from hpcwhirl.scene.words import SHOWN
from hpcwhirl.store.reading.cases import Cases


def draw_growth(cases: Cases, line: list[int]) -> Any:
    """Return measured growth over the speed beside the linear check, and its feeding.

    Linear: contacts of nodal diameter k = the lobes held closed, and the springs in
    their place that let motion grow fastest; both of roots below `SLOW`.
    """
    from matplotlib.figure import Figure

    rows = [cases.rows[i] for i in line]
    if not all("late_friction" in row for row in rows):
        msg = f"{cases.path} is older than late_friction: gather the campaign again"
        raise InputError(msg)
    linear = [_linear(cases, i) for i in line]
    speeds = np.array([row["speed"] for row in rows])
    figure = Figure(figsize=(10, 7), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True)
    for name, look in (("slow", "k-"), ("sprung", "k:")):
        label = {"slow": "linear, all closed", "sprung": "linear, worst springs"}[name]
        upper.plot(speeds, [r[name] for r in linear], look, lw=1, label=label)
    for row in rows:
        shown = SHOWN[shown_word(row)]
        upper.plot(row["speed"], row["growth_rate"], "o", mfc=shown.colour,
                   mec=shown.stroke, ms=5)  # fmt: skip
    upper.axhline(0.0, c="grey", lw=0.6)
    unit = ROW["growth_rate"].unit
    upper.set_ylabel(f"growth of ln amplitude, {unit}\n(dots: measured in the window)")
    upper.set_title(f"Growth, {heading(cases, line)}")
    upper.legend(fontsize=8, title=f"roots below {SLOW / 2 / np.pi:g} Hz")
    _feeding(lower, rows)
    regime_legend(figure, cases, line)
    return figure


def _linear(cases: Cases, case: int) -> dict[str, float]:
    scene = cases.scene(case)
    around = scene.nodal_diameter % scene.engine.rotor.blades
    k = min(around, scene.engine.rotor.blades - around)  # as the tips see the lobes
    return growth_of_diameter(resolve(scene).model, k, scene.speed, scene.friction)


def _feeding(axes: Any, rows: list[dict[str, Any]]) -> None:
    """Draw work of friction and of transport over what is lost, in the window."""
    touching = [r for r in rows if r["late_contacts"] and r["late_lost"] > 0]
    speeds = [r["speed"] for r in touching]
    for name, label, marker in (
        ("late_friction", "friction", "o"),
        ("late_rotation", "transport over the deformed ring", "x"),
    ):
        share = [r[name] / r["late_lost"] for r in touching]
        axes.plot(speeds, share, marker, ms=5, mfc="none", label=label)
    axes.axhline(1.0, c="grey", lw=0.6, ls="--")
    axes.set_yscale("symlog", linthresh=1.0)
    axes.margins(y=0.1)
    axes.set(xlabel=axis_of("speed"), ylabel="fed over lost, in the window")
    axes.legend(fontsize=8)
