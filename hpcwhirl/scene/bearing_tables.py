"""Tables of a bearing's coefficients over speed, as files have them.

Names of columns, their defaults, signs and units are those of ROSS (R. Timbo et al.,
ROSS - Rotordynamic open source software, JOSS 2020): the speed of rotation, rad/s, as
speed, frequency or w; kxx and cxx; and, optionally, kyy and cyy (default kxx and cxx),
kxy, kyx, cxy and cyx (default 0). Axial coefficients (kzz, czz, mzz), which move
nothing in the rotor's plane, and numbers of nodes, tags and colours are skipped. Added
mass (mxx; myy, by default mxx) is a number of its own, `added_mass`: of a bearing of a
shaft line only, and the same at all speeds. Any other column must be zero: what it says
is not modelled. Without a speed a table has one row, which holds at all speeds.

ROSS 3 calls the speed `speed`, and saves how it interpolates, which must be as here.
Coefficients over the frequency of the motion, as those of seals and magnetic bearings,
have the axis `whirl_frequency` here and `frequency` in ROSS 3, whose elements are known
by their keys; they are read of bearings of a shaft line only. Tables over speed and
frequency at once are refused.
"""

from __future__ import annotations

import itertools
import json
import math
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hpcwhirl.errors import nearest, shown
from hpcwhirl.scene.columns import Column, columns_of, refuse_unknown
from hpcwhirl.scene.kept_tables import (
    Rows,
    are_finite,
    ascends,
    kept_rows,
    kept_table,
    must,
    read,
)
from hpcwhirl.scene.units import in_si

AXIS = "frequency"  # name of the speed in the text that a scene stores
AXES = "speed", AXIS, "w"
OF_WHIRL = "whirl_frequency"
COEFFICIENTS = "kxx", "kxy", "kyx", "kyy", "cxx", "cxy", "cyx", "cyy"
HEAD = ",".join((AXIS, *COEFFICIENTS))
USUAL = {"kyy": "kxx", "cyy": "cxx"}  # default of a bearing's missing column
SKIPPED = {
    "n", "n_link", "tag", "color", "scale_factor", "name", "kzz", "czz", "mzz",
    "radial_clearance", "seal_leakage", "interpolation",
}  # fmt: skip
BETWEEN = "interpolation", "pchip"  # key of ROSS 3, and its value as here
UNITS = {"k": "N/m", "c": "N s/m"}
OVER_WHIRL = "magnetic", "squeezefilm"  # in names of elements with such coefficients
OF_ROSS_3 = "interpolation", "radial_clearance"  # keys of an element of ROSS 3
WHIRL = (
    "coefficients over the frequency of the whirl are modelled of bearings of a shaft "
    "only, engine.shaft, and not over speed besides"
)
ELEMENTS: dict[str, Callable[[str], Any]] = {
    ".toml": tomllib.loads,
    ".json": json.loads,
}
MASSES = tuple(f"m{a}{b}" for a, b in itertools.product("xy", repeat=2))


def bearing_table(text: str) -> str:
    """Return the table of a bearing over speed as the text that a scene stores.

    text : name of a CSV, TOML or JSON file or of a spreadsheet, "file.toml#tag" for one
        element of several; or the table itself, its lines separated by line breaks or
        semicolons; "" is returned unchanged

    Raises
    ------
    ValueError
        if the file cannot be read, or does not hold such a table
    """
    if not text:
        return ""
    is_kept = text.startswith(f"{HEAD};")
    rows = kept_rows(text) if is_kept else _rows(_columns_in(text))
    wide = 1 + len(COEFFICIENTS)
    must(all(len(row) == wide for row in rows), f"every row must have {wide} numbers")
    are_rows = rows and are_finite(rows)
    must(are_rows, "it must have one row at least, of finite numbers")
    rises = rows[0][0] >= 0.0 and ascends(rows)
    must(rises, "its speed must be >= 0 rad/s and ascend")
    return kept_table(HEAD, rows)


def is_table(text: str) -> bool:
    """Return whether a text is a table itself, not the name of a file with one."""
    return "\n" in text or ";" in text


