"""Does the lean plan give what the whole model gives, and what does it save? Runs both.

    python scripts/evidence/lean.py words        random scenes, lean against everything
    python scripts/evidence/lean.py certain      the same, ended once a word is proved
    python scripts/evidence/lean.py time         seconds by kind of scene
    python scripts/evidence/lean.py symmetry     how long a symmetric motion stays so
    options: --cases 300  --seed 1  --duration 2.5  --time-step 2e-6  --processes 2
             --repeats 5 (time: the least of so many)
             --damping 0.005 (words: of the casing, light: symmetries break)
             --own (words: on `mostly_damped` alone)
             --blades 12 22 (words: of the engines drawn, those with so many; every N
             that folds has a kernel of its own, half a minute to compile)

`words` draws speed 20 ... 520 rad/s, k = 0 ... 4, gap 0.1 ... 1 mm, friction 0 (one
case in five) or up to 0.2, ring 8 ... 26 mm thick, force 20 ... 150 kN, every fifth
shaft clamped, and engines: N of 12 ... 36, damping of the casing 0.003 ... 0.2 and of
the rotor 0.001 ... 0.03, half of them with a support damped as the casing. Motion in
contact is chaotic, and a folded model has other round-off: it exits 1 if a word
differs. Contact makes round-off grow, and a plan believes in one sector up to 12
touchdowns a blade: numbers are told by touchdowns, over the cases of which the plan
left something out. `certain` judges the regimes alone: there a word may differ only
where the whole run is `undecided`.
"""

from __future__ import annotations

import argparse
import itertools
import sys
from collections import defaultdict
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import qmc

from hpcwhirl.campaign.simulate import result_of
from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.march import March
from hpcwhirl.scene import Scene, apply_settings, named_scene

sys.path.insert(0, str(Path(__file__).parents[1]))
from evidence.confusion import confusion

BLADES = (12, 16, 18, 22, 24, 30, 36)
LOW = (20.0, 0.0, 1e-4, 0.0, 0.008, 20e3, 0.0)
HIGH = (520.0, 5.0, 1e-3, 0.2, 0.026, 150e3, 5.0)
# place in BLADES, log10 of the damping of casing and rotor, share on a support
ENGINE_LOW, ENGINE_HIGH = (0.0, -2.5, -3.0, 0.0), (len(BLADES), -0.7, -1.5, 1.0)
KEPT = ("regime", "whirl", "outcome", "stop", "folds", "certificate", "contacts")
FLOORS = {  # of each number compared: below it, it is round-off of what has been
    "contact_impulse": 1e-9, "centre_peak": 1e-10, "orbit_radius": 1e-10,
    "ledger_damping": 1e-9, "last_contact": 1e-9, "growth_rate": 1e-3,
}  # fmt: skip
Pair = tuple[dict[str, Any], dict[str, Any]]  # outcome of a scene, lean and whole
WHOLE = {"plan": "everything"}
CERTAIN = {"until": "certain", "traces": "summary"}
KINDS: dict[str, dict[str, Any]] = {
    "k = 1 in contact: nothing to leave out": {"speed": 300.0},
    "k = 2, contact does not end: begun anew, whole":
        {"nodal_diameter": 2, "engine.casing.damping": 0.0, "support_frequency": 100.0},
    "k = 2, 0.06 s: one of two sectors, no closed form":
        {"nodal_diameter": 2, "duration": 0.06},
    "k = 2, damped": {"nodal_diameter": 2},
    "k = 2, damped, words alone": {"nodal_diameter": 2} | CERTAIN,
    "k = 2, gap 1 mm, damped, words alone":
        {"nodal_diameter": 2, "gap": 1e-3} | CERTAIN,
    "k = 0: one blade for 22, never touches": {"nodal_diameter": 0},
    "k = 1, gap 10 cm: never touches": {"gap": 0.1, "force": 1e3},
    "no load": {"force": 0.0},
}  # fmt: skip


def drawn(count: int, seed: int, *, engines: bool = True) -> list[dict[str, Any]]:
    """Return the inputs of random scenes, a scrambled Sobol sequence."""
    bits = max(1, (count - 1).bit_length())
    low, high = (LOW + ENGINE_LOW, HIGH + ENGINE_HIGH) if engines else (LOW, HIGH)
    points = qmc.Sobol(len(low), rng=seed).random_base2(bits)
    return [
        _scene(p[:7]) | _engine(p[7:]) for p in qmc.scale(points, low, high)[:count]
    ]


