"""The setting that `tradeoff --for` names meets its wish on the rest of the campaign.

Engines of 6 to 10 blades, each with a campaign of 24 cases over speed, friction and gap
of 0.5 s. Of 12 drawn cases `tradeoff` chooses the cheapest setting for a peak of the
tips within 5 %, else 10 %, else 20 %, the first that any setting meets. On 12 other
cases the peak must then be within this of the reference in at least nine of ten of
those that the reference knows well enough, and no other setting that meets the wish
there may cost less by a factor above 1.3. Engines for which no setting is named are not
asked.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hpcwhirl.benchmark.drawing import by_words, word_by_draft
from hpcwhirl.benchmark.tradeoff import Row as Tried
from hpcwhirl.benchmark.tradeoff import Tradeoff, measure
from hpcwhirl.benchmark.trials import BOTH, settings_of
from hpcwhirl.benchmark.wish import Wish, cheapest
from hpcwhirl.campaign.plan.design import Design

COUNT, LEAST = 30, 0.9
REPEATS, DRAWN = 2, 12
DEARER = 1.3
WISHES = [Wish("peak", most) for most in (0.05, 0.1, 0.2)]
Row = dict[str, Any]


def drawn(seed: int, index: int) -> Row:
    """Return the tables of a campaign."""
    random = np.random.default_rng([seed, index])
    speed = float(random.uniform(200.0, 450.0))
    gap = float(10 ** random.uniform(-4.0, -3.3))
    return {
        "scene": {"duration": 0.5},
        "engine": {
            "rotor": {
                "blades": int(random.integers(6, 11)),
                "damping": float(10 ** random.uniform(-2.5, -1.5)),
            },
            "casing": {"damping": float(10 ** random.uniform(-2.5, -1.3))},
        },
        "sweep": {
            "speed": [speed, 1.2 * speed, 1.5 * speed],
            "friction": [0.03, 0.1],
            "gap": [gap, 1.5 * gap, 2.0 * gap, 3.0 * gap],
        },
    }


def judged(document: Row) -> Row:
    """Choose a setting on half of a campaign's cases; ask it on the others."""
    design = Design.of(document)
    words = {n: word_by_draft(design.scene(n)) for n in range(len(design.settings))}
    first = by_words(words, DRAWN)
    rest = [n for n in words if n not in first]
    settings = settings_of([BOTH, "step"])
    chosen = measure(_scenes(design, first), settings, REPEATS)
    named = [(wish, cheapest(chosen, [wish])) for wish in WISHES]
    wish, row = next(((w, r) for w, r in named if r is not None), (WISHES[-1], None))
    if row is None:
        return {"held": None, "why": "no setting meets the wish"}
    found = measure(_scenes(design, rest), settings, REPEATS)
    own = next(other for other in found.rows if other.label == row.label)
    share, cost = _share(own, found, wish), own.cost / _least(found, wish)
    good = share >= 0.9 and cost <= DEARER
    why = (
        f"{row.label} for {wish.most:.0%}: {share:.2f} of the cases, {cost:.2f} times "
        "the cheapest cost"
    )
    return {"held": good, "why": why, "share": share, "cost": cost, "label": row.label}


def _scenes(design: Design, numbers: list[int]) -> dict[str, Any]:
    return {design.name(n): design.scene(n) for n in numbers}


def _share(row: Tried, found: Tradeoff, wish: Wish) -> float:
    errors = wish.errors(row, found.cases)
    return float(np.mean([error <= wish.most for error in errors])) if errors else 1.0


def _least(found: Tradeoff, wish: Wish) -> float:
    """Return the least cost of a setting that meets the wish; infinite for none."""
    good = [row.cost for row in found.rows if _share(row, found, wish) >= 0.9]
    return min(good, default=math.inf)
