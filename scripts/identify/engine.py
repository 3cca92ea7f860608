"""Search for what the paper does not give: casing, dampings and pulse.

    python scripts/identify/engine.py --out DIR [--minutes 180] [--workers 2]
                                      [--rotation full]

The unknowns are in `identify.space`, what leads the search in `identify.screen`, what
judges engines in `identify.score`, written down before. Whether the pulse squeezes or
stretches is no unknown: with k = 1 and an even number of blades the two are the same
motion turned by half a turn (`pytest tests/dynamics/test_march.py -k whole_turn`).

It begins from nothing: Sobol's points fill the box evenly, linear theory says which of
them are integrated; then CMA-ES (Hansen; package `cma`) starts at the best engine so
far that lies away from all earlier starts, again and again. Engines that show all four
motions of the paper at the default inputs are computed at once at half and twice the
step, with 88 and 132 modes and in `exact`; the first whose motions are right in all of
them ends the search, or the time does. What was found, or else the best, is computed
whole: 51 speeds, clamped centre, Table 1.

The same command continues, and asks the same questions in the same order: DIR/screened
has a line for each engine. DIR/report.md holds the verdicts, DIR/engines.json all rows.
"""

from __future__ import annotations

import json
import time
import warnings
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

if not __package__:
    import sys

    sys.path.insert(0, str(Path(__file__).parents[1]))
from common import parser_of, table
from identify.full import FOUR, WHOLE, Found, Stage, compute
from identify.linear import growths, linear_miss
from identify.score import Row, divergent_near_270, pick, score_parts
from identify.screen import MOTIONS, about, cost, screened, words_right
from identify.space import (
    BOX,
    Engine,
    Floats,
    allowed,
    drawn,
    engine_at,
    engine_of_scene,
)

from hpcwhirl.scene import Scene

APART = 0.15  # of the box, rms a coordinate: starts are that far from one another


@dataclass(frozen=True)
class Plan:
    """How the box is searched; engines are counted, not seconds."""

    seed: int = 1
    drawn: int = 1024  # by linear theory
    screened: int = 64  # of them, the best
    population: int = 16
    spread: float = 0.12  # of the box, the first standard deviation
    patience: int = 12  # generations without a better engine that end a start
    generations: int = 50


def judged(engine: Engine) -> Row:
    """Return the cost of an engine, how many motions it shows, and its rows."""
    start = time.process_time()
    linear, rows = screened(engine)
    right = [words_right(rows, kind) for kind in ("table 2", "default")]
    return {"engine": engine, "cost": cost(linear, rows), "right": right, "rows": rows,
            "seconds": time.process_time() - start}  # fmt: skip


class Screen:
    """Costs of points: from the file of an earlier run, or computed by processes.

    held : inputs that all engines have beside the unknowns
    """

    def __init__(self, path: Path, workers: int, held: Engine) -> None:
        self.path, self.held, self.asked = path, held, list[Row]()
        context = get_context("spawn")
        self.pool = ProcessPoolExecutor(workers, context) if workers > 1 else None
        head = json.loads(json.dumps(about() | held))
        path.parent.mkdir(parents=True, exist_ok=True)
        whole = path.read_bytes().rpartition(b"\n")[0] if path.exists() else b""
        lines = [json.loads(line) for line in whole.splitlines()] or [head]
        if lines[0] != head:
            raise SystemExit(f"identify: {path}: begun with another box, screening or "
                             "physics version; take another --out")  # fmt: skip
        # a kill leaves at most a last line without its end
        path.write_text("".join(json.dumps(line) + "\n" for line in lines))
        self.known = {_key(line["engine"]): line for line in lines[1:]}

    def costs(self, points: Floats) -> Floats:
        """Return the cost of each point of the unit cube, (engines,)."""
        engines = [allowed(engine_at(point) | self.held) for point in points]
        new = {_key(e): e for e in engines if _key(e) not in self.known}
        run = self.pool.map if self.pool else map
        for key, row in zip(new, run(judged, list(new.values())), strict=True):
            self.known[key] = row
            with self.path.open("a") as file:
                file.write(json.dumps(row) + "\n")
        rows = [self.known[_key(engine)] for engine in engines]
        self.asked += rows
        return np.array([row["cost"] for row in rows])


