"""Which of the paper's motions survive with all that rotation adds.

    python scripts/paper/rotation.py [--step DT] [--duration S] [--out DIR]

marches the paper's four motions of `four_motions` and then 51 speeds at four frictions,
with rotation none and full, those that rub all round once more for four times as long,
and writes `rotation.md` beside this file. The campaigns lie in DIR (default: one that
is removed) and go on where they were stopped.
"""

from __future__ import annotations

import itertools
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import completed, parser_of, working_folder

from hpcwhirl import open_results
from hpcwhirl.analysis.rotation import critical_of, rotation_of_case
from hpcwhirl.campaign.simulate import simulate
from hpcwhirl.case.resolve import resolve
from hpcwhirl.scene import Scene, apply_settings, named_scene
from hpcwhirl.store.reading.reader import words

PAPER = {520.0: "damped", 410.0: "sustained", 270.0: "divergent", 420.0: "divergent"}
FRICTIONS = (0.1, 0.2)
SPEEDS = [float(speed) for speed in range(20, 521, 10)]
MAPPED = (0.05, 0.1, 0.15, 0.2)  # frictions
RUBBING, LONGER = 0.15, 4  # friction of rubs all round; durations that words must hold
KINDS = ("none", "full")
TOLD = ("damped", "sustained", "divergent", "undecided")
PAGE = Path(__file__).with_name("rotation.md")
HEAD = """# The four motions with all that rotation adds

`python scripts/paper/rotation.py --step {step:g} --duration {duration:g}` wrote this
page. `four_motions`, k = 1, gap 0.128 mm (the clearance at speed), {duration:g} s,
scheme modal with steps of {step:g} s: central differences for `none`, exact waves for
`full`. Word, then orbit radius over the gap and strongest line, rad/s, static frame,
forward positive; the seconds are those of the last contact.

| speed, rad/s | the paper | friction | none | full |
|---|---|---|---|---|
"""
TAIL = """
| at a speed, rad/s | {speeds} |
|---|{rules}|
| tips are pulled out by, mm | {grown} |
| free motion decays at least with, 1/s | {decay} |

Eq. 13, k = 1, 1F: {none:.1f} rad/s without, {full:.1f} rad/s with what rotation adds.
An unbalance meets a wave at {unbalance} rad/s. The gap is that at speed: without wear
or cooling, tips at rest stand as much farther from the casing as they are pulled out.
"""


def scene_of(speed: float, friction: float, rotation: str, args: Any) -> Scene:
    """Return a case."""
    given = {
        "engine.rotation": rotation, "solver.scheme": "modal", "speed": speed,
        "friction": friction, "duration": args.duration, "solver.time_step": args.step,
    }  # fmt: skip
    return apply_settings(named_scene("table2"), given)


def told(row: dict[str, Any]) -> str:
    """Return what a case did, in a cell."""
    word = row["regime"]
    if word == "damped":
        return f"damped, last contact {row['last_contact']:.2f} s"
    size = row["orbit_radius"] / row["gap"]
    return f"{word} {row['whirl']}, {size:.2g}, {row['line_frequency']:.0f}"


def marched(folder: Path, args: Any, times: int, sweep: dict[str, Any]) -> Any:
    """Return results of a campaign of so many durations, continued or computed."""
    tables = {
        "scene": {"duration": times * args.duration},
        "engine": {"name": "four_motions"},
        "solver": {"time_step": args.step},
        "output": {"traces": "summary"},
        "sweep": {**sweep, "speed": SPEEDS},
    }
    return open_results(completed(tables, folder))


def held(folder: Path, args: Any, data: Any) -> str:
    """Return what words of rubs all round are in longer runs, as a sentence."""
    sweep = {"rotation": ["full"], "friction": [RUBBING]}
    longer = words(marched(folder, args, LONGER, sweep).regime)
    own = (data.friction.values == RUBBING) & (words(data.rotation) == "full")
    first = words(data.regime)[own]
    same = [int((longer[first == word] == word).sum()) for word in TOLD]
    counts = [int((first == word).sum()) for word in TOLD]
    changed = [
        f"{speed:g} rad/s {one} to {other}"
        for speed, one, other in zip(SPEEDS, first, longer, strict=True)
        if one != other
    ]
    told = ", ".join(
        f"{n} of {count} {word}"
        for n, count, word in zip(same, counts, TOLD, strict=True)
    )
    return (
        f"\nAt friction {RUBBING:g} with full rotation, in runs of "
        f"{LONGER * args.duration:g} s, the same are: {told}. Others: "
        f"{', '.join(changed) or 'none'}.\n"
    )


