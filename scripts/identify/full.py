"""Engines at full numerics: campaigns of the paper's cases, and what they say.

A campaign's directory is named by its content, so the same question is asked once.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import tomli_w
from common import completed, results_of
from identify.score import Row, score, score_parts
from identify.screen import KINDS, MOTIONS, words_right
from identify.space import Engine

import hpcwhirl
from hpcwhirl.store.reading.reader import words

NUMBERS = ("orbit_radius", "line_frequency", "growth_rate", "gap")
NUMERICS: dict[str, dict[str, Any]] = {
    "half the step": {"solver.time_step": 5e-7},
    "twice the step": {"solver.time_step": 2e-6},
    "eta 88": {"solver.modes": 88},
    "eta 132": {"solver.modes": 132},
    "exact": {"solver.scheme": "exact"},
}


@dataclass(frozen=True)
class Stage:
    """What is computed for an engine; speeds in rad/s, times in s."""

    name: str
    speeds: Sequence[float]
    clamped: Sequence[float] = ()
    table1: Sequence[float] = ()
    other: Sequence[str] = ()  # of NUMERICS
    duration: float = 2.5
    time_step: float = 1e-6
    revolutions: float = 20.0


@dataclass
class Found:
    """An engine and what was computed for it."""

    engine: Engine
    rows: list[Row] = field(default_factory=list)

    @property
    def score(self) -> float:
        """Points won over points possible."""
        return score(score_parts(self.rows))

    @property
    def words(self) -> dict[str, int]:
        """{numerics: how many of the paper's four motions are right}."""
        kinds = dict.fromkeys(row["kind"] for row in self.rows)
        some = [k for k in kinds if k == "table 2" or k in NUMERICS]
        return {kind: words_right(self.rows, kind) for kind in some}

    @property
    def holds(self) -> bool:
        """Whether all four motions are right in all numerics."""
        return min(self.words.values(), default=0) == len(MOTIONS)


def grid(step: int) -> list[float]:
    """Return the paper's speeds, rad/s."""
    return [float(v) for v in range(20, 521, step)]


FOUR = Stage("four", tuple(MOTIONS), other=tuple(NUMERICS))
WHOLE = Stage("whole", grid(10), grid(20), grid(50), other=tuple(NUMERICS))


def cases_of(engine: Engine, stage: Stage) -> list[tuple[str, dict[str, Any]]]:
    """Return (kind, settings) of every case that a stage computes for an engine."""
    usual = {"engine.rotor.centre": "free", "nodal_diameter": 1, "revolutions": 0.0,
             "solver.time_step": stage.time_step, "solver.modes": 110,
             "solver.scheme": "modal"}  # fmt: skip
    told = [("table 2", s, KINDS["table 2"]) for s in stage.speeds]
    told += [("clamped", s, KINDS["clamped"]) for s in stage.clamped]
    for k in (1, 2):
        table1 = KINDS["table 1, k=1"] | {"nodal_diameter": k}
        table1 |= {"revolutions": stage.revolutions}
        told += [(f"table 1, k={k}", s, table1) for s in stage.table1]
    for kind in stage.other:
        told += [(kind, s, KINDS["table 2"] | NUMERICS[kind]) for s in MOTIONS]
    return [(kind, engine | usual | own | {"speed": s}) for kind, s, own in told]


def document(engines: Sequence[Engine], stage: Stage) -> dict[str, Any]:
    """Return the tables of a campaign."""
    cases = [settings for engine in engines for _, settings in cases_of(engine, stage)]
    output = {"traces": "summary"}
    return {"scene": {"duration": stage.duration}, "output": output, "cases": cases}


def compute(
    engines: Sequence[Engine], stage: Stage, folder: Path, ranks: int
) -> list[Found]:
    """Return what engines do, from a campaign that is run, continued or complete.

    ranks : of the campaign; 1: in this process
    """
    tables = document(engines, stage)
    name = hashlib.sha256(tomli_w.dumps(tables).encode()).hexdigest()[:12]
    place = folder / f"{stage.name}-{name}"
    place.parent.mkdir(parents=True, exist_ok=True)
    if (place / "results.h5").exists():
        data = hpcwhirl.open_results(place)
    elif ranks == 1:
        data = hpcwhirl.open_results(completed(tables, place))
    else:
        data = results_of(tables, place, ranks=ranks)
    told = {name: words(data[name]) for name in ("status", "regime", "whirl", "stop")}
    told |= {name: data[name].to_numpy() for name in NUMBERS}
    rows = iter([dict(zip(told, map(_plain, row), strict=True))
                 for row in zip(*told.values(), strict=True)])  # fmt: skip
    found = [Found(engine) for engine in engines]
    for item in found:
        for kind, settings in cases_of(item.engine, stage):
            item.rows.append(next(rows) | {"kind": kind, "speed": settings["speed"]})
    return found


def _plain(value: Any) -> Any:
    return str(value) if isinstance(value, str) else float(value)
