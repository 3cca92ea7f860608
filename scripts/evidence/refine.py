"""What refinement saves and what it loses, against a dense grid in `standard`.

    python scripts/evidence/refine.py [DIR] [--engine NAME[:K]]... [--duration S]
                                      [--ranks N] [--compute NAME]... [--write]

Both engines of `preset_map.py` over (speed, gap), the gap by its logarithm. The
reference is a grid of 241 x 81 cases in `standard`; with K = 2, 4, 8 it has 129 x
33, 65 x 17, 33 x 9. Campaigns are resumable, and a finer one goes on from a coarser.

The cases of a refined campaign are among those of the dense ones in `draft` and
`standard`, and which they are follows from words: they are looked up there, with their
core-seconds, for several coarse levels. With --compute, the refined campaign of an
engine is computed as well, on so many ranks, and has to have the same cases and words.

For each coarse level: shares of cases and of core-seconds in the kernel by the
processor's clock, share of the reference's points outside speckle that have the same
word, and tongues missed.
Speckle: points where more than 0.3 of the pairs of neighbours within 5 x 5 points
differ in the reference. What no map does without: corners of the reference's mixed
cells. Tongue: what is connected and of one word there, and somewhere 3 x 3 points wide;
it is missed where no point of it has its word. With --write, all goes to
scripts/evidence/refine.md.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from numpy.typing import NDArray
from scipy import ndimage

import hpcwhirl
from hpcwhirl.refinement.boundary import Cells
from hpcwhirl.refinement.growth import Address, Growth
from hpcwhirl.refinement.lattice import Lattice, Side
from hpcwhirl.refinement.tree import Tree
from hpcwhirl.store.directory.runs import Runs
from hpcwhirl.store.reading.grid import nearest_cases
from hpcwhirl.store.reading.reader import words

if __package__ is None or __package__ == "":
    sys.path.insert(0, str(Path(__file__).parents[1]))
from common import MPIRUN, parser_of, results_of, table, tell, working_folder
from evidence.preset_map import inputs_of

PAGE = Path(__file__).with_suffix(".md")
# coarser: coarse values along speed and gap, levels; the first is what is computed
SIZES = {
    1: [(16, 6, 4), (31, 11, 3)],
    2: [(9, 3, 4), (17, 5, 3)],
    4: [(9, 3, 3), (17, 5, 2)],
    8: [(9, 3, 2), (17, 5, 1)],
}
ENGINES = ("mostly_damped", "rubbing")
SPEEDS, GAPS = (40.0, 520.0), (0.8e-4, 4e-4)
SPECKLE = 2  # levels, as [refine] has them where nothing is said
UNLIKE = 0.3
DRAFT, STANDARD = "draft", "standard"
# seconds of the kernel by the processor's clock: others on the machine count less
TIMED = (
    "import sys, time; time.perf_counter = time.process_time; "
    "from hpcwhirl.cli import main; raise SystemExit(main(sys.argv[1:]))"
)
GOALS = (
    "grid", "refined from",
    "corners of cells whose corners differ, of dense draft's points",
    "refined draft, of dense draft's cases",
    "confirmed, of dense standard's core-seconds",
    "of which no map of these words does without",
    "alike outside speckle, confirmed", "tongues missed",
)  # fmt: skip
Names = NDArray[np.str_]
Floats = NDArray[np.float64]
Size = tuple[int, int, int]  # coarse values of speed and gap, levels


@dataclass
class Dense:
    """Words and core-seconds of all points of a grid, (speeds, gaps), in a preset."""

    words: Names
    seconds: Floats


def sides(size: Size) -> tuple[Side, Side]:
    """Return speed and gap with the coarse values and all levels."""
    across, up, levels = size
    speeds = tuple(float(v) for v in np.linspace(*SPEEDS, across))
    gaps = tuple(float(f"{v:.6g}") for v in np.geomspace(*GAPS, up))
    return (
        Side("speed", speeds, (levels,) * (across - 1)),
        Side("gap", gaps, (levels,) * (up - 1), "log"),
    )


def dense(side: Side) -> list[float]:
    """Return all values of an input."""
    return [side.value(place) for place in range(side.last + 1)]


def designed(
    engine: str, duration: float, both: tuple[Side, Side], preset: str = ""
) -> dict[str, Any]:
    """Return the campaign of an engine: dense in a preset, or refined and confirmed."""
    scene = {"duration": duration, "speed": 300.0}
    document: dict[str, Any] = {"output": {"traces": "summary"}, "scene": scene}
    fixed = {name: [value] for name, value in inputs_of(engine).items()}
    document["sweep"] = fixed | {
        side.name: dense(side) if preset else list(side.values) for side in both
    }
    if preset:
        document["solver"] = {"preset": preset}
        return document
    rule = {"over": ["speed", "gap"], "levels": both[0].depth, "first": DRAFT}
    document["refine"] = rule | {"scale": {"gap": "log"}, "confirm": STANDARD}
    return document


def computed(document: dict[str, Any], folder: Path, ranks: int) -> Any:
    """Return the results of a campaign, its seconds by the processor's clock."""
    file = folder.with_suffix(".toml")
    file.write_text(tomli_w.dumps(document))
    front = [*MPIRUN, "-n", str(ranks)] if ranks > 1 else []
    call = [*front, sys.executable, "-c", TIMED, "campaign", str(file)]
    call += ["--out", str(folder), "--report", "no"]
    subprocess.run(call, check=True, stdout=subprocess.DEVNULL)
    return hpcwhirl.open_results(folder)


