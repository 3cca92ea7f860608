"""The tables of a campaign's file as a reader looks them up; see tables.toml."""

from __future__ import annotations

import tomllib
from functools import cache
from importlib import resources

from hpcwhirl.scene.catalogue import InputFact


@cache
def tables() -> dict[str, list[InputFact]]:
    """Return {table: its keys} of what a file has beside a scene's tables.

    `<input>` stands for the name of any input.
    """
    text = resources.files("hpcwhirl.campaign").joinpath("tables.toml").read_text()
    return {
        table: [
            InputFact(
                key,
                table,
                told.get("default"),
                "",
                told["meaning"],
                told["allowed"],
                "",
            )
            for key, told in keys.items()
        ]
        for table, keys in tomllib.loads(text).items()
    }
