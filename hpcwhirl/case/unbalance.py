"""The circle of an unbalanced rotor: its steady motion without contact.

In the rotating frame the force of an unbalance, m e Omega^2, is constant, and so is the
rotor's response x_s to it. On supports that differ by direction the circle becomes an
ellipse, in the rotating frame x_s = x_1 + Re(xi e^{2 i Omega t}), and with unequal
sectors a sum of further even harmonics, see `reduction.steady`. The kernels integrate
the difference y = x - x_s, on which the force does not act: without contact it decays.
The energy ledger and the words are those of y; gaps, tips and the orbit are those of x.

A run begins on the circle if that leaves `CLEAR` of the gap at every blade, otherwise
on x_s scaled down until it does. If a blade is lost, whose pull at its root then
vanishes, the run begins undeflected and at rest. `start_energy` adds a motion to it.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import replace
from functools import lru_cache, partial
from typing import Any

import numpy as np

from hpcwhirl.arrays import Complexes, Floats
from hpcwhirl.case.profile import room_of
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.bearing_laws import force_at
from hpcwhirl.reduction.equilibrium import (
    bearing_at,
    equilibrium,
    loaded_of,
    loads_of_weight,
    on_springs,
    pushed_at,
)
from hpcwhirl.reduction.model import Model
from hpcwhirl.reduction.modes import Spin
from hpcwhirl.reduction.numbers import zero_between
from hpcwhirl.reduction.steady import Loads, Steady, steady_response
from hpcwhirl.reduction.supports import CLOSED, Bearing, Support, film_shares
from hpcwhirl.scene import Scene
from hpcwhirl.scene.rules import NO_BLADE

CLEAR = 0.1  # share of the gap that is left at each blade when a run begins
SWEEPS, ALIKE = 100, 1e-13  # over several films; relative change that ends them
MOST_KEPT = 32  # number of cached circles


def force_of(scene: Scene) -> complex:
    """Return the force of a scene's unbalance, F_x + i F_y, N, rotating frame."""
    return scene.unbalance * scene.speed**2 * cmath.exp(1j * scene.unbalance_phase)


def is_unbalanced(scene: Scene) -> bool:
    """Return whether the rotor has an unbalance, or has lost a blade."""
    return scene.unbalance > 0.0 or scene.engine.rotor.lost_blade != NO_BLADE


def loss_step(scene: Scene) -> int:
    """Return the time step at whose end a blade is lost; 0 if not during the run."""
    if scene.lost_blade_time == 0.0:
        return 0
    return max(1, round(scene.lost_blade_time / scene.solver.time_step))


def weighs(scene: Scene) -> bool:
    """Return whether the rotor has its weight."""
    return scene.gravity > 0.0


def has_steady(scene: Scene) -> bool:
    """Return whether the rotor has a `steady` motion other than rest."""
    return is_unbalanced(scene) or weighs(scene)


def weight_of(scene: Scene) -> complex:
    """Return the acceleration of gravity, g_x + i g_y, m/s^2, static frame."""
    return cmath.rect(scene.gravity, scene.gravity_angle)


def released_moment(model: Model) -> complex:
    """Return the unbalance m e, as x + i y, kg m, that the loss of a blade causes.

    Omega^2 times it is the force at the centre that does the same work as the missing
    centrifugal load, on the static deflection caused by a force at the centre.
    """
    spin, hub = model.rotor.spin, 2 * model.blades + np.arange(2)
    if spin is None or spin.released is None:
        return 0j
    moved = np.linalg.solve(model.rotor.stiffness, np.eye(len(spin.released))[:, hub])
    x, y = np.linalg.solve(moved[hub].T, moved.T @ spin.released)
    return complex(x, y)


def moment_of(model: Model, scene: Scene) -> complex:
    """Return the unbalance m e, as x + i y, kg m, with that of a lost blade."""
    own = cmath.rect(scene.unbalance, scene.unbalance_phase)
    return own + released_moment(model)


