"""Named engines and scenes: the tables of the paper, and inputs that it leaves open."""

from __future__ import annotations

import tomllib
from difflib import get_close_matches
from functools import cache, partial
from importlib import resources
from pathlib import Path
from typing import Any

from hpcwhirl.errors import InputError, unknown
from hpcwhirl.scene.input_names import Value, full_name
from hpcwhirl.scene.inputs import Scene
from hpcwhirl.scene.plain_data import apply_settings, flatten

ALIKE = 0.85  # least similarity of two names for one to be a misspelling of the other
FORMER = {"salvat2016": "mostly_damped"}  # names of earlier versions


@cache
def _table() -> dict[str, dict[str, Any]]:
    text = resources.files("hpcwhirl.scene").joinpath("engines.toml").read_text("utf-8")
    return tomllib.loads(text)


def engine_names() -> tuple[str, ...]:
    """Return the names of all engines."""
    return tuple(_table())


def engine_inputs(name: str) -> dict[str, Value]:
    """Return {dotted name: value} of a named engine: name, casing, damping, pulse.

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
    """Return a text that describes a named engine's motions in the scene of Table 2."""
    return str(_table()[name]["shows"])


def title_of(name: str, file: str) -> str:
    """Return the title of an engine: its name, or that of its file if it has none.

    Parameters
    ----------
    name, file : `name` and `file` of [engine]
    """
    return Path(file).stem if file and name == Scene().engine.name else name


def check_label(scene: Scene) -> None:
    """Refuse the name of a built-in engine, or a similar one, with default inputs.

    A name is a label and sets no inputs, so such a scene would be mistaken for that
    engine.

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
        msg = f"engine.name = '{label}' is a label and sets no inputs: those of "
        msg += f"'{name}' must be in the file, as in jobs/{name}.toml; "
        raise InputError(msg + "hpcwhirl inputs engines lists them")


def table1() -> Scene:
    """Return the scene of Table 1: 410 rad/s, gap 1 mm, mu 0.2, 20 revolutions."""
    return Scene(speed=410.0, gap=1e-3, friction=0.2, revolutions=20.0)


def table2() -> Scene:
    """Return the scene of Table 2: 410 rad/s, gap 0.128 mm, mu 0.1, 2.5 s."""
    return Scene(speed=410.0, gap=1.28e-4, friction=0.1, duration=2.5)


def table2_on(engine: str) -> Scene:
    """Return the scene of Table 2 with a named engine."""
    return apply_settings(table2(), engine_inputs(engine))


NAMED = {"table1": table1, "table2": table2} | {
    name: partial(table2_on, name) for name in engine_names()
}


def named_scene(name: str) -> Scene:
    """Return a named scene; raise InputError for an unknown name."""
    if name not in NAMED:
        raise unknown("scene", name, NAMED)
    return NAMED[name]()
