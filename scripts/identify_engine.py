"""Search for what the paper does not give: casing, dampings and pulse.

    python scripts/identify_engine.py --out DIR --minutes 60 [--ranks N]

The unknowns and their bounds are in `identify_space`; the score is that of
`identify_score`, written down before the search. Three stages, every case through
`hpcwhirl campaign`:

A  screening: a Sobol sequence over all unknowns, few speeds, short runs, step 2e-6 s.
   A second sequence is kept to rings whose two-lobed mode meets the rotor's backward
   wave near 420 rad/s, 380 <= omega_bd + omega_2/2 <= 440 rad/s: a blade whose contact
   point turns with that wave in the static frame at Omega - omega_bd excites n lobes
   at n (Omega - omega_bd).
B  the best of A and the present default: a coarse sweep, the clamped centre and
   Table 1 at a few speeds, 2.5 s, step 1e-6 s. Then rounds of refinement: Sobol
   sequences in ever smaller boxes around the best, screened as in A, the best as in B.
C  the best few and the default: 51 speeds, clamped centre, Table 1, other time steps
   and numbers of modes, and a profile of the score along each unknown.

A campaign's directory is named by its content, so that the same command continues.
DIR/engines.json holds every engine with its score, DIR/report.md the tables.
"""

from __future__ import annotations

import argparse
import hashlib
import math
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from identify_report import write_report
from identify_score import Row, score, score_parts
from identify_space import (
    BY_HAND,
    TWO_LOBED,
    UNKNOWNS,
    Engine,
    box_around,
    default_engine,
    draw,
    from_unit,
    to_unit,
)

from hpcwhirl import open_results
from hpcwhirl.campaign.design import load_design
from hpcwhirl.campaign.resume import prepare
from hpcwhirl.campaign.run import run_campaign
from hpcwhirl.store.reader import words

BATCH = 24  # engines a campaign
ROWS = ("orbit_radius", "line_frequency", "growth_rate", "speed", "gap", "centre_peak",
        "late_fed", "late_lost", "last_contact", "ledger_rotation", "ledger_friction",
        "ledger_damping", "ledger_impact")  # fmt: skip


@dataclass(frozen=True)
class Stage:
    """What is computed for an engine; speeds in rad/s, times in s."""

    name: str
    speeds: tuple[float, ...]
    duration: float = 2.5
    time_step: float = 1e-6
    clamped: tuple[float, ...] = ()
    table1: tuple[float, ...] = ()
    variants: tuple[tuple[float, int], ...] = ()  # time step, modes
    revolutions: float = 20.0


@dataclass
class Found:
    """An engine, what was computed for it and what that is worth."""

    engine: Engine
    stage: str
    rows: list[Row] = field(default_factory=list)

    @property
    def score(self) -> float:
        """Points won over points possible."""
        return score(score_parts(self.rows))


def grid(start: int, stop: int, step: int) -> tuple[float, ...]:
    """Return speeds, both ends included."""
    return tuple(float(v) for v in range(start, stop + 1, step))


DECIDING = (270.0, 410.0, 420.0, 520.0)
SCREEN = Stage("A", (150.0, *DECIDING), duration=1.5, time_step=2e-6)
SWEEP = Stage(
    "B",
    tuple(sorted({*grid(60, 500, 40), 260.0, 280.0, *DECIDING})),
    clamped=(150.0, 270.0, 420.0),
    table1=(100.0, 270.0, 420.0),
)
FINAL = Stage(
    "C",
    grid(20, 520, 10),
    clamped=grid(20, 520, 20),
    table1=grid(20, 520, 50),
    variants=((5e-7, 110), (1e-6, 88), (1e-6, 132)),
)


@dataclass(frozen=True)
class Plan:
    """How much is done: engines of each stage, durations, time."""

    minutes: float = 60.0
    screened: int = 288
    kept: int = 8
    around: int = 4
    drawn: int = 16
    rounds: int = 6
    finals: int = 2
    profile: int = 7
    stages: tuple[Stage, Stage, Stage] = (SCREEN, SWEEP, FINAL)


