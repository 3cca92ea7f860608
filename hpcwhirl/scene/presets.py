"""Presets: solver inputs chosen from measured trade-offs, and what they lose."""

from __future__ import annotations

import tomllib
from functools import cache
from importlib import resources
from typing import Any

from hpcwhirl.errors import unknown
from hpcwhirl.scene.files import Value, flatten, full_name
from hpcwhirl.scene.inputs import Scene

ELSEWHERE = "what it loses on other engines is not measured"


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
        where there is none of this name
    """
    if name not in _table():
        raise unknown("preset", name, preset_names())
    return {full_name(n): value for n, value in _table()[name]["inputs"].items()}


def preset_loss(name: str) -> str:
    """Return what a preset costs and loses, as measured, in one sentence.

    On engines at random first, then on those of the trade-off and on maps.
    """
    found = {"engines": ELSEWHERE, **_table()[name]}
    told = (str(found[key]) for key in ("engines", "loses", "regimes") if key in found)
    return "; ".join(told)


def preset_bounds(name: str) -> dict[str, float]:
    """Return {number: relative error that nine engines in ten stay below}."""
    return dict(_table()[name].get("nine_in_ten", {}))


def preset_in_short(name: str) -> str:
    """Return what a preset costs, and the first thing that it loses."""
    found = _table()[name]
    cost, *losses = str(found["loses"]).split("; ")
    first = str(found.get("engines") or found.get("regimes") or losses[0])
    return f"{cost}; {first.partition('; ')[0]}"


def loss_of(scene: Scene) -> str:
    """Return what the preset of a scene loses, or that nobody has measured it there."""
    if scene.engine.file:
        return "not measured on rotors from file"
    equal = scene.has_harmonics and not scene.engine.rotor.mistuning
    if not equal or scene.engine.casing.kind == "rigid":
        return "not measured but for equal blades in a ring of harmonics: this is other"
    return preset_loss(preset_of(scene))


def preset_of(scene: Scene) -> str:
    """Return the preset whose inputs all are those of a scene, "" for none."""
    inputs = flatten(scene)
    for name in preset_names():
        if all(inputs[n] == value for n, value in preset_inputs(name).items()):
            return name
    return ""
