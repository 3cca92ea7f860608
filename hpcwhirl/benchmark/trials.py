"""The scenes and solver settings that `hpcwhirl tradeoff` compares, from trials.toml.

A setting changes one property of the solver, its axis, such as the scheme or the time
step; the reference is a setting of high accuracy.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from typing import Any

from hpcwhirl.case.resolve import resolve
from hpcwhirl.errors import unknown
from hpcwhirl.scene import Scene, apply_settings
from hpcwhirl.scene.input_names import Value
from hpcwhirl.structure.bladed_disk import MOST_DOF

Settings = dict[str, Value]
A_BLADE = "modes_a_blade"  # key of a setting: fixed-interface modes / N


@dataclass(frozen=True)
class Setting:
    """A setting of the solver that `hpcwhirl tradeoff` tries.

    Attributes
    ----------
    axis, label : what the setting varies, such as the scheme; name of the setting
    inputs : {input: value} that it sets in a scene
    """

    axis: str
    label: str
    inputs: Settings


def trials() -> dict[str, Any]:
    """Return the table trials.toml: scenes, settings by axis, and the reference."""
    text = resources.files("hpcwhirl.benchmark").joinpath("trials.toml").read_text()
    return tomllib.loads(text)


def default_scenes(base: Scene) -> dict[str, Scene]:
    """Return the scenes on which settings are compared by default, {name: scene}.

    There is one for each kind of motion, and one near a boundary between two words.

    base : scene of which each one changes some inputs
    """
    table = trials()["scenes"]
    return {name: apply_settings(base, inputs) for name, inputs in table.items()}


def applied(scene: Scene, inputs: Settings) -> Scene:
    """Return a scene with the inputs of a setting.

    inputs : {input: value}; the key `modes_a_blade`, times N, sets the input `modes`
    """
    settings: dict[str, Any] = {"until": "end", **inputs}
    if "time_step" in inputs:  # otherwise the input accuracy would choose it
        settings["accuracy"] = 0.0
    if inputs.keys() & {A_BLADE, "modes", "casing.harmonics", "casing.families"}:
        settings["truncation"] = 0.0
    if A_BLADE in settings:
        settings["modes"] = settings.pop(A_BLADE) * scene.engine.rotor.blades
    return apply_settings(scene, settings)


def reference_of(scene: Scene) -> Scene:
    """Return a scene with the accurate settings of the reference, and full traces."""
    scene = resolve(scene).scene  # modes and step are chosen by error bounds
    table, engine, solver = trials()["reference"], scene.engine, scene.solver
    modes = table[A_BLADE] * engine.rotor.blades
    most = MOST_DOF // (3 * engine.rotor.blades) - 1
    chosen: Settings = {
        "scheme": table["scheme"],
        "time_step": min(table["time_step"], 0.25 * solver.time_step),
        "accuracy": 0.0,
        "truncation": 0.0,
        "modes": max(modes, solver.modes),
        "casing.harmonics": max(table["harmonics"], engine.casing.harmonics),
        "casing.families": "all",
        "rotor.elements": max(min(table["elements"], most), engine.rotor.elements),
        "until": "end",
        "traces": "full",
    }
    return apply_settings(scene, chosen)


def axes() -> tuple[str, ...]:
    """Return the names of what settings vary, such as the time step.

    Those that take long to compare are last.
    """
    table = trials()
    return (*table["axes"], "together", *table["slow"])


def settings_of(names: Sequence[str] = ()) -> list[Setting]:
    """Return the settings that vary the named axes.

    names : names from `axes`; none: all but those that take long to compare

    Raises
    ------
    InputError
        for a name that is no axis
    """
    table = trials()
    single = table["axes"] | table["slow"]
    chosen = names or (*table["axes"], "together")
    out = [Setting("as given", "as given", {})]
    for name in chosen:
        if name not in (*single, "together"):
            raise unknown("axis", name, axes())
        if name == "together":
            inputs = table["together"]["inputs"]
            rows = [
                dict(zip(inputs, row, strict=True)) for row in table[name]["values"]
            ]
        else:
            rows = [{n: v} for n, values in single[name].items() for v in values]
        out += [Setting(name, _label(row), row) for row in rows]
    return out


def _label(inputs: Mapping[str, Value]) -> str:
    short = {name.rsplit(".", 1)[-1]: value for name, value in inputs.items()}
    return ", ".join(
        f"{n} {v:g}" if isinstance(v, float) else f"{n} {v}" for n, v in short.items()
    )
