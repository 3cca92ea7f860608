"""What presets promise, asked on features: a table and texts.

    python scripts/evidence/promises.py [FILE] [--count N] [--write]

The cases are those of the claim `promises` (`populations/promises.py`); their rows are
kept in FILE (default a temporary one) and not computed again. A line tells of a feature
and a preset in how many cases the word is that of the finer run, and the radius and the
contact impulse are within what the preset states of nine engines in ten; and the same
of the cases of which the preset's estimate is sure; a second table, how often that is
right if the estimate must be smaller by other factors. --write puts the tables into
scripts/evidence/promises.md, and a sentence on each preset, with the features on which
it holds least, into hpcwhirl/scene/presets.toml.
"""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import parser_of, share, table, tell, working_folder
from evidence.claims import judge
from evidence.populations.promises import (
    COUNT,
    FEATURES,
    LONG,
    PRESETS,
    SHORT,
    TIMES,
    is_sure,
)
from evidence.presets import PATH, write

from hpcwhirl.scene import preset_bounds

PAGE = Path(__file__).with_suffix(".md")
SEED = 45
OFTEN = 0.8  # share of a feature's cases below which a preset names it
ENOUGH = 0.95  # share of a preset's sure cases that must be right, or it says so
FACTORS = 1.0, TIMES, 10.0, 30.0  # bound of the radius / least estimate that is sure
NAMES = {"orbit_radius": "radius", "contact_impulse": "contact impulse"}
HEAD = (
    "feature", "preset", "cases", "word", *NAMES.values(), "radius off, median", "sure",
    "word and radius of these",
)  # fmt: skip
Row = dict[str, Any]


def within(row: Row, preset: str, number: str) -> bool:
    """Return whether a number of a case is within what a preset states."""
    return bool(row["errors"][preset][number] <= preset_bounds(preset)[number])


def kept_of(rows: list[Row], preset: str, times: float = TIMES) -> tuple[int, int]:
    """Return of how many cases a preset is sure; in how many of them it is right."""
    sure = [row for row in rows if is_sure(row["rows"][preset], preset, times)]
    right = [r for r in sure if r["same"][preset] and within(r, preset, "orbit_radius")]
    return len(sure), len(right)


def line_of(feature: str, preset: str, rows: list[Row]) -> list[str]:
    """Return the line of the table on some cases with a preset."""
    off = float(np.median([row["errors"][preset]["orbit_radius"] for row in rows]))
    held = [sum(within(row, preset, number) for row in rows) for number in NAMES]
    same = sum(row["same"][preset] for row in rows)
    counts = [len(rows), same, *held, f"{100 * off:.2g} %", *kept_of(rows, preset)]
    return [feature, preset, *map(str, counts)]


def text_of(preset: str, rows: list[Row]) -> str:
    """Return a sentence: how often a preset holds, and on which features seldom."""
    bounds, count = preset_bounds(preset), len(rows)

    def of(number: int) -> str:
        return share(number, count, "{0} of {1} ({3})")

    held = [
        f"{name} within {100 * bounds[number]:g} % in "
        + of(sum(within(row, preset, number) for row in rows))
        for number, name in NAMES.items()
    ]
    seldom, wrong = [], []
    for feature in FEATURES:
        own = [row for row in rows if row["scene"]["feature"] == feature]
        name = feature if feature != "none" else "no feature"
        good = sum(within(row, preset, "orbit_radius") for row in own)
        if own and good < OFTEN * len(own):
            seldom.append(f"{name} {good} of {len(own)}")
        sure, kept = kept_of(own, preset)
        if kept < ENOUGH * sure:
            wrong.append(f"{name} {kept} of {sure}")
    right = of(sum(row["same"][preset] for row in rows))
    sure, kept = kept_of(rows, preset)
    return (
        f"with features on small engines, {SHORT:g} and {LONG:g} s: word as a finer "
        f"run in {right}, {', '.join(held)}; both word and radius in "
        f"{share(kept, sure, '{0} of {1} ({3})')} of which estimate = all says so "
        f"(same word, {TIMES:g} radius_error within that)"
        + (
            f", too few to rely on it: {', '.join(wrong)}"
            if kept < ENOUGH * sure
            else ""
        )
        + (f"; the radius is so least with {', '.join(seldom)}" if seldom else "")
    )


def measured(rows: list[Row], left: int) -> str:
    """Return the text of the page: a table by feature, and of all together.

    rows, left : the cases that were asked; how many more were drawn
    """
    parts = {
        name: [row for row in rows if row["scene"]["feature"] == name]
        for name in FEATURES
    }
    for lasts in (SHORT, LONG):
        own = [row for row in rows if row["scene"]["inputs"]["duration"] == lasts]
        parts[f"all of {lasts:g} s"] = own
    parts["all"] = rows
    lines = [line_of(name, preset, own) for name, own in parts.items() if own
             for preset in PRESETS]  # fmt: skip
    told = f"{len(rows)} cases of seed {SEED}; {left} more touched nothing."
    further = table(("sure if the stated radius is at least", *PRESETS), factors(rows))
    return "\n".join([told, "", *table(HEAD, lines), "", *further])


def factors(rows: list[Row]) -> list[list[str]]:
    """Return a line for each of `FACTORS`: how often what a preset is sure of holds."""
    lines = []
    for times in FACTORS:
        both = [kept_of(rows, preset, times) for preset in PRESETS]
        own = [share(kept, sure, "{0} of {1} ({3})") for sure, kept in both]
        lines.append([f"{times:g} radius_error", *own])
    return lines


def main() -> int:
    """Measure, print, write."""
    parser = parser_of(__doc__, write=PAGE)
    parser.add_argument("file", type=Path, nargs="?")
    parser.add_argument("--count", type=int, default=COUNT)
    args = parser.parse_args()
    with working_folder(None, "promises") as folder:
        found = judge("promises", args.count, SEED, args.file or folder / "rows.jsonl")
    rows = [row for row in found if "errors" in row]
    tell(measured(rows, len(found) - len(rows)), PAGE if args.write else None)
    if args.write:
        presets = tomllib.loads(PATH.read_text())
        own = {name: {"features": text_of(name, rows)} for name in PRESETS}
        write({name: own.get(name, {}) | row | own.get(name, {})
               for name, row in presets.items()})  # fmt: skip
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
