"""Named engines: values for inputs that the paper leaves open, chosen to differ."""

from __future__ import annotations

import tomllib
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from hpcwhirl.errors import InputError, unknown
from hpcwhirl.scene.files import Value, flatten, full_name
from hpcwhirl.scene.inputs import Scene

FORMER = {"salvat2016": "mostly_damped"}  # names of earlier versions


@cache
def _table() -> dict[str, dict[str, Any]]:
    text = resources.files("hpcwhirl.scene").joinpath("engines.toml").read_text("utf-8")
    return tomllib.loads(text)


def engine_names() -> tuple[str, ...]:
    """Return the names of all engines."""
    return tuple(_table())


def engine_inputs(name: str) -> dict[str, Value]:
    """Return {dotted name: value} of a named engine: its name, casing, dampings, pulse.

    Raises
    ------
    InputError
        for an unknown engine
    """
    if name not in _table():
        raise unknown("engine", name, engine_names())
    given = _table()[name]["inputs"]
    inputs = {full_name(n): value for n, value in given.items()}
    return {"engine.name": name, **inputs}


def engine_shows(name: str) -> str:
    """Return a text on the measured motions of a named engine in Table 2's scene."""
    return str(_table()[name]["shows"])


def title_of(name: str, file: str) -> str:
    """Return the title of an engine: its name, or that of its file if it has none.

    Parameters
    ----------
    name, file : `name` and `file` of [engine]
    """
    return Path(file).stem if file and name == Scene().engine.name else name


def check_label(scene: Scene) -> None:
    """Refuse the name of a built-in engine on a scene with the default's inputs.

    A name is a label and sets no inputs, so such a scene would be mistaken for that
    engine.

    Raises
    ------
    InputError
        with the file and the command that show the engine's inputs
    """
    label, usual = scene.engine.name, Scene()
    name = FORMER.get(label, label)
    if label == usual.engine.name or scene.engine.file or name not in engine_names():
        return
    values, default = flatten(scene), flatten(usual)
    inputs = engine_inputs(name).keys() - {"engine.name"}
    if all(values[n] == default[n] for n in inputs):
        msg = f"engine.name = '{label}' is a label and sets no inputs: those of "
        msg += f"'{name}' must stand in the file, as in jobs/{name}.toml; "
        raise InputError(msg + "hpcwhirl inputs engines tells them")