def short_plan(minutes: float) -> Plan:
    """Return a plan that only shows that every part works."""
    tiny = {"duration": 4e-3, "time_step": 4e-6, "revolutions": 0.2}
    sweep = replace(SWEEP, speeds=DECIDING, clamped=(270.0,), table1=(420.0,), **tiny)
    final = replace(sweep, name="C", variants=((4e-6, 88),))
    return Plan(
        minutes, screened=4, kept=1, around=1, drawn=2, rounds=1, finals=1, profile=1,
        stages=(replace(SCREEN, **tiny), sweep, final),
    )  # fmt: skip


def cases_of(engine: Engine, stage: Stage) -> list[tuple[str, dict[str, Any]]]:
    """Return (kind, settings) of every case that a stage computes for an engine."""
    usual = {"solver.time_step": stage.time_step, "solver.modes": 110}
    table2 = {"gap": 1.28e-4, "friction": 0.1, "nodal_diameter": 1, "revolutions": 0.0}
    table1 = {"gap": 1e-3, "friction": 0.2, "revolutions": stage.revolutions}
    free = {"engine.rotor.centre": "free"}
    cases = [("table 2", {"speed": s} | table2 | free | usual) for s in stage.speeds]
    for s in stage.clamped:
        clamped = {"engine.rotor.centre": "clamped"}
        cases.append(("clamped", {"speed": s} | table2 | clamped | usual))
    for k in (1, 2):
        lobes = {"nodal_diameter": k}
        cases += [
            (f"table 1, k={k}", {"speed": s} | table1 | lobes | free | usual)
            for s in stage.table1
        ]
    for step, modes in stage.variants:
        other = {"solver.time_step": step, "solver.modes": modes}
        kind = f"step {step:g} s, eta {modes}"
        cases += [(kind, {"speed": s} | table2 | free | other) for s in DECIDING]
    return [(kind, engine | settings) for kind, settings in cases]


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
        prepare(design, place)
        if not run_campaign(design, place).complete:
            raise SystemExit(75)  # asked to stop: the same command continues
        return
    command = ["mpirun", "-n", str(ranks), sys.executable, "-m", "hpcwhirl", "campaign"]
    command += [str(place / "cases.toml"), "--out", str(place)]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
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


def read(engines: Sequence[Engine], stage: Stage, place: Path) -> list[Found]:
    """Return the rows of each engine from a campaign's results."""
    data = open_results(place)
    named = {name: words(data[name]) for name in ("status", "regime", "whirl", "stop")}
    numbers = {name: data[name].to_numpy() for name in ROWS}
    found, at = [], 0
    for engine in engines:
        item = Found(engine, stage.name)
        for kind, settings in cases_of(engine, stage):
            row: Row = {name: str(values[at]) for name, values in named.items()}
            row |= {name: float(values[at]) for name, values in numbers.items()}
            item.rows.append(row | {"kind": kind, "speed": settings["speed"]})
            at += 1
        found.append(item)
    return found


