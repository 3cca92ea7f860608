"""Ellipses along a shaft line, and forces of its supports, from those of its disk.

The bladed disk's displacement and slope are those of the reduced rotor. They are
imposed on the whole line, whose other coordinates follow from its equations of steady
whirl, Z = f e^{i Omega t} + b e^{-i Omega t} in the static frame, see
`reduction.shaft_whirl`. So places that the reduction does not keep are known, too. A
squeeze film has the damping at the radius of its circle.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hpcwhirl.arrays import Complexes, Floats, Indices
from hpcwhirl.case.unbalance import centre_of
from hpcwhirl.reduction.model import Model
from hpcwhirl.reduction.shaft_whirl import Held, held_by, whirl_matrices
from hpcwhirl.reduction.supports import LoadedBearing, Support, film_shares
from hpcwhirl.scene import Rotor
from hpcwhirl.scene.shaft_tables import WORDS
from hpcwhirl.structure.shaft import (
    GROUND,
    INNER,
    NODE,
    WHOLE,
    ShaftLine,
    line_of,
)


def line_of_rotor(rotor: Rotor) -> ShaftLine | None:
    """Return the shaft line of a rotor; None if it is on springs or a massless one."""
    return None if rotor.shaft in WORDS else line_of(rotor.shaft)


def shaft_ellipses(
    rotor: Rotor, model: Model, places: Floats, back: Complexes, speed: float
) -> tuple[Complexes, tuple[Held, ...]]:
    """Return a shaft line's f and b, (2, n), m and rad, and its supports as they act.

    rotor, model : inputs, with a shaft line; the model of all sectors
    places, back : (n,), m, circle of all coordinates of the reduced rotor, see
        `reduction.steady.Steady.still`, and what turns backward, conj(xi) / 2
    speed : Omega, rad/s, > 0
    """
    line = line_of(rotor.shaft)
    supports, held = _supports(line, model, places), disk_of(rotor, line)
    whole, n = dynamic_stiffness(line, speed, supports), line.size
    moved = np.zeros(2 * n, dtype=np.complex128)  # f and conj(b)
    fixed = np.append(held, n + held)
    both = _at_disk(model, places), np.conj(_at_disk(model, back))
    moved[fixed] = np.concatenate(both)
    free = np.setdiff1d(np.arange(2 * n), fixed)
    load = -whole[np.ix_(free, fixed)] @ moved[fixed]
    moved[free] = np.linalg.solve(whole[np.ix_(free, free)], load)
    return np.stack([moved[:n], moved[n:].conj()]), supports


def _at_disk(model: Model, places: Floats | Complexes) -> Complexes:
    """Return displacement and slope of the shaft at the bladed disk, (2,), complex.

    model, places : the model; (n,), displacements of the reduced rotor's coordinates
    """
    x, y = places[list(model.rotor.terms.tilt[:2])]
    return np.array(
        [centre_of(model, places), x + (-1j if model.rotor.cyclic else 1j) * y]
    )


def _supports(line: ShaftLine, model: Model, places: Floats) -> tuple[Held, ...]:
    """Return the supports of a line, films with the damping on their circles.

    model, places : as in `shaft_ellipses`
    """
    stations, out = iter(model.rotor.terms.stations), []
    for own, held in zip(line.supports, held_by(line), strict=True):
        support, one = held.support, None if own.is_spring else next(stations)
        if one is not None and isinstance(one.support, LoadedBearing):
            support = replace(one.support, spring=0.0)
        if one is not None and own.film:
            radius = float(np.hypot(*(one.rows @ places)))
            across = film_shares(radius / own.clearance)[1]
            support = Support(damping=own.film * across + 0j)
        out.append(replace(held, support=support))
    return tuple(out)


def disk_of(rotor: Rotor, line: ShaftLine) -> Indices:
    """Return the two coordinates of a shaft line, Z and Phi, at the bladed disk."""
    first = NODE * line.stations[rotor.shaft_station]
    return np.array([first, first + 1], dtype=np.intp)


def dynamic_stiffness(
    line: ShaftLine, speed: float, supports: tuple[Held, ...]
) -> Complexes:
    """Return the matrix of a line's steady whirl (f, conj(b)) at a speed, (2 n, 2 n).

    speed, supports : rad/s; what holds the line
    """
    own, s = whirl_matrices(line, supports, speed), 1j * speed
    return np.asarray(s**2 * own.mass + s * own.damping + own.stiffness)


def stations_of(line: ShaftLine, moved: Complexes) -> list[tuple[complex, complex]]:
    """Return f and b of each station, m; moved : (2, n), f and b of all coordinates."""
    return [pair_of(moved[:, NODE * node]) for node in line.stations]


def pair_of(parts: Complexes) -> tuple[complex, complex]:
    """Return f and b as numbers, from an array (2,)."""
    return complex(parts[0]), complex(parts[1])


def forces_of(
    supports: tuple[Held, ...], moved: Complexes, speed: float
) -> list[tuple[complex, complex]]:
    """Return f and b of the force on each support of a line, N; last, on the ground.

    It includes the reaction m Z'' of a support's added mass. The branches of a support
    over the whirl's frequency are parts of its force.

    supports, moved : as `shaft_ellipses` returns them; speed : Omega, rad/s
    """
    found: list[Complexes] = []
    ground = np.zeros(2, dtype=np.complex128)
    for one in supports:
        if one.part == INNER:
            continue
        own = one.support.at(speed)
        way = moved[:, one.at] - (0.0 if one.to == GROUND else moved[:, one.to])
        turns = 1j * speed * np.array([1.0, -1.0])
        force = (own.stiffness + turns * (own.damping + turns * one.mass)) * way
        force += (own.stiffness_apart + turns * own.damping_apart) * way[::-1].conj()
        if one.part == WHOLE:
            found.append(force)
        else:
            found[one.part] = found[one.part] + force
        whole = one if one.part == WHOLE else supports[one.part]
        ground += force if whole.to == GROUND else 0.0
    return [*map(pair_of, found), pair_of(ground)]
