"""What the engine search found, as JSON and as Markdown tables: misses are shown."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from identify.full import OTHER_NUMERICS
from identify.guide import WEIGHTS, WORDS, cost, misses, shows_all, words_right
from identify.kept import key_of
from identify.score import Row, divergent_near_270, pick, score_parts
from identify.space import COORDINATES, Engine, default_engine, point_of

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
    lines += screened_table(best[:8], asked)
    lines += tried_table(search.tried)
    default = default_engine()
    for item in search.whole:
        whose = " (the default)" if item.engine == default else ""
        lines += [f"## Computed whole, score {item.score:.3f}{whose}", ""]
        lines += [describe(item.engine), "", *targets_table(item.rows)]
        lines += [*motions(item.rows), *robustness(item.rows)]
    lines += determined([e for e in search.best() if shows_all(asked[key_of(e)])])
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
    lines += _head(["cost", *(what for what, _ in SHORT.values()), *names])
    for engine in engines:
        rows = asked[key_of(engine)]
        found = misses(rows)
        cells = [f"{cost(rows):.3f}", *_values(engine)]
        lines.append(_line([*cells, *(f"{found[n]:.2f}" for n in names)]))
    return [*lines, ""]


def tried_table(items: Sequence[Any]) -> Lines:
    """Return what engines with four motions do at full numerics."""
    if not items:
        return []
    kinds = list(items[0].words)
    lines = ["## At full numerics: motions right, of four", ""]
    lines += _head([*(what for what, _ in SHORT.values()), *kinds, "of 16 beside"])
    for item in items:
        words = (str(item.words[k]) for k in kinds)
        beside = "" if math.isnan(item.beside) else f"{item.beside:g}"
        lines.append(_line([*_values(item.engine), *words, beside]))
    return [*lines, ""]


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
    lines = _head(["target", "points", "verdict", "found"])
    for name, (won, most) in score_parts(rows).items():
        row = told.get(name.split()[0])
        found = motion(row) if row else f"damped: {won / most:.0%} of the speeds"
        verdict = "agrees" if won == most else "misses" if won == 0 else "in part"
        lines.append(_line([name, f"{won:.3g} of {most:g}", verdict, found]))
    return [*lines, ""]


def motion(row: Row) -> str:
    """Return what a case does, in words and numbers."""
    if row["status"] != "ok":
        return "failed"
    return (
        f"{row['speed']:g}: {row['regime']} {row['whirl']}, "
        f"growth {row['growth_rate']:.2g}/s, line {row['line_frequency']:+.0f} rad/s, "
        f"radius {row['orbit_radius'] / row['gap']:.2g} gaps"
    )


def motions(rows: Sequence[Row]) -> Lines:
    """Return the regimes along the speeds of every kind of case."""
    lines: Lines = []
    for kind in dict.fromkeys(row["kind"] for row in rows):
        told = (f"{r['speed']:g} {_letters(r)}" for r in pick(rows, kind).values())
        lines += [f"{kind}: " + ", ".join(told), ""]
    return lines


def _letters(row: Row) -> str:
    return f"{row['regime'][:4]}-{row['whirl'][:1]}"


def robustness(rows: Sequence[Row]) -> Lines:
    """Return the words at the deciding speeds for other steps and modes."""
    usual = pick(rows, "table 2")
    kinds = [k for k in dict.fromkeys(r["kind"] for r in rows) if k in OTHER_NUMERICS]
    if not kinds:
        return []
    speeds = sorted(pick(rows, kinds[0]))
    lines = _head(["case", *(f"{s:g}" for s in speeds), "regimes as usual"])
    for kind in ["table 2", *kinds]:
        told = [pick(rows, kind)[s] for s in speeds]
        same = sum(r["regime"] == usual[r["speed"]]["regime"] for r in told)
        words = [f"{r['regime']} {r['whirl']}" for r in told]
        lines.append(_line([kind, *words, f"{same} of {len(speeds)}"]))
    return [*lines, ""]


def determined(engines: Sequence[Engine]) -> Lines:
    """Return the range of each coordinate among engines with all four motions."""
    if not engines:
        return []
    points = np.array([point_of(engine) for engine in engines])
    lines = [f"## All four motions when screened: {len(engines)} engines", ""]
    lines += _head(["coordinate", "lowest", "highest", "share of the box"])
    for name, at in zip(COORDINATES, points.T, strict=True):
        ends = [f"{COORDINATES[name].value(x):.4g}" for x in (at.min(), at.max())]
        lines.append(_line([name, *ends, f"{at.max() - at.min():.0%}"]))
    return [*lines, ""]


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> Lines:
    """Return a table in Markdown and the empty line after it."""
    return [*_head(heads), *(_line(cells) for cells in rows), ""]


def _line(cells: Iterable[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def _head(cells: Sequence[str]) -> Lines:
    return [_line(cells), "|" + "---|" * len(cells)]
