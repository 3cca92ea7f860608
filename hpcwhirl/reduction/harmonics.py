"""Modes of a casing by its harmonics: a ring in closed form, a shell; at one station.

A ring has two modes per harmonic and phase. For h >= 1, the first one bends the ring
(for h = 1 it moves the ring on its support); the second one stretches it, with a
frequency of c / R sqrt(1 + h^2) or more, c the speed of sound. At a contact, the
stretching mode has some thousandths of the compliance of the bending mode, but it
limits the time step.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.linalg import eigh

from hpcwhirl.arrays import Floats
from hpcwhirl.reduction.modes import ModalModel
from hpcwhirl.scene import Casing
from hpcwhirl.structure import (
    FourierOperator,
    Sines,
    Uniform,
    harmonic_matrices,
    shell_matrices,
)

NONE = np.zeros((0, 0))
STILL = 1e-12  # motion over the largest, at a station or of a mode, that counts as none


def _places(
    operator: FourierOperator, h: int, p: int
) -> Iterator[tuple[list[int], Floats]]:
    """Yield ([indices of coordinates], their signs) of each phase of a motion (h, p).

    The coordinates are radial w, tangential u and, of a shell, axial v.

    h, p : harmonic; axial function, from 0
    """
    layer, count = len(operator.radial), operator.directions
    cosine, sine = (operator.width * p + i for i in (max(2 * h - 1, 0), 2 * h))
    yield [cosine, layer + sine, 2 * layer + cosine][:count], np.ones(count)
    if h > 0:
        rows = [sine, layer + cosine, 2 * layer + sine]
        yield rows[:count], np.array([1.0, -1.0, 1.0])[:count]


def _stretches(h: int, modes: Floats) -> int:
    """Return the index of the mode that stretches the ring.

    modes : (2, 2), w and u of the two modes, by columns
    """
    return int(np.argmax(np.abs(modes[0] + h * modes[1])))


def model_of_modes(
    labels: list[tuple[float, int, int, int]],
    columns: list[Floats],
    damping: float | Floats,
    matrices: tuple[Floats, Floats] | None = None,
) -> ModalModel:
    """Return a casing's model from its modes by harmonic, sorted by frequency.

    Parameters
    ----------
    labels : (omega, harmonic, rank, phase) of each mode
    columns : shape of each mode, in the coordinates of the matrices
    damping : modal damping ratio, one or (modes,)
    matrices : mass and stiffness; None if modes were left out, which the matrices
        would include
    """
    omega, diameter, rank, phase = map(np.array, zip(*labels, strict=True))
    order = np.lexsort((phase, rank, diameter, omega))
    mass, stiffness = matrices or (np.zeros((0, 0)),) * 2
    return ModalModel(
        mass=mass,
        stiffness=stiffness,
        shapes=np.ascontiguousarray(np.column_stack(columns)[:, order]),
        omega=omega[order],
        diameter=diameter[order],
        rank=rank[order],
        phase=phase[order],
        centre_share=np.zeros(len(omega)),
        damping=damping if isinstance(damping, float) else damping[order],
        kept=0,
    )


def _model(
    casing: Casing,
    operator: FourierOperator,
    matrices_of: Callable[[int, int], tuple[float, Floats]],
    kept_of: Callable[[int, Floats], list[int]],
) -> ModalModel:
    """Return the modes of a casing whose harmonics and axial functions are uncoupled.

    Parameters
    ----------
    matrices_of : (h, p) -> (mass, stiffness matrix) of harmonic h, axial function p
    kept_of : (h, modes by columns) -> those that are kept with `families` = bending
    """
    mass, stiffness = (np.zeros((operator.size, operator.size)) for _ in range(2))
    labels, columns, whole = [], [], casing.families == "all"
    for h in range(casing.harmonics + 1):
        found = []
        for p in range(operator.axial.count):
            inertia, stiff = matrices_of(h, p)
            own = inertia * np.eye(len(stiff))
            squared, modes = eigh(stiff, own)
            if h == 0:  # torsion is uncoupled: entries that couple it are round-off
                modes[np.abs(modes) < STILL * np.abs(modes).max()] = 0.0
            omega = np.sqrt(np.maximum(squared, 0.0))  # a free ring's are round-off
            kept = range(len(omega)) if whole else kept_of(h, modes)
            found += [(omega[n], p, modes[:, n]) for n in kept]
            for rows, signs in _places(operator, h, p):
                mass[np.ix_(rows, rows)] = own
                stiffness[np.ix_(rows, rows)] = stiff * np.outer(signs, signs)
        found.sort(key=lambda mode: mode[:2])
        for rank, (value, p, mode) in enumerate(found):
            for phase, (rows, signs) in enumerate(_places(operator, h, p)):
                columns.append(np.zeros(operator.size))
                columns[-1][rows] = signs * mode
                labels.append((value, h, rank, phase))
    matrices = (mass, stiffness) if whole else None
    return model_of_modes(labels, columns, casing.damping, matrices)


def harmonic_model(casing: Casing, radius: float) -> tuple[ModalModel, FourierOperator]:
    """Return the modes of a ring of harmonics and its contact operator.

    Parameters
    ----------
    casing : section, support, damping and `harmonics` of the ring
    radius : R_c, m
    """

    def kept_of(h: int, modes: Floats) -> list[int]:
        return [0, 1] if h == 0 else [1 - _stretches(h, modes)]

    operator = FourierOperator(casing.harmonics, radius)
    matrices = partial(harmonic_matrices, casing, radius)
    return _model(casing, operator, lambda h, _: matrices(h), kept_of), operator


def shell_model(casing: Casing, radius: float) -> tuple[ModalModel, FourierOperator]:
    """Return the modes of a shell and its contact operator.

    There are three modes for each harmonic h, axial function p, and phase.

    Parameters
    ----------
    casing : section, `width` (its length), support, damping, `harmonics` and
        `axial_modes`; with `families` = bending, each (h, p) keeps only the mode that
        moves most radially
    radius : R_c, m
    """
    axial = Sines(casing.axial_modes, casing.width)
    operator = FourierOperator(casing.harmonics, radius, axial, directions=3)
    model = _model(
        casing,
        operator,
        lambda h, p: shell_matrices(casing, radius, h, p + 1),
        lambda _, modes: [int(np.argmax(np.abs(modes[0])))],
    )
    return model, operator


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
