"""What this core can do at most: independent fused multiply-adds, in registers."""

from __future__ import annotations

from numba import njit

CHAINS = 96  # independent sums; enough vectors to hide the latency of one


@njit(cache=True, fastmath={"contract"})
def multiply_add(rounds, values, factor, term):
    """Apply x = factor x + term `rounds` times to values (CHAINS,), in place."""
    for _ in range(rounds):
        for k in range(CHAINS):
            values[k] = values[k] * factor + term
