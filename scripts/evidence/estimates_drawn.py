"""The engines that estimates are held against, and what is measured of each.

An engine is drawn from (seed, index) alone. Of truncation: 12 to 36 blades, k = 0 .. 4,
every other without friction, rings of 6 to 45 mm by 0.08 to 0.5 m, damping of both
bodies over two decades, of support and suspension that or their own; loads so strong
that most touch within 2 ms, and those that do not left out. Presets: 13, 17 and 22
blades (a kernel is compiled for each), k = 1 .. 3, the same freedoms, pulses of 0.5 to
1 ms.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from evidence.early import KINDS, SLOW, drawn, scene_of

from hpcwhirl import simulate
from hpcwhirl.campaign.simulate import Course
from hpcwhirl.case.limits import SAFE
from hpcwhirl.case.resolve import Case, resolve
from hpcwhirl.case.rotation_choice import change_of, choice_of
from hpcwhirl.case.truncation import truncation_error
from hpcwhirl.dynamics.bodies.timestep import central_differences
from hpcwhirl.scene import (
    Scene,
    apply_settings,
    named_scene,
    preset_inputs,
    preset_names,
)

BASE = named_scene("four_motions")
WIDTH = 0.2  # m, of rings that the drawn forces are for
FINEST, FAMILIES = 80, 8  # harmonics, and fixed-interface modes a blade
TWIN = 1e-7
# twins of a case whose terms are left out; their number where these differ; next force
FEW, MANY, APART = 4, 8, 1e-5
WORDED = {"duration": 1.0, "until": "decided", "longest": 4.0, "time_step": 2e-6}
LEAST = 0.01  # of the gap: what a radius is compared with, at least
ASKED = (0.3, 0.05, 0.01)
PARTS: tuple[dict[str, Any], ...] = (
    {"families": 0}, {"families": 1}, {"families": 3}, {"families": 5},
    {"casing.harmonics": 6}, {"casing.harmonics": 12}, {"casing.harmonics": 20},
    {"casing.harmonics": 40}, {"casing.families": "bending"},
)  # fmt: skip
NUMBERS = {"orbit_radius": "orbit radius", "contact_impulse": "contact impulse"}
Record = dict[str, Any]


def _between(random: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(random.uniform(np.log(low), np.log(high))))


def _damping(random: np.random.Generator) -> dict[str, float]:
    return {
        "rotor.damping": _between(random, 1e-3, 0.1),
        "casing.damping": _between(random, 3e-3, 0.3),
    }


def _freedoms(
    random: np.random.Generator, thickness: tuple[float, float]
) -> dict[str, float]:
    """Return a ring, and the dampings that engines have of their own, or have not."""
    own = random.random(2) < 0.5
    return {
        "casing.width": _between(random, 0.08, 0.5),
        "casing.thickness": _between(random, *thickness),
        "casing.support_frequency": _between(random, 10.0, 25.0),
        "casing.support_damping": _between(random, 0.03, 0.6) if own[0] else -1.0,
        "rotor.suspension_damping": _between(random, 0.01, 0.6) if own[1] else -1.0,
    }


def touched_engine(seed: int, index: int) -> dict[str, Any]:
    """Return inputs of an engine and a load that is likely to make it touch."""
    random, lobes = np.random.default_rng([seed, index]), index % 5
    # a ring is stiff against a load without lobes
    gaps, forces = (
        ((1e-5, 1e-4), (2e5, 2e6)) if lobes == 0 else ((1e-4, 5e-4), (3e4, 3e5))
    )
    own = _freedoms(random, (6e-3, 45e-3))
    return own | {
        "blades": int(random.integers(12, 37)),
        "nodal_diameter": lobes,
        "friction": float(random.uniform(0.02, 0.2)) * (index // 5 % 2),
        "gap": _between(random, *gaps),
        "speed": float(random.uniform(20.0, 520.0)),
        "pulse": _between(random, 2e-4, 1.25e-3),
        "force": _between(random, *forces) * own["casing.width"] / WIDTH,
        **_damping(random),
    }


def _shortly(inputs: dict[str, Any]) -> Scene:
    """Return the scene of first contacts, in the kernel that is compiled once."""
    return apply_settings(BASE, inputs | {
        "duration": 2e-3, "interval": 1e-5, "traces": "full", "time_step": 1e-6,
        "plan": "everything", "scheme": "general",
        "modes": FAMILIES * inputs["blades"], "casing.harmonics": FINEST,
    })  # fmt: skip


def left_out_of(scene: Scene) -> list[tuple[str, Scene, float]]:
    """Return (way, what is left of a scene, error stated) of all ways tried."""
    out = []
    for part in PARTS:
        own = {n: v for n, v in part.items() if n != "families"}
        if "families" in part:
            own["modes"] = part["families"] * scene.engine.rotor.blades
        tried = apply_settings(scene, own)
        out.append(("estimate", tried, truncation_error(tried)))
    for asked in ASKED:
        tried = resolve(apply_settings(scene, {"truncation": asked})).reduced
        if tried.engine.casing.harmonics <= FINEST:  # what is finer can't be judged
            out.append(("as asked", apply_settings(tried, {"truncation": 0.0}), asked))
    return out


def of_truncation(seed: int, index: int) -> Record:
    """Return what truncation makes of an engine's motion, and what was stated."""
    inputs = touched_engine(seed, index)
    scene = _shortly(inputs)
    finest = simulate(scene)
    if not finest.row["contacts"]:
        return {"inputs": inputs, "left_out": "no contact"}
    true, rows = finest.traces["tips"], []
    for way, tried, stated in left_out_of(scene):
        tips = simulate(tried).traces["tips"]
        shown = min(len(tips), len(true))
        missed = ((tips[:shown] - true[:shown]) ** 2).sum() / (true[:shown] ** 2).sum()
        rows.append({"way": way, "found": float(np.sqrt(missed)), "stated": stated})
    return {"inputs": inputs, "contacts": finest.row["contacts"], "rows": rows}


