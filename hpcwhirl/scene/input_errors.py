"""Errors of pydantic about a scene, as one line each."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError

from hpcwhirl.errors import InputError, shown, unknown
from hpcwhirl.scene.input_names import PRESET, input_names
from hpcwhirl.scene.input_types import WRONG_UNIT
from hpcwhirl.scene.otherwise import OTHERWISE


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
    """Return the error for an unknown key, with its right table or the nearest key."""
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
    inside = [n.removeprefix(f"{table}.") for n in names if n.startswith(table)]
    return unknown(what, word, [n for n in inside if "." not in n])


def _tables(name: str) -> list[str]:
    """Return the dotted names of the nested tables that contain an input."""
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
