"""How far a preset's regime map is to be trusted: 750 cases, against `reference`.

    python scripts/evidence/preset_map.py [DIR] [--ranks 2] [--write]
    python scripts/evidence/preset_map.py [DIR] --rotation full [--every 3]

Three engines, two named ones and one whose ring lets motion grow, at 25 speeds and 10
gaps each, 2.5 s. Runs the campaign with each preset (resumable), prints seconds of the
whole commands, the confusion of regimes, how many cells differ where the reference's
map has no boundary (the same words in all neighbouring cells), and the map: d(amped),
s(ustained), v (divergent) or u(ndecided), a capital where any preset gives another one.
With --write, the presets tell their agreement (scripts/evidence/presets.py drops it
where it changes a preset). `--rotation full` has all terms of rotation, `--every` takes
every so many of the speeds and gaps; neither is written.
"""

from __future__ import annotations

import sys
import time
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.benchmark.trials import trials
from hpcwhirl.scene import engine_inputs, preset_names
from hpcwhirl.scene.input_names import full_name
from hpcwhirl.store.reading.reader import words

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import parser_of, results_of, working_folder
from evidence.agreement import confusion
from evidence.presets import PATH, write

ENGINES = ("four_motions", "mostly_damped", "rubbing")  # named; jobs/light_ring.toml's
SPEEDS = [float(s) for s in np.linspace(40.0, 520.0, 25)]
GAPS = [float(f"{g:.3g}") for g in np.geomspace(0.8e-4, 4e-4, 10)]
Names = NDArray[np.str_]


@dataclass(frozen=True)
class Grid:
    """What is mapped: the rotation of all cases, speeds, rad/s, and gaps, m."""

    rotation: str
    speeds: list[float]
    gaps: list[float]


LETTERS = {"damped": "d", "sustained": "s", "divergent": "v", "undecided": "u"}


def inputs_of(engine: str) -> dict[str, object]:
    """Return the inputs of an engine by their dotted names."""
    if engine != "rubbing":
        own = engine_inputs(engine)
        return {name: value for name, value in own.items() if name != "engine.name"}
    ring = trials()["scenes"]["sustained backward"]
    return {full_name(name): v for name, v in ring.items() if name != "speed"}


def mapped(
    engine: str, preset: str, grid: Grid, folder: Path, ranks: int
) -> tuple[Names, float]:
    """Return regimes (gaps, speeds) and the seconds of the whole command."""
    shared = inputs_of(engine)
    if grid.rotation != "none":
        shared["engine.rotation"] = grid.rotation
    cases = [
        {"speed": speed, "gap": gap, **shared}
        for gap in grid.gaps
        for speed in grid.speeds
    ]
    document = {"output": {"traces": "summary"}, "cases": cases}
    out, start = folder / f"{engine}-{preset}", time.perf_counter()
    data = results_of(document, out, "--preset", preset, ranks=ranks)
    seconds = time.perf_counter() - start
    return words(data.regime).reshape(len(grid.gaps), len(grid.speeds)), seconds


def inside(regimes: Names) -> NDArray[np.bool_]:
    """Return where all neighbours, diagonal ones too, have a cell's own word."""
    padded = np.pad(regimes, 1, mode="edge")
    rows, columns = regimes.shape
    near = [
        padded[i : i + rows, j : j + columns] == regimes
        for i in range(3)
        for j in range(3)
    ]
    return np.asarray(np.logical_and.reduce(near))


def compared(preset: str, maps: dict[str, dict[str, Names]]) -> str:
    """Print a preset's confusion with the reference; return it in a few words."""
    pairs: list[tuple[str, str]] = []
    far, counts = 0, []
    for engine, found in maps.items():
        true, got = found["reference"], found[preset]
        pairs += zip(true.ravel(), got.ravel(), strict=True)
        far += int(((got != true) & inside(true)).sum())
        counts.append(f"{engine} {(got == true).sum()}")
    each = next(iter(maps.values()))["reference"].size
    told = f"of {each} regimes on a map, as reference: {', '.join(counts)}"
    print(f"{preset}: {told}; {far} differ away from a boundary of the map")
    print(*confusion(pairs), sep="\n")
    return told


def show(engine: str, grid: Grid, found: dict[str, Names]) -> None:
    """Print the reference's map, capitals where a preset says something else."""
    true = found["reference"]
    gaps, speeds = grid.gaps, grid.speeds
    print(f"{engine}: gaps {1e3 * gaps[0]:g} (below) to {1e3 * gaps[-1]:g} mm over "
          f"{speeds[0]:g} to {speeds[-1]:g} rad/s")  # fmt: skip
    apart = np.any([regimes != true for regimes in found.values()], axis=0)
    for row, differs in zip(true[::-1], apart[::-1], strict=True):
        letters = [LETTERS[word] for word in row]
        print("    " + "".join(
            c.upper() if d else c for c, d in zip(letters, differs, strict=True)
        ))  # fmt: skip


def main() -> int:
    """Run everything and print; write into the presets' file if asked."""
    parser = parser_of(__doc__, write=PATH, folder="?")
    parser.add_argument("--ranks", type=int, default=2)
    parser.add_argument("--rotation", choices=["none", "full"], default="none")
    parser.add_argument("--every", type=int, default=1)
    args = parser.parse_args()
    grid = Grid(args.rotation, SPEEDS[:: args.every], GAPS[:: args.every])
    names, maps = preset_names(), {}
    with working_folder(args.folder, "presets") as folder:
        for engine in ENGINES:
            maps[engine] = {}
            for preset in names:
                maps[engine][preset], seconds = mapped(
                    engine, preset, grid, folder, args.ranks
                )
                print(f"{engine} engine, {preset}: {seconds:.1f} s")
    told = {preset: compared(preset, maps) for preset in names}
    for engine, found in maps.items():
        show(engine, grid, found)
    if args.write and grid == Grid("none", SPEEDS, GAPS):
        table = tomllib.loads(PATH.read_text())
        for preset in names[:-1]:
            table[preset]["regimes"] = told[preset]
        write(table)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