def steady(model: Model, scene: Scene) -> Steady | None:
    """Return the rotor's steady motion without contact; None if that is rest.

    On supports that are the same in all directions that of an unbalance is a circle,
    constant in the rotating frame, and the sag by the rotor's weight turns backward at
    Omega in this frame. Even harmonics are those of the unbalance, odd ones those of
    the weight, see `reduction.steady`.

    Raises
    ------
    InputError
        at a critical speed without damping
    """
    if not has_steady(scene):
        return None
    loads = force_of(scene), weight_of(scene)
    return _steady(model, loads, scene.speed, scene.solver.time_step)


def circle(model: Model, scene: Scene) -> Floats | None:
    """Return the part of `steady` that is constant in the rotating frame, (n,), m.

    It is in the n coordinates of the rotor's matrices; None for a balanced rotor.
    """
    found = steady(model, scene)
    return None if found is None else found.still


def swing(model: Model, scene: Scene) -> Complexes | None:
    """Return the part of `steady` that turns at 2 Omega, (n,), m; None without one.

    In the rotating frame it is Re(xi e^{2 i Omega t}), xi the result: with equal
    sectors all that supports that differ by direction add to the circle.
    """
    found = steady(model, scene)
    return None if found is None or 2 not in found.orders else found.of(2)


def steady_at(model: Model, scene: Scene, time: float) -> Floats:
    """Return the rotor's `steady` displacement at a time, s, (n,), m; 0 if balanced."""
    found = steady(model, scene)
    if found is None:
        return np.zeros(len(model.rotor.shapes))
    return found.at(scene.speed * time)


def steady_rates(model: Model, scene: Scene, time: float) -> Floats:
    """Return the rotor's steady velocity by unbalance at a time, s, (n,), m/s.

    It is (x_{n+1} - x_{n-1}) / 2 dt of `steady_at`.
    """
    step = scene.solver.time_step
    before, after = (steady_at(model, scene, time + d) for d in (-step, step))
    return np.asarray((after - before) / (2.0 * step))


def missing_at_start(model: Model, scene: Scene) -> tuple[Floats, Floats]:
    """Return the motion at the start less the steady one, (n,) each, m and m/s.

    It is 0 if the run begins on the steady motion. The rotor has its sag in any case.
    """
    found, none = steady(model, scene), np.zeros(len(model.rotor.shapes))
    share = share_at_start(model, scene)
    if found is None or share == 1.0:
        return none, none
    step, circling = scene.solver.time_step, found.only(0)
    before, now, after = (circling.at(scene.speed * t) for t in (-step, 0.0, step))
    return (share - 1.0) * now, (share - 1.0) / (2.0 * step) * (after - before)


def steady_start(model: Model, scene: Scene) -> tuple[Floats, Floats]:
    """Return the motion with which a run begins, (n,) each, of an unbalance and weight.

    It is a displacement, m, and a velocity, m/s, in the coordinates of `circle`.
    """
    less = missing_at_start(model, scene)
    whole = steady_at(model, scene, 0.0), steady_rates(model, scene, 0.0)
    return whole[0] + less[0], whole[1] + less[1]


def exact_steady(model: Model, scene: Scene) -> Steady:
    """Return the `steady` motion by unbalance without an error of steps."""
    return _steady(model, (force_of(scene), 0j), scene.speed, 0.0)


@lru_cache(maxsize=MOST_KEPT)
def _steady(
    model: Model, given: tuple[complex, complex], speed: float, step: float
) -> Steady:
    loads = _loads(model, given, speed)
    if step and loaded_of(model.rotor.spin):
        model, loads = _in_bearings(model, loads, given[1], speed)
    spin = model.rotor.spin
    try:
        if spin is not None and films_of(spin):
            found = _circle_in_films(model, spin, loads, speed)
        else:
            found = steady_response(model.rotor, model.blades, loads, speed, step)
    except np.linalg.LinAlgError:
        found = Steady(np.zeros(1, int), np.full((1, 1), np.inf + 0j))
    if not np.isfinite(found.shapes).all():
        raise InputError(
            f"unbalance and gravity must be 0 at speed {speed:.6g}, a critical speed "
            "without damping"
        )
    found.shapes.flags.writeable = False
    return found


