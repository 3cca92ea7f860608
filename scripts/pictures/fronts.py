"""Draw what accuracy costs on three engines: the fronts that `hpcwhirl tradeoff` finds.

    python scripts/pictures/fronts.py [--out .pictures/fronts.png] [--cases N]

The engines are the first three of the claim `wishes` (scripts/evidence/populations),
the second one with `rotation = "full"`. Of each, N cases of its campaign (default 8)
are drawn and computed with all settings. Shown is the error of the tips' peak that nine
cases in ten are below, over the processor time against that of preset `reference`.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import parser_of
from evidence.populations.wishes import REPEATS, drawn

from hpcwhirl.benchmark.drawing import drawn_cases
from hpcwhirl.benchmark.tradeoff import Row, measure
from hpcwhirl.benchmark.trials import BOTH, PRESET, settings_of
from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.report.canvas import in_defaults, new_figure, save

SEED, ENGINES = 45, (0, 1, 2)
TURNING = 1  # the engine with all terms of rotation
PEAK = "blade_peak"
SMALLEST = 1e-4  # smallest error that is shown
COLOURS = "#3F86B5", "#C63D0F", "#4d4d4d"


def tables_of(index: int) -> dict[str, Any]:
    """Return the tables of an engine's campaign."""
    document = drawn(SEED, index)
    if index == TURNING:
        document["engine"]["rotation"] = "full"
    return document


def measured(index: int, count: int) -> list[Row]:
    """Return what settings cost and lose on drawn cases of an engine, by cost."""
    design = Design.of(tables_of(index))
    cases = drawn_cases(design, count)
    found = measure(cases, settings_of([PRESET, BOTH]), REPEATS)
    known = [row for row in found.rows if PEAK in row.errors]
    return sorted(known, key=lambda row: row.cost)


def point_of(row: Row) -> tuple[float, float]:
    """Return cost and error of a setting."""
    return row.cost, max(row.errors[PEAK].nine.value, SMALLEST)


def front_of(rows: list[Row]) -> list[Row]:
    """Return the settings, by cost, than which no cheaper one has a smaller error."""
    out: list[Row] = []
    for row in rows:
        if not out or point_of(row)[1] < point_of(out[-1])[1]:
            out.append(row)
    return out


def label_of(index: int) -> str:
    """Return the name of an engine in the legend."""
    engine = tables_of(index)["engine"]
    turns = ", rotation full" if index == TURNING else ""
    return f"engine {index}, {engine['rotor']['blades']} blades{turns}"


@in_defaults
def draw(engines: dict[int, list[Row]], path: Path) -> Path:
    """Draw settings and front of each engine; return the path."""
    figure, axes = new_figure((8, 5))
    for colour, (index, rows) in zip(COLOURS, engines.items(), strict=True):
        axes.plot(*zip(*map(point_of, rows), strict=True), "o", ms=3, c=colour)
        front = front_of(rows)
        axes.step(*zip(*map(point_of, front), strict=True), where="post", c=colour,
                  label=label_of(index))  # fmt: skip
        for row in front:
            if "preset" in row.label:
                axes.annotate(row.label.split(" = ")[0].removeprefix("preset "),
                              point_of(row), fontsize=7, c=colour, xytext=(4, 4),
                              textcoords="offset points")  # fmt: skip
    axes.set(xscale="log", yscale="log",
             xlabel="processor time / that of preset reference",
             ylabel="error of the tips' peak, nine cases in ten below")  # fmt: skip
    axes.legend(fontsize=8)
    return save(figure, path)


def main() -> None:
    """Measure three engines and draw their fronts."""
    parser = parser_of(__doc__)
    parser.add_argument("--out", type=Path, default=Path(".pictures/fronts.png"))
    parser.add_argument("--cases", type=int, default=8)
    given = parser.parse_args()
    engines = {index: measured(index, given.cases) for index in ENGINES}
    for index, rows in engines.items():
        for row in front_of(rows):
            cost, error = point_of(row)
            print(f"{label_of(index)}: {row.label}: {cost:.3f}, {error:.2%}")
    print(draw(engines, given.out))


if __name__ == "__main__":
    main()