def _turned(omega: float, ratio: float, step: float) -> float:
    """Return a mode's frequency as the scheme has it, from a step's eigenvalues."""
    found = central_differences(omega, ratio, step)
    once = [[found.keep, -found.pull], [found.keep, 1.0 - found.pull]]
    return float(np.abs(np.angle(np.linalg.eigvals(once))).max()) / step


def of_accuracy(seed: int, index: int) -> Record:
    """Return the largest frequency error of an engine's rotor, and what was asked."""
    random = np.random.default_rng([seed, index])
    inputs = {
        "blades": int(random.integers(12, 37)),
        "rotor.damping": _between(random, 1e-3, 0.1),
        "modes": int(random.integers(0, 9)) * 12,
    }
    asked = _between(random, 1e-5, 0.3)
    scene = apply_settings(BASE, inputs | {"accuracy": asked, "kind": "rigid"})
    model = resolve(scene).model
    step = resolve(scene).scene.solver.time_step
    rotor = model.rotor
    errors = [
        _turned(w, xi, step) / (w * np.sqrt(1.0 - xi**2)) - 1.0
        for w, xi in zip(rotor.omega, rotor.ratios, strict=True)
    ]
    held_back = bool(step >= 0.999 * SAFE * min(model.limits(0.0).values()))
    # eigenvalues of a step lose 1e-9 or so of a frequency
    found = max(errors) - 1e-9
    way = "the step is that of stability" if held_back else "as asked"
    return {"inputs": inputs, "rows": [{"way": way, "found": found, "stated": asked}]}


def moving_engine(seed: int, index: int) -> dict[str, Any]:
    """Return inputs of an engine whose motion presets are held against."""
    random = np.random.default_rng([seed, index])
    return _freedoms(random, (12e-3, 45e-3)) | {
        "blades": (13, 17, 22)[index % 3],
        "nodal_diameter": int(random.choice([1, 1, 2, 3])) if index % 3 < 2 else 1,
        "friction": float(random.uniform(0.02, 0.2)) * float(random.random() < 0.75),
        "gap": _between(random, 8e-5, 4e-4),
        "speed": float(random.uniform(40.0, 520.0)),
        "pulse": _between(random, 5e-4, 1e-3),
        "rotor.damping": _between(random, 3e-3, 0.03),
        "casing.damping": _between(random, 0.02, 0.3),
    }