def _loads(model: Model, given: tuple[complex, complex], speed: float) -> Loads:
    """Return the loads of unbalance, lost blade and weight, see `reduction.steady`.

    given : F_x + i F_y, N, rotating frame, of the unbalance; g_x + i g_y, m/s^2
    speed : Omega, rad/s
    """
    force, weight = given
    load = np.zeros(len(model.rotor.mass), dtype=complex)
    load[2 * model.blades : 2 * model.blades + 2] = force.real, force.imag
    if model.rotor.terms.released is not None:
        load += speed**2 * model.rotor.terms.released
    if weight == 0.0:
        return {0: load}
    return {0: load, **loads_of_weight(model.rotor, model.blades, weight)}


def weight_forces(model: Model, scene: Scene) -> Floats:
    """Return the forces of the rotor's weight, (2, n), N, rotating frame.

    They are factors of cos theta and sin theta, theta the rotor's angle.
    """
    if not weighs(scene):
        return np.zeros((2, len(model.rotor.mass)))
    weight = weight_of(scene)
    found = loads_of_weight(model.rotor, model.blades, weight)[1]
    return np.array([found.real, -found.imag])


def _in_bearings(
    model: Model, loads: Loads, weight: complex, speed: float
) -> tuple[Model, Loads]:
    """Return model and loads with which the sag is the equilibrium in bearings.

    Journal and rolling bearings become springs and dampers that are the same in all
    directions, and the rest of their force in equilibrium a load. So a circle beside
    the sag is round; what the bearings do beyond it is left to the time integration.

    loads, weight, speed : result of `_loads`; g_x + i g_y, m/s^2; Omega, rad/s
    """
    spin, rotor = model.rotor.terms, on_springs(model.rotor, speed)
    if weight != 0.0:
        found = equilibrium(model.rotor, model.blades, weight).at(speed)
        for i, place in zip(loaded_of(spin), found.tolist(), strict=True):
            held = rotor.terms.stations[i].support.at(speed).stiffness
            own = bearing_at(spin, i)
            force = force_at(own.law, place, speed) + (held + own.spring) * place
            loads = loads | {1: loads[1] + pushed_at(spin.stations[i], force)}
    return replace(model, rotor=rotor), loads


def films_of(spin: Spin) -> list[int]:
    """Return which of a rotor's supports, `Spin.supports`, are squeeze films."""
    every = enumerate(spin.supports)
    return [i for i, own in every if isinstance(own, Support) and own.film > 0.0]


def _circle_in_films(model: Model, spin: Spin, loads: Loads, speed: float) -> Steady:
    """Return the steady motion by unbalance with squeeze films.

    A film's damping depends on the radius of its circle, and is that at the radius that
    results. Of several films each radius is found with the last ones of the others.

    loads, speed : result of `_loads`; Omega, rad/s
    """
    places = films_of(spin)
    radii = dict.fromkeys(places, 0.0)

    def at(place: int, radius: float) -> Steady:
        damped = _with_films(spin, radii | {place: radius})
        turned = replace(model.rotor, spin=damped)
        return steady_response(turned, model.blades, loads, speed)

    def miss(place: int, radius: float) -> float:
        z = at(place, radius).still @ _rows_of(model, spin, place).T
        return float(np.hypot(*z)) - radius

    for _ in range(SWEEPS if len(places) > 1 else 1):
        last = dict(radii)
        for place in places:
            most = CLOSED * _film(spin, place).clearance
            if miss(place, most) > 0.0:
                raise _closing(_film(spin, place))
            radii[place] = zero_between(
                partial(miss, place), 0.0, most, xtol=1e-15, rtol=1e-14
            )
        if all(abs(radii[i] - last[i]) <= ALIKE * radii[i] for i in places):
            break
    return at(places[0], radii[places[0]])


def _closing(own: Support) -> InputError:
    return InputError(
        f"film_clearance must be > {own.clearance:.6g} m: the unbalance's circle would "
        f"exceed {CLOSED:g} of it, which closes the squeeze film"
    )


def _film(spin: Spin, place: int) -> Support:
    own = spin.supports[place]
    if isinstance(own, Bearing):
        raise TypeError(own)
    return own


def _rows_of(model: Model, spin: Spin, place: int) -> Floats:
    """Return the displacements x, y of a support for unit coordinates, (2, n)."""
    if place > 0:
        return np.asarray(spin.stations[place - 1].rows)
    return np.eye(len(model.rotor.mass))[2 * model.blades : 2 * model.blades + 2]


