"""What users write: TOML files, and settings such as ``name=value``."""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from hpcwhirl.errors import (
    InputError,
    MissingFileError,
    as_table,
    one_line,
    shown,
    unknown,
)
from hpcwhirl.safe_open import read_regular
from hpcwhirl.scene.bearing_tables import is_table
from hpcwhirl.scene.campaign_tables import TABLES
from hpcwhirl.scene.input_names import (
    FILE,
    PRESET,
    Value,
    full_name,
    takes_list,
)
from hpcwhirl.scene.inputs import Scene
from hpcwhirl.scene.named import check_label, preset_inputs, preset_names
from hpcwhirl.scene.plain_data import (
    SCENE_TABLES,
    apply_settings,
    check_kept,
    scene_from,
)
from hpcwhirl.scene.quantities import INPUTS
from hpcwhirl.scene.shaft_tables import (
    KEPT,
    SUFFIXES,
    TOLERANCE,
    UNEQUAL,
    parsed,
    text_of,
    tolerance_of,
    with_tables,
)
from hpcwhirl.scene.swept import KEYS
from hpcwhirl.scene.table_files import utf_8
from hpcwhirl.scene.table_model import anchored
from hpcwhirl.scene.units import is_shown_in, measure, told_of

DESIGN_TABLES = (*KEYS, *TABLES)  # only in campaign files
WIDEST = 1000  # largest number of bits of a whole number, so that it fits a float
DEEPEST = 32  # deepest nesting of tables and lists
# a name with so many dots that a parser would need memory for the square of them
PARTS = "engine.rotor", "engine.casing"  # tables inside a table
TWICE = re.compile(r"Cannot declare (\(.*?\)) twice")  # what tomllib says
DOTTED = re.compile(rf"^[ \t\[]*(?:[\w-]+[ \t]*\.[ \t]*){{{DEEPEST}}}", re.MULTILINE)


def preset_in(document: Mapping[str, Any]) -> dict[str, Value]:
    """Return {dotted input: value} of the preset that a TOML file's [solver] names.

    Return {} if it names none; document : the file's parsed TOML

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


def scene_of_preset(inputs: Mapping[str, Any]) -> Scene | None:
    """Return the scene of nested inputs whose solver names a preset; None: it does not.

    inputs : those of `Scene`, such as {"speed": 330.0, "solver": {"preset": "draft"}}

    Raises
    ------
    InputError
        for an unknown preset, or a wrong input
    """
    preset = preset_in(inputs)
    return _set(dict(inputs), preset, {}) if preset else None


def scene_of_document(
    document: Mapping[str, Any],
    extra_tables: Sequence[str] = (),
    folder: Path | str = "",
    settings: Mapping[str, Value] | None = None,
) -> Scene:
    """Return the scene that a parsed TOML file describes.

    Its inputs are in the tables scene, engine, solver and output.

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
            raise unknown("table", table, (*known, *PARTS))
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
    """Return the scene of a TOML file with a preset and then settings applied.

    data : inputs of [scene], and the tables engine, solver and output in it
    preset, settings : {input: value}
    """
    if not preset:
        return apply_settings(scene_from(data), settings)
    solver = {name: value for name, value in data["solver"].items() if name != PRESET}
    merged = {**preset, **{full_name(name): value for name, value in settings.items()}}
    check_kept(merged)
    return apply_settings(scene_from({**data, "solver": solver}), merged)


def _placed(engine: Mapping[str, Any], folder: Path | str) -> dict[str, Any]:
    """Return the table [engine] with absolute paths of the files that it names.

    These are the engine file and the tables of bearing, profile and shaft. The shaft as
    a table [engine.shaft], or engine.shaft and engine.station, become inputs of the
    rotor.

    folder : directory to which relative names refer
    """
    placed = _with_shaft(engine, folder)
    if isinstance(engine.get("file"), str):
        placed["file"] = _anchored(engine["file"], folder)
    for part, name in (("rotor", "bearing"), ("casing", "profile")):
        inner = placed.get(part)
        table = inner.get(name) if isinstance(inner, Mapping) else None
        if isinstance(inner, Mapping) and isinstance(table, str):
            kept = table if is_table(table) else _anchored(table, folder)
            placed[part] = {**inner, name: kept}
    return placed


