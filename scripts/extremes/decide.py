"""Scenes at the extremes: each gives a right answer, by a law, or a clear refusal.

    python scripts/extremes/decide.py [WORD...]   all, or whose extreme has each WORD
    python scripts/extremes/decide.py --write     all, and extremes.md anew
    python scripts/extremes/decide.py --rows FILE go on: scenes with a row of the same
                                          code in FILE are not tried again
    python scripts/extremes/decide.py --random 300 --seed 1
                                          random scenes of the whole allowed box, every
                                          other one with a feature on (`FEATURES`)

Scenes run in --workers processes apart (`workers.py`), each scene with a limit of
--limit seconds of the processor, beyond which its row says OVER: that, a hang, a crash
or a warning is a broken row, too. Exits 1 where one is broken.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import NamedTuple

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import parser_of, table, tell, working_folder
from extremes import crossed
from extremes.drawn import random_scene, with_feature
from extremes.table import TABLE, Extreme
from extremes.workers import LIMIT, Answer, apart
from last_run import code_of

PAGE = Path(__file__).with_name("extremes.md")
DEAREST = 3  # scenes that the page names
Key = tuple[str, str, str]


class Outcome(NamedTuple):
    """What a scene gave: whether its law holds, in words, and the processor's time."""

    extreme: Extreme
    holds: bool
    told: str
    seconds: float

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


def page_of(outcomes: list[Outcome]) -> str:
    """Return the page: the sum, extremes by features, refusals, single inputs."""
    bad = [each for each in outcomes if not each.holds]
    pairs = sum(" x " in each.extreme.what for each in outcomes)
    kinds = [each.kind for each in outcomes]
    dearest = sorted(outcomes, key=lambda each: -each.seconds)[:DEAREST]
    dear = ", ".join(f"{e.extreme.what} {e.seconds:.0f} s" for e in dearest)
    told = (
        f"{len(outcomes)} scenes, {pairs} of them pairs of an extreme and a feature, "
        f"in {sum(each.seconds for each in outcomes):.0f} s of processor time (most: "
        f"{dear}): 0 without a law, {len(bad)} broken. "
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


def key_of(extreme: Extreme) -> Key:
    """Return what no other scene has: what it is of, its settings, its law."""
    return extreme.what, extreme.name, meaning(extreme)


def known(path: Path, code: str) -> dict[Key, Answer]:
    """Return the answers that a file has of this code, {key of a scene: answer}."""
    path.touch()
    rows = [json.loads(line) for line in path.read_text("utf-8").splitlines()]
    return {
        (*row["of"],): Answer(*row["answer"]) for row in rows if row["code"] == code
    }


def try_all(
    chosen: list[Extreme], path: Path, count: int, limit: float
) -> list[Outcome]:
    """Try the scenes that have no row in a file; add theirs to it, and print each.

    count, limit : processes at once; s, processor time of a scene
    """
    code, start = code_of("extremes"), time.monotonic()
    found = known(path, code)
    left = [each for each in chosen if key_of(each) not in found]
    print(f"{len(chosen)} scenes, {len(left)} of them without a row", flush=True)
    with path.open("a", encoding="utf-8") as file:
        for number, answer in apart(left, count, limit):
            of = key_of(left[number])
            found[of] = answer
            file.write(json.dumps({"of": of, "answer": answer, "code": code}) + "\n")
            file.flush()
            spent = f"[{answer.seconds:.1f} s; {time.monotonic() - start:.0f} s]"
            print(f"{of[0]}: {of[1]}: {answer.told} {spent}", flush=True)
    return [Outcome(each, *found[key_of(each)]) for each in chosen]


def at_random(seconds: float, seed: int) -> int:
    """Try random scenes for a while; return how many laws are broken."""
    end, tried, bad, taken = time.monotonic() + seconds, 0, 0, 0
    while time.monotonic() < end:
        draw = with_feature if tried % 2 else random_scene
        extreme = draw(seed + tried)
        ((_, (holds, told, _)),) = apart([extreme])
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
    parser.add_argument("--rows", type=Path, metavar="FILE")
    parser.add_argument("--workers", type=int, default=2, metavar="COUNT")
    parser.add_argument("--limit", type=float, default=LIMIT, metavar="SECONDS")
    parser.add_argument("--random", type=float, metavar="SECONDS", default=0.0)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    if args.write and args.words:
        parser.error("--write needs the whole table, without a WORD")
    if args.random > 0.0:
        return 1 if at_random(args.random, args.seed) else 0
    chosen = [each for each in TABLE if all(word in each.what for word in args.words)]
    with working_folder(None, "extremes") as folder:
        rows = args.rows or folder / "rows.jsonl"
        outcomes = try_all(chosen, rows, args.workers, args.limit)
    bad = sum(not each.holds for each in outcomes)
    if args.write:
        tell(page_of(outcomes), PAGE)
    print(f"{len(outcomes) - bad} of {len(outcomes)} laws hold")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
