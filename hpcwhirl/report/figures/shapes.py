"""Shapes of the rotor's first family of modes."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from hpcwhirl.errors import InputError
from hpcwhirl.reduction.modes import modal_model
from hpcwhirl.scene import Rotor, Scene
from hpcwhirl.structure import bladed_disk

Floats = NDArray[np.float64]
NODE = 3  # DoF a node: radial, tangential, rotation
LARGEST = 0.2  # of a drawn displacement, tip radii
MIN_BLADES = 3
HUB = 10.0  # the centre is amplified so much more


def draw_shapes(rotor: Rotor, diameters: tuple[int, ...] = (0, 1, 3, 4)) -> Any:
    """Return a figure of the first family's mode shapes, amplified, by diameter."""
    whole = bladed_disk(rotor.model_copy(update={"centre": "free"}))
    model = modal_model(whole, 0.0)
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
