"""What presets promise, asked on features: a table and texts.

    python scripts/evidence/promises.py [FILE] [--count N] [--write]

The cases are those of the claim `promises` (`populations/promises.py`); their rows are
kept in FILE (default a temporary one) and not computed again. A line tells of a feature
and a preset in how many cases the word is that of the finer run, and the radius and the
contact impulse are within what the preset states of nine engines in ten; and the same
of the cases of which the preset's estimate is sure. --write puts the table into
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
from evidence.populations.promises import COUNT, FEATURES, LONG, PRESETS, SHORT
from evidence.presets import PATH, write

from hpcwhirl.scene import preset_bounds

PAGE = Path(__file__).with_suffix(".md")
SEED = 45
OFTEN = 0.8  # share of a feature's cases below which a preset names it
NAMES = {"orbit_radius": "radius", "contact_impulse": "contact impulse"}
HEAD = (
    "feature", "preset", "cases", "word", *NAMES.values(), "radius off, median", "sure",
    "word and radius of these",
)  # fmt: skip
Row = dict[str, Any]


def within(row: Row, preset: str, number: str) -> bool:
    """Return whether a number of a case is within what a preset states."""
    return bool(row["errors"][preset][number] <= preset_bounds(preset)[number])


def kept_of(rows: list[Row], preset: str) -> tuple[int, int]:
    """Return of how many cases a preset is sure; in how many of them it is right."""
    sure = [row for row in rows if row["sure"][preset]]
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
    seldom = []
    for feature in FEATURES:
        own = [row for row in rows if row["scene"]["feature"] == feature]
        good = sum(within(row, preset, "orbit_radius") for row in own)
        if own and good < OFTEN * len(own):
            name = feature if feature != "none" else "no feature"
            seldom.append(f"{name} {good} of {len(own)}")
    right = of(sum(row["same"][preset] for row in rows))
    sure, kept = kept_of(rows, preset)
    return (
        f"with features on small engines, {SHORT:g} and {LONG:g} s: word as a finer "
        f"run in {right}, {', '.join(held)}; both word and radius in {kept} of {sure} "
        "of which estimate = all says so (same word, 3 radius_error within that)"
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
    return "\n".join([told, "", *table(HEAD, lines)])


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
