"""Whether words of motions and intervals of exponents hold, on sustained cases.

    python scripts/evidence/motions.py [FILE] [--write]

Draws cases of the named engines and, with full rotation, of one that is also unbalanced
and turns in an oval casing, in their ranges of sustained speeds, in `draft`, until each
engine has `WANTED` sustained ones or `TRIED` were tried.
Each goes on beside a twin, first over `SHORT` revolutions, as `output.chaos` measures
it, then over 4 times as many, which do not overlap. Rows go to FILE (JSON lines,
resumable; default a temporary file). Prints how often the word is the same at both, and
how often the interval of the exponent holds that of the longer measurement; and for
each case the exponent with twins a hundred times farther apart. With --write, the
tables go to scripts/evidence/motions.md.
"""

from __future__ import annotations

import math
import sys
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from hpcwhirl.analysis import chaos as motion
from hpcwhirl.analysis.chaos import exponent, growths
from hpcwhirl.analysis.regimes import MotionThresholds
from hpcwhirl.analysis.rules import motion_of
from hpcwhirl.campaign.simulate import Course
from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.side_by_side import SideBySide
from hpcwhirl.scene import apply_settings, named_scene, preset_inputs

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import kept, parser_of, share, table, tell, working_folder

PAGE = Path(__file__).with_suffix(".md")
SHORT, LONGER, SETTLED = 100, 4, 10  # revolutions; times that; revolutions before
WANTED, TRIED, SEED = 9, 40, 32
DURATION = 1.5  # s
FORM = "{0} of {1} ({3})"  # of a share
FAR = 1e-7  # distance of the second twins
RANGES = {  # engine: speeds between which it is sustained, rad/s
    "four_motions": (375.0, 412.0),
    "mostly_damped": (405.0, 445.0),
    "forward_step": (345.0, 412.0),
    "steady_beside": (375.0, 412.0),
    "four_motions, rotation full": (150.0, 520.0),
    "four_motions, unbalanced": (350.0, 520.0),
    "four_motions, unbalanced in an oval": (350.0, 520.0),
}
TURNING = {"rotation": "full", "friction": 0.15}
Row = dict[str, Any]


def drawn() -> list[Row]:
    """Return the cases that are tried, engines in turn."""
    out = []
    for number in range(TRIED):
        for place, (name, (low, high)) in enumerate(RANGES.items()):
            random = np.random.default_rng([SEED, place, number])
            inputs = {"speed": random.uniform(low, high)}
            inputs["gap"] = 1.28e-4 * 2 ** random.uniform(-0.5, 1.0)
            if "rotation" not in name:
                inputs["friction"] = random.uniform(0.07, 0.15)
            if "unbalanced" in name:  # beyond the gap, and little friction
                inputs |= {"unbalance": random.uniform(2e-3, 2e-2), "gap": 1e-4,
                           "friction": random.uniform(0.0, 0.1)}  # fmt: skip
            if "oval" in name:
                size = random.uniform(1e-5, 6e-5)
                inputs["profile"] = f"harmonic,amplitude,phase;2,{size:.6g},0"
            out.append({"engine": name, "number": number, "inputs": inputs})
    return out


def scene_of(row: Row) -> Any:
    """Return the scene of a case."""
    name, _, turns = row["engine"].partition(", ")
    given = preset_inputs("draft") | {"traces": "summary", "duration": DURATION}
    own = (TURNING if turns else {}) | row["inputs"]
    return apply_settings(named_scene(name), given | own)


def measured(row: Row) -> Row:
    """Return a row with the regime and, of a sustained case, what was measured."""
    start = time.perf_counter()
    course = Course(resolve(scene_of(row)))
    result = course.run()
    found = row | {"regime": result.row["regime"]}
    found["marched"] = time.perf_counter() - start
    if found["regime"] != "sustained":
        return found
    march, speed = course.march, abs(result.row["speed"])
    turns = SETTLED + (1 + LONGER) * SHORT + 2
    twins = motion.twins_of(march, turns)
    if twins is None:
        return found | {"regime": "one sector of many"}
    growth = growths(twins, motion.DELTA, twins.intervals)
    if twins.ended or not np.isfinite(growth).all():
        return found | {"regime": "ended"}
    points = motion.section_of(twins.one.history().judged, speed, twins.first_row)
    each = 2 * math.pi / speed / twins.interval  # intervals of a revolution
    for name, first, last in (
        ("short", SETTLED, SETTLED + SHORT),
        ("long", SETTLED + SHORT, SETTLED + (1 + LONGER) * SHORT),
    ):
        part = growth[int(first * each) : int(last * each)]
        numbers = motion.numbers_of(part, twins.interval, points[first:last])
        told = motion_of(result.row | numbers, asdict(MotionThresholds()))
        found[name] = numbers | {"word": told}
    found["seconds"] = time.perf_counter() - start - found["marched"]
    return found | {"far": _with_far_twins(march, twins.interval, 2 * math.pi / speed)}