def rows_of(own: Mapping[str, Any]) -> tuple[Rows, bool]:
    """Return (speed, kxx, ..., cyy) of each row of one element, given as a table.

    Returns also whether the table is over the whirl's frequency, in place of the speed.
    """
    columns = _columns({key: v for key, v in own.items() if v is not None})
    over = OF_WHIRL in columns
    rows = _rows(columns, (*AXES, OF_WHIRL))
    told = f"its {OF_WHIRL if over else 'speed'} must be >= 0 rad/s and ascend"
    must(rows and rows[0][0] >= 0.0 and ascends(rows), told)
    return rows, over


def as_ross_3(own: Mapping[str, Any]) -> dict[str, Any]:
    """Return an element of ROSS 3, whose `frequency` is that of the whirl.

    With a speed, too, its table has two axes, and is refused when it is read.
    """
    return {OF_WHIRL if key == AXIS else key: value for key, value in own.items()}


def listed(name: str) -> dict[str, Any]:
    """Return the columns of a bearing's table in a file, {name: values in SI}.

    name : as of `bearing_table`
    """
    found = _columns_in(name)
    return {key: column.numbers(unit) if (unit := _unit_of(key)) else
            list(column.cells.values()) for key, column in found.items()}  # fmt: skip


def _unit_of(name: str) -> str:
    """Return the SI unit of a column; "": it has none."""
    if name in (*AXES, OF_WHIRL):
        return "rad/s"
    if name in MASSES:
        return "kg"
    return UNITS[name[0]] if name in COEFFICIENTS else ""


def added_mass(own: Mapping[str, Any]) -> tuple[float, float] | None:
    """Return mxx and myy of one element, kg, given as a table; None if both are 0.

    A number may be a list, one for each speed: they must be equal.
    """
    given = {name: own[name] for name in MASSES if own.get(name) not in (None, [])}
    found = {name: _constant(name, value) for name, value in given.items()}
    for name in ("mxy", "myx"):
        cross = found.get(name, 0.0)
        told = f"{name} must be 0, got {cross:g}: added mass acts along x and y"
        must(cross == 0.0, told)
    xx = found.get("mxx", 0.0)
    pair = xx, found.get("myy", xx)
    return pair if any(pair) else None


def _constant(name: str, value: Any) -> float:
    """Return an added mass, kg, >= 0, from a number, a text with a unit, or lists."""
    try:
        numbers = {in_si(one, "kg") for one in np.ravel(value).tolist()}
    except ValueError as failed:
        raise ValueError(f"{name} {failed}") from None
    told = (
        f"{name} must be one number, got {shown(value)}: added mass over the speed or"
    )
    must(len(numbers) == 1, f"{told} frequency is not modelled")
    (number,) = numbers
    is_fit = isinstance(number, int | float) and 0.0 <= number < math.inf
    must(is_fit, f"{name} must be a number >= 0, got {shown(value)}")
    return float(number)


def _rows(columns: Mapping[str, Column], known_axes: tuple[str, ...] = AXES) -> Rows:
    """Return (speed, kxx, ..., cyy), rad/s, N/m, N s/m, of each row of a table.

    known_axes : names that the column of the speed may have
    """
    axes = [name for name in (*AXES, OF_WHIRL) if name in columns]
    is_known = len(axes) < 2 and all(name in known_axes for name in axes)
    must(is_known, f"it has {' and '.join(axes)}: {WHIRL}")
    missing = ", ".join(name for name in ("kxx", "cxx") if name not in columns)
    must(not missing, f"it must have the columns {missing}, got {_names(columns)}")
    key, usual = BETWEEN
    for cell in columns[key].cells.values() if key in columns else ():
        told = f"{key} = {shown(cell)} is not modelled, only {usual}"
        must(cell == usual or len(columns["kxx"].cells) < 3, told)
    known = {*known_axes, *COEFFICIENTS, *SKIPPED}
    refuse_unknown(columns, known.__contains__, (*known_axes, *COEFFICIENTS), _why)
    length = len(columns["kxx"].cells)
    if not axes:
        told = f"it must have the column speed, or one row, got {_names(columns)}"
        must(length < 2, told)
    speeds = columns[axes[0]].numbers("rad/s") if axes else [0.0] * length
    own = [_coefficient(columns, name, length) for name in COEFFICIENTS]
    are_alike = all(len(column) == len(speeds) for column in own)
    must(are_alike, "its columns must be of one length")
    return list(zip(speeds, *own, strict=True))


