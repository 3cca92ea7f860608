"""What linear theory says of an engine before anything is integrated.

Contacts held closed, all tips sliding on the ring (`hpcwhirl.analysis.stability`), have
a forward root, the ring's translation with 1F's backward wave, and a backward one, the
ring with the suspension. Where contact hardens up to being closed and the root still
grows, nothing bounds the motion: the forward root of an engine with the paper's step
crosses zero near 420 rad/s, the backward one of an engine that diverges at 270 grows
there (scripts/identify/why.md). What keeps 410 up is a forward root that grows with
contacts closed for a part of the time, springs in their place, and no more when closed.
Of the pulse and of basins all this tells nothing.
"""

from __future__ import annotations

import numpy as np
from identify.score import Row
from identify.space import GAP, Engine

from hpcwhirl.analysis.stability import closed_roots, coupled, sprung_roots, static_line
from hpcwhirl.case.resolve import resolve
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene, apply_settings

FRICTION = 0.1
LINES = {"forward": (120.0, 650.0), "backward": (-350.0, -40.0)}  # rad/s, static
SPRINGS = (1.5e5, 3e5, 6e5, 1.2e6, 2.5e6, 5e6)  # N/m a blade
NONE = -100.0  # 1/s: no such root
SMALL = {"solver.modes": 44, "engine.casing.harmonics": 6}
WIDE = 10.0  # 1/s: as wrong as can be
SURE = 1.0  # 1/s beyond zero
# speed, root, whether it grows; what the paper has at 410 and 420 lies between
WANTED = (
    (270.0, "backward", True),
    (400.0, "forward", False),
    (400.0, "backward", False),
    (410.0, "forward sprung", True),
    (410.0, "backward sprung", False),
    (430.0, "forward", True),
)
SPEEDS = tuple(dict.fromkeys(speed for speed, _, _ in WANTED))


def model_at(engine: Engine) -> Model:
    """Return the reduced model of an engine on Table 2; any speed's."""
    scene = apply_settings(Scene(), engine | SMALL | {"gap": GAP})
    return resolve(scene).model


def growths(model: Model, speed: float) -> Row:
    """Return the growth, 1/s, of the roots that are `WANTED` at a speed.

    Of contacts held closed, or the largest over `SPRINGS` in their place.
    """
    pair = coupled(model, 1, speed, FRICTION)
    row: Row = {"kind": "linear", "speed": speed}
    for root in (root for at, root, _ in WANTED if at == speed):
        name, _, sprung = root.partition(" ")
        roots = closed_roots(pair)
        if sprung:
            roots = np.concatenate([sprung_roots(pair, each) for each in SPRINGS])
        lines = static_line(roots.imag, 1, speed)
        low, high = LINES[name]
        own = roots.real[(lines > low) & (lines < high)]
        row[root] = float(f"{own.max(initial=NONE):.6g}")
    return row


def linear_rows(engine: Engine) -> list[Row]:
    """Return what linear theory says at all `SPEEDS`."""
    model = model_at(engine)
    return [growths(model, speed) for speed in SPEEDS]


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
