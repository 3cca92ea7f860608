"""The central-difference recursion of one mode, and when it is stable.

(1/dt^2 + xi w/dt) q_{n+1} = f_n + (2/dt^2 - w^2) q_n - (1/dt^2 - xi w/dt) q_{n-1}
is marched with the increment d_n = q_n - q_{n-1}, which is algebraically the same
and loses no digits to 2 - w^2 dt^2 on slow modes:
d_{n+1} = keep d_n - pull q_n + give f_n,   q_{n+1} = q_n + d_{n+1}.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import InputError
from hpcwhirl.reduction.model import Model

Floats = NDArray[np.float64]


def recursion(
    omega: Floats, damping: float | Floats, step: float
) -> tuple[Floats, ...]:
    """Return (keep, pull, give), each (m,), of the recursion above.

    Parameters
    ----------
    omega : (m,), rad/s
    damping : xi, of all modes or (m,)
    step : dt, s
    """
    give = 1.0 / (1.0 / step**2 + damping * omega / step)
    keep = give * (1.0 / step**2 - damping * omega / step)
    return keep, give * omega**2, give


def check_step(model: Model, step: float) -> None:
    """Raise InputError, naming the limit, where dt >= 2 / omega_max of a body."""
    body, limit = min(model.limits().items(), key=lambda item: item[1])
    if not step < limit:
        msg = (
            f"time_step must be < {limit:.6g} s (2 / omega_max of the {body}), "
            f"got {step:.6g}"
        )
        raise InputError(msg)