def _with_films(spin: Spin, radii: dict[int, float]) -> Spin:
    """Return terms of rotation with the damping of films at the radii of circles.

    radii : {index in `Spin.supports`: m}
    """
    changed = list(spin.supports)
    for i, radius in radii.items():
        own = _film(spin, i)
        across = own.film * (film_shares(radius / own.clearance)[1] - 1.0)
        changed[i] = replace(own, damping=own.damping + across)
    others = zip(spin.stations, changed[1:], strict=True)
    stations = tuple(replace(one, support=own) for one, own in others)
    return replace(spin, support=changed[0], stations=stations)


def centre_orbit(model: Model, scene: Scene, times: Floats) -> Complexes:
    """Return the centre's `steady` displacement x_o + i y_o at times, s, (b,), m."""
    found, hub = steady(model, scene), 2 * model.blades
    if found is None:
        return np.zeros(len(times), dtype=complex)
    turns = np.exp(1j * scene.speed * np.outer(times, found.orders))
    x, y = (turns @ found.shapes[:, hub : hub + 2]).real.T
    return np.asarray(x + 1j * y)


def centre_of(model: Model, places: Any) -> complex:
    """Return the displacement of the rotor's centre, x_o + i y_o, m.

    places : (n,), m, displacements of all coordinates of the rotor
    """
    x, y = places[2 * model.blades : 2 * model.blades + 2]
    return complex(x + 1j * y)


def reach_of(model: Model, scene: Scene) -> float:
    """Return the largest outward displacement of a tip in the steady motion, m.

    The tip of a lost blade is excluded; clearances of contact points in addition to the
    gap are subtracted.
    """
    found = steady(model, scene)
    return 0.0 if found is None else _reach(model, scene, found)


def _reach(model: Model, scene: Scene, found: Steady) -> float:
    outward = found.farthest()
    tips = np.arange(model.contacts) != scene.engine.rotor.lost_blade
    reached = outward[model.places[0]] - model.clearances(0.0)
    return float(reached[tips].max())


def share_at_start(model: Model, scene: Scene) -> float:
    """Return the part of the steady displacement by unbalance at the start, 0 to 1.

    It is 0 if a blade is lost, since the rotor was balanced before.
    """
    if scene.engine.rotor.lost_blade != NO_BLADE:
        return 0.0
    casing = scene.engine.casing
    clear = scene.gap if casing.profile_rise > 0.0 else room_of(scene)
    if casing.kind == "rigid" and casing.rise == 0.0:  # lobes held from the start
        clear -= abs(casing.amplitude)
    clear = max(clear, 0.0)
    found, room = steady(model, scene), (1.0 - CLEAR) * clear
    if found is None or _reach(model, scene, found) <= room:
        return 1.0
    sag = _reach(model, scene, found.only(1)) if weighs(scene) else 0.0
    return max(room - sag, 0.0) / _reach(model, scene, found.only(0))


def check_unbalance(model: Model, scene: Scene) -> None:
    """Raise InputError if a rotor's steady motion exceeds amplitude limit or gap.

    The unbalance must not move tips to the limit, nor the sag by weight into the wall.
    """
    found = steady(model, scene)
    if found is None:
        return
    sag, room = _reach(model, scene, found.only(1)), room_of(scene)
    if weighs(scene) and not sag < room:
        raise InputError(
            f"gravity must be < {scene.gravity * max(room, 0.0) / sag:.6g} m/s^2: the "
            f"rotor's sag moves blades by {sag:.6g} m, the gap leaves {room:.6g} m, "
            f"got {scene.gravity:.6g}"
        )
    found = found.only(0)
    sizes = found.sizes()
    tips = sizes[: 2 * model.blades].reshape(-1, 2)
    far = float(np.hypot(*tips.T).max())
    most = scene.solver.amplitude_limit * scene.engine.rotor.radius
    if not far < most and scene.engine.rotor.lost_blade != NO_BLADE:
        share = far / scene.engine.rotor.radius
        raise InputError(
            f"amplitude_limit must be > {share:.6g} (radius of the tips' circle after "
            "the loss of the blade, without contact, over the tip radius), got "
            f"{scene.solver.amplitude_limit:.6g}"
        )
    if not far < most:
        raise InputError(
            f"unbalance must be < {scene.unbalance * most / far:.6g} kg m (its circle "
            f"would reach the amplitude limit, {most:g} m, without contact), "
            f"got {scene.unbalance:.6g}"
        )


