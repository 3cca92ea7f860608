"""Time of a step with a feature of the engine, against the same scene without it.

    python scripts/cost/terms.py [--engine four_motions] [--repeats 9] [NAME ...]

Each scene is integrated beyond its pulse; then the same steps of it and of its base are
timed in turn, from the same states, by the time of the process. The least of the
repetitions counts. Features are those of `TERMS`.
"""

from __future__ import annotations

import sys
import time
import tomllib
from pathlib import Path
from typing import Any, NamedTuple

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import parser_of, table

from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.kernels import contact
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
JOB = tomllib.loads((ROOT / "jobs/three_bearings.toml").read_text(encoding="utf-8"))
SHAFT = JOB["engine"]["shaft"]
LINE = {  # three bearings with dampers, one on a pedestal
    "shaft": text_of(
        {name: value for name, value in SHAFT.items() if name != "station"}, "the shaft"
    )
}
LOST = {
    "lost_blade": 3, "amplitude_limit": 0.5, "engine.rotor.centre_stiffness": 3e8,
}  # fmt: skip
UNEVEN: dict[str, Any] = {"mistuning": [0.01 * ((7 * j) % 5 - 2) for j in range(22)]}
TERMS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "unlike supports": (FULL, {"stiffness_difference": 5e6}),
    "film": (FULL, FILM),
    "unlike supports, mistuned": (FULL | UNEVEN, {"stiffness_difference": 5e6}),
    "film, mistuned": (FULL | UNEVEN, FILM),
    "film, unbalance": (FULL | {"unbalance": 2e-4}, FILM),
    "shaft": (FULL, LINE),
    "shaft, no modes": (FULL, LINE | {"shaft_modes": 0}),
    "shaft, mistuned": (FULL | UNEVEN, LINE),
    "mistuned": ({}, UNEVEN),
    "mistuned, rotation": (FULL, UNEVEN),
    "lost blade": (FULL, LOST),
    "run-up, mistuned": (UNEVEN, {"acceleration": 100.0}),
    "run-up": ({}, {"acceleration": 100.0}),
}
HEAD = (
    "feature", "motion", "without, us", "with, us", "ratio", "in contact, without",
    "in contact, with", "marched by",
)  # fmt: skip


class Begun(NamedTuple):
    """A march beyond its pulse, and a copy of its state there."""

    march: March
    state: list[Any]


def begun(scene: Scene) -> Begun:
    """Return a scene's march beyond the pulse."""
    march = March(resolve(scene))
    march.warm()
    march.advance(round(BEGUN / march.scene.solver.time_step))
    return Begun(march, [part.copy() for part in march.state])


def timed(own: Begun) -> float:
    """Return the time of a step, us, from the state where the march stands."""
    own.march.put(own.state)
    start = time.process_time()
    own.march.advance(STEPS)
    return 1e6 * (time.process_time() - start) / STEPS


def compared(base: Scene, feature: dict[str, Any], repeats: int) -> list[str]:
    """Return the columns of the table for a feature: times, ratio, shares in contact.

    base, feature : scene without it; its inputs
    """
    both = [begun(base), begun(apply_settings(base, feature))]
    least = [min(times) for times in zip(*_rounds(both, repeats), strict=True)]
    shares = [
        own.march.counter[contact.TOUCHED] - own.state[-3][contact.TOUCHED]
        for own in both
    ]
    kinds = [type(own.march.scheme).__name__ for own in both]
    return [
        *(f"{one:.3f}" for one in least), f"{least[1] / least[0]:.2f}",
        *(f"{share / STEPS:.2f}" for share in shares), kinds[1],
    ]  # fmt: skip


def _rounds(both: list[Begun], repeats: int) -> list[list[float]]:
    return [[timed(own) for own in both] for _ in range(repeats)]


def main() -> None:
    """Print the table."""
    parser = parser_of(__doc__)
    parser.add_argument("names", nargs="*", help="features; all without any")
    parser.add_argument("--engine", default="four_motions")
    parser.add_argument("--repeats", type=int, default=9)
    given = parser.parse_args()
    rows = list[list[str]]()
    for name, (base, feature) in TERMS.items():
        if given.names and name not in given.names:
            continue
        for motion, more in (("flight", {"gap": 1e-2}), ("contact", {})):
            scene = apply_settings(named_scene(given.engine), {**PLAIN, **base, **more})
            rows.append([name, motion, *compared(scene, feature, given.repeats)])
    print("\n".join(table(HEAD, rows)))


if __name__ == "__main__":
    main()
