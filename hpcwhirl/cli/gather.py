"""`hpcwhirl gather`: journals and traces to results.h5."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("folder", type=Path, metavar="DIR")
    parser.add_argument(
        "--compress", type=int, choices=range(10), default=0, metavar="LEVEL",
        help="gzip of the traces, 1 to 9 (default 0: none)",
    )  # fmt: skip


def run(args: argparse.Namespace) -> int:
    """Gather what there is; cases without a result are rows with status missing."""
    from hpcwhirl import __version__
    from hpcwhirl.campaign.ranks import communicator
    from hpcwhirl.errors import WhirlError
    from hpcwhirl.store.gather import gather

    comm = communicator()
    root = comm is None or comm.rank == 0
    try:
        path = gather(
            args.folder, {"version": __version__}, comm, compress=args.compress
        )
    except WhirlError:  # raised on every rank, told by one
        if root:
            raise
        return 2
    if root:
        print(path)
        _refresh(args.folder)
    return 0


def _refresh(folder: Path) -> None:
    """Draw a map again that there is, and say what else shows older results."""
    from hpcwhirl.report.fresh import refresh

    drawn, stale = refresh(folder)
    for made in drawn:
        print(made)
    for line in stale:
        print(f"hpcwhirl: {line}", file=sys.stderr)
