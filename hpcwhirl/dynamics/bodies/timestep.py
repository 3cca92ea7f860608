"""Coefficients of a time step of one mode: central differences, or the exact flow.

For a mode of frequency w, rad/s, damping ratio xi and modal force f, central
differences,
(1/dt^2 + xi w/dt) q_{n+1} = f_n + (2/dt^2 - w^2) q_n - (1/dt^2 - xi w/dt) q_{n-1},
are written with the increment d_n = q_n - q_{n-1}, which is algebraically the same but
loses no digits in 2 - w^2 dt^2 for slow modes:
d_{n+1} = keep d_n - pull q_n + give f_n,   q_{n+1} = q_n + d_{n+1}.

Its free motion is z^n, (1 + xi x) z^2 - (2 - x^2) z + (1 - xi x) = 0 with x = w dt, so
that the phase advances by arg z per step, not by x sqrt(1 - xi^2): see `case.limits`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from hpcwhirl.arrays import Floats


def recursion(
    omega: Floats, damping: float | Floats, step: float
) -> tuple[Floats, ...]:
    """Return the coefficients (keep, pull, give) of a step of central differences.

    Each is (m,), for the m modes of a body: d' = keep d - pull q + give f, with
    amplitude q, its last and next increment d and d', and modal force f.

    Parameters
    ----------
    omega : (m,), rad/s
    damping : damping ratio xi, of all modes or (m,)
    step : dt, s
    """
    give = 1.0 / (1.0 / step**2 + damping * omega / step)
    keep = give * (1.0 / step**2 - damping * omega / step)
    return keep, give * omega**2, give


@dataclass(frozen=True)
class Recursion:
    """Coefficients of a step of one mode, d' = keep d - pull q + give f, q' = q + d'.

    q and q' are the amplitude before and after the step, d' its increment in this step,
    d = q_n - q_{n-1} that in the step before, f the modal force.

    Attributes
    ----------
    omega, damping : rad/s; damping ratio xi
    keep, pull, give : coefficients; a force f acts as impulse f dt at the step's start
    speed : (2,), coefficients of d and q in the velocity at the end of a step, 1/s
    """

    omega: float
    damping: float
    keep: float
    pull: float
    give: float
    speed: tuple[float, float]


def central_differences(omega: float, damping: float, step: float) -> Recursion:
    """Return the coefficients of a step of central differences, as in Algorithm 1.

    omega, damping, step : rad/s; damping ratio xi; dt, s
    """
    keep, pull, give = (
        float(v[0]) for v in recursion(np.array([omega]), damping, step)
    )
    return Recursion(omega, damping, keep, pull, give, (1.0 / step, 0.0))


@lru_cache(1024)
def exact_flow(omega: float, damping: float, step: float) -> Recursion:
    """Return the coefficients of a step whose free motion is exactly that of the mode.

    With a = xi omega dt, b = omega_d dt and S = sin(b) / omega_d, a step from amplitude
    q and velocity v gives q' = e^-a ((cos b + xi omega S) q + S v). Written in q and
    the increment d = q_n - q_{n-1} nothing cancels: pull = (1 - e^-a)^2 + 4 e^-a
    sin^2(b / 2).

    Parameters
    ----------
    omega : rad/s
    damping : damping ratio xi < 1
    step : dt, s
    """
    a, omega_d = damping * omega * step, omega * math.sqrt(1.0 - damping**2)
    b, xw = omega_d * step, damping * omega
    sine = math.sin(b) / omega_d if omega_d > 0.0 else step
    half = math.sin(b / 2) ** 2
    decay, grown = math.exp(-a), math.exp(a)
    pull = math.expm1(-a) ** 2 + 4 * decay * half
    # d = e^a S (v + xw q) - back q
    back = math.expm1(a) - 2 * grown * half
    speed = 1.0 / (grown * sine), back / (grown * sine) - xw
    return Recursion(omega, damping, decay**2, pull, step * decay * sine, speed)
