"""Modes of the Fourier ring: two a harmonic and phase, in closed form."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from hpcwhirl.reduction.modes import ModalModel
from hpcwhirl.scene import Casing
from hpcwhirl.structure import FourierOperator, harmonic_matrices

Floats = NDArray[np.float64]


def _places(operator: FourierOperator, h: int) -> list[tuple[list[int], Floats]]:
    """Return the coordinates (w, u) of each phase of a harmonic, and their signs."""
    wide = operator.width
    if h == 0:
        return [([0, wide], np.array([1.0, 1.0]))]
    cosine, sine = 2 * h - 1, 2 * h
    return [
        ([cosine, wide + sine], np.array([1.0, 1.0])),
        ([sine, wide + cosine], np.array([1.0, -1.0])),
    ]


def harmonic_model(casing: Casing, radius: float) -> tuple[ModalModel, FourierOperator]:
    """Return the modes of a ring of harmonics and its contact operator.

    Parameters
    ----------
    casing : its section, support, damping and `harmonics`
    radius : R_c, m
    """
    operator = FourierOperator(casing.harmonics, radius)
    size = 2 * operator.width
    mass, stiffness, shapes = (np.zeros((size, size)) for _ in range(3))
    labels, column = [], 0
    for h in range(casing.harmonics + 1):
        inertia, stiff = harmonic_matrices(casing, radius, h)
        squared, modes = eigh(stiff, inertia * np.eye(2))
        found = np.sqrt(np.maximum(squared, 0.0))  # a free ring's are 0 to round-off
        for half, (rows, signs) in enumerate(_places(operator, h)):
            place = np.ix_(rows, rows)
            mass[place] = inertia * np.eye(2)
            stiffness[place] = stiff * np.outer(signs, signs)
            shapes[rows, column : column + 2] = signs[:, None] * modes
            labels += [(found[n], h, n, half) for n in range(2)]
            column += 2
    columns = zip(*labels, strict=True)
    omega, diameter, rank, phase = (np.array(column) for column in columns)
    order = np.lexsort((phase, rank, diameter, omega))
    model = ModalModel(
        mass=mass,
        stiffness=stiffness,
        shapes=np.ascontiguousarray(shapes[:, order]),
        omega=omega[order],
        diameter=diameter[order],
        rank=rank[order],
        phase=phase[order],
        centre_share=np.zeros(size),
        damping=casing.damping,
        kept=0,
    )
    return model, operator
