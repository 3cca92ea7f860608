"""Time of a step with a feature of the engine, against the same scene without it.

    python scripts/cost/terms.py [--engine four_motions] [--repeats 9] [NAME ...]

Each scene is integrated beyond its pulse; then the same steps of it and of its base, in
flight and as given, are timed in turn, from the same states, by the time of the
process. The least of the repetitions counts. A step in contact takes the time in flight
and what the steps as given take beyond it, divided by their share in contact. Features
are those of `TERMS`, and three contact points a tip, of which no base has as many
touching.
"""

from __future__ import annotations

import sys
import tempfile
import time
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import parser_of, table
from cost.sizes import with_points

from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.kernels.contact import LAST, STEP, TOUCHED
from hpcwhirl.dynamics.march import March
from hpcwhirl.scene import Scene, apply_settings, named_scene
from hpcwhirl.scene.shaft_tables import text_of

ROOT = Path(__file__).parents[2]

BEGUN, STEPS = 3e-3, 2000  # s, steps
PLAIN: dict[str, Any] = {
    "plan": "everything", "revolutions": 0.0, "duration": 0.1, "speed": 420.0,
    "output.traces": "summary",
}  # fmt: skip
FULL: dict[str, Any] = {"rotation": "full"}
FILM = {
    "film_viscosity": 0.01, "film_length": 0.03, "film_radius": 0.05,
    "film_clearance": 2e-4,
}  # fmt: skip
JOURNAL = {
    "journal_viscosity": 0.02, "journal_length": 0.06, "journal_radius": 0.1,
    "journal_clearance": 2e-4,
}  # fmt: skip
BALLS = {"rolling_stiffness": 1e10, "rolling_balls": 9, "rolling_clearance": 1e-5}
JOB = tomllib.loads((ROOT / "jobs/three_bearings.toml").read_text(encoding="utf-8"))
SHAFT = {k: v for k, v in JOB["engine"]["shaft"].items() if k != "station"}


def line(*more: dict[str, Any]) -> dict[str, Any]:
    """Return the job's shaft on its three bearings, one on a pedestal.

    more : what its bearings have besides, from the first one on
    """
    each = zip(SHAFT["bearings"], [*more, {}, {}, {}], strict=False)
    table = SHAFT | {"bearings": [one | beside for one, beside in each]}
    return {"shaft": text_of(table, "the shaft")}


LINE = line()
APART = {"kyy": 3e7, "kxy": 1e6}
LOST = {
    "lost_blade": 3, "amplitude_limit": 0.5, "engine.rotor.centre_stiffness": 3e8,
}  # fmt: skip
UNEVEN: dict[str, Any] = {"mistuning": [0.01 * ((7 * j) % 5 - 2) for j in range(22)]}
LOOSE = {"slip": "set-valued"}
SLOW: dict[str, Any] = {"speed": 1.0, "friction": 0.5}
TERMS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "unlike supports": (FULL, {"stiffness_difference": 5e6}),
    "film": (FULL, FILM),
    "unlike supports, mistuned": (FULL | UNEVEN, {"stiffness_difference": 5e6}),
    "stop": (FULL, {"stop_clearance": 1e-3}),
    "film, mistuned": (FULL | UNEVEN, FILM),
    "film, unbalance": (FULL | {"unbalance": 2e-4}, FILM),
    "shaft": (FULL, LINE),
    "shaft, one film": (FULL, line(FILM)),
    "shaft, one journal": (FULL | {"gravity": 9.81}, line(JOURNAL)),
    "shaft, one stop": (FULL, line({"stop_clearance": 1e-3})),
    "shaft, one rolling": (FULL | {"gravity": 9.81}, line(BALLS)),
    "shaft, film, unlike supports": (FULL, line(FILM, APART, APART)),
    "shaft, film, mistuned": (FULL | UNEVEN, line(FILM)),
    "shaft, no modes": (FULL, LINE | {"shaft_modes": 0}),
    "shaft, mistuned": (FULL | UNEVEN, LINE),
    "mistuned": ({}, UNEVEN),
    "mistuned, rotation": (FULL, UNEVEN),
    "lost blade": (FULL, LOST),
    "run-up, mistuned": (UNEVEN, {"acceleration": 100.0}),
    "run-up": ({}, {"acceleration": 100.0}),
    "layer": ({}, {"contact_law": "abradable"}),
    "layer, rotation": (FULL, {"contact_law": "abradable"}),
    "layer by Archard": ({}, {"contact_law": "archard"}),
    "layer, mistuned": (UNEVEN, {"contact_law": "abradable"}),
    "friction by slip": ({}, LOOSE),
    "friction by slip, mistuned": (UNEVEN, LOOSE),
    "tips that stick": (SLOW, LOOSE),
    "tips that stick, rotation": (FULL | SLOW, LOOSE),
    "tips that stick, mistuned": (UNEVEN | SLOW, LOOSE),
}
POINTS = "three points"
HEAD = (
    "feature", "in flight, us", "ratio", "in contact, us", "ratio", "shares in contact",
    "touching", "marched by",
)  # fmt: skip


