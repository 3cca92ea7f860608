"""Conversion of plain data and settings to scenes, and of scenes to data and TOML."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import tomli_w
from pydantic import ValidationError

from hpcwhirl.errors import InputError, shown
from hpcwhirl.scene.history import history_of, parsed
from hpcwhirl.scene.input_errors import told_by
from hpcwhirl.scene.input_names import Value, full_name
from hpcwhirl.scene.inputs import Scene

SCENE_TABLES = ("scene", "engine", "solver", "output")
SETS = {  # {input: inputs whose values it overrides if it is not 0}
    "solver.accuracy": ("solver.time_step",),
    "solver.truncation": (
        "solver.modes",
        "engine.casing.harmonics",
        "engine.casing.families",
    ),
}


def scene_from(data: Mapping[str, Any]) -> Scene:
    """Return the validated scene of nested plain data.

    Raises
    ------
    InputError
        one line on the first input that is wrong
    """
    try:
        return Scene.model_validate(dict(data))
    except ValidationError as failed:
        raise told_by(failed) from None


def flatten(scene: Scene) -> dict[str, Value]:
    """Return {dotted name: value} of every input of the scene."""

    def walk(data: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, Value]]:
        for name, value in data.items():
            if isinstance(value, Mapping):
                yield from walk(value, f"{prefix}{name}.")
            else:
                plain = list(value) if isinstance(value, tuple) else value
                yield f"{prefix}{name}", plain

    return dict(walk(scene.model_dump(), ""))


def apply_settings(scene: Scene, settings: Mapping[str, Value]) -> Scene:
    """Return the scene with some inputs replaced, validated again.

    Tables without a replaced input are shared with the given scene, being frozen.

    Parameters
    ----------
    scene : the scene to start from
    settings : {name: value}; a name may be an unambiguous ending, e.g. ``time_step``
    """
    if not settings:
        return scene
    data: dict[str, Any] = dict(scene)
    for name, value in settings.items():
        *tables, leaf = full_name(name).split(".")
        place = data
        for table in tables:
            place[table] = dict(place[table])
            place = place[table]
        place[leaf] = value
    return scene_from(data)


def check_kept(settings: Mapping[str, Any]) -> None:
    """Refuse a setting without effect, which another one overrides, see `SETS`.

    Parameters
    ----------
    settings : {full dotted name: value} of options and of a preset

    Raises
    ------
    InputError
        naming the setting that would have no effect
    """
    for cause, effects in SETS.items():
        lost = [name for name in effects if name in settings]
        value = settings.get(cause)
        if lost and value and isinstance(value, int | float):  # else refused later
            msg = (
                f"--set {lost[0]}: {cause} = {shown(value)} sets it; add --set "
                f"{cause.rpartition('.')[2]}=0"
            )
            raise InputError(msg)


def to_toml(scene: Scene) -> str:
    """Return the whole scene as TOML that `load_scene` reads back."""
    data = scene.model_dump()
    tables = {name: data.pop(name) for name in SCENE_TABLES[1:]}
    return tomli_w.dumps({"scene": data, **tables})


def case_before(scene: Scene) -> Scene | None:
    """Return the case with whose last state a case begins; None without history."""
    over, values = parsed(scene.history)
    if not values:
        return None
    return apply_settings(
        scene, {over: values[-1], "history": history_of(over, values[:-1])}
    )
