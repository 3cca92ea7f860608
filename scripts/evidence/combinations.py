"""Do all features of an engine hold together? March each pair of them; say its cost.

    python scripts/evidence/combinations.py            all pairs
    python scripts/evidence/combinations.py film tilt  the pairs of these features
    options: --write (the page combinations.md)  --quick (compare with no other scheme)

Each feature is set on an engine of 11 blades for 3 ms, and each pair of features. A row
tells the integrator; the share of steps in contact; the time of a march, in one thread
as in the program, over that of the engine without features, marched in turn, least of
three after a first one, which holds some fixed cost of a march; and the largest
difference of the tips from those of scheme `paper`, or `general` where `paper` refuses,
over the largest displacement; or the reason of a refusal. `exact` has an error of
another kind, of the step; a speed that changes has one of its intervals.

A feature may cost time in each step, or keep blades in contact for longer, where each
step takes more with or without it. Pairs are judged by the first: by the time over that
of the engine without features in contact for the same share of its steps. This engine
is marched with gaps that give other shares, `GAPS`; between them, time is linear.
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
from hpcwhirl.dynamics.kernels.contact import TOUCHED
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
WHIRL = np.linspace(20.0, 1500.0, 12)  # rad/s
ON_SHAFT: dict[str, dict[int, Any]] = {  # bearings by station, in place of `HELD`
    "shaft": {},
    "journal": {0: {"journal_viscosity": 0.02, "journal_length": 0.06,
                    "journal_radius": 0.06, "journal_clearance": 3e-4}},
    "rolling": {2: {"rolling_stiffness": 1e10, "rolling_balls": 9,
                    "rolling_clearance": 1e-5, "cxx": 2e3}},
    "added mass": {1: {"kxx": 2e5, "cxx": 3e3, "mxx": 12.0}},  # of a seal
    "over whirl": {1: {  # a spring in series with a damper
        "whirl_frequency": [float(w) for w in WHIRL],
        "kxx": [float(k) for k in 2e6 * WHIRL**2 / (WHIRL**2 + 500.0**2)],
        "cxx": [float(c) for c in 2e6 * 500.0 / (WHIRL**2 + 500.0**2)],
    }},
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
    "stop": FULL | {"stop_clearance": 1e-4, "stop_friction": 0.1},
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
    "friction table": {"friction_law": "table", "friction": 0.2,
                       "friction_table": "slip,friction;0,0.2;100,0.1"},
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
FAR = 4.0  # times the base with the same share in contact: a pair above it is told
GAPS = (1e-2, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5, 5e-6)  # m, of the base: its shares
ROUNDS = 9  # marches of the base with each gap, of which the least time counts
TURNS = 3  # marches of a pair and of the base, in turn, of which the least count
CAUSES = {  # why pairs are above `FAR`: the first feature that a pair has counts
    "elements": "a ring of elements is not the same at every angle, so that no waves "
    "exist: `general` integrates all modes, and places the blades anew, in every step",
    "lost blade": "sectors are unequal, so that each tip in contact needs a row of "
    "coefficients of all waves; and the loads of the shaft are read at all samples",
    "lost blade later": "as of a blade lost at once; and arrays of two rotors are made",
    "run-down": "coefficients are computed anew for each interval of the speed, of "
    "which the base has one",
    "shell": "a shell has several times as many modes as the ring",
}


class Row(NamedTuple):
    """What a pair of features gave: integrator, costs, difference; or refusal.

    share : of the steps, in contact
    cost, like : time over that of the base; over that of the base with this share
    """

    pair: tuple[str, ...]
    scheme: str = ""
    share: float = 0.0
    cost: float = 0.0
    like: float = 0.0
    apart: float | None = None
    refused: str = ""


class Base(NamedTuple):
    """Times of the engine without features.

    Attributes
    ----------
    time : s, with the gap of all pairs
    shares, times : of steps in contact, ascending; s, with the gaps `GAPS`
    """

    time: float
    shares: list[float]
    times: list[float]

    def like(self, share: float) -> float:
        """Return the time, s, with a share of the steps in contact."""
        return float(np.interp(share, self.shares, self.times))


def marched(given: dict[str, Any]) -> tuple[March, float]:
    """Return a march at its end, and its processor time, s."""
    march = March(resolve(apply_settings(named_scene("four_motions"), given)))
    begun = time.process_time()
    march.run()
    return march, time.process_time() - begun


def share_of(march: March) -> float:
    """Return the share of a march's steps in contact."""
    return float(march.counter[TOUCHED]) / march.steps


