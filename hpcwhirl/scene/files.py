"""Scenes from plain data and ``name=value`` settings, their TOML and their digests."""

from __future__ import annotations

import hashlib
import json
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache, lru_cache
from pathlib import Path
from typing import Any, TypeGuard, get_origin

import tomli_w
from pydantic import ValidationError

from hpcwhirl.errors import (
    SHOWN,
    InputError,
    MissingFileError,
    one_line,
    shown,
    unknown,
)
from hpcwhirl.safe_open import check_regular, open_regular, read_regular
from hpcwhirl.scene.bearing import bearing_table
from hpcwhirl.scene.history import history_of, parsed
from hpcwhirl.scene.input_types import WRONG_UNIT
from hpcwhirl.scene.inputs import Scene
from hpcwhirl.scene.otherwise import OTHERWISE
from hpcwhirl.scene.profile import profile_table
from hpcwhirl.scene.quantities import INPUTS, LEAVES
from hpcwhirl.scene.units import each_in_si, told_of

Value = bool | int | float | str | list[float]
FILE = "engine.file"  # the one input that names a file
TABLES_KEPT: dict[str, Callable[[str], str]] = {  # inputs whose file is kept as text
    "engine.rotor.bearing": bearing_table,
    "engine.casing.profile": profile_table,
}
MISTUNING = "engine.rotor.mistuning"  # the one input that is a list
READING = 2  # increase when the same engine file would give other numbers
PHYSICS_VERSION = 16  # increase when the same inputs would give other numbers
MOST_BYTES = 2**31  # largest engine file: 16 matrices of 4,000 coordinates
WIDEST = 1000  # largest number of bits of a whole number, so that it fits a float
DEEPEST = 32  # deepest nesting of tables and lists
LATER = tuple(name for name, told in INPUTS.items() if told.later)
IN_UNITS = {name for name, field in LEAVES if field.annotation is float}
SCENE_TABLES = ("scene", "engine", "solver", "output")
PRESET = "preset"  # key of [solver]: a name for the values of several inputs
TABLES = {"sweep", "zip", "cases", "sample", "refine", "twins", "branch", "campaign"}
SETS = {  # {input: inputs whose values it overrides if it is not zero}
    "solver.accuracy": ("solver.time_step",),
    "solver.truncation": (
        "solver.modes",
        "engine.casing.harmonics",
        "engine.casing.families",
    ),
}


def input_names() -> dict[str, str]:
    """Return {dotted name: meaning with unit} of every scene input."""
    return {name: told.labelled(told.meaning) for name, told in INPUTS.items()}


def value_in_si(name: str, value: Any) -> Any:
    """Return a value of an input with texts such as "0.8 mm" converted to SI numbers.

    Parameters
    ----------
    name : full dotted name
    value : value from TOML; in a list each element is converted

    Raises
    ------
    InputError
        naming the input, if the unit is unknown or of another quantity
    """
    told = INPUTS.get(name)
    if name in TABLES_KEPT:
        return told_of(name, lambda: _tables_in(value, TABLES_KEPT[name]))
    if told is None or name not in IN_UNITS:
        return value
    return told_of(name, lambda: each_in_si(value, told.unit))


def _tables_in(value: Any, table: Callable[[str], str]) -> Any:
    """Return the table that a text names, or a list of tables for a list of texts."""
    if isinstance(value, list):
        return [_tables_in(one, table) for one in value]
    return table(value) if isinstance(value, str) else value


@cache
def takes_list(name: str) -> bool:
    """Return whether the input of a full dotted name is a list of numbers."""
    return any(n == name and get_origin(f.annotation) is tuple for n, f in LEAVES)


