"""How sure the four motions of an engine are: under scatter, and along each unknown.

    python scripts/identify/sure.py --out DIR [--engine NAME ...] [--fast] [--write]
                                    [--scatter 0.01 ...] [--change 0.01 ...]

Scatter: every unknown times exp(s z), z normal, s = 1 % and 5 %, 64 draws from a seed;
of each motion the share of draws with its regime and whirl, with the interval (Wilson,
95 %) that so many draws leave open. Sharpness: one unknown at a time by up to 20 %, the
others held; how far it may go until a motion is lost. At the default inputs; `--fast`
takes the preset of `identify.screen`. `--write` puts the section of an engine and its
numerics into scripts/identify/sure.md, in the place of what it was before.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import parser_of, share, table, with_section
from identify.full import Found, Stage, compute
from identify.score import pick
from identify.screen import MOTIONS, motion
from identify.space import UNKNOWNS, Engine, engine_of_scene, scattered

from hpcwhirl.scene import engine_names, named_scene

SCATTERS = (0.01, 0.05)
CHANGES = (0.01, 0.02, 0.05, 0.1, 0.2)
FOUR = Stage("scatter", tuple(MOTIONS))
PAGE = Path(__file__).with_name("sure.md")
NUMERICS = {True: "the preset of the screening", False: "the default inputs"}
LETTERS = {"damped": "d", "sustained": "S", "divergent": "V", "undecided": "?"}
NAMES = dict(zip(UNKNOWNS, (
    ("thickness, mm", 1e3), ("width, mm", 1e3), ("ring damping", 1.0),
    ("support damping", 1.0), ("support, rad/s", 1.0), ("rotor damping", 1.0),
    ("suspension damping", 1.0), ("pulse, ms", 1e3),
), strict=True))  # fmt: skip
Compute = Callable[[Sequence[Engine]], list[Found]]


def right(found: Found) -> list[bool]:
    """Return which of the four motions have regime and whirl of the paper."""
    sweep = pick(found.rows, "table 2")
    return [(sweep[s]["regime"], sweep[s]["whirl"]) == w for s, w in MOTIONS.items()]


def scatter_lines(found: dict[float, list[Found]]) -> list[str]:
    """Return the table of shares under scatter."""
    heads = [f"{speed:g} {' '.join(words)}" for speed, words in MOTIONS.items()]
    lines = []
    for scatter, items in found.items():
        each = np.array([right(item) for item in items])
        counts = [*each.sum(axis=0).tolist(), int(each.all(axis=1).sum())]
        lines.append([f"{scatter:.0%}", *(share(n, len(items), "{0} of {1} ({3})")
                                          for n in counts)])  # fmt: skip
    return [*table(["scatter", *heads, "all four"], lines), ""]


def sharp_lines(tried: dict[tuple[str, float], Found]) -> list[str]:
    """Return the table of words along each unknown, and how far all four hold."""
    steps = sorted({step for _, step in tried})
    lines = []
    for name in UNKNOWNS:
        own = {step: tried[name, step] for step in steps}
        told = [letters(found) for found in own.values()]
        lines.append([NAMES[name][0], *told, holds(own)])
    heads = ["unknown", *(f"{step:+.0%}" if step else "0" for step in steps)]
    return [*table([*heads, "all four hold"], lines), ""]


def letters(found: Found) -> str:
    """Return the words at the four speeds, a star behind those that are not right."""
    sweep = pick(found.rows, "table 2")
    pairs = zip(MOTIONS, right(found), strict=True)
    return "".join(LETTERS.get(sweep[s]["regime"], "!") + "*" * (not ok)
                   for s, ok in pairs)  # fmt: skip


def holds(own: dict[float, Found]) -> str:
    """Say between which changes about none all four motions are there."""
    lost = [step for step, found in own.items() if not all(right(found))]
    if 0.0 in lost:
        return "never"
    low = max((step for step in lost if step < 0.0), default=-np.inf)
    high = min((step for step in lost if step > 0.0), default=np.inf)
    inside = [step for step in own if low < step < high]
    return f"{min(inside):+.0%} to {max(inside):+.0%}"


def changed(
    engine: Engine, changes: Sequence[float] = CHANGES
) -> dict[tuple[str, float], Engine]:
    """Return {(unknown, relative change): engine}, one unknown at a time, and none."""
    steps = sorted({0.0, *changes, *(-c for c in changes)})
    return {
        (name, step): engine | {name: float(f"{engine[name] * (1 + step):.6g}")}
        for name in UNKNOWNS
        for step in steps
    }


def computed(
    engines: Sequence[Engine], out: Path, workers: int, *, fast: bool
) -> list[Found]:
    """Return the four motions of engines, of each but once."""
    own = {tuple(engine.values()): engine for engine in engines}
    if fast:
        each = [Found(e, [motion(e, "table 2", speed) for speed in MOTIONS])
                for e in own.values()]  # fmt: skip
    else:
        each = compute(list(own.values()), FOUR, out, workers)
    found = dict(zip(own, each, strict=True))
    return [found[tuple(engine.values())] for engine in engines]


def section(name: str, args: Any, motions_of: Compute) -> str:
    """Return what is found of a named engine."""
    engine = engine_of_scene(named_scene(name))
    values = (f"{told} {engine[n] * by:.5g}" for n, (told, by) in NAMES.items())
    lines = [f"## {name}, {NUMERICS[args.fast]}", "", ", ".join(values), ""]
    if args.scatter:
        draws = {s: scattered(engine, s, args.draws) for s in args.scatter}
        lines += scatter_lines({s: motions_of(own) for s, own in draws.items()})
    if args.change:
        tried = changed(engine, args.change)
        along = motions_of(list(tried.values()))
        lines += sharp_lines(dict(zip(tried, along, strict=True)))
    return "\n".join(lines)


def main(words: Sequence[str] | None = None) -> int:
    """Compute, print and write."""
    parser = parser_of(__doc__, write=PAGE)
    add = parser.add_argument
    add("--out", type=Path, default=Path("build/sure"))
    add("--workers", type=int, default=1, help="MPI ranks")
    add("--draws", type=int, default=64)
    add("--engine", action="append", choices=engine_names())
    add("--fast", action="store_true", help="preset of the screening")
    add("--scatter", type=float, nargs="*", default=SCATTERS)
    add("--change", type=float, nargs="*", default=CHANGES)
    args = parser.parse_args(words)
    own = partial(computed, out=args.out, workers=args.workers, fast=args.fast)
    for name in args.engine or ["four_motions"]:
        told = section(name, args, own)
        print(told)
        if args.write:
            PAGE.write_text(with_section(PAGE.read_text(), told))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
