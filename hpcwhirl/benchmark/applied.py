"""Write a setting of the solver to a campaign's file, whose comments are kept."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.exceptions import TOMLKitError

from hpcwhirl.benchmark.tradeoff import Row
from hpcwhirl.benchmark.trials import PRESET
from hpcwhirl.campaign.plan.design import design_of
from hpcwhirl.errors import InputError, unreadable
from hpcwhirl.scene import preset_inputs
from hpcwhirl.scene.input_names import full_name
from hpcwhirl.store.atomic import write_whole


def write_setting(path: Path, row: Row, measured: Mapping[str, Any]) -> None:
    """Write the options of a setting as inputs to a campaign's file.

    The file is checked before it is replaced.

    Parameters
    ----------
    path : the file
    row : the setting
    measured : the parsed TOML of the file when its cases were drawn

    Raises
    ------
    InputError
        if the file has other contents than `measured`, or would not be a campaign's
        with the inputs
    MissingFileError
        if the file cannot be read or written
    """
    try:
        document = tomlkit.parse(path.read_text("utf-8"))
    except OSError as failed:
        raise unreadable(path, failed) from failed
    except TOMLKitError as failed:
        raise InputError(f"{path}: {failed}") from failed
    if document.unwrap() != measured:
        msg = f"{path} has changed since its cases were drawn, so nothing was written: "
        raise InputError(msg + f"run again, or type {row.options}")
    name = row.options.removeprefix(f"--{PRESET} ")
    if name != row.options:
        _write_preset(document, name)
    else:
        for key, value in row.inputs.items():
            _table(document, full_name(key))[key.rpartition(".")[2]] = value
    design_of(document.unwrap(), {}, path.parent)
    write_whole(path, tomlkit.dumps(document).encode())


def _write_preset(document: Any, name: str) -> None:
    """Name a preset in [solver], and take out the inputs that would override it."""
    for key in preset_inputs(name):
        _table(document, key).pop(key.rpartition(".")[2], None)
    _table(document, "solver.preset")[PRESET] = name


def _table(document: Any, name: str) -> Any:
    """Return the table of an input, by its dotted name; it is made where missing."""
    table = document
    for part in name.split(".")[:-1]:
        if part not in table:
            table[part] = tomlkit.table()
        table = table[part]
    return table