def of_presets(seed: int, index: int, rotation: str = "none") -> Record:
    """Return words and errors of presets, and of a twin, against a finer run."""
    inputs = moving_engine(seed, index)
    if rotation != "none":
        own = "rotor.suspension_damping"
        least = inputs["rotor.damping"] if inputs[own] > 0.0 else -1.0
        inputs |= {"rotation": rotation, own: max(inputs[own], least)}
    scene = apply_settings(BASE, inputs | {"duration": 1.0})
    asked = {n: apply_settings(scene, preset_inputs(n)) for n in preset_names()}
    last = resolve(asked["reference"]).scene
    finer = apply_settings(last, {
        "scheme": "exact", "accuracy": 0.0, "truncation": 0.0,
        "modes": FAMILIES * scene.engine.rotor.blades, "casing.families": "all",
        "casing.harmonics": max(FINEST, last.engine.casing.harmonics),
    })  # fmt: skip
    middle = asked["standard"]
    twin = apply_settings(middle, {"force": middle.force * (1.0 + TWIN)})
    rows = {n: simulate(s).row for n, s in {**asked, "finer": finer}.items()}
    other = simulate(twin).row
    errors = {n: _errors(rows[n], rows["finer"], scene.gap) for n in asked}
    errors["twins"] = _errors(other, rows["standard"], scene.gap)
    words = {n: _words(row) for n, row in rows.items()}
    # a twin's word is told against its own: it is the finer run's where that is so
    same = _words(other) == words["standard"]
    words["twins"] = words["finer"] if same else _words(other)
    return {"inputs": inputs, "words": words, "errors": errors}


QUICK = "closing gap", "oval that rises", "release", "three points a tip"
LATE = (  # a step of the first four takes tens of times as long
    "squeeze film", "plastic layer", "Archard's layer", "run-up or run-down",
    *QUICK, *QUICK, *QUICK, *QUICK,
)  # fmt: skip
SOON = 0.1, 0.02  # s; of what `general` integrates beside rotation, or has a layer


def of_late_features(seed: int, index: int) -> Record:
    """Return words and errors of presets on small engines with a feature of `LATE`.

    The finer run has a third of the step of `reference` and all that truncation leaves
    out; it is by the same scheme, since most of these features refuse `exact`.
    """
    kind = LATE[index % len(LATE)]
    row = drawn(seed, list(KINDS).index(kind) + len(KINDS) * index)
    with tempfile.TemporaryDirectory() as folder:
        scene = scene_of(row, Path(folder))
        runs_up = scene.acceleration != 0.0 and scene.engine.rotation == "full"
        scene = apply_settings(scene, {"duration": SOON[kind in SLOW or runs_up]})
        asked = {n: apply_settings(scene, preset_inputs(n)) for n in preset_names()}
        last = resolve(asked["reference"]).scene
        step = resolve(asked["reference"]).scene.solver.time_step / 3.0
        whole = {"modes": FAMILIES * scene.engine.rotor.blades}
        harmonics = max(40, last.engine.casing.harmonics)
        if scene.engine.casing.discretization == "fourier" and not scene.engine.file:
            whole |= {"casing.families": "all", "casing.harmonics": harmonics}
        own = {"accuracy": 0.0, "truncation": 0.0, "time_step": step}
        finer = apply_settings(last, whole | own)
        force = finer.force * (1.0 + TWIN)
        twin = apply_settings(finer, {"force": force})
        ways = {**asked, "finer": finer, "other": twin}
        rows = {n: simulate(each).row for n, each in ways.items()}
    words = {n: _words(one) for n, one in rows.items()}
    words["twins"] = words.pop("other")
    errors = {n: _errors(rows[n], rows["finer"], scene.gap) for n in asked}
    errors["twins"] = _errors(rows["other"], rows["finer"], scene.gap)
    inputs = row["inputs"] | {"rotor.damping": scene.engine.rotor.damping}
    contacts = rows["finer"]["contacts"]
    return {"inputs": inputs, "kind": kind, "words": words, "errors": errors,
            "contacts": contacts}  # fmt: skip


