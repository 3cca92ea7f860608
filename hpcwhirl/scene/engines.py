"""Engines by name: what the paper does not give, chosen to do different things."""

from __future__ import annotations

import tomllib
from functools import cache
from importlib import resources
from typing import Any

from hpcwhirl.errors import unknown
from hpcwhirl.scene.files import Value, full_name


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
        where there is none of this name
    """
    if name not in _table():
        raise unknown("engine", name, engine_names())
    given = _table()[name]["inputs"]
    inputs = {full_name(n): value for n, value in given.items()}
    return {"engine.name": name, **inputs}


def engine_shows(name: str) -> str:
    """Return what a named engine shows on the paper's Table 2, as measured."""
    return str(_table()[name]["shows"])
