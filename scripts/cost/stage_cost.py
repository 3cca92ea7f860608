"""What the map of the solid stage costs, and what a longer step loses.

    python scripts/cost/stage_cost.py FOLDER [--coarse] [--seconds S] [--write]

What jobs/stage.py makes in the folder is made first where it is missing. Each case of
its map is integrated for 0.02 s with several steps. Timed is the processor of this
process: preparing a case (all but the first, which also reads the file), a step in
blocks of steps that are all in flight or all in contact. Errors are against the
`REFERENCE` step: of the contact impulse, of the work of friction and of the energy fed
to damping, relative; words as well. Then the whole map runs on two ranks, S seconds a
case, and the processor time of all its processes is told for a second of motion, for
200 cases of 1 s on 16 cores as well.
"""

from __future__ import annotations

import csv
import statistics
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import tomli_w

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parents[2] / "jobs"))
import stage
from common import (
    campaign,
    parser_of,
    processor_time,
    table,
    tell,
    under_mpi,
    working_folder,
)

from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.campaign.simulate import result_of
from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.kernels.contact import TOUCHED
from hpcwhirl.dynamics.march import March
from hpcwhirl.reduction.numbers import one_thread
from hpcwhirl.scene import Scene, apply_settings
from hpcwhirl.scene.documents import load_document

PAGE = Path(__file__).with_suffix(".md")
STEPS = 1.25e-6, 1e-6, 5e-7  # s
REFERENCE = 2.5e-7  # s
SHORT = 0.02  # s
BLOCK = 100  # steps timed together
NUMBERS = "contact_impulse", "ledger_friction", "ledger_damping"
CASES, CORES = 200, 16
HOUR = 3600.0  # s, the demand


@dataclass
class Timed:
    """What cases of one step took and gave.

    Attributes
    ----------
    prepared : s of the processor, of each case
    flight, contact : us a step, of blocks without and with contact in every step
    marched : s of the processor over seconds of motion, of each case
    rows : results
    """

    prepared: list[float] = field(default_factory=list)
    flight: list[float] = field(default_factory=list)
    contact: list[float] = field(default_factory=list)
    marched: list[float] = field(default_factory=list)
    rows: list[dict[str, Any]] = field(default_factory=list)


@one_thread()
def timed(scenes: Sequence[Scene], step: float) -> Timed:
    """Integrate scenes with a step, s, and time them."""
    out, given = Timed(), {"time_step": step, "duration": SHORT, "traces": "orbit"}
    for scene in scenes:
        start = time.process_time()
        case = resolve(apply_settings(scene, given))
        march = March(case)
        out.prepared.append(time.process_time() - start)
        spent = 0.0
        march.advance(BLOCK)  # compiles
        while not march.done:
            before, touched = march.steps, int(march.counter[TOUCHED])
            start = time.process_time()
            march.advance(BLOCK)
            taken = time.process_time() - start
            steps = march.steps - before
            touched = int(march.counter[TOUCHED]) - touched
            spent += taken
            if touched in {0, steps}:
                kind = out.contact if touched else out.flight
                kind.append(1e6 * taken / steps)
        out.marched.append(spent / (march.steps * step))
        out.rows.append(dict(result_of(case, march.history()).row))
    return out


def errors(rows: list[dict[str, Any]], finest: list[dict[str, Any]]) -> list[float]:
    """Return the largest relative error of each of `NUMBERS` over the cases."""
    pairs = list(zip(rows, finest, strict=True))
    return [max(abs(a[n] / b[n] - 1) for a, b in pairs) for n in NUMBERS]


def line(step: float, own: Timed, finest: Timed) -> list[str]:
    """Return a row of the table of steps."""
    pairs = zip(own.rows, finest.rows, strict=True)
    same = sum(a["regime"] == b["regime"] for a, b in pairs)
    apart = [f"{e:.1e}" for e in errors(own.rows, finest.rows)]
    return [
        f"{step:g}", f"{statistics.median(own.prepared[1:]):.1f}",
        f"{statistics.median(own.flight):.2f}", f"{statistics.median(own.contact):.1f}",
        f"{statistics.median(own.marched):.1f}", f"{max(own.marched):.0f}", *apart,
        f"{same} of {len(own.rows)}",
    ]  # fmt: skip


def whole(folder: Path, seconds: float) -> tuple[float, list[dict[str, str]]]:
    """Return (s of the processor, rows of all cases) of the map on two ranks."""
    document = load_document(folder / "map.toml")
    document["scene"]["duration"] = seconds
    document["engine"]["file"] = str((folder / "rotor.h5").resolve())
    columns = "regime,contacts,contact_impulse,last_contact,steps,time_step,seconds"
    with working_folder(None, "stage") as out:
        file = out / "map.toml"
        file.write_text(tomli_w.dumps(document), encoding="utf-8")
        before = processor_time()
        campaign(file, out / "map")
        spent = processor_time() - before
        words = "-m", "hpcwhirl", "cases", out / "map", "--csv", "--no-units"
        listed = under_mpi(0, *words, "--columns", columns)
    return spent, list(csv.DictReader(listed.splitlines()))


def told_whole(folder: Path, seconds: float) -> list[str]:
    """Return the lines on the whole map."""
    spent, rows = whole(folder, seconds)
    names = list(rows[0])
    motion = sum(float(row["steps"]) * float(row["time_step"]) for row in rows)
    rate = spent / motion
    hours = CASES * rate / CORES / HOUR
    return [
        f"The whole map, {len(rows)} cases of {seconds:g} s on two ranks (`mpirun -n 2",
        f"hpcwhirl campaign`, with map and page): {spent:.0f} s of the processor for",
        f"{motion:.2f} s of motion, {rate:.1f} a second. {CASES} cases of 1 s at that",
        f"rate are {hours:.2f} h on {CORES} cores; allowed for an hour were",
        f"{CORES * HOUR / CASES:.0f} s a second.",
        "",
        *table(names, [[short(row[n]) for n in names] for row in rows]),
    ]


def short(value: str) -> str:
    """Return a number with four digits, other text unchanged."""
    try:
        return f"{float(value):.4g}"
    except ValueError:
        return value


def main() -> None:
    """Time, compare and print."""
    parser = parser_of(__doc__, write=PAGE)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--coarse", action="store_true", help="of the small mesh")
    parser.add_argument("--seconds", type=float, default=1.0, help="of a case")
    args = parser.parse_args()
    stage.reduced(args.folder, stage.COARSE if args.coarse else stage.FINE)
    scenes = list(Design.of(args.folder / "map.toml").scenes)
    finest = timed(scenes, REFERENCE)
    head = (
        "step, s", "prepared, s a case", "in flight, µs", "in contact, µs",
        "s of the processor a second of motion, median", "most",
        *(f"{name}, apart" for name in NUMBERS), "same word",
    )  # fmt: skip
    lines = [line(step, timed(scenes, step), finest) for step in STEPS]
    lines.append(line(REFERENCE, finest, finest))
    told = [*table(head, lines), "", *told_whole(args.folder, args.seconds)]
    tell("\n".join(told), PAGE if args.write else None)


if __name__ == "__main__":
    main()