def grid_of(data: Any, both: tuple[Side, Side]) -> Dense:
    """Return the rows of a dense campaign over the grid."""
    place = [{v: i for i, v in enumerate(dense(side))} for side in both]
    rows = tuple(
        np.array([known[v] for v in data[side.name].to_numpy().tolist()])
        for known, side in zip(place, both, strict=True)
    )
    shape = tuple(map(len, place))
    names, seconds = np.full(shape, "", "U16"), np.full(shape, np.nan)
    names[rows], seconds[rows] = words(data.regime), data["seconds"].to_numpy()
    if (names == "").any():
        raise SystemExit(f"{(names == '').sum()} points of the grid have no case")
    return Dense(names, seconds)


def lattice_of(size: Size) -> Lattice:
    """Return a lattice whose places are those of the grid: values matter not here."""
    across, up, levels = size
    return Lattice(tuple(
        Side(name, tuple(map(float, range(count))), (levels,) * (count - 1))
        for name, count in (("speed", across), ("gap", up))
    ))  # fmt: skip


def looked_up(size: Size, known: dict[str, Dense], *, confirm: bool) -> Growth:
    """Return what a refined campaign computes, by the words of the dense ones."""
    growth = Growth(lattice_of(size), 1, SPECKLE, confirm=confirm)
    by = known[DRAFT], known[STANDARD]

    def word(address: Address) -> str | None:
        found = str(by[address.fidelity].words[address.point])
        return None if found in ("", "none") else found

    growth.feed(word, list(growth.wanted))
    return growth


def shown(tree: Tree, shape: tuple[int, ...]) -> Names:
    """Return the word of each point of the grid, as a map shows it."""
    cells = [cell for cell, node in tree.cells.items() if not node.split]
    points = sorted({p for cell in cells for p in tree.cells[cell].corners})
    row = {point: number for number, point in enumerate(points)}
    corner = np.array([[row[p] for p in tree.cells[c].corners] for c in cells])
    level = np.array([cell[0] for cell in cells])
    none = np.zeros_like(level)
    place = [np.array([p[axis] for p in points], dtype=float) for axis in (0, 1)]
    grid = [np.arange(length, dtype=float) for length in shape]
    found = nearest_cases(Cells(corner, none, level, none, none), place, grid)[0]
    return np.array([tree.word(point) or "none" for point in points])[found]


