"""The setting that `tradeoff --for` names meets its wish on the rest of the campaign.

Engines of 4 to 6 blades, each with a campaign of 36 cases over speed, friction and gap,
of 0.06 s, in preset `reference`. All cases are integrated with all settings. Of `DRAWN`
cases, in their drawn order, the cheapest setting is chosen as `tradeoff --for` does it,
for a peak of the tips within 5 %, else 10 %, else 20 %, the first that a setting is
sure to meet. The wish must be met on the rest of the campaign, in nine of ten of the
cases that can be judged, or in all but one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from common import share

from hpcwhirl.benchmark.drawing import drawn_cases
from hpcwhirl.benchmark.tradeoff import Measurement, Tradeoff
from hpcwhirl.benchmark.tradeoff import Row as Tried
from hpcwhirl.benchmark.trials import BOTH, PRESET, settings_of
from hpcwhirl.benchmark.wish import BATCH, Wish, cheapest, is_settled
from hpcwhirl.campaign.plan.design import Design

COUNT, LEAST = 30, 0.9
REPEATS, DRAWN = 2, 24
DEARER = 1.3
WISHES = [Wish("peak", most) for most in (0.05, 0.1, 0.2)]
Row = dict[str, Any]
Found = Callable[[list[str]], Tradeoff]


def drawn(seed: int, index: int) -> Row:
    """Return the tables of a campaign."""
    random = np.random.default_rng([seed, index])
    speed = float(random.uniform(200.0, 450.0))
    gap = float(10 ** random.uniform(-4.0, -3.3))
    return {
        "scene": {"duration": 0.06},
        "engine": {
            "rotor": {
                "blades": int(random.integers(4, 7)),
                "damping": float(10 ** random.uniform(-2.5, -1.5)),
            },
            "casing": {"damping": float(10 ** random.uniform(-2.5, -1.3))},
        },
        "solver": {"preset": "reference"},
        "sweep": {
            "speed": [speed, 1.2 * speed, 1.5 * speed],
            "friction": [0.03, 0.06, 0.1],
            "gap": [gap, 1.5 * gap, 2.0 * gap, 3.0 * gap],
        },
    }


def judged(document: Row) -> Row:
    """Choose a setting on some of a campaign's cases; ask it on the others."""
    design = Design.of(document)
    scenes = drawn_cases(design, len(design.settings))
    measured = Measurement(settings_of([PRESET, BOTH]), REPEATS, len(scenes))
    return answer(measured.add(scenes).found, list(scenes))


def answer(found: Found, names: list[str]) -> Row:
    """Return what is chosen by the first cases of a measurement, and how good it is.

    found, names : function from names of cases to what was measured of them; all names
    """
    wish, row, drawn_ = WISHES[-1], None, names
    for wish in WISHES:
        drawn_ = settled(found, names, wish)
        row = cheapest(found(drawn_), [wish])
        if row is not None:
            break
    if row is None:
        return {"held": None, "why": "no setting is sure to meet a wish"}
    whole, rest = found(names), found([name for name in names if name not in drawn_])
    own, least = wish.support(same(row, rest), rest), least_cost(whole, wish)
    cost = same(row, whole).cost / least
    why = (
        f"{row.label} for {wish.most:.0%}: {own.met} of {own.of} other cases, "
        f"{cost:.2f} times the cheapest cost"
    )
    told = {"wish": wish.most, "met": own.met, "of": own.of, "drawn": len(drawn_)}
    good = own.met >= min(0.9 * own.of, own.of - 1)
    return {"held": good, "why": why, "cost": cost, "label": row.label} | told


def summed(rows: list[Row]) -> str:
    """Return the share of all other cases that met the wish, and the costs."""
    asked = [row for row in rows if row["held"] is not None]
    met, of = (sum(row[name] for row in asked) for name in ("met", "of"))
    costs = [row["cost"] for row in asked if math.isfinite(row["cost"])]
    near = sum(cost <= DEARER for cost in costs)
    return (
        f"of the cases that were not drawn {share(met, of)} met the wish; {len(asked)} "
        f"of {len(rows)} engines had a setting. It cost {np.median(costs):.2f} times "
        "the cheapest with which nine in ten of all cases meet it (median; "
        f"{min(costs):.2f} to {max(costs):.2f}), at most {DEARER:g} times in {near} of "
        f"{len(costs)}."
    )


def settled(found: Found, names: list[str], wish: Wish) -> list[str]:
    """Return the cases that `search` would integrate, of at most `DRAWN`."""
    for count in range(BATCH, DRAWN + 1, BATCH):
        if is_settled(found(names[:count]), [wish], DRAWN - count):
            break
    return names[:count]


def same(row: Tried, found: Tradeoff) -> Tried:
    """Return the row of other cases that has the same setting."""
    name = row.label.split(" = ")[0]
    return next(other for other in found.rows if name in other.label.split(" = "))


def least_cost(found: Tradeoff, wish: Wish) -> float:
    """Return the least cost of a setting with which nine in ten cases meet a wish."""
    known = [(row.cost, wish.support(row, found)) for row in found.rows]
    return min((c for c, s in known if s.met >= 0.9 * s.of), default=math.inf)
