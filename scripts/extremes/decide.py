"""Scenes at the extremes: each gives a right answer, by a law, or a clear refusal.

    python scripts/extremes/decide.py [WORD...]   all, or whose extreme has a WORD
    python scripts/extremes/decide.py --write     all, and extremes.md anew
    python scripts/extremes/decide.py --long      those of 1e7 steps and more, alone
    python scripts/extremes/decide.py --random 300 --seed 1
                                          random scenes of the whole allowed box, every
                                          other one with a feature on (`FEATURES`)

Scenes run in a process apart, each with a time limit, warnings being errors: a hang, a
crash or a stray line is a finding too, after which another process goes on. Exits 1
where a law is broken.
"""

from __future__ import annotations

import multiprocessing
import resource
import sys
import time
import traceback
import warnings
from collections.abc import Iterator
from multiprocessing.connection import Connection
from pathlib import Path
from typing import NamedTuple

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import parser_of, processor_time, table, tell
from extremes import crossed
from extremes.drawn import random_scene, with_feature
from extremes.laws import Broken
from extremes.table import TABLE, Extreme

PAGE = Path(__file__).with_name("extremes.md")
LIMIT = 300.0  # s for one scene, compilation of its kernel included
Answer = tuple[bool, str]


def decide(extreme: Extreme) -> Answer:
    """Return (whether its law holds, what came out or what is broken)."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            return True, extreme.law(extreme.settings)
        except Broken as broken:
            return False, f"BROKEN: {broken}"
        except Exception:  # noqa: BLE001 - a traceback is the finding
            last = traceback.format_exc().strip().splitlines()
            return False, f"TRACEBACK: {last[-1]} at {last[-3].strip()}"


def serve(extremes: list[Extreme], answers: Connection) -> None:
    """Decide scenes one after the other; send each answer at once."""
    for extreme in extremes:
        answers.send(decide(extreme))


def apart(extremes: list[Extreme]) -> Iterator[Answer]:
    """Yield `decide` of scenes, by a process that goes on until a scene ends it."""
    context, done = multiprocessing.get_context("fork"), 0
    while done < len(extremes):
        mine, its = context.Pipe(duplex=False)
        child = context.Process(target=serve, args=(extremes[done:], its), daemon=True)
        child.start()
        its.close()
        lives = True
        while lives and done < len(extremes):
            try:
                lives = mine.poll(LIMIT)
                yield mine.recv() if lives else (False, f"HANG: {LIMIT:g} s")
            except EOFError:
                lives = False
                yield False, "DIED"
            done += 1
        child.kill()
        child.join()


class Outcome(NamedTuple):
    """What a scene gave: whether its law holds, and in words."""

    extreme: Extreme
    holds: bool
    told: str

    @property
    def kind(self) -> str:
        """Return a word for the outcome: law, refused, unstable or BROKEN."""
        if not self.holds:
            return "BROKEN"
        first = self.told.partition(" ")[0].rstrip(":")
        return first if first in {"refused", "unstable"} else "law"


def meaning(extreme: Extreme) -> str:
    """Return the law in words."""
    words = (extreme.law.__doc__ or "").strip().splitlines()
    return words[0].rstrip(".") if words else "refused in one clear line"


def crossing(outcomes: list[Outcome]) -> list[str]:
    """Return the table of extremes by features; a cell tells the kind of an outcome."""
    kinds = {each.extreme.what: each.kind for each in outcomes}
    signs = {"law": "+", "refused": "r", "unstable": "u", "BROKEN": "**no**", "": ""}
    head = ["extreme, and its law", *crossed.FEATURES]
    rows = [
        [f"{name}: {one.law.__doc__.splitlines()[0].rstrip('.')}"]
        + [signs[kinds.get(f"{name} x {each}", "")] for each in crossed.FEATURES]
        for name, one in crossed.EXTREMES.items()
    ]
    return table(head, rows)


def by_input(outcomes: list[Outcome]) -> list[str]:
    """Return the table of single inputs at extremes: a row for each law of each."""
    groups: dict[tuple[str, str], list[str]] = {}
    for each in outcomes:
        if " x " not in each.extreme.what:
            key = each.extreme.what, meaning(each.extreme)
            groups.setdefault(key, []).append(each.kind)
    head = "input or feature", "law", "scenes", "by the law", "refused", "unstable"
    kinds = "law", "refused", "unstable"
    rows = [
        [*key, len(found), *map(found.count, kinds)] for key, found in groups.items()
    ]
    return table(head, rows)


def refusals(outcomes: list[Outcome]) -> list[str]:
    """Return lines of the pairs that are refused, one for each text."""
    groups: dict[str, list[str]] = {}
    for each in outcomes:
        if " x " in each.extreme.what and each.kind == "refused":
            text = each.told.removeprefix("refused: ").removeprefix("scene: ")
            groups.setdefault(text, []).append(each.extreme.what)
    return [f"- {', '.join(pairs)}: {text}" for text, pairs in groups.items()]


def page_of(outcomes: list[Outcome], seconds: float) -> str:
    """Return the page: the sum, extremes by features, refusals, single inputs."""
    bad = [each for each in outcomes if not each.holds]
    pairs = sum(" x " in each.extreme.what for each in outcomes)
    kinds = [each.kind for each in outcomes]
    told = (
        f"{len(outcomes)} scenes, {pairs} of them pairs of an extreme and a feature, "
        f"in {seconds:.0f} s of processor time: 0 without a law, {len(bad)} broken. "
        f"{kinds.count('law')} hold by the law of their row, {kinds.count('refused')} "
        f"are refused in a line, {kinds.count('unstable')} said to be unstable."
    )
    parts = [
        [told], [f"- **broken**: {e.extreme.what}: {e.told}" for e in bad],
        ["+ the law holds; r refused, see below; u said to be `unstable`:"],
        crossing(outcomes), ["Refused pairs:"], refusals(outcomes),
        ["Single inputs, and numbers of features, at their edges:"], by_input(outcomes),
    ]  # fmt: skip
    return "\n\n".join("\n".join(lines) for lines in parts if lines)


def try_all(chosen: list[Extreme]) -> list[Outcome]:
    """Try scenes; print a line for each, with the time since the beginning."""
    outcomes, start = [], time.monotonic()
    for extreme, answer in zip(chosen, apart(chosen), strict=True):
        outcomes.append(Outcome(extreme, *answer))
        spent, told = time.monotonic() - start, outcomes[-1].told
        print(f"{extreme.what}: {extreme.name}: {told} [{spent:.0f} s]", flush=True)
    return outcomes


def at_random(seconds: float, seed: int) -> int:
    """Try random scenes for a while; return how many laws are broken."""
    end, tried, bad, taken = time.monotonic() + seconds, 0, 0, 0
    while time.monotonic() < end:
        draw = with_feature if tried % 2 else random_scene
        extreme = draw(seed + tried)
        ((holds, told),) = apart([extreme])
        tried += 1
        taken += not told.startswith("refused")
        bad += not holds
        if not holds or told.startswith("unstable"):
            print(f"seed {seed + tried - 1}: {told}: {extreme.name}", flush=True)
    print(f"{tried} random scenes, {taken} integrated, {bad} broken")
    return bad


def main() -> int:
    """Read the command line and try what it asks for."""
    parser = parser_of(__doc__, write=PAGE)
    parser.add_argument("words", nargs="*", metavar="WORD")
    parser.add_argument("--long", action="store_true")
    parser.add_argument("--random", type=float, metavar="SECONDS", default=0.0)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    if args.write and (args.words or args.long):
        parser.error("--write needs the whole table, without a WORD or --long")
    if args.random > 0.0:
        return 1 if at_random(args.random, args.seed) else 0
    outcomes = try_all([
        each for each in TABLE
        if each.long == args.long and all(word in each.what for word in args.words)
    ])  # fmt: skip
    bad = sum(not each.holds for each in outcomes)
    spent = processor_time(resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    if args.write:
        tell(page_of(outcomes, spent), PAGE)
    print(f"{len(outcomes) - bad} of {len(outcomes)} laws hold, {spent:.0f} s")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
