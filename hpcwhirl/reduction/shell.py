"""Modes of a casing as a simply supported shell, and of any casing at one station."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from hpcwhirl.reduction.harmonics import model_of_modes
from hpcwhirl.reduction.modes import ModalModel
from hpcwhirl.scene import Casing
from hpcwhirl.structure import FourierOperator, Sines, Uniform, shell_matrices

Floats = NDArray[np.float64]
NONE = np.zeros((0, 0))
STILL = 1e-12  # motion at a station that counts as 0, relative to the largest


def shell_model(casing: Casing, radius: float) -> tuple[ModalModel, FourierOperator]:
    """Return the modes of a shell, three of each (h, p) and phase, and its operator.

    Parameters
    ----------
    casing : section, `width` (its length), support, damping, `harmonics` and
        `axial_modes`; with `families` = bending, each (h, p) keeps only the mode that
        moves most radially
    radius : R_c, m
    """
    axial = Sines(casing.axial_modes, casing.width)
    operator = FourierOperator(casing.harmonics, radius, axial, directions=3)
    mass, stiffness = (np.zeros((operator.size, operator.size)) for _ in range(2))
    labels, columns = [], []
    for h in range(casing.harmonics + 1):
        found = []
        for p in range(casing.axial_modes):
            inertia, stiff = shell_matrices(casing, radius, h, p + 1)
            squared, modes = eigh(stiff, inertia * np.eye(3))
            if h == 0:  # torsion is uncoupled: entries that couple it are round-off
                modes[np.abs(modes) < STILL * np.abs(modes).max()] = 0.0
            kept = range(3)
            if casing.families == "bending":
                kept = range(first := int(np.argmax(np.abs(modes[0]))), first + 1)
            omega = np.sqrt(np.maximum(squared, 0.0))
            found += [(omega[n], p, modes[:, n]) for n in kept]
            for rows, signs in _places(operator, h, p):
                grid = np.ix_(rows, rows)
                mass[grid] = inertia * np.eye(3)
                stiffness[grid] = stiff * np.outer(signs, signs)
        found.sort(key=lambda mode: mode[:2])
        for rank, (omega, p, mode) in enumerate(found):
            for phase, (rows, signs) in enumerate(_places(operator, h, p)):
                columns.append(np.zeros(operator.size))
                columns[-1][rows] = signs * mode
                labels.append((omega, h, rank, phase))
    matrices = (mass, stiffness) if casing.families == "all" else None
    return model_of_modes(labels, columns, casing.damping, matrices), operator


def _places(
    operator: FourierOperator, h: int, p: int
) -> Iterator[tuple[list[int], Floats]]:
    """Yield ([indices of w, v, u], their signs) of each phase of (h, p), p from 0."""
    layer = len(operator.radial)
    cosine, sine = (operator.width * p + i for i in (max(2 * h - 1, 0), 2 * h))
    yield [cosine, layer + sine, 2 * layer + cosine], np.ones(3)
    if h > 0:
        signs = np.array([1.0, -1.0, 1.0])
        yield [sine, layer + cosine, 2 * layer + sine], signs


def at_station(
    model: ModalModel, operator: FourierOperator, station: float
) -> tuple[ModalModel, FourierOperator]:
    """Return a casing restricted to one axial place, m, where the blades touch it.

    It has no matrices and no modes that are at rest there; a casing that is uniform
    along its axis is returned unchanged.
    """
    if isinstance(operator.axial, Uniform):
        return model, operator
    weight = operator.axial.at(np.array([station]))[0]
    shape = (operator.axial.count, operator.width, -1)
    rows = operator.radial, operator.tangential
    seen = [np.tensordot(weight, model.shapes[r].reshape(shape), 1) for r in rows]
    shapes = np.vstack(seen)
    moved = np.abs(shapes).max(axis=0)
    chosen = moved > STILL * moved.max()
    columns = ("omega", "diameter", "rank", "phase", "centre_share")
    kept = {name: getattr(model, name)[chosen] for name in columns}
    kept["shapes"] = np.ascontiguousarray(shapes[:, chosen])
    damping = model.ratios[chosen]
    flat = FourierOperator(operator.harmonics, operator.radius)
    return replace(model, mass=NONE, stiffness=NONE, damping=damping, **kept), flat
