"""Random scenes over the whole allowed box: refused in a line, lost, or sound."""

from __future__ import annotations

from typing import Any

import numpy as np
from extremes.laws import SHORT, any_law
from extremes.table import FEATURES, SCHEMES, Extreme

from hpcwhirl.scene import Scene, flatten
from hpcwhirl.scene.input_names import full_name

FEW = 2000  # steps of a random scene
WIDE, NEAR = 300.0, 3.0  # decades around a default that an input may lie
CHOICES: dict[str, tuple[Any, ...]] = {
    "solver.scheme": SCHEMES,
    "engine.rotor.blades": (1, 2, 3, 5, 22),
    "engine.rotor.elements": (1, 2, 10, 20),
    "engine.rotor.centre": ("free", "clamped"),
    "engine.rotation": ("none", "full"),
    "engine.casing.kind": ("ring", "ring", "ring", "rigid"),
    "engine.casing.discretization": ("fourier", "fourier", "elements"),
    "engine.casing.harmonics": (1, 2, 20),
    "engine.casing.elements": (3, 4, 40),
    "nodal_diameter": (0, 1, 2, 3, 20),
    "solver.modes": (0, 1, 20, 110),
    "direction": ("squeeze", "stretch"),
}
SIZES = (
    "engine.rotor.blades", "engine.rotor.centre", "engine.rotor.elements",
    "engine.casing.kind", "engine.casing.harmonics", "solver.modes",
)  # fmt: skip
FIXED = ("duration", "revolutions", "output.interval", "engine.casing.amplitude")


def random_scene(seed: int) -> Extreme:
    """Return a scene with a few inputs drawn anew, some of them at absurd places."""
    rng = np.random.default_rng(seed)
    plain = {n: v for n, v in flatten(Scene()).items() if isinstance(v, float)}
    names = [n for n in plain if n not in FIXED]
    drawn: dict[str, Any] = {}
    for name in rng.choice(names, size=rng.integers(1, 6), replace=False):
        decades = rng.choice([0.3, NEAR, WIDE], p=[0.5, 0.4, 0.1])
        default = plain[str(name)] or 1.0
        drawn[str(name)] = float(default * 10.0 ** rng.uniform(-decades, decades))
    for name, values in CHOICES.items():
        if rng.random() < 0.3:
            drawn[name] = values[rng.integers(len(values))]
    if drawn.setdefault("solver.scheme", "modal") in {"modal", "exact"}:
        for name in SIZES:  # a kernel of its own for each: half a minute to compile
            drawn.pop(name, None)
    if drawn.get("engine.casing.kind") == "rigid":
        drawn["engine.casing.amplitude"] = 2e-4
    if rng.random() < 0.2:
        drawn["speed"] = -float(drawn.get("speed", 410.0))
    step = float(drawn.get("solver.time_step", SHORT["time_step"]))
    drawn["solver.time_step"] = step
    drawn |= {
        "duration": FEW * step,
        "output.interval": 5 * step,
        "solver.accuracy": 0.0,
    }
    return Extreme("random", drawn, any_law)


def with_feature(seed: int) -> Extreme:
    """Return a random scene with a feature on, two of whose numbers are drawn anew."""
    rng = np.random.default_rng([seed, 1])
    on, numbers = FEATURES[list(FEATURES)[rng.integers(len(FEATURES))]]
    own = {full_name(name): value for name, value in on.items()}
    plain = flatten(Scene()) | own
    for name in rng.choice(numbers, size=min(2, len(numbers)), replace=False):
        decades = rng.choice([0.3, 3.0, 30.0]) * rng.uniform(-1.0, 1.0)
        usual = float(plain[full_name(str(name))] or 1.0)
        own[full_name(str(name))] = usual * 10.0**decades
    return Extreme("random", random_scene(seed).settings | own, any_law)
