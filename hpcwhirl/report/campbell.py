"""A Campbell-like diagram: both bodies' frequencies over the speed, rotating frame."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.analysis.critical import critical_of_families
from hpcwhirl.case.resolve import resolve
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.families import Line, first_family, modal_table
from hpcwhirl.report.labels import axis_of, eq13_of
from hpcwhirl.report.ranges import FAMILIES, MARGIN, own_waves
from hpcwhirl.scene import Scene

Floats = NDArray[np.float64]
COLOURS = dict(zip(FAMILIES, ("#0072B2", "#56B4E9", "#009E73"), strict=True))
MOST_ENGINE_ORDERS = 12


def draw_campbell(scene: Scene, speeds: Floats) -> Any:
    """Return frequencies over the speed: blades, casing as blades see it, orders.

    The rotor's frequencies do not depend on the speed (no centrifugal terms). A wave of
    the casing with k lobes passes the blades at |omega_c -+ k Omega|; where one meets
    1F or the suspension of the same k against the rotation is Eq. 13.

    Parameters
    ----------
    scene : engine and nodal diameter
    speeds : (n,), rad/s, of the campaign
    """
    from matplotlib.figure import Figure

    table, k = modal_table(resolve(scene).model), scene.nodal_diameter
    if not any(m.body == "rotor" for m in table):
        msg = "a Campbell diagram needs modes of the rotor"
        raise InputError(msg)
    most = MARGIN * (float(np.abs(speeds).max(initial=0.0)) or 1.0)
    span = np.linspace(0.0, most, 201)
    figure = Figure(figsize=(9.5, 6.2), layout="constrained")
    axes = figure.subplots()
    top = _families(axes, table, span)
    _orders(axes, span, top)
    _casing(axes, table, k, span)
    _marks(axes, table, k, most)
    axes.axvspan(*(np.abs(speeds).min(), np.abs(speeds).max()), color="#EEEEEE", lw=0,
                 zorder=0, label="speeds of the campaign")  # fmt: skip
    axes.set(xlim=(0.0, most), ylim=(0.0, top), xlabel=axis_of("speed"),
             ylabel=axis_of("frequency") + " (rotating frame)")  # fmt: skip
    axes.set_title(f"{scene.engine.name}: casing of k = {k}", parse_math=False)
    axes.legend(fontsize=8, loc="upper left")
    return figure


def _families(axes: Any, table: list[Line], span: Floats) -> float:
    """Draw the rotor's families as bands over all k; return the top of the axis, Hz."""
    top = 0.0
    for name, colour in COLOURS.items():
        own = [m.frequency_hz for m in table if m.body == "rotor" and m.family == name]
        if not own:
            continue
        axes.fill_between(span, min(own), max(own), color=colour, lw=1.2,
                          label=f"rotor {name}")  # fmt: skip
        top = max(top, MARGIN * max(own))
    return top or 1.0


def _orders(axes: Any, span: Floats, top: float) -> None:
    """Draw engine orders n Omega / 2 pi, named where they leave the axes."""
    for n in range(1, MOST_ENGINE_ORDERS + 1):
        line = n * span / (2 * np.pi)
        axes.plot(span, line, c="#999999", lw=0.5)
        end = min(span[-1], 2 * np.pi * top / n)
        look = {"color": "#666666", "fontsize": 7, "ha": "right", "va": "top"}
        axes.annotate(f"{n}", (end, n * end / (2 * np.pi)), (-2, -2),
                      textcoords="offset points", **look)  # fmt: skip


def _casing(axes: Any, table: list[Line], k: int, span: Floats) -> None:
    """Draw the casing's first wave of k as the blades meet it, both ways."""
    first = first_family(table, "casing").get(k)
    if first is None:
        return
    for sign, look, told in ((-1, "-", "against"), (1, "--", "with")):
        seen = np.abs(first - sign * k * span) / (2 * np.pi)
        axes.plot(span, seen, look, c="#D55E00", lw=1.0,
                  label=f"casing, k = {k}, wave {told} the rotation")  # fmt: skip


def _marks(axes: Any, table: list[Line], k: int, most: float) -> None:
    """Mark Eq. 13 on the families of the rotor that have it."""
    rotor = own_waves(table, k)
    for row in critical_of_families(table):
        if row["nodal_diameter"] == k and row["speed"] <= most:
            name, speed = row["family"], row["speed"]
            at = speed, rotor[name] / (2 * np.pi)
            axes.plot(*at, "o", c="black", mfc="white", ms=5, zorder=4)
            axes.annotate(f"{eq13_of(name)}: {speed:.0f} rad/s", at,
                          (6, 8 if name == "1F" else -14), fontsize=8,
                          textcoords="offset points")  # fmt: skip
