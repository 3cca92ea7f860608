"""The bladed disk: N tapered blades on spokes and rim beams, its centre on springs."""

from __future__ import annotations

import itertools
from functools import lru_cache

import numpy as np

from hpcwhirl.arrays import Floats, Indices
from hpcwhirl.errors import InputError
from hpcwhirl.scene import Rotor
from hpcwhirl.scene.rules import NO_BLADE
from hpcwhirl.structure.elements import (
    CyclicStructure,
    Section,
    add_block,
    beam,
    turn,
)
from hpcwhirl.structure.mount import mount_of, polar_of
from hpcwhirl.structure.shaft import line_of

NODE = 3  # DoF of a node: radial, tangential, rotation
GHOST = 1e-6  # share of mass and of stiffness that a lost blade keeps in the model
MOST_DOF = 15_000  # dense M and K then take 1.8 GB each


def blade_sections(rotor: Rotor) -> tuple[float, list[Section]]:
    """Return length, m, and cross sections of the beam elements of a blade.

    All elements have the same length; there is one section for each element, from the
    root to the tip.
    """
    length = (rotor.radius - rotor.disk_radius) / rotor.elements
    share = np.linspace(0.0, 1.0, rotor.elements + 1)
    heights = (rotor.root_thickness * (1 + (rotor.taper - 1) * share)).tolist()
    return length, [
        Section(rotor.blade_width, ends, rotor.young, rotor.density)
        for ends in itertools.pairwise(heights)
    ]


def blade(rotor: Rotor) -> tuple[Floats, Floats]:
    """Return mass and stiffness (M, K) of one free blade; its root node is the first.

    Returns
    -------
    M, K : (n, n), n = 3 (elements + 1); DoF radial, tangential, rotation of each node
    """
    size = NODE * (rotor.elements + 1)
    mass, stiffness = np.zeros((size, size)), np.zeros((size, size))
    length, sections = blade_sections(rotor)
    for e, section in enumerate(sections):
        dofs = NODE * e + np.arange(2 * NODE)
        for target, part in zip((mass, stiffness), beam(length, section), strict=True):
            add_block(target, part, dofs)
    return mass, stiffness


def blade_stiffness(rotor: Rotor) -> float:
    """Return the stiffness k_blade of a blade clamped at its root, N/m.

    It is the static tangential force at the tip per tangential displacement of the tip.
    """
    stiffness = blade(rotor)[1][NODE:, NODE:]
    load = np.zeros(len(stiffness))
    load[-2] = 1.0
    return float(1.0 / np.linalg.solve(stiffness, load)[-2])


def spoke(rotor: Rotor, angle: float) -> tuple[float, Section, Floats]:
    """Return the beam of the disk from its centre to the root of a blade.

    Returns its length, m, its section, and the matrix, (6, 5), that gives the beam's
    DoF from x_o, y_o and the root's radial, tangential displacement and rotation

    rotor, angle : inputs of the rotor; rad, direction of the beam from the x axis
    """
    thick = (rotor.spoke_thickness, rotor.spoke_thickness)
    section = Section(rotor.spoke_width, thick, rotor.young, rotor.density)
    transform = np.zeros((6, 5))
    transform[:2, :2] = turn(angle)  # rotation of the centre stays zero
    transform[3:, 2:] = np.eye(3)
    return rotor.disk_radius, section, transform


def rim(rotor: Rotor) -> tuple[float, Section, Floats]:
    """Return the beam of the disk from the root of one blade to that of the next.

    Returns its length, m, its section, and the matrix, (6, 6), that gives the beam's
    DoF from radial, tangential displacement and rotation of both roots
    """
    half = np.pi / rotor.blades
    thick = (rotor.rim_thickness, rotor.rim_thickness)
    section = Section(rotor.rim_width, thick, rotor.young, rotor.density)
    transform = np.eye(6)
    transform[:2, :2] = turn(np.pi / 2 + half)
    transform[3:5, 3:5] = turn(np.pi / 2 - half)
    return 2 * rotor.disk_radius * np.sin(half), section, transform