def _key(engine: Engine) -> tuple[Any, ...]:
    return tuple(engine.values())


def first_points(plan: Plan, held: Engine) -> Floats:
    """Return the likeliest points of the box by linear theory."""
    filled = drawn(plan.drawn, plan.seed)
    costs = [linear_miss(growths(allowed(engine_at(p) | held))) for p in filled]
    return filled[np.argsort(costs, kind="stable")[: plan.screened]]


def next_start(points: Floats, costs: Floats, starts: Floats) -> Floats:
    """Return the best point that lies apart from all starts; (coordinates,)."""
    order = np.argsort(costs, kind="stable")
    for point in np.clip(points[order], 0.0, 1.0):
        away = np.sqrt(((starts - point) ** 2).mean(axis=1))
        if away.min(initial=np.inf) > APART:
            return np.asarray(point)
    return np.asarray(points[order[0]])


def descend(
    start: Floats, costs: Any, plan: Plan, number: int
) -> Iterator[tuple[Floats, Floats]]:
    """Yield (points, costs) of the generations from a start until it stands still."""
    import cma  # only a search needs it

    chance = np.random.default_rng([plan.seed, number])
    options = {
        "bounds": [0.0, 1.0], "popsize": plan.population, "verbose": -9,
        "seed": np.nan, "randn": lambda *shape: chance.standard_normal(shape),
        "tolflatfitness": plan.generations, "signals_filename": "",
    }  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        strategy = cma.CMAEvolutionStrategy(list(start), plan.spread, options)
    best, since = np.inf, 0
    for _ in range(plan.generations):
        points = np.array(strategy.ask())
        found = costs(points)
        strategy.tell(list(points), list(found))
        yield points, found
        since = 0 if found.min() < best - 1e-3 else since + 1
        best = min(best, found.min())
        if since >= plan.patience or strategy.stop():
            return


