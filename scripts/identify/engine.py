"""Search for what the paper does not give: casing, dampings and pulse.

    python scripts/identify/engine.py --out DIR [--minutes 180] [--workers 2]
                                      [--rotation full]

The unknowns are in `identify.space`, what leads the search in `identify.guide`, what
judges engines in `identify.score`, written down before. Whether the pulse squeezes or
stretches is no unknown: with k = 1 and an even number of blades the two are the same
motion turned by half a turn (`pytest tests/dynamics/test_march.py -k whole_turn`).

It begins from nothing: `identify.search` screens engines at a fast preset of fixed
sizes, the best at the default inputs, too. Those that show all four motions of the
paper there are computed at once at half and twice the step, with 88 and 132 modes and
in `exact`; an engine whose four motions are right in all of them is found, and the
search ends with as many as `--enough` asks for, or when the time has gone. With
`--firm` an engine counts only if each of its unknowns may be 1 % off, down and up.
What was found, or else the best, is computed whole: 51 speeds, clamped centre, Table 1.

The same command continues, and asks the same questions in the same order. DIR/screened
holds every engine screened, DIR/report.md the verdicts, DIR/engines.json all that was
computed, to read by a program.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
from identify.full import BESIDE, FOUR, WHOLE, Found, Stage, compute, count_beside
from identify.guide import WORDS, cost, shows_all, words_right
from identify.kept import Kept, engine_of
from identify.report import write_report
from identify.screen import about
from identify.search import Plan, Screen, Told, search
from identify.space import Engine, allowed, default_engine, engine_of_scene

from hpcwhirl.errors import InputError
from hpcwhirl.scene import Scene, apply_settings, parse_setting

PROGRESS = 30.0  # s between lines


@dataclass
class Limits:
    """When a search ends, and with what it is computed."""

    minutes: float = 180.0
    engines: int = 0  # screened; 0: no limit
    enough: int = 1
    workers: int = 1
    firm: bool = False
    stages: tuple[Stage, Stage, Stage] = (FOUR, BESIDE, WHOLE)
    rotation: str = "none"


@dataclass
class Search:
    """A search within limits, and what it has found."""

    out: Path
    plan: Plan
    limits: Limits
    seeds: tuple[Engine, ...] = ()
    tried: list[Found] = field(default_factory=list)  # at full numerics
    whole: list[Found] = field(default_factory=list)
    start: float = field(default_factory=time.monotonic)

    def __post_init__(self) -> None:
        held = {"engine.rotation": self.limits.rotation}
        self.held = held if self.limits.rotation != "none" else {}
        self.kept = Kept(self.out / "screened", about() | self.held)
        self.screen = Screen(self.kept, self.limits.workers, self.held)
        self.said, self.looked = -PROGRESS, 0

    @property
    def found(self) -> list[Found]:
        """Engines whose four motions hold in all numerics, and beside if asked for."""
        firm = self.limits.firm
        return [item for item in self.tried if (item.firm if firm else item.holds)]

    @property
    def minutes(self) -> float:
        """Time since this command began."""
        return (time.monotonic() - self.start) / 60

    def run(self) -> None:
        """Search until there is enough or no time is left, then compute the best."""
        try:
            for told in search(self.screen, self.plan, self.seeds):
                self._say(told)
                self._try()
                if self._over():
                    break
        finally:
            self.screen.close()
        self._conclude()

    def best(self) -> list[Engine]:
        """Return the engines that were asked for, the most promising first."""
        worth = {key: (-words_right(rows), cost(rows))
                 for key, rows in self.screen.asked.items()}  # fmt: skip
        keys = sorted(worth, key=lambda key: worth[key])
        return [engine_of(key) | self.held for key in keys]

    def _say(self, told: Told) -> None:
        now = time.monotonic()
        if now - self.said < PROGRESS:
            return
        self.said = now
        print(
            f"{self.minutes:6.1f} min, {self.kept.seconds:.0f} s of computing: "
            f"{told.stage}, {told.engines} engines, best cost {told.best:.3f}, "
            f"{told.words} of {len(WORDS)} motions",
            flush=True,
        )

    def _over(self) -> bool:
        most = self.limits.engines
        late = self.minutes > self.limits.minutes
        return self._enough() or late or 0 < most <= len(self.screen.asked)

    def _try(self) -> None:
        """Compute those of the last batch that have all four motions in full."""
        rows = self.screen.asked
        new = [key for key in list(rows)[self.looked :] if shows_all(rows[key])]
        self.looked = len(rows)
        four, beside, _ = self.limits.stages
        for key in new:
            if self._enough():
                break
            engine = engine_of(key) | self.held
            (item,) = compute([engine], four, self.out, self.limits.workers)
            if item.holds:
                count_beside(item, beside, self.out, self.limits.workers)
            self.tried.append(item)
            told = ", ".join(f"{kind} {count}" for kind, count in item.words.items())
            print(f"{self.minutes:6.1f} min: four motions when screened; {told}; "
                  f"beside {item.beside:g}", flush=True)  # fmt: skip
        if new:
            self.save()

    def _enough(self) -> bool:
        return len(self.found) >= self.limits.enough

    def _conclude(self) -> None:
        """Compute the best whole: what was found, or what came nearest."""
        best = [item.engine for item in self.found][: self.limits.enough]
        best = best or self.best()[:1]
        default = allowed(default_engine() | self.held)
        engines = best + [e for e in [default] if e not in best]
        for engine in engines:
            stage, ranks = self.limits.stages[-1], self.limits.workers
            self.whole += compute([engine], stage, self.out, ranks)
            self.save()

    def save(self) -> None:
        """Write engines.json and report.md."""
        write_report(self)


def seed_engine(text: str) -> Engine:
    """Return an engine of `name=value` pairs, others as in the package."""
    try:
        settings = dict(parse_setting(pair) for pair in text.split())
        return engine_of_scene(apply_settings(Scene(), settings))
    except InputError as wrong:
        raise argparse.ArgumentTypeError(str(wrong)) from None


def short_limits(limits: Limits) -> Limits:
    """Return limits that only show that every part works."""
    tiny = {"duration": 4e-3, "time_step": 4e-6, "revolutions": 0.2}
    four = replace(FOUR, other=("eta 88",), **tiny)
    whole = replace(WHOLE, speeds=FOUR.speeds, clamped=(270.0,), table1=(420.0,),
                    other=("eta 88",), **tiny)  # fmt: skip
    return replace(limits, engines=8, stages=(four, replace(BESIDE, **tiny), whole))


def parser() -> argparse.ArgumentParser:
    """Return the options."""
    told = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    told.add_argument("--out", type=Path, default=Path("build/identify"))
    told.add_argument("--minutes", type=float, default=180.0, help="of the search")
    told.add_argument("--workers", type=int, default=1, help="processes")
    told.add_argument("--enough", type=int, default=1, help="engines to be found")
    told.add_argument("--firm", action="store_true", help="hold 1 %% off, too")
    told.add_argument("--engines", type=int, default=0, help="screened at most")
    told.add_argument("--seed", type=int, default=1, help="of chance")
    told.add_argument("--spread", type=float, default=Plan.spread, help="of a start")
    told.add_argument("--rotation", choices=("none", "full"), default="none",
                      help="terms of rotation of all engines")  # fmt: skip
    told.add_argument("--short", action="store_true", help="show that it works")
    told.add_argument(
        "--seed-engine", type=seed_engine, action="append", default=[],
        metavar="'NAME=VALUE ...'", help="begin with this engine, not with the box",
    )  # fmt: skip
    return told


def main(words: Sequence[str] | None = None) -> int:
    """Search and write the report; 1 where no engine has all four motions."""
    args = parser().parse_args(words)
    limits = Limits(
        args.minutes, args.engines, args.enough, args.workers, firm=args.firm,
        rotation=args.rotation,
    )  # fmt: skip
    plan = Plan(seed=args.seed, spread=args.spread)
    if args.short:
        limits, plan = (
            short_limits(limits),
            replace(plan, drawn=16, screened=4, generations=1),
        )
    run = Search(args.out, plan, limits, tuple(args.seed_engine))
    run.run()
    print(f"identify: {len(run.found)} engines with all four motions; report in "
          f"{args.out / 'report.md'}")  # fmt: skip
    return 0 if run.found else 1


if __name__ == "__main__":
    raise SystemExit(main())
