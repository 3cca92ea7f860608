"""`hpcwhirl gather`: journals and traces to results.h5."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

COMPLETE, FAILED, WRONG_INPUT = 0, 1, 2


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("folder", type=Path, metavar="DIR")
    parser.add_argument(
        "--compress", type=int, choices=range(10), default=0, metavar="LEVEL",
        help="gzip of the traces, 1 to 9 (default 0: none)",
    )  # fmt: skip


def run(args: argparse.Namespace) -> int:
    """Gather what there is; cases without a result are rows with status missing.

    The exit code is 1 where a case failed or is missing, also while a campaign is
    still at it: who goes on with the results of all may rely on 0.
    """
    from hpcwhirl import __version__
    from hpcwhirl.analysis.regimes import threshold_facts
    from hpcwhirl.campaign.log import say
    from hpcwhirl.errors import WhirlError
    from hpcwhirl.launch import communicator
    from hpcwhirl.store.directory.owner import Asking
    from hpcwhirl.store.results.gather import gather

    comm = communicator()
    facts: dict[str, str | float] = {"version": __version__, **threshold_facts()}
    try:
        asking = Asking(say=say)
        path = gather(args.folder, facts, comm, compress=args.compress, asking=asking)
    except WhirlError:  # raised on every rank, told by one
        if comm.rank == 0:
            raise
        return WRONG_INPUT
    code = COMPLETE
    if comm.rank == 0:
        print(path)
        _refresh(args.folder)
        code = _code(path)
    return int(comm.bcast(code, root=0))


def _code(path: Path) -> int:
    """Return the exit code of a results file; say how many cases have no result."""
    from hpcwhirl.store.reading.reader import count_statuses

    found = count_statuses(path)
    cases = sum(found.values())
    bad = {name: count for name, count in found.items() if name != "ok"}
    if not bad:
        return COMPLETE
    why = ", ".join(f"{count} {name}" for name, count in bad.items())
    told = f"{sum(bad.values())} of {cases} cases have no result: {why}"
    print(f"hpcwhirl: {told}; see `status` and `message` in {path}", file=sys.stderr)
    return FAILED


def _refresh(folder: Path) -> None:
    """Draw a map again that there is, and say what else shows older results."""
    from hpcwhirl.report.fresh import refresh

    drawn, stale = refresh(folder)
    for made in drawn:
        print(made)
    for line in stale:
        print(f"hpcwhirl: {line}", file=sys.stderr)
