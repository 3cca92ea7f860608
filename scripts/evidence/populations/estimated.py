"""A run's error by its time step is within 3 `solver.estimate` in 3 of 4 cases.

Engines of 6 to 10 blades at drawn speed, gap and friction, in `draft`, 0.3 s. The error
of the radius and of the centre's peak is that against a quarter of the step, with the
same modes. Both must be below three times the estimate, or below 1 % of themselves;
where the run with a quarter of the step has another word, so must the longer step, or
one of the numbers must be estimated to be off by 5 % or more.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hpcwhirl.analysis.estimate import COMPARED
from hpcwhirl.analysis.estimate import LEAST as FLOOR
from hpcwhirl.benchmark.trials import pinned
from hpcwhirl.campaign.simulate import simulate
from hpcwhirl.scene import Scene, apply_settings, preset_inputs

COUNT, LEAST = 200, 0.75
TIMES, SMALL, LARGE = 3.0, 0.01, 0.05
Row = dict[str, Any]


def drawn(seed: int, index: int) -> Row:
    """Return the inputs of a case."""
    random = np.random.default_rng([seed, index])
    return {
        "rotor.blades": int(random.integers(6, 11)),
        "speed": float(random.uniform(200.0, 520.0)),
        "gap": float(10 ** random.uniform(-4.0, -3.3)),
        "friction": float(random.uniform(0.02, 0.2)),
        "rotor.damping": float(10 ** random.uniform(-2.5, -1.3)),
        "duration": 0.3,
    }


def judged(inputs: Row) -> Row:
    """Compare the estimate of a case with its error against a quarter of its step."""
    scene = apply_settings(Scene(), preset_inputs("draft") | inputs)
    row = simulate(apply_settings(scene, {"estimate": "step"})).row
    fine = simulate(pinned(scene, 0.25)).row
    wrong = []
    sure = row["coarse_regime"] == row["regime"]
    sure = sure and max(row[name] for name in COMPARED) < LARGE
    if sure and fine["regime"] != row["regime"]:
        wrong.append(f"{row['regime']}, of a quarter of the step {fine['regime']}")
    for name, of in COMPARED.items():
        size = max(abs(float(row[of])), FLOOR * scene.gap)
        error = abs(float(row[of]) - float(fine[of])) / size
        if error > max(TIMES * row[name], SMALL):
            wrong.append(f"{of} off by {error:.2g}, estimated {row[name]:.2g}")
    return {"held": not wrong, "why": "; ".join(wrong)}
