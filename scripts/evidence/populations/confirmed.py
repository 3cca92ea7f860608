"""Confirming a map by estimate repeats no more cases, and gives the same words.

Engines of 4 to 7 blades, half of them with `rotation = "full"`, over 9 speeds and 5
gaps, 1 s. All cases are computed in `draft` with and without `estimate = "step"`, in
`standard`, and in `standard` with a step shorter by 3 %, its twin. Which of them a map
refined from 3 x 3 cases would need, confirmed by `standard`, is looked up: at all
boundaries as without an estimate, and as with it. With it no more cases may be computed
again, and at most two more points may have another word than `standard` gives than by
its twin: that much is chance. The processor time of both, against all cases in
`standard`, is told: an estimate takes half of `draft`'s time again.
"""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np

from hpcwhirl.benchmark.trials import pinned
from hpcwhirl.campaign.simulate import simulate
from hpcwhirl.refinement.growth import Growth
from hpcwhirl.refinement.lattice import Lattice, Point, Side
from hpcwhirl.refinement.tree import Tree
from hpcwhirl.scene import Scene, apply_settings, preset_inputs

COUNT, LEAST = 9, 0.8
MORE = 2  # points with other words than by the twin, of 45
SPECKLE = 2
SUSPENSION = 0.0275  # damping of the suspension, which a turning rotor's is below
LATTICE = Lattice(
    (
        Side("speed", (40.0, 280.0, 520.0), (2, 2)),
        Side("gap", (0.8e-4, 1.8e-4, 4e-4), (1, 1), "log"),
    )
)
POINTS: list[Point] = [(i, j) for i in range(9) for j in range(5)]
Row = dict[str, Any]


def drawn(seed: int, index: int) -> Row:
    """Return the inputs of an engine."""
    random = np.random.default_rng([seed, index])
    most = math.inf if index % 2 == 0 else SUSPENSION
    return {
        "rotor.blades": int(random.integers(4, 8)),
        "friction": float(random.uniform(0.03, 0.2)),
        "rotor.damping": min(float(10 ** random.uniform(-2.5, -1.3)), most),
        "casing.damping": float(10 ** random.uniform(-2.5, -1.3)),
        "rotation": ["none", "full"][index % 2],
        "duration": 1.0,
    }


def judged(inputs: Row) -> Row:
    """Compute all cases of an engine, and look up what maps would have."""
    cases = {point: computed(inputs, point) for point in POINTS}
    whole = sum(case["standard_s"] for case in cases.values())
    by_place, by_estimate = (looked_up(cases, sure=sure) for sure in (False, True))
    twin = [case["twin"] != case["standard"] for case in cases.values()]
    other = by_estimate["other"]
    fewer = by_estimate["again"] <= by_place["again"]
    held = fewer and other <= sum(twin) + MORE
    told = {"place": by_place, "estimate": by_estimate, "twin": sum(twin)}
    why = (
        f"{other} of {len(POINTS)} words differ, {by_place['other']} by place, "
        f"{sum(twin)} of the twin; {by_estimate['seconds'] / whole:.2f} of the time, "
        f"{by_place['seconds'] / whole:.2f} by place"
    )
    return {"held": held, "why": why, "standard": whole} | told


def summed(rows: list[Row]) -> str:
    """Return how many words differ from those of `standard`, and the time it takes."""
    points, whole = len(rows) * len(POINTS), sum(row["standard"] for row in rows)
    parts = [
        f"{name} {sum(row[key]['other'] for row in rows)} words, "
        f"{sum(row[key]['seconds'] for row in rows) / whole:.2f} of the time, "
        f"{sum(row[key]['again'] for row in rows)} cases computed again"
        for name, key in (("by place", "place"), ("by estimate", "estimate"))
    ]
    twins = sum(row["twin"] for row in rows)
    return (
        f"of {points} points other than all in `standard`: {'; '.join(parts)}; "
        f"of the twins of `standard` {twins} words."
    )


def computed(inputs: Row, point: Point) -> Row:
    """Return the words of a case and the processor time of each of its runs, s."""
    sides = zip(LATTICE.sides, point, strict=True)
    base = apply_settings(Scene(), inputs | {s.name: s.value(x) for s, x in sides})
    draft, standard = (apply_settings(base, preset_inputs(name))
                       for name in ("draft", "standard"))  # fmt: skip
    scenes = {
        "draft": draft,
        "estimated": apply_settings(draft, {"estimate": "step"}),
        "standard": standard,
        "twin": pinned(standard, 0.97),
    }
    found: Row = {}
    for name, scene in scenes.items():
        start = time.process_time()
        row = simulate(scene).row
        found |= {name: row["regime"], f"{name}_s": time.process_time() - start}
        if name == "estimated":
            found["sure"] = row["coarse_regime"] == row["regime"] != "none"
    return found


def looked_up(cases: dict[Point, Row], *, sure: bool) -> Row:
    """Return seconds, cases computed again, and points with other words of a map.

    sure : whether cases whose word is that of the longer step count as sure
    """
    growth = Growth(LATTICE, 1, SPECKLE, confirm=True)
    growth.feed(
        lambda a: word_of(cases[a.point]["standard" if a.fidelity else "draft"]),
        list(growth.wanted),
        lambda a: sure and bool(cases[a.point]["sure"]),
    )
    first = "estimated_s" if sure else "draft_s"
    names = [(a.point, "standard_s" if a.fidelity else first) for a in growth.wanted]
    tree = growth.trees[0]
    other = sum(shown(tree, p) != word_of(cases[p]["standard"]) for p in POINTS)
    return {
        "seconds": sum(cases[point][name] for point, name in names),
        "again": sum(a.fidelity for a in growth.wanted),
        "other": other,
    }


def word_of(regime: str) -> str | None:
    """Return the word by which a map is refined; None if a case has none."""
    return None if regime == "none" else regime


def shown(tree: Tree, point: Point) -> Any:
    """Return the word that a map shows at a point: that of the nearest corner."""
    whole = [c for c, node in tree.cells.items() if not node.split]
    corners = {p for c in whole if inside(c, point) for p in tree.cells[c].corners}
    near = min(corners, key=lambda p: (apart(p, point), p))
    return tree.word(near)


def inside(cell: Any, point: Point) -> bool:
    """Return whether a point lies in a cell, its edges included."""
    corners = LATTICE.corners(cell)
    return all(a <= x <= b for a, x, b
               in zip(corners[0], point, corners[-1], strict=True))  # fmt: skip


def apart(one: Point, other: Point) -> int:
    """Return the largest distance of two points along an input."""
    return max(abs(a - b) for a, b in zip(one, other, strict=True))