def _with_far_twins(march: Any, interval: float, turn: float) -> float:
    """Return the exponent of the short measurement with twins farther apart, 1/s."""
    twins = SideBySide(march, interval, (SETTLED + SHORT) * turn, FAR)
    growth = growths(twins, FAR, twins.intervals)
    return exponent(growth[int(SETTLED * turn / interval) :], twins.interval).rate


def computed(path: Path) -> list[Row]:
    """Return the rows of the file, with those that are still wanted added to it."""
    found: Counter[str] = Counter()  # sustained ones of each engine

    def wanted() -> Iterator[Row]:
        for row in drawn():
            if found[row["engine"]] < WANTED:
                yield row

    def told(row: Row) -> None:
        found[row["engine"]] += "long" in row
        words = [row[n]["word"] for n in ("short", "long") if n in row]
        print(row["engine"], row["inputs"], row["regime"], *words, flush=True)

    return kept(path, wanted(), measured, told)


def tables(rows: list[Row]) -> str:
    """Return the tables of the page."""
    good = [row for row in rows if "long" in row]
    return "\n\n".join([_words(good), _intervals(good), _cases(good)])


def _words(rows: list[Row]) -> str:
    lines = []
    for word in sorted({row["short"]["word"] for row in rows}):
        own = [row["long"]["word"] for row in rows if row["short"]["word"] == word]
        others = Counter(own) - Counter({word: len(own)})
        lines.append([
            word, str(len(own)), share(own.count(word), len(own), FORM),
            ", ".join(f"{n} {w}" for w, n in others.items()) or "none",
        ])  # fmt: skip
    told = [row for row in rows if row["short"]["word"] != "untold"]
    right = sum(row["long"]["word"] in {row["short"]["word"], "untold"} for row in told)
    share_told = share(right, len(told), FORM) + " or untold"
    lines.append(["all but untold", str(len(told)), share_told, ""])
    head = ["word", "cases", f"the same over {LONGER} times as long", "others"]
    return "\n".join(table(head, lines))


def _intervals(rows: list[Row]) -> str:
    pairs = [(row["short"], row["long"]) for row in rows]
    apart = [(abs(a["exponent"] - b["exponent"]), a["exponent_error"],
              b["exponent_error"]) for a, b in pairs]  # fmt: skip
    held = [miss <= own for miss, own, _ in apart]
    both = sum(miss <= math.hypot(own, other) for miss, own, other in apart)
    of_word = {word: [h for h, (a, _) in zip(held, pairs, strict=True)
                      if a["word"] == word]
               for word in sorted({a["word"] for a, _ in pairs})}  # fmt: skip
    far = max(abs(row["far"] - row["short"]["exponent"])
              / row["short"]["exponent_error"] for row in rows)  # fmt: skip
    turns = 2 * (SETTLED + (1 + LONGER) * SHORT) + 2 * (SETTLED + SHORT)
    cost = np.median([
        row["seconds"] / (turns * 2 * math.pi / row["inputs"]["speed"])
        / (row["marched"] / DURATION) for row in rows
    ])  # fmt: skip
    lines = [
        [
            "longer exponent within the shorter one's interval",
            share(sum(held), len(rows), FORM),
        ],
        *(
            [f"of these {word}", share(sum(own), len(own), FORM)]
            for word, own in of_word.items()
        ),
        ["within both intervals together", share(both, len(rows), FORM)],
        [f"change with twins {FAR:g} apart, over the interval, largest", f"{far:.2g}"],
        ["time of a twin's second over that of the case, median", f"{cost:.2f}"],
    ]
    return "\n".join(table(["", ""], lines))


def _cases(rows: list[Row]) -> str:
    lines = []
    for row in rows:
        turn = 2 * math.pi / row["inputs"]["speed"]
        line = [row["engine"], f"{row['inputs']['speed']:.1f}",
                f"{1e3 * row['inputs']['gap']:.3f}"]  # fmt: skip
        for name in ("short", "long"):
            own = row[name]
            rate, error = own["exponent"] * turn, own["exponent_error"] * turn
            line += [f"{rate:.4f} ± {error:.4f}",
                     f"{own['period']}: {own['return_distance']:.2g}",
                     f"{own.get('zero_one', math.nan):.2f}", own["word"]]  # fmt: skip
        lines.append(line)
    head = ["engine", "rad/s", "gap, mm"]
    for name in (str(SHORT), str(LONGER * SHORT)):
        head += [f"exponent a revolution, {name}", "period: distance", "K", "word"]
    return "\n".join(table(head, lines))


def main() -> None:
    """Measure what is missing, print the tables, write the page if asked to."""
    parser = parser_of(__doc__, write=PAGE)
    parser.add_argument("file", nargs="?", type=Path)
    args = parser.parse_args()
    with working_folder(None, "motions") as folder:
        text = tables(computed(args.file or folder / "motions.jsonl"))
    tell(text, PAGE if args.write else None)


if __name__ == "__main__":
    main()
