"""Settings of the solver that `hpcwhirl tradeoff` tries, and the reference.

They are in trials.toml. A setting changes one property of the solver, its axis, such as
the scheme or the time step.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from typing import Any

from hpcwhirl.case.resolve import resolve
from hpcwhirl.errors import InputError, unknown
from hpcwhirl.scene import (
    Scene,
    apply_settings,
    flatten,
    preset_inputs,
    preset_names,
)
from hpcwhirl.scene.input_names import Value, full_name
from hpcwhirl.scene.quantities import WHOLE
from hpcwhirl.structure.bladed_disk import MOST_DOF

Settings = dict[str, Value]
A_BLADE = "modes_a_blade"  # key of a setting: fixed-interface modes / N
BOTH = "together"  # axis of settings that change accuracy and truncation
FINER = 0.25  # longest step of the reference / that of a scene
PRESET = "preset"  # axis of the presets
# inputs that are chosen by `truncation` unless it is 0
CHOSEN = {A_BLADE, "modes", "casing.harmonics", "casing.families"}
OF_BEAMS = {A_BLADE, "modes", "rotor.elements"}  # without effect on a rotor from file


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

    @property
    def key(self) -> str:
        """A text that no other setting has."""
        return f"{self.axis}: {self.label}"

    @property
    def options(self) -> str:
        """The options of a command that make the setting; "" if it has none.

        It has none as given, and where an input depends on the number of blades.
        """
        if self.axis == PRESET:
            return f"--preset {self.label.removeprefix(PRESET).strip()}"
        if A_BLADE in self.inputs:
            return ""
        return " ".join(f"--set {name}={value}" for name, value in self.sets.items())

    @property
    def sets(self) -> Settings:
        """The inputs, and the zeros without which they would be overridden."""
        return _with_free(self.inputs)


def _with_free(inputs: Settings) -> Settings:
    """Return a setting's inputs and the zeros without which they would be overridden.

    A given time step needs `accuracy` 0, given modes need `truncation` 0.
    """
    free: Settings = {}
    if "time_step" in inputs:
        free["accuracy"] = 0.0
    if inputs.keys() & CHOSEN:
        free["truncation"] = 0.0
    return inputs | free


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

    Raises
    ------
    InputError
        if an input changes nothing of a rotor from file
    """
    fixed = sorted(inputs.keys() & OF_BEAMS) if scene.engine.file else []
    if fixed:
        msg = f"{fixed[0]} has no effect on a rotor from file: truncation reduces it"
        raise InputError(msg)
    settings: dict[str, Any] = {"until": "end", **_with_free(inputs)}
    if A_BLADE in settings:
        settings["modes"] = settings.pop(A_BLADE) * scene.engine.rotor.blades
    return apply_settings(scene, settings)


def pinned(scene: Scene, factor: float = 1.0) -> Scene:
    """Return a scene with its modes, terms of rotation and time step as numbers.

    So two scenes that lead to the same computation are equal.

    factor : by which the time step is multiplied
    """
    case = resolve(scene)
    return case.pinned(factor * case.step)


def reference_of(scene: Scene) -> Scene:
    """Return a scene with the accurate settings of the reference.

    Where rotation is "auto", the reference has all its terms.
    """
    if scene.engine.rotation == "auto":
        scene = apply_settings(scene, {"rotation": "full"})
    scene = pinned(scene)  # modes and step are chosen by error bounds
    table, engine, solver = trials()["reference"], scene.engine, scene.solver
    modes = table[A_BLADE] * engine.rotor.blades
    most = MOST_DOF // (3 * engine.rotor.blades) - 1
    chosen: Settings = {
        "scheme": table["scheme"],
        "time_step": min(table["time_step"], FINER * solver.time_step),
        "modes": max(modes, solver.modes),
        "casing.harmonics": max(table["harmonics"], engine.casing.harmonics),
        "casing.families": "all",
        "rotor.elements": max(min(table["elements"], most), engine.rotor.elements),
        "truncation": 0.0,
        "until": "end",
    }
    return apply_settings(scene, chosen)


def coarser_than(reference: Scene) -> Scene:
    """Return the reference with a longer step, and fewer modes, waves and elements.

    By how much both differ, the reference does not know a number.
    """
    fine: Mapping[str, Any] = flatten(reference)
    coarse: Settings = {}
    for name, factor in trials()["coarser"].items():
        value = fine[full_name(name)] * factor
        coarse[name] = math.ceil(value) if full_name(name) in WHOLE else value
    return apply_settings(reference, coarse)


def axes() -> tuple[str, ...]:
    """Return the names of what settings vary, such as the time step.

    Those that take long to compare are last.
    """
    table = trials()
    return (*table["axes"], PRESET, BOTH, *table["slow"])


def settings_of(names: Sequence[str] = ()) -> list[Setting]:
    """Return the settings that vary the named axes, after "as given".

    names : names from `axes`; none: all but those that take long to compare

    Raises
    ------
    InputError
        for a name that is no axis
    """
    chosen = names or (*trials()["axes"], PRESET, BOTH)
    out = [Setting("as given", "as given", {})]
    for name in chosen:
        if name not in axes():
            raise unknown("axis", name, axes())
        out += _settings(name)
    return out


def _settings(axis: str) -> list[Setting]:
    if axis == PRESET:
        return [Setting(axis, f"{PRESET} {name}", _short(preset_inputs(name)))
                for name in preset_names()]  # fmt: skip
    table = trials()
    if axis == BOTH:
        inputs = table[BOTH]["inputs"]
        rows = [dict(zip(inputs, row, strict=True)) for row in table[BOTH]["values"]]
    else:
        single = (table["axes"] | table["slow"])[axis]
        rows = [{n: v} for n, values in single.items() for v in values]
    return [Setting(axis, _label(row), row) for row in rows]


def _short(inputs: Mapping[str, Value]) -> Settings:
    return {name.removeprefix("solver."): value for name, value in inputs.items()}


def _label(inputs: Mapping[str, Value]) -> str:
    short = {name.rsplit(".", 1)[-1]: value for name, value in inputs.items()}
    return ", ".join(
        f"{n} {v:g}" if isinstance(v, float) else f"{n} {v}" for n, v in short.items()
    )
