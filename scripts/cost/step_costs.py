"""Times of steps as the planner foretells them against those measured, by size.

    python scripts/cost/step_costs.py [--sizes 22 57 ...] [--repeats N] [--write]

Motions are those of `hpcwhirl bench --sizes`, scheme `modal`; foretold from number of
blades, share of steps in contact and blades touching, relative to the median of the
run, as a campaign learns how fast its machine is. 36 and 57 were not fitted.
"""

from __future__ import annotations

import argparse
import statistics
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import table

from hpcwhirl.benchmark.bench import fma_peak
from hpcwhirl.benchmark.sizes import UNEQUAL, Row, rows_of
from hpcwhirl.scene import Scene, apply_settings, schemes
from hpcwhirl.scene.schemes import DEFAULT

PAGE = Path(__file__).with_suffix(".md")
CLOSE = 0.25  # relative
SIZES = 22, 36, 57


def foretold(row: Row) -> float:
    """Return the time of a step that the planner's formula gives, us."""
    times = schemes.UNEQUAL if row.sectors == UNEQUAL else schemes.EQUAL
    return float(times.step(row.blades, row.timing.contact, row.timing.touching))


def page(rows: list[Row]) -> str:
    """Return the comparison as Markdown."""
    ratios = [foretold(row) / row.timing.microseconds_per_step for row in rows]
    middle = statistics.median(ratios)
    head = ("blades", "sectors", "motion", "in contact", "touching", "foretold, µs",
            "measured, µs", "foretold / measured, over the median",
            )  # fmt: skip
    lines = [
        [
            row.blades, row.sectors, row.motion, f"{row.timing.contact:.0%}",
            f"{row.timing.touching:.1f}", f"{foretold(row):.3f}",
            f"{row.timing.microseconds_per_step:.3f}",
            f"{ratio / middle:.2f}" + " ✗" * (abs(ratio / middle - 1.0) > CLOSE),
        ]
        for row, ratio in zip(rows, ratios, strict=True)
    ]  # fmt: skip
    close = sum(abs(ratio / middle - 1.0) <= CLOSE for ratio in ratios)
    return "\n".join([
        "# Steps foretold and measured", "",
        "Made by `python scripts/cost/step_costs.py --write`, beside other work.", "",
        *table(head, lines), "",
        f"Within {CLOSE:.0%}: {close} of {len(rows)} (✗: not); median {middle:.2f}.",
        "",
    ])  # fmt: skip


def main() -> None:
    """Time, compare and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--sizes", type=int, nargs="+", default=SIZES)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--write", action="store_true", help=f"also to {PAGE.name}")
    args = parser.parse_args()
    scene = apply_settings(Scene(), {"plan": "everything"})  # leave out no step
    found = rows_of(scene, args.sizes, args.repeats, fma_peak(args.repeats))
    told = page([row for row in found if row.timing.scheme == DEFAULT])
    print(told)
    if args.write:
        PAGE.write_text(told)


if __name__ == "__main__":
    main()
