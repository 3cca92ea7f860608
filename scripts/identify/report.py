"""What the engine search found: all of it as JSON, the verdicts as Markdown tables."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Sequence
from typing import Any

from common import table
from identify.guide import WEIGHTS, WORDS, cost, misses, words_right
from identify.kept import key_of
from identify.score import Row, divergent_near_270, pick, score_parts
from identify.space import Engine, default_engine

SHORT = {
    "engine.casing.thickness": ("thickness, mm", 1e3),
    "engine.casing.width": ("width, mm", 1e3),
    "engine.casing.damping": ("ring damping", 1.0),
    "engine.casing.support_damping": ("support damping", 1.0),
    "engine.casing.support_frequency": ("support, rad/s", 1.0),
    "engine.rotor.damping": ("rotor damping", 1.0),
    "engine.rotor.suspension_damping": ("suspension damping", 1.0),
    "pulse": ("pulse, ms", 1e3),
}
Lines = list[str]


def write_report(search: Any) -> None:
    """Write engines.json and report.md of a search as far as it has come."""
    out, kept, asked = search.out, search.kept, search.screen.asked
    best = search.best()[:20]
    facts = {
        "seconds": kept.seconds,
        "engines": len(asked),
        "screened": [{"engine": e, "cost": cost(asked[key_of(e)])} for e in best],
        "tried": [_record(item) for item in search.tried],
        "whole": [_record(item) for item in search.whole],
    }
    out.mkdir(parents=True, exist_ok=True)
    (out / "engines.json").write_text(json.dumps(facts, indent=1) + "\n")
    lines = ["# Engines with the motions of the paper", "", *_counts(search), ""]
    lines += screened_table(best[:8], asked) + words_table(list(asked.values()))
    default = default_engine()
    for item in search.whole:
        whose = " (the default)" if item.engine == default else ""
        lines += [f"## Computed whole, score {item.score:.3f}{whose}", ""]
        lines += [describe(item.engine), "", *targets_table(item.rows)]
    (out / "report.md").write_text("\n".join(lines))


def _counts(search: Any) -> Lines:
    """Say what was screened, in what time, and what came of it."""
    asked = search.screen.asked.values()
    cases, seconds = sum(len(rows) for rows in asked), search.kept.seconds
    right = [words_right(rows) for rows in asked]
    told = ", ".join(f"{right.count(n)} with {n}" for n in range(len(WORDS), -1, -1))
    return [
        f"{len(asked)} engines screened, {cases} cases, {seconds:.0f} s of processor",
        f"time; of the four motions: {told}.",
        f"At full numerics {len(search.tried)} tried, {len(search.found)} with all",
        "four in every one.",
    ]


def screened_table(engines: Sequence[Engine], asked: Any) -> Lines:
    """Return the best engines of the screening with what misses."""
    names = list(WEIGHTS)
    lines = ["## The best when screened (0: as the paper, 1: not at all)", ""]
    cells = []
    for engine in engines:
        rows = asked[key_of(engine)]
        found = misses(rows)
        shares = (f"{found[name]:.2f}" for name in names)
        cells.append([f"{cost(rows):.3f}", *_values(engine), *shares])
    head = ["cost", *(what for what, _ in SHORT.values()), *names]
    return [*lines, *table(head, cells), ""]


def words_table(engines: Sequence[Sequence[Row]]) -> Lines:
    """Return how many engines did what when screened, at each of the four speeds."""
    cells = []
    for speed, regime, whirl in WORDS:
        asked = [
            sweep[speed]
            for rows in engines
            if speed in (sweep := pick(rows, "table 2"))
        ]
        count = Counter(f"{row['regime']} {row['whirl']}" for row in asked)
        found = ", ".join(f"{n} {word}" for word, n in count.most_common())
        cells.append([f"{speed:g}", f"{regime} {whirl}", str(len(asked)), found])
    head = ["rad/s", "the paper", "engines asked", "what they did"]
    return ["## What engines did when screened", "", *table(head, cells), ""]


def _record(item: Any) -> dict[str, Any]:
    parts = score_parts(item.rows)
    beside = None if math.isnan(item.beside) else item.beside
    return {"engine": item.engine, "score": item.score, "parts": parts,
            "beside": beside, "rows": item.rows}  # fmt: skip


def describe(engine: dict[str, Any]) -> str:
    """Return the unknowns of an engine in a line."""
    names = (what for what, _ in SHORT.values())
    pairs = zip(names, _values(engine), strict=True)
    return ", ".join(f"{name} {value}" for name, value in pairs)


def _values(engine: Engine) -> list[str]:
    return [f"{engine[name] * by:.5g}" for name, (_, by) in SHORT.items()]


def targets_table(rows: Sequence[Row]) -> Lines:
    """Return every target with what was found and whether that agrees."""
    sweep = pick(rows, "table 2")
    low = divergent_near_270(sweep)
    told = {"270": low} | {f"{s:g}": sweep.get(s) for s in (410.0, 420.0, 520.0)}
    cells = []
    for name, (won, most) in score_parts(rows).items():
        row = told.get(name.split()[0])
        found = motion(row) if row else f"damped: {won / most:.0%} of the speeds"
        verdict = "agrees" if won == most else "misses" if won == 0 else "in part"
        cells.append([name, f"{won:.3g} of {most:g}", verdict, found])
    return [*table(["target", "points", "verdict", "found"], cells), ""]


def motion(row: Row) -> str:
    """Return what a case does, in words and numbers."""
    if row["status"] != "ok":
        return "failed"
    return (
        f"{row['speed']:g}: {row['regime']} {row['whirl']}, "
        f"growth {row['growth_rate']:.2g}/s, line {row['line_frequency']:+.0f} rad/s, "
        f"radius {row['orbit_radius'] / row['gap']:.2g} gaps"
    )
