"""Steps of central differences in which no gap can close, so that gaps are left out.

A gap is the clearance plus Re sum_kappa G_kappa e^{2 pi i kappa j / N}, G the spectrum
of the gaps, kappa the nodal diameter (slot), j the blade, see `cyclic`. So it changes
by at most the change of the clearance plus the sum of |change| over the real and
imaginary parts of all slots. While that is below the lowest gap of the last step that
was transformed, no blade touches: the transform from spectrum to gaps is skipped. Gaps
of a skipped step that are needed later (two steps before a contact, or in the saved
state) are transformed then, from the spectra of the last three steps, with the same
bits.
"""

from __future__ import annotations

from hpcwhirl.dynamics.kernels.compiled import inlined, rare
from hpcwhirl.dynamics.kernels.loop.passes import one_norm, to_gaps, to_gaps_seldom
from hpcwhirl.dynamics.kernels.vectors import (
    FOUR,
    broadcast,
    get,
    higher_of,
    load,
    put,
    store,
    total_of,
)

STEPS = 3  # number of steps whose gaps are in the state
ROUNDING = 1e-12  # relative to gap and amplitudes: above the round-off of a transform


@inlined
def moved(spectrum, seen, width, row):
    """Store the spectrum of the gaps of a step; return how far gaps may have moved, m.

    It is the sum of |change| since the last step whose gaps were computed, over all
    real and imaginary parts of the spectrum.

    spectrum, width : (width,), m, re, then im; its length
    row : number of the step mod 3
    seen : (4 width + 2 FOUR,), m, in and out: spectra of three steps; spectrum of the
        step whose gaps were computed last, the change from it up to which no gap
        closes, and its clearance; clearances of the three steps
    """
    total, last = broadcast(0.0), STEPS * width
    for c in range(0, width, FOUR):
        value = load(spectrum, c)
        store(seen, row * width + c, value)
        change = value - load(seen, last + c)
        total = total + higher_of(change, broadcast(0.0) - change)
    return total_of(total)


@inlined
def gaps_if_near(spectrum, wave, gap, k, wide, gaps, row, seen, skipped):
    """Compute the gaps of all blades if one might close; return the lowest, m.

    If the spectrum of the gaps has changed too little for any gap to close, the step is
    skipped: its gaps are not computed, and 1 is returned.

    spectrum, wave, gap, k, wide, gaps : as in `passes.to_gaps`; gaps is (3, 2 wide)
        flat, of three steps
    row : number of the step mod 3
    seen, skipped : see `moved`; (3,), out: 1 for a step that is skipped, else 0
    """
    width, last = 2 * k, STEPS * 2 * k
    free = last + width
    put(seen, free + 2 + row, gap)
    closed = get(seen, free + 1) - gap
    if moved(spectrum, seen, width, row) + closed < get(seen, free):
        put(skipped, row, 1)
        return 1.0
    put(skipped, row, 0)
    lowest = to_gaps(spectrum, wave, gap, k, wide, gaps, row * 2 * wide)
    left = lowest
    if lowest > 0.0:
        left = lowest - ROUNDING * (gap + one_norm(spectrum, width))
    if left > 0.0:
        for c in range(0, width, FOUR):
            store(seen, last + c, load(spectrum, c))
    put(seen, free, left)
    put(seen, free + 1, gap)
    return lowest


@rare
def catch_up(wave, k, wide, gaps, row, seen, skipped):
    """Compute the gaps of an earlier step, if that was skipped.

    row : number of the step mod 3, by which `gaps`, (3, 2 wide) flat, m, are ordered
    wave, seen : table of cos and sin, see `passes.to_gaps`; spectra, see `moved`
    skipped : (3,), in and out: 1 for a step without gaps
    """
    if skipped[row] == 1:
        skipped[row] = 0
        spectrum = seen[row * 2 * k : (row + 1) * 2 * k]
        gap = seen[(STEPS + 1) * 2 * k + 2 + row]
        to_gaps_seldom(spectrum, wave, gap, k, wide, gaps, row * 2 * wide)


@inlined
def begin_unseen(k, seen, skipped):
    """Make the next step compute its gaps: no bound of their change is known yet.

    k : number of slots; seen, skipped : out, see `moved` and `gaps_if_near`
    """
    put(seen, (STEPS + 1) * 2 * k, -1.0)
    for row in range(STEPS):
        put(skipped, row, 0)
