"""Sums of rows of a table, each row times a factor, for two or six vectors at a time.

A fused multiply-add waits for the preceding one of the same sum: six sums at once keep
both units of a core busy. The terms of a sum are added in the order of the rows listed
in the argument `which`.
"""

from __future__ import annotations

from hpcwhirl.dynamics.kernels.compiled import inlined
from hpcwhirl.dynamics.kernels.vectors import (
    FOUR,
    broadcast,
    fma,
    get,
    load,
    lower_of,
    store,
)


@inlined
def add_six(factors, which, size, table, stride, v, six):
    """Return `six` vectors plus the sum over s of factors[s] times row which[s].

    table : flat, in rows of length `stride`; v : first of the 24 columns that are read
    """
    a, b, c, d, e, f = six
    for s in range(size):
        factor, at = broadcast(get(factors, s)), get(which, s) * stride + v
        a = fma(load(table, at), factor, a)
        b = fma(load(table, at + FOUR), factor, b)
        c = fma(load(table, at + 2 * FOUR), factor, c)
        d = fma(load(table, at + 3 * FOUR), factor, d)
        e = fma(load(table, at + 4 * FOUR), factor, e)
        f = fma(load(table, at + 5 * FOUR), factor, f)
    return a, b, c, d, e, f


@inlined
def add_two(factors, which, size, table, stride, v, two):
    """Return `two` vectors plus the sum over s of factors[s] times row which[s].

    Arguments are those of `add_six`; 8 columns are read, from v on.
    """
    a, b = two
    for s in range(size):
        factor, at = broadcast(get(factors, s)), get(which, s) * stride + v
        a = fma(load(table, at), factor, a)
        b = fma(load(table, at + FOUR), factor, b)
    return a, b


@inlined
def store_six(out, v, six):
    """Store six vectors from out[v] on; return their elementwise minimum."""
    a, b, c, d, e, f = six
    store(out, v, a)
    store(out, v + FOUR, b)
    store(out, v + 2 * FOUR, c)
    store(out, v + 3 * FOUR, d)
    store(out, v + 4 * FOUR, e)
    store(out, v + 5 * FOUR, f)
    return lower_of(lower_of(lower_of(a, b), lower_of(c, d)), lower_of(e, f))
