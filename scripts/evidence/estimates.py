"""Whether estimates of truncation, accuracy, presets, rotation hold on random engines.

    python scripts/evidence/estimates.py [DIR] [--write]
        [--only truncation|accuracy|presets|rotation|kept|presets_full|presets_late]

Draws engines (see estimates_drawn.py), measures what each estimate speaks of and prints
a table: estimate, class, drawn, held, share, median and worst ratio of what was found
to what was stated. What is measured is kept in DIR (default a temporary folder), a line
an engine, and not measured again. --write puts the tables into
scripts/evidence/estimates.md and what presets lose into hpcwhirl/scene/presets.toml;
what --only leaves out stays there as it was.
Exit code 1 if an estimate of truncation or accuracy holds in less than 95 % of a class
of at least 20, or if without the terms that `auto` leaves out a sure word changes, or
words that are chance come with other frequencies.

truncation: error of all tips' motion in the first 2 ms, root mean square over that of
the motion, against all modes (8 a blade, 80 harmonics), for parts left out of one body
or as `solver.truncation` chooses; stated is the estimate, or what was asked for. What
has hardly touched by then (blades and steps of 1 us) is a class of its own, too.
accuracy: largest error of a rotor mode's damped frequency, from the eigenvalues of a
step; stated is `solver.accuracy`. presets: words and numbers after 1 s against a finer
run (scheme exact, the step of `reference`, 80 harmonics), twins whose force differs by
1e-7 beside them; stated is what presets.toml says of nine engines in ten.
presets_full: the same with all terms of rotation. presets_late: the same on small
engines with a film, a layer, a run-up, a closing gap, a rising or released oval, or
several points a tip (see `of_late_features`). rotation: words without the terms that
`auto` leaves out, against those with them, of engines that touch; beside them words
without the terms in the basis that those with them have, and twins with the terms, in
force as above, and in the blades' frequencies by as much as the terms change.
`sure`: where a case without the terms and three twins, whose force differs by 1e-5 and
2e-5, have the same word, and those with the terms, too, undecided included. Where they
do not, the word is `chance`: held are those of which a permutation test cannot tell the
words of a case and 7 twins without the terms from those with them (p >= 0.05 over the
number of such engines). kept: the same of
terms that `auto` keeps; `sure`: where neither word is undecided, and a twin in force
agrees.
"""

from __future__ import annotations

import itertools
import sys
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hpcwhirl.scene import preset_bounds, preset_names

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import kept, parser_of, table, with_section, working_folder
from evidence.estimates_drawn import MEASURES, NUMBERS
from evidence.presets import PATH, write

PAGE = Path(__file__).with_suffix(".md")
# {what: seed, engines drawn}; others, once it was changed
PLANS = {
    "truncation": (17, 120), "accuracy": (15, 120), "presets": (17, 60),
    "rotation": (32, 60), "kept": (32, 60), "presets_full": (17, 12),
    "presets_late": (7, 40),
}  # fmt: skip
LEAST, ENOUGH = 20, 0.95  # rows of a class of which a share is asked
TOUCHED = 20  # contacts of blades and steps: below, a motion has hardly begun to touch
HARDLY = f"fewer than {TOUCHED} contacts"
WAYS = {"none": "words", "terms": "in one basis", "twins": "twins",
        "detuned": "detuned"}  # fmt: skip
LEFT_OUT = "rotation: left out, words"
ALL_ASKED = (LEFT_OUT, "sure"), (LEFT_OUT, "chance")  # which all must hold
DOUBT = 0.05  # probability of a difference by chance, in any of the engines
SHUFFLES = 20_000
FULL = "with rotation full, "
HEAD = ("estimate", "class", "drawn", "held", "share", "median ratio", "worst ratio")
TENTH = 0.9  # of engines, of which presets tell the largest error
Record = dict[str, Any]


@dataclass(frozen=True)
class Line:
    """One line of the table; ratios are of what was found to what was stated."""

    estimate: str
    kind: str
    drawn: int
    held: int
    median: float
    worst: float

    @property
    def share(self) -> float:
        """Share of the drawn in which the estimate held."""
        return self.held / self.drawn


def measured(name: str, folder: Path) -> list[Record]:
    """Return the records of all engines of one of `PLANS`, measured or kept."""
    seed, count = PLANS[name]
    places = ({"index": index} for index in range(count))
    file = folder / f"{name}-{seed}.jsonl"
    return kept(file, places, lambda one: MEASURES[name](seed, one["index"]))


def _among(value: float, limits: tuple[float, float]) -> str:
    """Return in words which side of two limits a value lies, or between."""
    low, high = limits
    if value < low:
        return f"< {low:g}"
    return f">= {high:g}" if value >= high else f"{low:g}-{high:g}"


