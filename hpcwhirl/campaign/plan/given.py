"""A design from what Python has: a file's path, tables, a scene, numpy's numbers."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hpcwhirl.campaign.plan.design import Design, design_of, load_design
from hpcwhirl.errors import InputError, shown
from hpcwhirl.scene import Scene, apply_settings

ALLOWED = "a Design, a TOML file, a mapping of its tables, or a Scene"


def design_given(source: Any, settings: Mapping[str, Any] | None) -> Design:
    """Return the design of what was given, see `Design.of`."""
    found = plain(settings or {})
    if isinstance(source, Design):
        if found:
            msg = f"a Design takes no settings: it is made, got {shown(found)}"
            raise InputError(msg)
        return source
    if isinstance(source, Scene):
        scene = apply_settings(source, found)
        return Design.one(scene)
    if source is None or isinstance(source, Path | str):
        return load_design(Path(source) if source is not None else None, found)
    if isinstance(source, Mapping):
        return design_of(plain(source), found)
    msg = f"design must be {ALLOWED}, got {shown(source)}"
    raise InputError(msg)


def plain(value: Any) -> Any:
    """Return a value as TOML would have given it: no arrays, no numpy numbers."""
    if isinstance(value, Mapping):
        return {str(name): plain(one) for name, one in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, list | tuple | range):
        return [plain(one) for one in value]
    return str(value) if isinstance(value, Path) else value
