"""What linear theory says of an engine before anything is integrated.

Contacts held closed, all tips sliding on the ring (`hpcwhirl.analysis.stability`), have
a forward root, the ring's translation with 1F's backward wave, and a backward one, the
ring with the suspension. Where contact hardens up to being closed and the root still
grows, nothing bounds the motion: the forward root of an engine with the paper's step
crosses zero near 420 rad/s, the backward one of an engine that diverges at 270 grows
there (scripts/identify/why.md). Of the pulse and of basins it tells nothing.
"""

from __future__ import annotations

import numpy as np
from identify.score import Row
from identify.space import GAP, Engine

from hpcwhirl.analysis.stability import closed_roots, coupled, static_line
from hpcwhirl.case.resolve import resolve
from hpcwhirl.scene import Scene, apply_settings

FRICTION = 0.1
FORWARD, BACKWARD = (200.0, 650.0), (-350.0, -100.0)  # rad/s, static frame
NONE = -100.0  # 1/s: no such root
SMALL = {"solver.modes": 44, "engine.casing.harmonics": 6}
WIDE = 20.0  # 1/s: as wrong as can be
SURE = 1.0  # 1/s beyond zero
# speed, root, whether it grows; what the paper has at 410 and 420 lies between
WANTED = (
    (150.0, "backward", False),
    (150.0, "forward", False),
    (270.0, "backward", True),
    (400.0, "forward", False),
    (400.0, "backward", False),
    (430.0, "forward", True),
)
SPEEDS = tuple(dict.fromkeys(speed for speed, _, _ in WANTED))


def closed(engine: Engine, speed: float) -> Row:
    """Return the growth, 1/s, of both roots of closed contacts at a speed."""
    settings = engine | SMALL | {"speed": speed, "gap": GAP, "friction": FRICTION}
    model = resolve(apply_settings(Scene(), settings)).model
    roots = closed_roots(coupled(model, 1, speed, FRICTION))
    lines = static_line(roots.imag, 1, speed)
    row: Row = {"kind": "linear", "speed": speed}
    for name, (low, high) in (("forward", FORWARD), ("backward", BACKWARD)):
        own = roots.real[(lines > low) & (lines < high)]
        row[name] = float(f"{own.max(initial=NONE):.6g}")
    return row


def linear_miss(rows: list[Row]) -> float:
    """Return how far growths are from what the paper's motions want, 0 to 1."""
    at = {row["speed"]: row for row in rows if row["kind"] == "linear"}
    misses = []
    for speed, root, grows in WANTED:
        if speed not in at:
            return 1.0
        growth = at[speed][root]
        short = SURE - growth if grows else SURE + growth
        misses.append(float(np.clip(short / WIDE, 0.0, 1.0)))
    return sum(misses) / len(misses)


def linear_cost(engine: Engine) -> float:
    """Return `linear_miss` of an engine."""
    return linear_miss([closed(engine, speed) for speed in SPEEDS])
