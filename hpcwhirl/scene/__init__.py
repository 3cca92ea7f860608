"""Inputs of cases and campaigns as frozen data in SI units, their TOML, and tables.

The tables list the words that a case may get (such as "damped"), all quantities, the
schemes of time integration, the presets of solver inputs, and the built-in engines.
"""

from hpcwhirl.scene.case_digest import content_digest, digest
from hpcwhirl.scene.documents import (
    DESIGN_TABLES,
    load_document,
    load_scene,
    parse_setting,
    preset_in,
    scene_of_document,
)
from hpcwhirl.scene.engine_parts import Casing, Engine, Rotor
from hpcwhirl.scene.input_names import input_names
from hpcwhirl.scene.inputs import Output, Scene, Solver
from hpcwhirl.scene.named import (
    NAMED,
    engine_inputs,
    engine_names,
    engine_shows,
    loss_of,
    named_scene,
    preset_bounds,
    preset_in_short,
    preset_inputs,
    preset_loss,
    preset_names,
    preset_of,
    title_of,
)
from hpcwhirl.scene.plain_data import (
    apply_settings,
    case_before,
    check_kept,
    flatten,
    scene_from,
    to_toml,
)

__all__ = [
    "DESIGN_TABLES", "NAMED", "Casing", "Engine", "Output", "Rotor", "Scene", "Solver",
    "apply_settings", "case_before", "check_kept", "content_digest", "digest",
    "engine_inputs", "engine_names", "engine_shows", "flatten", "input_names",
    "load_document", "load_scene", "loss_of", "named_scene", "parse_setting",
    "preset_bounds", "preset_in", "preset_in_short", "preset_inputs", "preset_loss",
    "preset_names", "preset_of", "scene_from", "scene_of_document", "title_of",
    "to_toml",
]  # fmt: skip