def _scene(point: Sequence[float]) -> dict[str, Any]:
    """Return the operating point that 7 numbers stand for."""
    speed, k, gap, friction, thickness, force, centre = map(float, point)
    return {
        "speed": speed, "nodal_diameter": int(k), "gap": gap,
        "friction": friction if friction > 0.04 else 0.0, "thickness": thickness,
        "force": force, "centre": "clamped" if centre < 1.0 else "free",
    }  # fmt: skip


def _engine(point: Sequence[float]) -> dict[str, Any]:
    """Return the engine that 4 numbers stand for; `mostly_damped` for none."""
    if not len(point):
        return {}
    place, casing, rotor, support = map(float, point)
    own = {"support_damping": -1.0} if support < 0.5 else {}
    damping = {"casing.damping": 10.0**casing, "rotor.damping": 10.0**rotor}
    return {"blades": BLADES[int(place)]} | damping | own


def outcome(scene: Scene) -> dict[str, Any]:
    """Return words, numbers and seconds of a scene."""
    march = March(resolve(scene))
    row = result_of(march.case, march.run()).row
    found = {name: row[name] for name in (*KEPT, *FLOORS)}
    return found | {"seconds": march.seconds, "blades": march.model.blades}


def kind(case: dict[str, Any], lean: dict[str, Any]) -> str:
    """Return what a plan did to a case."""
    ways = [f"folded {lean['folds']} times"] if lean["folds"] > 1 else []
    ways += ["closed form"] if lean["certificate"] >= 0 else []
    return f"k = {case['nodal_diameter']}: " + (", ".join(ways) or "as the whole")


def apart(lean: dict[str, Any], whole: dict[str, Any]) -> dict[str, float]:
    """Return the relative difference of each number that is no round-off."""
    out = {}
    for name, floor in FLOORS.items():
        scale = max(abs(lean[name]), abs(whole[name]))
        out[name] = abs(lean[name] - whole[name]) / scale if scale > floor else 0.0
    return out


def differs(lean: dict[str, Any], whole: dict[str, Any], *, certain: bool) -> bool:
    """Return whether a word is another one where it must not be."""
    if certain:
        return lean["regime"] != whole["regime"] != "undecided"
    return (lean["regime"], lean["whirl"]) != (whole["regime"], whole["whirl"])


def words(args: argparse.Namespace) -> int:
    """Integrate random scenes both ways; print words, differences and seconds."""
    base = apply_settings(
        named_scene("mostly_damped"),
        {"duration": args.duration, "time_step": args.time_step},
    )
    cases = drawn(args.cases, args.seed, engines=not args.own)
    if args.blades and not args.own:
        cases = [case for case in cases if case["blades"] in args.blades]
    if args.damping:
        cases = [case | {"engine.casing.damping": args.damping} for case in cases]
    short = CERTAIN if args.what == "certain" else {}
    scenes = [apply_settings(base, case | short) for case in cases]
    whole = [apply_settings(base, case | WHOLE) for case in cases]
    with ProcessPoolExecutor(args.processes) as pool:
        ways = [list(pool.map(outcome, each, chunksize=4)) for each in (scenes, whole)]
    return tell(cases, list(zip(*ways, strict=True)), certain=args.what == "certain")


def tell(
    cases: Sequence[dict[str, Any]], pairs: Sequence[Pair], *, certain: bool
) -> int:
    """Print what differs between lean and whole; return how many words do."""
    wrong, groups = 0, defaultdict(list)
    for case, pair in zip(cases, pairs, strict=True):
        groups[kind(case, pair[0])].append(pair)
        if differs(*pair, certain=certain):
            wrong += 1
            told = [f"{w['regime']} {w['whirl']} ({w['stop']})" for w in pair]
            print(f"differs: {case}: {told[0]} | {told[1]}")
    print(f"{len(cases)} cases, {wrong} with another word; lean | whole:")
    print(*confusion((a["regime"], b["regime"]) for a, b in pairs), sep="\n")
    for name, own in sorted(groups.items()):
        spent = [sum(pair[i]["seconds"] for pair in own) for i in (0, 1)]
        print(f"  {name}: {len(own)} cases, {spent[1] / spent[0]:.1f} times sooner")
    if not certain:  # a case that ends with its word has the numbers of that instant
        tell_numbers(pairs)
    return wrong


