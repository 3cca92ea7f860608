"""Response of a rotor to its unbalance over the speed, without contact or integration.

At each speed the steady motion solves linear equations, see `case.unbalance`; with a
squeeze film those of the film at the radius of the circle. In the static frame each
point of the shaft moves on Z = f e^{i Omega t} + b e^{-i Omega t}, a circle (b = 0) or,
on supports that differ by direction, an ellipse of semi-axes |f| + |b| and ||f| - |b||.

The supports take the rotor's external loads less its inertia. With t the rigid
translation of all coordinates, on which elastic forces do no work,

F_f = t^T [F - (Omega^2 K_1 + Omega^4 K_2) x],
F_b = -t^T [-4 Omega^2 M - 4 i Omega^2 C + Omega^2 K_1 + Omega^4 K_2] conj(xi) / 2,

with x, xi the circle and the swing, F the unbalance's force and the other terms those
of `reduction.modes.Spin`. This is the force through shaft and supports to the ground,
whatever holds the rotor; it has the part of the damping that a translation meets. Of a
shaft line, forces and circles are those of `shaft_response`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from hpcwhirl.analysis.shaft_response import (
    forces_of,
    line_of_rotor,
    shaft_ellipses,
    stations_of,
)
from hpcwhirl.arrays import Complexes, Floats
from hpcwhirl.case.profile import room_of
from hpcwhirl.case.resolve import resolve
from hpcwhirl.case.unbalance import centre_of, exact_steady, force_of
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.criticals import damped_criticals
from hpcwhirl.reduction.families import rotor_by_diameter
from hpcwhirl.reduction.growth import search_range
from hpcwhirl.reduction.model import Model, model_of
from hpcwhirl.reduction.modes import stiffening_at
from hpcwhirl.reduction.steady import translation
from hpcwhirl.reduction.waves import unbalance_speeds
from hpcwhirl.scene import Scene, apply_settings
from hpcwhirl.scene.shaft_tables import WORDS

POINTS = 201  # equally spaced speeds of a response
AT_REST = 0.01  # lowest speed / highest
AROUND = np.array([0.0, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0])  # half widths of a peak
SHARP = 1e-5  # least damping ratio that sets speeds around a critical speed
PLACES = "centre", "tips", "supports"  # that every rotor has
STATION, SUPPORT = "station ", "support "  # and a number: further ones of a shaft line


@dataclass(frozen=True)
class Steady:
    """The steady motion of an unbalanced rotor at one speed, without contact.

    Attributes
    ----------
    speed : rad/s
    centre : (2,), m, f and b of the shaft's centre
    tips : (2,), m, f and b of a centre from which tips on rigid blades would move
        radially as those of the rotor do
    supports : (2,), N, f and b of the force of the rotor on what holds it
    stations : m, f and b of each station of a shaft line
    forces : N, f and b of the force on each support of a shaft line
    reach : m, largest outward displacement of a tip
    room : m, least gap of tips and casing at that speed
    """

    speed: float
    centre: tuple[complex, complex]
    tips: tuple[complex, complex]
    supports: tuple[complex, complex]
    reach: float
    room: float
    stations: tuple[tuple[complex, complex], ...] = ()
    forces: tuple[tuple[complex, complex], ...] = ()

    @property
    def places(self) -> tuple[str, ...]:
        """Names of the places whose motion or force is known."""
        return (
            *PLACES,
            *(f"{STATION}{i}" for i in range(len(self.stations))),
            *(f"{SUPPORT}{i}" for i in range(len(self.forces))),
        )

    def parts(self, place: str) -> tuple[complex, complex]:
        """Return f and b at one of `places`, m, or N of a force."""
        for start, values in ((STATION, self.stations), (SUPPORT, self.forces)):
            if place.startswith(start):
                return values[int(place.removeprefix(start))]
        found: tuple[complex, complex] = getattr(self, place)
        return found

    def size(self, place: str) -> float:
        """Return the amplitude at a place, the major semi-axis of the ellipse."""
        forward, backward = self.parts(place)
        return float(abs(forward) + abs(backward))

    @property
    def used(self) -> float:
        """Share of the clearance that the tips reach."""
        return self.reach / self.room if self.room > 0.0 else np.inf


def unit_of(place: str) -> str:
    """Return the SI unit of the amplitude at a place."""
    return "N" if place.startswith("support") else "m"


def check_response(scene: Scene) -> None:
    """Raise InputError where a scene has no response to an unbalance."""
    if scene.engine.rotation == "none":
        raise InputError(
            "engine.rotation must be full for the response to an unbalance, got none"
        )
    if scene.engine.rotor.centre == "clamped":
        raise InputError(
            "engine.rotor.centre must be free for the response to an unbalance, got "
            "clamped"
        )


def steady_at(scene: Scene, speed: float) -> Steady:
    """Return the steady motion of an unbalanced rotor at a speed, rad/s.

    Raises
    ------
    InputError
        at a critical speed without damping, where the circle would close a squeeze
        film, or beyond a bearing's table
    """
    return _steady_at(scene, speed)


@lru_cache(maxsize=4096)
def _steady_at(scene: Scene, speed: float) -> Steady:
    case = resolve(apply_settings(scene, {"speed": speed}))
    own, model = case.reduced, case.model
    found = exact_steady(model, own)
    places, back = found.still, found.of(2).conj() / 2
    radial = model.places[0]
    wave = 2 / model.contacts * np.exp(1j * model.angles)
    outward = found.farthest()[radial]
    tips = np.arange(model.contacts) != own.engine.rotor.lost_blade
    reached = (outward - model.clearances(0.0))[tips]
    running = own.model_copy(update={"gap": case.clearance})
    line = line_of_rotor(own.engine.rotor)
    stations: list[tuple[complex, complex]] = []
    forces: list[tuple[complex, complex]] = []
    on_supports = _on_supports(model, own, places, back)
    if line is not None:
        moved, supports = shaft_ellipses(own.engine.rotor, model, places, back, speed)
        *forces, on_supports = forces_of(supports, moved, speed)
        stations = stations_of(line, moved)
    return Steady(
        speed,
        (centre_of(model, places), centre_of(model, back)),
        (complex(wave @ places[radial]), complex(wave @ back[radial])),
        on_supports,
        float(reached.max()),
        room_of(running),
        tuple(stations),
        tuple(forces),
    )


def _on_supports(
    model: Model, scene: Scene, places: Floats, back: Complexes
) -> tuple[complex, complex]:
    """Return the force of the rotor on what holds it, f and b, N, static frame.

    places, back : (n,), m, x and conj(xi) / 2
    """
    spin, speed = model.rotor.terms, scene.speed
    moved = translation(model.rotor, model.blades)
    stiffened = stiffening_at(spin, speed)
    forward = force_of(scene) - moved @ (stiffened @ places)
    if spin.released is not None:
        forward += speed**2 * (moved @ spin.released)
    inertia = -4 * speed**2 * (model.rotor.mass + 1j * spin.coriolis) + stiffened
    return complex(forward), complex(-moved @ (inertia @ back))


def moving_mass(scene: Scene) -> float:
    """Return the mass of disk and blades, and of a shaft line, kg."""
    reduced = resolve(scene).reduced
    line = line_of_rotor(reduced.engine.rotor)
    if line is not None:
        reduced = apply_settings(reduced, {"shaft": WORDS[0], "shaft_station": 0})
    model = model_of(reduced)
    t = translation(model.rotor, model.blades)
    disk = float((t.conj() @ model.rotor.mass @ t).real) / 2
    return disk + (line.mass if line else 0.0)


def range_of(scene: Scene, highest: float) -> tuple[float, float]:
    """Return the speeds of a response, rad/s, of which a case may run at each.

    They end at `highest`, a bearing's table, or where blades lose their stiffness.
    """
    case = resolve(scene)
    rotor = rotor_by_diameter(case.model)
    span = search_range(rotor, case.model.blades, highest)
    high = min(span.high, highest)
    return max(span.low, AT_REST * high), high


def speeds_of(scene: Scene, low: float, high: float) -> list[float]:
    """Return the speeds at which to compute a response, rad/s, ascending.

    They are equally spaced, and denser around critical speeds, so that no peak is
    missed however sharp.

    low, high : rad/s
    """
    case, found = resolve(scene), [*np.linspace(low, high, POINTS)]
    rotor, blades = rotor_by_diameter(case.model), case.model.blades
    damped = damped_criticals(rotor, blades, high)
    peaks = [(one.speed, abs(one.growth)) for one in damped]
    peaks += [(speed, 0.0) for speed in unbalance_speeds(rotor, high)]
    for speed, decay in peaks:
        wide = max(decay, SHARP * speed) * AROUND
        found += [*(speed - wide), *(speed + wide)]
    return sorted({speed for speed in map(float, found) if low <= speed <= high})