def base_of() -> Base:
    """March the engine without features, with each of `GAPS`; return its times.

    They are marched in turn, and to the end without a certificate.
    """
    each = [BASE | {"gap": gap, "plan": "everything"} for gap in GAPS]
    shares = [share_of(marched(given)[0]) for given in each]
    rounds = [[marched(given)[1] for given in [BASE, *each]] for _ in range(ROUNDS)]
    time, *times = map(min, zip(*rounds, strict=True))
    found = sorted(zip(shares, times, strict=True))
    return Base(time, *map(list, zip(*found, strict=True)))


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


def row_of(pair: tuple[str, ...], base: Base, *, oracle: bool) -> Row:
    """March a scene with some features; return its row.

    base : processor times of the engine without features
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
    both = [(marched(given)[1], marched(BASE)[1]) for _ in range(TURNS)]
    cost = min(time for time, _ in both) / min(time for _, time in both)
    share, scheme = share_of(march), type(march.scheme).__name__.lstrip("_")
    costs = cost, cost * base.time / base.like(share)
    return Row(pair, scheme, share, *costs, apart(given, march) if oracle else None)


def told(row: Row) -> str:
    """Return the line of a table for a pair."""
    name = " + ".join(row.pair)
    if row.refused:
        return f"| {name} | refused | | | | {row.refused} |"
    far = "" if row.apart is None else f"{row.apart:.0e}"
    costs = f"{row.share:.2f} | {row.cost:.1f} | {row.like:.1f}"
    return f"| {name} | {row.scheme} | {costs} | {far} |"


def cause_of(row: Row) -> str:
    """Return the feature that makes a pair dear, see `CAUSES`; else "other"."""
    return next((name for name in CAUSES if name in row.pair), "other")


def causes(rows: list[Row]) -> list[str]:
    """Return a line for each group of the pairs above `FAR`: which, how far, why."""
    groups: dict[str, list[Row]] = {}
    for row in rows:
        if row.like > FAR:
            groups.setdefault(cause_of(row), []).append(row)
    lines = []
    for name, own in sorted(groups.items(), key=lambda group: -len(group[1])):
        least, most = (f"{of(row.like for row in own):.1f}" for of in (min, max))
        why = CAUSES.get(name) or "; ".join(" + ".join(row.pair) for row in own)
        lines.append(f"- {name} ({len(own)}, {least} to {most} times): {why}")
    return lines


def page(rows: list[Row]) -> str:
    """Return the page: what holds, in a sentence, and the table of all pairs."""
    refused = sum(bool(row.refused) for row in rows)
    dear = sum(row.like > FAR for row in rows)
    more = sum(row.cost > FAR for row in rows)
    head = (
        f"# Features that hold together\n\n{len(rows)} pairs of features of an engine "
        f"(`python scripts/evidence/combinations.py`): {refused} are refused, and "
        f"{dear} of the others take more than {FAR:g} times the base with the same "
        f"share of steps in contact ({more} than {FAR:g} times the base as it is).\n"
    )
    table = (
        "| pair | integrator | in contact | cost / base | with this contact "
        "| difference, or reason |\n|---|---|---|---|---|---|"
    )
    why = causes(rows)
    return "\n".join([head, *why, *[""] * bool(why), table, *map(told, rows), ""])


def main(words: list[str] | None = None) -> int:
    """March the pairs that are asked for; print a line for each."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("features", nargs="*", choices=[[], *FEATURES], metavar="NAME")
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--quick", action="store_true")
    asked = parser.parse_args(words)
    names = asked.features or list(FEATURES)
    base = base_of()
    print("base: shares in contact", *(f"{share:.2f}" for share in base.shares))
    print("base: ms", *(f"{1e3 * time:.2f}" for time in base.times), flush=True)
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
