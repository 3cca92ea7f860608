"""The force of the shaft's support on a rotor that loses a blade, and its torque.

The centre, Z = X_o + i Y_o in the static frame, is held by springs, dampers and a
squeeze film that do not rotate, see `reduction.supports`. Their force on the rotor
follows from Z and its velocity, which a cubic spline through the samples gives.

Friction brakes the rotor with the torque mu R lambda of each contact force lambda, and
the shaft drives it on with the same mean torque, since the rotor's angular momentum
about its axis stays bounded.
"""

from __future__ import annotations

import math

import numpy as np

from hpcwhirl.analysis.whirl import static_frame
from hpcwhirl.arrays import Floats
from hpcwhirl.case.resolve import Case
from hpcwhirl.case.speed import angle_at, speed_at
from hpcwhirl.dynamics.bodies.operators import friction_with_sign
from hpcwhirl.dynamics.history import History
from hpcwhirl.reduction.supports import film_shares
from hpcwhirl.scene.rules import NO_BLADE
from hpcwhirl.structure.bladed_disk import NODE, blade

FEWEST = 4  # samples of a cubic spline


def support_force(case: Case, time: Floats, centre: Floats) -> Floats:
    """Return the force of the support on the rotor at n samples, (n, 2), N.

    It is in the static frame. (0, 2) with too few samples, and where a shaft that bends
    holds the disk, whose slope acts, too.

    time, centre : (n,), s, ascending; (n, 2), m, static frame
    """
    spin = case.model.rotor.spin
    if len(time) < FEWEST or spin is None or spin.tilt:
        return np.zeros((0, 2))
    from scipy.interpolate import CubicSpline  # slow to import

    z, held = centre @ [1.0, 1.0j], case.scene.engine.rotor.centre_stiffness
    rate = CubicSpline(time, centre).derivative()(time) @ [1.0, 1.0j]
    force = -held * z
    speeds, which = np.unique(speed_at(case.scene, time), return_inverse=True)
    supports = [spin.support.at(float(speed)) for speed in speeds]
    for name, factor in (
        ("stiffness", z), ("damping", rate),
        ("stiffness_apart", z.conj()), ("damping_apart", rate.conj()),
    ):  # fmt: skip
        force -= np.array([getattr(one, name) for one in supports])[which] * factor
    own = supports[0]
    if own.film > 0.0:
        force -= own.film * _beyond_small(z, rate, own.clearance)
    return np.stack([force.real, force.imag], axis=1)


def _beyond_small(z: Floats, rate: Floats, clearance: float) -> Floats:
    """Return the velocity by which a film's force exceeds that of small motions, m/s.

    z, rate, clearance : (n,), m, m/s, complex, of the centre; m
    """
    size = np.abs(z)
    way = np.divide(z, size, out=np.ones_like(z), where=size > 0.0)
    along = (rate * way.conj()).real * way
    shares = np.array([film_shares(one / clearance) for one in size.tolist()]) - 1.0
    return np.asarray(shares[:, 0] * along + shares[:, 1] * (rate - along))


def loss_numbers(case: Case, history: History) -> dict[str, float]:
    """Return the results on the supports of a rotor that loses a blade; else {}.

    case, history : the case; what was recorded while it was integrated
    """
    if case.given.engine.rotor.lost_blade == NO_BLADE:
        return {}
    judged, scene = history.judged, case.scene
    angles = angle_at(scene, judged.time)
    force = support_force(case, judged.time, static_frame(judged.centre, angles))
    sizes = np.hypot(*force.T)
    drag = abs(friction_with_sign(scene)) * history.contact_impulse
    if history.rubbing is not None:
        drag = float(np.sign(scene.speed)) * history.rubbing.impulse
    return {
        "support_peak": float(sizes.max()) if len(sizes) else math.nan,
        "support_peak_time": (
            float(judged.time[sizes.argmax()]) if len(sizes) else math.nan
        ),
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
