"""The tilt of a disk, as further coordinates in the reduced matrices of its rotor.

These coordinates are the last ones: the slopes phi_x, phi_y of the shaft at the disk
or, in nodal diameter 1, conj(phi), as for the centre. See `structure.tilting`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hpcwhirl.arrays import Indices
from hpcwhirl.structure import Tilt


def with_tilt(
    tilt: Tilt, centre: Indices, turn: Any, mass: Any, stiffness: Any
) -> tuple[Any, Any]:
    """Return M and K with the w coordinates of the tilt, (n + w, n + w), from (n, n).

    Parameters
    ----------
    centre : (w,), indices of the centre's coordinates
    turn : (w, w), anticlockwise rotation by 90 degrees in these coordinates
    """
    held, n, same = _bordered(stiffness, turn), len(mass), np.eye(len(turn))
    _, across, alone = tilt.stiffness
    held[n:, n:] = alone * same
    held[n:, centre] = across * same
    held[centre, n:] = across * same
    heavy = _bordered(mass, turn)
    heavy[n:, n:] = tilt.about_diameter * same
    return heavy, held


def turning_tilt(
    tilt: Tilt, turn: Any, coriolis: Any, stiffening: Any, load: Any
) -> tuple[Any, Any, Any]:
    """Return C, K_1 (n + w, n + w) and F_c (n + w,) with the tilt, see `modes.Spin`."""
    n = len(load)
    turns, stiffens = _bordered(coriolis, turn), _bordered(stiffening, turn)
    turns[n:, n:] = (tilt.about_diameter - tilt.polar / 2) * turn
    stiffens[n:, n:] = (tilt.polar - tilt.about_diameter) * np.eye(len(turn))
    return turns, stiffens, np.append(load, np.zeros(len(turn)))


def energy_in_shaft(tilt: Tilt | None, spring: float, centre: Any, slope: Any) -> Any:
    """Return twice the strain energy in the shaft of modes of unit amplitude, (m,), J.

    Parameters
    ----------
    spring : stiffness of the shaft against a displacement, N/m, k_o without a tilt
    centre, slope : (w, m), centre and slope of each mode; slope is not used without a
        tilt
    """
    energy = spring * (np.abs(centre) ** 2).sum(axis=0)
    if tilt is None:
        return energy
    _, across, alone = tilt.stiffness
    energy += 2 * across * (centre.conj() * slope).real.sum(axis=0)
    return energy + alone * (np.abs(slope) ** 2).sum(axis=0)


def _bordered(matrix: Any, turn: Any) -> Any:
    return np.pad(matrix, (0, len(turn)))
