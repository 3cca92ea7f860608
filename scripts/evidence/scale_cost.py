"""What commands cost over many cases: seconds, memory, bytes; writes scale_cost.md.

    python scripts/evidence/scale_cost.py                      # 10^4, 10^5, 10^6 rows
    python scripts/evidence/scale_cost.py --cases 10000 --only gather status
    options: --folder DIR (kept and used again), --write (the page)

Rows are made up: a grid of so many speeds and gaps is planned as any campaign, and its
journals are written by the program's own writer, as two ranks would, in scattered
order, from a few rows that were computed; each has the inputs of its case, and numbers
in as many digits as computed ones. Each command runs by itself in a new process:
seconds are of the clock, MB the largest resident set of the process.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
import zlib
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import tomli_w

from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.scene.quantities import ROW
from hpcwhirl.store.directory.journal import Journals, journal_name
from hpcwhirl.store.directory.manifest import PlanFile
from hpcwhirl.store.directory.record import (
    CHECKED,
    Header,
    Record,
    fields_of,
    header_of,
)

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import parser_of, table, tell, working_folder

PAGE = Path(__file__).with_suffix(".md")
SIZES = (10_000, 100_000, 1_000_000)
SCENE = {"nodal_diameter": 1, "friction": 0.2, "duration": 2.5}
TEMPLATES: dict[str, dict[str, Any]] = {
    "scene": SCENE,
    "solver": {"preset": "draft"},
    "output": {"traces": "summary"},
    "sweep": {"speed": [50.0, 200.0, 350.0, 500.0], "gap": [1e-4, 3e-4, 1e-3]},
}
GOLDEN = 0.6180339887498949
RANKS = 2
COMMANDS: dict[str, list[str]] = {
    "status": ["status", "DIR"],
    "gather": ["gather", "DIR"],
    "map": ["map", "DIR"],
    "nothing to do": ["campaign", "DIR/sweep.toml", "--out", "DIR", "--report", "no"],
    "extend": ["campaign", "DIR/sweep.toml", "--out", "DIR", "--extend", "undecided",
               "--to", "20", "--dry-run"],
    "classify": ["classify", "DIR", "--set", "drift=0.11", "--write"],
    "cases": ["cases", "DIR", "--csv"],
    "cases --where": ["cases", "DIR", "--where", "speed > 499 and gap < 2e-4"],
}  # fmt: skip

AIMS = {
    "status": "3 s", "gather": "60 s, 500 MB", "nothing to do": "4 s",
    "classify": "20 s, 500 MB", "cases": "500 MB",
}  # fmt: skip


class Cost(NamedTuple):
    """Seconds of the clock, of the processor, and MB, of a process."""

    seconds: float
    processor: float
    megabytes: float


def hpcwhirl(*words: str | Path, out: Path | None = None) -> Cost:
    """Run a sub-command in a new process."""
    command = [sys.executable, "-m", "hpcwhirl", *map(str, words)]
    begun = time.perf_counter()
    with (out or Path(os.devnull)).open("wb") as file:
        child = subprocess.Popen(command, stdout=file)
        _, code, used = os.wait4(child.pid, 0)
    seconds = time.perf_counter() - begun
    if os.waitstatus_to_exitcode(code):
        msg = f"{' '.join(command)} ended with {os.waitstatus_to_exitcode(code)}"
        raise SystemExit(msg)
    return Cost(seconds, used.ru_utime + used.ru_stime, used.ru_maxrss / 1e3)


def templates(folder: Path) -> list[Record]:
    """Return the records of a few cases that are computed here."""
    file = folder / "templates.toml"
    file.write_text(tomli_w.dumps(TEMPLATES))
    hpcwhirl("campaign", file, "--out", folder / "templates", "--report", "no")
    found = Journals(folder / "templates").newest()
    return [found[name] for name in sorted(found)]


def made(folder: Path, cases: int) -> Path:
    """Return the directory of a finished campaign of so many made-up rows."""
    place = folder / f"rows-{cases}"
    if place.exists():
        return place
    known = templates(folder)
    part = folder / f"rows-{cases}.part"
    shutil.rmtree(part, ignore_errors=True)
    (part / "journal").mkdir(parents=True)
    (part / "traces").mkdir()
    wide = round(cases**0.5 / 10) * 10
    speeds = np.round(np.linspace(20.0, 520.0, wide), 9)
    gaps = np.geomspace(5e-5, 2e-3, cases // wide)
    document = TEMPLATES | {
        "sweep": {"speed": speeds.tolist(), "gap": gaps.tolist()},
    }
    (part / "sweep.toml").write_text(tomli_w.dumps(document))
    design = Design.of(document)
    PlanFile(part).write(design.manifest())
    for rank in range(RANKS):
        name = journal_name(1, rank)
        plan, traces = design.digests.identity, name.replace(".log", ".bin")
        header, head = header_of(plan, traces, fields_of())
        records = records_of(design, known, header)[rank::RANKS]
        (part / "journal" / name).write_bytes(head + records.tobytes())
    part.rename(place)
    return place


def records_of(design: Design, known: list[Record], header: Header) -> np.ndarray:
    """Return a record for each case of a design, in the order that they would end.

    Many at once; what the program's writer makes of some of them is the same.
    """
    rows = sorted(known, key=lambda r: (r["row"]["speed"], -r["row"]["gap"]))
    layout = header.layout
    slots = b"".join(layout.encode(record, header.tag) for record in rows)
    computed = np.frombuffer(slots, layout.dtype)
    cases = np.argsort((np.arange(len(design.settings)) * GOLDEN) % 1.0)
    own = {name: column_of(design, name)[cases] for name in ("speed", "gap")}
    drive = own["speed"] / 520.0 - 0.1 * np.log10(own["gap"] / 1e-4)
    found = computed[(np.clip(drive, 0.0, 0.999) * len(rows)).astype(int)]
    more = 1.0 + 1e-3 * ((cases * GOLDEN) % 1.0)
    for name in ROW.keys() - set(FIXED):
        if layout.dtype[f"row.{name}"].kind == "f":
            found[f"row.{name}"] *= more
    found["case"], found["ended"] = cases, 1.7e9 + 1e-3 * np.arange(len(cases))
    found["row.speed"], found["row.gap"] = own["speed"], own["gap"]
    digests = np.frombuffer(b"".join(map(bytes.fromhex, design.digests)), "V32")
    found["digest"] = digests[cases]
    data = found.view(np.uint8).reshape(len(found), -1)
    found["crc"] = [zlib.crc32(one[CHECKED:]) for one in data]
    for one in found[:: len(found) // 100]:
        if layout.encode(layout.decode(one.tobytes(), {}), header.tag) != one.tobytes():
            raise SystemExit("these are not the records that the program writes")
    return found


def column_of(design: Design, name: str) -> np.ndarray:
    """Return an input of all cases, (cases,)."""
    column = design.settings.column(name, None)
    return column.of(np.arange(len(design.settings)), np.array(column.values, float))


FIXED = ("duration", "time_step", "sample_interval", "end_time", "window", "force",
         "pulse", "friction", "certificate", "last_contact", "load_end")  # fmt: skip


class Place(NamedTuple):
    """What a directory holds: cases, files, bytes of its plan, a journal line's."""

    cases: int
    files: int
    plan: int
    line: float
    costs: dict[str, Cost]


