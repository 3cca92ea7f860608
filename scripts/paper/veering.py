"""The veering diagram (Fig. 5): frequencies over nodal diameters, and what it shows."""

from __future__ import annotations

from typing import Any

import numpy as np

from hpcwhirl.reduction.families import family_ranks
from hpcwhirl.reduction.modes import ModalModel, modal_model
from hpcwhirl.scene import Rotor
from hpcwhirl.structure import bladed_disk


def full_rotor(rotor: Rotor, *, clamped: bool = False) -> ModalModel:
    """Return the modes of the rotor, not reduced; with a clamped centre if asked."""
    free = "clamped" if clamped else "free"
    return modal_model(bladed_disk(rotor.model_copy(update={"centre": free})), 0.0)


def frequencies(model: ModalModel) -> dict[tuple[int, str], float]:
    """Return {(nodal diameter, family): Hz}."""
    out = {}
    for k in np.unique(model.diameter):
        names = family_ranks(model, int(k))
        for m in np.flatnonzero((model.diameter == k) & (model.phase == 0)):
            out[int(k), names[int(model.rank[m])]] = float(model.omega[m] / 2 / np.pi)
    return out


def draw_veering(rotor: Rotor, families: int = 12) -> Any:
    """Return frequencies over nodal diameters, centre free and clamped (Fig. 5)."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 5.4), layout="constrained")
    whole, low = figure.subplots(1, 2)
    bodies = {"free": full_rotor(rotor), "clamped": full_rotor(rotor, clamped=True)}
    for axes, count in ((whole, families), (low, 2)):
        wanted = [f"{n}F" for n in range(1, count + 1)]
        _veering(axes, {n: frequencies(b) for n, b in bodies.items()}, wanted)
        axes.set(xlabel="nodal diameter k", title=f"{count} families of modes")
        axes.axvspan(0.6, 1.4, color="#0072B2", alpha=0.12, lw=0)
    whole.set(ylabel="frequency, kHz", ylim=(0, None))
    low.set(ylabel="frequency, kHz", ylim=(0, None))
    low.legend(loc="center right", fontsize=8)
    return figure


def _veering(
    axes: Any, found: dict[str, dict[tuple[int, str], float]], wanted: list[str]
) -> None:
    looks = {"free": ("o", "#0072B2", 5), "clamped": ("x", "#D55E00", 5)}
    for centre, (marker, colour, size) in looks.items():
        for place, family in enumerate(wanted):
            at = sorted(
                (k, f) for (k, name), f in found[centre].items() if name == family
            )
            x, y = np.array(at).T
            label = f"centre {centre}" if place == 0 else None
            axes.plot(x, y / 1e3, marker, c=colour, ms=size, mfc="none", label=label)
            if centre == "free":
                axes.plot(x, y / 1e3, c=colour, lw=0.5)
    for (k, name), f in found["free"].items():
        if name == "suspension":
            axes.plot(k, f / 1e3, "s", c="#009E73", ms=6, label="suspension")
