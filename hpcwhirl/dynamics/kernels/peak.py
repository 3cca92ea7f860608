"""Loops that measure the peak rates of one core, to which time loops are compared.

They measure the rate of multiply-add operations and that of reading arrays.
"""

from __future__ import annotations

from hpcwhirl.dynamics.kernels.compiled import by_numba

CHAINS = 96  # number of independent sums, enough to hide the latency of an addition


@by_numba(fastmath={"contract"})
def multiply_add(rounds, values, factor, term):
    """Apply x = factor x + term `rounds` times to each number of an array, in place.

    values : (CHAINS,), independent numbers, so that no addition waits for another
    """
    for _ in range(rounds):
        for k in range(CHAINS):
            values[k] = values[k] * factor + term


@by_numba(fastmath={"contract", "reassoc"})
def total_again(rounds, values):
    """Read an array `rounds` times, summing it; return the total of these sums.

    values : (4 n,); values[0] is overwritten by the number of the round, so that no two
        sums are equal
    """
    n, total = len(values) // 4, 0.0
    for i in range(rounds):
        values[0] = i  # or the compiler could reuse the sum of the round before
        a, b, c, d = 0.0, 0.0, 0.0, 0.0
        for k in range(n):
            a += values[k]
            b += values[n + k]
            c += values[2 * n + k]
            d += values[3 * n + k]
        total += (a + b) + (c + d)
    return total
