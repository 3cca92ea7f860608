"""Labels and ticks in chosen units on axes that are drawn in SI."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from hpcwhirl.scene.units import shown_in
from hpcwhirl.store.reading.select import value_text

TOLD = re.compile(r", (rad/s|m|N|s|Hz|1/s)(?=$|[\n,]| \()")
STEPS = (1, 2, 2.5, 5, 10)


def tell_in_units(figure: Any) -> None:
    """Label the axes of a figure in the units of `scene.units.shown_in`.

    The data stay in SI; labels name the unit, and ticks are at round numbers of it.
    Only linear axes whose label contains a unit are changed.
    """
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            found = TOLD.search(axis.label.get_text())
            if found and axis.get_scale() == "linear":
                _tell(axis, found)


def _tell(axis: Any, found: re.Match[str]) -> None:
    from matplotlib.ticker import FuncFormatter, MaxNLocator

    unit, factor = shown_in(found[1])
    if factor == 1.0:
        return

    class Round(MaxNLocator):
        """Ticks at round numbers of the unit shown."""

        def tick_values(self, vmin: float, vmax: float) -> Any:
            ticks = super().tick_values(factor * vmin, factor * vmax)
            return np.asarray(ticks) / factor

    text = axis.label.get_text()
    axis.set_label_text(f"{text[: found.start()]}, {unit}{text[found.end() :]}")
    axis.set_major_locator(Round(9, steps=STEPS))
    axis.set_major_formatter(
        FuncFormatter(lambda x, _: value_text(round(factor * x, 9)))
    )