def near_boundary(known: Names) -> NDArray[np.bool_]:
    """Return the points at the corners of cells whose corners differ."""
    one = known[:-1, :-1]
    uneven = np.zeros(one.shape, dtype=bool)
    for other in (known[1:, :-1], known[:-1, 1:], known[1:, 1:]):
        uneven |= one != other
    out = np.zeros(known.shape, dtype=bool)
    for i, j in ((0, 0), (0, 1), (1, 0), (1, 1)):
        rows = slice(i, i + uneven.shape[0]), slice(j, j + uneven.shape[1])
        out[rows] |= uneven
    return out


def speckled(known: Names) -> NDArray[np.bool_]:
    """Return the points around which the words of a grid are speckle."""
    unlike, pairs = np.zeros(known.shape), np.zeros(known.shape)
    for axis in (0, 1):
        ahead = known != np.roll(known, -1, axis)
        there = np.ones(known.shape)
        last = [slice(None)] * 2
        last[axis] = slice(-1, None)
        ahead[tuple(last)], there[tuple(last)] = False, 0.0
        unlike += ndimage.uniform_filter(ahead.astype(float), 5, mode="nearest")
        pairs += ndimage.uniform_filter(there, 5, mode="nearest")
    return np.asarray(unlike > UNLIKE * pairs)


def missed(known: Names, found: Names) -> tuple[int, int]:
    """Return how many tongues there are, and how many of them are missed."""
    count = lost = 0
    for word in np.unique(known):
        wide = ndimage.binary_opening(known == word, np.ones((3, 3)))
        parts, number = ndimage.label(known == word)
        for part in range(1, number + 1):
            own = parts == part
            if (own & wide).any():
                count += 1
                lost += not (found[own] == word).any()
    return count, lost


@dataclass
class Measured:
    """An engine's dense campaigns, and what was computed beside.

    sizes : of the coarse level, with levels
    computed : lines about the refined campaign that was computed
    """

    engine: str
    sizes: list[Size]
    known: dict[str, Dense]
    computed: list[str] = field(default_factory=list)


def measured(
    engine: str, sizes: list[Size], args: argparse.Namespace, folder: Path
) -> Measured:
    """Run the dense campaigns of an engine."""
    first, known = sides(sizes[0]), {}
    for preset in (STANDARD, DRAFT):
        document = designed(engine, args.duration, first, preset)
        data = computed(document, folder / f"{engine}-dense-{preset}", args.ranks)
        known[preset] = grid_of(data, first)
    out = Measured(engine, sizes, known)
    if engine in args.compute:
        out.computed = compared(engine, args, folder, out)
    return out


def compared(
    engine: str, args: argparse.Namespace, folder: Path, known: Measured
) -> list[str]:
    """Compute the refined campaign; return how it compares, and its busy fraction."""
    size = known.sizes[0]
    growth = looked_up(size, known.known, confirm=True)
    place, both = folder / f"{engine}-refined", sides(size)
    tables = designed(engine, args.duration, both)
    data = results_of(tables, place, ranks=args.ranks)
    at = [list(map(side.place, data[f"place_{side.name}"].to_numpy())) for side in both]
    rows = zip(data["fidelity"].to_numpy().tolist(), *at, strict=True)
    own = dict(zip(rows, words(data.regime).tolist(), strict=True))
    presets = known.known[DRAFT], known.known[STANDARD]
    wanted = {(a.fidelity, *a.point): str(presets[a.fidelity].words[a.point])
              for a in growth.wanted}  # fmt: skip
    both_have = own.keys() & wanted.keys()
    other = sum(own[key] != wanted[key] for key in both_have)
    busy = [share["busy"] / share["span"] for share in Runs(place).shares()]
    told = (
        f"Computed, on {args.ranks} ranks: {len(own)} cases, {len(both_have)} of the "
        f"{len(wanted)} looked up; {other} words differ. Busy fraction "
        f"{min(busy):.3f} to {max(busy):.3f}."
    )
    return [told]


