"""`runs/`: what every rank did with its time, one file a run, written at its end."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from hpcwhirl.store.whole import write_whole

Share = dict[str, Any]


def write_run(folder: Path, run: int, shares: list[Share]) -> None:
    """Keep what the ranks of a run did; see `read_runs`."""
    path = folder / "runs" / f"{run:04d}.json"
    text = json.dumps({"run": run, "ranks": shares}, indent=1) + "\n"
    write_whole(path, text.encode())


def read_runs(folder: Path) -> list[Share]:
    """Return {run, rank, host, busy, span, units} of each rank of each run, in order.

    busy, span in s. A run that was killed left no file, and a file that is not whole
    is left out: results do not depend on either.
    """
    found: list[Share] = []
    for path in sorted((folder / "runs").glob("*.json")):
        try:
            data = json.loads(path.read_text(encoding="utf-8"))
            found += [{"run": data["run"], **share} for share in data["ranks"]]
        except (ValueError, KeyError, TypeError, OSError):
            continue
    return found
