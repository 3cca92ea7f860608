"""Engines at full numerics: campaigns of the paper's cases, and what they say.

A campaign's directory is named by its content, so the same question is asked once.
"""

from __future__ import annotations

import hashlib
import math
import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import tomli_w
from identify.guide import WORDS, words_right
from identify.score import Row, score, score_parts
from identify.screen import KINDS
from identify.space import UNKNOWNS, Engine, neighbours

from hpcwhirl import open_results
from hpcwhirl.campaign.plan.design import load_design
from hpcwhirl.campaign.resume import prepare
from hpcwhirl.campaign.run import run_campaign
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.reading.reader import words

NUMBERS = ("orbit_radius", "line_frequency", "growth_rate", "speed", "gap",
           "centre_peak", "late_fed", "late_lost", "late_friction", "last_contact",
           "window", "whirl_ratio")  # fmt: skip
OTHER_NUMERICS: dict[str, dict[str, Any]] = {
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
    speeds: tuple[float, ...]
    clamped: tuple[float, ...] = ()
    table1: tuple[float, ...] = ()
    other: tuple[str, ...] = ()  # of OTHER_NUMERICS
    duration: float = 2.5
    time_step: float = 1e-6
    revolutions: float = 20.0


@dataclass
class Found:
    """An engine and what was computed for it.

    beside : how many of its `neighbours` have all four motions; nan where not asked
    """

    engine: Engine
    rows: list[Row] = field(default_factory=list)
    beside: float = math.nan

    @property
    def score(self) -> float:
        """Points won over points possible."""
        return score(score_parts(self.rows))

    @property
    def words(self) -> dict[str, int]:
        """{numerics: how many of the paper's four motions are right}."""
        kinds = dict.fromkeys(row["kind"] for row in self.rows)
        some = [k for k in kinds if k == "table 2" or k in OTHER_NUMERICS]
        return {kind: words_right(self.rows, kind) for kind in some}

    @property
    def firm(self) -> bool:
        """Whether they are so also with each unknown a little off, down and up."""
        return self.holds and self.beside == 2 * len(UNKNOWNS)

    @property
    def holds(self) -> bool:
        """Whether all four motions are right in all numerics."""
        return min(self.words.values(), default=0) == len(WORDS)


def grid(start: int, stop: int, step: int) -> tuple[float, ...]:
    """Return speeds, both ends included."""
    return tuple(float(v) for v in range(start, stop + 1, step))


DECIDING = tuple(speed for speed, _, _ in WORDS)
FOUR = Stage("four", DECIDING, other=tuple(OTHER_NUMERICS))
BESIDE = Stage("beside", DECIDING)
CHANGE = 0.01  # of one unknown, of engines beside one whose motions hold
WHOLE = Stage(
    "whole",
    grid(20, 520, 10),
    clamped=grid(20, 520, 20),
    table1=grid(20, 520, 50),
    other=tuple(OTHER_NUMERICS),
)


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
        other = KINDS["table 2"] | OTHER_NUMERICS[kind]
        told += [(kind, s, other) for s in DECIDING]
    return [(kind, engine | usual | own | {"speed": s}) for kind, s, own in told]


def document(engines: Sequence[Engine], stage: Stage) -> str:
    """Return the TOML of a campaign."""
    cases = [settings for engine in engines for _, settings in cases_of(engine, stage)]
    return tomli_w.dumps(
        {
            "scene": {"duration": stage.duration},
            "output": {"traces": "summary"},
            "cases": cases,
        }
    )


def campaign(place: Path, ranks: int) -> None:
    """Run or continue the campaign of a directory, in this process or under MPI."""
    if ranks == 1:
        design = load_design(place / "cases.toml", {})
        prepare(design, Directory(place))
        if not run_campaign(design, Directory(place)).complete:
            raise SystemExit(75)  # asked to stop: the same command continues
        return
    command = [os.environ.get("MPIRUN", "mpirun"), "-n", str(ranks), sys.executable]
    command += ["-m", "hpcwhirl", "campaign", str(place / "cases.toml")]
    done = subprocess.run(
        [*command, "--out", str(place)], check=False, capture_output=True, text=True
    )
    if done.returncode not in {0, 1}:  # 1: some cases failed, which are misses
        raise SystemExit(f"identify: {place}: {done.stderr.strip()}")


def compute(
    engines: Sequence[Engine], stage: Stage, folder: Path, ranks: int
) -> list[Found]:
    """Run one campaign, or take its results where they are, and read it."""
    text = document(engines, stage)
    place = folder / f"{stage.name}-{hashlib.sha256(text.encode()).hexdigest()[:12]}"
    if not (place / "results.h5").exists():
        place.mkdir(parents=True, exist_ok=True)
        (place / "cases.toml").write_text(text)
        campaign(place, ranks)
    return read(engines, stage, place)


def count_beside(found: Found, stage: Stage, folder: Path, ranks: int) -> None:
    """Count the neighbours of an engine that have all four motions."""
    near = compute(neighbours(found.engine, CHANGE), stage, folder, ranks)
    found.beside = sum(item.words["table 2"] == len(WORDS) for item in near)


def read(engines: Sequence[Engine], stage: Stage, place: Path) -> list[Found]:
    """Return the rows of each engine from a campaign's results."""
    data = open_results(place)
    named = {name: words(data[name]) for name in ("status", "regime", "whirl", "stop")}
    numbers = {name: data[name].to_numpy() for name in NUMBERS}
    found, at = [], 0
    for engine in engines:
        item = Found(engine)
        for kind, settings in cases_of(engine, stage):
            row: Row = {name: str(values[at]) for name, values in named.items()}
            row |= {name: float(values[at]) for name, values in numbers.items()}
            item.rows.append(row | {"kind": kind, "speed": settings["speed"]})
            at += 1
        found.append(item)
    return found