def search(screen: Screen, plan: Plan) -> Iterator[str]:
    """Yield where it is after each batch; for ever: the caller ends it."""
    points, costs = np.empty((0, len(BOX))), np.empty(0)
    likely = first_points(plan, screen.held)
    for batch in np.array_split(likely, plan.screened // plan.population or 1):
        found = screen.costs(batch)
        points, costs = np.vstack([points, batch]), np.append(costs, found)
        yield "drawn"
    starts = points[:0]
    for number in range(10**6):
        start = next_start(points, costs, starts)
        best = (np.inf, start)
        for batch, found in descend(start, screen.costs, plan, number):
            points, costs = np.vstack([points, batch]), np.append(costs, found)
            best = min(best, (found.min(), batch[found.argmin()]), key=lambda x: x[0])
            yield f"start {number + 1}"
        starts = np.vstack([starts, start, best[1]])


def found_by(
    screen: Screen, plan: Plan, args: Any, four: Stage
) -> tuple[list[Found], bool]:
    """Search; return what was tried at full numerics, and whether the last holds."""
    begun, tried, looked = time.monotonic(), list[Found](), 0
    for stage in search(screen, plan):
        minutes = (time.monotonic() - begun) / 60
        best = min(row["cost"] for row in screen.asked)
        right = max(row["right"][0] for row in screen.asked)
        print(f"{minutes:6.1f} min: {stage}, {len(screen.asked)} engines, "
              f"best cost {best:.3f}, {right} motions", flush=True)  # fmt: skip
        for row in screen.asked[looked:]:
            if row["right"] == [len(MOTIONS)] * 2:
                tried += compute([row["engine"]], four, args.out, args.workers)
                print("four motions when screened;", tried[-1].words, flush=True)
                if tried[-1].holds:
                    return tried, True
        looked = len(screen.asked)
        if minutes > args.minutes or 0 < args.engines <= looked:
            break
    return tried, False


def targets_table(rows: Sequence[Row]) -> list[str]:
    """Return every target with what was found and whether that agrees."""
    sweep = pick(rows, "table 2")
    told = {"270": divergent_near_270(sweep)}
    told |= {f"{s:g}": sweep.get(s) for s in (410.0, 420.0, 520.0)}
    cells = []
    for name, (won, most) in score_parts(rows).items():
        row = told.get(name.split()[0])
        found = motion_in_words(row) if row else f"damped: {won / most:.0%} of them"
        verdict = "agrees" if won == most else "misses" if won == 0 else "in part"
        cells.append([name, f"{won:.3g} of {most:g}", verdict, found])
    return table(["target", "points", "verdict", "found"], cells)


def motion_in_words(row: Row) -> str:
    """Return what a case does, in words and numbers."""
    if row["status"] != "ok":
        return "failed"
    return (
        f"{row['speed']:g}: {row['regime']} {row['whirl']}, "
        f"growth {row['growth_rate']:.2g}/s, line {row['line_frequency']:+.0f} rad/s, "
        f"radius {row['orbit_radius'] / row['gap']:.2g} gaps"
    )


def report(screen: Screen, tried: list[Found], whole: list[Found], out: Path) -> None:
    """Write engines.json and report.md."""
    asked = list({_key(row["engine"]): row for row in screen.asked}.values())
    right = [row["right"][0] for row in asked]
    counts = ", ".join(f"{right.count(n)} with {n}" for n in (4, 3, 2, 1, 0))
    told = (
        f"{len(asked)} engines screened, {sum(len(row['rows']) for row in asked)} "
        f"cases, {sum(row['seconds'] for row in asked):.0f} s of processor time; of "
        f"the four motions: {counts}. At full numerics {len(tried)} tried, "
        f"{sum(item.holds for item in tried)} with all four in every one."
    )
    lines = ["# Engines with the motions of the paper", "", told, ""]
    default = engine_of_scene(Scene())
    for item in whole:
        whose = " (the default)" if item.engine.items() >= default.items() else ""
        unknowns = ", ".join(f"{name} = {v:g}" for name, v in item.engine.items()
                             if name in default)  # fmt: skip
        lines += [f"## Computed whole, score {item.score:.3f}{whose}", "", unknowns, "",
                  *targets_table(item.rows), ""]  # fmt: skip
    (out / "report.md").write_text("\n".join(lines))
    facts = {"screened": sorted(asked, key=lambda row: row["cost"])[:20]}
    for name, items in (("tried", tried), ("whole", whole)):
        facts[name] = [{"engine": item.engine, "score": item.score, "rows": item.rows}
                       for item in items]  # fmt: skip
    (out / "engines.json").write_text(json.dumps(facts, indent=1) + "\n")


def arguments(words: Sequence[str] | None) -> Any:
    """Return what was asked for."""
    parser = parser_of(__doc__)
    add = parser.add_argument
    add("--out", type=Path, default=Path("build/identify"))
    add("--minutes", type=float, default=180.0, help="of the search")
    add("--workers", type=int, default=1, help="processes")
    add("--engines", type=int, default=0, help="screened at most")
    add("--seed", type=int, default=1, help="of chance")
    add("--rotation", choices=("none", "full"), default="none", help="terms of all")
    add("--short", action="store_true", help="show that it works")
    return parser.parse_args(words)


def main(words: Sequence[str] | None = None) -> int:
    """Search and write the report; 1 where no engine has all four motions."""
    args = arguments(words)
    plan, four, last = Plan(seed=args.seed), FOUR, WHOLE
    if args.short:
        tiny = {"duration": 4e-3, "time_step": 4e-6, "revolutions": 0.2}
        args.engines, four = 8, replace(FOUR, other=("eta 88",), **tiny)
        plan = replace(plan, drawn=16, screened=4, generations=1)
        last = replace(four, name="whole", clamped=(270.0,), table1=(420.0,))
    held = {"engine.rotation": args.rotation} if args.rotation != "none" else {}
    screen = Screen(args.out / "screened", args.workers, held)
    try:
        tried, holds = found_by(screen, plan, args, four)
    finally:
        if screen.pool:
            screen.pool.shutdown(cancel_futures=True)
    best = min(screen.asked, key=lambda row: (-row["right"][0], row["cost"]))
    engines = [tried[-1].engine if holds else best["engine"]]
    engines.append(allowed(engine_of_scene(Scene()) | held))
    whole = [item for engine in engines
             for item in compute([engine], last, args.out, args.workers)]  # fmt: skip
    report(screen, tried, whole, args.out)
    print(f"identify: {int(holds)} engines with all four motions; report in "
          f"{args.out / 'report.md'}")  # fmt: skip
    return 0 if holds else 1


if __name__ == "__main__":
    raise SystemExit(main())
