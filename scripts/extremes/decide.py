"""Scenes at the extremes: each gives a right answer, by a law, or a clear refusal.

    python scripts/extremes/decide.py [WORD...]   all, or whose input has a WORD
    python scripts/extremes/decide.py --write     all, and extremes.md anew
    python scripts/extremes/decide.py --random 300 --seed 1
                                          random scenes of the whole allowed box, every
                                          other one with a feature on (`FEATURES`)

Every scene runs in a process of its own with a time limit, warnings being errors: a
hang, a crash or a stray line is a finding too. Exits 1 where a law is broken.
"""

from __future__ import annotations

import multiprocessing
import sys
import time
import traceback
import warnings
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import parser_of, table, tell
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


def apart(extreme: Extreme) -> Answer:
    """Return `decide` of a scene in a process of its own."""
    context = multiprocessing.get_context("fork")
    mine, its = context.Pipe(duplex=False)
    child = context.Process(target=lambda: its.send(decide(extreme)), daemon=True)
    child.start()
    its.close()
    try:
        answer = mine.recv() if mine.poll(LIMIT) else (False, f"HANG: {LIMIT:g} s")
    except EOFError:
        answer = False, "DIED"
    child.kill()
    child.join()
    return answer


def meaning(extreme: Extreme) -> str:
    """Return the law in words."""
    words = (extreme.law.__doc__ or "").strip().splitlines()
    return words[0].rstrip(".") if words else "refused in one clear line"


def row_of(extreme: Extreme, told: str) -> list[str]:
    """Return the row of an extreme."""
    cells = extreme.what, f"`{extreme.name}`", meaning(extreme), told
    return [cell.replace("|", "\\|") for cell in cells]


def try_all(words: list[str], *, write: bool) -> int:
    """Try the table, or what has the words; return how many laws are broken."""
    chosen = [e for e in TABLE if all(w in e.what for w in words)]
    rows, bad = [], 0
    for extreme in chosen:
        start = time.monotonic()
        holds, told = apart(extreme)
        bad += not holds
        rows.append(row_of(extreme, told))
        spent = time.monotonic() - start
        print(f"{extreme.what}: {extreme.name}: {told} [{spent:.1f} s]", flush=True)
    if write:
        head = "extreme", "settings", "law", "outcome"
        tell("\n".join(table(head, rows)), PAGE)
    print(f"{len(chosen) - bad} of {len(chosen)} laws hold")
    return bad


def at_random(seconds: float, seed: int) -> int:
    """Try random scenes for a while; return how many laws are broken."""
    end, tried, bad, taken = time.monotonic() + seconds, 0, 0, 0
    while time.monotonic() < end:
        draw = with_feature if tried % 2 else random_scene
        extreme = draw(seed + tried)
        holds, told = apart(extreme)
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
    parser.add_argument("--random", type=float, metavar="SECONDS", default=0.0)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    if args.words and args.write:
        parser.error("--write needs the whole table, without a WORD")
    if args.random > 0.0:
        return 1 if at_random(args.random, args.seed) else 0
    return 1 if try_all(args.words, write=args.write) else 0


if __name__ == "__main__":
    sys.exit(main())
