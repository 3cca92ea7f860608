"""What the engine search found, as JSON and as Markdown tables: misses are shown."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from identify.score import Row, divergent_near_270, pick, score_parts

NEAR = 0.9  # of the best score: engines that determine the unknowns
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


def write_report(
    out: Path, search: Any, unknowns: dict[str, Any], default: dict[str, Any],
    minutes: float,
) -> None:  # fmt: skip
    """Write engines.json and report.md of a search as far as it has come."""
    stages = {"A": search.screened, "B": search.swept, "C": search.final}
    facts = {
        "minutes": minutes,
        "default": default,
        "unknowns": unknowns,
        "stages": {name: [_record(f) for f in _sorted(items)]
                   for name, items in stages.items()},
        "profile": search.profile,
    }  # fmt: skip
    out.mkdir(parents=True, exist_ok=True)
    (out / "engines.json").write_text(json.dumps(facts, indent=1) + "\n")
    lines = [f"# Engines found in {minutes:.0f} minutes", ""]
    for name, items in stages.items():
        lines += engines_table(name, _sorted(items)[:8], default)
    for item in _sorted(search.final):
        whose = " (the default)" if item.engine == default else ""
        lines += [f"## Stage C, score {item.score:.3f}{whose}", ""]
        lines += [describe(item.engine), "", *targets_table(item.rows)]
        lines += [*motions(item.rows), *robustness(item.rows)]
    lines += determined("A", search.screened, unknowns)
    lines += determined("B", search.swept, unknowns)
    lines += profile_table(search.profile)
    (out / "report.md").write_text("\n".join(lines))


def _sorted(items: Iterable[Any]) -> list[Any]:
    return sorted(items, key=lambda item: -item.score)


def _record(item: Any) -> dict[str, Any]:
    parts = score_parts(item.rows)
    return {"engine": item.engine, "score": item.score, "parts": parts,
            "rows": item.rows}  # fmt: skip


def describe(engine: dict[str, Any]) -> str:
    """Return the unknowns of an engine in a line."""
    values = (f"{what} {engine[n] * by:.4g}" for n, (what, by) in SHORT.items())
    return ", ".join(values)


def engines_table(stage: str, items: Sequence[Any], default: dict[str, Any]) -> Lines:
    """Return the best engines of a stage with the parts of their scores."""
    if not items:
        return []
    names = list(score_parts(items[0].rows))
    heads = ["score", *(what for what, _ in SHORT.values()), *names]
    lines = [f"## Stage {stage}: the best", "", *_head(heads)]
    for item in items:
        parts = score_parts(item.rows)
        mark = " (default)" if item.engine == default else ""
        cells = [f"{item.score:.3f}{mark}"]
        cells += [f"{item.engine[n] * by:.4g}" for n, (_, by) in SHORT.items()]
        cells += [f"{won:.3g} of {most:g}" for won, most in parts.values()]
        lines.append(_line(cells))
    return [*lines, ""]


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
    kinds = [k for k in dict.fromkeys(r["kind"] for r in rows) if k.startswith("step")]
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


def determined(stage: str, items: Sequence[Any], unknowns: dict[str, Any]) -> Lines:
    """Return the range of each unknown among engines within 10 % of the best."""
    if not items:
        return []
    best = max(item.score for item in items)
    near = [item.engine for item in items if item.score >= NEAR * best]
    lines = [f"## Within 10 % of the best of stage {stage}: {len(near)} engines", ""]
    lines += _head(["unknown", "lowest", "highest", "share of the bounds"])
    for name, (what, by) in SHORT.items():
        values = [engine[name] for engine in near]
        low, high, along_log = unknowns[name]
        span = max(values) - min(values)
        share = span / (high - low)
        if along_log:
            share = math.log(max(values) / min(values)) / math.log(high / low)
        ends = [f"{v * by:.4g}" for v in (min(values), max(values))]
        lines.append(_line([what, *ends, f"{share:.0%}"]))
    return [*lines, ""]


def profile_table(profile: dict[str, list[tuple[float, float]]]) -> Lines:
    """Return the score along each unknown, the others held."""
    if not profile:
        return []
    lines = ["## One at a time about the best (screened: few speeds, short runs)", ""]
    lines += _head(["unknown", "value: score"])
    for name, pairs in profile.items():
        what, by = SHORT[name]
        told = ", ".join(f"{value * by:.4g}: {got:.2f}" for value, got in pairs)
        lines.append(_line([what, told]))
    return [*lines, ""]


def _line(cells: Iterable[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def _head(cells: Sequence[str]) -> Lines:
    return [_line(cells), "|" + "---|" * len(cells)]
