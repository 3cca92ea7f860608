"""Rotors of unequal sectors, by mistuning or the loss of a blade, and their modes.

Such a rotor is reduced as a whole. Its modes have no single nodal diameter; as labels
they get the diameter and family of modes of the tuned rotor.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from scipy.linalg import eigh

from hpcwhirl.arrays import Floats, Indices, Integers
from hpcwhirl.reduction import modes
from hpcwhirl.reduction.cyclic_coordinates import diameter_shares, diameters, dominant
from hpcwhirl.reduction.supports import (
    coordinates_of,
    energy_in_shaft,
    planar,
    turning_mount,
    with_mount,
)
from hpcwhirl.structure import CyclicStructure, Rotation

FORWARD = planar(1j)
NEAR = 0.1  # scale of ln(frequency ratio) within which modes are similar


def labels(
    shapes: Floats, omega: Floats, blades: int
) -> tuple[Integers, Integers, Integers]:
    """Return nodal diameter, rank and phase of m modes as their labels, each (m,).

    The diameter is the one that dominates the tips; successive modes of a diameter form
    pairs with one rank (k = 0 and N / 2 have single modes). Labels are exact for a
    tuned rotor; for others they are mere names: a localised mode has many diameters.

    shapes, omega, blades : (n, m), tips first; (m,), rad/s, ascending; N
    """
    diameter = dominant(shapes, omega, blades)
    order = np.zeros_like(diameter)
    for k in diameters(blades):
        members = diameter == k
        order[members] = np.arange(np.count_nonzero(members))
    width = np.where(2 * diameter % blades == 0, 1, 2)
    return diameter, order // width, order % width


def named_modes(
    matrices: tuple[Floats, Floats],
    shapes: Floats,
    omega: Floats,
    blades: int,
    damping: float | Floats,
    *,
    kept: int,
) -> modes.ModalModel:
    """Return the modal model of a rotor from its m modes, which get labels.

    The labels are the nodal diameter that dominates a mode, rank and phase.

    Parameters
    ----------
    matrices : M, K (n, n), or two empty arrays if only modes are known
    shapes : (n, m), mass-orthonormal, tips first
    omega : (m,), rad/s, ascending
    blades : N
    damping : modal damping ratio, one or (m,)
    kept : number of coordinates beyond tips and centre, which are the last of the n
    """
    diameter, rank, phase = labels(shapes, omega, blades)
    return modes.ModalModel(
        mass=matrices[0],
        stiffness=matrices[1],
        shapes=shapes,
        omega=omega,
        diameter=diameter,
        rank=rank,
        phase=phase,
        centre_share=np.zeros(len(omega)),
        damping=damping,
        kept=kept,
        cyclic=False,
    )


def named_after(
    model: modes.ModalModel, tuned: modes.ModalModel, blades: int
) -> modes.ModalModel:
    """Return a mistuned rotor whose modes get the names of the tuned rotor's modes.

    Every mode gets the diameter and rank of one tuned mode, each used once, so that
    families are complete even if modes are localised. The assignment has the largest
    sum of (share of the diameter) exp(-(ln(omega / omega_tuned) / NEAR)^2). A weakly
    mistuned mode gets its dominant diameter.

    Parameters
    ----------
    model : the mistuned rotor, with m modes
    tuned : the tuned rotor, with at least m modes
    blades : N
    """
    from scipy.optimize import linear_sum_assignment  # slow to import

    shares = diameter_shares(model.shapes, blades)[tuned.diameter].T
    away = np.log(np.divide.outer(model.omega, tuned.omega)) / NEAR
    _, assigned = linear_sum_assignment(shares * np.exp(-(away**2)), maximize=True)
    diameter, rank = tuned.diameter[assigned], tuned.rank[assigned]
    pair = np.stack([diameter, rank], axis=1)
    phase = np.tril((pair[:, None] == pair).all(axis=2), -1).sum(axis=1)
    return replace(model, diameter=diameter, rank=rank, phase=phase)


def modes_of(mass: Floats, stiffness: Floats) -> tuple[Floats, Floats]:
    """Return all modes of a structure: frequencies, rad/s, (n,), and shapes, (n, n).

    Frequencies are ascending, shapes mass-orthonormal; omega^2 < 0 is taken as 0.

    mass, stiffness : M, K (n, n), symmetric
    """
    squared, shapes = eigh(stiffness, mass)
    return np.sqrt(np.maximum(squared, 0.0)), np.ascontiguousarray(shapes)


def boundary_of(structure: CyclicStructure) -> Indices:
    """Return the indices of the DoF that a reduction keeps, (b,).

    They are those of the tips, sector by sector, then of the centre.

    structure : bladed disk
    """
    first = structure.sector_size * np.arange(structure.sectors)
    tips = first[:, None] + np.array(structure.boundary)
    centre = np.array(structure.centre, dtype=np.intp)
    return np.concatenate([tips.ravel(), centre], dtype=np.intp)


def _reference_speed(structure: CyclicStructure) -> float:
    """Return the speed, rad/s, whose modes extend a basis at rest to all speeds.

    It follows from the mean matrices of all sectors, as `modes.reference_speed` does
    for equal ones, so that it does not depend on which of them is the first.
    """
    n, d = structure.sectors, structure.sector_size
    mean = (
        a[: n * d, : n * d].reshape(n, d, n, d).sum(axis=(0, 2)) / n
        for a in (structure.mass, structure.stiffness)
    )
    return modes.speed_of_basis(*mean)


def basis_of(
    structure: CyclicStructure,
    boundary: Indices,
    eta: int,
    rotation: Rotation | None,
    near: Floats | None,
) -> Floats:
    """Return the Craig-Bampton basis of a structure of unequal sectors, (n, m).

    boundary : (b,), indices of the DoF kept, tips and centre
    eta, rotation, near : parameters of `whole_model`
    """
    modes.check_modes(eta, len(structure.mass) - len(boundary), structure.sectors)
    taut = None
    if rotation is not None:
        squared = _reference_speed(structure) ** 2
        taut = structure.stiffness + squared * rotation.stiffening
    matrices = structure.mass, structure.stiffness
    return np.asarray(modes.reduction_basis(*matrices, (boundary, eta), taut, near))


def whole_model(
    structure: CyclicStructure,
    damping: float,
    eta: int,
    rotation: Rotation | None = None,
    near: Floats | None = None,
    basis: Floats | None = None,
) -> modes.ModalModel:
    """Return the Craig-Bampton reduction (Eq. 1 of the paper) of all sectors at once.

    The modes have no labels yet: diameter, rank and phase are 0, see `named_after`.

    Parameters
    ----------
    structure
        sectors, which may differ, and centre
    damping
        modal damping ratio xi, of every mode
    eta
        fixed-interface modes kept, the lowest of the whole structure
    rotation
        matrices of the rotor's rotation, if included, see `modal_model`
    near
        fixed-interface modes of the tuned rotor, see `craig_bampton`
    basis
        (n, m), displacements of all DoF for unit coordinates of the model, of which
        those of tips and centre are the first; None: the basis of this structure
    """
    boundary = boundary_of(structure)
    if basis is None:
        basis = basis_of(structure, boundary, eta, rotation, near)
    mass, stiffness = (
        basis.T @ full @ basis for full in (structure.mass, structure.stiffness)
    )
    mass, stiffness = (mass + mass.T) / 2, (stiffness + stiffness.T) / 2
    blades, mount, reach = structure.sectors, structure.mount, math.inf
    if rotation is not None:
        reach = modes.highest_of(mass, stiffness, len(boundary) + eta)
    centre = 2 * blades + np.arange(2)
    if mount is not None:
        mass, stiffness = with_mount(mount, centre, FORWARD, mass, stiffness)
    omega, shapes = modes_of(mass, stiffness)
    moved = shapes[2 * blades : 2 * blades + len(structure.centre)]
    if mount is not None:
        moved = shapes[coordinates_of(mount, centre, len(mass))]
    springs = energy_in_shaft(mount, structure.centre_stiffness, moved)
    share = springs / np.maximum(omega**2, np.finfo(float).tiny)
    spin = None if rotation is None else _spin(structure, rotation, basis)
    no_name = np.zeros(len(omega), dtype=np.int64)
    model = modes.ModalModel(
        mass, stiffness, shapes, omega, no_name, no_name, no_name, share, damping,
        kept=len(mass) - len(boundary), cyclic=False, spin=spin, reach=reach,
    )  # fmt: skip
    return modes.on_mount(model, mount, blades, 1.0)


def _spin(structure: CyclicStructure, rotation: Rotation, basis: Floats) -> modes.Spin:
    """Return the terms of rotation of a rotor reduced by a basis, and of its shaft.

    structure, rotation, basis : sectors and centre; matrices of the rotor's rotation;
        (n, m)
    """
    mount, centre = structure.mount, 2 * structure.sectors + np.arange(2)
    turns, stiff = (
        basis.T @ full @ basis
        for full in (rotation.coriolis, rotation.stiffening - structure.mass)
    )
    terms = turns, stiff, basis.T @ rotation.load
    if mount is not None:
        terms = turning_mount(mount, centre, FORWARD, *terms)
    turns, stiff, load = terms
    more = 2 * mount.more if mount else 0
    released, swing = np.zeros((2, len(load)))
    released[: basis.shape[1]] = basis.T @ rotation.released
    swing[: basis.shape[1]] = basis.T @ rotation.swing
    return modes.Spin(
        (turns - turns.T) / 2, (stiff + stiff.T) / 2, load,
        tilt=tuple(range(len(load) - more, len(load))),
        released=released if released.any() else None, swing=swing,
    )  # fmt: skip
