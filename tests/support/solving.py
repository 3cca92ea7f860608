"""The contact problem of a constant W, solved by the kernels' parts from Python."""

from hpcwhirl.dynamics.kernels import keep_inverse as keep
from hpcwhirl.dynamics.kernels.compiled import kernel
from hpcwhirl.dynamics.kernels.loop import circulant

place_of = keep.place_of.py_func
guess, seek, recall = circulant.guess, circulant.seek, keep.recall


@kernel
def solve(gaps, lowest, blades, wide, space, anew):
    """Return the number of active blades, and the way: guess, seek, pivoting, 0, 1, 2.

    gaps : (2 wide,), m, folded; in: without contact; out: with it
    anew : whether the inverse kept in `space` is computed first
    """
    if anew:
        recall(blades, wide, space)
    active = guess(gaps, 0, lowest, blades, wide, space)
    if active >= 0:
        return active, 0
    active = seek(gaps, 0, lowest, blades, wide, space)
    if active >= 0:
        return active, 1
    return circulant.solve_any(gaps, 0, blades, wide, space), 2
