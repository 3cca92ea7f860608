"""The rotor's modes: shapes of a family (Fig. 4) and the veering diagram (Fig. 5)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import InputError
from hpcwhirl.reduction.families import family_ranks
from hpcwhirl.reduction.modes import ModalModel, modal_model
from hpcwhirl.scene import Rotor, Scene
from hpcwhirl.structure import bladed_disk

Floats = NDArray[np.float64]
NODE = 3  # DoF a node: radial, tangential, rotation
LARGEST = 0.2  # of a drawn displacement, tip radii
MIN_BLADES = 3
HUB = 10.0  # the centre is amplified so much more


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


def draw_shapes(rotor: Rotor, diameters: tuple[int, ...] = (0, 1, 3, 4)) -> Any:
    """Return the shapes of 1F, amplified, with the centre displaced and at rest."""
    from matplotlib.figure import Figure

    model = full_rotor(rotor)
    figure = Figure(figsize=(9, 9.4), layout="constrained")
    panels = figure.subplots(2, 2).ravel()
    for axes in panels[len(diameters) :]:
        axes.axis("off")
    for axes, k in zip(panels, diameters, strict=False):
        own = (model.diameter == k) & (model.rank == 0) & (model.phase == 0)
        mode = int(np.flatnonzero(own)[0])
        _shape(axes, rotor, model.shapes[:, mode])
        hertz = model.omega[mode] / (2 * np.pi)
        axes.set_title(f"k = {k}, f = {hertz:.2f} Hz")
    panels[0].legend(fontsize=8, loc="upper left")
    figure.suptitle(
        "First family, displacements amplified, the centre's "
        f"{HUB:g} times more; full model"
    )
    return figure


def draw_shapes_of(scene: Scene) -> Any:
    """Return the shapes of 1F of a scene's rotor, if its blades are equal."""
    rotor = scene.engine.rotor
    if scene.engine.file or rotor.mistuning or rotor.blades < MIN_BLADES:
        msg = f"shapes need equal blades, {MIN_BLADES} at least, and no rotor from file"
        raise InputError(msg)
    found = [k for k in (0, 1, 3, 4) if k <= rotor.blades // 2]
    rest = [k for k in range(rotor.blades // 2 + 1) if k not in found]
    return draw_shapes(rotor, tuple(sorted([*found, *rest][:4])))


def _shape(axes: Any, rotor: Rotor, shape: Floats) -> None:
    """Draw a shape (n,): blades by their nodes, the centre, and where they rest."""
    size = NODE * (rotor.elements + 1)
    motion = shape[: size * rotor.blades].reshape(rotor.blades, -1, NODE)
    scale = LARGEST * rotor.radius / np.abs(motion[..., :2]).max()
    hub = shape[size * rotor.blades :] @ np.array([1.0, 1j])
    along = np.linspace(rotor.disk_radius, rotor.radius, rotor.elements + 1)
    for j in range(rotor.blades):
        turn = np.exp(2j * np.pi * j / rotor.blades)
        moved = (along + scale * (motion[j, :, 0] + 1j * motion[j, :, 1])) * turn
        axes.plot((along * turn).real, (along * turn).imag, c="#CCCCCC", lw=0.6)
        axes.plot(moved.real, moved.imag, c="#08306b", lw=1.0)
    axes.plot(0, 0, "o", c="black", ms=9, mfc="none", label="centre at rest")
    placed = HUB * scale * hub
    axes.plot(
        placed.real, placed.imag, "o", c="#D55E00", ms=5, label="centre displaced"
    )
    axes.set_aspect("equal")
    axes.axis("off")


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
