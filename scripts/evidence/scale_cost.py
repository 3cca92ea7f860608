"""What commands cost over many cases: seconds, memory, bytes; writes scale_cost.md.

    python scripts/evidence/scale_cost.py                      # 10^4, 10^5, 10^6 rows
    python scripts/evidence/scale_cost.py --cases 10000 --only gather status
    options: --folder DIR (kept and used again), --write (the page), --profile COMMAND

Rows are made up: a grid of so many speeds and gaps is planned as any campaign, and its
journals are written by the program's own writer, as two ranks would, in scattered
order, from a few rows that were computed; each has the inputs of its case, and numbers
in as many digits as computed ones. Each command runs by itself in a new process:
seconds are of the clock, MB the largest resident set of the process.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hpcwhirl.campaign.design import Design
from hpcwhirl.store.journal import Record, journal_name, read_records, sealed
from hpcwhirl.store.manifest import write_manifest

PAGE = Path(__file__).with_suffix(".md")
SIZES = (10_000, 100_000, 1_000_000)
SCENE = {"nodal_diameter": 1, "friction": 0.2, "duration": 2.5}
TEMPLATES = {
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
    "nothing to do": ["campaign", "DIR/sweep.toml", "--out", "DIR", "--report", "no"],
    "classify": ["classify", "DIR", "--set", "drift=0.11"],
    "map": ["map", "DIR"],
    "cases": ["cases", "DIR", "--csv"],
    "cases --where": ["cases", "DIR", "--where", "speed > 499 and gap < 2e-4"],
}


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
    file.write_text(as_toml(TEMPLATES))
    hpcwhirl("campaign", file, "--out", folder / "templates", "--report", "no")
    found = read_records(folder / "templates")
    return [found[name] for name in sorted(found)]


def as_toml(document: dict[str, dict[str, Any]]) -> str:
    """Return a campaign's file."""
    quoted = {name: {key: f'"{value}"' if isinstance(value, str) else value
                     for key, value in table.items()}
              for name, table in document.items()}  # fmt: skip
    lines = [f"[{name}]\n" + "".join(f"{k} = {v}\n" for k, v in table.items())
             for name, table in quoted.items()]  # fmt: skip
    return "\n".join(lines)


def made(folder: Path, cases: int, known: list[Record]) -> Path:
    """Return the directory of a finished campaign of so many made-up rows."""
    place = folder / f"rows-{cases}"
    if place.exists():
        return place
    part = folder / f"rows-{cases}.part"
    (part / "journal").mkdir(parents=True)
    (part / "traces").mkdir()
    wide = round(cases**0.5 / 10) * 10
    speeds = np.round(np.linspace(20.0, 520.0, wide), 9)
    gaps = np.geomspace(5e-5, 2e-3, cases // wide)
    document = TEMPLATES | {
        "sweep": {"speed": speeds.tolist(), "gap": gaps.tolist()},
    }
    (part / "sweep.toml").write_text(as_toml(document))
    design = Design.of(document)
    write_manifest(part, design.manifest())
    files = [(part / "journal" / journal_name(1, r)).open("wb") for r in range(RANKS)]
    for number, record in enumerate(records(design, known)):
        files[number % RANKS].write(sealed(record))
    for file in files:
        file.close()
    part.rename(place)
    return place


def records(design: Design, known: list[Record]) -> Iterator[Record]:
    """Yield a record for each case of a design, in the order that they would end."""
    cases = len(design.settings)
    scattered = np.argsort((np.arange(cases) * GOLDEN) % 1.0)
    now = 1.7e9
    rows = sorted(known, key=lambda r: (r["row"]["speed"], -r["row"]["gap"]))
    for case in scattered.tolist():
        own = design.settings[case]
        drive = own["speed"] / 520.0 - 0.1 * np.log10(own["gap"] / 1e-4)
        like = rows[int(np.clip(drive, 0.0, 0.999) * len(rows))]
        more = 1.0 + 1e-3 * ((case * GOLDEN) % 1.0)
        row = {name: value * more if isinstance(value, float) else value
               for name, value in like["row"].items() if name not in FIXED}  # fmt: skip
        row = {n: row.get(n, like["row"][n]) for n in like["row"]}  # in their order
        row |= {name: own[name] for name in ("speed", "gap")}
        yield like | {
            "case": case, "digest": design.digests[case], "ended": (now := now + 1e-3),
            "row": row,
        }  # fmt: skip


FIXED = ("duration", "time_step", "sample_interval", "end_time", "window", "force",
         "pulse", "friction", "certificate", "last_contact", "load_end")  # fmt: skip


def bytes_of(folder: Path) -> int:
    """Return the bytes of a folder's files."""
    return sum(p.stat().st_size for p in folder.rglob("*") if p.is_file())


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
    return out


def main() -> None:
    """Make campaigns, run commands on them, tell what they cost."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, nargs="+", default=SIZES)
    parser.add_argument("--only", nargs="+", choices=COMMANDS, default=list(COMMANDS))
    parser.add_argument("--folder", type=Path)
    args = parser.parse_args()
    folder = args.folder or Path(tempfile.mkdtemp(prefix="scale-cost-"))
    folder.mkdir(parents=True, exist_ok=True)
    try:
        known = templates(folder)
        for cases in args.cases:
            place = made(folder, cases, known)
            measured(place, args.only)
    finally:
        if not args.folder:
            shutil.rmtree(folder)


if __name__ == "__main__":
    main()
