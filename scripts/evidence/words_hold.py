"""How often words hold: motions judged early and late, and however they are kept.

    python scripts/evidence/words_hold.py [DIR] [--runs 300] [--seed 11] [--write]

Draws speed, gap, friction, lobes and loading on five engines (22 and 12 blades), and
integrates each motion to 1, 1.25, 2.5, 5 and 10 s, each of these kept in three ways:
no traces, orbits every 20 ms, all tips every 7 ms. The campaigns are in DIR (resumable;
default a temporary folder), on two ranks. Prints how many of each word there are at
each time, what the words of earlier times are at 10 s, and in how many cases any
variable that words are given by depends on what was kept; exit code 1 if one does.
With --write, the tables go to scripts/evidence/words_hold.md.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

import hpcwhirl
from hpcwhirl.scene.quantities import PERFORMANCE
from hpcwhirl.store.reading.reader import words

sys.path.insert(0, str(Path(__file__).parents[1]))
from cost.under_mpi import campaign
from evidence.preset_map import inputs_of

PAGE = Path(__file__).with_suffix(".md")
TIMES = (1.0, 1.25, 2.5, 5.0, 10.0)
STEP = 4e-6
WORDS = ("damped", "sustained", "divergent", "undecided", "none")
# what is kept must not matter to words; `sample_interval` tells what is kept
KEPT: dict[str, dict[str, Any]] = {
    "no traces": {"traces": "summary"},
    "orbits every 20 ms": {"traces": "orbit", "interval": 0.02},
    "tips every 7 ms": {"traces": "full", "interval": 0.007},
}
CASING, ROTOR = "engine.casing.", "engine.rotor."
BASE = inputs_of("mostly_damped")
ENGINES: dict[str, dict[str, Any]] = {  # what differs from it
    "mostly_damped, 22 blades": {},
    "four_motions, 22 blades": inputs_of("four_motions"),
    "diverging, 22 blades": {
        CASING + "thickness": 0.036, CASING + "width": 0.345,
        CASING + "damping": 0.0756, CASING + "support_damping": 0.266,
        CASING + "support_frequency": 15.0, ROTOR + "damping": 0.0091,
        ROTOR + "suspension_damping": 0.0536,
    },
    "slowly ringing, 22 blades": {
        CASING + "thickness": 0.016, CASING + "width": 0.0734, CASING + "damping": 0.03,
        CASING + "support_damping": -1.0,
    },
    "light ring, 12 blades": {
        ROTOR + "blades": 12, CASING + "thickness": 0.02, CASING + "damping": 0.05,
        CASING + "support_damping": 0.2, ROTOR + "suspension_damping": 0.05,
    },
}  # fmt: skip


def drawn(runs: int, seed: int) -> list[dict[str, Any]]:
    """Return the inputs of so many motions, engines in turn."""
    random = np.random.default_rng(seed)
    out = []
    for run in range(runs):
        engine = list(ENGINES.values())[run % len(ENGINES)]
        out.append(BASE | engine | {
            "speed": float(random.uniform(20.0, 520.0)),
            "gap": float(np.exp(random.uniform(np.log(6e-5), np.log(4e-4)))),
            "friction": float(random.choice([0.0, 0.05, 0.1, 0.2, 0.3])),
            "nodal_diameter": int(random.choice([1, 1, 1, 2, 3])),
            "pulse": float(random.uniform(4e-4, 1e-3)),
        })  # fmt: skip
    return out


def mapped(cases: list[dict[str, Any]], kept: str, folder: Path) -> Any:
    """Run the campaign of all cases and times kept in one way; return its results."""
    name = kept.replace(" ", "-").replace(",", "")
    path, out = folder / f"{name}.toml", folder / name
    every = [case | {"duration": time} for time in TIMES for case in cases]
    inputs = {"solver": {"time_step": STEP}, "output": KEPT[kept], "cases": every}
    path.write_text(tomli_w.dumps(inputs))
    campaign(path, out)
    return hpcwhirl.open_results(out)


def differing(results: list[Any]) -> dict[str, int]:
    """Return {variable: cases in which it depends on what was kept}."""
    first, *others = results
    aside = {*PERFORMANCE, "sample_interval"}
    names = [
        n for n in first.data_vars if first[n].dims == ("case",) and n not in aside
    ]
    out = {}
    for name in names:
        values = first[name].values
        apart = np.zeros(len(values), bool)
        for other in others:
            theirs = other[name].values
            numbers = values.dtype.kind == "f"
            apart |= [
                not np.array_equal(a, b, equal_nan=numbers)
                for a, b in zip(values, theirs, strict=True)
            ]
        if apart.any():
            out[name] = int(apart.sum())
    return out


def counted(names: np.ndarray) -> list[str]:
    """Return rows of a table: words at each time, and their share."""
    rows = ["| judged at | " + " | ".join(WORDS[:-1]) + " | unstable |"]
    rows.append("|---" * 6 + "|")
    for time, at in zip(TIMES, names, strict=True):
        count = Counter(at)
        cells = [f"{count[w]} ({count[w] / len(at):.1%})" for w in WORDS[:-1]]
        rows.append(f"| {time:g} s | " + " | ".join(cells) + f" | {count['none']} |")
    return rows


def changes(names: np.ndarray) -> list[str]:
    """Return rows of a table: what the words of earlier times are at the last."""
    rows = [
        "| judged at | word | cases | the same at 10 s | undecided | another word |"
    ]
    rows.append("|---" * 6 + "|")
    for time, at in zip(TIMES[:-1], names[:-1], strict=True):
        for word in WORDS[:3]:
            later = Counter(names[-1][at == word])
            total, same, open_ = later.total(), later[word], later["undecided"]
            other = {w: n for w, n in later.items() if w not in {word, "undecided"}}
            told = ", ".join(f"{n} {w}" for w, n in other.items()) or "0"
            rows.append(
                f"| {time:g} s | {word} | {total} | {same} | {open_} | {told} |"
            )
    return rows


def wrong_at(names: np.ndarray, time: float) -> tuple[int, int]:
    """Return (decided cases at a time that have another word at the last, decided)."""
    at, last = names[TIMES.index(time)], names[-1]
    decided = np.isin(at, WORDS[:3])
    other = decided & np.isin(last, WORDS[:3]) & (at != last)
    return int(other.sum()), int(decided.sum())


def page(results: list[Any], runs: int, seed: int) -> tuple[str, bool]:
    """Return the page, and whether no variable depends on what was kept."""
    names = words(results[0].regime).reshape(len(TIMES), runs)
    apart = differing(results)
    other, decided = wrong_at(names, 2.5)
    held = (
        f"- Of {decided} words other than undecided at 2.5 s, {other} are another one "
        f"at 10 s ({other / max(decided, 1):.2%})."
    )
    made = (
        f"Made by `python scripts/evidence/words_hold.py --runs {runs} --seed {seed}`; "
        f"{len(ENGINES)} engines in turn: {'; '.join(ENGINES)}."
    )
    head = [
        f"# How often words hold: {runs} motions, seed {seed}, step {STEP:g} s",
        "",
        made,
        "",
        f"- Kept in {len(KEPT)} ways ({', '.join(KEPT)}), {len(TIMES) * runs} cases: "
        + (f"variables that differ: {apart}" if apart else "no variable differs."),
        held,
        "",
    ]
    rows = [*head, *counted(names), "", *changes(names), ""]
    return "\n".join(rows), not apart


def main() -> int:
    """Run the campaigns and print the page."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("folder", nargs="?", type=Path, help="of the campaigns")
    parser.add_argument("--runs", type=int, default=300)
    parser.add_argument("--seed", type=int, default=11)
    parser.add_argument("--write", action="store_true", help=f"also to {PAGE.name}")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = args.folder or Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        cases = drawn(args.runs, args.seed)
        results = [mapped(cases, kept, folder) for kept in KEPT]
        text, same = page(results, args.runs, args.seed)
    print(text)
    if args.write:
        PAGE.write_text(text)
    return 0 if same else 1


if __name__ == "__main__":
    sys.exit(main())
