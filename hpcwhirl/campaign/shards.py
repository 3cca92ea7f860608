"""Shards: the share of one array job's element, the same whatever is finished."""

from __future__ import annotations

import heapq
from collections.abc import Sequence

from hpcwhirl.launch import Shard


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