@lru_cache(maxsize=4)
def _joints(rotor: Rotor) -> list[list[tuple[Indices, tuple[Floats, ...]]]]:
    """Return the beams of the disk for each sector: spoke, then rim.

    Each is (indices of its DoF among those of the whole disk, (M, K)); a rotor of one
    blade has no rim.
    """
    size, blades = NODE * (rotor.elements + 1), rotor.blades
    hub, out = blades * size + np.arange(2), []
    for j in range(blades):
        root = j * size + np.arange(NODE)
        after = (j + 1) % blades * size + np.arange(NODE)
        beams = [(np.r_[hub, root], spoke(rotor, 2 * np.pi * j / blades))]
        if blades > 1:
            beams.append((np.r_[root, after], rim(rotor)))
        out.append([
            (dofs, tuple(turned.T @ a @ turned for a in beam(length, section)))
            for dofs, (length, section, turned) in beams
        ])  # fmt: skip
    return out


def bladed_disk(rotor: Rotor) -> CyclicStructure:
    """Return mass and stiffness matrices of the bladed disk, rotating frame.

    DoF of sector j: (radial, tangential, rotation) of its nodes from root to tip;
    then, if the centre is free, x_o and y_o. Rotation of the centre is blocked.
    The tip's radial and tangential DoF are the boundary. Mistuning scales the
    stiffness of each blade, E_j = E (1 + delta_j), not that of the disk. A lost blade
    keeps a share `GHOST` of its mass and stiffness.

    Raises
    ------
    InputError
        if blades and elements need more DoF than `MOST_DOF`
    """
    size, blades = NODE * (rotor.elements + 1), rotor.blades
    if blades * size > MOST_DOF:
        raise InputError(
            f"rotor.blades and rotor.elements must lead to at most {MOST_DOF} degrees "
            f"of freedom, 3 blades (elements + 1), got {blades * size}"
        )
    centre = (blades * size, blades * size + 1) if rotor.centre == "free" else ()
    total = blades * size + 2  # the centre is assembled, then dropped if clamped
    matrices = np.zeros((total, total)), np.zeros((total, total))
    (inertia, elastic), hub = blade(rotor), np.array([total - 2, total - 1])
    tuned = rotor.model_copy(update={"mistuning": (), "lost_blade": NO_BLADE})
    changes = rotor.mistuning or (0.0,) * blades
    for j, (change, joints) in enumerate(zip(changes, _joints(tuned), strict=True)):
        left = GHOST if j == rotor.lost_blade else 1.0
        blade_matrices = left * inertia, left * (1 + change) * elastic
        own = slice(j * size, (j + 1) * size)
        for i, target in enumerate(matrices):
            target[own, own] += blade_matrices[i]
            for dofs, parts in joints:
                add_block(target, parts[i], dofs)
    mass, stiffness = matrices
    radii = np.linspace(rotor.disk_radius, rotor.radius, rotor.elements + 1)
    mount, kept = mount_of(rotor, mass, radii), slice(None) if centre else slice(0, -2)
    held = 0.0 if mount else rotor.centre_stiffness
    stiffness[hub, hub] += held
    return CyclicStructure(
        mass[kept, kept],
        stiffness[kept, kept],
        sectors=blades,
        sector_size=size,
        boundary=(size - 3, size - 2),
        centre=centre,
        centre_stiffness=held,
        mistuned=rotor.is_uneven,
        mount=mount,
    )


def polar_inertia(rotor: Rotor) -> float:
    """Return the polar moment of inertia of disk, blades and a shaft line, kg m^2."""
    radii = np.linspace(rotor.disk_radius, rotor.radius, rotor.elements + 1)
    disk = rotor.polar_inertia or polar_of(rotor, bladed_disk(rotor).mass, radii)
    return disk + (line_of(rotor.shaft).polar if rotor.has_line else 0.0)
