"""What the interval of a refined boundary promises, and what it does not.

    python scripts/evidence/boundaries.py [DIR] [--edges 50] [--ranks 2] [--write]

Three engines over speed and gap, 13 x 6 coarse values and two levels, `draft`: of the
edges between cases of different words, a sample. Each is looked at in 15 places between
its ends, evenly on its input's own scale: what four bisections would find, and every
other change of word that wide. Its ends are computed again as twins, the force changed
by 1e-6 at most, and so are the places one edge further out on either side.

- "a change within": edges along which the word changes between `low` and `high`, which
  is what the file tells: the ends are cases of two words, of these inputs.
- "once": edges along which it changes once; else three times, five times, ...
- "of twins": pairs of twins, one at either end, whose words differ, so that theirs
  changes between `low` and `high`, too; "one edge wider", so of the four twins at the
  ends and one edge further out: it changes somewhere between these.
- "off": from the point that is told, the middle of the edge, to the nearest change, in
  edges: half of the edges, nine in ten, at most.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.scene.case_digest import PHYSICS_VERSION
from hpcwhirl.store.reading.reader import words

if __package__ is None or __package__ == "":
    sys.path.insert(0, str(Path(__file__).parents[1]))
from common import parser_of, results_of, share, table, tell, working_folder
from evidence.preset_map import ENGINES, inputs_of

PAGE = Path(__file__).with_suffix(".md")
SPEEDS, GAPS, LEVELS = (40.0, 520.0, 13), (0.8e-4, 4e-4, 6), 2
OVER = ("speed", "gap")
LOG = {"gap"}
PARTS = 16  # of an edge
TWINS, SPREAD = 8, 1e-6  # of a place; of the force
SEED = 25
HEAD = ("engine", "edges", "looked at", "a change within", "once", "of twins",
        "of twins, one edge wider", "off: half, nine in ten, most")  # fmt: skip
Floats = NDArray[np.float64]
Names = NDArray[np.str_]
Row = dict[str, Any]


@dataclass
class Edges:
    """Edges of an engine's boundaries, and what was computed along them.

    Attributes
    ----------
    engine : its name
    of : how many edges there are
    inside : (e, PARTS + 1), words from end to end
    twins : (e, 4, TWINS), of twins one edge before, at both ends, one edge behind
    """

    engine: str
    of: int
    inside: Names
    twins: Names


def refined(engine: str, duration: float) -> Row:
    """Return the refined campaign of an engine."""
    gaps = [float(f"{v:.6g}") for v in np.geomspace(*GAPS)]
    grid = {"speed": np.linspace(*SPEEDS).tolist(), "gap": gaps}
    rule = {"over": [*OVER], "levels": LEVELS, "scale": dict.fromkeys(LOG, "log")}
    return {
        "scene": {"duration": duration, "speed": 300.0},
        "output": {"traces": "summary"},
        "sweep": {name: [value] for name, value in inputs_of(engine).items()} | grid,
        "refine": rule | {"first": "draft"},
    }


def along(low: float, high: float, *, log: bool) -> tuple[list[float], list[float]]:
    """Return places between both ends of an edge, and those of twins."""
    part = np.arange(PARTS + 1) / PARTS
    wide = np.array([-1.0, 0.0, 1.0, 2.0])
    if log:
        inside, outside = (low * (high / low) ** at for at in (part, wide))
    else:
        inside, outside = (low + (high - low) * at for at in (part, wide))
    outside[1:3] = low, high
    return inside[1:-1].tolist(), outside.tolist()


def cases_of(own: Row, name: str, ends: tuple[float, float], chance: Any) -> list[Row]:
    """Return the cases along an edge, and the twins around it.

    Parameters
    ----------
    own : its other input, and the force
    name, ends : its input, and that from where to where
    chance : numbers of the twins
    """
    inside, outside = along(*ends, log=name in LOG)
    force = own.pop("force")
    cases = [own | {name: value} for value in inside]
    for value in outside:
        nudged = force * (1.0 + SPREAD * chance.uniform(-1.0, 1.0, TWINS))
        cases += [own | {name: value, "force": one} for one in nudged.tolist()]
    return cases


def looked_at(engine: str, args: argparse.Namespace, folder: Path) -> Edges:
    """Compute the refined campaign of an engine, and a sample of its edges."""
    document = refined(engine, args.duration)
    data = results_of(document, folder / engine, ranks=args.ranks)
    number = np.flatnonzero(data["boundary_along"].to_numpy() >= 0)
    chance = np.random.default_rng(SEED)
    chosen = np.sort(chance.permutation(number)[: args.edges])
    force, cases = float(data["force"].to_numpy()[0]), []
    for point in chosen.tolist():
        own = {n: data[f"boundary_{n}"].to_numpy()[point].item() for n in OVER}
        name = OVER[int(data["boundary_along"][point])]
        low, high = (float(data[f"boundary_{end}"][point]) for end in ("low", "high"))
        cases += cases_of(own | {"force": force}, name, (low, high), chance)
    fixed = inputs_of(engine)
    edges = {n: document[n] for n in ("scene", "output")}
    edges |= {"solver": {"preset": "draft"}, "cases": [fixed | case for case in cases]}
    found = results_of(edges, folder / f"{engine}-edges", ranks=args.ranks)
    names = words(found["regime"]).reshape(len(chosen), -1)
    known, rows = words(data["regime"]), ("before", "behind")
    ends = [known[data[f"boundary_{n}"].to_numpy()[chosen]] for n in rows]
    inside = np.column_stack([ends[0], names[:, : PARTS - 1], ends[1]])
    twins = names[:, PARTS - 1 :].reshape(-1, 4, TWINS)
    return Edges(engine, len(number), inside, twins)


def changes(edges: Edges) -> NDArray[np.bool_]:
    """Return where words change along edges, (e, PARTS)."""
    return np.asarray(edges.inside[:, 1:] != edges.inside[:, :-1])


def off(edges: Edges) -> Floats:
    """Return how far the middle lies from the nearest change of word, in edges."""
    middles = (np.arange(PARTS) + 0.5) / PARTS
    away = np.where(changes(edges), np.abs(middles - 0.5), np.inf)
    return np.asarray(away.min(axis=1))


def wider(twins: Names) -> NDArray[np.bool_]:
    """Return whether the word of twins changes from one edge before to one behind."""
    return np.asarray((twins != twins[:, :1]).any(axis=1))


def row(name: str, parts: list[Edges]) -> list[str]:
    """Return the row of some engines together."""
    count = np.concatenate([changes(edges).sum(axis=1) for edges in parts])
    twins = np.concatenate([edges.twins for edges in parts])
    ends, wide = twins[:, 1] != twins[:, 2], wider(twins)
    away = np.concatenate([off(edges) for edges in parts])
    quantiles = ", ".join(f"{v:.2f}" for v in np.quantile(away, [0.5, 0.9, 1.0]))
    shares = [share(int(found.sum()), found.size)
              for found in (count > 0, count == 1, ends, wide)]  # fmt: skip
    edges = sum(own.of for own in parts)
    return [name, str(edges), str(len(count)), *shares, quantiles]


def measured(found: list[Edges]) -> str:
    """Return the table, and how often the bounds hold where they hold least."""
    rows = [row(edges.engine, [edges]) for edges in found]
    least = min(float(wider(edges.twins).mean()) for edges in found)
    lines = table(HEAD, [*rows, row("all", found)])
    return "\n".join(lines) + (
        f"\n\nOne edge wider on either side, the bounds hold of {least:.1%} of twins "
        f"on the engine where they hold least; physics version {PHYSICS_VERSION}."
    )


def main() -> int:
    """Run everything, print, write it if wanted."""
    parser = parser_of(__doc__, write=PAGE, folder="?")
    parser.add_argument("--edges", type=int, default=50)
    parser.add_argument("--duration", type=float, default=1.25)
    parser.add_argument("--ranks", type=int, default=2)
    args = parser.parse_args()
    with working_folder(args.folder, "boundaries") as folder:
        found = [looked_at(engine, args, folder) for engine in ENGINES]
    tell(measured(found), PAGE if args.write else None)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
