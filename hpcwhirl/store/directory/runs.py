"""Files in `runs/` that say how each rank used its time, one file per run.

They are written at the end of a run.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from hpcwhirl.errors import MissingFileError
from hpcwhirl.safe_open import read_regular
from hpcwhirl.store.atomic import Say, write_whole
from hpcwhirl.store.directory.journal import listed

Share = dict[str, Any]
KEYS = {"rank": int, "host": str, "cases": int, "busy": float, "span": float}
COSTS = {"beside": float, "first": float}  # optional entries, s, see `read_runs`
LARGEST = 1 << 53  # limit of all numbers: whole numbers below it are exact


class Runs:
    """The files in a campaign's directory that say how the ranks of each run used time.

    folder : the campaign's directory
    """

    def __init__(self, folder: Path) -> None:
        self.place = folder / "runs"

    def files(self) -> list[Path]:
        """Return the paths of these files, in the order of the runs."""
        return listed(self.place, ".json")

    def write(self, run: int, shares: list[Share], stopped: str = "") -> None:
        """Write how the ranks of a run used their time, and why it stopped.

        Parameters
        ----------
        run : number of the run
        shares : use of time of each rank, see `shares`
        stopped : why the run stopped early; "": it did not
        """
        told = {"run": run, "stopped": stopped, "ranks": shares}
        text = json.dumps(told, indent=1) + "\n"
        write_whole(self.place / f"{run:04d}.json", text.encode(), parents=False)

    def shares(self, say: Say | None = None) -> list[Share]:
        """Return how each rank of each run used its time, in the order of the runs.

        An entry has run, rank, host, cases, busy and span, the last two in s. It may
        also have `beside`, the median overhead of a computation beyond its kernel, s,
        and `first`, by how much the rank's first computation took longer, s. A killed
        run has no file, and a damaged file is skipped: no result depends on these
        files.

        say : prints one line about skipped files
        """
        found: list[Share] = []
        told: list[str] = []
        try:
            paths = self.files()
        except MissingFileError as failed:
            paths, told = [], [str(failed)]
        for path in paths:
            try:
                found += _shares(json.loads(read_regular(path)))
            except (ValueError, TypeError, RecursionError):
                told.append(f"{path} is damaged")
            except OSError as failed:
                told.append(f"cannot read {path}: {failed.strerror}")
        if told and say is not None:
            more = f" ({len(told)} such files)" if len(told) > 1 else ""
            say(f"{told[0]}{more}: the ranks' times of that run are left out")
        return found

    def why_stopped(self, run: int) -> str:
        """Return why a run stopped early, from its file; "": it did not, or unknown."""
        try:
            found = json.loads(read_regular(self.place / f"{run:04d}.json"))
        except (OSError, ValueError, RecursionError):  # killed runs leave no whole file
            return ""
        told = found.get("stopped") if isinstance(found, dict) else ""
        return told if isinstance(told, str) else ""


def _shares(data: Any) -> list[Share]:
    """Return how each rank of a run used its time, from the run's parsed file.

    Raises
    ------
    TypeError, ValueError
        where the file is damaged
    """
    if not isinstance(data, dict) or not isinstance(data.get("ranks"), list):
        raise TypeError("no run and ranks")
    shares = [{"run": data.get("run"), **dict(share)} for share in data["ranks"]]
    for share in shares:
        more = {name: kind for name, kind in COSTS.items() if name in share}
        for name, kind in ({"run": int} | KEYS | more).items():
            _check(share.get(name), kind)
    return shares


def _check(value: Any, kind: type) -> None:
    """Raise unless a value in the file of a run is finite and has the type `kind`."""
    kinds: Any = (int, float) if kind is float else kind
    if isinstance(value, bool) or not isinstance(value, kinds):
        raise TypeError(f"{value!r:.40} is no {kind.__name__}")
    if kind is not str and not abs(value) < LARGEST:
        raise ValueError("no finite number")
