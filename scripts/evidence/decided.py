"""How long cases are undecided, whether words hold, and what `until = "decided"` costs.

    python scripts/evidence/decided.py [FILE] [--write]

Draws cells of the maps over 121 speeds (40 to 520 rad/s) and 41 gaps (0.08 to 0.4 mm)
of five engines: `rubbing` of `preset_map`, `four_motions`, the default,
`mostly_damped`, two of `words_hold`; and of `four_motions` with full rotation at
friction 0.15, where it rubs all round. Each is integrated in `draft` to 2.5, 5, 10 and
20 s, and has the word of a run of that length. Rows go to FILE (JSON
lines, resumable; default a temporary file). Prints the share of undecided at each time,
what words of earlier times
are at 20 s, and what is left undecided, and spent, by cases that end when they are
decided. With --write, the tables go to scripts/evidence/decided.md.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from hpcwhirl.campaign.simulate import Course
from hpcwhirl.case.resolve import resolve
from hpcwhirl.scene import apply_settings, named_scene, preset_inputs

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import kept, parser_of, share, table, working_folder
from evidence.preset_map import inputs_of
from evidence.words_hold import ENGINES, TOLD, told_of

PAGE = Path(__file__).with_suffix(".md")
TIMES = (2.5, 5.0, 10.0, 20.0)
SPEEDS, GAPS = np.linspace(40.0, 520.0, 121), np.geomspace(0.8e-4, 4e-4, 41)
WORDS = ("damped", "sustained", "divergent", "undecided")
TURNING = "four_motions, rotation full, friction 0.15"
CELLS = {
    "rubbing": 250, "four_motions": 250, "diverging, 22 blades": 60,
    "mostly_damped": 60, "light ring, 12 blades": 60, TURNING: 60,
}  # fmt: skip
SEED = 16
FORM = "{0} ({2:.1%}; {3})"  # of a share
Row = dict[str, Any]


def engines() -> dict[str, dict[str, Any]]:
    """Return {name: inputs by which an engine differs from `mostly_damped`}."""
    own = {name: inputs_of(name) for name in ("rubbing", "four_motions")}
    own["mostly_damped"] = {}
    own[TURNING] = own["four_motions"] | {"rotation": "full", "friction": 0.15}
    return own | {name: ENGINES[name] for name in CELLS if name not in own}


def drawn() -> list[Row]:
    """Return the cells of all engines, without repetition, engines in turn."""
    out: list[tuple[float, Row]] = []
    for name, count in CELLS.items():
        random = np.random.default_rng(SEED)
        cells = random.choice(len(SPEEDS) * len(GAPS), count, replace=False)
        for place, cell in enumerate(cells):
            speed, gap = SPEEDS[cell // len(GAPS)], GAPS[cell % len(GAPS)]
            row = {"engine": name, "speed": float(speed), "gap": float(gap)}
            out.append((place / count, row))
    return [row for _, row in sorted(out, key=lambda pair: pair[0])]


def judged(cell: Row) -> Row:
    """Return the words of a cell at all times, and processor seconds until each."""
    inputs = engines()[cell["engine"]] | preset_inputs("draft")
    inputs |= {"speed": cell["speed"], "gap": cell["gap"], "traces": "summary"}
    words, seconds = [], []
    for duration in TIMES:
        given = inputs | {"duration": duration}
        course = Course(resolve(apply_settings(named_scene("mostly_damped"), given)))
        course.march.warm()
        start = time.process_time()
        words.append(str(course.run().row["regime"]))
        seconds.append(time.process_time() - start)
    return {"words": words, "seconds": seconds}


def falling(rows: list[Row]) -> list[str]:
    """Return the table of undecided cases at each time."""
    out = []
    for engine in CELLS:
        words = [row["words"] for row in rows if row["engine"] == engine]
        counts = [sum(w[i] == "undecided" for w in words) for i in range(len(TIMES))]
        out.append([engine, len(words), *(share(n, len(words), FORM) for n in counts)])
    return table(["engine", "cells", *(f"{t:g} s" for t in TIMES)], out)


def later(rows: list[Row]) -> list[str]:
    """Return the table of what words of earlier times are at the last."""
    out = []
    for engine in CELLS:
        words = [row["words"] for row in rows if row["engine"] == engine]
        for place, at in enumerate(TIMES[:-1]):
            for word in WORDS[:3]:
                last = Counter(w[-1] for w in words if w[place] == word)
                if last:
                    out.append([engine, f"{at:g} s", word, *told_of(last, word)])
    return table(["engine", "at", "word", *TOLD], out)


def at_decision(row: Row) -> int:
    """Return the place of the time at which a case that is to be decided ends."""
    decided = [place for place, word in enumerate(row["words"]) if word != "undecided"]
    return decided[0] if decided else len(TIMES) - 1


def ending(rows: list[Row]) -> list[str]:
    """Return the table of cases that go on until they are decided, 20 s at most."""
    heads = ["engine", "undecided at 2.5 s", "undecided at the end"]
    heads += ["engine time, over 2.5 s each", "processor time, over that of 2.5 s"]
    heads += ["words of after 2.5 s", "another word at 20 s"]
    out = []
    for engine in CELLS:
        own = [row for row in rows if row["engine"] == engine]
        ends = [at_decision(row) for row in own]
        lasted = sum(TIMES[end] for end in ends) / (TIMES[0] * len(own))
        spent = sum(row["seconds"][end] for row, end in zip(own, ends, strict=True))
        spent /= sum(row["seconds"][0] for row in own)
        late = [row for row, end in zip(own, ends, strict=True) if end]
        words = [(row["words"][at_decision(row)], row["words"][-1]) for row in late]
        found = [pair for pair in words if pair[0] != "undecided"]
        changed = Counter(f"{a} to {b}" for a, b in found if a != b)
        told = ", ".join(f"{n} {what}" for what, n in changed.items()) or "0"
        first = sum(row["words"][0] == "undecided" for row in own)
        left = sum(a == "undecided" for a, _ in words)
        shares = (share(n, len(own), FORM) for n in (first, left))
        out.append([engine, *shares, f"{lasted:.2f}", f"{spent:.2f}", len(found), told])
    return table(heads, out)


def page(rows: list[Row]) -> str:
    """Return all tables, as Markdown."""
    told = (
        "Written by `python scripts/evidence/decided.py --write`: cells drawn from the "
        "maps over 121 speeds (40 to 520 rad/s) and 41 gaps (0.08 to 0.4 mm) of five "
        "engines, one also with rotation, in `draft`; each marched to 20 s and judged "
        "at four times, as a run of that length is. Shares with their 95 % interval "
        "(Wilson)."
    )
    parts = [
        "# How long cases are undecided, and whether words hold",
        told,
        "## Undecided cases",
        "\n".join(falling(rows)),
        '## With `until = "decided"`, `longest = 20`',
        "\n".join(ending(rows)),
        "## What words are at 20 s",
        "\n".join(later(rows)),
    ]
    return "\n\n".join(parts) + "\n"


def main() -> int:
    """Compute what is missing, print the tables, write them if wanted."""
    parser = parser_of(__doc__, write=PAGE)
    parser.add_argument("file", nargs="?", type=Path)
    args = parser.parse_args()
    with working_folder(None, "decided") as place:
        file = args.file or place / "rows.jsonl"
        text = page(kept(file, drawn(), judged))
    print(text)
    if args.write:
        PAGE.write_text(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
