"""Terms of rotation of the bladed disk: Coriolis, stiffening, softening, load.

At Omega, with u the displacement in the rotating frame, anticlockwise (all in plane),

M u'' + (D + 2 Omega C) u' + (K + Omega^2 (K_g - M)) u = f + Omega^2 F_c

    C = integral of rho A N^T (z x N), skew: C_uv = -N_u N_v, C_vu = N_v N_u
    K_g = integral of n(s) v' v', n the axial force per unit Omega^2
    F_c = integral of rho A N^T X, X the position of a point from the centre

(u along a beam, v across, 90 degrees anticlockwise from u). Forces n follow from the
static response of the sector to F_c, centre held; within an element n' = -rho A X_s, so
that they are exact on a blade: P(r) = integral of rho A s from r to the tip. A rigid
rotation u_r then causes no forces, u_r (K_g - M) u_r = 0, and a rigid translation only
those of its inertia. All motion is in plane, so the softening matrix is M itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Polynomial

from hpcwhirl.arrays import Floats, Indices
from hpcwhirl.scene import Rotor
from hpcwhirl.structure import elements
from hpcwhirl.structure.bladed_disk import GHOST, NODE, blade_sections, rim, spoke

ROD, BEND = [0, 3], [1, 2, 4, 5]  # axial and bending DoF of a beam


@dataclass(frozen=True)
class Rotation:
    """The matrices and loads that rotation adds to a bladed disk, in its n DoF.

    Attributes
    ----------
    coriolis : C (n, n), kg, skew
    stiffening : K_g (n, n), kg: N/m per unit Omega^2
    load : F_c (n,), kg m: N per unit Omega^2, including the pull of a lost blade
    swing : F_e (n,), kg m: N per unit of -dOmega/dt, load of an angular acceleration
    released : (n,), kg m: the pull of a lost blade at its root with opposite sign; zero
        if no blade is lost
    """

    coriolis: Floats
    stiffening: Floats
    load: Floats
    swing: Floats
    released: Floats


@dataclass(frozen=True)
class Member:
    """A beam of one sector of the bladed disk: its position, and the DoF it couples.

    Attributes
    ----------
    length : m
    section : section of the beam
    transform : (6, c), from the DoF of `dofs` to those of the beam
    start : (along, across), m: position of the first end from the centre, in the beam's
        axes
    dofs : (c,), indices into the DoF of (the sector, the next sector's root, the centre
        in the sector's axes)
    """

    length: float
    section: elements.Section
    transform: Floats
    start: tuple[float, float]
    dofs: Indices


def coriolis_of(length: float, section: elements.Section) -> Floats:
    """Return a beam's Coriolis matrix C, (6, 6), kg, in the DoF of `elements.beam`.

    length, section : length, m, and section of the beam
    """
    out = np.zeros((6, 6))
    for xi, weight in zip(elements.POINTS, elements.WEIGHTS, strict=True):
        mass = section.density * section.at(xi)[0] * weight * length
        along = np.array([1 - xi, xi])
        out[np.ix_(ROD, BEND)] -= mass * np.outer(along, elements.hermite(xi, length))
    return np.asarray(out - out.T)


def loads_of(
    length: float, section: elements.Section, start: tuple[float, float]
) -> tuple[Floats, Floats]:
    """Return a beam's centrifugal load F_c, and its load F_e of a changing speed.

    Each is (6,), kg m: N per unit Omega^2 and N per unit of -dOmega/dt, on the DoF of
    `elements.beam`.

    start : (along, across), m, position of the first end from the centre of the disk,
        in the beam's axes
    """
    load, swing = np.zeros(6), np.zeros(6)
    for xi, weight in zip(elements.POINTS, elements.WEIGHTS, strict=True):
        mass = section.density * section.at(xi)[0] * weight * length
        along, across = np.array([1 - xi, xi]), elements.hermite(xi, length)
        x, y = start[0] + xi * length, start[1]
        load[ROD] += mass * along * x
        load[BEND] += mass * across * y
        swing[ROD] -= mass * along * y
        swing[BEND] += mass * across * x
    return load, swing


def stiffening_of(
    length: float, section: elements.Section, start: float, mean: float
) -> Floats:
    """Return a beam's stress stiffness K_g, (6, 6), kg, under the centrifugal pull.

    It is N/m per unit Omega^2, in the DoF of `elements.beam`.

    Parameters
    ----------
    length, section : length, m, and section of the beam
    start : m, coordinate of the beam's first end along its axis, from the centre
    mean : kg m, mean axial force per unit Omega^2
    """
    heights = Polynomial([section.thickness[0], np.diff(section.thickness)[0]])
    pull = section.density * section.width * heights * Polynomial([start, length])
    drop = (length * pull).integ()  # n = n(0) - drop
    average = drop.integ()(1.0)
    out = np.zeros((6, 6))
    for xi, weight in zip(elements.POINTS, elements.WEIGHTS, strict=True):
        force = mean + average - drop(xi)
        slope = elements.hermite(xi, length, 1)
        out[np.ix_(BEND, BEND)] += force * weight * length * np.outer(slope, slope)
    return out


def members(rotor: Rotor) -> list[Member]:
    """Return the beams of a sector of a bladed disk: spoke, rim, blade elements.

    The elements of the blade follow from root to tip; a rotor of one blade has no rim.
    """
    size = NODE * (rotor.elements + 1)
    root, after, hub = (
        np.arange(NODE),
        size + np.arange(NODE),
        size + NODE + np.arange(2),
    )
    beams = [Member(*spoke(rotor, 0.0), (0.0, 0.0), np.r_[hub, root])]
    if rotor.blades > 1:
        half = np.pi / rotor.blades
        chord = rotor.disk_radius * np.sin(half), rotor.disk_radius * np.cos(half)
        start = -chord[0], -chord[1]
        beams.append(Member(*rim(rotor), start, np.r_[root, after]))
    length, sections = blade_sections(rotor)
    for e, section in enumerate(sections):
        start = rotor.disk_radius + e * length, 0.0
        dofs = NODE * e + np.arange(2 * NODE)
        beams.append(Member(length, section, np.eye(2 * NODE), start, dofs))
    return beams


def tensions(parts: list[Member], size: int) -> Floats:
    """Return the mean axial force of each beam of a sector, (beams,), kg m.

    It is N per unit Omega^2, from the static response to the centrifugal load F_c,
    equal in all sectors, with the centre held. Mistuning of the blades does not change
    it.

    Parameters
    ----------
    parts : beams of the sector, result of `members`
    size : number of DoF of a sector
    """
    stiffness, load = np.zeros((size, size)), np.zeros(size)
    folded = []
    for part in parts:
        moving = part.dofs < size + NODE  # the centre is held
        places = part.dofs[moving] % size  # all sectors move alike
        transform = part.transform[:, moving]
        elastic = elements.beam(part.length, part.section)[1]
        elements.add_block(stiffness, transform.T @ elastic @ transform, places)
        pushed = loads_of(part.length, part.section, part.start)[0]
        np.add.at(load, places, transform.T @ pushed)
        folded.append((elastic[3] @ transform, places))
    moved = np.linalg.solve(stiffness, load)
    return np.array([row @ moved[places] for row, places in folded])


def rotation_of(rotor: Rotor) -> Rotation:
    """Return what rotation adds to a bladed disk: Coriolis, stiffening, loads.

    The matrices are in the DoF of `bladed_disk`. The loss of a blade does not change
    the tension of disk and rim.
    """
    size, blades = NODE * (rotor.elements + 1), rotor.blades
    parts = members(rotor)
    wide, total = size + NODE + 2, blades * size + 2
    whole: list[Floats] = [np.zeros((total, total)), np.zeros((total, total))]
    whole += [np.zeros(total), np.zeros(total)]
    released, pull = np.zeros(total), 0.0
    split = len(parts) - rotor.elements, len(parts)
    forces = tensions(parts, size)
    disk, blade = (
        _added(parts[a:b], forces[a:b], wide) for a, b in ((0, split[0]), split)
    )
    for part in parts[split[0] :]:
        pull += float(loads_of(part.length, part.section, part.start)[0][ROD].sum())
    for j in range(blades):
        after = (j + 1) % blades * size + np.arange(NODE)
        places = np.r_[j * size + np.arange(size), after, total - 2, total - 1]
        lift = np.eye(wide)
        lift[-2:, -2:] = elements.turn(2 * np.pi * j / blades)
        left = GHOST if j == rotor.lost_blade else 1.0
        for target, own, other in zip(whole[:2], disk, blade, strict=False):
            elements.add_block(target, lift.T @ (own + left * other) @ lift, places)
        for target, own, other in zip(whole[2:], disk[2:], blade[2:], strict=True):
            np.add.at(target, places, lift.T @ (own + left * other))
        if j == rotor.lost_blade:
            whole[2][j * size] += (1 - GHOST) * pull
            released[j * size] = -(1 - GHOST) * pull
    kept = slice(None) if rotor.centre == "free" else slice(0, -2)
    coriolis, stiffening, load, swing = whole
    return Rotation(
        coriolis[kept, kept], stiffening[kept, kept], load[kept], swing[kept],
        released[kept],
    )  # fmt: skip


def _added(
    parts: list[Member], forces: Floats, wide: int
) -> tuple[Floats, Floats, Floats, Floats]:
    """Return the terms of rotation of one sector, sums over its beams.

    They are C, K_g, (wide, wide), F_c, F_e, (wide,), see `Rotation`.

    parts : beams of a sector
    forces : (beams,), kg m, mean axial force of each beam per unit Omega^2
    wide : number of DoF of the sector, the next sector's root and the centre
    """
    grids = np.zeros((wide, wide)), np.zeros((wide, wide))
    out = *grids, np.zeros(wide), np.zeros(wide)
    for part, mean in zip(parts, forces, strict=True):
        lift = part.transform
        turns = coriolis_of(part.length, part.section)
        stiff = stiffening_of(part.length, part.section, part.start[0], mean)
        elements.add_block(out[0], lift.T @ turns @ lift, part.dofs)
        elements.add_block(out[1], lift.T @ stiff @ lift, part.dofs)
        pushed = loads_of(part.length, part.section, part.start)
        for target, push in zip(out[2:], pushed, strict=True):
            np.add.at(target, part.dofs, lift.T @ push)
    return out
