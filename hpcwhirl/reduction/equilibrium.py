"""The equilibrium of a rotor under its weight in journal and rolling bearings.

Z (s,) are the displacements in these bearings, static frame, where the rotor does not
move. With springs k_r in their place, which its stiffness matrix has, forces f on the
bearings move them by G f beyond the Z_0 of the weight, so that

S Z = P + F(Z), S = G^-1 - k_r, P = G^-1 Z_0:

S is the stiffness of the rotor that only its other supports hold, P the load of the
bearings: where they alone carry a rigid rotor on two of them, S = 0. Newton's method
begins where each carries its load, halves steps that leave a film, and ends at
round-off. G and Z_0 are those of a turning rotor: damping that rotates moves the sag to
the side, and blades bend once a revolution.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from hpcwhirl.arrays import Complexes, Floats
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.bearing_laws import (
    Journal,
    Law,
    force_at,
    linearised,
    place_under,
)
from hpcwhirl.reduction.modes import ModalModel, Spin
from hpcwhirl.reduction.steady import Loads, steady_response, translation
from hpcwhirl.reduction.supports import LoadedBearing, Station, Support

ITERATIONS, HALVINGS = 60, 40
MISSED = 1e-6  # largest force that an equilibrium leaves, relative to the loads
SETTLED = 1e-13  # relative change of Z at which Newton's method ends
WIDEST = 0.99  # eps up to which the equilibrium is sought
MOST_KEPT = 32  # number of cached rotors


def loads_of_weight(model: ModalModel, blades: int, weight: complex) -> Loads:
    """Return the load of a rotor's weight, {1: (n,), N}, see `steady`.

    model, blades, weight : rotor with terms of rotation; N; g_x + i g_y, m/s^2
    """
    carried = model.mass @ translation(model, blades)
    if model.terms.hung is not None:
        carried = carried + [1.0, 1.0j] @ model.terms.hung
    return {1: carried * weight.conjugate()}


def loaded_of(spin: Spin | None) -> list[int]:
    """Return which stations of a rotor are journal or rolling bearings."""
    stations = spin.stations if spin else ()
    of_kind = [isinstance(one.support, LoadedBearing) for one in stations]
    return [i for i, found in enumerate(of_kind) if found]


def bearing_at(spin: Spin, place: int) -> LoadedBearing:
    """Return the bearing at a station of `loaded_of`."""
    own = spin.stations[place].support
    if not isinstance(own, LoadedBearing):
        raise TypeError(own)
    return own


def on_springs(model: ModalModel, speed: float | None) -> ModalModel:
    """Return a rotor with linear supports in place of its bearings, alike in x and y.

    speed : rad/s, of their linearisation; None: the springs in the stiffness matrix
    """
    spin, stations, turned = model.terms, list(model.terms.stations), speed or 0.0
    for i in loaded_of(spin):
        here = Support() if speed is None else bearing_at(spin, i).at(turned)
        alike = Support(here.stiffness, here.damping.real + 0j)
        unmirrored = alike.at(turned)  # as `Support.at` mirrors it at this speed
        stations[i] = replace(stations[i], support=unmirrored)
    return replace(model, spin=replace(spin, stations=tuple(stations)))


def pushed_at(station: Station, force: complex) -> Complexes:
    """Return the load of a force that is constant in the static frame, (n,), h = 1.

    station, force : where it acts; N, complex, static frame
    """
    return np.asarray([1.0, 1.0j] @ station.rows) * force.conjugate()


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """The equilibrium of a rotor in its bearings, at any speed.

    Attributes
    ----------
    model, blades : rotor with terms of rotation; N
    weight : g_x + i g_y, m/s^2
    """

    model: ModalModel
    blades: int
    weight: complex

    @cached_property
    def places(self) -> list[int]:
        """The stations of the bearings."""
        return loaded_of(self.model.terms)

    @cached_property
    def least(self) -> float:
        """Least speed, rad/s, at which films carry the loads that they have at rest."""
        _, loads = self.reduced(0.0)
        laws = [bearing_at(self.model.terms, i).law for i in self.places]
        each = zip(laws, np.abs(loads).tolist(), strict=True)
        return max((law.slowest(load) for law, load in each), default=0.0)

    def at(self, speed: float) -> Complexes:
        """Return Z, (s,), m, at a speed, rad/s."""
        return _solved(self, speed)

    def reduced(self, speed: float) -> tuple[Floats, Complexes]:
        """Return S, (2 s, 2 s), N/m, in x, y of each bearing, and P, (s,), N."""
        sprung, spin = on_springs(self.model, None), self.model.terms
        stations = [spin.stations[i] for i in self.places]

        def moved(loads: Loads) -> Floats:
            found = steady_response(sprung, self.blades, loads, speed).of(1)
            x, y = np.array([one.rows @ found for one in stations]).T
            return np.asarray((x - 1j * y).conj() / 2).view(float)

        unit = [pushed_at(one, way) for one in stations for way in (1.0 + 0j, 1j)]
        give = np.column_stack([moved({1: load}) for load in unit])
        hung = moved(loads_of_weight(sprung, self.blades, self.weight))
        both = np.linalg.solve(give, np.column_stack([np.eye(len(give)), hung]))
        stiff, load = both[:, :-1], np.ascontiguousarray(both[:, -1])
        held = [bearing_at(spin, i).spring for i in self.places]
        rest = stiff - np.diag(np.array(held, dtype=np.float64).repeat(2))
        return np.asarray(rest, dtype=np.float64), load.view(np.complex128)


@dataclass(frozen=True, eq=False)
class _Balance:
    """The equations S Z = P + F(Z) of a rotor at a speed.

    Attributes
    ----------
    laws, speed : of the bearings; Omega, rad/s
    stiff, load : S, (2 s, 2 s), N/m; P, (s,), N
    """

    laws: list[Law]
    speed: float
    stiff: Floats
    load: Complexes

    def start(self) -> Complexes:
        """Return where each bearing carries its load, (s,), m."""
        each = zip(self.laws, self.load.tolist(), strict=True)
        return np.array([place_under(law, load, self.speed) for law, load in each])

    def rest(self, z: Complexes) -> Floats:
        """Return what is left of the equations at Z, (2 s,), N."""
        each = zip(self.laws, z.tolist(), strict=True)
        forces = [force_at(law, place, self.speed) for law, place in each]
        return np.asarray(self.stiff @ z.view(float) - (self.load + forces).view(float))

    def step(self, z: Complexes, left: Floats) -> Complexes:
        """Return the step of Newton's method from Z, (s,), m; left : `rest`."""
        slope = self.stiff.copy()
        for i, (law, place) in enumerate(zip(self.laws, z.tolist(), strict=True)):
            two = slice(2 * i, 2 * i + 2)
            slope[two, two] += linearised(law, place, self.speed)[0]
        return np.linalg.lstsq(slope, -left, rcond=None)[0].view(complex)

    def is_within(self, z: Complexes) -> bool:
        """Return whether films are left between journals and their bearings."""
        each = zip(self.laws, np.abs(z).tolist(), strict=True)
        films = ((law, e) for law, e in each if isinstance(law, Journal))
        return all(e < WIDEST * law.clearance for law, e in films)

    def ahead(self, z: Complexes, left: Floats) -> Complexes:
        """Return a step that leaves less of the equations, (s,), m; 0 if none does."""
        step = self.step(z, left)
        for _ in range(HALVINGS):
            tried = z + step
            if self.is_within(tried) and _size(self.rest(tried)) < _size(left):
                return step
            step = step / 2.0
        return np.zeros_like(z)