def full_name(name: str) -> str:
    """Return the full dotted name of an input from it or from an unambiguous ending."""
    if name in INPUTS:
        return name
    matches = [n for n in INPUTS if n.endswith("." + name)]
    if len(matches) == 1:
        return matches[0]
    if matches:
        msg = f"input '{name}' is ambiguous: {' or '.join(matches)}"
        raise InputError(msg)
    if name.rpartition(".")[2] == PRESET:
        msg = (
            "a preset is no scene input: --preset NAME, or preset in a file's [solver]"
        )
        raise InputError(msg)
    if name.partition(".")[0] in TABLES:
        table = name.partition(".")[0]
        msg = f"'{name}' is no scene input: write [{table}] in the campaign's file"
        raise InputError(msg)
    if name.lower() in OTHERWISE:
        msg = f"unknown scene input '{name}': {OTHERWISE[name.lower()]}"
        raise InputError(msg)
    short = {n.rsplit(".", 1)[-1] for n in INPUTS}
    raise unknown("scene input", name, short | INPUTS.keys())


def by_full_name(given: Iterable[tuple[str, Any]], where: str) -> dict[str, Any]:
    """Return {full dotted name: value}, with -0.0 replaced by 0.0.

    Parameters
    ----------
    given : (name or unambiguous ending, value) of each input
    where : where the inputs are given, for messages

    Raises
    ------
    InputError
        for an unknown or ambiguous name, or an input under two names
    """
    out: dict[str, Any] = {}
    for name, value in given:
        full = full_name(name)
        if full in out:
            msg = f"{where} names {full} twice, once as {name}"
            raise InputError(msg)
        out[full] = _signless(value)
    return out


def _signless(value: Any) -> Any:
    """Return a value, or a list of values, with -0.0 replaced by 0.0."""
    if isinstance(value, list):
        return [_signless(one) for one in value]
    return value + 0.0 if isinstance(value, float) else value


def undotted(
    content: Mapping[str, Any],
    is_value: Callable[[Mapping[str, Any]], bool],
    prefix: str = "",
) -> Iterator[tuple[str, Any]]:
    """Yield (dotted name, value): undo TOML's parsing of dotted keys into tables.

    Parameters
    ----------
    content : parsed table
    is_value : whether a table that is not empty is a value, such as a range
    prefix : beginning of all names
    """
    for name, given in content.items():
        if isinstance(given, Mapping) and given and not is_value(given):
            yield from undotted(given, is_value, f"{prefix}{name}.")
        else:
            yield prefix + name, given


def is_whole(value: object) -> TypeGuard[int]:
    """Return whether a value from TOML is a whole number, which booleans are not."""
    return isinstance(value, int) and not isinstance(value, bool)


def is_number(value: object) -> TypeGuard[int | float]:
    """Return whether a value from TOML is a number, perhaps infinite or NaN."""
    return is_whole(value) or isinstance(value, float)


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


def scene_from(data: Mapping[str, Any]) -> Scene:
    """Return the validated scene of nested plain data.

    Raises
    ------
    InputError
        one line on the first input that is wrong
    """
    try:
        return Scene.model_validate(dict(data))
    except ValidationError as failed:
        raise told_by(failed) from None


def told_by(failed: ValidationError) -> InputError:
    """Return pydantic's error about a scene as an InputError of one line."""
    return _one_line(failed.errors()[0])


def flatten(scene: Scene) -> dict[str, Value]:
    """Return {dotted name: value} of every input of the scene."""

    def walk(data: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, Value]]:
        for name, value in data.items():
            if isinstance(value, Mapping):
                yield from walk(value, f"{prefix}{name}.")
            else:
                plain = list(value) if isinstance(value, tuple) else value
                yield f"{prefix}{name}", plain

    return dict(walk(scene.model_dump(), ""))


def apply_settings(scene: Scene, settings: Mapping[str, Value]) -> Scene:
    """Return the scene with some inputs replaced, validated again.

    Tables without a replaced input are frozen and shared with the scene.

    Parameters
    ----------
    scene : the scene to start from
    settings : {name: value}; a name may be an unambiguous ending, e.g. ``time_step``
    """
    if not settings:
        return scene
    data: dict[str, Any] = dict(scene)
    for name, value in settings.items():
        *tables, leaf = full_name(name).split(".")
        place = data
        for table in tables:
            place[table] = dict(place[table])
            place = place[table]
        place[leaf] = value
    return scene_from(data)