def _with_shaft(engine: Mapping[str, Any], folder: Path | str) -> dict[str, Any]:
    """Return the table [engine] with its shaft among the inputs of the rotor."""
    placed, rotor = dict(engine), engine.get("rotor", {})
    if not isinstance(rotor, Mapping):
        return placed
    own = dict(rotor)
    for name, target in (("shaft", "shaft"), ("station", "shaft_station")):
        if name in placed:
            if target in own:
                msg = f"engine.{name} is given twice, also as rotor.{target}"
                raise InputError(msg)
            own[target] = placed.pop(name)
    shaft = own.get("shaft")
    if isinstance(shaft, Mapping):
        own["shaft"] = told_of("shaft", lambda: _shaft_line(shaft, own, folder))
    elif isinstance(shaft, str) and Path(shaft).suffix in SUFFIXES:
        own["shaft"] = _anchored(shaft, folder)
    return placed | {"rotor": own} if own else placed


def _shaft_line(
    shaft: Mapping[str, Any], own: dict[str, Any], folder: Path | str
) -> str:
    """Return the text of the shaft in a table; its station and modes become inputs.

    shaft, own : the table; inputs of the rotor, which are changed in place
    folder : directory to which a relative name refers
    """
    for name in ("station", "modes"):
        if name in shaft:
            own[f"shaft_{name}"] = shaft[name]
    rest = {k: v for k, v in shaft.items() if k not in {"station", "modes"}}
    unequal, file = rest.pop("unequal", KEPT), rest.pop("file", None)
    tolerance = tolerance_of(rest.pop("whirl_tolerance", TOLERANCE))
    if unequal not in UNEQUAL:
        told = f"unequal must be one of {', '.join(UNEQUAL)}, got {shown(unequal)}"
        raise ValueError(told)
    if file is None:
        rest = with_tables(rest, lambda name: _anchored(name, folder))
        return text_of(rest, "[engine.shaft]", unequal, tolerance)
    if rest or not isinstance(file, str):
        told = "with a file has only station, modes, unequal, whirl_tolerance, got "
        raise ValueError(f"{told}{', '.join(rest) or shown(file)}")
    path = Path(_anchored(file, folder))
    return text_of(parsed(path), path.name, unequal, tolerance)


def _anchored(file: str, folder: Path | str) -> str:
    try:
        return anchored(file, folder)
    except ValueError as failed:
        raise InputError(f"{FILE}: {failed}") from None


def load_scene(path: Path | str) -> Scene:
    """Return the scene of a TOML file (tables scene, engine, solver, output)."""
    with naming_lines(path):
        return scene_of_document(load_document(path), folder=Path(path).parent)


def parsed_toml(text: str) -> dict[str, Any]:
    """Parse a TOML text.

    Raises
    ------
    ValueError
        in one line, if it is no TOML, is nested too deeply, or has a too large number
    """
    try:
        if DOTTED.search(text):
            raise RecursionError  # noqa: TRY301 - as where the parser gives up
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
        raise ValueError(f"nested deeper than {DEEPEST} tables or lists") from None
    except tomllib.TOMLDecodeError:
        raise
    except ValueError:  # Python refuses to read such an integer
        raise ValueError(f"a whole number of more than {WIDEST} bits") from None
    return document


def _twice(found: re.Match[str]) -> str:
    """Return in TOML's form what the parser says of a table that is given twice."""
    names = ast.literal_eval(found[1])
    return f"the table [{'.'.join(names)}] is given twice"


def _members(value: Any) -> list[Any]:
    """Return the values directly inside a parsed TOML table or list; else []."""
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
            raise ValueError("more than one line")
        return document["value"]
    try:
        return float(raw)  # .1 and 1e-6 are numbers to engineers, but not in TOML
    except ValueError:
        return raw.strip()


def parse_setting(text: str) -> tuple[str, Value]:
    """Parse an option's ``name=value`` as (full dotted name of the input, value).

    The text of the value is TOML, or a word without quotes.
    """
    name, sign, raw = text.partition("=")
    if not sign or not name.strip() or not raw.strip():
        raise InputError(f"a setting must be NAME=VALUE, got {shown(text)}")
    name = name.strip()
    full = full_name(name)
    return full, setting_value(full, raw, name)


def setting_value(full: str, raw: str, name: str = "") -> Value:
    """Parse the text of an input's value: a TOML value, or a word without quotes.

    Parameters
    ----------
    full : full dotted name of the input
    raw : text of the value, not empty
    name : name of the input in messages; "": the full name
    """
    name = name or full
    try:
        value: Value = _value(raw)
    except ValueError as failed:
        msg = f"{name} takes one value, got {failed}: {shown(raw)}"
        raise InputError(msg) from None
    listed = isinstance(value, list) and takes_list(full)
    if not listed and not isinstance(value, bool | int | float | str):
        raise InputError(f"{name} takes one value, got {shown(raw)}")
    return value


