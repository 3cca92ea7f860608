"""Numbers of the loads of a shaft, and of the loss of a blade.

Friction brakes the rotor with the torque mu R lambda of each contact force lambda, and
the shaft drives it on with the same mean torque, since the rotor's angular momentum
about its axis stays bounded.
"""

from __future__ import annotations

import math

import numpy as np

from hpcwhirl.case.resolve import Case
from hpcwhirl.case.speed import speed_at
from hpcwhirl.dynamics.bodies.operators import friction_with_sign
from hpcwhirl.dynamics.history import History
from hpcwhirl.scene.rules import NO_BLADE
from hpcwhirl.structure.bladed_disk import NODE, blade


def shaft_numbers(history: History) -> dict[str, float | str]:
    """Return the largest loads of the shaft; {} if they were not read.

    history : what was recorded while the case was integrated
    """
    shaft = history.shaft
    if shaft is None:
        return {}
    found: dict[str, float | str] = {
        "support_peak": math.nan, "support_peak_time": math.nan,
        "support_peak_place": "", "torque_peak": math.nan,
        "support_names": "; ".join(shaft.names),
    }  # fmt: skip
    if not len(shaft.time):
        return found
    sizes, torque = np.hypot(*np.moveaxis(shaft.force, 2, 0)), np.abs(shaft.torque)
    row, place = np.unravel_index(sizes.argmax(), sizes.shape)
    return found | {
        "support_peak": float(sizes[row, place]),
        "support_peak_time": float(shaft.time[row]),
        "support_peak_place": shaft.names[place],
        "torque_peak": float(torque.max()),
    }


def loss_numbers(case: Case, history: History) -> dict[str, float]:
    """Return the results on a rotor that loses a blade; else {}.

    case, history : the case; what was recorded while it was integrated
    """
    if case.given.engine.rotor.lost_blade == NO_BLADE:
        return {}
    scene = case.scene
    drag = abs(friction_with_sign(scene)) * history.contact_impulse
    if history.rubbing is not None:
        drag = float(np.sign(scene.speed)) * history.rubbing.impulse
    return {
        "friction_torque": drag * scene.engine.rotor.radius / history.end,
        "released_energy": _released_energy(case),
    }


def _released_energy(case: Case) -> float:
    """Return the kinetic energy of the lost blade in the static frame, J.

    It turns with the rotor; its vibration is left out.
    """
    rotor, scene = case.scene.engine.rotor, case.scene
    if rotor.lost_blade == NO_BLADE:  # it would be lost after the run
        return 0.0
    moved = np.zeros((rotor.elements + 1, NODE))
    moved[:, 1] = np.linspace(rotor.disk_radius, rotor.radius, rotor.elements + 1)
    moved[:, 2] = 1.0
    inertia = moved.ravel() @ blade(rotor)[0] @ moved.ravel()
    return 0.5 * float(inertia * speed_at(scene, scene.lost_blade_time) ** 2)
