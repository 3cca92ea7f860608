"""The share that `margin --check` gives holds in a five times finer sweep.

Engines of 6 to 10 blades, in `draft`: 15 speeds, two gaps, 0.6 s. 20 points are drawn
in each range of two damped cases or more. A sweep of a fifth of the step inside the
same ranges is a sample, too: the 95 % interval of the difference of both shares (by
Newcombe's rule from Wilson's intervals) must contain 0. Engines without such a range
are not asked.
"""

from __future__ import annotations

import math
import tempfile
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

import hpcwhirl
from hpcwhirl.scene import apply_settings
from hpcwhirl.store.reading.results_file import Results
from hpcwhirl.store.reading.shares import interval
from hpcwhirl.studies.margin_check import Check, check_line, computed_word
from hpcwhirl.studies.margins import SAFE, Line, lines_of, ranges_of

COUNT, LEAST = 30, 0.9
DRAWN, FINER = 20, 5  # points in each range; times a finer sweep's step
SPEEDS = {"start": 240.0, "stop": 520.0, "step": 20.0}
Row = dict[str, Any]


def drawn(seed: int, index: int) -> Row:
    """Return the tables of a campaign over speed."""
    random = np.random.default_rng([seed, index])
    gap = float(10 ** random.uniform(-4.0, -3.4))
    return {
        "preset": "draft",
        "scene": {
            "duration": 0.6,
            "friction": float(random.uniform(0.02, 0.15)),
            "nodal_diameter": 1,
            "force": float(random.uniform(2e4, 1e5)),
        },
        "engine": {
            "rotor": {
                "blades": int(random.integers(6, 11)),
                "suspension_damping": float(random.uniform(0.03, 0.2)),
            },
            "casing": {"thickness": float(random.uniform(0.02, 0.05))},
        },
        "output": {"traces": "summary"},
        "sweep": {"speed": SPEEDS, "gap": [gap, 2.0 * gap]},
    }


def judged(document: Row) -> Row:
    """Draw points in the ranges of a campaign; compare them with a finer sweep."""
    damped, checks = [0, 0], list[Check]()
    with tempfile.TemporaryDirectory() as scratch:
        place = Path(scratch) / "out"
        tables = {n: v for n, v in document.items() if n != "preset"}
        tables["solver"] = {"preset": document["preset"]}
        with hpcwhirl.campaign(tables, place) as data, Results(place) as results:
            for line in lines_of(data, "speed", 0.0):
                parts = [(one.low, one.high) for one in ranges_of(line)
                         if one.cases > 1]  # fmt: skip
                checks += check_line(results, "speed", line, parts, DRAWN)[1]
                for low, high in parts:
                    words = _finer(results, line, low, high)
                    damped[0] += sum(word == SAFE for word in words)
                    damped[1] += len(words)
    if not checks:
        return {"held": None}
    count = sum(one.damped for one in checks), DRAWN * len(checks)
    share, low, high = interval(*count)
    true = damped[0] / damped[1]
    why = f"{true:.3f} of {damped[1]}, given as {share:.3f} [{low:.3f}, {high:.3f}]"
    held = agree(interval(*count), interval(*damped))
    told = {"drawn": count, "finer": damped, "ranges": len(checks)}
    whole = sum(one.holds for one in checks)
    return {"held": held, "why": why, "whole": whole} | told


def agree(one: tuple[float, float, float], two: tuple[float, float, float]) -> bool:
    """Return whether two shares, with the ends of their intervals, may be the same."""
    below, above = sorted([one, two])
    return above[0] - below[0] <= math.hypot(above[0] - above[1], below[2] - below[0])


def _finer(results: Results, line: Line, low: float, high: float) -> list[str]:
    """Return the words at the points of a finer sweep between two speeds."""
    scene = results.scene(int(line.cases[0]))
    inside = line.values[(line.values >= low) & (line.values <= high)]
    parts = np.arange(1, FINER) / FINER
    values = [a + part * (b - a) for a, b in pairwise(inside.tolist())
              for part in parts.tolist()]  # fmt: skip
    scenes = (apply_settings(scene, {"speed": float(value)}) for value in values)
    return [computed_word(one) for one in scenes]
