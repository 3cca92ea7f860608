"""A casing whose departures are all outward nowhere narrows the gap: nothing touches.

Tables over the angle are drawn with departures >= 0: trenches, steps, slits, worn arcs
and noise of up to 3 mm, with edges down to 0.005 rad, in rigid and in elastic casings,
around a rotor that nothing loads. A profile may be refused because its harmonics miss
the table; of the others the gap that is left must be that of the circle to a millionth
of the largest departure, and in a run of two revolutions no blade may touch.
"""

from __future__ import annotations

import math
import random
from typing import Any

import numpy as np

from hpcwhirl.campaign.simulate import simulate
from hpcwhirl.case.profile import departure, shape_of
from hpcwhirl.errors import InputError
from hpcwhirl.scene import Scene, apply_settings

COUNT, LEAST = 50, 1.0
CLOSE = 1e-6  # relative to the largest departure
ENGINE = {
    "rotation": "none", "blades": 4, "rotor.elements": 2, "modes": 8, "harmonics": 8,
    "force": 0.0, "time_step": 4e-6, "traces": "summary", "gap": 1.28e-4,
}  # fmt: skip
AROUND = np.linspace(0.0, 2 * math.pi, 50001)


def drawn(seed: int, index: int) -> dict[str, Any]:
    """Return the settings of a scene with a profile over the angle."""
    lot = random.Random(f"profiles {seed} {index}")
    size = 10 ** lot.uniform(-5.0, math.log10(3e-3))
    rows = _steps(lot, size) if lot.random() < 0.6 else _noise(lot, size)
    table = ";".join(["angle,departure", *(f"{a!r},{w!r}" for a, w in rows)])
    kind = lot.choice(("ring", "rigid"))
    return {"profile": table, "casing.kind": kind, "speed": lot.uniform(100.0, 600.0)}


def _steps(lot: random.Random, size: float) -> list[tuple[float, float]]:
    """Return arcs of constant departure, some of which are 0, with steep edges."""
    count = lot.randint(1, 4)
    starts = sorted(lot.uniform(0.0, 6.0) for _ in range(count))
    rows = [(0.0, 0.0)]
    for start, until in zip(starts, [*starts[1:], 6.2], strict=True):
        edge = 10 ** lot.uniform(-2.3, -0.5)
        end = start + lot.uniform(0.2, 0.9) * (until - start)
        depth = size * lot.random()
        ends = start, start + edge, end, end + edge
        rows += zip(ends, (0.0, depth, depth, 0.0), strict=True)
    far = [max(a for a, _ in rows[: i + 1]) for i in range(len(rows))]
    ascends = [i == 0 or far[i] > far[i - 1] for i in range(len(rows))]
    return [row for row, ahead in zip(rows, ascends, strict=True) if ahead]


def _noise(lot: random.Random, size: float) -> list[tuple[float, float]]:
    """Return departures at unevenly spaced angles, a third of which are 0."""
    angles = sorted({lot.uniform(0.0, 6.28) for _ in range(lot.randint(4, 40))})
    return [(a, size * max(0.0, lot.uniform(-0.5, 1.0))) for a in angles]


def judged(row: dict[str, Any]) -> dict[str, Any]:
    """Look for the least gap at all angles, and integrate two revolutions."""
    last = {"duration": 4 * math.pi / row["speed"]}
    try:
        scene = apply_settings(Scene(), ENGINE | row | last)
        found = simulate(scene).row
    except InputError as refused:
        return {"held": None, "why": str(refused)}
    least = float(departure(shape_of(scene), AROUND).min())
    most = max(float(line.split(",")[1]) for line in row["profile"].split(";")[1:])
    if least < -CLOSE * most:
        return {"held": False, "why": f"{-least:.3g} m inward of {most:.3g} m outward"}
    touches = found["contacts"]
    return {"held": touches == 0, "why": f"{touches} contacts" if touches else ""}
