"""Waves of both bodies with drawn combinations of features move as `general` does.

Engines of 3 to 8 blades with rotation, in scheme `modal` by the loop of waves, against
scheme `general` by the loop of bodies: up to three of the features below at once, over
5 ms. Displacements agree to 1e-9 of the largest, the terms of the ledger to 1e-8 of
their sum. Nothing is said of scenes that an input error refuses, of those without
contact, and of those that `modal` integrates by other kernels.
"""

from __future__ import annotations

import random
from typing import Any

import numpy as np

from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.kernels.loop.wave_types import PointsRotor
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import InputError
from hpcwhirl.scene import Scene, apply_settings

COUNT = 40
LEAST = 1.0
NEAR, NEAR_IN_LEDGER = 1e-9, 1e-8
MOST = 3  # features at once
SHAPE = "harmonic,amplitude,phase;2,1e-5,0.3"


def _features(draw: random.Random, blades: int) -> dict[str, dict[str, Any]]:
    """Return the inputs of each feature, {name: {input: value}}."""
    return {
        "mistuning": {
            "mistuning": [round(draw.gauss(0.0, 0.03), 4) for _ in range(blades)],
        },
        "unlike supports": {"stiffness_difference": draw.uniform(-8e6, 8e6)},
        "film": {
            "film_viscosity": draw.uniform(0.01, 0.1), "film_length": 0.03,
            "film_radius": 0.05, "film_clearance": draw.uniform(1e-4, 4e-4),
        },
        "unbalance": {"unbalance": 10 ** draw.uniform(-4.0, -2.5)},
        "cross coupling": {"cross_coupling": draw.uniform(1e5, 3e6)},
        "oval": {"casing.profile": SHAPE},
        "release": {"casing.profile": SHAPE, "casing.profile_release": 2e-3},
        "gap closes": {"gap_closure": 2e-5, "gap_time": 3e-3},
        "rigid": {
            "casing.kind": "rigid", "casing.amplitude": 1.2e-4, "casing.rise": 1e-3,
        },
        "tilt": {"shaft": "cantilever"},
        "lost blade": {
            "lost_blade": 1, "amplitude_limit": 0.5, "centre_stiffness": 3e8,
        },
    }  # fmt: skip


def drawn(seed: int, index: int) -> dict[str, Any]:
    """Return the inputs of an engine, {name: value}."""
    draw = random.Random(f"terms {seed} {index}")
    blades = draw.randint(3, 8)
    given: dict[str, Any] = {
        "blades": blades, "modes": 2 * blades, "casing.harmonics": 5,
        "nodal_diameter": draw.choice([1, 1, 2]), "rotation": "full",
        "speed": draw.choice([-1.0, 1.0]) * draw.uniform(150.0, 500.0),
        "friction": draw.choice([0.0, 0.1, 0.3]), "gap": draw.uniform(3e-5, 8e-5),
        "time_step": 4e-6, "duration": 5e-3, "revolutions": 0.0, "plan": "everything",
    }  # fmt: skip
    features = _features(draw, blades)
    for name in draw.sample(sorted(features), draw.randint(1, MOST)):
        given |= features[name]
    return given


def judged(scene: dict[str, Any]) -> dict[str, Any]:
    """Return how far the two loops are apart, relative to the largest numbers."""
    try:
        waves, bodies = (
            March(resolve(apply_settings(Scene(), {**scene, "scheme": name})))
            for name in ("modal", "general")
        )
        if not isinstance(waves.scheme.arrays.rotor, PointsRotor):
            return {"held": None, "why": "by other kernels"}
        one, other = waves.run(), bodies.run()
    except InputError as error:
        return {"held": None, "why": str(error)}
    if not other.contacts:
        return {"held": None, "why": "no contact"}
    pairs = list(zip(*map(_present, (waves, bodies)), strict=True))
    apart = max(_off(here, there) for here, there in pairs)
    through = sum(map(abs, other.ledger.values()))
    off = max(abs(one.ledger[term] - value) for term, value in other.ledger.items())
    held = apart < NEAR and off < NEAR_IN_LEDGER * through
    why = f"apart by {apart:.1e}, ledger by {off / through:.1e}"
    return {"held": held, "apart": apart, "ledger": off / through, "why": why}


def _present(march: March) -> list[Any]:
    """Return the displacements of rotor and casing, without the tip of a lost blade."""
    lost = march.scene.engine.rotor.lost_blade
    rotor, casing = march.displacements()
    tip = [2 * lost, 2 * lost + 1] if lost >= 0 else []
    return [np.delete(rotor, tip), casing]


def _off(here: Any, there: Any) -> float:
    largest = np.abs(there).max(initial=0.0)
    return float(np.abs(here - there).max() / largest) if largest > 0.0 else 0.0
