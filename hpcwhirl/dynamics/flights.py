"""Coefficients of the exact scheme's jumps over steps without contact, and bounds.

A jump replaces many free steps by one; bounds of the motion tell how long it may be,
see `kernels.flight`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.arrays import Complexes, Floats
from hpcwhirl.case.limits import step_counts
from hpcwhirl.dynamics.kernels import flight, passes, waves
from hpcwhirl.dynamics.kernels.wave_types import Flight
from hpcwhirl.scene import Scene

LONGEST = 10  # exponent: jumps of 1, 2, 4, ... 2^LONGEST steps have coefficients


class Flyer(NamedTuple):
    """Functions that return coefficients of a body's motion without contact.

    Attributes
    ----------
    jump : number of steps -> coefficients of a jump over them, see `kernels.flight`
    bound : time, s -> coefficients of a bound of the motion in that time
    dies : whether all free motion decays
    """

    jump: Callable[[int], Floats]
    bound: Callable[[float], Floats]
    dies: bool


def flying_modes(items: Floats, step: float) -> Flyer:
    """Return the functions for a body's motion without contact, by its modes.

    items, step : (ITEMS, modes), coefficients of modes, see `kernels.passes`; dt, s
    """
    real = items[:, items[passes.KEEP] > 0.0]
    held = bool((real[passes.OMEGA] > 0.0).all())
    return Flyer(
        lambda count: _jump(items, count, step),
        lambda longest: _bound(items, longest),
        held and bool((real[passes.DAMPING] > 0.0).all()),
    )


def flying_waves(items: Floats, step: float) -> Flyer:
    """Return the functions for a rotor's motion without contact, by its waves.

    items, step : (ITEMS, waves), coefficients of waves, see `kernels.waves`; dt, s
    """
    ahead = items[waves.AHEAD_RE] + 1j * items[waves.AHEAD_IM]
    roots = np.log1p(ahead) / step
    return Flyer(
        lambda count: _turned(roots * (count * step)),
        lambda longest: _bound_waves(roots, items[waves.RADIAL], longest),
        all_die_out(items),
    )


def all_die_out(items: Floats) -> bool:
    """Return whether all waves that contact can excite decay.

    items : (ITEMS, waves), coefficients of waves, see `kernels.waves`
    """
    ahead = items[waves.AHEAD_RE] + 1j * items[waves.AHEAD_IM]
    return die_out(ahead, items[[waves.PUSH_RE, waves.PUSH_IM]])


def die_out(ahead: Complexes, push: NDArray[Any]) -> bool:
    """Return whether all free motion of a body's waves decays.

    Waves that do not change (z = 1) and that contact does not excite are left out.

    ahead : (waves,), z - 1 of each wave, z the factor of its amplitude in a step
    push : (r, waves), change of each wave by contact forces
    """
    pushed = np.asarray(push.any(axis=0))
    less = 2 * ahead.real + ahead.real**2 + ahead.imag**2  # |z|^2 - 1, not cancelling
    return bool((less < 0.0).all(where=pushed | (ahead != 0.0)))


def flight_arrays(
    scene: Scene, beat: int, rotor: Callable[[], Flyer], ring: Floats
) -> Flight | tuple[()]:
    """Return the kernel's arrays for jumps of scheme `exact`; () for other schemes.

    Parameters
    ----------
    scene : scene to integrate
    beat : steps between rows of evidence, at which jumps end
    rotor : returns functions for the rotor's motion without contact; called for `exact`
    ring : coefficients of the ring's modes, packed as in the kernel
    """
    if not scene.solver.flies:
        return ()
    total, _ = step_counts(scene)
    counts = np.array([2**p for p in range(LONGEST + 1)] + [beat], dtype=np.int64)
    step = scene.solver.time_step
    bodies = rotor(), flying_modes(passes.unpacked(ring), step)
    jumps = [
        np.array([body.jump(int(count)).ravel() for count in counts]) for body in bodies
    ]
    bounds = [body.bound(counts[-2] * step).ravel() for body in bodies]
    certifiable = can_fly(scene) and all(body.dies for body in bodies)
    return Flight(total, certifiable, counts, *jumps, *bounds)


def can_fly(scene: Scene) -> bool:
    """Return whether gaps change only by free motion while no blade touches.

    Lobes of a rigid casing change the gaps, too: then there are no jumps.
    """
    casing = scene.engine.casing
    return casing.kind == "ring" or casing.amplitude == 0.0


def _jump(items: Floats, count: int, step: float) -> Floats:
    """Return coefficients of a jump of modes over `count` steps, (JUMP_ITEMS, modes).

    items, step : (ITEMS, modes), coefficients of modes, see `kernels.passes`; dt, s

    Amplitude q and velocity v become q' = e^-a ((cos b + xi omega S) q + S v) and v' =
    e^-a ((cos b - xi omega S) v - omega^2 S q), a = xi omega t, b = omega_d t, S =
    sin(b) / omega_d. Items SPEED_D and SPEED_Q relate v to q and to the increment d =
    q_n - q_{n-1}, before the jump and after it. The loss is the decrease of energy.
    """
    omega, xi = items[passes.OMEGA], items[passes.DAMPING]
    of_d, of_q = items[passes.SPEED_D], items[passes.SPEED_Q]
    time, omega_d = count * step, omega * np.sqrt(1.0 - xi**2)
    decay, b = np.exp(-xi * omega * time), omega_d * time
    sine = time * np.sinc(b / np.pi)
    swing, drag = decay * np.cos(b), decay * xi * omega * sine
    qq, qd = swing + drag + decay * sine * of_q, decay * sine * of_d
    vq = (swing - drag) * of_q - decay * sine * omega**2
    vd = (swing - drag) * of_d
    back = np.divide(1.0, of_d, out=np.zeros_like(of_d), where=of_d != 0.0)
    turn = np.exp(1j * items[passes.SPIN] * time)
    out = np.empty((flight.JUMP_ITEMS, items.shape[1]))
    out[flight.QQ], out[flight.QD] = qq, qd
    out[flight.DQ], out[flight.DD] = back * (vq - of_q * qq), back * (vd - of_q * qd)
    stiff = omega**2
    out[flight.LQQ] = 0.5 * (of_q**2 + stiff - vq**2 - stiff * qq**2)
    out[flight.LQD] = of_q * of_d - vq * vd - stiff * qq * qd
    out[flight.LDD] = 0.5 * (of_d**2 - vd**2 - stiff * qd**2)
    out[flight.TURNED_RE], out[flight.TURNED_IM] = turn.real, turn.imag
    return out


def _bound(items: Floats, longest: float) -> Floats:
    """Return coefficients that bound the free motion of modes, (BOUND_ITEMS, modes).

    v^2 = (omega^2 q^2 + 2 xi omega q q' + q'^2) / (1 - xi^2), with q' = dq/dt, is a
    decreasing envelope of |q'|^2. The displacement of a mode stays below v / omega, and
    the magnitude of the ring's amplitude C after a time t below its present magnitude
    plus v t.

    items : (ITEMS, modes), coefficients of modes, see `kernels.passes`
    longest : s, time for which the bound is used
    """
    omega, xi = items[passes.OMEGA], items[passes.DAMPING]
    spin, weight = np.abs(items[passes.SPIN]), np.abs(items[passes.RADIAL])
    scale = 1.0 / (1.0 - xi**2)
    out = np.empty((flight.BOUND_ITEMS, items.shape[1]))
    out[flight.STIFF], out[flight.MIXED] = scale * omega**2, 2 * scale * xi * omega
    out[flight.ONE] = scale
    out[flight.RISE] = weight * (omega + 2 * spin + spin**2 * longest)
    out[flight.RISE_HELD] = weight * spin**2
    held = np.divide(weight, omega, out=np.zeros_like(omega), where=omega > 0.0)
    out[flight.REACH] = held
    return out


def _turned(angles: Complexes) -> Floats:
    """Return the coefficients e^{s t} of a jump of waves, (JUMP_ITEMS, waves).

    angles : s t, complex, with the root s of each wave and the duration t of the jump
    """
    turn = np.exp(angles)
    return np.stack([turn.real, turn.imag])  # TURNED_RE, TURNED_IM


def _bound_waves(roots: Complexes, radial: Floats, longest: float) -> Floats:
    """Return coefficients that bound the free motion of waves, (BOUND_ITEMS, waves).

    A wave's part of a gap, gamma a e^{st}, with its root s, its amplitude a and the gap
    gamma for unit amplitude, has the initial rate gamma s a, and a second derivative of
    at most |gamma s^2 a|, times its growth if the wave is unstable.

    roots, radial : (waves,), s, 1/s, and gamma
    longest : s, time for which the bound is used
    """
    out, weight = np.empty((waves.BOUND_ITEMS, len(roots))), np.abs(radial)
    rate, grown = radial * roots, np.exp(np.maximum(roots.real, 0.0) * longest)
    out[waves.VELOCITY_RE], out[waves.VELOCITY_IM] = rate.real, rate.imag
    out[waves.RISE], out[waves.REACH] = weight * np.abs(roots) ** 2 * grown, weight
    return out
