"""Conversion of nested dicts and settings to scenes, and of scenes to dicts and TOML.

An invalid scene raises InputError with one line, made from pydantic's error.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import tomli_w
from pydantic import ValidationError

from hpcwhirl.errors import InputError, shown, unknown
from hpcwhirl.scene.history import history_of, parsed
from hpcwhirl.scene.input_names import (
    OTHERWISE,
    PRESET,
    Value,
    full_name,
    input_names,
    stands_for,
)
from hpcwhirl.scene.inputs import Scene
from hpcwhirl.scene.table_model import WRONG_UNIT

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
    """Return the validated scene of nested dicts, one for each table of inputs.

    Raises
    ------
    InputError
        in one line, on the first invalid input
    """
    try:
        return Scene.model_validate(dict(data))
    except ValidationError as failed:
        raise told_by(failed) from None


def flatten(scene: Scene) -> dict[str, Value]:
    """Return {full dotted name: value in SI} of every input of a scene."""

    def walk(data: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, Value]]:
        for name, value in data.items():
            if isinstance(value, dict):
                yield from walk(value, f"{prefix}{name}.")
            else:
                plain = list(value) if isinstance(value, tuple) else value
                yield f"{prefix}{name}", plain

    return dict(walk(scene.model_dump(), ""))


def apply_settings(scene: Scene, settings: Mapping[str, Value]) -> Scene:
    """Return a scene with some inputs replaced, validated again.

    Its tables without a replaced input are the same objects as in the given scene.

    Parameters
    ----------
    scene : the scene to start from
    settings : {input: new value}; a name may be an unambiguous ending: ``time_step``
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


def with_reals(scene: Scene, settings: Mapping[str, Any]) -> Scene:
    """Return a scene with some inputs replaced that need no validation.

    The inputs are real numbers that have been checked, as those of a plan's cases have.

    settings : {full dotted name: new value}
    """
    own = {n: float(v) + 0.0 for n, v in settings.items() if "." not in n}
    inside: dict[str, dict[str, Any]] = {}
    for name, value in settings.items():
        table, _, leaf = name.partition(".")
        if leaf:
            inside.setdefault(table, {})[leaf] = value
    tables = {n: with_reals(getattr(scene, n), v) for n, v in inside.items()}
    return scene.model_copy(update={**own, **tables})


def check_kept(settings: Mapping[str, Any]) -> None:
    """Refuse a setting that another one overrides, as accuracy does time_step (`SETS`).

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
            raise InputError(
                f"--set {lost[0]} has no effect: {cause} = {shown(value)} sets it; add "
                f"--set {cause.rpartition('.')[2]}=0"
            )


def to_toml(scene: Scene) -> str:
    """Return the whole scene as TOML that `load_scene` reads back."""
    data = scene.model_dump()
    tables = {name: data.pop(name) for name in SCENE_TABLES[1:]}
    return tomli_w.dumps({"scene": data, **tables})


def case_before(scene: Scene) -> Scene | None:
    """Return the preceding case on a branch; None if the given case begins at rest.

    The last state of the preceding case is the initial state of the given one.
    """
    over, values = parsed(scene.history)
    if not values:
        return None
    return apply_settings(
        scene, {over: values[-1], "history": history_of(over, values[:-1])}
    )


def _allowed(error: Mapping[str, Any]) -> str:
    context = error.get("ctx", {})
    words = {
        "greater_than": "must be > {gt}",
        "greater_than_equal": "must be >= {ge}",
        "less_than_equal": "must be <= {le}",
        "finite_number": "must be a finite number",
        "int_type": "must be a whole number",
        "float_type": "must be a number",
        "string_type": "must be a string",
        "string_too_long": "must have at most {max_length} characters",
        "model_type": "must be a table",
        "tuple_type": "must be a list of numbers",
        "literal_error": "must be one of {expected}",
        "value_error": "{error}",
    }
    pattern = words.get(error["type"])
    return pattern.format(**context) if pattern else str(error["msg"])


def _unknown_key(table: str, word: str) -> InputError:
    """Return the error for an unknown key, with its right table or a similar key.

    table, word : dotted name of the table in which the key was written; the key
    """
    what, names = f"key in [{table or 'scene'}]", input_names()
    names = {**names, f"solver.{PRESET}": ""}
    homes = [n.rpartition(".")[0] for n in names if n.rpartition(".")[2] == word]
    if homes:
        right = " or ".join(f"[{home or 'scene'}]" for home in homes)
        return InputError(f"unknown {what} '{word}'; it belongs in {right}")
    dotted = f"{table}.{word}".removeprefix(".")
    places = sorted({p for n in names for p in _tables(n) if p.endswith(f".{word}")})
    if places and dotted not in places:
        return InputError(f"unknown {what} '{word}'; it is the table [{places[0]}]")
    if word.lower() in OTHERWISE:
        return InputError(f"unknown {what} '{word}': {OTHERWISE[word.lower()]}")
    if hint := stands_for(word):
        return InputError(f"unknown {what} '{word}'{hint}")
    inside = [n.removeprefix(f"{table}.") for n in names if n.startswith(table)]
    return unknown(what, word, [n for n in inside if "." not in n])


def _tables(name: str) -> list[str]:
    """Return the dotted names of the nested tables that contain an input.

    name : the input's full dotted name
    """
    parts = name.split(".")[:-1]
    return [".".join(parts[: i + 1]) for i in range(len(parts))]


def _one_line(error: Mapping[str, Any]) -> InputError:
    location = ".".join(str(part) for part in error["loc"])
    if error["type"] == "extra_forbidden":
        return _unknown_key(*location.rpartition(".")[::2])
    if error["type"] == "value_error":
        return InputError(f"{location or 'scene'}: {_allowed(error)}")
    if error["type"] == WRONG_UNIT:
        return InputError(f"{location}.{error['msg']}".removeprefix("."))
    unit = input_names().get(location, "")
    note = f" ({unit})" if unit else ""
    return InputError(
        f"{location} {_allowed(error)}, got {shown(error['input'])}{note}"
    )


def told_by(failed: ValidationError) -> InputError:
    """Return pydantic's error about a scene as an InputError of one line."""
    return _one_line(failed.errors()[0])
