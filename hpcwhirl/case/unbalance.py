"""The circle of an unbalanced rotor: its steady motion without contact.

In the rotating frame the force of an unbalance, m e Omega^2, is constant, and so is the
rotor's response x_s to it. On supports that differ by direction the circle becomes an
ellipse, in the rotating frame x_s = x_1 + Re(xi e^{2 i Omega t}). The kernels integrate
the difference y = x - x_s, on which the force does not act: without contact it decays.
The energy ledger and the words are those of y; gaps, tips and the orbit are those of x.

A run begins on the circle if that leaves `CLEAR` of the gap at every blade, otherwise
on x_s scaled down until it does, at rest in the rotating frame. If a blade is lost,
whose pull at its root then vanishes, the run begins undeflected and at rest.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from hpcwhirl.arrays import Complexes, Floats
from hpcwhirl.case.profile import room_of
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.model import Model
from hpcwhirl.reduction.modes import Spin
from hpcwhirl.reduction.numbers import zero_between
from hpcwhirl.reduction.supports import CLOSED, Bearing, film_shares
from hpcwhirl.reduction.waves import unbalance_response
from hpcwhirl.scene import Scene
from hpcwhirl.scene.rules import NO_BLADE

CLEAR = 0.1  # share of the gap that is left at each blade when a run begins
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


def circle(model: Model, scene: Scene) -> Floats | None:
    """Return the rotor's steady displacement by unbalance without contact.

    It is None for a balanced rotor. On supports that differ by direction it is the
    constant part x_1, to which `swing` is added.

    Returns
    -------
    (n,), m, rotating frame, of the n coordinates of the rotor's matrices

    Raises
    ------
    InputError
        at a critical speed without damping
    """
    return _steady(model, scene)[0] if is_unbalanced(scene) else None


def swing(model: Model, scene: Scene) -> Complexes | None:
    """Return the part of the steady motion by unbalance that turns at 2 Omega, (n,), m.

    In the rotating frame the rotor moves by Re(xi e^{2 i Omega t}), xi the result,
    about `circle`, in the same n coordinates. None if the rotor is balanced, or if the
    supports are the same in all directions.
    """
    spin = model.rotor.spin
    if not is_unbalanced(scene) or spin is None or spin.support.is_round:
        return None
    return _steady(model, scene)[1]


def steady_at(model: Model, scene: Scene, time: float) -> Floats:
    """Return the rotor's steady displacement by unbalance at a time, s, (n,), m.

    There is no contact. The rotating frame and the n coordinates are those of `circle`
    and `swing`, from which it follows; it is 0 without an unbalance.
    """
    places, swung = circle(model, scene), swing(model, scene)
    if places is None:
        return np.zeros(len(model.rotor.shapes))
    if swung is None:
        return places
    return np.asarray(places + (swung * cmath.exp(2j * scene.speed * time)).real)


def exact_steady(model: Model, scene: Scene) -> tuple[Floats, Complexes]:
    """Return (circle, swing) of an unbalanced rotor without an error of time steps.

    `swing` is 0 on supports that are the same in all directions. See `circle`, which
    has the steady motion of the scene's scheme, for coordinates and errors.
    """
    return _circle(model, force_of(scene), scene.speed, 0.0)


def _steady(model: Model, scene: Scene) -> tuple[Floats, Complexes]:
    speed, step = scene.speed, scene.solver.time_step
    return _circle(model, force_of(scene), speed, step)


@lru_cache(maxsize=MOST_KEPT)
def _circle(
    model: Model, force: complex, speed: float, step: float
) -> tuple[Floats, Complexes]:
    spin = model.rotor.spin
    try:
        if spin is not None and spin.support.at(speed).film:
            found = _circle_in_film(model, spin, force, speed)
        else:
            found = unbalance_response(model.rotor, model.blades, force, speed, step)
    except np.linalg.LinAlgError:
        found = np.array([np.inf]), np.zeros(1, dtype=np.complex128)
    if not all(np.isfinite(part).all() for part in found):
        raise InputError(
            f"unbalance must be 0 at speed {speed:.6g}, a critical speed without "
            "damping"
        )
    for part in found:
        part.flags.writeable = False
    return found


def _circle_in_film(
    model: Model, spin: Spin, force: complex, speed: float
) -> tuple[Floats, Complexes]:
    """Return (circle, swing), the steady motion by unbalance, with a squeeze film.

    The film's damping depends on the radius of the centre's circle, and is that at the
    radius that results.

    force, speed : F_x + i F_y, N, rotating frame; Omega, rad/s
    """
    own = spin.support
    if isinstance(own, Bearing):  # refused beside a film
        raise TypeError(own)

    def at(radius: float) -> tuple[Floats, Complexes]:
        across = own.film * (film_shares(radius / own.clearance)[1] - 1.0)
        support = replace(own, damping=own.damping + across)
        turned = replace(model.rotor, spin=replace(spin, support=support))
        return unbalance_response(turned, model.blades, force, speed)

    def miss(radius: float) -> float:
        return abs(centre_of(model, at(radius)[0])) - radius

    most = CLOSED * own.clearance
    if miss(most) > 0.0:
        raise InputError(
            f"film_clearance must be > {own.clearance:.6g} m: the unbalance's circle "
            f"would exceed {CLOSED:g} of it, which closes the squeeze film"
        )
    return at(zero_between(miss, 0.0, most, xtol=1e-15, rtol=1e-14))


def centre_of(model: Model, places: Any) -> complex:
    """Return the displacement of the rotor's centre, x_o + i y_o, m.

    places : (n,), m, displacements of all coordinates of the rotor
    """
    x, y = places[2 * model.blades : 2 * model.blades + 2]
    return complex(x + 1j * y)


def reach_of(model: Model, scene: Scene) -> float:
    """Return the largest outward displacement of a tip on the unbalance's circle, m.

    The tip of a lost blade is excluded; clearances of contact points in addition to the
    gap are subtracted.
    """
    places, swung = circle(model, scene), swing(model, scene)
    if places is None:
        return 0.0
    outward = places if swung is None else places + np.abs(swung)
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
    reach, room = reach_of(model, scene), (1.0 - CLEAR) * clear
    return 1.0 if reach <= room else room / reach


def check_unbalance(model: Model, scene: Scene) -> None:
    """Raise InputError if unbalance alone moves tips to the amplitude limit."""
    places = circle(model, scene)
    if places is None:
        return
    swung = swing(model, scene)
    sizes = np.abs(places) if swung is None else np.abs(places) + np.abs(swung)
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
    places = circle(model, scene)
    if places is None:
        return None
    centre = centre_of(model, places)
    own = cmath.rect(scene.unbalance, scene.unbalance_phase)
    lost = released_moment(model)
    force = force_of(scene) + scene.speed**2 * lost
    lag = cmath.phase(force * centre.conjugate()) * math.copysign(1.0, scene.speed)
    reach, swung = reach_of(model, scene), swing(model, scene)
    room = room_of(scene)
    back = 0j if swung is None else centre_of(model, swung.conj()) / 2
    return {
        "unbalance": abs(own + lost),
        "force": abs(force),
        "radius": abs(centre),
        "backward": abs(back),
        "lag": lag,
        "reach": reach,
        "over_gap": reach / room if room > 0.0 else None,
        "touches": reach > room,
    }