def coarsened(known: dict[str, Dense], step: int) -> dict[str, Dense]:
    """Return every so many-th point of grids along both inputs."""
    part = slice(None, None, step), slice(None, None, step)
    return {n: Dense(d.words[part], d.seconds[part]) for n, d in known.items()}


def goals(found: Measured) -> list[str]:
    """Return how far the goals are met, for each coarse level and coarser grids."""
    sizes = [((across, up, left), 1 << (levels - left))
             for across, up, levels in found.sizes
             for left in range(levels, 0, -1)]  # fmt: skip
    rows = (_goal(size, coarsened(found.known, step)) for size, step in sizes)
    return table(GOALS, rows)


def _goal(size: Size, known: dict[str, Dense]) -> list[str]:
    draft, standard = known[DRAFT], known[STANDARD]
    first, second = (looked_up(size, known, confirm=c) for c in (False, True))
    by = draft.seconds, standard.seconds
    seconds = sum(float(by[a.fidelity][a.point]) for a in second.wanted)
    names = shown(second.trees[0], standard.words.shape)
    speckle, same = speckled(standard.words), names == standard.words
    count, lost = missed(standard.words, names)
    needed = standard.seconds[near_boundary(standard.words)].sum()
    shares = (near_boundary(draft.words).mean(), len(first.wanted) / names.size,
              seconds / standard.seconds.sum(),
              needed / standard.seconds.sum())  # fmt: skip
    return [" x ".join(map(str, standard.words.shape)),
            f"{size[0]} x {size[1]}, {size[2]} levels", *(f"{s:.3f}" for s in shares),
            f"{same[~speckle].mean():.2%}", f"{lost} of {count}"]  # fmt: skip


def section(found: Measured) -> str:
    """Return what the page tells of an engine."""
    reference = found.known[STANDARD].words
    shares = ", ".join(f"{word} {(reference == word).mean():.1%}"
                       for word in np.unique(reference))  # fmt: skip
    taken = [found.known[preset].seconds.sum() for preset in (STANDARD, DRAFT)]
    alike = (found.known[DRAFT].words == reference).mean()
    facts = (
        f"Reference: {shares}; {speckled(reference).mean():.1%} speckle. It took "
        f"{taken[0]:.0f} core-seconds, the grid in `draft`, {alike:.1%} of it alike, "
        f"{taken[1]:.0f}."
    )
    parts = [
        f"### {found.engine}, {reference.shape[0]} x {reference.shape[1]}",
        facts,
        "\n".join(goals(found)),
        *found.computed,
    ]
    return "\n\n".join(parts)


def _engine(text: str) -> tuple[str, int]:
    """Return an engine and how much coarser its grid is."""
    name, _, coarser = text.partition(":")
    if name not in ENGINES or int(coarser or 1) not in SIZES:
        msg = f"{' or '.join(ENGINES)}, and one of {', '.join(map(str, SIZES))}"
        raise argparse.ArgumentTypeError(msg)
    return name, int(coarser or 1)


def main() -> int:
    """Run everything, print, write it if wanted."""
    parser = parser_of(__doc__, write=PAGE, folder="?")
    parser.add_argument("--duration", type=float, default=2.5)
    parser.add_argument("--ranks", type=int, default=2)
    parser.add_argument("--engine", action="append", type=_engine, metavar="NAME[:K]")
    parser.add_argument("--compute", action="append", choices=ENGINES, default=[])
    args = parser.parse_args()
    args.engine = args.engine or [(name, 1) for name in ENGINES]
    with working_folder(args.folder, "refine") as folder:
        found = [measured(name, SIZES[k], args, folder) for name, k in args.engine]
    tell("\n\n".join(map(section, found)), PAGE if args.write else None)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