def tell_numbers(pairs: Sequence[Pair]) -> None:
    """Print how far apart the numbers are, over the cases that a plan changed."""
    changed = [p for p in pairs if p[0]["folds"] > 1 or p[0]["certificate"] >= 0]
    print(f"numbers of the {len(changed)} cases of which something is left out:")
    for low, high in itertools.pairwise((-1.0, 0.0, 1.0, 3.0, 6.0, 12.0, np.inf)):
        own = [p for p in changed if low < touches(p[1]) <= high]
        _tell_group(f"{max(low, 0.0):g} < touchdowns a blade <= {high:g}", own)
    _tell_group("all", changed)


def touches(found: dict[str, Any]) -> float:
    """Return the touchdowns of a blade, on average."""
    return float(found["contacts"] / found["blades"])


def _tell_group(name: str, pairs: Sequence[Pair]) -> None:
    if not pairs:
        return
    off = [apart(*pair) for pair in pairs]
    most = [max(each.values()) for each in off]
    worst = {n: max(each[n] for each in off) for n in FLOORS}
    largest = max(worst, key=lambda n: worst[n])
    middle, high = np.quantile(most, [0.5, 0.95])
    print(
        f"  {name}: {len(pairs)} cases, relative differences {middle:.1e} (median), "
        f"{high:.1e} (95 %), {worst[largest]:.1e} (largest: {largest})"
    )


def clock(args: argparse.Namespace) -> int:
    """Print the seconds of each kind of scene, lean and whole, by turns."""
    base = apply_settings(named_scene("mostly_damped"), {"time_step": args.time_step})
    for name, settings in KINDS.items():
        spent: dict[str, list[float]] = {"lean": [], "everything": []}
        for _ in range(args.repeats):
            for plan, own in spent.items():
                given = settings | ({"until": "end"} if plan == "everything" else {})
                march = March(resolve(apply_settings(base, given | {"plan": plan})))
                march.advance(1)
                march.seconds = 0.0
                march.run()
                own.append(march.seconds)
        least = {plan: min(own) for plan, own in spent.items()}
        print(
            f"{name}: {least['everything']:.3f} s whole, {least['lean']:.4f} s lean, "
            f"{least['everything'] / least['lean']:.1f} times"
        )
    return 0


def asymmetry(march: March) -> float:
    """Return the tips' part that is not the same on all sectors, over the whole."""
    tips = march.displacements()[0][: 2 * march.model.blades].reshape(-1, 2)
    folds = np.gcd(march.scene.nodal_diameter, march.model.blades)
    sectors = tips.reshape(folds, -1)
    scale = np.abs(sectors).max()
    return float(np.abs(sectors - sectors.mean(axis=0)).max() / scale) if scale else 0.0


def symmetry(args: argparse.Namespace) -> int:
    """Print how asymmetry grows in the whole model of scenes with even k."""
    base = apply_settings(
        named_scene("mostly_damped"),
        {"duration": args.duration, "time_step": args.time_step} | WHOLE,
    )
    marks = (1e-12, 1e-9, 1e-6, 1e-3)
    for case in drawn(args.cases, args.seed):
        if case["nodal_diameter"] not in {2, 4}:
            continue
        march, passed = March(resolve(apply_settings(base, case))), {}
        while not march.done:
            march.advance(march.stride * 5)
            share = asymmetry(march)
            for mark in marks:
                if share > mark:
                    passed.setdefault(mark, march.steps * args.time_step)
        row = result_of(march.case, march.history()).row
        if row["regime"] in {"damped", "none"} and max(passed, default=0.0) < 1e-9:
            continue
        when = ", ".join(f"{mark:g} at {time:.3f} s" for mark, time in passed.items())
        end = f"{row['regime']} {row['whirl']}, ended at {row['end_time']:.2f} s"
        print(f"{case}: {end}; asymmetry {when}", flush=True)
    return 0


def main() -> int:
    """Parse the command line and do what is asked."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=["words", "certain", "time", "symmetry"])
    parser.add_argument("--cases", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--duration", type=float, default=2.5)
    parser.add_argument("--time-step", type=float, default=2e-6)
    parser.add_argument("--damping", type=float, default=0.0)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--own", action="store_true")
    parser.add_argument("--blades", type=int, nargs="+", choices=BLADES)
    parser.add_argument("--repeats", type=int, default=5)
    args = parser.parse_args()
    ways = {"words": words, "certain": words, "time": clock, "symmetry": symmetry}
    return 1 if ways[args.what](args) else 0


if __name__ == "__main__":
    sys.exit(main())