def _names(columns: Mapping[str, Column]) -> str:
    return shown(", ".join(columns))


def _coefficient(columns: Mapping[str, Column], name: str, length: int) -> list[float]:
    column = columns.get(name, columns.get(USUAL.get(name, "")))
    return column.numbers(UNITS[name[0]]) if column else [0.0] * length


def _why(name: str) -> str:
    told = ": added mass is only modelled of bearings of a shaft, engine.shaft"
    return told if name in MASSES else ""


class _Element(NamedTuple):
    """A table of a TOML file that has the key kxx: the keys that lead to it, itself."""

    path: tuple[str, ...]
    table: Mapping[str, Any]

    @property
    def names(self) -> set[str]:
        """The names by which a user may choose the element."""
        return {self.path[-1] if self.path else "", str(self.table.get("tag", ""))}


def _columns_in(name: str) -> dict[str, Column]:
    """Return the columns of the table in a file; name : of it, or "file.toml#tag".

    A name with a line break or a semicolon is a table itself.
    """
    if is_table(name):
        return columns_of(name if "\n" in name else name.replace(";", "\n"))
    file, sign, tag = name.rpartition("#")
    file, tag = (
        (file, tag) if sign and file.endswith((".toml", ".json")) else (name, "")
    )
    path = Path(file)
    if path.suffix not in ELEMENTS:
        return columns_of(read(path))
    return _of_elements(_parsed(read(path), path.suffix), tag)


def _parsed(text: str, kind: str) -> Any:
    """Return the content of a TOML or JSON file; kind : ".toml" or ".json"."""
    try:
        return ELEMENTS[kind](text)
    except (ValueError, RecursionError) as failed:
        told = f"it is no {kind[1:].upper()}: {failed}"
        raise ValueError(told) from None


def _of_elements(content: Any, tag: str) -> dict[str, Column]:
    """Return the columns of the one element in a file, or of that with a tag."""
    found = _elements(content, ())
    if tag:
        known = sorted(set().union(*(one.names for one in found)) - {""})
        found = [one for one in found if tag in one.names]
        hint = nearest(tag, known) or f"; known: {', '.join(known)}"
        must(found, f"it has no element {shown(tag)}{hint}")
    more = ": name one, as file.toml#tag" if len(found) > 1 else ""
    must(len(found) == 1, f"it must have one table with kxx, got {len(found)}{more}")
    (path, own) = found[0]
    kind = "".join(path).replace("_", "").lower()
    if any(own.get(key) is not None for key in OF_ROSS_3):
        return _columns(as_ross_3(own))
    must(not any(word in kind for word in OVER_WHIRL), f"{'.'.join(path)}: {WHIRL}")
    return _columns(own)


def _columns(own: Mapping[str, Any]) -> dict[str, Column]:
    """Return the columns of an element; a single number holds in all rows."""
    given = {key.lower(): value for key, value in own.items() if value != []}
    count = max((len(v) for v in given.values() if isinstance(v, list)), default=1)
    out = {}
    for name, value in given.items():
        cells = value if isinstance(value, list) else [value]
        nested = name in COEFFICIENTS and any(isinstance(c, list) for c in cells)
        must(not nested, f"{name} has two axes: {WHIRL}")
        listed = cells * count if len(cells) == 1 else cells
        out[name] = Column(name, "", {i: str(c) for i, c in enumerate(listed, 1)})
    return out


def _elements(content: Any, path: tuple[str, ...]) -> list[_Element]:
    """Return all tables in a parsed file that have the key kxx, at any depth."""
    if isinstance(content, list):
        inner = [(str(i), value) for i, value in enumerate(content)]
    else:
        inner = list(content.items()) if isinstance(content, Mapping) else []
    is_one = isinstance(content, Mapping) and "kxx" in {str(k).lower() for k in content}
    own = [_Element(path, content)] if is_one else []
    return own + [f for k, value in inner for f in _elements(value, (*path, k))]
