"""Check that the solved contact problem agrees with the motion of the bodies.

The multipliers are found from predicted gaps and the Delassus matrix, and applied to
the bodies' amplitudes. If a sample falls on a step with contact, the gaps are computed
again from the amplitudes. Their difference from g + W lambda (the miss), relative to
the lengths of which they are sums, is round-off unless a row of W or the effect of a
multiplier is wrong. The energy ledger would not show such an error, since it has the
work of the forces that were really applied.
"""

from __future__ import annotations

from numba import njit

from hpcwhirl.dynamics.kernels.compiled import rare
from hpcwhirl.dynamics.kernels.contact import MISS
from hpcwhirl.dynamics.kernels.keep_inverse import place_of
from hpcwhirl.dynamics.kernels.passes import (
    RADIAL,
    RING_STATE,
    ROTOR_STATE,
    item,
    to_gaps_seldom,
)


@njit(cache=True)
def note_miss(actual, solved, u, gap, ledger):
    """Raise ledger[MISS] to the largest relative error of the solved gaps.

    The error of a gap is |actual - solved| / (gap + |u| + |actual|).

    actual, solved, u : (N,) or more, m: gaps computed from the amplitudes, corrected
        gaps of the contact problem, displacements of the tips
    """
    worst, reach, apart = 0.0, 0.0, 0.0
    for j in range(len(actual)):
        worst = max(worst, abs(actual[j] - solved[j]))
        reach = max(reach, abs(u[j]))
        apart = max(apart, abs(actual[j]))
    if worst > ledger[MISS] * (gap + reach + apart):
        ledger[MISS] = worst / (gap + reach + apart)


@rare
def note_miss_folded(again, gaps, row, reach, gap, blades, ledger):
    """Raise ledger[MISS] to the error of the solved gaps of a step, like `note_miss`.

    Both are folded: `again` (2 wide,), m, computed from the amplitudes, and `gaps`.
    Entries that repeat a blade are not compared, since pivoting does not correct them.

    reach : bound of the tips' displacements, m
    gaps, row : corrected gaps in folded rows, and where the row of this step begins
    """
    worst, apart = 0.0, 0.0
    for j in range(blades):
        at = place_of(j, blades, len(again) // 2)
        worst = max(worst, abs(again[at] - gaps[row + at]))
        apart = max(apart, abs(again[at]))
    if worst > ledger[MISS] * (gap + reach + apart):
        ledger[MISS] = worst / (gap + reach + apart)


@rare
def add_ring(t, c, k, spectrum):
    """Add the ring's displacement in a state t to a spectrum (2 k,), m.

    t, c : state without pending step; packed items of the modes, see `passes`
    """
    size = len(t) // RING_STATE
    for m in range(size):
        psi = item(c, RADIAL, m)
        spectrum[m % k] += psi * t[m]
        spectrum[k + m % k] += psi * t[size + m]


@rare
def note_miss_cyclic(t_b, c_b, t_c, c_c, wave, gap, reach, gaps, row, spectrum, again,
                     blades, ledger):  # fmt: skip
    """Raise ledger[MISS] to the error of the solved gaps against states t_b, t_c.

    t_b, t_c : states of rotor and ring of the cyclic kernel, without pending forces
    reach : bound of the tips' displacements, m
    gaps, row : as in `note_miss_folded`
    spectrum : (2 k,), in: that of the casing's shape; out: that of the gaps
    again : (2 wide,), out: gaps of the states
    """
    width, size = len(spectrum), len(t_b) // ROTOR_STATE
    k, wide = width // 2, len(wave) // width
    for m in range(size):
        spectrum[m % width] += item(c_b, RADIAL, m) * t_b[m]
    add_ring(t_c, c_c, k, spectrum)
    to_gaps_seldom(spectrum, wave, gap, k, wide, again, 0)
    note_miss_folded(again, gaps, row, reach, gap, blades, ledger)
