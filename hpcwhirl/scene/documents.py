"""Scenes from parsed TOML documents: tables, presets, paths of engine files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from hpcwhirl.errors import InputError, as_table, shown, unknown
from hpcwhirl.scene.campaign_tables import TABLES
from hpcwhirl.scene.input_names import FILE, PRESET, Value, full_name
from hpcwhirl.scene.input_types import anchored
from hpcwhirl.scene.inputs import Scene
from hpcwhirl.scene.named import check_label, preset_inputs, preset_names
from hpcwhirl.scene.plain_data import (
    SCENE_TABLES,
    apply_settings,
    check_kept,
    scene_from,
)
from hpcwhirl.scene.swept import KEYS
from hpcwhirl.scene.toml_text import load_document

DESIGN_TABLES = (*KEYS, *TABLES)  # only in campaign files


def preset_in(document: Mapping[str, Any]) -> dict[str, Value]:
    """Return {dotted name: value} of the preset named in a document's [solver].

    Empty if none is named.

    Raises
    ------
    InputError
        for an unknown preset
    """
    solver = document.get("solver")
    if not isinstance(solver, Mapping) or PRESET not in solver:
        return {}
    name = solver[PRESET]
    if not isinstance(name, str):
        allowed = ", ".join(preset_names())
        raise InputError(f"[solver] preset must be one of {allowed}, got {shown(name)}")
    return preset_inputs(name)


def scene_of_document(
    document: Mapping[str, Any],
    extra_tables: Sequence[str] = (),
    folder: Path | str = "",
    settings: Mapping[str, Value] | None = None,
) -> Scene:
    """Return the scene of a document with tables scene, engine, solver, output.

    A preset in [solver] overrides the other inputs of the document; settings override
    both.

    Parameters
    ----------
    document : parsed TOML
    extra_tables : further tables that the document may have
    folder : directory to which a relative `engine.file` refers; "": the working
        directory
    settings : {name: value} that override the document

    Raises
    ------
    InputError
        for a wrong table, name or value, or the name of an engine without its inputs
    """
    known = (*SCENE_TABLES, *extra_tables)
    for table, content in document.items():
        if table not in known:
            raise unknown("table", table, known)
        if table in SCENE_TABLES:
            as_table(f"[{table}]", content)
    data = dict(document.get("scene", {}))
    for table in SCENE_TABLES[1:]:
        if table in data:
            raise InputError(f"[scene] {table}: write it as the table [{table}]")
        if table in document:
            data[table] = document[table]
    if isinstance(data.get("engine"), Mapping):
        data["engine"] = _placed(data["engine"], folder)
    scene = _set(data, preset_in(document), settings or {})
    check_label(scene)
    return scene


def _set(
    data: dict[str, Any], preset: Mapping[str, Value], settings: Mapping[str, Value]
) -> Scene:
    """Return the scene of plain data, with a preset's and then settings' values."""
    if not preset:
        return apply_settings(scene_from(data), settings)
    solver = {name: value for name, value in data["solver"].items() if name != PRESET}
    merged = {**preset, **{full_name(name): value for name, value in settings.items()}}
    check_kept(merged)
    return apply_settings(scene_from({**data, "solver": solver}), merged)


def _placed(engine: Mapping[str, Any], folder: Path | str) -> dict[str, Any]:
    """Return [engine] with absolute paths of its file, bearing and profile."""
    placed = dict(engine)
    if isinstance(engine.get("file"), str):
        placed["file"] = _anchored(engine["file"], folder)
    for part, name in (("rotor", "bearing"), ("casing", "profile")):
        inner = engine.get(part)
        table = inner.get(name) if isinstance(inner, Mapping) else None
        if isinstance(inner, Mapping) and isinstance(table, str):
            kept = table if ";" in table else _anchored(table, folder)
            placed[part] = {**inner, name: kept}
    return placed


def _anchored(file: str, folder: Path | str) -> str:
    try:
        return anchored(file, folder)
    except ValueError as failed:
        raise InputError(f"{FILE}: {failed}") from None


def load_scene(path: Path | str) -> Scene:
    """Return the scene of a TOML file (tables scene, engine, solver, output)."""
    return scene_of_document(load_document(path), folder=Path(path).parent)