def classes(record: Record) -> Iterator[str]:
    """Return the classes that an engine is of."""
    inputs = record["inputs"]
    blades, k = inputs["blades"], inputs.get("nodal_diameter", 1)
    friction = "no friction" if inputs.get("friction", 0.1) == 0.0 else "friction"
    thickness, damping = inputs.get("casing.thickness"), inputs["rotor.damping"]
    if record.get("contacts", TOUCHED) < TOUCHED:
        yield HARDLY
    yield "all"
    yield "N " + ("12-19" if blades < 20 else "20-27" if blades < 28 else "28-36")
    yield f"rotor damping {'< 1 %' if damping < 0.01 else '>= 1 %'}"
    if thickness is None:
        return
    ring = inputs["casing.damping"]
    yield f"k {k}, {friction}"
    yield "ring " + _among(1e3 * thickness, (12, 25)) + " mm"
    yield "ring " + _among(inputs["casing.width"], (0.15, 0.3)) + " m wide"
    yield f"ring damping {'< 3 %' if ring < 0.03 else '>= 3 %'}"


def lines(estimate: str, rows: list[tuple[Record, float]]) -> list[Line]:
    """Return a line for each class of (engine, found over stated)."""
    by_class: dict[str, list[float]] = {}
    for record, ratio in rows:
        for kind in classes(record):
            by_class.setdefault(kind, []).append(ratio)
    order = sorted(by_class, key=lambda kind: (kind != "all", kind))
    return [_line(estimate, kind, by_class[kind]) for kind in order]


def _line(estimate: str, kind: str, ratios: list[float]) -> Line:
    held = sum(ratio <= 1.0 for ratio in ratios)
    middle, worst = float(np.median(ratios)), max(ratios)
    return Line(estimate, kind, len(ratios), held, middle, worst)


def of_errors(name: str, records: list[Record]) -> list[Line]:
    """Return the lines of truncation or accuracy, each way of it apart."""
    out: list[Line] = []
    for way in dict.fromkeys(row["way"] for r in records for row in r["rows"]):
        rows = [
            (record, row["found"] / row["stated"])
            for record in records
            for row in record["rows"]
            if row["way"] == way
        ]
        out += lines(f"{name}: {way}", rows)
    return out


def of_presets(records: list[Record]) -> list[Line]:
    """Return the lines of presets: words, and numbers against what is stated."""
    out: list[Line] = []
    for preset in ("twins", *preset_names()):
        wrong = [
            (r, 0.5 + (r["words"][preset] != r["words"]["finer"])) for r in records
        ]
        out += [_words(line) for line in lines(f"{preset}: words", wrong)]
        stated = {} if preset == "twins" else preset_bounds(preset)
        for number, bound in stated.items():
            rows = [(r, r["errors"][preset][number] / bound) for r in records]
            out += lines(f"{preset}: {NUMBERS[number]}", rows)
    return out


def of_presets_of(records: list[Record], what: str) -> list[Line]:
    """Return the lines of presets with a feature, of all engines.

    what : the feature, as the lines tell it
    """
    whole = [line for line in of_presets(records) if line.kind == "all"]
    return [replace(line, estimate=f"{what}{line.estimate}") for line in whole]


def of_rotation(records: list[Record]) -> list[Line]:
    """Return the lines of rotation: words of other ways, against those with the terms.

    Those of which the terms are left out, and those that keep them, by their centre.
    """
    out: list[Line] = []
    parts: dict[str, list[Record]] = {}
    for one in records:
        kept = f"kept, {one['inputs']['centre']} centre"
        part = "left out" if one["chosen"] == "none" else kept
        parts.setdefault(part, []).append(one)
    for (part, own), way in itertools.product(sorted(parts.items()), WAYS):
        wrong = [(r, 0.5 + (r["words"][way] != r["words"]["full"])) for r in own]
        sure = [(r, ratio) for r, ratio in wrong if _is_sure(r, way)]
        kinds = {"all": wrong, "sure": sure}
        if way == "none":
            kinds["chance"] = _of_chance(own)
        for kind, rows in kinds.items():
            if rows:
                ratios = [ratio for _, ratio in rows]
                line = _line(f"rotation: {part}, {WAYS[way]}", kind, ratios)
                out.append(_words(line))
    return out


def _is_sure(one: Record, way: str) -> bool:
    """Return whether twins in force keep their word, see the module."""
    words, spread = one["words"], one.get("spread")
    if spread:
        return all(len(set(twins)) == 1 for twins in spread.values())
    decided = not any("undecided" in words[name] for name in (way, "full"))
    return decided and words["twins"] == words["full"]


