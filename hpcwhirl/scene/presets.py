"""Presets: named solver inputs, chosen by measurement, and their measured errors."""

from __future__ import annotations

import tomllib
from functools import cache
from importlib import resources
from typing import Any

from hpcwhirl.errors import unknown
from hpcwhirl.scene.input_names import Value, full_name
from hpcwhirl.scene.inputs import Scene
from hpcwhirl.scene.plain_data import flatten

ELSEWHERE = "its errors on other engines were not measured"


@cache
def _table() -> dict[str, dict[str, Any]]:
    text = resources.files("hpcwhirl.scene").joinpath("presets.toml").read_text("utf-8")
    return tomllib.loads(text)


def preset_names() -> tuple[str, ...]:
    """Return the names of all presets, the fastest first."""
    return tuple(_table())


def preset_inputs(name: str) -> dict[str, Value]:
    """Return {dotted name: value} that a preset sets.

    Raises
    ------
    InputError
        for an unknown preset
    """
    if name not in _table():
        raise unknown("preset", name, preset_names())
    return {full_name(n): value for n, value in _table()[name]["inputs"].items()}


def preset_loss(name: str) -> str:
    """Return a text with the measured errors of a preset.

    Errors on random engines come first, then cost and errors on the engines of the
    trade-off, then those of maps.
    """
    texts = {"engines": ELSEWHERE, **_table()[name]}
    parts = (str(texts[key]) for key in ("engines", "loses", "regimes") if key in texts)
    return "; ".join(parts)


def preset_bounds(name: str) -> dict[str, float]:
    """Return {quantity: relative error that 90 % of random engines do not exceed}."""
    return dict(_table()[name].get("nine_in_ten", {}))


def preset_in_short(name: str) -> str:
    """Return a text with the cost of a preset and the first of its measured errors."""
    texts = _table()[name]
    cost, *losses = str(texts["loses"]).split("; ")
    first = str(texts.get("engines") or texts.get("regimes") or losses[0])
    return f"{cost}; {first.partition('; ')[0]}"


def loss_of(scene: Scene) -> str:
    """Return the errors of a scene's preset, or a note that they were not measured."""
    if scene.engine.file:
        return "not measured on rotors from file"
    equal = scene.has_harmonics and not scene.engine.rotor.is_uneven
    if not equal or scene.engine.casing.kind == "rigid":
        return "not measured: presets were tried on equal blades in a ring of harmonics"
    return preset_loss(preset_of(scene))


def preset_of(scene: Scene) -> str:
    """Return the name of the preset whose inputs the scene has; "" for none."""
    inputs = flatten(scene)
    for name in preset_names():
        if all(inputs[n] == value for n, value in preset_inputs(name).items()):
            return name
    return ""