class Search:
    """The stages, one after the other, within a time."""

    def __init__(self, out: Path, plan: Plan, ranks: int) -> None:
        self.out, self.plan, self.ranks = out, plan, ranks
        self.start = time.monotonic()
        self.screened: list[Found] = []
        self.swept: list[Found] = []
        self.final: list[Found] = []
        self.profile: dict[str, list[tuple[float, float]]] = {}

    def left(self, share: float) -> bool:
        """Return whether less than a share of the time has gone."""
        return time.monotonic() - self.start < 60 * share * self.plan.minutes

    def batches(
        self, engines: Sequence[Engine], stage: Stage, until: float
    ) -> list[Found]:
        """Compute engines in campaigns of `BATCH` while there is time."""
        found: list[Found] = []
        for first in range(0, len(engines), BATCH):
            if first and not self.left(until):
                break
            part = engines[first : first + BATCH]
            found += compute(part, stage, self.out, self.ranks)
            best = max(item.score for item in found)
            spent = (time.monotonic() - self.start) / 60
            print(
                f"{spent:6.1f} min  {stage.name}: {len(found)} of {len(engines)} "
                f"engines, best score {best:.3f}",
                flush=True,
            )
        return found

    def screen(self) -> None:
        """Stage A: both sequences, taken in turns."""
        half = self.plan.screened // 2
        everywhere, two_lobed = draw(half, seed=1), draw(half, seed=2, within=TWO_LOBED)
        engines = [e for pair in zip(everywhere, two_lobed, strict=True) for e in pair]
        self.screened = self.batches(engines, self.plan.stages[0], 0.35)

    def sweep(self) -> None:
        """Stage B: the best of A, then rounds of smaller boxes."""
        best = top(self.screened, self.plan.kept)
        engines = [default_engine(), *(item.engine for item in best)]
        self.swept = self.batches(engines, self.plan.stages[1], 0.5)
        for number in range(self.plan.rounds):
            if not self.left(0.85):
                break
            self.refine(number)
            self.save()

    def refine(self, number: int) -> None:
        """One round of stage B: draw around the best, screen, sweep the best.

        Round 1 looks into the box found by hand instead.
        """
        half = 0.12 * 0.7**number
        drawn: list[Engine] = []
        if number == 1:
            drawn = draw(3 * self.plan.drawn, 200, BY_HAND, "squeeze")
        around = 0 if drawn else self.plan.around
        for rank, item in enumerate(top(self.swept, around)):
            box = box_around(item.engine, half)
            seed = 100 * (number + 1) + rank
            drawn += draw(self.plan.drawn, seed, box, item.engine["direction"])
        found = self.batches(drawn, self.plan.stages[0], 1.0)
        self.screened += found
        engines = [item.engine for item in top(found, max(1, self.plan.kept // 2))]
        self.swept += self.batches(engines, self.plan.stages[1], 1.0)

    def conclude(self) -> None:
        """Stage C: the best few and the default, and the profile of the best."""
        best = [item.engine for item in top(self.swept, self.plan.finals)]
        engines = best + [e for e in [default_engine()] if e not in best]
        for engine in engines:
            self.final += compute([engine], self.plan.stages[2], self.out, self.ranks)
            self.save()
        self.profile = self.profiles(top(self.final, 1)[0].engine)

    def profiles(self, engine: Engine) -> dict[str, list[tuple[float, float]]]:
        """Return {unknown: (value, score)}: one at a time, screened as in stage A."""
        values: list[tuple[str, float]] = []
        for name in UNKNOWNS:
            at = to_unit(name, engine[name])
            shares = at + np.linspace(-0.1, 0.1, self.plan.profile)
            tried = {from_unit(name, share) for share in shares} - {engine[name]}
            values += [(name, value) for value in sorted(tried)]
        engines = [engine, *(engine | {name: value} for name, value in values)]
        found = self.batches(engines, self.plan.stages[0], math.inf)
        out = {name: [(engine[name], found[0].score)] for name in UNKNOWNS}
        for (name, value), item in zip(values, found[1:], strict=True):
            out[name].append((value, item.score))
        return {name: sorted(pairs) for name, pairs in out.items()}

    def save(self) -> None:
        """Write engines.json and report.md."""
        minutes = (time.monotonic() - self.start) / 60
        write_report(self.out, self, UNKNOWNS, default_engine(), minutes)


def top(found: Sequence[Found], count: int) -> list[Found]:
    """Return the best, each engine once."""
    out: list[Found] = []
    for item in sorted(found, key=lambda item: -item.score):
        if all(item.engine != other.engine for other in out):
            out.append(item)
    return out[:count]


def main(words_: Sequence[str] | None = None) -> int:
    """Search and write the report."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("build/identify"))
    parser.add_argument("--minutes", type=float, default=60.0, help="of stages A and B")
    parser.add_argument("--ranks", type=int, default=1, help="MPI ranks a campaign")
    parser.add_argument("--short", action="store_true", help="show that it works")
    parser.add_argument("--rounds", type=int, default=6, help="of refinement, at most")
    parser.add_argument("--finals", type=int, default=2, help="engines of stage C")
    args = parser.parse_args(words_)
    plan = Plan(args.minutes, rounds=args.rounds, finals=args.finals)
    plan = short_plan(args.minutes) if args.short else plan
    search = Search(args.out, plan, args.ranks)
    search.screen()
    search.sweep()
    search.conclude()
    search.save()
    print(f"identify: report in {args.out / 'report.md'}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
