"""What `--pilot` foresees against what campaigns take; writes foresight.md.

    python scripts/evidence/foresight.py                  # all seven, 1 and 2 ranks
    python scripts/evidence/foresight.py --only short --ranks 1
    options: --write (the page)

Each campaign has a pilot in a new directory, of a fifth of what its ranks compute, and
is then ended there, on one rank and on two; kernels are compiled before. Seconds are of
the clock, of the whole command that ends it.
"""

from __future__ import annotations

import json
import shlex
import shutil
import subprocess
import sys
import time
import tomllib
from pathlib import Path
from typing import Any, NamedTuple

import tomli_w

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import JOBS, parser_of, program, table, tell, working_folder

PAGE = Path(__file__).with_suffix(".md")
CLOSE = 0.25  # relative
TABLE = tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8"))
HEAD = (
    "campaign", "ranks", "cases", "foreseen, s", "range, s", "took, s",
    "foreseen / took", "cases foreseen", "the pilot, s", "its cases",
)  # fmt: skip


class Found(NamedTuple):
    """A forecast and what it was of."""

    name: str
    ranks: int
    cases: int
    seconds: dict[str, Any]  # foreseen: usual, range
    pilot: float
    learned: int
    took: float
    counted: int

    @property
    def marks(self) -> tuple[bool, bool]:
        """Whether seconds are close, and within their range."""
        low, high = self.seconds["range"]
        far = abs(self.seconds["usual"] / self.took - 1.0) > CLOSE
        return not far, bool(low <= self.took <= high)


def written(name: str, folder: Path) -> Path | None:
    """Write a campaign of the table; return its file, None of the default one."""
    tables = {k: v for k, v in TABLE[name].items() if k not in ("pilot", "of")}
    if "of" in TABLE[name]:
        known = tomllib.loads((JOBS / TABLE[name]["of"]).read_text("utf-8"))
        tables = known | {k: known[k] | own for k, own in tables.items()}
    if not tables:
        return None
    file = folder / f"{name}.toml"
    file.write_text(tomli_w.dumps(tables))
    return file


def called(words: list[str], ranks: int) -> tuple[float, dict[str, Any]]:
    """Run a campaign on some ranks; return its seconds and what it says as JSON."""
    call = ("-m", "hpcwhirl", "campaign", *words, "--json")
    command = program(ranks if ranks > 1 else 0, *call)
    start = time.perf_counter()
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=False)
    seconds = time.perf_counter() - start
    if done.returncode not in {0, 1}:
        raise SystemExit(f"{shlex.join(command)} ended with {done.returncode}")
    return seconds, json.loads(done.stdout)


def foreseen(name: str, ranks: int, folder: Path) -> Found:
    """Foresee a campaign and run it."""
    file, out = written(name, folder), folder / f"{name}-{ranks}"
    words = [*([str(file)] if file else []), "--out", str(out)]
    pilot, told = called([*words, "--pilot", str(TABLE[name]["pilot"])], ranks)
    took, ended = called(words, ranks)
    shutil.rmtree(out)
    cases = told["cases"] + told.get("beyond", 0)
    cases += told.get("more", {"usual": 0})["usual"]
    learned = told["learned_from"]["finished"]
    return Found(name, ranks, cases, told["wall_seconds"], pilot, learned, took,
                 ended["cases"])  # fmt: skip


def compared(rows: list[Found]) -> list[str]:
    """Return what was found as Markdown."""
    lines = []
    for row in rows:
        near, inside = (" ✗" * (not right) for right in row.marks)
        usual, (low, high) = row.seconds["usual"], row.seconds["range"]
        lines.append([
            row.name, row.ranks, row.counted, f"{usual:.1f}",
            f"{low:.1f} ... {high:.1f}{inside}", f"{row.took:.1f}",
            f"{usual / row.took:.2f}{near}", row.cases, f"{row.pilot:.1f}", row.learned,
        ])  # fmt: skip
    return table(HEAD, lines)


def measured(rows: list[Found]) -> str:
    """Return the table, and how many forecasts were close."""
    close, inside = map(sum, zip(*(row.marks for row in rows), strict=True))
    return "\n".join(compared(rows)) + (
        f"\n\nWithin {CLOSE:.0%}: {close} of {len(rows)}; within the range that was "
        f"told: {inside} of {len(rows)} (✗: not)."
    )


def main() -> None:
    """Foresee and run."""
    parser = parser_of(__doc__, write=PAGE)
    parser.add_argument("--only", nargs="+", choices=TABLE, default=[*TABLE])
    parser.add_argument("--ranks", type=int, nargs="+", default=[1, 2])
    args = parser.parse_args()
    rows: list[Found] = []
    with working_folder(None, "foresight") as folder:
        for name in args.only:
            for ranks in args.ranks:
                rows.append(foreseen(name, ranks, folder))
                print(compared(rows[-1:])[-1], flush=True)
                print(compared(rows[-1:])[-1], flush=True)
    tell(measured(rows), PAGE if args.write else None)


if __name__ == "__main__":
    main()
