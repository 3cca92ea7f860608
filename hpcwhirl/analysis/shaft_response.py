"""Circles along a shaft line, and forces of its supports, from those of its disk.

The bladed disk's displacement and slope are those of the reduced rotor. They are
imposed on the whole line, whose other coordinates follow from its equations of steady
whirl, Z = Y e^{i Omega t} in the static frame, see `reduction.shaft_whirl`. So places
that the reduction does not keep are known, too.
"""

from __future__ import annotations

import numpy as np

from hpcwhirl.arrays import Complexes, Floats, Indices
from hpcwhirl.case.unbalance import centre_of
from hpcwhirl.reduction.model import Model
from hpcwhirl.reduction.shaft_whirl import held_by, whirl_matrices
from hpcwhirl.scene import Rotor
from hpcwhirl.scene.shaft_tables import WORDS
from hpcwhirl.structure.shaft import GROUND, NODE, ShaftLine, line_of


def line_of_rotor(rotor: Rotor) -> ShaftLine | None:
    """Return the shaft line of a rotor; None if it is on springs or a massless one."""
    return None if rotor.shaft in WORDS else line_of(rotor.shaft)


def shaft_circles(
    rotor: Rotor, model: Model, places: Floats, speed: float
) -> Complexes:
    """Return the circles of a shaft line's coordinates, (n,), m and rad, static frame.

    rotor, model : inputs, with a shaft line; the model of all sectors
    places, speed : m, circle of all coordinates of the reduced rotor, see
        `reduction.steady.Steady.still`; Omega, rad/s, > 0
    """
    line, spin = line_of(rotor.shaft), model.rotor.terms
    x, y = places[list(spin.tilt[:2])]
    slope = complex(x, -y if model.rotor.cyclic else y)
    whole, held = dynamic_stiffness(line, speed), disk_of(rotor, line)
    moved = np.zeros(line.size, dtype=np.complex128)
    moved[held] = centre_of(model, places), slope
    free = np.setdiff1d(np.arange(line.size), held)
    load = -whole[np.ix_(free, held)] @ moved[held]
    moved[free] = np.linalg.solve(whole[np.ix_(free, free)], load)
    return moved


def disk_of(rotor: Rotor, line: ShaftLine) -> Indices:
    """Return the two coordinates of a shaft line, Z and Phi, at the bladed disk."""
    first = NODE * line.stations[rotor.shaft_station]
    return np.array([first, first + 1], dtype=np.intp)


def dynamic_stiffness(line: ShaftLine, speed: float) -> Complexes:
    """Return the matrix of a line's forward steady whirl at a speed, rad/s, (n, n)."""
    own, s, n = whirl_matrices(line, held_by(line), speed), 1j * speed, line.size
    whole = s**2 * own.mass + s * own.damping + own.stiffness
    return np.asarray(whole[:n, :n])


def stations_of(line: ShaftLine, moved: Complexes) -> list[complex]:
    """Return the displacement of each station, m, of coordinates (n,)."""
    return [complex(moved[NODE * node]) for node in line.stations]


def forces_of(line: ShaftLine, moved: Complexes, speed: float) -> list[complex]:
    """Return the force on each support of a line, N, and what the ground takes, last.

    moved, speed : (n,), m, circles of all coordinates; Omega, rad/s
    """
    found, ground = [], 0j
    for one in held_by(line):
        own = one.support.at(speed)
        way = moved[one.at] - (0.0 if one.to == GROUND else moved[one.to])
        found.append(complex((own.stiffness + 1j * speed * own.damping) * way))
        ground += found[-1] if one.to == GROUND else 0.0
    return [*found, ground]
