"""A preset keeps its word and its radius on features, after half a second.

Engines of 6 to 9 blades with a feature on, which touch, at drawn speed, gap, friction
and damping, 0.5 s; each preset against a run with half the step of `reference`
and a truncation of 0.3 % in place of 1 %; beside it a twin of `standard` whose
force differs by 1e-6. A preset's word must be that of the finer run, and its radius
within what it states of nine engines in ten. A case whose twin is as far apart is
chaotic and is not asked.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hpcwhirl.campaign.simulate import simulate
from hpcwhirl.errors import WhirlError
from hpcwhirl.scene import (
    Scene,
    apply_settings,
    named_scene,
    preset_bounds,
    preset_inputs,
)
from hpcwhirl.scene.shaft_tables import text_of

COUNT, LEAST = 70, 0.6
PRESETS = "draft", "standard"
NUMBERS = "orbit_radius", "contact_impulse", "centre_peak"
FLOOR = 0.01  # of the gap, what a length is compared with, at least
TWIN = 1e-6
FINER = {"accuracy": 2.5e-5, "truncation": 0.003}
FULL: dict[str, Any] = {"rotation": "full"}
OVAL = "harmonic,amplitude,phase;2,{0},0.4"
Row = dict[str, Any]
LINE = text_of({
    "sections": [
        {"length": 0.2, "outer": 0.12, "inner": 0.05}, {"length": 0.5, "outer": 0.1},
    ],
    "bearings": [
        {"station": 0, "kxx": 4e7, "cxx": 5e3}, {"station": 2, "kxx": 6e7, "cxx": 8e3},
    ],
}, "the shaft")  # fmt: skip
FEATURES = (
    "none", "rotation", "tilt", "shaft", "release", "eccentric", "oval", "unbalance",
    "film", "gravity", "unlike supports", "mistuned", "run-up", "gap closes",
)  # fmt: skip


def feature(name: str, random: np.random.Generator, gap: float, blades: int) -> Row:
    """Return the inputs that switch a feature on, its numbers drawn.

    gap, blades : m, and number of blades, of the engine
    """
    share, far = float(random.uniform(0.1, 0.4)), float(random.uniform(0.2, 0.5))
    spread = (0.02 * random.standard_normal(blades)).tolist()
    return {
        "none": {},
        "rotation": FULL,
        "tilt": FULL | {"shaft": "cantilever"},
        "shaft": FULL | {"shaft": LINE, "shaft_station": 1},
        "release": {"profile": OVAL.format(far * gap), "profile_release": 0.05},
        "eccentric": {"offset": far * gap},
        "oval": {"profile": OVAL.format(far * gap)},
        "unbalance": FULL | {"unbalance": 10 ** float(random.uniform(-4.5, -3.0))},
        "film": FULL | {"film_viscosity": 0.01, "film_length": 0.1,
                        "film_radius": 0.15, "film_clearance": 1e-3},
        "gravity": FULL | {"gravity": share * 2.0, "gravity_angle": -1.57},
        "unlike supports": FULL | {"stiffness_difference": share * 2e7},
        "mistuned": {"mistuning": spread},
        "run-up": {"acceleration": 500.0 * share},
        "gap closes": {"gap_closure": far * gap, "gap_time": 0.2},
    }[name]  # fmt: skip


def drawn(seed: int, index: int) -> Row:
    """Return the inputs of a case, and the name of its feature."""
    random = np.random.default_rng([seed, index])
    name, blades = FEATURES[index % len(FEATURES)], int(random.integers(6, 10))
    gap = float(10 ** random.uniform(-4.0, -3.4))
    given = {
        "rotor.blades": blades,
        "speed": float(random.uniform(200.0, 520.0)),
        "gap": gap,
        "friction": float(random.uniform(0.03, 0.2)),
        "rotor.damping": float(10 ** random.uniform(-2.5, -1.6)),
        "duration": 0.5,
        "amplitude_limit": 2.0,
    }
    return {"feature": name, "inputs": given | feature(name, random, gap, blades)}


def _scene(given: Row) -> Scene:
    return apply_settings(named_scene("four_motions"), given)


def _row(given: Row, more: Row) -> Row:
    found = simulate(_scene(more | given | {"traces": "summary"})).row
    return {name: found[name] for name in ("regime", "outcome", "contacts", *NUMBERS)}


def _apart(one: Row, other: Row, gap: float) -> Row:
    """Return {number: relative difference} of two rows."""
    least = {"orbit_radius": FLOOR * gap, "centre_peak": FLOOR * gap}
    return {
        name: abs(float(one[name]) - float(other[name]))
        / max(abs(float(other[name])), least.get(name, 1e-9))
        for name in NUMBERS
    }


def judged(case: Row) -> Row:
    """Compute a case by presets, finer, and a twin; say what is apart."""
    given = case["inputs"]
    gap, force = given["gap"], _scene(given).force
    try:
        finer = _row(given, preset_inputs("reference") | FINER)
        rows = {name: _row(given, preset_inputs(name)) for name in PRESETS}
        pushed = given | {"force": force * (1.0 + TWIN)}
        twin = _row(pushed, preset_inputs("standard"))
    except WhirlError as failed:
        return {"held": None, "why": f"refused: {failed}"}
    if not finer["contacts"]:
        return {"held": None, "why": "no contact"}
    errors = {name: _apart(row, finer, gap) for name, row in rows.items()}
    scatter = _apart(twin, rows["standard"], gap)
    same = {name: row["regime"] == finer["regime"] for name, row in rows.items()}
    wrong = [
        f"{name}: radius off by {errors[name]['orbit_radius']:.2g}, word {same[name]}"
        for name in PRESETS
        if not same[name]
        or errors[name]["orbit_radius"] > preset_bounds(name)["orbit_radius"]
    ]
    known = twin["regime"] == rows["standard"]["regime"]
    known = known and scatter["orbit_radius"] < 0.05
    told = {"errors": errors, "scatter": scatter, "same": same, "known": known}
    held = not wrong if known else None
    why = "; ".join([case["feature"], *wrong])
    return {"held": held, "why": why, "word": finer["regime"]} | told
