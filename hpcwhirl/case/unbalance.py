"""The circle of an unbalanced rotor: its steady motion without contact.

In the rotating frame the force of an unbalance, m e Omega^2, is constant, and so is the
rotor's response x_s to it. The kernels march what is left, y = x - x_s, which is free
of the force: it decays where there is no contact, its energy is that of the ledger, and
words judge it. Gaps, tips and the orbit are those of x.

A run begins on the circle, where that leaves `CLEAR` of the gap to every blade, else on
x_s scaled down until it does, at rest in the rotating frame.
"""

from __future__ import annotations

import cmath
import math
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import InputError
from hpcwhirl.reduction.model import Model
from hpcwhirl.reduction.waves import unbalance_response
from hpcwhirl.scene import Scene

Floats = NDArray[np.float64]
CLEAR = 0.1  # share of the gap that a run leaves to each blade as it begins
MOST_KEPT = 32  # cached circles, as of models


def force_of(scene: Scene) -> complex:
    """Return the force of a scene's unbalance, F_x + i F_y, N, rotating frame."""
    return scene.unbalance * scene.speed**2 * cmath.exp(1j * scene.unbalance_phase)


def circle(model: Model, scene: Scene) -> Floats | None:
    """Return x_s, the rotor's places on its circle; None without an unbalance.

    Returns
    -------
    (n,), m, rotating frame, in the coordinates of the rotor's matrices

    Raises
    ------
    InputError
        at a critical speed without damping
    """
    if scene.unbalance == 0.0:
        return None
    return _circle(model, force_of(scene), scene.speed)


@lru_cache(maxsize=MOST_KEPT)
def _circle(model: Model, force: complex, speed: float) -> Floats:
    try:
        places = unbalance_response(model.rotor, model.blades, force, speed)
    except np.linalg.LinAlgError:
        places = np.array([np.inf])
    if not np.isfinite(places).all():
        msg = (
            f"unbalance must be 0 at speed {speed:.6g}, a critical speed without "
            "damping"
        )
        raise InputError(msg)
    places.flags.writeable = False
    return places


def centre_of(model: Model, places: Floats) -> complex:
    """Return x_o + i y_o, m, of a rotor's places."""
    x, y = places[2 * model.blades : 2 * model.blades + 2]
    return complex(x, y)


def reach_of(model: Model, places: Floats) -> float:
    """Return how far the blade that is farthest out stands outward, m."""
    return float(places[0 : 2 * model.blades : 2].max())


def share_at_start(model: Model, scene: Scene, places: Floats) -> float:
    """Return the share of the circle, 0 to 1, at which a run begins."""
    reach, room = reach_of(model, places), (1.0 - CLEAR) * scene.gap
    return 1.0 if reach <= room else room / reach


def check_unbalance(model: Model, scene: Scene) -> None:
    """Raise InputError where the circle, without contact, ends a run by its size."""
    places = circle(model, scene)
    if places is None:
        return
    tips = places[: 2 * model.blades].reshape(-1, 2)
    far = float(np.hypot(*tips.T).max())
    most = scene.solver.amplitude_limit * scene.engine.rotor.radius
    if not far < most:
        msg = (
            f"unbalance must be < {scene.unbalance * most / far:.6g} kg m (its circle "
            f"would reach the amplitude limit, {most:g} m, without contact), "
            f"got {scene.unbalance:.6g}"
        )
        raise InputError(msg)


def facts_of_unbalance(model: Model, scene: Scene) -> dict[str, Any] | None:
    """Return the circle at the scene's speed as `model --json` shows it.

    Returns
    -------
    unbalance : kg m
    force : N, m e Omega^2
    radius : m, of the centre's circle
    lag : rad, angle of the centre behind the unbalance, in the sense of rotation
    reach : m, outward displacement of the tip that is farthest out
    over_gap : reach over gap; None where the gap is 0
    touches : whether the circle, without contact, would pass through the casing

    None without an unbalance.
    """
    places = circle(model, scene)
    if places is None:
        return None
    centre, force = centre_of(model, places), force_of(scene)
    lag = cmath.phase(force * centre.conjugate()) * math.copysign(1.0, scene.speed)
    reach = reach_of(model, places)
    return {
        "unbalance": scene.unbalance,
        "force": abs(force),
        "radius": abs(centre),
        "lag": lag,
        "reach": reach,
        "over_gap": reach / scene.gap if scene.gap > 0.0 else None,
        "touches": reach > scene.gap,
    }
