"""Names that stand for inputs: engines, scenes of the paper, and presets.

An engine sets the inputs that the paper leaves open; a preset sets solver inputs,
chosen by measurement, and has texts on its measured errors.
"""

from __future__ import annotations

import tomllib
from difflib import get_close_matches
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from hpcwhirl.errors import InputError, unknown
from hpcwhirl.scene.input_names import Value, full_name
from hpcwhirl.scene.inputs import Scene
from hpcwhirl.scene.plain_data import apply_settings, flatten

ALIKE = 0.85  # least similarity of two names for one to be a misspelling of the other
FORMER = {"salvat2016": "mostly_damped"}  # names of earlier versions
TOLD = "engines", "features", "loses", "regimes"  # texts of a preset, in their order
ELSEWHERE = "its errors on other engines were not measured"


@cache
def _table(kind: str) -> dict[str, dict[str, Any]]:
    """Return {name: its inputs and texts} of all built-in engines, or all presets.

    kind : "engine" or "preset", whose file engines.toml or presets.toml is read
    """
    file = resources.files("hpcwhirl.scene").joinpath(f"{kind}s.toml")
    return tomllib.loads(file.read_text("utf-8"))


def _inputs(kind: str, name: str) -> dict[str, Value]:
    """Return {full dotted input: value} that a built-in engine or a preset sets.

    kind : "engine" or "preset"
    """
    if name not in _table(kind):
        raise unknown(kind, name, _table(kind))
    return {full_name(n): v for n, v in _table(kind)[name]["inputs"].items()}


def engine_names() -> tuple[str, ...]:
    """Return the names of all built-in engines."""
    return tuple(_table("engine"))


def engine_inputs(name: str) -> dict[str, Value]:
    """Return {full dotted input: value} that a built-in engine sets.

    These are inputs of casing, damping and pulse, and the engine's name.

    Raises
    ------
    InputError
        for an unknown engine
    """
    return {"engine.name": name, **_inputs("engine", name)}


def engine_shows(name: str) -> str:
    """Return a text: at which speeds a built-in engine whirls in scene `table2`."""
    return str(_table("engine")[name]["shows"])


def title_of(name: str, file: str) -> str:
    """Return the name of an engine for results; without one, its file's name.

    Parameters
    ----------
    name, file : `name` and `file` of [engine]
    """
    return Path(file).stem if file and name == Scene().engine.name else name


def check_label(scene: Scene) -> None:
    """Refuse a scene with the name of a built-in engine but none of its inputs.

    A name is a label and sets no inputs, so such a scene would be mistaken for that
    engine. Similar names are refused, too.

    Raises
    ------
    InputError
        with the file and the command that show the engine's inputs
    """
    label, usual = scene.engine.name, Scene()
    near = get_close_matches(label, engine_names(), n=1, cutoff=ALIKE)  # a misspelling
    name = FORMER.get(label, (near or [label])[0])
    if name == usual.engine.name or scene.engine.file or name not in engine_names():
        return
    values, default = flatten(scene), flatten(usual)
    inputs = engine_inputs(name).keys() - {"engine.name"}
    if all(values[n] == default[n] for n in inputs):
        msg = f"engine.name = '{label}' is a label and sets no inputs: the inputs of "
        msg += f"'{name}' must be in the file, as in jobs/{name}.toml; "
        raise InputError(msg + "hpcwhirl inputs engines lists them")


# {named scene: its inputs}: tables of the paper, and the scene of Table 2 by engine
TABLE_2: dict[str, Value] = {
    "speed": 410.0, "gap": 1.28e-4, "friction": 0.1, "duration": 2.5
}  # fmt: skip
NAMED: dict[str, dict[str, Value]] = {
    "table1": {"speed": 410.0, "gap": 1e-3, "friction": 0.2, "revolutions": 20.0},
    "table2": TABLE_2,
    **{name: TABLE_2 | engine_inputs(name) for name in engine_names()},
}


def named_scene(name: str) -> Scene:
    """Return a scene of `NAMED`, such as "table2"; InputError for an unknown name."""
    if name not in NAMED:
        raise unknown("scene", name, NAMED)
    return apply_settings(Scene(), NAMED[name])


def preset_names() -> tuple[str, ...]:
    """Return the names of all presets, the fastest first."""
    return tuple(_table("preset"))


def preset_inputs(name: str) -> dict[str, Value]:
    """Return {full dotted input: value} of the solver inputs that a preset sets.

    Raises
    ------
    InputError
        for an unknown preset
    """
    return _inputs("preset", name)


def preset_loss(name: str) -> str:
    """Return a text with the measured errors of a preset.

    Errors on random engines come first, then how often they hold with features, then
    time and errors on the engines of the measured trade-off, then how many regimes on
    maps are right.
    """
    texts = {"engines": ELSEWHERE, **_table("preset")[name]}
    parts = (str(texts[key]) for key in TOLD if key in texts)
    return "; ".join(parts)


def preset_bounds(name: str) -> dict[str, float]:
    """Return {result: relative error} that 90 % of random engines keep with a preset.

    Results are such as `orbit_radius`; {} if not measured.
    """
    return dict(_table("preset")[name].get("nine_in_ten", {}))


def preset_in_short(name: str) -> str:
    """Return a text with the cost of a preset and the first of its measured errors."""
    texts = _table("preset")[name]
    cost, *losses = str(texts["loses"]).split("; ")
    first = str(texts.get("engines") or texts.get("regimes") or losses[0])
    return f"{cost}; {first.partition('; ')[0]}"


def loss_of(scene: Scene) -> str:
    """Return a text: the measured errors of a scene's preset, or why there are none."""
    if scene.engine.file:
        return "not measured on rotors from file"
    equal = scene.has_harmonics and not scene.engine.rotor.is_uneven
    if not equal or scene.engine.casing.kind == "rigid":
        return "not measured: presets were tried on equal blades in a ring of harmonics"
    return preset_loss(preset_of(scene))


def preset_of(scene: Scene) -> str:
    """Return the name of the preset whose solver inputs a scene has; "" for none."""
    inputs = flatten(scene)
    for name in preset_names():
        if all(inputs[n] == value for n, value in preset_inputs(name).items()):
            return name
    return ""