def _of_chance(records: list[Record]) -> list[tuple[Record, float]]:
    """Return (engine, ratio > 1 if the terms change its words) where words are chance.

    The ratio is of the probability asked for to that of the words found.
    """
    spread = [r for r in records if r.get("spread")]
    by_chance = [r for r in spread if not _is_sure(r, "none")]
    least = DOUBT / max(len(by_chance), 1)
    return [(r, least / as_alike(**r["spread"])) for r in by_chance]


def as_alike(full: list[str], none: list[str]) -> float:
    """Return how probable it is that words of two lists differ as much by chance.

    A permutation test of the sum over words of |difference of counts|.
    """
    names, codes = np.unique([*full, *none], return_inverse=True)
    ones = np.eye(len(names))[codes]
    sign = np.repeat([1.0 / len(full), -1.0 / len(none)], [len(full), len(none)])
    found = np.abs(sign @ ones).sum()
    random = np.random.default_rng(len(codes))
    shuffled = random.permuted(np.tile(sign, (SHUFFLES, 1)), axis=1)
    alike = np.abs(shuffled @ ones).sum(axis=1) >= found - 1e-9
    return float((1 + alike.sum()) / (1 + SHUFFLES))


def _words(line: Line) -> Line:
    """Return a line of words, of which there is no ratio."""
    return replace(line, median=np.nan, worst=np.nan)


def loses(preset: str, records: list[Record]) -> dict[str, Any]:
    """Return what presets.toml tells of a preset, from many engines."""
    right = sum(r["words"][preset] == r["words"]["finer"] for r in records)
    twins = sum(r["words"]["twins"] == r["words"]["finer"] for r in records)
    told, nine = [], {}
    for number, name in NUMBERS.items():
        found = [r["errors"][preset][number] for r in records]
        floor = [r["errors"]["twins"][number] for r in records]
        nine[number] = float(f"{np.quantile(found, TENTH):.2g}")
        told.append(
            f"{name} {100 * np.median(found):.2g} % ({100 * nine[number]:.2g} %, "
            f"{100 * max(found):.2g} %; twins {100 * np.median(floor):.2g} %, "
            f"{100 * np.quantile(floor, TENTH):.2g} %)"
        )
    text = (
        f"on {len(records)} engines at random, 1 s: words as a finer run in {right} "
        f"(its twins in {twins}); error in the median (nine in ten below, largest): "
        + ", ".join(told)
    )
    return {"engines": text, "nine_in_ten": nine}


def section(name: str, drawn: int, found: list[Line]) -> str:
    """Return the section of one of `PLANS`: how many were drawn, and its lines."""
    cells = []
    for x in found:
        ratios = (
            [""] * 2 if np.isnan(x.median) else [f"{x.median:.2g}", f"{x.worst:.2g}"]
        )
        share = f"{100 * x.share:.0f} %"
        cells.append([x.estimate, x.kind, x.drawn, x.held, share, *ratios])
    told = f"{drawn} engines of seed {PLANS[name][0]}."
    return "\n".join([f"## {name}", "", told, "", *table(HEAD, cells), ""])


TELL: dict[str, Callable[[list[Record]], list[Line]]] = {
    "truncation": partial(of_errors, "truncation"),
    "accuracy": partial(of_errors, "accuracy"),
    "presets": of_presets,
    "rotation": of_rotation,
    "kept": of_rotation,
    "presets_full": partial(of_presets_of, what=FULL),
    "presets_late": partial(of_presets_of, what="late features, "),
}


def failing(found: list[Line]) -> list[Line]:
    """Return the lines in which an estimate holds too seldom."""
    return [
        line
        for line in found
        if (
            line.estimate.startswith(("truncation", "accuracy"))
            and line.drawn >= LEAST
            and line.share < ENOUGH
        )
        or ((line.estimate, line.kind) in ALL_ASKED and line.held < line.drawn)
    ]


def main() -> int:
    """Measure, print, write."""
    parser, bad = parser_of(__doc__, write=PAGE, folder="?"), []
    parser.add_argument("--only", choices=list(PLANS), action="append")
    args = parser.parse_args()
    with working_folder(args.folder, "estimates") as folder:
        for name in args.only or PLANS:
            records = measured(name, folder)
            known = [record for record in records if not record.get("left_out")]
            found = TELL[name](known)
            bad += failing(found)
            told = section(name, len(records), found)
            print(told)
            if args.write:
                PAGE.write_text(with_section(PAGE.read_text(), told))
            if args.write and name == "presets":
                presets = tomllib.loads(PATH.read_text())
                write({n: row | loses(n, known) for n, row in presets.items()})
    return 1 if bad else 0


if __name__ == "__main__":
    raise SystemExit(main())