def check_films(model: Model, scene: Scene) -> None:
    """Raise InputError if the rotor's weight closes a squeeze film, beside its circle.

    A film has no stiffness: what holds the rotor beside it must keep the film open.
    """
    found, spin = steady(model, scene), model.rotor.spin
    if found is None or spin is None or not weighs(scene):
        return
    for place in films_of(spin):
        rows, clearance = _rows_of(model, spin, place), _film(spin, place).clearance
        sag = float(np.linalg.norm(np.abs(rows @ found.of(1)))) / math.sqrt(2.0)
        reached = sag + float(np.hypot(*(rows @ found.still)))
        if not reached < CLOSED * clearance:
            raise InputError(
                f"film_clearance must be > {reached / CLOSED:.6g} m: the sag by the "
                f"rotor's weight, {sag:.6g} m, would close the squeeze film, got "
                f"{clearance:.6g}"
            )


def check_stops(model: Model, scene: Scene) -> None:
    """Raise InputError if a rotor rests on a stop by its weight and circle."""
    found, spin = steady(model, scene), model.rotor.spin
    if found is None or spin is None:
        return
    for place in stops_of(spin):
        rows, own = _rows_of(model, spin, place), spin.supports[place]
        sag = float(np.linalg.norm(np.abs(rows @ found.of(1)))) / math.sqrt(2.0)
        reached = sag + float(np.hypot(*(rows @ found.still)))
        if isinstance(own, Support) and not reached < own.stop:
            raise InputError(
                f"stop_clearance must be > {reached:.6g} m: the rotor would rest on "
                f"the stop without any contact of blades, got {own.stop:.6g}"
            )


def stops_of(spin: Spin) -> list[int]:
    """Return which of a rotor's supports, `Spin.supports`, are or have stops."""
    every = enumerate(spin.supports)
    return [i for i, own in every if isinstance(own, Support) and own.stop > 0.0]


def facts_of_unbalance(model: Model, scene: Scene) -> dict[str, Any] | None:
    """Return the facts on the circle of an unbalance that `model --json` shows.

    Returns
    -------
    unbalance : kg m, m e, including that of a lost blade
    force : N, m e Omega^2
    radius : m, of the centre's circle; for an ellipse that of its forward part
    backward : m, radius of the backward part, if supports differ by direction
    lag : rad, angle by which the centre lags the unbalance, in the sense of rotation
    reach : m, outward displacement of the tip that is farthest out
    over_gap : reach divided by the least gap; None if that gap is 0
    touches : whether the circle, without contact, would pass through the casing

    None without an unbalance.
    """
    found = steady(model, scene)
    if found is None or not is_unbalanced(scene):
        return None
    centre = centre_of(model, found.still)
    moment = moment_of(model, scene)
    force = scene.speed**2 * moment
    lag = cmath.phase(force * centre.conjugate()) * math.copysign(1.0, scene.speed)
    reach, room = reach_of(model, scene), room_of(scene)
    back = centre_of(model, found.of(2).conj()) / 2
    return {
        "unbalance": abs(moment),
        "force": abs(force),
        "radius": abs(centre),
        "backward": abs(back),
        "lag": lag,
        "reach": reach,
        "over_gap": reach / room if room > 0.0 else None,
        "touches": reach > room,
    }


def facts_of_weight(model: Model, scene: Scene) -> dict[str, Any] | None:
    """Return the facts on the sag by the rotor's weight that `model --json` shows.

    Returns
    -------
    sag : m, displacement of the centre, constant in the static frame
    angle : rad, its direction there
    change : m, change of a blade's gap in a revolution, largest less least
    over_gap : half the change over the least gap; None if that gap is 0

    None without gravity.
    """
    found, room = steady(model, scene), room_of(scene)
    if found is None or not weighs(scene):
        return None
    sag = centre_of(model, found.of(1).conj()) / 2
    change = 2.0 * float(np.abs(found.of(1)[model.places[0]]).max())
    return {
        "sag": abs(sag),
        "angle": cmath.phase(sag),
        "change": change,
        "over_gap": 0.5 * change / room if room > 0.0 else None,
    }
