"""Shards: the share of one array job's element, the same whatever is finished."""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass

from hpcwhirl.errors import InputError, shown

MOST = 100_000  # shards: more than any scheduler's array has elements


@dataclass(frozen=True)
class Shard:
    """The I-th of N shares of a campaign, counted from 1."""

    number: int
    of: int

    def __str__(self) -> str:
        """Return ``I/N``."""
        return f"{self.number}/{self.of}"


def parse_shard(text: str) -> Shard:
    """Return the shard of a text ``I/N``.

    Raises
    ------
    InputError
        where it is not two whole numbers with 1 <= I <= N
    """
    number, slash, of = text.partition("/")
    parts = number, of
    digits = all(p.isascii() and p.isdigit() and len(p) < 20 for p in parts)
    if slash and digits and 1 <= int(number) <= int(of) <= MOST:
        return Shard(int(number), int(of))
    msg = f"--shard must be I/N with 1 <= I <= N <= {MOST}, got {shown(text)}"
    raise InputError(msg)


def share(costs: Sequence[float], shard: Shard) -> frozenset[int]:
    """Return the cases of a shard.

    The dearest case first, each to the shard that has least so far: loads differ by at
    most one case. It depends on the costs of all cases alone, never on what has been
    computed, so that every shard finds its own share without asking.

    Parameters
    ----------
    costs : (n,), predicted cost of each case, any unit
    shard : whose cases to return
    """
    loads = [(0.0, number) for number in range(1, shard.of + 1)]
    mine = []
    for case in sorted(range(len(costs)), key=lambda i: (-costs[i], i)):
        load, number = loads[0]
        heapq.heapreplace(loads, (load + costs[case], number))
        if number == shard.number:
            mine.append(case)
    return frozenset(mine)
