"""Which of the paper's motions survive with all that rotation adds.

    python scripts/paper/rotation.py [--step DT] [--duration S] [--out DIR]

marches 51 speeds of `four_motions` at four frictions, the paper's four motions among
them, with rotation none and full, those that rub all round once more for four times as
long, and writes `rotation.md` beside this file. The campaigns lie in DIR (default: one
that is removed) and go on where they were stopped.
"""

from __future__ import annotations

import itertools
import sys
from collections import Counter
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import Row, completed, parser_of, table, tell, working_folder

from hpcwhirl.analysis.rotation import critical_of, rotation_of_case
from hpcwhirl.case.resolve import resolve
from hpcwhirl.scene import Scene, apply_settings, named_scene
from hpcwhirl.store.reading.results_file import Results

PAPER = {520.0: "damped", 410.0: "sustained", 270.0: "divergent", 420.0: "divergent"}
FRICTIONS = (0.1, 0.2)
SPEEDS = [float(speed) for speed in range(20, 521, 10)]
MAPPED = (0.05, 0.1, 0.15, 0.2)  # frictions
RUBBING, LONGER = 0.15, 4  # friction of rubs all round; durations that words must hold
KINDS = ("none", "full")
TOLD = ("damped", "sustained", "divergent", "undecided")
Rows = dict[tuple[Any, ...], Row]  # by friction, rotation, speed
PAGE = Path(__file__).with_name("rotation.md")


def scene_of(speed: float, friction: float, rotation: str, args: Any) -> Scene:
    """Return a case."""
    given = {
        "engine.rotation": rotation, "solver.scheme": "modal", "speed": speed,
        "friction": friction, "duration": args.duration, "solver.time_step": args.step,
    }  # fmt: skip
    return apply_settings(named_scene("table2"), given)


def told(row: Row) -> str:
    """Return what a case did, in a cell."""
    word = row["regime"]
    if word == "damped":
        return f"damped, last contact {row['last_contact']:.2f} s"
    size = row["orbit_radius"] / row["gap"]
    return f"{word} {row['whirl']}, {size:.2g}, {row['line_frequency']:.0f}"


def marched(folder: Path, args: Any, times: int, sweep: dict[str, Any]) -> Rows:
    """Return rows of a campaign of so many durations, continued or computed."""
    tables = {
        "scene": {"duration": times * args.duration},
        "engine": {"name": "four_motions"},
        "solver": {"time_step": args.step},
        "output": {"traces": "summary"},
        "sweep": {**sweep, "speed": SPEEDS},
    }
    cases = Results(completed(tables, folder))
    names = "friction", "rotation", "speed"
    return {tuple(cases.value(i, n) for n in names): row
            for i, row in enumerate(cases.rows)}  # fmt: skip


def at_paper(rows: Rows) -> list[str]:
    """Return the paper's motions as Markdown, and how many words are the paper's."""
    same, lines = dict.fromkeys(KINDS, 0), []
    for friction, (speed, word) in itertools.product(FRICTIONS, PAPER.items()):
        own = {kind: rows[friction, kind, speed] for kind in KINDS}
        paper = word if friction == FRICTIONS[0] else "-"
        start = f"{speed:g}", paper, f"{friction:g}"
        lines.append([*start, *map(told, own.values())])
        for kind, row in own.items():
            same[kind] += row["regime"] == paper
    counts = (
        f"Of the paper's words at friction {FRICTIONS[0]:g}, {same['none']} are those "
        f"of none and {same['full']} those of full."
    )
    head = "speed, rad/s", "the paper", "friction", *KINDS
    return [*table(head, lines), "", counts, ""]


def held(rows: Rows, longer: Rows, duration: float) -> str:
    """Return what words of rubs all round are in longer runs, as a sentence."""
    pairs = {key[-1]: (rows[key]["regime"], row["regime"])
             for key, row in longer.items()}  # fmt: skip
    same = Counter(one for one, other in pairs.values() if one == other)
    count = Counter(one for one, _ in pairs.values())
    told = ", ".join(f"{same[word]} of {count[word]} {word}" for word in TOLD)
    changed = [f"{speed:g} rad/s {one} to {other}"
               for speed, (one, other) in pairs.items() if one != other]  # fmt: skip
    return (
        f"At friction {RUBBING:g} with full rotation, in runs of "
        f"{LONGER * duration:g} s, the same are: {told}. Others: "
        f"{', '.join(changed) or 'none'}."
    )


def mapped(rows: Rows) -> list[str]:
    """Return the words over the speed as Markdown, by friction and rotation."""
    lines = []
    for friction, kind in itertools.product(MAPPED, KINDS):
        own = [rows[friction, kind, speed] for speed in SPEEDS]
        spans = []
        for word, group in itertools.groupby(own, _word):
            speeds = [row["speed"] for row in group]
            span = f"{speeds[0]:g}" + (f"–{speeds[-1]:g}" if len(speeds) > 1 else "")
            spans.append(f"{span} {word}")
        damped = sum(row["regime"] == "damped" for row in own)
        lines.append([f"{friction:g}", kind, damped, ", ".join(spans)])
    head = "friction", "rotation", "damped of 51", "speeds, rad/s"
    return table(head, lines)


def _word(row: Row) -> str:
    word = row["regime"]
    return "damped" if word == "damped" else f"**{word}** {row['whirl']}"


def facts_of(args: Any) -> list[str]:
    """Return what rotation does to free motion, as Markdown."""
    facts = [rotation_of_case(resolve(scene_of(speed, 0.1, "full", args)))
             for speed in sorted(PAPER)]  # fmt: skip
    eq13 = [
        next(row["speed"]
             for row in critical_of(resolve(scene_of(410.0, 0.1, kind, args)), 1)
             if (row["nodal_diameter"], row["family"]) == (1, "1F"))
        for kind in KINDS
    ]  # fmt: skip
    grown = [f"{1e3 * one['tip_growth']:.3f}" for one in facts]
    decay = [f"{-one['growth']:.2f}" for one in facts]
    unbalance = ", ".join(f"{s:.1f}" for s in facts[0]["unbalance_speeds"])
    eq13_told = (
        f"Eq. 13, k = 1, 1F: {eq13[0]:.1f} rad/s without, {eq13[1]:.1f} rad/s with "
        f"what rotation adds. An unbalance meets a wave at {unbalance} rad/s."
    )
    rows = [["tips are pulled out by, mm", *grown],
            ["free motion decays at least with, 1/s", *decay]]  # fmt: skip
    head = ["at a speed, rad/s", *(f"{speed:g}" for speed in sorted(PAPER))]
    return [*table(head, rows), "", eq13_told]


def main() -> None:
    """March all cases and write the page."""
    parser = parser_of(__doc__)
    parser.add_argument("--step", type=float, default=1e-6, help="time step, s")
    parser.add_argument("--duration", type=float, default=2.5, help="engine time, s")
    parser.add_argument("--out", type=Path, help="directory of the campaigns")
    args = parser.parse_args()
    sweep = {"rotation": [*KINDS], "friction": [*MAPPED]}
    with working_folder(args.out, "rotation") as folder:
        rows = marched(folder / "map", args, 1, sweep)
        rub = {"rotation": ["full"], "friction": [RUBBING]}
        longer = marched(folder / "longer", args, LONGER, rub)
    lines = [*at_paper(rows), "### Words over the speed", "", *mapped(rows), ""]
    lines += [held(rows, longer, args.duration), "", *facts_of(args)]
    tell("\n".join(lines), PAGE)


if __name__ == "__main__":
    main()
