"""Check of the gaps of samples, and the value of a spectrum at a blade.

The solved contact problem must agree with the motion of the bodies. The multipliers are
found from predicted gaps and the Delassus matrix, and applied to the bodies'
amplitudes. If a sample falls on a step with contact, the gaps are computed again from
the amplitudes. Their difference from g + W lambda (the miss), relative to the lengths
of which they are sums, is round-off unless a row of W or the effect of a multiplier is
wrong. The energy ledger would not show such an error, since it has the work of the
forces that were really applied.
"""

from __future__ import annotations

from hpcwhirl.dynamics.kernels.compiled import part, rare
from hpcwhirl.dynamics.kernels.contact import (
    MISS,
)
from hpcwhirl.dynamics.kernels.keep_inverse import place_of


@part
def at_blade(spectrum, turns, j, width):
    """Return the value at blade j of a spectrum G: Re sum_k G_k e^{2 pi i k j / N}.

    spectrum : (width,), re, then im, of G at all nodal diameters k
    turns, width : (N, width) flat, cos and -sin of 2 pi k j / N; twice the number of
        nodal diameters, padded
    """
    total = 0.0
    for i in range(width):
        total += spectrum[i] * turns[j * width + i]
    return total


@part
def note_miss(actual, solved, u, gap, ledger):
    """Raise ledger[MISS] to the largest error of a step's solved gaps, if larger.

    The error is the largest |actual - solved| over (gap + largest |u| + largest
    |actual|).

    actual, solved, u : (N,) or more, m: gaps computed from the amplitudes, gaps of the
        contact problem (g + W lambda), displacements of the tips
    gap : m, clearance
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
    """Raise ledger[MISS] to the largest error of a step's solved gaps, if larger.

    The error is defined in `note_miss`. Arrays are in folded order (see
    `loop.circulant.folded`). Entries that repeat a blade are not compared, since
    pivoting does not correct them.

    again : (2 wide,), m, gaps computed from the amplitudes
    gaps, row : m, gaps of the contact problem, and the index at which those of this
        step begin
    reach, gap, blades : m, bound of the tips' displacements; m, clearance; N
    """
    worst, apart = 0.0, 0.0
    for j in range(blades):
        at = place_of(j, blades, len(again) // 2)
        worst = max(worst, abs(again[at] - gaps[row + at]))
        apart = max(apart, abs(again[at]))
    if worst > ledger[MISS] * (gap + reach + apart):
        ledger[MISS] = worst / (gap + reach + apart)
