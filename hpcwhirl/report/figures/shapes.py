"""Figures of mode shapes: the rotor's first family, 1F, and the casing around it."""

from __future__ import annotations

from typing import Any

import numpy as np

from hpcwhirl.arrays import Floats
from hpcwhirl.case.resolve import resolve
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.model import Model
from hpcwhirl.reduction.modes import modal_model
from hpcwhirl.report import palette
from hpcwhirl.report.canvas import legend_below, new_figure
from hpcwhirl.scene import Rotor, Scene
from hpcwhirl.structure import bladed_disk

NODE = 3  # DoF of a node: radial, tangential, rotation
LARGEST = 0.2  # largest drawn displacement, in tip radii
MIN_BLADES = 3
HUB = 10.0  # additional amplification of the centre
AROUND, SWING = 1.22, 0.12  # drawn radius and amplitude of the casing, in tip radii
ACROSS = 4  # panels in a row
BLUE, ORANGE, PALE = palette.DEEP, palette.ORANGE, palette.PALE


def draw_shapes(
    rotor: Rotor, diameters: tuple[int, ...] = (0, 1, 3, 4), model: Model | None = None
) -> Any:
    """Return a figure of the mode shapes of family 1F, amplified, by nodal diameter.

    Parameters
    ----------
    rotor : rotor with equal blades
    diameters : nodal diameters k, one panel each
    model : model of rotor and casing; the casing's first mode of each k is drawn, too;
        None: no casing
    """
    whole = bladed_disk(rotor.model_copy(update={"centre": "free"}))
    own = modal_model(whole, 0.0)
    columns = min(ACROSS, len(diameters)) if len(diameters) > 4 else 2
    rows = -(-len(diameters) // columns)
    width = 9.0 if columns == 2 else 13.0
    size = width, 0.7 + 1.06 * width / columns * rows
    figure, grid = new_figure(size, rows, columns, squeeze=False)
    panels = grid.ravel()
    for axes in panels[len(diameters) :]:
        axes.remove()
    for axes in panels[: len(diameters)]:
        axes.axis("off")
        axes.set_aspect("equal")
    for axes, k in zip(panels, diameters, strict=False):
        mode = np.flatnonzero((own.diameter == k) & (own.rank == 0) & (own.phase == 0))
        _shape(axes, rotor, own.shapes[:, mode[0]])
        title = f"k = {k}, f = {own.omega[mode[0]] / (2 * np.pi):.2f} Hz"
        around = _casing(axes, rotor.radius, model, k) if model else None
        axes.set_title(title + (f"\ncasing {around:.2f} Hz" if around else ""))
    legend_below(figure, panels[0], ncols=3)
    figure.suptitle(
        "First family, displacements amplified, the centre's "
        f"{HUB:g} times more; full model"
    )
    return figure


def draw_shapes_of(scene: Scene) -> Any:
    """Return the figure of the mode shapes of 1F of a scene's rotor and casing.

    The blades must all be equal; else InputError.
    """
    rotor = scene.engine.rotor
    if scene.engine.file or rotor.is_uneven or rotor.blades < MIN_BLADES:
        msg = f"shapes need equal blades, {MIN_BLADES} at least, and no rotor from file"
        raise InputError(msg)
    return draw_shapes(rotor, tuple(range(rotor.blades // 2 + 1)), resolve(scene).model)


def _shape(axes: Any, rotor: Rotor, shape: Floats) -> None:
    """Draw a mode shape of the rotor: blades, disk, and their positions at rest.

    Blades are drawn through their nodes; the disk as spokes from the centre to the
    roots, and as a rim from root to root.

    rotor, shape : inputs of the rotor; (n,), displacements in all its DoF
    """
    size = NODE * (rotor.elements + 1)
    motion = shape[: size * rotor.blades].reshape(rotor.blades, -1, NODE)
    scale = LARGEST * rotor.radius / np.abs(motion[..., :2]).max()
    hub = shape[size * rotor.blades :] @ np.array([1.0, 1j])
    along = np.linspace(rotor.disk_radius, rotor.radius, rotor.elements + 1)
    turn = np.exp(2j * np.pi * np.arange(rotor.blades) / rotor.blades)[:, None]
    rest = along * turn
    moved = (along + scale * (motion[..., 0] + 1j * motion[..., 1])) * turn
    for place, colour, centre in ((rest, PALE, 0.0), (moved, BLUE, scale * hub)):
        root = place[:, 0]
        for blade in place:
            axes.plot(blade.real, blade.imag, c=colour, lw=1.0)
        rim = np.append(root, root[0])
        axes.plot(rim.real, rim.imag, c=colour, lw=1.6)
        spokes = np.column_stack([np.full(len(root), centre), root])
        axes.plot(spokes.real.T, spokes.imag.T, c=colour, lw=0.5)
    axes.plot(0, 0, "o", c=palette.INK, ms=9, mfc="none", label="centre at rest")
    placed = HUB * scale * hub
    axes.plot(placed.real, placed.imag, "o", c=ORANGE, ms=5, label="centre displaced")


def _casing(axes: Any, radius: float, model: Model, k: int) -> float | None:
    """Draw the casing's first mode of harmonic k around the rotor.

    Return its frequency, Hz; None, and nothing is drawn, if there is no such mode.
    """
    casing, ring = model.casing, model.ring
    if casing is None or ring is None:
        return None
    found = np.flatnonzero((casing.diameter == k) & (casing.phase == 0))
    if not len(found):
        return None
    mode = found[np.argmin(casing.omega[found])]
    angle = np.linspace(0.0, 2 * np.pi, 361)
    w, u = (rows @ casing.shapes[:, mode] for rows in ring.rows(angle))
    scale = SWING / np.abs([w, u]).max()
    rest = AROUND * radius * np.exp(1j * angle)
    moved = radius * (AROUND + scale * (w + 1j * u)) * np.exp(1j * angle)
    axes.plot(rest.real, rest.imag, c=PALE, lw=1.0)
    axes.plot(moved.real, moved.imag, c=ORANGE, lw=1.8, label="casing, first mode of k")
    marks = moved[:-1:20]  # only these show that the whole ring rotates
    axes.plot(marks.real, marks.imag, ".", c=ORANGE, ms=4)
    return float(casing.omega[mode] / (2 * np.pi))
