"""A preset keeps its radius on features wherever `solver.estimate` says that it does.

Engines of 6 to 9 blades with a feature on, which touch, at drawn speed, gap, friction
and damping, five of each feature for 0.5 s and five for 2.5 s; each preset, with
`estimate = "all"`, against a run with half the step of `reference` and a truncation
of 0.3 % in place of 1 %. A preset is sure of a case where three times `radius_error` is
within what it states of nine engines in ten, and the coarser run has its word. Then its
radius must be within what it states, and its word that of the finer run. A case of
which no preset is sure is not asked.
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
from hpcwhirl.scene.quantities import ESTIMATED
from hpcwhirl.scene.shaft_tables import text_of

COUNT, LEAST = 140, 0.9
PRESETS = "draft", "standard", "reference"
TIMES = 3.0  # what an error may be / its estimate
SHORT, LONG = 0.5, 2.5  # s
OFTEN = 5  # cases of each feature that last SHORT; further ones last LONG
NUMBERS = "orbit_radius", "contact_impulse", "centre_peak"
FLOOR = 0.01  # of the gap, what a length is compared with, at least
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
        "duration": LONG if index >= OFTEN * len(FEATURES) else SHORT,
        "amplitude_limit": 2.0,
    }
    return {"feature": name, "inputs": given | feature(name, random, gap, blades)}


def _scene(given: Row) -> Scene:
    return apply_settings(named_scene("four_motions"), given)


def _row(given: Row, more: Row) -> Row:
    found = simulate(_scene(more | given | {"traces": "summary"})).row
    names = ("regime", "outcome", "contacts", *NUMBERS, *ESTIMATED)
    return {name: found[name] for name in names if name in found}


def _apart(one: Row, other: Row, gap: float) -> Row:
    """Return {number: relative difference} of two rows."""
    least = {"orbit_radius": FLOOR * gap, "centre_peak": FLOOR * gap}
    return {
        name: abs(float(one[name]) - float(other[name]))
        / max(abs(float(other[name])), least.get(name, 1e-9))
        for name in NUMBERS
    }


def is_sure(row: Row, preset: str, times: float = TIMES) -> bool:
    """Return whether a preset's estimate says that it keeps its word and radius."""
    most = preset_bounds(preset)["orbit_radius"] / times
    return bool(row["radius_error"] <= most and row["coarse_regime"] == row["regime"])


def judged(case: Row) -> Row:
    """Compute a case by presets, and finer; say what is apart where they are sure."""
    given = case["inputs"]
    try:
        finer = _row(given, preset_inputs("reference") | FINER)
        rows = {
            name: _row(given, preset_inputs(name) | {"estimate": "all"})
            for name in PRESETS
        }
    except WhirlError as failed:
        return {"held": None, "why": f"refused: {failed}"}
    if not finer["contacts"]:
        return {"held": None, "why": "no contact"}
    errors = {name: _apart(row, finer, given["gap"]) for name, row in rows.items()}
    same = {name: row["regime"] == finer["regime"] for name, row in rows.items()}
    sure = {name: is_sure(row, name) for name, row in rows.items()}
    wrong = [
        f"{name}: radius off by {errors[name]['orbit_radius']:.2g}, estimated "
        f"{rows[name]['radius_error']:.2g}, word {same[name]}"
        for name in PRESETS
        if sure[name]
        and not (
            same[name]
            and errors[name]["orbit_radius"] <= preset_bounds(name)["orbit_radius"]
        )
    ]
    told = {"errors": errors, "sure": sure, "same": same, "rows": rows}
    held = not wrong if any(sure.values()) else None
    why = "; ".join([case["feature"], *wrong])
    return {"held": held, "why": why, "word": finer["regime"]} | told
