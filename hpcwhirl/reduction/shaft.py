"""The shaft: tilt of the disk on it, and identification of its springs by modes.

The tilt of a disk gives the reduced matrices of its rotor further coordinates, the last
ones: the slopes phi_x, phi_y of the shaft at the disk or, in nodal diameter 1,
conj(phi), as for the centre. See `structure.tilting`.

If a rotor from file is held only by equal springs k_o at its centre, its response to a
steady unit force at the centre is a rigid translation by 1 / k_o, which strains only
the springs. So the steady response of tips and centre gives k_o and, since the motion
of each tip in a translation is known, a check of the tips and the centre that the file
names.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hpcwhirl.arrays import Complexes, Floats, Indices
from hpcwhirl.structure import Tilt

RIGID = 0.01  # largest relative deviation from a translation; left-out modes cause it


class MisplacedError(ValueError):
    """A rotor translates rigidly, but tips or centre are not where the file says."""


def shaft_stiffness(
    shapes: Floats, hub: Floats, omega: Floats, first: float = 0.0
) -> float | None:
    """Identify the stiffness k_o of a rotor's shaft, N/m, from its modes.

    None where the modes do not determine it.

    Parameters
    ----------
    shapes : (N, 2, m), radial and tangential motion of N tips in m modes of unit mass
    hub : (2, m), motion of the centre x_o and y_o in the modes
    omega : (m,), rad/s, natural frequencies
    first : rad, angle of the tip of blade 0

    Raises
    ------
    MisplacedError
        if the motion is a translation in other axes, or with blades numbered in the
        opposite sense: forward and backward whirl would be exchanged
    """
    if not hub.any() or not omega.min() > 0.0:
        return None
    steady = hub.T / omega[:, None] ** 2
    compliance = hub @ steady
    give = float(np.trace(compliance)) / 2
    if np.abs(compliance - give * np.eye(2)).max() > RIGID * give:
        return None
    answer = shapes @ steady / give  # (N, 2, 2): tips if x_o or y_o is 1
    moved = answer @ np.array([1.0, 1j])
    angle = first + 2 * np.pi * np.arange(len(shapes)) / len(shapes)
    expected = np.exp(1j * angle)[:, None] * np.array([1.0, 1j])
    miss = float(np.abs(moved - expected).max())
    if miss <= RIGID:
        return 1.0 / give
    _check_places(moved, angle)
    return None


def _check_places(moved: Complexes, angle: Floats) -> None:
    """Raise MisplacedError if tips translate in other axes, or in another blade order.

    moved : (N, 2), radial and tangential motion of the tips if the centre moves by 1 in
        a rigid translation
    angle : (N,), rad, angles of the tips according to the file
    """
    radial, tangential = moved.T
    for way, order in ((1.0, "anticlockwise"), (-1.0, "clockwise")):
        wave = np.exp(-1j * way * angle)
        out, along = (wave * radial).mean(), (wave * tangential).mean()
        rest = [radial - out / wave, tangential - along / wave]
        whole = abs(abs(out) - 1.0) < RIGID and abs(abs(along) - 1.0) < RIGID
        if whole and np.abs(rest).max() < RIGID:
            first = round(float(np.degrees(np.angle(out)))) % 360
            sense = "with" if (along / out).imag > 0.0 else "against"
            raise MisplacedError(
                f"counted {order}, blade 0 at {first} degrees from x_o, tangential "
                f"motion positive {sense} the angle"
            )


def with_tilt(
    tilt: Tilt, centre: Indices, turn: Any, mass: Any, stiffness: Any
) -> tuple[Any, Any]:
    """Return a rotor's M and K with coordinates of the disk's tilt added at the end.

    From (n, n) they become (n + w, n + w): w is 2 for real slopes phi_x and phi_y, 1
    for a complex one.

    Parameters
    ----------
    tilt : overhung shaft and inertia of the disk
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
    """Return a rotor's terms of rotation with w coordinates of the disk's tilt added.

    They are C and K_1, (n + w, n + w), and F_c, (n + w,), see `Spin`.

    tilt : overhung shaft and inertia of the disk
    turn : (w, w), anticlockwise rotation by 90 degrees in the tilt's coordinates
    """
    n = len(load)
    turns, stiffens = _bordered(coriolis, turn), _bordered(stiffening, turn)
    turns[n:, n:] = (tilt.about_diameter - tilt.polar / 2) * turn
    stiffens[n:, n:] = (tilt.polar - tilt.about_diameter) * np.eye(len(turn))
    return turns, stiffens, np.append(load, np.zeros(len(turn)))


def energy_in_shaft(tilt: Tilt | None, spring: float, centre: Any, slope: Any) -> Any:
    """Return twice the shaft's strain energy in each of m modes, (m,), J.

    Parameters
    ----------
    spring : stiffness of the shaft against a displacement, N/m, k_o without a tilt
    centre, slope : (2, m) or, complex, (1, m), of the shaft at the disk in each mode of
        unit amplitude; slope is not used without a tilt
    """
    energy = spring * (np.abs(centre) ** 2).sum(axis=0)
    if tilt is None:
        return energy
    _, across, alone = tilt.stiffness
    energy += 2 * across * (centre.conj() * slope).real.sum(axis=0)
    return energy + alone * (np.abs(slope) ** 2).sum(axis=0)


def _bordered(matrix: Any, turn: Any) -> Any:
    return np.pad(matrix, (0, len(turn)))
