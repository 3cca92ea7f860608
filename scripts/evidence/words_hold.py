"""How often words hold: motions judged early and late, and however they are kept.

    python scripts/evidence/words_hold.py [DIR] [--runs 300] [--seed 11] [--write]
    python scripts/evidence/words_hold.py [DIR] --rotation full [--write]
    python scripts/evidence/words_hold.py [DIR] --uneven --runs 60
    python scripts/evidence/words_hold.py [DIR] --cells [--write]

Three populations, each motion integrated to 1, 1.25, 2.5, 5, 10 and 20 s: so many runs
on five engines (22 and 12 blades; speed, gap, friction, lobes and loading are drawn) at
a step of 4 us; 358 points of speed and gap of `jobs/light_ring.toml`, whose growth
often ends in a steady motion, and 60 engines drawn as for the presets, these two by
`draft`. The first is also kept in two other ways to 2.5 s: orbits every 20 ms, all tips
every 7 ms. The campaigns are in DIR (resumable; default a temporary folder), on two
ranks. Prints how many of each word there are at each time, what the words of earlier
times are at 20 s, and in how many cases any variable that words are given by depends on
what was kept; exit code 1 if one does. With `--rotation full`, only the first
population, with all effects of rotation, and what the certificate ends: exit code 1 if
a case that it ended has another word, or any other contact, where all is integrated to
2.5 s; with `--uneven`, only the latter, of mistuned blades. With `--cells`, how long
cells of maps are undecided, and what `until = "decided"` costs: cells drawn from the
maps over 121 speeds and 41 gaps of five engines, and of `four_motions` with full
rotation at friction 0.15, where it rubs all round, in `draft`, judged from 2.5 s on.
With --write, the tables go to scripts/evidence/words_hold.md, with rotation to
words_hold_full.md, of cells to decided.md.
"""

from __future__ import annotations

import sys
import tomllib
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hpcwhirl.scene.case_digest import PHYSICS_VERSION
from hpcwhirl.scene.input_names import full_name
from hpcwhirl.scene.quantities import PERFORMANCE
from hpcwhirl.store.reading.reader import words

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import parser_of, results_of, share, table, tell, working_folder
from evidence.estimates_drawn import moving_engine
from evidence.preset_map import inputs_of

PAGE = Path(__file__).with_suffix(".md")
FULL_PAGE, CELLS_PAGE = (PAGE.with_stem(n) for n in ("words_hold_full", "decided"))
TIMES = (1.0, 1.25, 2.5, 5.0, 10.0, 20.0)
COMPARED = 3  # of them, at which what is kept must not matter
STEP = 4e-6
RINGS, DRAWN = 358, 60  # motions of the other populations
LIGHT_RING = Path(__file__).parents[2] / "jobs" / "light_ring.toml"
TOLD = ("cases", "the same at 20 s", "undecided", "another word")
WORDS = ("damped", "sustained", "divergent", "undecided", "none")
# what is kept must not matter to words; `sample_interval` tells what is kept
KEPT: dict[str, dict[str, Any]] = {
    "no traces": {"traces": "summary"},
    "orbits every 20 ms": {"traces": "orbit", "interval": 0.02},
    "tips every 7 ms": {"traces": "full", "interval": 0.007},
}
FIRST = "no traces"
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

TURNING = "four_motions, rotation full, friction 0.15"
CELLS = {  # so many cells of an engine's map
    "rubbing": 250, "four_motions": 250, "diverging, 22 blades": 60,
    "mostly_damped": 60, "light ring, 12 blades": 60, TURNING: 60,
}  # fmt: skip
SPEEDS, GAPS = np.linspace(40.0, 520.0, 121), np.geomspace(0.8e-4, 4e-4, 41)
CELL_SEED, LATE = 16, np.array(TIMES[2:])


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


