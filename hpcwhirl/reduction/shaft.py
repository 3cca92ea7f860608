"""The shaft's springs of a rotor from file, told by its modes.

A rotor that nothing but equal springs k_o at its centre holds answers a steady force at
the centre with a translation of the whole, by 1 / k_o: no part of it is strained but
the springs. So the steady response of tips and centre tells k_o, and, since a
translation is known to the last tip, whether tips and centre are what the file says.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
RIGID = 0.01  # of a translation: what a response that is one may miss, modes left out


class MisplacedError(ValueError):
    """The rotor translates as one, but not as its tips and centre are said to lie."""


def shaft_stiffness(shapes: Floats, hub: Floats, omega: Floats) -> float | None:
    """Return k_o, N/m; None where modes do not tell it.

    Parameters
    ----------
    shapes : (N, 2, m), mass-orthonormal: radial and tangential motion of the tips
    hub : (2, m), of x_o and y_o
    omega : (m,), rad/s

    Raises
    ------
    MisplacedError
        where tips or centre are those of a translation in other axes, or numbered the
        other way round: forward and backward would change places
    """
    if not hub.any() or not omega.min() > 0.0:
        return None
    steady = hub.T / omega[:, None] ** 2
    compliance = hub @ steady
    give = float(np.trace(compliance)) / 2
    if np.abs(compliance - give * np.eye(2)).max() > RIGID * give:
        return None
    answer = shapes @ steady / give  # (N, 2, 2): of x_o and y_o moved by 1
    moved = answer @ np.array([1.0, 1j])
    angle = 2 * np.pi * np.arange(len(shapes)) / len(shapes)
    told = np.exp(1j * angle)[:, None] * np.array([1.0, 1j])
    miss = float(np.abs(moved - told).max())
    if miss <= RIGID:
        return 1.0 / give
    _check_places(moved, angle)
    return None


def _check_places(moved: NDArray[np.complex128], angle: Floats) -> None:
    """Refuse a translation of tips that lie or count otherwise than told."""
    radial, tangential = moved.T
    for way, told in ((1.0, "anticlockwise"), (-1.0, "clockwise")):
        wave = np.exp(-1j * way * angle)
        out, along = (wave * radial).mean(), (wave * tangential).mean()
        rest = [radial - out / wave, tangential - along / wave]
        whole = abs(abs(out) - 1.0) < RIGID and abs(abs(along) - 1.0) < RIGID
        if whole and np.abs(rest).max() < RIGID:
            first = round(float(np.degrees(np.angle(out)))) % 360
            sense = "with" if (along / out).imag > 0.0 else "against"
            raise MisplacedError(
                f"counted {told}, blade 0 at {first} degrees from x_o, tangential "
                f"motion positive {sense} the angle"
            )
