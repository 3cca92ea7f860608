"""Starts of amplitudes and velocities are uniform over the energy at speed.

With `rotation = "full"`, 300 draws on modes of one nodal diameter, or of several, at
four speeds on engines of 5 to 9 blades: their energy is that asked for to 1e-9, and the
mean share of strain energy, by the rotor's matrices, is one half within three standard
errors.
"""

from __future__ import annotations

import math
import random
from typing import Any

import numpy as np

from hpcwhirl.case.resolve import Case, resolve
from hpcwhirl.dynamics.start import start_of
from hpcwhirl.reduction.waves import turning_matrices
from hpcwhirl.scene import Scene, apply_settings

COUNT, LEAST = 12, 0.9  # three standard errors: one of 370 is beyond by chance
DRAWS = 300
SPEEDS = 100.0, 300.0, 500.0, 800.0
MODES = "rotor 1F 2", "rotor 1F 0", "rotor 1F 2, rotor 2F 2, rotor 1F 0"
ENGINE = {
    "rotation": "full", "rotor.elements": 3, "harmonics": 6, "force": 0.0, "gap": 0.4,
    "start_energy": 0.3, "start_as": "both",
}  # fmt: skip


def drawn(seed: int, index: int) -> dict[str, Any]:
    """Return the settings of a scene; the speed is the next of `SPEEDS`."""
    lot = random.Random(f"starts {seed} {index}")
    blades = lot.randint(5, 9)
    return {
        "blades": blades, "modes": 2 * blades, "speed": SPEEDS[index % len(SPEEDS)],
        "start_modes": lot.choice(MODES),
    }  # fmt: skip


def judged(row: dict[str, Any]) -> dict[str, Any]:
    """Draw starts and take the mean of their share of strain energy."""
    scene = apply_settings(Scene(), ENGINE | row)
    rotor = (model := resolve(scene).model).rotor
    stiffness = turning_matrices(rotor, scene.speed, row["blades"])[2]
    shares, off = [], 0.0
    for draw in range(DRAWS):
        given = apply_settings(scene, {"start_draw": draw / DRAWS})
        place, velocity = start_of(Case(given, model))[:2]
        strain = place @ stiffness @ place / 2
        energy = strain + velocity @ rotor.mass @ velocity / 2
        shares.append(strain / energy)
        off = max(off, abs(energy / scene.start_energy - 1.0))
    mean, error = float(np.mean(shares)), float(np.std(shares)) / math.sqrt(DRAWS)
    held = bool(abs(mean - 0.5) <= 3.0 * error and off < 1e-9)
    return {"held": held, "share": mean, "why": f"{mean:.3f} +- {error:.3f}, {off:.2g}"}
