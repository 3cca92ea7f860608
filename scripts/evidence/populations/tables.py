"""A bearing's table is read column by column, and between its rows stays between them.

Tables are drawn with rows that need not be monotone, with equal neighbours, negative
cross coupling and missing optional columns; their heads differ in order, case,
separator, unit and name of the speed, and there are comments, empty lines and columns
of zeros that are not used. At a table's speeds all eight coefficients of the support
must be those of the row, at nine speeds between two rows within the two, and at a
negative speed the mirror image.
"""

from __future__ import annotations

import random
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from hpcwhirl.reduction.supports import bearing_of, planar
from hpcwhirl.scene.bearing_tables import COEFFICIENTS, bearing_table
from hpcwhirl.scene.kept_tables import kept_rows

COUNT, LEAST = 100, 1.0
SPRING = 3.4e7  # N/m, which the table replaces
CLOSE = 1e-9  # relative to the largest coefficient of its kind: round-off of SPRING
SPEEDS = ("frequency", "1"), ("speed", "1"), ("w", "1"), ("Speed [rpm]", "rpm")
FACTORS = {"1": 1.0, "rpm": np.pi / 30}
MARKS = ",", ";", "\t", " "


def drawn(seed: int, index: int) -> dict[str, Any]:
    """Return a table: its text, and the rows that it means, in SI."""
    lot = random.Random(f"tables {seed} {index}")
    count = lot.randint(1, 6)
    speeds = sorted(lot.sample(range(0, 1000, 7), count))
    names = [n for n in COEFFICIENTS if n in {"kxx", "cxx"} or lot.random() < 0.7]
    columns = {name: _values(lot, name, count) for name in names}
    none = [0.0] * count
    whole = {n: columns.get(n, columns.get(_usual(n), none)) for n in COEFFICIENTS}
    head, unit = lot.choice(SPEEDS)
    own = {head: [speed / FACTORS[unit] for speed in speeds], **columns}
    if lot.random() < 0.3:
        own["mxx"] = [0.0] * count
    rows = [[s, *(whole[n][i] for n in COEFFICIENTS)] for i, s in enumerate(speeds)]
    return {"text": _written(lot, own), "rows": rows}


def _usual(name: str) -> str:
    return {"kyy": "kxx", "cyy": "cxx"}.get(name, "")


def _values(lot: random.Random, name: str, count: int) -> list[float]:
    size = 10 ** lot.uniform(5.0, 8.0) / (1.0 if name[0] == "k" else 1e4)
    least = size / 10 if name[1] == name[2] else -size
    out = [lot.uniform(least, size) for _ in range(count)]
    return [out[max(i - 1, 0)] if lot.random() < 0.2 else x for i, x in enumerate(out)]


def _written(lot: random.Random, columns: dict[str, list[float]]) -> str:
    mark = lot.choice(MARKS)
    names = lot.sample(list(columns), len(columns))
    spelt = {n: n if "[" in n else lot.choice((n, n.upper(), n.title())) for n in names}
    if mark == " ":
        spelt = {name: word.replace(" ", "") for name, word in spelt.items()}
    lines = [mark.join(spelt[name] for name in names)]
    for row in zip(*(columns[name] for name in names), strict=True):
        comma = mark in ";\t" and lot.random() < 0.3
        cells = [repr(x).replace(".", ",") if comma else repr(x) for x in row]
        lines.append(mark.join(cells))
    if lot.random() < 0.3:
        lines.insert(lot.randint(1, len(lines)), lot.choice(("", "# a note", "% 1, 2")))
    return "\n".join(lines) + "\n"


def judged(row: dict[str, Any]) -> dict[str, Any]:
    """Read the table from a file and compare what a support has of each column."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "bearing.csv"
        path.write_text(row["text"])
        bearing = bearing_of(kept_rows(bearing_table(str(path))), SPRING)
    rows = np.array(row["rows"])
    size = np.repeat(np.abs(rows[:, 1:]).reshape(-1, 2, 4).max(axis=(0, 2)), 4)
    near, why = CLOSE * (size + np.repeat([SPRING, 0.0], 4)), ""
    for here, after in zip(rows, [*rows[1:], rows[-1]], strict=True):
        for part in np.linspace(0.0, 0.9, 10):
            at = float(here[0] + part * (after[0] - here[0]))
            ends = here[1:], (after if part else here)[1:]
            found = _columns(bearing.at(at))
            beyond = np.maximum(np.min(ends, 0) - found, found - np.max(ends, 0)) - near
            if beyond.max() > 0.0:
                name = COEFFICIENTS[int(beyond.argmax())]
                why = why or f"{name} at {at:.6g} rad/s is out by {beyond.max():.3g}"
            mirror = _columns(bearing.at(-at)) * [1, -1, -1, 1, 1, -1, -1, 1]
            if at > 0.0 and np.abs(mirror - found).max() > 0.0:
                why = why or f"no mirror image at {-at:.6g} rad/s"
    return {"held": not why, "why": why}


def _columns(support: Any) -> np.ndarray:
    """Return the eight coefficients of a support, with the spring that it replaces."""
    flip = np.diag([1.0, -1.0])
    pairs = (
        (support.stiffness + SPRING, support.stiffness_apart),
        (
            support.damping,
            support.damping_apart,
        ),
    )
    return np.concatenate([(planar(a) + planar(b) @ flip).ravel() for a, b in pairs])
