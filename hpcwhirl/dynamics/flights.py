"""Arrays of the exact scheme's jumps over steps without contact, and their bounds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.case.limits import step_counts
from hpcwhirl.dynamics.kernels import flight, passes
from hpcwhirl.dynamics.kernels.kernel_types import Flight
from hpcwhirl.scene import Scene
from hpcwhirl.scene.schemes import SCHEMES

Floats = NDArray[np.float64]
LONGEST = 10  # jumps of 1, 2, 4, ... 2^LONGEST steps


def flight_arrays(
    scene: Scene, beat: int, rotor: Floats, ring: Floats
) -> Flight | tuple[()]:
    """Return the argument `flight` of `kernels.flight.fly`; empty for other schemes.

    Parameters
    ----------
    scene : the case
    beat : steps between rows of evidence, at which jumps end
    rotor, ring : items of both bodies, (ITEMS size,) and (ITEMS ring_size,)
    """
    if not SCHEMES[scene.solver.scheme].flies:
        return ()
    total, _ = step_counts(scene)
    counts = np.array([2**p for p in range(LONGEST + 1)] + [beat], dtype=np.int64)
    bodies = rotor.reshape(passes.ITEMS, -1), ring.reshape(passes.ITEMS, -1)
    step = scene.solver.time_step
    jumps = [
        np.array([_jump(b, int(count), step).ravel() for count in counts])
        for b in bodies
    ]
    longest = counts[-2] * step
    bounds = [_bound(b, longest).ravel() for b in bodies]
    return Flight(total, _certifiable(scene, bodies), counts, *jumps, *bounds)


def can_fly(scene: Scene) -> bool:
    """Return whether gaps move by free modes only between contacts."""
    casing = scene.engine.casing
    return casing.kind == "ring" or casing.amplitude == 0.0


def _certifiable(scene: Scene, bodies: tuple[Floats, Floats]) -> bool:
    """Return whether all free motion dies out: every mode is damped and held."""
    real = [b[:, b[passes.KEEP] > 0.0] for b in bodies]
    held = all((b[passes.OMEGA] > 0.0).all() for b in real)
    return (
        can_fly(scene) and held and all((b[passes.DAMPING] > 0.0).all() for b in real)
    )


def _jump(items: Floats, count: int, step: float) -> Floats:
    """Return the flow of (q, d) over `count` steps, (JUMP_ITEMS, size).

    q' = e^-a ((cos b + xi omega S) q + S v), v' = e^-a ((cos b - xi omega S) v
    - omega^2 S q), a = xi omega t, b = omega_d t, S = sin(b) / omega_d; v follows from
    (q, d), and d' from v', by the items `speed`; the loss is the decrease of energy.
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
    """Return the items that bound a body's free motion, (BOUND_ITEMS, size).

    v^2 = (omega^2 q^2 + 2 xi omega q q' + q'^2) / (1 - xi^2) is the falling envelope of
    |q'|^2; a mode's displacement stays below v / omega, and |C| below |C| + v t.

    longest : s, time ahead up to which the bound is used
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
