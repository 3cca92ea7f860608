"""Do all features of an engine hold together? March each pair of them; say its cost.

    python scripts/evidence/combinations.py            all pairs
    python scripts/evidence/combinations.py film tilt  the pairs of these features
    options: --write (the page combinations.md)  --quick (compare with no other scheme)

Each feature is set on an engine of 11 blades for 3 ms, and each pair of features. A row
tells the integrator; the time of a march, in one thread as in the program, over that of
the engine without features, least of two after a first one, which holds some fixed cost
of a march; and the largest difference of the tips from those of scheme `paper`, or
`general` where `paper` refuses, over the largest displacement; or the reason of a
refusal. `exact` has an error of another kind, of the step; a speed that changes has one
of its intervals.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from itertools import combinations
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hpcwhirl.case.resolve import resolve
from hpcwhirl.cli.command import THREADS
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import WhirlError
from hpcwhirl.scene import apply_settings, named_scene
from hpcwhirl.scene.shaft_tables import text_of

PAGE = Path(__file__).with_name("combinations.md")
BASE = {
    "speed": 420.0, "duration": 3e-3, "interval": 2e-5, "time_step": 1e-6,
    "traces": "full", "blades": 11, "modes": 33, "gap": 2e-4,
    "casing.harmonics": 8,
}  # fmt: skip
FULL = {"rotation": "full"}
OVAL = {"profile": "harmonic,amplitude,phase;2,2e-5,0"}
HELD = {
    0: {"kxx": 4e7, "cxx": 5e3, "kxy": 1e6, "kyx": -1e6}, 2: {"kxx": 6e7, "cxx": 8e3},
}  # fmt: skip
ON_SHAFT: dict[str, dict[int, Any]] = {  # bearings by station, in place of `HELD`
    "shaft": {},
    "journal": {0: {"journal_viscosity": 0.02, "journal_length": 0.06,
                    "journal_radius": 0.06, "journal_clearance": 3e-4}},
    "rolling": {2: {"rolling_stiffness": 1e10, "rolling_balls": 9,
                    "rolling_clearance": 1e-5, "cxx": 2e3}},
    "added mass": {1: {"kxx": 2e5, "cxx": 3e3, "mxx": 12.0}},  # of a seal
}  # fmt: skip


def on_shaft(*names: str) -> dict[str, Any]:
    """Return the inputs of an engine on a shaft with the bearings of some features."""
    held = HELD.copy()
    for name in names:
        held |= ON_SHAFT[name]
    text = text_of({
        "sections": [
            {"length": 0.2, "outer": 0.12, "inner": 0.05},
            {"length": 0.5, "outer": 0.1, "outer_end": 0.08},
        ],
        "disks": [{"station": 2, "mass": 20.0, "polar": 0.3}],
        "bearings": [{"station": place, **own} for place, own in sorted(held.items())],
    }, "the shaft")  # fmt: skip
    return FULL | {"shaft": text, "shaft_station": 1}


FEATURES: dict[str, dict[str, Any]] = {
    "rotation": FULL,
    "unbalance": FULL | {"unbalance": 2e-3},
    "lost blade": FULL | {"lost_blade": 3, "amplitude_limit": 2.0,
                          "rotor.centre_stiffness": 3e8},
    "lost blade later": FULL | {"lost_blade": 3, "lost_blade_time": 1e-3,
                                "amplitude_limit": 2.0},
    "gravity": FULL | {"gravity": 9.81, "gravity_angle": -1.4},
    "mistuned": {"mistuning": [0.02 * float(np.sin(7.0 * j)) for j in range(11)]},
    "unlike supports": FULL | {"stiffness_difference": 5e6},
    "film": FULL | {"film_viscosity": 0.01, "film_length": 0.1, "film_radius": 0.15,
                    "film_clearance": 1e-3},  # beyond the circle of a lost blade
    "cross-coupling": FULL | {"cross_coupling": 1e5},
    "tilt": FULL | {"shaft": "cantilever"},
    **{name: on_shaft(name) for name in ON_SHAFT},
    "run-up": {"acceleration": 100.0},
    "run-down": {"acceleration": -3000.0, "ramp": "decay", "speed_to": 10.0},
    "gap closes": {"gap_closure": 2e-5, "gap_time": 0.1},
    "oval": OVAL,
    "release": OVAL | {"profile_release": 2e-3},
    "layer": {"contact_law": "abradable"},
    "rubbed layer": {"contact_law": "archard", "wear_coefficient": 1e-11},
    "stribeck": {"friction_law": "stribeck"},
    "set-valued": {"slip": "set-valued", "speed": 20.0, "friction": 0.4},
    "start energy": {"start_energy": 5.0},
    "gap at rest": FULL | {"gap_at": "rest", "gap": 4e-4},
    "exact": {"scheme": "exact"},
    "decided": {"until": "decided"},
    "chaos": {"chaos": 50.0},
    "elements": {"discretization": "elements", "casing.elements": 40},
    "shell": {"discretization": "shell"},
    "rigid casing": {"kind": "rigid", "amplitude": 5e-5, "growth": 20.0},
}  # fmt: skip
FAR = 4.0  # times the base: a pair above it is told


class Row(NamedTuple):
    """What a pair of features gave: integrator, cost / base, difference; or refusal."""

    pair: tuple[str, ...]
    scheme: str = ""
    cost: float = 0.0
    apart: float | None = None
    refused: str = ""


def marched(given: dict[str, Any]) -> tuple[March, float]:
    """Return a march at its end, and its processor time, s."""
    march = March(resolve(apply_settings(named_scene("four_motions"), given)))
    begun = time.process_time()
    march.run()
    return march, time.process_time() - begun


def apart(given: dict[str, Any], march: March) -> float | None:
    """Return how far the tips are from those of `paper` or `general`, None without."""
    tips = march.history().tips
    for scheme in ("paper", "general"):
        try:
            other, _ = marched(given | {"scheme": scheme})
        except WhirlError:
            continue
        far = np.abs(other.history().tips - tips).max()
        return float(far / max(np.abs(tips).max(), 1e-300))
    return None


def row_of(pair: tuple[str, ...], base: float, *, oracle: bool) -> Row:
    """March a scene with some features; return its row.

    base : s, processor time of the engine without features
    """
    given = dict(BASE)
    for name in pair:
        given |= FEATURES[name]
    if on := [name for name in pair if name in ON_SHAFT]:
        given |= on_shaft(*on)
    try:
        march, _ = marched(given)
    except WhirlError as refused:
        return Row(pair, refused=str(refused).partition("\n")[0])
    cost = min(marched(given)[1] for _ in range(2)) / base
    scheme = type(march.scheme).__name__.lstrip("_")
    return Row(pair, scheme, cost, apart(given, march) if oracle else None)


def told(row: Row) -> str:
    """Return the line of a table for a pair."""
    name = " + ".join(row.pair)
    if row.refused:
        return f"| {name} | refused | | {row.refused} |"
    far = "" if row.apart is None else f"{row.apart:.0e}"
    return f"| {name} | {row.scheme} | {row.cost:.1f} | {far} |"


def page(rows: list[Row]) -> str:
    """Return the page: what holds, in a sentence, and the table of all pairs."""
    refused = sum(bool(row.refused) for row in rows)
    dear = sum(row.cost > FAR for row in rows)
    head = (
        f"# Features that hold together\n\n{len(rows)} pairs of features of an engine "
        f"(`python scripts/evidence/combinations.py`): {refused} are refused, and "
        f"{dear} of the others take more than {FAR:g} times the base.\n"
    )
    table = (
        "| pair | integrator | cost / base | difference, or reason |\n|---|---|---|---|"
    )
    return "\n".join([head, table, *map(told, rows), ""])


def main(words: list[str] | None = None) -> int:
    """March the pairs that are asked for; print a line for each."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("features", nargs="*", choices=[[], *FEATURES], metavar="NAME")
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--quick", action="store_true")
    asked = parser.parse_args(words)
    names = asked.features or list(FEATURES)
    marched(BASE)
    base = min(marched(BASE)[1] for _ in range(3))
    rows = []
    for pair in combinations(names, 2):
        rows.append(row_of(pair, base, oracle=not asked.quick))
        print(told(rows[-1]), flush=True)
    if asked.write:
        PAGE.write_text(page(rows), encoding="utf-8")
    print(page(rows).splitlines()[2])
    return 0


if __name__ == "__main__":
    if not set(THREADS) <= set(os.environ):  # else threads that wait take its time
        alone = dict.fromkeys(THREADS, "1") | dict(os.environ)
        os.execve(sys.executable, [sys.executable, *sys.argv], alone)
    sys.exit(main())
