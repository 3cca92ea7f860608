"""What `--pilot` foresees against what campaigns take; writes foresight.md.

    python scripts/evidence/foresight.py                  # all seven, 1 and 2 ranks
    python scripts/evidence/foresight.py --only short --ranks 1
    options: --write (the page), --load TEXT (what else the machine did, for the page)

Each campaign has a pilot in a new directory, of a fifth of what its ranks compute, and
is then ended there, on one rank and on two; kernels are compiled before. Seconds are of
the clock, of the whole command that ends it. Seconds of the kernels are foreseen once
more, without the clock's changes between both: from a fifth of the cases that have
ended, evenly spread, those of all others; and, as `--dry-run` does, from none.
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

import numpy as np
import tomli_w

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import JOBS, parser_of, program, table, working_folder

from hpcwhirl.campaign.begin import as_begun
from hpcwhirl.campaign.plan.cost import costs_of
from hpcwhirl.campaign.plan.design import Design, load_design
from hpcwhirl.campaign.work_queue import scattered
from hpcwhirl.store.directory.completions import ended_in
from hpcwhirl.store.directory.journal import Journals
from hpcwhirl.store.directory.manifest import PlanFile

PAGE = Path(__file__).with_suffix(".md")
CLOSE = 0.25  # relative
TABLE = tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8"))
HEAD = (
    "campaign", "ranks", "cases", "foreseen, s", "range, s", "took, s",
    "foreseen / took", "cases foreseen", "the pilot, s", "its cases",
    "kernels foreseen / taken", "each within 25%", "nominal / taken",
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
    kernel: float
    close: float
    nominal: tuple[float, float]

    @property
    def marks(self) -> tuple[bool, bool, bool]:
        """Whether seconds and kernels are close, and seconds within their range."""
        low, high = self.seconds["range"]
        ratio = self.seconds["usual"] / self.took
        far = [abs(value - 1.0) > CLOSE for value in (ratio, self.kernel)]
        return not far[0], not far[1], bool(low <= self.took <= high)


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
    again = retold(load_design(file, {}), out)
    shutil.rmtree(out)
    cases = told["cases"] + told.get("beyond", 0)
    cases += told.get("more", {"usual": 0})["usual"]
    learned = told["learned_from"]["finished"]
    return Found(name, ranks, cases, told["wall_seconds"], pilot, learned, took,
                 ended["cases"], *again)  # fmt: skip


def retold(design: Design, folder: Path) -> tuple[float, float, tuple[float, float]]:
    """Foresee kernel seconds of a campaign that has ended, of its coarse cases.

    A fifth of them is learned from.

    Returns
    -------
    Foreseen over taken, of all other cases together; the share of them within `CLOSE`;
    nominal limits over taken, of no step in contact and of all.
    """
    design = as_begun(design, PlanFile(folder))
    taken = ended_in(Journals(folder), design.manifest()).seconds
    given = np.where(np.isfinite(taken), taken, 0.0)
    first, rest = np.split(scattered(len(taken)), [-(-len(taken) // 5)])
    costs, seconds = costs_of(design), np.full(len(taken), np.nan)
    seconds[first] = taken[first]
    costs.learn_all(seconds)
    each = costs.predict(rest)
    close = np.abs(each - given[rest]) <= CLOSE * given[rest]
    low, high = (
        float(costs_of(design, share=share).nominal.sum() / given.sum())
        for share in (0.0, 1.0)
    )
    return float(each.sum() / given[rest].sum()), float(close.mean()), (low, high)


def compared(rows: list[Found]) -> list[str]:
    """Return what was found as Markdown."""
    lines = []
    for row in rows:
        near, kernel, inside = (" ✗" * (not right) for right in row.marks)
        usual, (low, high) = row.seconds["usual"], row.seconds["range"]
        lines.append([
            row.name, row.ranks, row.counted, f"{usual:.1f}",
            f"{low:.1f} ... {high:.1f}{inside}", f"{row.took:.1f}",
            f"{usual / row.took:.2f}{near}", row.cases, f"{row.pilot:.1f}", row.learned,
            f"{row.kernel:.2f}{kernel}", f"{row.close:.0%}",
            f"{row.nominal[0]:.2f} ... {row.nominal[1]:.2f}",
        ])  # fmt: skip
    return table(HEAD, lines)


def page(rows: list[Found], load: str) -> str:
    """Return the page."""
    close, kernels, inside = map(sum, zip(*(row.marks for row in rows), strict=True))
    return f"""# What a pilot foresees

Made by `python scripts/evidence/foresight.py --write`; campaigns are in foresight.toml.
{load}

{chr(10).join(compared(rows))}

Within {CLOSE:.0%}: {close} of {len(rows)}, of kernels {kernels}; within the range
that was told: {inside} of {len(rows)} (✗: not). Cases of a refined campaign are
guessed beforehand.
"""


def main() -> None:
    """Foresee and run."""
    parser = parser_of(__doc__, write=PAGE)
    parser.add_argument("--only", nargs="+", choices=TABLE, default=[*TABLE])
    parser.add_argument("--ranks", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--load", default="Nothing else ran.")
    args = parser.parse_args()
    rows: list[Found] = []
    with working_folder(None, "foresight") as folder:
        for name in args.only:
            for ranks in args.ranks:
                rows.append(foreseen(name, ranks, folder))
                print(compared(rows[-1:])[-1], flush=True)
    if args.write:
        PAGE.write_text(page(rows, args.load))


if __name__ == "__main__":
    main()