def held_by(place: Path, cases: int, costs: dict[str, Cost]) -> Place:
    """Return what a directory of so many cases holds, commands' costs with it."""
    files = sum(path.is_file() for path in place.rglob("*"))
    journal = sum(path.stat().st_size for path in (place / "journal").iterdir())
    plan = (place / "campaign.json").stat().st_size
    return Place(cases, files, plan, journal / cases, costs)


def measured(place: Path, only: list[str]) -> dict[str, Cost]:
    """Return what each command costs on a campaign."""
    out = {}
    for name in only:
        words = [word.replace("DIR", str(place)) for word in COMMANDS[name]]
        to = place / "cases.csv" if "--csv" in words else None
        out[name] = hpcwhirl(*words, out=to)
        cost = out[name]
        print(
            f"{place.name} {name}: {cost.seconds:.1f} s ({cost.processor:.1f} s of the "
            f"processor), {cost.megabytes:.0f} MB", flush=True,
        )  # fmt: skip
        if to:
            to.unlink()
    return out


def compared(found: list[Place]) -> list[str]:
    """Return the table of commands and sizes."""
    names = [name for name in COMMANDS if all(name in one.costs for one in found)]
    sizes = [f"10^{len(str(one.cases)) - 1}" for one in found]
    lines = []
    for name in names:
        cells = (
            f"{c.seconds:.1f} s ({c.processor:.1f}), {c.megabytes:.0f} MB"
            for c in (one.costs[name] for one in found)
        )
        command = " ".join(COMMANDS[name]).replace("DIR", "D")
        lines.append([f"`{command}`", *cells, AIMS.get(name, "")])
    held = [
        f"{one.line:.0f} B a case in the journal, {one.plan / 1e3:.3g} kB of plan, "
        f"{one.files} files" for one in found
    ]  # fmt: skip
    lines.append(["what there is", *held, "700 B"])
    head = ["command", *(f"{size} cases" for size in sizes), "aim"]
    return table(head, lines)


def main() -> None:
    """Make campaigns, run commands on them, tell what they cost."""
    parser = parser_of(__doc__, write=PAGE)
    parser.add_argument("--cases", type=int, nargs="+", default=SIZES)
    parser.add_argument("--only", nargs="+", choices=COMMANDS, default=list(COMMANDS))
    parser.add_argument("--folder", type=Path)
    args = parser.parse_args()
    if args.write and (args.cases, args.only) != (SIZES, list(COMMANDS)):
        parser.error("--write needs all sizes and commands: no --cases, no --only")
    found = []
    # an installed program is not compiled at every start, which takes a second
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    with working_folder(args.folder, "scale-cost") as folder:
        for cases in args.cases:
            # in a process of its own: what it holds would count as its child's
            with ProcessPoolExecutor(1, get_context("spawn")) as pool:
                place = pool.submit(made, folder, cases).result()
            found.append(held_by(place, cases, measured(place, args.only)))
    tell("\n".join(compared(found)), PAGE if args.write else None)


if __name__ == "__main__":
    main()
