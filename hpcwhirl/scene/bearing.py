"""The coefficients of a bearing over speed, from a table that an input names.

Names of columns, their defaults and units are those of ROSS (R. Timbo et al., ROSS -
Rotordynamic open source software, JOSS 2020): frequency, or w, rad/s; kxx and cxx; and,
optionally, kyy and cyy (default kxx and cxx), kxy, kyx, cxy and cyx (default 0).
"""

from __future__ import annotations

import csv
import itertools
import math
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hpcwhirl.scene.kept_table import Rows, kept_rows, kept_table, text_of

SPEED = "frequency"
COEFFICIENTS = "kxx", "kxy", "kyx", "kyy", "cxx", "cxy", "cyx", "cyy"
HEAD = ",".join((SPEED, *COEFFICIENTS))
OTHERWISE = {"kyy": "kxx", "cyy": "cxx"}  # default of a missing column


def is_table(text: str) -> bool:
    """Return whether a text is a table, and not the name of a file."""
    return text.startswith(f"{HEAD};")


def bearing_table(text: str) -> str:
    """Return a bearing's table as one line of text, the form that a scene stores.

    text : name of a CSV or TOML file, or a table in that form, which is only checked;
        "" stays ""

    Raises
    ------
    ValueError
        if the file cannot be read, or is not a table of a bearing
    """
    if not text:
        return ""
    rows = kept_rows(text) if is_table(text) else _read(Path(text))
    if any(len(row) != 1 + len(COEFFICIENTS) for row in rows):
        msg = f"every row must have {1 + len(COEFFICIENTS)} numbers"
        raise ValueError(msg)
    _check(rows)
    return kept_table(HEAD, rows)


def _read(path: Path) -> Rows:
    """Return (rad/s, kxx, ..., cyy) of each row of a CSV or TOML file, N/m, N s/m."""
    text = text_of(path)
    return _rows(_of_toml(text) if path.suffix == ".toml" else _of_csv(text))


def _of_csv(text: str) -> dict[str, list[Any]]:
    read = csv.DictReader(text.splitlines())
    heads = [(head or "").strip().lower() for head in read.fieldnames or ()]
    lines = [list(line.values()) for line in read]
    if any(len(line) != len(heads) for line in lines):
        msg = "every row must have as many values as the head has names"
        raise ValueError(msg)
    return {head: [line[i] for line in lines] for i, head in enumerate(heads)}


def _of_toml(text: str) -> dict[str, list[Any]]:
    try:
        found = _tables(tomllib.loads(text))
    except tomllib.TOMLDecodeError as failed:
        msg = f"it is no TOML: {failed}"
        raise ValueError(msg) from None
    if len(found) != 1:
        msg = f"a TOML file must have one table with kxx, got {len(found)}"
        raise ValueError(msg)
    listed = {n: v if isinstance(v, list) else [v] for n, v in found[0].items()}
    count = max(len(listed.get(name, [])) for name in (SPEED, "w", "kxx"))
    return {n: v * count if len(v) == 1 else v for n, v in listed.items()}


def _tables(table: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Return all tables with the key kxx among a table and those nested in it."""
    own = [table] if "kxx" in table else []
    inner = [value for value in table.values() if isinstance(value, Mapping)]
    return own + [found for value in inner for found in _tables(value)]


def _rows(columns: Mapping[str, list[Any]]) -> Rows:
    speeds = columns.get(SPEED, columns.get("w"))
    missing = [name for name in ("kxx", "cxx") if name not in columns]
    missing += [SPEED] if speeds is None else []
    if missing or speeds is None:
        msg = f"it must have the columns {', '.join(missing)}"
        raise ValueError(msg)
    none = ["0"] * len(speeds)
    named = [
        columns.get(n, columns.get(OTHERWISE.get(n, ""), none)) for n in COEFFICIENTS
    ]
    if any(len(column) != len(speeds) for column in named):
        msg = "its columns must be of one length"
        raise ValueError(msg)
    try:
        return [tuple(map(float, row)) for row in zip(speeds, *named, strict=True)]
    except (TypeError, ValueError):
        msg = "its values must be numbers"
        raise ValueError(msg) from None


def _check(rows: Rows) -> None:
    speeds = [row[0] for row in rows]
    if not rows or not all(map(math.isfinite, (v for row in rows for v in row))):
        msg = "it must have one row at least, of finite numbers"
        raise ValueError(msg)
    pairs = itertools.pairwise(speeds)
    if speeds[0] < 0.0 or any(after <= before for before, after in pairs):
        msg = f"its {SPEED} must be >= 0 rad/s and ascend"
        raise ValueError(msg)
