"""The search: Sobol's points, then CMA-ES from the best of them, again and again.

Words are flat and most engines give none of the motions. The first engines fill the box
evenly; linear theory, which costs some 5 ms, says which of them are integrated. CMA-ES
(Hansen; package `cma`) then starts at the best engine so far that lies away from all
earlier starts, and makes `guide.cost` small until it stands still. All chance is seeded
and each population follows from the costs before it: with what was kept of an earlier
run the same questions are asked, and answered without computing.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from typing import Any

import numpy as np
from identify.guide import cost, words_right
from identify.kept import Kept, key_of
from identify.linear import linear_miss, linear_rows
from identify.score import Row
from identify.screen import timed
from identify.space import COORDINATES, Engine, allowed, drawn, engine_at, point_of
from numpy.typing import NDArray

Points = NDArray[np.float64]
Costs = Callable[[Points], NDArray[np.float64]]
APART = 0.15  # of the box, rms a coordinate: starts are that far from one another


@dataclass(frozen=True)
class Plan:
    """How the box is searched; engines are counted, not seconds."""

    seed: int = 1
    drawn: int = 1024  # by linear theory
    screened: int = 64  # of them, the best
    batch: int = 16
    population: int = 16
    spread: float = 0.12  # of the box, the first standard deviation
    patience: int = 12  # generations without a better engine that end a start
    generations: int = 50


class Screen:
    """Costs of engines: from what was kept, or computed by so many processes.

    held : inputs that all engines have beside the unknowns
    """

    def __init__(self, kept: Kept, workers: int, held: Engine | None = None) -> None:
        self.kept, self.asked = kept, dict[tuple[float, ...], list[Row]]()
        self.held = held or {}
        self.pool: ProcessPoolExecutor | None = None
        if workers > 1:
            self.pool = ProcessPoolExecutor(workers, mp_context=get_context("spawn"))

    def close(self) -> None:
        """End the processes."""
        if self.pool is not None:
            self.pool.shutdown(cancel_futures=True)

    def rows(self, engines: Sequence[Engine]) -> list[list[Row]]:
        """Return the rows of engines; those computed are kept, one by one."""
        engines = [allowed(engine | self.held) for engine in engines]
        new = {key_of(e): e for e in engines if key_of(e) not in self.kept.rows}
        run = self.pool.map if self.pool is not None else map
        answers = run(timed, list(new.values()))
        for engine, (rows, seconds) in zip(new.values(), answers, strict=True):
            self.kept.add(engine, rows, seconds)
        found = [self.kept.rows[key_of(engine)] for engine in engines]
        self.asked |= {key_of(e): r for e, r in zip(engines, found, strict=True)}
        return found

    def costs(self, points: Points) -> NDArray[np.float64]:
        """Return the cost of each point of the unit cube, (engines,)."""
        return np.array([cost(r) for r in self.rows([engine_at(p) for p in points])])


def first_points(plan: Plan, seeds: Sequence[Engine], held: Engine) -> Iterator[Points]:
    """Yield batches: of the box the likeliest, or no other than engines given.

    held : see `Screen`
    """
    if seeds:
        yield np.array([point_of(engine) for engine in seeds])
        return
    filled = drawn(plan.drawn, plan.seed)
    costs = [
        linear_miss(linear_rows(allowed(engine_at(point) | held))) for point in filled
    ]
    points = filled[np.argsort(costs, kind="stable")[: plan.screened]]
    for at in range(0, len(points), plan.batch):
        yield points[at : at + plan.batch]


def next_start(points: Points, costs: NDArray[np.float64], starts: Points) -> Points:
    """Return the best point that lies apart from all starts; (coordinates,)."""
    order = np.argsort(costs, kind="stable")
    for point in np.clip(points[order], 0.0, 1.0):
        away = np.sqrt(((starts - point) ** 2).mean(axis=1))
        if not len(starts) or away.min() > APART:
            return np.asarray(point)
    return np.asarray(points[order[0]])


def _strategy(start: Points, plan: Plan, number: int) -> Any:
    """Return CMA-ES at a start, its chance its own."""
    import cma  # only a search needs it

    chance = np.random.default_rng([plan.seed, number])
    options = {
        "bounds": [0.0, 1.0], "popsize": plan.population, "verbose": -9,
        "seed": np.nan, "randn": lambda *shape: chance.standard_normal(shape),
        "tolflatfitness": plan.generations, "signals_filename": "",
    }  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        return cma.CMAEvolutionStrategy(list(start), plan.spread, options)


def descend(
    start: Points, costs: Costs, plan: Plan, number: int
) -> Iterator[tuple[Points, NDArray[np.float64]]]:
    """Yield (points, costs) of the generations from a start until it stands still."""
    strategy = _strategy(start, plan, number)
    best, since = np.inf, 0
    for _ in range(plan.generations):
        points = np.array(strategy.ask())
        found = costs(points)
        strategy.tell(list(points), list(found))
        yield points, found
        better = found.min() < best - 1e-3
        best, since = min(best, found.min()), 0 if better else since + 1
        if since >= plan.patience or strategy.stop():
            return


@dataclass
class Told:
    """How far a search is, after a batch of engines."""

    stage: str
    engines: int
    best: float
    words: int  # right, of the best by words


def search(screen: Screen, plan: Plan, seeds: Sequence[Engine] = ()) -> Iterator[Told]:
    """Yield after each batch; for ever: the caller ends it."""
    points = np.empty((0, len(COORDINATES)))
    costs = np.empty(0)

    def told(stage: str) -> Told:
        words = max(words_right(rows) for rows in screen.asked.values())
        return Told(stage, len(screen.asked), float(costs.min()), words)

    for batch in first_points(plan, seeds, screen.held):
        points, costs = (
            np.vstack([points, batch]),
            np.append(costs, screen.costs(batch)),
        )
        yield told("drawn")
    starts = points[:0]
    for number in range(10**6):
        start = next_start(points, costs, starts)
        starts = np.vstack([starts, start])
        best = (np.inf, start)
        for batch, found in descend(start, screen.costs, plan, number):
            points, costs = np.vstack([points, batch]), np.append(costs, found)
            if found.min() < best[0]:
                best = (found.min(), batch[found.argmin()])
            yield told(f"start {number + 1}")
        starts = np.vstack([starts, best[1]])
