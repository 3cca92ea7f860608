"""What the rows of the loop `points` share: sizes, angles, small numbers.

In the rotating frame no coefficient depends on the position of the blades. Equal
sectors move by nodal diameter, kappa = 0 .. N // 2, so that all gaps are

g_j = gap + Re sum_kappa G_kappa e^{2 pi i kappa j / N},

one real transform of N points for both bodies, with the spectrum G of the gaps.
"""

from __future__ import annotations

import math

from hpcwhirl.dynamics.kernels.compiled import inlined, part
from hpcwhirl.dynamics.kernels.contact import TINY, angle_at
from hpcwhirl.dynamics.kernels.keep_inverse import place_of


@part
def flush(s):
    """Set numbers below 1e-150 in a body's state s to 0, since denormals are slow."""
    for m in range(len(s)):
        if abs(s[m]) < TINY:
            s[m] = 0.0


@inlined
def angle_of(wall, speed, time):
    """Return the rotor's angle at a time, s, times the number of lobes, rad.

    wall, speed : `kernel_types.Wall`; Omega, rad/s
    """
    return wall.lobes * (angle_at(wall, speed, time) % (2.0 * math.pi))


@inlined
def read_before(gaps, row, where, active, blades, wide, before):
    """Copy the gaps, m, that blades in contact had two steps before to `before` (N,).

    gaps, row : gaps in folded order, and the index at which those of that step begin
    where, active : the blades in contact are where[:active]
    """
    for s in range(active):
        before[where[s]] = gaps[row + place_of(where[s], blades, wide)]
