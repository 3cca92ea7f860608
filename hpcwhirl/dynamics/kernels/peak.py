"""Measurement of this core's peak: independent fused multiply-adds in registers."""

from __future__ import annotations

from numba import njit

CHAINS = 96  # number of independent sums, enough to hide the latency of one


@njit(cache=True, fastmath={"contract"})
def multiply_add(rounds, values, factor, term):
    """Apply x = factor x + term `rounds` times to values (CHAINS,), in place."""
    for _ in range(rounds):
        for k in range(CHAINS):
            values[k] = values[k] * factor + term
