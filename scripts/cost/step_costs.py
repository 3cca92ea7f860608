"""Times of steps as the planner foretells them against those measured, by size.

    python scripts/cost/step_costs.py [--sizes 22 57 ...] [--points 2 3] [--repeats N]
        [--write]

Motions are those of `scripts/cost/sizes.py`, and equal sectors by the other schemes;
foretold from number of blades, share of steps in contact and blades touching, relative
to the median of the run, as a campaign learns how fast its machine is. For `modal`, 36
and 57 blades with one contact point a tip were not fitted; several points, with which
at most 44 blades are timed, were, at 22, 36 and 44.
"""

from __future__ import annotations

import statistics
import sys
import tempfile
from collections.abc import Callable, Sequence
from functools import partial
from itertools import product
from pathlib import Path
from typing import NamedTuple

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import parser_of, table, tell
from cost.sizes import (
    CYCLIC,
    FLIGHT,
    GIVEN,
    RUBS,
    UNEQUAL,
    asked_of,
    requests_of,
    with_points,
)

from hpcwhirl.benchmark.bench import Timing, settled_all, time_marches
from hpcwhirl.scene import Scene, apply_settings
from hpcwhirl.scene.schemes import DEFAULT, NAMES, SCHEMES

PAGE = Path(__file__).with_suffix(".md")
CLOSE = 0.25  # relative
SIZES = 22, 36, 57
POINTS = 2, 3  # a tip, beside one


class Row(NamedTuple):
    """A motion by a scheme, and the time of its steps."""

    blades: int
    points: int
    sectors: str
    motion: str
    timing: Timing


def timed(
    scene: Scene,
    sizes: Sequence[int],
    repeats: int,
    several: Sequence[Callable[[Scene], Scene]],
) -> list[Row]:
    """Return the steps of `modal` and, of equal sectors, those of the other schemes.

    All rows take turns in each repeat, so that a machine that gets slower meanwhile
    makes no scheme or size look dearer than another.

    several : each returns a scene whose engine has several contact points a tip
    """
    requests = [row for n in sizes for row in requests_of(scene, n, several)]
    others = [name for name in NAMES if name != DEFAULT]
    for name, n, motion in product(others, sizes, (FLIGHT, GIVEN, RUBS)):
        requests.append((CYCLIC, motion, asked_of(scene, n, CYCLIC, motion, name)))
    sectors, motions, asked = zip(*requests, strict=True)
    marches = settled_all(asked)
    timings = time_marches(asked, marches, repeats)
    models = [march.model for march in marches]
    return [
        Row(model.blades, model.each, *of_row)
        for model, *of_row in zip(models, sectors, motions, timings, strict=True)
    ]


def foretold(row: Row) -> float:
    """Return the time of a step that the planner's formula gives, us."""
    found, uneven = row.timing, row.sectors == UNEQUAL
    return 1e6 * float(
        SCHEMES[found.scheme].step_seconds(
            "none", row.blades, uneven=uneven, share=found.contact,
            touching=found.touching, points=row.points,
        )
    )  # fmt: skip


def compared(rows: list[Row]) -> str:
    """Return the comparison as Markdown."""
    ratios = [foretold(row) / row.timing.microseconds_per_step for row in rows]
    middle = statistics.median(ratios)
    head = ("scheme", "blades", "points", "sectors", "motion", "in contact", "touching",
            "foretold, µs", "measured, µs", "foretold / measured, over the median",
            )  # fmt: skip
    lines = [
        [
            row.timing.scheme, row.blades, row.points, row.sectors, row.motion,
            f"{row.timing.contact:.0%}", f"{row.timing.touching:.1f}",
            f"{foretold(row):.3f}",
            f"{row.timing.microseconds_per_step:.3f}",
            f"{ratio / middle:.2f}" + " ✗" * (abs(ratio / middle - 1.0) > CLOSE),
        ]
        for row, ratio in zip(rows, ratios, strict=True)
    ]  # fmt: skip
    close = sum(abs(ratio / middle - 1.0) <= CLOSE for ratio in ratios)
    return "\n".join(table(head, lines)) + (
        f"\n\nWithin {CLOSE:.0%}: {close} of {len(rows)} (✗: not); median {middle:.2f}."
    )


def main() -> None:
    """Time, compare and print."""
    parser = parser_of(__doc__, write=PAGE)
    parser.add_argument("--sizes", type=int, nargs="+", default=SIZES)
    parser.add_argument("--points", type=int, nargs="*", default=POINTS)
    parser.add_argument("--repeats", type=int, default=3)
    args = parser.parse_args()
    scene = apply_settings(Scene(), {"plan": "everything"})  # leave out no step
    with tempfile.TemporaryDirectory(prefix="hpcwhirl-steps-") as folder:
        several = [partial(with_points, Path(folder), points=n) for n in args.points]
        told = compared(timed(scene, args.sizes, args.repeats, several))
    tell(told, PAGE if args.write else None)


if __name__ == "__main__":
    main()