@lru_cache(maxsize=4096)
def _solved(own: Equilibrium, speed: float) -> Complexes:
    laws = [bearing_at(own.model.terms, i).law for i in own.places]
    equations = _Balance(laws, speed, *own.reduced(speed))
    z = equations.start()
    for _ in range(ITERATIONS):
        step = equations.ahead(z, equations.rest(z))
        z = z + step
        if _size(step.view(float)) <= SETTLED * _size(z.view(float)):
            break
    load = equations.load
    if not _size(equations.rest(z)) <= MISSED * _size(load.view(float)):
        loads = ", ".join(f"{size:.4g}" for size in np.abs(load).tolist())
        raise InputError(
            "gravity must let the rotor rest in the bearings of its shaft: at "
            f"{speed:.6g} rad/s, no equilibrium was found under loads of {loads} N; "
            "set another speed, clearance or viscosity"
        )
    z.flags.writeable = False
    return z


def _size(values: Floats) -> float:
    return math.sqrt(float(values @ values))


@lru_cache(maxsize=MOST_KEPT)
def equilibrium(model: ModalModel, blades: int, weight: complex) -> Equilibrium:
    """Return the equilibrium of a rotor; kept for its last models."""
    return Equilibrium(model, blades, weight)


@lru_cache(maxsize=MOST_KEPT)
def loaded(model: ModalModel, blades: int, weight: complex) -> ModalModel:
    """Return a rotor whose bearings are linearised about its equilibrium.

    A rotor without journal or rolling bearings, or without weight, is returned
    unchanged.

    model, blades, weight : rotor; N; g_x + i g_y, m/s^2
    """
    places = loaded_of(model.spin)
    if not places or weight == 0.0:
        return model
    found, spin = equilibrium(model, blades, weight), model.terms
    stations = list(spin.stations)
    for order, i in enumerate(places):

        def sag(speed: float, order: int = order) -> complex:
            return complex(found.at(speed)[order])

        support = replace(bearing_at(spin, i), sag=sag, least=found.least)
        stations[i] = replace(stations[i], support=support)
    return replace(model, spin=replace(spin, stations=tuple(stations)))
