"""Shares of starts hold for other starts, of campaigns with overloaded starts, too.

Engines of 6 to 10 blades, in `draft`, 0.2 s; the forces of 24 starts, drawn over two
decades, reach those that carry the tips to the amplitude limit alone. For each word of
the table, overloaded included, the share of 120 further starts must agree: the 95 %
interval of the difference of both shares contains 0. Campaigns without an overloaded
start are not asked.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from evidence.populations.margins import agree

import hpcwhirl
from hpcwhirl.store.reading.shares import interval

COUNT, LEAST = 20, 0.85
STARTS, FURTHER = 24, 120
SAMPLE = {"count": STARTS, "method": "random"}
Row = dict[str, Any]


def drawn(seed: int, index: int) -> Row:
    """Return the tables of a campaign of drawn starts."""
    random = np.random.default_rng([seed, index])
    force = {"distribution": "loguniform", "low": 1e5, "high": 3e7}
    return {
        "scene": {
            "duration": 0.2,
            "friction": float(random.uniform(0.02, 0.15)),
            "gap": float(10 ** random.uniform(-4.0, -2.7)),
            "speed": float(random.uniform(240.0, 520.0)),
        },
        "engine": {"rotor": {"blades": int(random.integers(6, 11))}},
        "solver": {"preset": "draft"},
        "output": {"traces": "summary"},
        "sample": SAMPLE | {"seed": index, "force": force},
    }


def judged(document: Row) -> Row:
    """Compute the shares of a campaign's starts and of further ones."""
    one = _counts(document)
    if not one["overloaded"]:
        return {"held": None}
    more = {"count": FURTHER, "seed": 1000 + document["sample"]["seed"]}
    two = _counts(document | {"sample": document["sample"] | more})
    ends = {word: (interval(one[word], STARTS), interval(two[word], FURTHER))
            for word in one}  # fmt: skip
    bad = [word for word, pair in ends.items() if not agree(*pair)]
    why = ", ".join(f"{w} {one[w]} of {STARTS}, {two[w]} of {FURTHER}" for w in bad)
    return {"held": not bad, "why": why, "first": one, "further": two}


def _counts(document: Row) -> dict[str, int]:
    """Run a campaign; return {word: its number of starts}; every start is one."""
    with tempfile.TemporaryDirectory() as scratch:
        place = Path(scratch) / "out"
        with hpcwhirl.campaign(document, place) as data:
            found = hpcwhirl.basins(data).isel(point=0)
            words = found["regime"].to_numpy().tolist()
            count = found["count"].to_numpy().tolist()
            share = float(found["share"].sum())
    told = dict(zip(words, count, strict=True))
    if sum(told.values()) != document["sample"]["count"] or abs(share - 1.0) > 1e-12:
        raise SystemExit(f"{document}: shares are not of all starts: {told}")
    return told
