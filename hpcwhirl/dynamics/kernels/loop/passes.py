"""Spectra by four nodal diameters at a time: their sums, and the gaps that they give.

A spectrum G has a complex number for each slot (nodal diameter), re of all slots first,
then im. The gap of blade j is gap + Re sum_k G_k e^{2 pi i k j / N}; those of blades j
and N - j are the difference and the sum of a part of cosines and a part of sines.
"""

from __future__ import annotations

from hpcwhirl.dynamics.kernels.compiled import inlined, part, rare
from hpcwhirl.dynamics.kernels.loop.transform import SPAN, to_gaps_split
from hpcwhirl.dynamics.kernels.vectors import (
    FOUR,
    broadcast,
    element,
    fma,
    get,
    higher_of,
    load,
    lower_of,
    store,
    total_of,
)


@part
def copy_to(out, values):
    """Copy the first len(out) entries of the array `values` to `out`."""
    for i in range(len(out)):
        out[i] = values[i]


@rare
def sum_of(values, first, last):
    """Return the sum of values[first:last], always added in this order."""
    total = 0.0
    for i in range(first, last):
        total += values[i]
    return total


@inlined
def one_norm(spectrum, width):
    """Return the sum of |re| + |im| of a spectrum: a bound of its value at every blade.

    spectrum : its real and imaginary parts, the first `width` entries, m
    """
    total = broadcast(0.0)
    for c in range(0, width, FOUR):
        part = load(spectrum, c)
        total = total + higher_of(part, broadcast(0.0) - part)
    return total_of(total)


@inlined
def at_four(spectrum, wave, gap, k, wide, j):
    """Return the parts of gaps, m, that are sums of cosines and of sines: (even, odd).

    They are those of blades j .. j + 3: the gaps are even - odd, and even + odd at the
    blades N - j. Arguments are those of `to_gaps`.
    """
    even, odd = broadcast(gap), broadcast(0.0)
    for c in range(k):
        even = fma(broadcast(spectrum[c]), load(wave, c * wide + j), even)
        odd = fma(broadcast(spectrum[k + c]), load(wave, (k + c) * wide + j), odd)
    return even, odd


@inlined
def at_twelve(spectrum, wave, gap, k, wide, j):
    """Return (even, odd), the result of `at_four`, for blades j, j + 4 and j + 8 on.

    The three pairs are computed together to hide the latency of the processor's units.
    Arguments are those of `at_four`.
    """
    first = second = third = broadcast(gap)
    one = two = three = broadcast(0.0)
    for c in range(k):
        at, on = c * wide + j, (k + c) * wide + j
        re, im = broadcast(get(spectrum, c)), broadcast(get(spectrum, k + c))
        first = fma(re, load(wave, at), first)
        second = fma(re, load(wave, at + FOUR), second)
        third = fma(re, load(wave, at + 2 * FOUR), third)
        one = fma(im, load(wave, on), one)
        two = fma(im, load(wave, on + FOUR), two)
        three = fma(im, load(wave, on + 2 * FOUR), three)
    return (first, one), (second, two), (third, three)


@inlined
def unfold_four(parts, gaps, row, wide, j, least):
    """Store the gaps of blades j .. j + 3 and N - j .. N - j - 3 in an array of gaps.

    Return the elementwise minimum of these gaps and the four numbers `least`, m.

    parts : (even, odd), m, result of `at_four`
    gaps, row, wide : array in which the gaps of blades j begin at index `row`, those of
        blades N - j at row + wide
    """
    even, odd = parts
    here, there = even - odd, even + odd
    store(gaps, row + j, here)
    store(gaps, row + wide + j, there)
    return lower_of(least, lower_of(here, there))


@inlined
def lowest_of(least, gap):
    """Return the lowest gap, m, of the vector `least` and the number `gap`."""
    lowest = gap
    for i in range(FOUR):
        lowest = min(lowest, element(least, i))
    return lowest


@inlined
def to_gaps(spectrum, wave, gap, k, wide, gaps, row):
    """Compute the gaps of all blades from their spectrum; return the lowest gap, m.

    spectrum : (2 k,), m, re, then im, of the k nodal diameters, padded
    wave : (2 k, wide), flat: cos and sin of every nodal diameter at blades j = 0 .. N
        // 2, then padding; followed by N and its split in two factors, see `transform`
    gap : m, clearance, which is added to all gaps
    gaps, row : m, out: from index `row` on, `wide` gaps of blades j, then `wide` of
        blades N - j
    """
    if get(wave, 2 * k * wide + SPAN) > 0.0:
        return lowest_of(to_gaps_split(spectrum, wave, gap, k, wide, gaps, row), gap)
    least = broadcast(gap)
    for j in range(0, wide - 2 * FOUR, 3 * FOUR):
        one, two, three = at_twelve(spectrum, wave, gap, k, wide, j)
        least = unfold_four(one, gaps, row, wide, j, least)
        least = unfold_four(two, gaps, row, wide, j + FOUR, least)
        least = unfold_four(three, gaps, row, wide, j + 2 * FOUR, least)
    for j in range(wide - wide % (3 * FOUR), wide, FOUR):
        parts = at_four(spectrum, wave, gap, k, wide, j)
        least = unfold_four(parts, gaps, row, wide, j, least)
    return lowest_of(least, gap)


@rare
def to_gaps_seldom(spectrum, wave, gap, k, wide, gaps, row):
    """Compute the gaps of all blades from their spectrum; return the lowest gap, m.

    It is `to_gaps`, with its arguments, compiled once for callers that run in few
    steps.
    """
    return to_gaps(spectrum, wave, gap, k, wide, gaps, row)
