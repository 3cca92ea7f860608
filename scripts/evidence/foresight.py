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

import argparse
import json
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import program, table

from hpcwhirl.campaign.plan.cost import costs_of
from hpcwhirl.campaign.plan.design import Design, load_design
from hpcwhirl.campaign.resume import as_begun
from hpcwhirl.campaign.work_queue import scattered
from hpcwhirl.store.directory.completions import ended_in
from hpcwhirl.store.directory.journal import Journals
from hpcwhirl.store.directory.manifest import PlanFile

PAGE = Path(__file__).with_suffix(".md")
CLOSE = 0.25  # relative
# s, about a fifth of what ranks compute
PILOTS = {
    "short": 1.0, "draft": 1.0, "default": 4.0, "divergent": 0.1, "refined": 3.0,
    "mistuned": 2.0, "sizes": 3.0,
}  # fmt: skip
POPULATION = Path(__file__).parents[2] / "jobs" / "mistuned_population.toml"
CAMPAIGNS = {
    "short": """
[scene]
duration = 2e-3
[output]
traces = "summary"
[sweep]
speed = { start = 20, stop = 519, num = 50 }
gap = { start = 1e-4, stop = 1e-3, num = 30 }
""",
    "draft": """
[scene]
duration = 2.5
[solver]
preset = "draft"
[sweep]
speed = { start = 20, stop = 520, num = 26 }
friction = [0.1, 0.2, 0.3]
gap = [1e-4, 2e-4, 4e-4, 8e-4]
""",
    "default": "",
    "divergent": """
[scene]
gap = 1e-4
duration = 2.5
[solver]
preset = "draft"
[sweep]
speed = { start = 300, stop = 520, num = 12 }
friction = [0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6, 0.65, 0.7, 0.75]
""",
    "refined": """
[scene]
duration = 1.0
[solver]
preset = "draft"
[output]
traces = "summary"
[sweep]
speed = { start = 100, stop = 500, num = 9 }
friction = { start = 0.02, stop = 0.3, num = 6 }
[refine]
over = ["speed", "friction"]
levels = 3
""",
    "mistuned": POPULATION.read_text().replace("count = 1000", "count = 60"),
    "sizes": """
[scene]
duration = 0.2
[solver]
time_step = 1e-6
[output]
traces = "summary"
[sweep]
"rotor.blades" = [12, 22, 36, 60, 88]
speed = { start = 300, stop = 520, num = 6 }
friction = [0.05, 0.3]
""",
}


class Found(NamedTuple):
    """A forecast and what it was of."""

    name: str
    ranks: int
    cases: int
    foreseen: float
    low: float
    high: float
    pilot: float
    learned: int
    took: float
    counted: int
    kernel: float
    close: float
    nominal: tuple[float, float]


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
    file, out = folder / f"{name}.toml", folder / f"{name}-{ranks}"
    words, path = ["--out", str(out)], None
    if CAMPAIGNS[name]:
        file.write_text(CAMPAIGNS[name])
        words, path = [str(file), *words], file
    pilot, told = called([*words, "--pilot", str(PILOTS[name])], ranks)
    took, ended = called(words, ranks)
    again = retold(load_design(path, {}), out)
    shutil.rmtree(out)
    wall = told["wall_seconds"]
    cases = told["cases"] + told.get("beyond", 0)
    cases += told.get("more", {"usual": 0})["usual"]
    return Found(name, ranks, cases, wall["usual"], *wall["range"], pilot,
                 told["learned_from"]["finished"], took, ended["cases"],
                 *again)  # fmt: skip


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


def compared(rows: list[Found]) -> str:
    """Return what was found as Markdown."""
    head = ("campaign", "ranks", "cases", "foreseen, s", "range, s", "took, s",
            "foreseen / took", "cases foreseen", "the pilot, s", "its cases",
            "kernels foreseen / taken", "each within 25%", "nominal / taken",
            )  # fmt: skip
    lines = []
    for row in rows:
        ratio = row.foreseen / row.took
        mark = "" if abs(ratio - 1.0) <= CLOSE else " ✗"
        inside = "" if row.low <= row.took <= row.high else " ✗"
        lines.append([
            row.name, row.ranks, row.counted, f"{row.foreseen:.1f}",
            f"{row.low:.1f} ... {row.high:.1f}{inside}", f"{row.took:.1f}",
            f"{ratio:.2f}{mark}", row.cases, f"{row.pilot:.1f}", row.learned,
            f"{row.kernel:.2f}" + " ✗" * (abs(row.kernel - 1.0) > CLOSE),
            f"{row.close:.0%}", f"{row.nominal[0]:.2f} ... {row.nominal[1]:.2f}",
        ])  # fmt: skip
    return "\n".join(table(head, lines))


def page(rows: list[Found], load: str) -> str:
    """Return the page."""
    close = sum(abs(row.foreseen / row.took - 1.0) <= CLOSE for row in rows)
    inside = sum(row.low <= row.took <= row.high for row in rows)
    kernels = sum(abs(row.kernel - 1.0) <= CLOSE for row in rows)
    return f"""# What a pilot foresees

Made by `python scripts/evidence/foresight.py --write`; the campaigns stand there.
{load}

{compared(rows)}

Within {CLOSE:.0%}: {close} of {len(rows)}, of kernels {kernels}; within the range
that was told: {inside} of {len(rows)} (✗: not). Cases of a refined campaign are
guessed beforehand.
"""


def main() -> None:
    """Foresee and run."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", choices=CAMPAIGNS, default=[*CAMPAIGNS])
    parser.add_argument("--ranks", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--load", default="Nothing else ran.")
    args = parser.parse_args()
    rows: list[Found] = []
    with tempfile.TemporaryDirectory(prefix="foresight-") as folder:
        for name in args.only:
            for ranks in args.ranks:
                rows.append(foreseen(name, ranks, Path(folder)))
                print(compared(rows[-1:]).splitlines()[-1], flush=True)
    if args.write:
        PAGE.write_text(page(rows, args.load))


if __name__ == "__main__":
    main()