class Begun(NamedTuple):
    """A march beyond its pulse, and a copy of its state there."""

    march: March
    state: Any


def begun(scene: Scene) -> Begun:
    """Return a scene's march beyond the pulse."""
    march = March(resolve(scene))
    march.warm()
    march.advance(round(BEGUN / march.scene.solver.time_step))
    return Begun(march, march.state._make(part.copy() for part in march.state))


def timed(own: Begun) -> float:
    """Return the time of a step, us, from the state where the march stands."""
    own.march.put(own.state)
    start = time.process_time()
    own.march.advance(STEPS)
    return 1e6 * (time.process_time() - start) / STEPS


def touching(own: Begun) -> tuple[float, float]:
    """Return the share of timed steps in contact, and the mean number that touch."""
    own.march.put(own.state)
    counter, counts = own.march.counter, []
    for _ in range(STEPS):
        own.march.advance(1)
        if counter[LAST] == counter[STEP]:
            counts.append(int((own.march.state.last == counter[STEP]).sum()))
    share = float(counter[TOUCHED] - own.state.counter[TOUCHED]) / STEPS
    return share, sum(counts) / max(len(counts), 1)


def compared(base: Scene, featured: Scene, repeats: int) -> list[str]:
    """Return the columns of the table for a feature.

    base, featured : scene without it; with it
    """
    far = {"gap": 1e-2}
    scenes = [apply_settings(one, far) for one in (base, featured)] + [base, featured]
    every = [begun(scene) for scene in scenes]
    least = [min(times) for times in zip(*_rounds(every, repeats), strict=True)]
    flights, mixed = least[:2], least[2:]
    shares, counts = zip(*map(touching, every[2:]), strict=True)
    rubs = [
        flight + (both - flight) / share if share else float("nan")
        for flight, both, share in zip(flights, mixed, shares, strict=True)
    ]
    return [
        *_pair(flights), *_pair(rubs), " ".join(f"{share:.2f}" for share in shares),
        " ".join(f"{count:.1f}" for count in counts),
        type(every[3].march.scheme).__name__,
    ]  # fmt: skip


def _pair(times: Sequence[float]) -> list[str]:
    return [f"{times[0]:.3f} {times[1]:.3f}", f"{times[1] / times[0]:.2f}"]


def _rounds(every: list[Begun], repeats: int) -> list[list[float]]:
    return [[timed(own) for own in every] for _ in range(repeats)]


def scenes_of(engine: str, folder: Path) -> Iterator[tuple[str, Scene, Scene]]:
    """Return each feature's name, and the scenes without it and with it.

    folder : directory in which engines of several contact points a tip are written
    """
    plain = apply_settings(named_scene(engine), PLAIN)
    for name, (more, feature) in TERMS.items():
        base = apply_settings(plain, more)
        yield name, base, apply_settings(base, feature)
    yield POINTS, plain, with_points(folder, plain)


def main() -> None:
    """Print the table."""
    parser = parser_of(__doc__)
    parser.add_argument("names", nargs="*", help="features; all without any")
    parser.add_argument("--engine", default="four_motions")
    parser.add_argument("--repeats", type=int, default=9)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="hpcwhirl-terms-") as folder:
        rows = [
            [name, *compared(base, featured, given.repeats)]
            for name, base, featured in scenes_of(given.engine, Path(folder))
            if not given.names or name in given.names
        ]
    print("\n".join(table(HEAD, rows)))


if __name__ == "__main__":
    main()
