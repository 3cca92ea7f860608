"""Search for what the paper does not give: casing, dampings and pulse.

    python scripts/identify/engine.py --out DIR --minutes 60 [--ranks N]

The unknowns and their bounds are in `identify.space`; the score is that of
`identify.score`, written down before the search. Whether the pulse squeezes or
stretches is no unknown: with k = 1 and an even number of blades the two are the same
motion turned by half a turn (`pytest tests/test_march.py -k whole_turn`), and Table 1
with k = 2 is damped either way. Three stages, every case through `hpcwhirl campaign`:

A  differential evolution (scipy) over all unknowns: a generation is a campaign of few
   speeds at a step of 8e-6 s; it starts from the default, engines found by hand and a
   Sobol sequence, and minimizes -(score + guide) / 2.
B  the best of A and the present default: a coarse sweep, the clamped centre and
   Table 1 at a few speeds, step 1e-6 s.
C  the best few of B and the default: 51 speeds, clamped centre, Table 1, other time
   steps and numbers of modes, and a profile of the score along each unknown.

A campaign's directory is named by its content and all chance is seeded, so that the
same command continues. DIR/engines.json holds every engine with its score,
DIR/report.md the tables.
"""

from __future__ import annotations

import argparse
import hashlib
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from numpy.typing import NDArray
from scipy.optimize import differential_evolution

from hpcwhirl import open_results
from hpcwhirl.campaign.design import load_design
from hpcwhirl.campaign.resume import prepare
from hpcwhirl.campaign.run import run_campaign
from hpcwhirl.store.reader import words

sys.path.insert(0, str(Path(__file__).parents[1]))
from identify.report import write_report
from identify.score import Row, guide, score, score_parts
from identify.space import (
    UNKNOWNS,
    Engine,
    default_engine,
    engine_at,
    first_population,
    from_unit,
    to_unit,
)

SEED = 1
ROWS = ("orbit_radius", "line_frequency", "growth_rate", "speed", "gap", "centre_peak",
        "late_fed", "late_lost", "last_contact", "ledger_rotation", "ledger_friction",
        "ledger_damping", "ledger_impact", "window")  # fmt: skip


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

    @property
    def guide(self) -> float:
        """What leads the search where words alone are flat."""
        return guide(self.rows)


def grid(start: int, stop: int, step: int) -> tuple[float, ...]:
    """Return speeds, both ends included."""
    return tuple(float(v) for v in range(start, stop + 1, step))


DECIDING = (270.0, 410.0, 420.0, 520.0)
SCREEN = Stage(
    "A",
    (100.0, 150.0, 200.0, 240.0, 300.0, 330.0, 370.0, 460.0, *DECIDING),
    time_step=8e-6,
    clamped=(150.0, 270.0),
    table1=(270.0, 420.0),
)
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
    """How much is done: time of stage A, engines of a generation and of each stage."""

    minutes: float = 60.0
    population: int = 32
    generations: int = 60
    kept: int = 8
    finals: int = 2
    profile: int = 7
    stages: tuple[Stage, Stage, Stage] = (SCREEN, SWEEP, FINAL)


def short_plan(minutes: float) -> Plan:
    """Return a plan that only shows that every part works."""
    tiny = {"duration": 4e-3, "time_step": 4e-6, "revolutions": 0.2}
    sweep = replace(SWEEP, speeds=DECIDING, clamped=(270.0,), table1=(420.0,), **tiny)
    final = replace(sweep, name="C", variants=((4e-6, 88),))
    return Plan(
        minutes, population=6, generations=1, kept=1, finals=1, profile=1,
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

    def compute(self, engines: Sequence[Engine], stage: Stage) -> list[Found]:
        """Return what one campaign finds; say how far the search is."""
        found = compute(engines, stage, self.out, self.ranks)
        best = max(found, key=lambda item: item.score)
        spent = (time.monotonic() - self.start) / 60
        print(
            f"{spent:6.1f} min  {stage.name}: {len(found)} engines, the best has "
            f"{best.score:.3f} of the points",
            flush=True,
        )
        return found

    def screen(self) -> None:
        """Stage A: generations until the time has gone."""
        population = first_population(self.plan.population, SEED)
        differential_evolution(
            self._generation,
            [(0.0, 1.0)] * len(UNKNOWNS),
            init=population,
            maxiter=self.plan.generations,
            mutation=(0.4, 0.9),
            recombination=0.8,
            updating="deferred",
            vectorized=True,
            polish=False,
            tol=0.0,
            seed=SEED,
            callback=self._out_of_time,
        )

    def _generation(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what a generation minimizes, (engines,), for (unknowns, engines)."""
        engines = [engine_at(point) for point in points.T]
        distinct = [e for i, e in enumerate(engines) if e not in engines[:i]]
        found = self.compute(distinct, self.plan.stages[0])
        self.screened += found
        self.save()
        worth = [-(item.score + item.guide) / 2 for item in found]
        return np.array([worth[distinct.index(engine)] for engine in engines])

    def _out_of_time(self, best: NDArray[np.float64], convergence: float) -> bool:
        del best, convergence
        return time.monotonic() - self.start > 60 * self.plan.minutes

    def sweep(self) -> None:
        """Stage B: the best of A, by what led them there, and the default."""
        best = top(self.screened, self.plan.kept)
        engines = [item.engine for item in best]
        engines += [e for e in [default_engine()] if e not in engines]
        self.swept = self.compute(engines, self.plan.stages[1])
        self.save()

    def conclude(self) -> None:
        """Stage C: the best few and the default, and the profile of the best."""
        best = [item.engine for item in top(self.swept, self.plan.finals)]
        engines = best + [e for e in [default_engine()] if e not in best]
        for engine in engines:
            self.final += self.compute([engine], self.plan.stages[2])
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
        found = self.compute(engines, self.plan.stages[0])
        out = {name: [(engine[name], found[0].score)] for name in UNKNOWNS}
        for (name, value), item in zip(values, found[1:], strict=True):
            out[name].append((value, item.score))
        return {name: sorted(pairs) for name, pairs in out.items()}

    def save(self) -> None:
        """Write engines.json and report.md."""
        minutes = (time.monotonic() - self.start) / 60
        write_report(self.out, self, UNKNOWNS, default_engine(), minutes)


def top(found: Sequence[Found], count: int) -> list[Found]:
    """Return the best by score and guide, each engine once."""
    out: list[Found] = []
    for item in sorted(found, key=lambda item: -(item.score + item.guide)):
        if all(item.engine != other.engine for other in out):
            out.append(item)
    return out[:count]


def main(words_: Sequence[str] | None = None) -> int:
    """Search and write the report."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("build/identify"))
    parser.add_argument("--minutes", type=float, default=60.0, help="of stage A")
    parser.add_argument("--ranks", type=int, default=1, help="MPI ranks a campaign")
    parser.add_argument("--short", action="store_true", help="show that it works")
    parser.add_argument("--finals", type=int, default=2, help="engines of stage C")
    args = parser.parse_args(words_)
    plan = Plan(args.minutes, finals=args.finals)
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