def rings(seed: int) -> list[dict[str, Any]]:
    """Return points of speed and gap on a ring that lets motion grow."""
    table = tomllib.loads(LIGHT_RING.read_text())
    bodies = ("casing", "rotor")
    ring = {f"engine.{b}.{n}": v for b in bodies for n, v in table["engine"][b].items()}
    shared = {n: v for n, v in table["scene"].items() if n != "duration"} | ring
    random = np.random.default_rng([seed, RINGS])
    return [
        shared | {
            "speed": float(random.uniform(40.0, 520.0)),
            "gap": float(np.exp(random.uniform(np.log(0.8e-4), np.log(4e-4)))),
        }
        for _ in range(RINGS)
    ]  # fmt: skip


def engines(seed: int) -> list[dict[str, Any]]:
    """Return engines that presets are held against, see `estimates_drawn`."""
    draws = [moving_engine(seed, index) for index in range(DRAWN)]
    return [{full_name(name): v for name, v in draw.items()} for draw in draws]


def cells() -> dict[str, list[dict[str, Any]]]:
    """Return {engine: inputs of cells of its map}, none twice."""
    named = {name: inputs_of(name) for name in ("rubbing", "four_motions")}
    turning = named["four_motions"] | {"engine.rotation": "full", "friction": 0.15}
    known = ENGINES | named | {"mostly_damped": {}, TURNING: turning}
    out = {}
    for name, count in CELLS.items():
        random = np.random.default_rng(CELL_SEED)
        chosen = random.choice(SPEEDS.size * GAPS.size, count, replace=False)
        places = zip(SPEEDS[chosen // GAPS.size], GAPS[chosen % GAPS.size], strict=True)
        out[name] = [BASE | known[name] | {"speed": float(speed), "gap": float(gap)}
                     for speed, gap in places]  # fmt: skip
    return out


def mapped(
    cases: list[dict[str, Any]], solver: dict[str, Any], kept: str, path: Path,
    times: Sequence[float] = (),
) -> Any:  # fmt: skip
    """Run the campaign of all cases and times kept in one way; return its results."""
    times = times or (TIMES if kept == FIRST else TIMES[:COMPARED])
    every = [case | {"duration": time} for time in times for case in cases]
    inputs = {"solver": solver, "output": KEPT[kept], "cases": every}
    return results_of(inputs, path, ranks=2)


def differing(results: list[Any]) -> dict[str, int]:
    """Return {variable: cases in which it depends on what was kept}."""
    others = results[1:]
    first = results[0].isel(case=slice(others[0].sizes["case"]))
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
    rows = []
    for time, at in zip(TIMES, names, strict=True):
        count = Counter(at)
        cells = (f"{count[w]} ({count[w] / len(at):.1%})" for w in WORDS[:-1])
        rows.append([f"{time:g} s", *cells, count["none"]])
    return table(["judged at", *WORDS[:-1], "unstable, overloaded"], rows)


def changes(names: np.ndarray, times: Iterable[float] = TIMES) -> list[list[Any]]:
    """Return rows of a table: what the words of earlier times are at the last."""
    return [[f"{time:g} s", word, *told_of(Counter(names[-1][at == word]), word)]
            for time, at in zip(times, names[:-1], strict=False)
            for word in WORDS[:3]]  # fmt: skip


def told_of(last: Counter[str], word: str) -> list[Any]:
    """Return the cells of cases that had a word and have these at the last."""
    other = {w: n for w, n in last.items() if w not in {word, "undecided"}}
    told = ", ".join(f"{n} {w}" for w, n in other.items()) or "0"
    return [last.total(), last[word], last["undecided"], told]


def wrong_at(names: np.ndarray, time: float) -> tuple[int, int]:
    """Return (decided cases at a time that have another word at the last, decided)."""
    at, last = names[TIMES.index(time)], names[-1]
    decided = np.isin(at, WORDS[:3])
    other = decided & np.isin(last, WORDS[:3]) & (at != last)
    return int(other.sum()), int(decided.sum())


def held(names: np.ndarray) -> list[str]:
    """Return how many words change, of all and of those that claim most."""
    out = []
    for time in (1.0, 2.5):
        other, decided = wrong_at(names, time)
        changed = names[-1][names[TIMES.index(time)] == "divergent"] != "divergent"
        out.append(
            f"- Of {decided} words other than undecided at {time:g} s, {other} are "
            f"another one at {TIMES[-1]:g} s ({other / max(decided, 1):.2%}); of "
            f"{changed.size} `divergent` {int(changed.sum())} are not."
        )
    return out


def section(title: str, result: Any) -> list[str]:
    """Return the tables of a population."""
    names = words(result.regime).reshape(len(TIMES), -1)
    head = [f"### {title}", "", *held(names), ""]
    later = table(["judged at", "word", *TOLD], changes(names))
    return [*head, *counted(names), "", *later, ""]


def main() -> int:
    """Run the campaigns and print the page."""
    parser = parser_of(__doc__, write=PAGE, folder="?")
    parser.add_argument("--runs", type=int, default=300)
    parser.add_argument("--seed", type=int, default=11)
    parser.add_argument("--rotation", choices=["none", "full"], default="none")
    parser.add_argument("--uneven", action="store_true", help="blades are mistuned")
    parser.add_argument("--cells", action="store_true", help="cells of maps")
    args = parser.parse_args()
    full, same = args.rotation == "full", True
    place = CELLS_PAGE if args.cells else FULL_PAGE if full else PAGE
    with working_folder(args.folder, "words") as folder:
        if args.cells:
            lines = of_cells(folder)
        elif args.uneven:
            lines, same = certified(uneven(args.runs, args.seed), folder)
        else:
            own = with_rotation if full else of_populations
            lines, same = own(folder, args.runs, args.seed)
    version = f"Physics version {PHYSICS_VERSION}."
    written = args.write and not args.uneven
    tell("\n".join([version, "", *lines]), place if written else None)
    return 0 if same else 1


def ending(names: np.ndarray, seconds: np.ndarray) -> list[Any]:
    """Return the cells of a row: cases that go on until decided, at most to the last.

    names, seconds : (times, cases), words and the kernel's seconds up to then
    """
    decided, cases = names != "undecided", np.arange(names.shape[1])
    ends = np.where(decided.any(axis=0), decided.argmax(axis=0), len(LATE) - 1)
    at, last, late = names[ends, cases], names[-1], decided[0] < decided.any(axis=0)
    changed = Counter(f"{a} to {b}" for a, b in zip(at, last, strict=True)
                      if "undecided" != a != b)  # fmt: skip
    open_ = (int((words == "undecided").sum()) for words in (names[0], at))
    return [
        *(share(n, cases.size, "{0} ({2:.1%}; {3})") for n in open_),
        f"{LATE[ends].mean() / LATE[0]:.2f}",
        f"{seconds[ends, cases].sum() / seconds[0].sum():.2f}", int(late.sum()),
        ", ".join(f"{n} {what}" for what, n in changed.items()) or "0",
    ]  # fmt: skip


def of_cells(folder: Path) -> list[str]:
    """Run the campaign of cells; return their tables."""
    chosen, shape = cells(), (len(LATE), -1)
    every = [case for own in chosen.values() for case in own]
    place, times = folder / "cells", LATE.tolist()
    data = mapped(every, {"preset": "draft"}, FIRST, place, times)
    names, seconds = words(data.regime).reshape(shape), data.seconds.values
    split = np.cumsum([len(own) for own in chosen.values()])[:-1]
    parts = [np.split(a, split, axis=1) for a in (names, seconds.reshape(shape))]
    falling, ends, later = [], [], []
    for engine, own, spent in zip(chosen, *parts, strict=True):
        counts = (own == "undecided").sum(axis=1).tolist()
        told = (share(n, own.shape[1], "{0} ({2:.1%}; {3})") for n in counts)
        falling.append([engine, own.shape[1], *told])
        ends.append([engine, *ending(own, spent)])
        later += [[engine, *row] for row in changes(own, times) if row[2]]
    heads = ["engine", "undecided at 2.5 s", "undecided at the end",
             "engine time, over 2.5 s each", "kernel's time, over that of 2.5 s",
             "words of after 2.5 s", "another word at 20 s"]  # fmt: skip
    return [
        "### Undecided cases", "",
        *table(["engine", "cells", *(f"{t:g} s" for t in times)], falling), "",
        '### With `until = "decided"`, `longest = 20`', "", *table(heads, ends), "",
        "### What words are at 20 s", "",
        *table(["engine", "at", "word", *TOLD], later),
    ]  # fmt: skip


def in_turn(runs: int) -> str:
    """Return the title of the first population."""
    told = f"{runs} motions, step {STEP:g} s, {len(ENGINES)} engines in turn"
    return f"{told}: {'; '.join(ENGINES)}"


def with_rotation(folder: Path, runs: int, seed: int) -> tuple[list[str], bool]:
    """Run the first population with rotation; return tables, and whether all is well.

    The certificate is held against runs to the end, which look for none.
    """
    cases = [case | {"engine.rotation": "full"} for case in drawn(runs, seed)]
    result = mapped(cases, {"time_step": STEP}, FIRST, folder / "full")
    proofs, same = certified(cases, folder)
    return [*proofs, "", *section(in_turn(runs), result)], same


def uneven(runs: int, seed: int) -> list[dict[str, Any]]:
    """Return motions with rotation of engines whose blades' moduli differ by 3 %."""
    random, cases = np.random.default_rng([seed, 3]), drawn(runs, seed)
    for case in cases:
        blades = case.get(ROTOR + "blades", 22)
        moduli = random.normal(0.0, 0.03, int(blades)).tolist()
        case |= {"engine.rotation": "full", ROTOR + "mistuning": moduli}
    return cases


def certified(cases: list[dict[str, Any]], folder: Path) -> tuple[list[str], bool]:
    """Return what the certificate ends, and whether it is as integrated to the end."""
    solver: dict[str, Any] = {"time_step": STEP}
    proved = mapped(
        cases, solver | {"until": "certain"}, "orbits every 20 ms",
        folder / "certain",
    )  # fmt: skip
    whole = mapped(
        cases, solver | {"plan": "everything"}, "orbits every 20 ms",
        folder / "everything",
    )  # fmt: skip
    early = words(proved.stop) == "certain"
    mine, theirs = words(proved.regime), words(whole.regime)
    open_ = early & (theirs == "undecided")
    other = {
        name: int((early & (proved[name].values != whole[name].values)).sum())
        for name in ("contacts", "last_contact")
    } | {"regime": int((early & ~open_ & (mine != theirs)).sum())}
    differ = ", ".join(f"{count} in `{name}`" for name, count in other.items())
    proofs = (
        f"- Certificate: it ended {int(early.sum())} of {early.size} cases before "
        f"their end. Integrated to the end, {int(open_.sum())} of them are "
        "`undecided`, as they are still coming to rest, and so many others differ: "
        f"{differ}."
    )
    return [proofs], not any(other.values())


def of_populations(folder: Path, runs: int, seed: int) -> tuple[list[str], bool]:
    """Run the campaigns; return tables, and whether what is kept does not matter."""
    draft = {"preset": "draft"}
    ring = mapped(rings(seed), draft, FIRST, folder / "light-ring")
    drew = mapped(engines(seed), draft, FIRST, folder / "engines")
    cases, step = drawn(runs, seed), {"time_step": STEP}
    results = [
        mapped(cases, step, kept, folder / kept.replace(" ", "-")) for kept in KEPT
    ]
    apart = differing(results)
    told = f"variables that differ: {apart}" if apart else "no variable differs."
    compared = f"{', '.join(KEPT)}), {results[1].sizes['case']} cases"
    return [
        f"- Kept in {len(KEPT)} ways ({compared}: {told}", "",
        *section(in_turn(runs), results[0]),
        *section(f"{RINGS} motions of `jobs/light_ring.toml`, draft", ring),
        *section(f"{DRAWN} engines drawn at random, draft", drew),
    ], not apart  # fmt: skip


if __name__ == "__main__":
    sys.exit(main())
