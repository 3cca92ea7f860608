"""What refinement saves and what it loses, against a dense grid in `standard`.

    python scripts/evidence/refine.py [DIR] [--coarser K] [--duration S] [--ranks N]
                                      [--engine NAME]...

Both engines of `preset_map.py` over (speed, gap), the gap by its logarithm. The
reference is the grid of 241 x 81 cases in `standard`; refined campaigns begin with 31 x
11 of them and have 3 levels. With --coarser 2 the grid has 121 x 41 cases (16 x 6, 3
levels), with 4 it has 61 x 21 (16 x 6, 2 levels), with 8 33 x 13 (9 x 4, 2 levels).
Campaigns are resumable. A refined campaign is given the journals of the dense ones: its
cases are among theirs, so that it computes nothing again and is told their seconds.

For dense draft, refined draft, refined draft + confirmed, dense standard and, where it
is installed, the package `adaptive` (LearnerND with a loss for words, on the words of
dense draft, as many points as the refined draft has): cases, core-seconds in the
kernel, share of the reference's points with the same word, all and outside speckle, and
tongues missed. Speckle: points where more than 0.3 of the pairs of neighbours within 5
x 5 points differ in the reference. Tongue: what is connected and of one word there, and
somewhere 3 x 3 points wide; it is missed where no point of it has its word.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

import hpcwhirl
from hpcwhirl.refinement.lattice import Side
from hpcwhirl.store.reader import words

if __package__ is None or __package__ == "":
    import sys

    sys.path.insert(0, str(Path(__file__).parents[1]))
from cost.under_mpi import campaign
from evidence.preset_map import inputs_of

SIZES = {
    1: (31, 11, 3),
    2: (16, 6, 3),
    4: (16, 6, 2),
    8: (9, 4, 2),
}  # coarse values, levels
SPEEDS, GAPS = (40.0, 520.0), (0.8e-4, 4e-4)
UNLIKE = 0.3
Names = NDArray[np.str_]


@dataclass
class Found:
    """One way to the map of an engine: its cases, core-seconds and words."""

    name: str
    cases: int
    seconds: float
    words: Names


def sides(coarser: int) -> tuple[Side, Side]:
    """Return speed and gap with the coarse values and all levels."""
    across, up, levels = SIZES[coarser]
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
    engine: str, duration: float, both: tuple[Side, Side], way: str
) -> dict[str, Any]:
    """Return the campaign of an engine in one way."""
    scene = {"duration": duration, "speed": 300.0}
    document: dict[str, Any] = {"output": {"traces": "summary"}, "scene": scene}
    fixed = {name: [value] for name, value in inputs_of(engine).items()}
    refined = way.startswith("refined")
    document["sweep"] = fixed | {
        side.name: list(side.values) if refined else dense(side) for side in both
    }
    preset = "standard" if way == "dense standard" else "draft"
    if refined:
        rule = {"over": ["speed", "gap"], "levels": both[0].depth, "first": preset}
        rule["scale"] = {"gap": "log"}
        document["refine"] = rule
        if way == "refined + confirmed":
            rule["confirm"] = "standard"
    else:
        document["solver"] = {"preset": preset}
    return document


WAYS = ("dense standard", "dense draft", "refined draft", "refined + confirmed")


def computed(way: str, document: dict[str, Any], folder: Path, ranks: int) -> Found:
    """Return what a campaign found, at all points of the dense grid."""
    file = folder.with_suffix(".toml")
    file.write_text(tomli_w.dumps(document))
    campaign(file, folder, "--report", "no", ranks=ranks)
    with hpcwhirl.open_results(folder) as data:
        cases, seconds = data.sizes["case"], float(data["seconds"].sum())
        regime = data["regime"].to_numpy()
        if "final" in data:
            from hpcwhirl.store.nearest import nearest_rows

            rows, values = nearest_rows(data)
            speed, gap, regime = (
                values["speed"],
                values["gap"],
                words(data.regime)[rows],
            )
        else:
            speed, gap = data["speed"].to_numpy(), data["gap"].to_numpy()
    return Found(way, cases, seconds, on_grid(speed, gap, regime))


def lend(folder: Path, dense_ones: list[Path]) -> None:
    """Give a campaign that has not begun the journals of finished ones."""
    if (folder / "journal").exists():
        return
    (folder / "journal").mkdir(parents=True)
    logs = [log for one in dense_ones for log in sorted(one.glob("journal/*.log"))]
    for number, log in enumerate(logs, 1):
        shutil.copyfile(log, folder / "journal" / f"{number:04d}-00000.log")


def on_grid(speed: Any, gap: Any, regime: Any) -> Names:
    """Return words over (speeds, gaps) of the finest grid, by the nearest known one."""
    both = GRID
    plane = np.array([(x, np.log(y)) for x in both[0] for y in both[1]])
    known = np.column_stack([speed, np.log(gap)])
    scale = np.ptp(plane, axis=0) / [len(both[0]), len(both[1])]
    near = cKDTree(known / scale).query(plane / scale)[1]
    return np.asarray(regime)[near].reshape(len(both[0]), len(both[1])).astype(str)


GRID: tuple[list[float], list[float]] = ([], [])


def peer(known: Names, count: int) -> Found | None:
    """Return what LearnerND finds with so many points, with the words of a grid."""
    try:
        import adaptive
    except ImportError:
        return None
    order = {word: i for i, word in enumerate(np.unique(known))}
    size = np.array(known.shape) - 1

    def word(at: tuple[float, float]) -> float:
        place = np.round(np.array(at) * size).astype(int)
        return float(order[known[tuple(place)]])

    def loss(simplex: Any, values: Any, value_scale: float) -> float:
        del value_scale
        volume = adaptive.learner.learnerND.volume(simplex)
        return float(volume * (1.0 if len({*map(float, values)}) > 1 else 0.05))

    learner = adaptive.LearnerND(word, [(0.0, 1.0)] * 2, loss_per_simplex=loss)
    adaptive.runner.simple(learner, npoints_goal=count)
    at, found = np.array(list(learner.data)), np.array(list(learner.data.values()))
    plane = np.stack(np.meshgrid(*(np.linspace(0, 1, n + 1) for n in size),
                                 indexing="ij"), axis=-1)  # fmt: skip
    scale = 1.0 / size
    near = cKDTree(at / scale).query(plane.reshape(-1, 2) / scale)[1]
    names = np.array(list(order))[found[near].astype(int)].reshape(known.shape)
    return Found("adaptive (peer)", len(at), float("nan"), names)


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


def told(reference: Found, ways: list[Found]) -> None:
    """Print the table of an engine."""
    speckle = speckled(reference.words)
    print(f"  {speckle.mean():.1%} of the reference's points are speckle")
    for way in ways:
        same = way.words == reference.words
        count, lost = missed(reference.words, way.words)
        print(f"  {way.name:20s} {way.cases:6d} cases {way.seconds:9.1f} s "
              f"{same.mean():7.2%} alike {same[~speckle].mean():7.2%} outside speckle "
              f"{lost} of {count} tongues missed")  # fmt: skip


def measured(engine: str, args: argparse.Namespace, folder: Path) -> None:
    """Run all campaigns of an engine and print."""
    both, found = sides(args.coarser), {}
    GRID[0][:], GRID[1][:] = dense(both[0]), dense(both[1])
    for way in WAYS:
        document = designed(engine, args.duration, both, way)
        place = folder / f"{engine}-{way.replace(' ', '-').replace('+', 'and')}"
        if way.startswith("refined"):
            lend(place, [folder / f"{engine}-dense-{p}" for p in ("draft", "standard")])
        found[way] = computed(way, document, place, args.ranks)
        last = found[way]
        print(f"{engine}, {way}: {last.cases} cases, {last.seconds:.1f} s", flush=True)
    ways = list(found.values())
    other = peer(found["dense draft"].words, found["refined draft"].cases)
    ways += [other] if other else []
    print(f"{engine}, {len(GRID[0])} x {len(GRID[1])}, {args.duration:g} s:")
    told(found["dense standard"], ways)
    draft, standard = found["dense draft"], found["dense standard"]
    refined, confirmed = found["refined draft"], found["refined + confirmed"]
    cases, seconds = refined.cases / draft.cases, confirmed.seconds / standard.seconds
    print(f"  refined draft over dense draft: {cases:.3f} of the cases")
    print(f"  confirmed over dense standard: {seconds:.3f} of the core-seconds")


def main() -> int:
    """Run everything and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, nargs="?")
    parser.add_argument("--coarser", type=int, choices=SIZES, default=1)
    parser.add_argument("--duration", type=float, default=2.5)
    parser.add_argument("--ranks", type=int, default=2)
    parser.add_argument("--engine", action="append", choices=("default", "rubbing"))
    args = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="hpcwhirl-refine-") as scratch:
        folder = args.folder or Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        for engine in args.engine or ("default", "rubbing"):
            measured(engine, args, folder)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
