"""How far motions of one attractor lie apart, in the tolerances of refinement.

    python scripts/evidence/neighbours.py [DIR]

Runs four engines with the preset draft at speeds of 140 to 520 rad/s (mostly_damped 350
to 500) with four forces, each also a millionth larger and smaller (resumable in DIR).
Prints, of the pairs of cases that differ by a millionth and have one regime, how many
`[refine] words = "attractor"` would take for two attractors, and the largest difference
in `refinement.words.TOLERANCES`.
"""

from __future__ import annotations

import sys
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

import hpcwhirl
from hpcwhirl.refinement.words import NUMBERS, Attractor, any_differ, features_of

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import on_engine, parser_of, results_of, working_folder

SPEEDS = {"start": 140, "stop": 520, "step": 20}
ENGINES = {
    "four_motions": SPEEDS,
    "mostly_damped": {"start": 350, "stop": 500, "step": 5},
    "steady_beside": SPEEDS,
    "forward_step": SPEEDS,
}
FORCES = (40e3, 75e3, 110e3, 150e3)  # N
NEAR = 1e-6


def attractors(engine: str, folder: Path, ranks: int) -> dict[Any, Attractor]:
    """Return {(speed, force): attractor} of an engine's cases."""
    forces = [f * (1 + side * NEAR) for f, side in product(FORCES, (0, 1, -1))]
    scene = {"scene": {"gap": 1.28e-4}, "solver": {"preset": "draft"}}
    sweep = {"speed": ENGINES[engine], "force": forces}
    rest = {"output": {"traces": "summary"}, "sweep": sweep}
    document = on_engine(engine, scene | rest)
    with results_of(document, folder / engine, ranks=ranks) as data:
        names = ("speed", "force", *NUMBERS)
        columns = [data[name].to_numpy().tolist() for name in names]
        regimes = hpcwhirl.words(data["regime"]).tolist()
    found = {}
    for regime, *values in zip(regimes, *columns, strict=True):
        row = dict(zip(names, values, strict=True)) | {"regime": regime}
        found[row["speed"], row["force"]] = Attractor(regime, features_of(row))
    return found


def main() -> int:
    """Run what is asked for and print it."""
    parser = parser_of(__doc__, folder="?")
    parser.add_argument("--ranks", type=int, default=2)
    args = parser.parse_args()
    with working_folder(args.folder, "neighbours") as folder:
        for engine in ENGINES:
            known = attractors(engine, folder, args.ranks)
            for regime in ("sustained", "divergent"):
                told(engine, regime, known)
    return 0


def told(engine: str, regime: str, known: dict[Any, Attractor]) -> None:
    """Print the pairs of a regime and the largest difference of each number."""
    pairs = [
        (own, known[speed, force * (1 + side * NEAR)])
        for (speed, force), own in known.items()
        for side in (1, -1)
        if force in FORCES
    ]
    same = [pair for pair in pairs if {one.regime for one in pair} == {regime}]
    if same:
        two = sum(map(any_differ, same))
        at = np.array([[one.at for one in pair] for pair in same])
        most = " ".join(f"{v:.2f}" for v in np.abs(at[:, 0] - at[:, 1]).max(axis=0))
        print(f"{engine}: of {len(same)} {regime} pairs {two} apart, at most {most}")


if __name__ == "__main__":
    sys.exit(main())