def mapped(folder: Path, args: Any) -> str:
    """Return the words over the speed, as Markdown; a line for each friction and kind.

    folder : of the campaigns, which are computed or continued there
    """
    sweep = {"rotation": [*KINDS], "friction": [*MAPPED]}
    data = marched(folder / "map", args, 1, sweep)
    regime, whirl = words(data.regime), words(data.whirl)
    lines = [
        "| friction | rotation | damped of 51 | speeds, rad/s |",
        "|---|---|---|---|",
    ]
    for friction, kind in itertools.product(MAPPED, KINDS):
        own = (data.friction.values == friction) & (words(data.rotation) == kind)
        found = list(zip(SPEEDS, regime[own], whirl[own], strict=True))
        told = []
        for word, group in itertools.groupby(found, lambda one: _word(*one[1:])):
            speeds = [one[0] for one in group]
            span = f"{speeds[0]:g}" + (f"–{speeds[-1]:g}" if len(speeds) > 1 else "")
            told.append(f"{span} {word}")
        damped = int((regime[own] == "damped").sum())
        lines.append(f"| {friction:g} | {kind} | {damped} | {', '.join(told)} |")
    return "\n".join(lines) + "\n" + held(folder / "longer", args, data)


def _word(regime: str, whirl: str) -> str:
    return regime if regime == "damped" else f"**{regime}** {whirl}"


def facts_of(args: Any) -> dict[str, Any]:
    """Return what the foot of the page tells."""
    cases = [resolve(scene_of(speed, 0.1, "full", args)) for speed in sorted(PAPER)]
    facts = [rotation_of_case(case) for case in cases]
    speeds = {
        kind: next(
            row["speed"]
            for row in critical_of(resolve(scene_of(410.0, 0.1, kind, args)), 1)
            if (row["nodal_diameter"], row["family"]) == (1, "1F")
        )
        for kind in ("none", "full")
    }
    return speeds | {
        "speeds": " | ".join(f"{speed:g}" for speed in sorted(PAPER)),
        "rules": "---|" * (len(PAPER) - 1) + "---",
        "grown": " | ".join(f"{1e3 * one['tip_growth']:.3f}" for one in facts),
        "decay": " | ".join(f"{-one['growth']:.2f}" for one in facts),
        "unbalance": ", ".join(f"{s:.1f}" for s in facts[0]["unbalance_speeds"]),
    }


def main() -> None:
    """March all cases and write the page, a row after the other."""
    parser = parser_of(__doc__)
    parser.add_argument("--step", type=float, default=1e-6, help="time step, s")
    parser.add_argument("--duration", type=float, default=2.5, help="engine time, s")
    parser.add_argument("--out", type=Path, help="directory of the campaigns")
    args = parser.parse_args()
    text = HEAD.format(step=args.step, duration=args.duration)
    same = dict.fromkeys(KINDS, 0)
    for friction in FRICTIONS:
        for speed, word in PAPER.items():
            rows = {
                kind: simulate(scene_of(speed, friction, kind, args)).row
                for kind in same
            }
            if friction == FRICTIONS[0]:
                for kind, row in rows.items():
                    same[kind] += row["regime"] == word
            cells = [told(row) for row in rows.values()]
            paper = word if friction == FRICTIONS[0] else "-"
            line = f"| {speed:g} | {paper} | {friction:g} | {' | '.join(cells)} |\n"
            print(line, end="", flush=True)
            text += line
    text += f"\nOf the paper's words at friction {FRICTIONS[0]:g}, "
    text += f"{same['none']} are those of none and {same['full']} those of full.\n"
    text += "\n## Words over the speed\n\n"
    with working_folder(args.out, "rotation") as folder:
        text += mapped(folder, args)
    PAGE.write_text(text + TAIL.format(**facts_of(args)), encoding="utf-8")
    print(PAGE)


if __name__ == "__main__":
    main()
