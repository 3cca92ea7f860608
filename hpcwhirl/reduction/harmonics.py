"""Modes of the ring of Fourier harmonics, in closed form: two per harmonic and phase.

For h >= 1, the first mode bends the ring (for h = 1 it moves the ring on its support);
the second one stretches it, with a frequency of c / R sqrt(1 + h^2) or more, c the
speed of sound. At a contact, the stretching mode has some thousandths of the compliance
of the bending mode, but it limits the time step.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from hpcwhirl.reduction.modes import ModalModel
from hpcwhirl.scene import Casing
from hpcwhirl.structure import FourierOperator, harmonic_matrices

Floats = NDArray[np.float64]


def _places(operator: FourierOperator, h: int) -> list[tuple[list[int], Floats]]:
    """Return ([index of w, index of u], their signs) for each phase of harmonic h."""
    wide = operator.width
    if h == 0:
        return [([0, wide], np.array([1.0, 1.0]))]
    cosine, sine = 2 * h - 1, 2 * h
    return [
        ([cosine, wide + sine], np.array([1.0, 1.0])),
        ([sine, wide + cosine], np.array([1.0, -1.0])),
    ]


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


def harmonic_model(casing: Casing, radius: float) -> tuple[ModalModel, FourierOperator]:
    """Return the modes of a ring of harmonics and its contact operator.

    Parameters
    ----------
    casing : section, support, damping and `harmonics` of the ring
    radius : R_c, m
    """
    operator = FourierOperator(casing.harmonics, radius)
    size = 2 * operator.width
    mass, stiffness = (np.zeros((size, size)) for _ in range(2))
    labels, columns = [], []
    for h in range(casing.harmonics + 1):
        inertia, stiff = harmonic_matrices(casing, radius, h)
        squared, modes = eigh(stiff, inertia * np.eye(2))
        frequencies = np.sqrt(
            np.maximum(squared, 0.0)
        )  # of a free ring, rigid motions have omega^2 = 0 up to round-off
        kept = [0, 1]
        if casing.families == "bending" and h > 0:
            kept.remove(_stretches(h, modes))
        for half, (rows, signs) in enumerate(_places(operator, h)):
            grid = np.ix_(rows, rows)
            mass[grid] = inertia * np.eye(2)
            stiffness[grid] = stiff * np.outer(signs, signs)
            for among, n in enumerate(kept):
                columns.append(np.zeros(size))
                columns[-1][rows] = signs * modes[:, n]
                labels.append((frequencies[n], h, among, half))
    matrices = (mass, stiffness) if casing.families == "all" else None
    return model_of_modes(labels, columns, casing.damping, matrices), operator
