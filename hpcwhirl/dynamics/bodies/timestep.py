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

POINTS, WEIGHTS = np.polynomial.legendre.leggauss(12)  # of Gauss, on -1 to 1


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
    rate : damping loss of a step of central differences, divided by (d + d')^2
    mean : (3,), coefficients of d, d', q' in dt (v- + v+) at the step's start, v before
        and after the impulse; the work of an impulse is half of this times impulse / dt
    loss : (3,), coefficients of d'^2, d' q', q'^2 in the damping loss of a step, J
    speed : (2,), coefficients of d and q in the velocity at the end of a step, 1/s
    """

    omega: float
    damping: float
    keep: float
    pull: float
    give: float
    rate: float
    mean: tuple[float, float, float]
    loss: tuple[float, float, float]
    speed: tuple[float, float]


def central_differences(omega: float, damping: float, step: float) -> Recursion:
    """Return the coefficients of a step of central differences, as in Algorithm 1.

    omega, damping, step : rad/s; damping ratio xi; dt, s
    """
    keep, pull, give = (
        float(v[0]) for v in recursion(np.array([omega]), damping, step)
    )
    rate = 2 * damping * omega / (4 * step)
    no_loss, mean = (0.0, 0.0, 0.0), (1.0, 1.0, 0.0)
    return Recursion(
        omega, damping, keep, pull, give, rate, mean, no_loss, (1.0 / step, 0.0)
    )


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
    # d' = e^-a S v + forth q from the start of a step; d = e^a S (v + xw q) - back q
    forth = math.expm1(-a) - 2 * decay * half + decay * xw * sine
    back = math.expm1(a) - 2 * grown * half
    after = 1.0 / (decay * sine), -forth / (decay * sine)  # v+ from d', q
    before = 1.0 / (grown * sine), back / (grown * sine) - xw  # v- from d, q
    place = step * (before[1] + after[1])  # of q = q' - d'
    mean = step * before[0], step * after[0] - place, place
    loss = _loss(omega, damping, step, after)
    give = step * decay * sine
    return Recursion(omega, damping, decay**2, pull, give, 0.0, mean, loss, before)


def _loss(
    omega: float, damping: float, step: float, after: tuple[float, float]
) -> tuple[float, float, float]:
    """Return the damping loss of a step of the exact flow, as three coefficients, J.

    They multiply d'^2, d' q', q'^2: q' is the amplitude at the end of the step, d' its
    increment in the step. The loss is the integral of 2 xi omega v^2, v(t) = e^{-xi
    omega t} (v+ c(t) - (xi omega v+ + omega^2 q) s(t)), by Gauss's rule: steps are
    short against the period.

    omega, damping, step : rad/s; damping ratio xi; dt, s
    after : coefficients of d' and of q, the amplitude at the start, in the velocity v+
        after the impulse at the start
    """
    t = 0.5 * step * (POINTS + 1.0)
    omega_d = omega * math.sqrt(1.0 - damping**2)
    sine = np.sin(omega_d * t) / omega_d if omega_d > 0.0 else t
    decay = np.exp(-damping * omega * t)
    of_v = decay * (np.cos(omega_d * t) - damping * omega * sine)
    of_q = -decay * omega**2 * sine
    of_q += after[1] * of_v
    of_d = after[0] * of_v - of_q  # q = q' - d'
    scale = 2 * damping * omega * 0.5 * step * WEIGHTS
    terms = (scale * of_d**2).sum(), (2 * scale * of_d * of_q).sum()
    return float(terms[0]), float(terms[1]), float((scale * of_q**2).sum())