def check_kept(settings: Mapping[str, Any]) -> None:
    """Check that no setting is overridden by another one, see `SETS`.

    Parameters
    ----------
    settings : {full dotted name: value} of options and of a preset

    Raises
    ------
    InputError
        naming the setting that would have no effect
    """
    for cause, effects in SETS.items():
        lost = [name for name in effects if name in settings]
        value = settings.get(cause)
        if lost and value and isinstance(value, int | float):  # else refused later
            msg = (
                f"--set {lost[0]}: {cause} = {shown(value)} sets it; add --set "
                f"{cause.rpartition('.')[2]}=0"
            )
            raise InputError(msg)


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
        return float(raw)  # .1 and 1e-6 are numbers for an engineer, but not in TOML
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


def to_toml(scene: Scene) -> str:
    """Return the whole scene as TOML that `load_scene` reads back."""
    data = scene.model_dump()
    tables = {name: data.pop(name) for name in SCENE_TABLES[1:]}
    return tomli_w.dumps({"scene": data, **tables})


def content_digest(file: str) -> str:
    """Return the SHA-256 of a file's bytes, "" for no file."""
    if not file:
        return ""
    try:
        check_bytes(file, check_regular(file))
        state = Path(file).stat()
        return _sha256(file, (state.st_ino, state.st_ctime_ns, state.st_mtime_ns))
    except MissingFileError:
        raise
    except OSError as failed:
        told = one_line(one_line(file), 3 * SHOWN)
        msg = f"cannot read {FILE} {told}: {failed.strerror or failed}"
        raise MissingFileError(msg) from None


def check_bytes(file: str, size: int) -> None:
    """Raise InputError for an engine file of more than `MOST_BYTES`, sparse or not."""
    if size > MOST_BYTES:
        msg = f"{FILE} {file} must have at most {MOST_BYTES} bytes, got {size}"
        raise InputError(msg)


@lru_cache(maxsize=64)
def _sha256(file: str, state: tuple[int, ...]) -> str:
    del state  # key of the cache: the file is read again only if it has changed
    with open_regular(file) as handle:
        return hashlib.file_digest(handle, "sha256").hexdigest()


def case_before(scene: Scene) -> Scene | None:
    """Return the case with whose last state a case begins; None without history."""
    over, values = parsed(scene.history)
    if not values:
        return None
    return apply_settings(
        scene, {over: values[-1], "history": history_of(over, values[:-1])}
    )


def digest(scene: Scene, content: str | None = None) -> str:
    """Return the SHA-256 of a case's inputs and the physics version, hexadecimal.

    The content of an engine file counts as an input, in addition to its path.

    Parameters
    ----------
    scene : all inputs of the case
    content : `content_digest` of the engine file when planned; None: as it is now
    """
    if content is None:
        content = content_digest(scene.engine.file)
    return digest_of(flatten(scene), content)


def digest_of(values: Mapping[str, Value], content: str) -> str:
    """Return the `digest` of a scene from its flattened inputs, see `flatten`."""
    told = [PHYSICS_VERSION, without_defaults(values), read_as(content)]
    text = json.dumps(told, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def without_defaults(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return flattened inputs without those of `LATER` that have their default."""
    return {n: v for n, v in values.items() if n not in LATER or v != default_of(n)}


@cache
def default_of(name: str) -> Any:
    """Return the default value of an input by its full dotted name."""
    return next(field.default for n, field in LEAVES if n == name)


def read_as(content: str) -> str:
    """Return an engine file's part of a digest: `content` and `READING`; "" if none."""
    return content and f"{content} {READING}"