NAMED_KEY = re.compile(  # the key that a message is about
    r"unknown (?:key|table|(?:scene )?input)[^']*'([\w.-]+)'|(?:^|[\s:])([a-z_][\w.]*)"
    r" (?:must be|takes one|must have|must lie|is given)"
)


@contextmanager
def naming_lines(
    path: Path | str, settings: Mapping[str, Value] | None = None
) -> Iterator[None]:
    """Within this context, an InputError on a key of a file also names its line.

    It does not where the file has the key twice or not at all.

    Parameters
    ----------
    path : the file
    settings : {input: value} that override the file, whose errors are not the file's
    """
    try:
        yield
    except InputError as failed:
        told = str(failed)
        line = 0 if str(path) in told else _line_of(told, path, settings or {})
        if not line:
            raise
        raise type(failed)(f"{told} ({path}, line {line})") from None


def _line_of(told: str, path: Path | str, settings: Mapping[str, Value]) -> int:
    """Return the line of a file that has the key that a message names, or 0."""
    found = NAMED_KEY.search(told)
    key = (found[1] or found[2]).rpartition(".")[2] if found else ""
    if not key or key in {name.rpartition(".")[2] for name in settings}:
        return 0
    given = re.compile(rf"(?:^|[{{,.\s]|\[){re.escape(key)}\s*(?:=|\]|\.\w+\s*=)")
    lines = _text_of(path).splitlines()
    having = [n for n, one in enumerate(lines, 1) if given.search(one.split("#")[0])]
    return having[0] if len(having) == 1 else 0


def load_document(path: Path | str) -> dict[str, Any]:
    """Return the parsed TOML of a file.

    Raises
    ------
    MissingFileError
        if the file cannot be read
    InputError
        if the file is no TOML
    """
    try:
        return parsed_toml(_text_of(path).replace("\r\n", "\n"))
    except ValueError as failed:
        why = str(failed).replace("Cannot overwrite a value", "a key is given twice")
        why = one_line(TWICE.sub(_twice, why), 300)
        msg = f"{path} is not valid TOML: {why}{_key_at(path, why)}"
        raise InputError(msg) from None


def _key_at(path: Path | str, why: str) -> str:
    """Return ": KEY" of the line on which a key is given twice; else ""."""
    found = re.search(r"a key is given twice \(at line (\d+)", why)
    lines = _text_of(path).splitlines() if found else []
    at = int(found[1]) - 1 if found else 0
    key = lines[at].partition("=")[0].strip() if at < len(lines) else ""
    return f": {one_line(key, 60)}" if key else ""


def units_of_document(document: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the units that a file is written in, in which its numbers are shown.

    Of several units of one quantity the first counts, of swept inputs before others.
    Times stay in s, and [engine], whose sizes differ by orders, is not asked.

    document : parsed TOML
    """
    tables = (document.get(name) for name in (*KEYS, "sample", "scene"))
    texts = (one for table in tables for one in _texts(table))
    units = dict.fromkeys(found[1] for one in texts if (found := measure(one)))
    known = {quantity.unit for quantity in INPUTS.values()} - {"1", "s"}
    first: dict[str, str] = {}
    for unit in units:
        for si in known:
            if is_shown_in(si, unit):
                first.setdefault(si, unit)
    return tuple(dict.fromkeys(first.values()))


def _texts(value: Any) -> Iterator[str]:
    """Yield the texts inside tables and lists of parsed TOML, in their order."""
    if isinstance(value, str):
        yield value
    for one in _members(value):
        yield from _texts(one)


def _text_of(path: Path | str) -> str:
    """Return the text of a file in UTF-8; MissingFileError if it cannot be read."""
    return readable(path, utf_8)


def readable(path: Path | str, text_of: Callable[[bytes], str]) -> str:
    """Return the text of a file; MissingFileError if it cannot be read.

    text_of : function from the content to the text, which raises ValueError with the
        reason why it is none
    """
    try:
        return text_of(read_regular(path))
    except ValueError as failed:
        raise MissingFileError(f"cannot read {path}: {failed}") from None
    except OSError as failed:
        msg = f"cannot read {path}: {failed.strerror or failed}"
        raise MissingFileError(msg) from None
