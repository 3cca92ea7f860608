"""Do two ways to integrate give the same words? Random cases, confusion, twins.

    python scripts/evidence/agreement.py exact      modal against exact
    python scripts/evidence/agreement.py elements   ring: harmonics, elements
    python scripts/evidence/agreement.py general    modal against mode by mode
    python scripts/evidence/agreement.py paper      modal against Algorithm 1
    options: --cases 200  --seed 1  --duration 2.5  --time-step 1e-6
             --engine mostly_damped (four_motions else, the default)
             --speeds 520 420 270 (Table 2 at these)  --sweep (at all of its speeds)
             --rotation full

Cases are drawn over the paper's ranges: speed 20 ... 520 rad/s, k = 1 or 2, gap 0.128
... 1 mm, friction 0.1 ... 0.2; `--sweep` takes Table 2's speeds instead. Motion in
contact is chaotic: where two words differ, twins of the case, whose force differs by a
few 1e-7 and a few 1e-5 of itself (as much as two schemes differ after a few ms), are
integrated in the first way. If they give the second way's word as well, the case lies
closer to a boundary than the motion can tell, and is listed so.
Exits 1 if a word differs that no twin gives, `undecided` left aside.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import numpy as np
from scipy.stats import qmc

from hpcwhirl.campaign.simulate import simulate
from hpcwhirl.scene import Scene, apply_settings, engine_names, named_scene

WAYS: dict[str, tuple[dict[str, str], dict[str, str]]] = {
    "exact": ({"scheme": "modal"}, {"scheme": "exact"}),
    "elements": ({"scheme": "modal"}, {"discretization": "elements"}),
    "general": ({"scheme": "modal"}, {"scheme": "general"}),
    "paper": ({"scheme": "modal"}, {"scheme": "paper"}),
}
NUDGES = (1e-7, 2e-7, 3e-7, 1e-5, 2e-5, 3e-5, 4e-5, 5e-5, 6e-5)
PARTED = 1e-3
KEPT = ("whirl", "growth_rate", "window", "late_fed", "late_lost", "contact_impulse",
        "orbit_radius")  # fmt: skip
SPEEDS, GAPS, FRICTIONS = (20.0, 520.0), (1.28e-4, 1e-3), (0.1, 0.2)


def drawn(count: int, seed: int) -> list[dict[str, Any]]:
    """Return the inputs of random cases, a scrambled Sobol sequence."""
    bits = max(1, (count - 1).bit_length())
    points = qmc.Sobol(4, rng=seed).random_base2(bits)[:count]
    low, high = zip(SPEEDS, GAPS, FRICTIONS, strict=True)
    scaled = qmc.scale(points[:, :3], low, high)
    return [
        {"speed": float(s), "gap": float(g), "friction": float(m),
         "nodal_diameter": 1 + int(p >= 0.5)}
        for (s, g, m), p in zip(scaled, points[:, 3], strict=True)
    ]  # fmt: skip


def outcome(scene: Scene) -> dict[str, Any]:
    """Return the words of a scene, the numbers behind them, and the seconds."""
    result = simulate(scene)
    row, word = result.row, result.row["regime"]
    if row["outcome"] == "unstable":
        word = "unstable"
    spent = {"seconds": result.performance["seconds"]}
    return {"word": word, "traces": result.traces} | {n: row[n] for n in KEPT} | spent


def parting(a: dict[str, Any], b: dict[str, Any]) -> float:
    """Return when two orbits differ by `PARTED` of their peak, s; the end if never."""
    time = a["traces"]["time"]
    one, other = a["traces"]["centre"], b["traces"]["centre"]
    count = min(len(one), len(other))
    apart = np.abs(one[:count] - other[:count]).max(axis=1)
    far = np.flatnonzero(apart > PARTED * np.abs(one).max())
    return float(time[far[0]] if len(far) else time[count - 1])


def numbers(found: dict[str, Any]) -> str:
    """Return the evidence behind a word in a line."""
    change = found["growth_rate"] * found["window"]
    share = found["late_fed"] / found["late_lost"] if found["late_lost"] else 0.0
    return (
        f"{found['word']} ({found['whirl']}; ln growth {change:+.2f}, "
        f"fed/lost {share:.2f})"
    )


def confusion(pairs: Iterable[tuple[str, str]]) -> list[str]:
    """Return a line for each pair of words, in their order, and how often it is."""
    counts = sorted(Counter(pairs).items())
    return [f"  {one:10s} | {other:10s} {count}" for (one, other), count in counts]


def compare(args: argparse.Namespace) -> int:
    """Integrate all cases both ways, print what differs, return the unexplained."""
    base = apply_settings(
        named_scene(args.engine),
        {"duration": args.duration, "time_step": args.time_step, "traces": "orbit",
         "rotation": args.rotation},
    )  # fmt: skip
    speeds = range(20, 521, 10) if args.sweep else args.speeds
    cases = [{"speed": float(v)} for v in speeds] or drawn(args.cases, args.seed)
    one, other = WAYS[args.way]
    with ProcessPoolExecutor(args.processes) as pool:
        ways = [
            pool.map(outcome, [apply_settings(base, case | way) for case in cases])
            for way in (one, other)
        ]
        pairs = list(zip(*ways, strict=True))
        differ = [i for i, (a, b) in enumerate(pairs) if a["word"] != b["word"]]
        force = base.force
        nudged = [
            apply_settings(base, cases[i] | one | {"force": force * (1 + nudge)})
            for i in differ
            for nudge in NUDGES
        ]
        twins = [found["word"] for found in pool.map(outcome, nudged)]
    report(args, cases, pairs)
    unexplained = 0
    for place, i in enumerate(differ):
        a, b = pairs[i]
        words = Counter(twins[place * len(NUDGES) : (place + 1) * len(NUDGES)])
        aside = "undecided" in (a["word"], b["word"])
        near = b["word"] in words or (len(words) > 1 and aside)
        unexplained += not (aside or near)
        verdict = "undecided" if aside else "on a boundary" if near else "UNEXPLAINED"
        given = ", ".join(f"{w} {n}" for w, n in sorted(words.items()))
        print(f"{verdict}: {cases[i]}\n  {numbers(a)} | {numbers(b)}\n  twins: {given}")
    return unexplained


def report(args: argparse.Namespace, cases: list[Any], pairs: list[Any]) -> None:
    """Print the confusion matrix of words and the seconds of both ways."""
    found = [(a["word"], b["word"]) for a, b in pairs]
    same, whirl = (sum(a[n] == b[n] for a, b in pairs) for n in ("word", "whirl"))
    seconds = [sum(pair[i]["seconds"] for pair in pairs) for i in (0, 1)]
    print(
        f"{args.way}: {len(cases)} cases of {args.duration:g} s, dt "
        f"{args.time_step:g} s: same regime {same}, same whirl {whirl}; "
        f"{seconds[0]:.1f} s against {seconds[1]:.1f} s of computing"
    )
    print(*confusion(found), sep="\n")
    equal = [(a, b) for a, b in pairs if a["word"] == b["word"]]
    for word in sorted({a["word"] for a, _ in equal}):
        own = [(a, b) for a, b in equal if a["word"] == word and a["whirl"] != "none"]
        if not own:
            continue
        late = np.median([parting(a, b) for a, b in own])
        apart = [
            np.median([abs(b[n] / a[n] - 1) for a, b in own if a[n] > 0] or [0.0])
            for n in ("contact_impulse", "orbit_radius")
        ]
        print(
            f"  {word}, median of {len(own)}: orbits part ({PARTED:g} of the peak) at "
            f"{late:.3g} s, contact impulse {apart[0]:.2%} apart, orbit radius "
            f"{apart[1]:.2%}"
        )


def main() -> int:
    """Parse the command line and compare."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("way", choices=WAYS)
    parser.add_argument("--engine", default="four_motions", choices=engine_names())
    parser.add_argument("--rotation", default="none", choices=["none", "full"])
    parser.add_argument("--cases", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--duration", type=float, default=2.5)
    parser.add_argument("--time-step", type=float, default=1e-6)
    parser.add_argument("--speeds", type=float, nargs="+", default=[])
    parser.add_argument("--sweep", action="store_true")
    parser.add_argument("--processes", type=int, default=2)
    return 1 if compare(parser.parse_args()) else 0


if __name__ == "__main__":
    sys.exit(main())
