"""TOML that users write: files, and settings such as ``name=value``."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from hpcwhirl.errors import InputError, MissingFileError, one_line, shown
from hpcwhirl.safe_open import read_regular
from hpcwhirl.scene.input_names import Value, full_name, takes_list

WIDEST = 1000  # largest number of bits of a whole number, so that it fits a float
DEEPEST = 32  # deepest nesting of tables and lists


def parsed_toml(text: str) -> dict[str, Any]:
    """Parse a TOML text.

    Raises
    ------
    ValueError
        in one line, if it is no TOML, nested too deeply, or has too large a number
    """
    try:
        document = tomllib.loads(text)
        depth, inside = 0, [document]
        while inside:
            values = [v for one in inside for v in _members(one)]
            if any(isinstance(v, int) and v.bit_length() > WIDEST for v in values):
                raise ValueError  # noqa: TRY301 - as where Python gives up
            inside, depth = [v for v in values if _members(v)], depth + 1
            if depth > DEEPEST:
                raise RecursionError  # noqa: TRY301 - as where the parser gives up
    except RecursionError:
        msg = f"nested deeper than {DEEPEST} tables or lists"
        raise ValueError(msg) from None
    except tomllib.TOMLDecodeError:
        raise
    except ValueError:  # Python refuses to read such an integer
        msg = f"a whole number of more than {WIDEST} bits"
        raise ValueError(msg) from None
    return document


def _members(value: Any) -> list[Any]:
    """Return the values directly inside a table or a list; [] for other values."""
    if isinstance(value, dict):
        return list(value.values())
    return value if isinstance(value, list) else []


def _value(raw: str) -> Any:
    try:
        document = parsed_toml(f"value = {raw}")
    except ValueError as failed:
        if not isinstance(failed, tomllib.TOMLDecodeError):
            raise
    else:
        if len(document) > 1:  # further lines would be ignored
            msg = "more than one line"
            raise ValueError(msg)
        return document["value"]
    try:
        return float(raw)  # .1 and 1e-6 are numbers to engineers, but not in TOML
    except ValueError:
        return raw.strip()


def parse_setting(text: str) -> tuple[str, Value]:
    """Parse ``name=value`` as (full dotted name, value): a TOML value or a word."""
    name, sign, raw = text.partition("=")
    if not sign or not name.strip() or not raw.strip():
        msg = f"a setting is name=value, got {shown(text)}"
        raise InputError(msg)
    name = name.strip()
    full = full_name(name)
    return full, setting_value(full, raw, name)


def setting_value(full: str, raw: str, name: str = "") -> Value:
    """Parse the text of an input's value: a TOML value or a word.

    Parameters
    ----------
    full : full dotted name
    raw : text that is not empty
    name : for messages; "": the full one
    """
    name = name or full
    try:
        value: Value = _value(raw)
    except ValueError as failed:
        msg = f"{name} takes one value, got {failed}: {shown(raw)}"
        raise InputError(msg) from None
    listed = isinstance(value, list) and takes_list(full)
    if not listed and not isinstance(value, bool | int | float | str):
        msg = f"{name} takes one value, got {shown(raw)}"
        raise InputError(msg)
    return value


def load_document(path: Path | str) -> dict[str, Any]:
    """Return the parsed TOML of a file.

    Raises
    ------
    MissingFileError
        if it cannot be read
    InputError
        if it is no TOML
    """
    try:
        text = read_regular(path).decode().replace("\r\n", "\n")
    except (OSError, UnicodeDecodeError) as failed:
        msg = f"cannot read {path}: {getattr(failed, 'strerror', None) or failed}"
        raise MissingFileError(msg) from None
    try:
        return parsed_toml(text)
    except ValueError as failed:
        msg = f"{path} is not valid TOML: {one_line(str(failed), 300)}"
        raise InputError(msg) from None
