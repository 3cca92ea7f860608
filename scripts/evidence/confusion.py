"""The confusion matrix of words: what two ways of computing call the same cases."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable


def alike(pairs: Iterable[tuple[str, str]]) -> int:
    """Return in how many pairs both words are one."""
    return sum(one == other for one, other in pairs)


def confusion(pairs: Iterable[tuple[str, str]]) -> list[str]:
    """Return a line for each pair of words, in their order, and how often it is."""
    counts = sorted(Counter(pairs).items())
    return [f"  {one:10s} | {other:10s} {count}" for (one, other), count in counts]
