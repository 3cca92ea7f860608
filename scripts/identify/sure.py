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

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import table
from identify.full import DECIDING, Found, Stage, compute
from identify.guide import WORDS
from identify.kept import key_of
from identify.report import SHORT, describe
from identify.score import pick
from identify.screen import motion
from identify.space import UNKNOWNS, Engine, engine_of_scene, scattered

from hpcwhirl.scene import engine_names, named_scene
from hpcwhirl.store.reading.shares import interval

SCATTERS = (0.01, 0.05)
CHANGES = (0.01, 0.02, 0.05, 0.1, 0.2)
FOUR = Stage("scatter", DECIDING)
PAGE = Path(__file__).with_name("sure.md")
TOLD = """\
# How sure the motions are

d damped, S sustained, V divergent, ? undecided, at 270, 410, 420 and 520 rad/s; a star:
not the paper's regime and whirl. Scatter of all eight unknowns at once; in brackets
what so many draws leave open (95 %).
"""
NUMERICS = {True: "the preset of the screening", False: "the default inputs"}
LETTERS = {"damped": "d", "sustained": "S", "divergent": "V", "undecided": "?"}


def changed(
    engine: Engine, changes: Sequence[float] = CHANGES
) -> list[tuple[str, float, Engine]]:
    """Return (unknown, relative change, engine), one unknown at a time, and none."""
    steps = sorted({0.0, *changes, *(-c for c in changes)})
    return [
        (name, step, engine | {name: float(f"{engine[name] * (1 + step):.6g}")})
        for name in UNKNOWNS
        for step in steps
    ]


def right(found: Found) -> list[bool]:
    """Return which of the four motions have regime and whirl of the paper."""
    sweep = pick(found.rows, "table 2")
    return [(sweep[s]["regime"], sweep[s]["whirl"]) == (r, w) for s, r, w in WORDS]


def scatter_lines(found: dict[float, list[Found]]) -> list[str]:
    """Return the table of shares under scatter."""
    heads = [f"{speed:g} {regime} {whirl}" for speed, regime, whirl in WORDS]
    lines = []
    for scatter, items in found.items():
        each = np.array([right(item) for item in items])
        counts = [*each.sum(axis=0), each.all(axis=1).sum()]
        lines.append([f"{scatter:.0%}", *(_share(int(n), len(items)) for n in counts)])
    return [*table(["scatter", *heads, "all four"], lines), ""]


def _share(hits: int, draws: int) -> str:
    _, low, high = interval(hits, draws)
    return f"{hits} of {draws} ({low:.0%} to {high:.0%})"


def sharp_lines(tried: Sequence[tuple[str, float, Found]]) -> list[str]:
    """Return the table of words along each unknown, and how far all four hold."""
    steps = sorted({step for _, step, _ in tried})
    lines = []
    for name in UNKNOWNS:
        own = {step: found for unknown, step, found in tried if unknown == name}
        told = [_letters(own[step]) for step in steps]
        lines.append([SHORT[name][0], *told, _holds(own)])
    heads = ["unknown", *(f"{step:+.0%}" if step else "0" for step in steps)]
    return [*table([*heads, "all four hold"], lines), ""]


def _letters(found: Found) -> str:
    sweep = pick(found.rows, "table 2")
    words = (
        LETTERS.get(sweep[s]["regime"], "!") + ("" if ok else "*")
        for s, ok in zip(DECIDING, right(found), strict=True)
    )
    return "".join(words)


def _holds(own: dict[float, Found]) -> str:
    """Say between which changes about none all four motions are there."""
    ends = []
    for sign in (-1.0, 1.0):
        end = 0.0
        for step in sorted((s for s in own if s * sign >= 0.0), key=abs):
            if not all(right(own[step])):
                break
            end = step
        ends.append(end)
    return f"{ends[0]:+.0%} to {ends[1]:+.0%}" if all(right(own[0.0])) else "never"


class Sure:
    """What computes engines: campaigns in a directory, or the fast preset here."""

    def __init__(self, out: Path, workers: int, *, fast: bool) -> None:
        self.out, self.workers, self.fast = out, workers, fast

    def found(self, engines: Sequence[Engine]) -> list[Found]:
        """Return the four motions of each engine."""
        own = {key_of(engine): engine for engine in engines}  # none twice: a campaign
        if self.fast:
            each = [
                Found(e, [motion(e, "table 2", speed) for speed in DECIDING])
                for e in own.values()
            ]
        else:
            each = compute(list(own.values()), FOUR, self.out, self.workers)
        found = dict(zip(own, each, strict=True))
        return [found[key_of(engine)] for engine in engines]

    def section(
        self, name: str, draws: int, scatters: Sequence[float], changes: Sequence[float]
    ) -> list[str]:
        """Return what is found of a named engine."""
        engine = engine_of_scene(named_scene(name))
        lines = [f"## {name}, {NUMERICS[self.fast]}", "", describe(engine), ""]
        under = {s: self.found(scattered(engine, s, draws)) for s in scatters}
        lines += scatter_lines(under) if under else []
        tried = changed(engine, changes) if changes else []
        along = self.found([item for _, _, item in tried]) if tried else []
        sharp = [(n, s, f) for (n, s, _), f in zip(tried, along, strict=True)]
        return lines + (sharp_lines(sharp) if sharp else [])


def written(page: str, section: Sequence[str]) -> str:
    """Return the page with a section in its place, or at the end."""
    head, *parts = page.split("\n## ")
    given = {part.partition("\n")[0]: part.rstrip() for part in parts}
    text = "\n".join(section).rstrip().removeprefix("## ")
    given[text.partition("\n")[0]] = text
    return "\n\n## ".join([head.rstrip(), *given.values()]) + "\n"


def main(words: Sequence[str] | None = None) -> int:
    """Compute, print and write."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("build/sure"))
    parser.add_argument("--workers", type=int, default=1, help="MPI ranks")
    parser.add_argument("--draws", type=int, default=64)
    parser.add_argument("--engine", action="append", choices=engine_names())
    parser.add_argument("--fast", action="store_true", help="preset of the screening")
    parser.add_argument("--scatter", type=float, nargs="*", default=SCATTERS)
    parser.add_argument("--change", type=float, nargs="*", default=CHANGES)
    parser.add_argument("--write", action="store_true", help=f"write {PAGE.name}")
    args = parser.parse_args(words)
    sure = Sure(args.out, args.workers, fast=args.fast)
    page = PAGE.read_text() if PAGE.exists() else TOLD
    for name in args.engine or ["four_motions"]:
        section = sure.section(name, args.draws, args.scatter, args.change)
        print("\n".join(section))
        page = written(page, section)
        if args.write:
            PAGE.write_text(page)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
