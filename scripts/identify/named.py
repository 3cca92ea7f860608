"""What the named engines show on Table 2, measured; writes it where they are named.

    python scripts/identify/named.py --out DIR [--write]

51 speeds at the default inputs for each engine of `hpcwhirl/scene/engines.toml`; with
`--write` the lines `shows` there are written anew.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections import Counter
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
from identify.full import Found, Stage, compute, grid
from identify.guide import WORDS
from identify.score import Row, pick
from identify.space import engine_of_scene

from hpcwhirl.scene import engine_names, named_scene

LINE = Stage("line", grid(20, 520, 10))
TABLE = Path(__file__).parents[2] / "hpcwhirl/scene/engines.toml"


def shown(found: Found) -> str:
    """Return what an engine shows in one line."""
    sweep = pick(found.rows, "table 2")
    count = Counter(row["regime"] for row in sweep.values())
    told = [f"{n} of {len(sweep)} speeds {word}" if i == 0 else f"{n} {word}"
            for i, (word, n) in enumerate(count.most_common())]  # fmt: skip
    parts = [", ".join(told)]
    parts += [f"{word} at {where}" for word in ("sustained", "divergent")
              if (where := ranges(sweep, word))]  # fmt: skip
    four = [f"{s:g} {sweep[s]['regime']} {sweep[s]['whirl']}" for s, _, _ in WORDS]
    return "; ".join([*parts, ", ".join(four)])


def ranges(sweep: dict[float, Row], word: str) -> str:
    """Return the speeds of a regime and their whirls, neighbours as one range."""
    speeds = sorted(sweep)
    numbered = [(i, s) for i, s in enumerate(speeds) if sweep[s]["regime"] == word]
    told = []
    for _, group in groupby(enumerate(numbered), lambda pair: pair[1][0] - pair[0]):
        own = [speed for _, (_, speed) in group]
        whirls = sorted({sweep[speed]["whirl"] for speed in own})
        ends = f"{own[0]:g}" if len(own) == 1 else f"{own[0]:g}-{own[-1]:g}"
        told.append(f"{ends} ({'/'.join(whirls)})")
    return ", ".join(told)


def written(text: str, name: str, shows: str) -> str:
    """Return the table's text with the line of an engine made anew."""
    head = rf"(\[{re.escape(name)}\]\nshows = ).*"
    new, count = re.subn(head, lambda m: f'{m.group(1)}"{shows}"', text)
    if count != 1:
        raise SystemExit(f"identify: {TABLE}: no line `shows` of {name}")
    return new


def main(words: Sequence[str] | None = None) -> int:
    """Compute, print and write."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("build/named"))
    parser.add_argument("--workers", type=int, default=1, help="MPI ranks")
    parser.add_argument("--write", action="store_true", help="write engines.toml")
    args = parser.parse_args(words)
    text = TABLE.read_text()
    for name in engine_names():
        engine = engine_of_scene(named_scene(name))
        (found,) = compute([engine], LINE, args.out, args.workers)
        print(f"{name}: {shown(found)}", flush=True)
        text = written(text, name, shown(found))
    if args.write:
        TABLE.write_text(text)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
