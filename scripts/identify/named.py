"""What the named engines show on Table 2, measured; writes it where they are named.

    python scripts/identify/named.py --out DIR [--write]

51 speeds at the default inputs for each engine of `hpcwhirl/scene/engines.toml`; with
`--write` the lines `shows` there are written anew.
"""

from __future__ import annotations

import re
import sys
from collections import Counter
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import TOP, parser_of
from identify.full import Found, Stage, compute, grid
from identify.score import Row, pick
from identify.screen import MOTIONS
from identify.space import engine_of_scene

from hpcwhirl.scene import engine_names, named_scene

LINE = Stage("line", grid(10))
TABLE = TOP / "hpcwhirl/scene/engines.toml"


def shown(found: Found) -> str:
    """Return what an engine shows in one line."""
    sweep = pick(found.rows, "table 2")
    (most, n), *others = Counter(r["regime"] for r in sweep.values()).most_common()
    told = [
        f"{n} of {len(sweep)} speeds {most}",
        *(f"{m} {word}" for word, m in others),
    ]
    parts = [", ".join(told)]
    parts += [f"{word} at {where}" for word in ("sustained", "divergent")
              if (where := ranges(sweep, word))]  # fmt: skip
    four = [f"{s:g} {sweep[s]['regime']} {sweep[s]['whirl']}" for s in MOTIONS]
    return "; ".join([*parts, ", ".join(four)])


def ranges(sweep: dict[float, Row], word: str) -> str:
    """Return the speeds of a regime and their whirls, neighbours as one range."""
    told = []
    for regime, group in groupby(sorted(sweep), lambda speed: sweep[speed]["regime"]):
        own = list(group)
        whirls = sorted({sweep[speed]["whirl"] for speed in own})
        ends = f"{own[0]:g}" + (f"-{own[-1]:g}" if len(own) > 1 else "")
        told += [f"{ends} ({'/'.join(whirls)})"] * (regime == word)
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
    parser = parser_of(__doc__, write=TABLE)
    parser.add_argument("--out", type=Path, default=Path("build/named"))
    parser.add_argument("--workers", type=int, default=1, help="MPI ranks")
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
