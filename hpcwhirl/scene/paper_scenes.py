"""Named scenes: the paper's Tables 1 and 2, and Table 2 with each named engine."""

from __future__ import annotations

from functools import partial

from hpcwhirl.errors import unknown
from hpcwhirl.scene.engines import engine_inputs, engine_names
from hpcwhirl.scene.files import apply_settings
from hpcwhirl.scene.inputs import Scene


def table1() -> Scene:
    """Return Table 1 at 410 rad/s: gap 1 mm, mu 0.2, 20 revolutions."""
    return Scene(speed=410.0, gap=1e-3, friction=0.2, revolutions=20.0)


def table2() -> Scene:
    """Return Table 2 at 410 rad/s: gap 0.128 mm, mu 0.1, 2.5 s."""
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