def turning_engine(seed: int, index: int) -> dict[str, Any]:
    """Return inputs of an engine at a speed where rotation may or may not matter.

    The centre of every fourth one is free, that of the others clamped.
    """
    random, free = np.random.default_rng([seed, index]), index % 4 == 0
    lobes = int(random.choice([1, 2, 3] if free else [0, 1, 2, 3]))
    inputs = _freedoms(random, (12e-3, 40e-3)) | {
        "blades": int(random.choice([16, 22])),
        "nodal_diameter": lobes,
        "friction": float(random.uniform(0.05, 0.3)),
        "gap": _between(random, *((8e-5, 3e-4) if lobes else (1e-5, 5e-5))),
        "force": _between(random, *((3e5, 2e6), (2e4, 1e5), (1e5, 6e5))[min(lobes, 2)]),
        "speed": _between(random, 3.0, 520.0),
        "pulse": _between(random, 5e-4, 1e-3),
        "rotor.damping": _between(random, 2e-3, 0.02),
        "casing.damping": _between(random, 0.01, 0.1),
        "rotor.suspension_damping": 0.03 if free else -1.0,
    }
    return inputs | {"centre": "free" if free else "clamped"}


def of_rotation(seed: int, index: int, chosen: str = "none") -> Record:
    """Return words without and with the terms of rotation, and what they change.

    Beside them those without the terms in the basis for all speeds, which those with
    them have, and with the terms of two twins: with another force, and with blades
    whose frequencies are higher by the share that the terms change. Where the terms are
    left out, `spread` has the words of further twins in force, see `_spread`. Engines
    of which `auto` chooses another rotation than `chosen` are left out.
    """
    inputs = turning_engine(seed, index)
    fine = {"modes": FAMILIES * inputs["blades"]}  # or the bases alone change words
    scene = apply_settings(BASE, inputs | WORDED | fine)
    if choice_of(scene).rotation != chosen:
        return {"inputs": inputs, "left_out": f"rotation is not {chosen}"}
    full, share = apply_settings(scene, {"rotation": "full"}), change_of(scene).share
    force, young = full.force, full.engine.rotor.young
    ways = {
        "none": scene,
        "full": full,
        "twins": apply_settings(full, {"force": force * (1.0 + TWIN)}),
        "detuned": apply_settings(full, {"rotor.young": young * (1.0 + share) ** 2}),
    }
    rows = {name: simulate(one).row for name, one in ways.items()}
    if not rows["full"]["contacts"]:
        return {"inputs": inputs, "left_out": "no contact"}
    rows["terms"] = Course(_without_terms(scene, full)).run().row
    return {
        "inputs": inputs,
        "words": {name: _words(row) for name, row in rows.items()},
        "contacts": rows["full"]["contacts"],
        "chosen": chosen,
        "change": share,
        "spread": _spread(scene, full) if chosen == "none" else {},
    }


def _without_terms(none: Scene, full: Scene) -> Case:
    """Return the case of a scene in the basis that it has with the terms."""
    model = resolve(full).model
    return Case(none, replace(model, rotor=replace(model.rotor, spin=None)))


def _spread(none: Scene, full: Scene) -> dict[str, list[str]]:
    """Return the words of twins in force, without the terms and with them: FEW of each.

    Where either are not all the same, the word is chance: MANY of each.
    """
    ways = {"none": none, "full": full}
    found = {name: _twins(scene, FEW) for name, scene in ways.items()}
    if all(len(set(words)) == 1 for words in found.values()):
        return found
    return {name: _twins(scene, MANY) for name, scene in ways.items()}


def _twins(scene: Scene, count: int) -> list[str]:
    """Return the words of a scene and of twins on both sides of its force."""
    places = [(i + 1) // 2 * (-1) ** i for i in range(count)]
    forces = [scene.force * (1.0 + place * APART) for place in places]
    return [_words(simulate(apply_settings(scene, {"force": f})).row) for f in forces]


def _words(row: dict[str, Any]) -> str:
    return f"{row['outcome']} {row['regime']} {row['whirl']}"


def _errors(row: Any, true: Any, gap: float) -> dict[str, float]:
    """Return relative errors of `NUMBERS`; a radius' at least of `LEAST` of the gap."""
    least = {"orbit_radius": LEAST * gap, "contact_impulse": 1e-300}
    return {
        n: float(abs(row[n] - true[n]) / max(abs(true[n]), least[n])) for n in NUMBERS
    }


MEASURES: dict[str, Callable[[int, int], Record]] = {
    "truncation": of_truncation,
    "accuracy": of_accuracy,
    "presets": of_presets,
    "rotation": of_rotation,
    "kept": partial(of_rotation, chosen="full"),
    "presets_full": partial(of_presets, rotation="full"),
    "presets_late": of_late_features,
}
