"""What every rank did with its time: kept for the results, told in a line."""

from __future__ import annotations

import socket
from pathlib import Path

from hpcwhirl.campaign.log import say
from hpcwhirl.campaign.ranks import Tally
from hpcwhirl.errors import MissingFileError
from hpcwhirl.launch import ALONE, Communicator
from hpcwhirl.store.runs import Share, write_run


def keep_shares(
    folder: Path, run: int, tally: Tally, comm: Communicator = ALONE, stopped: str = ""
) -> None:
    """Write the shares of all ranks; rank 0 says them. Every rank must call.

    Parameters
    ----------
    folder : the campaign's directory
    run : its number
    tally : of this rank
    comm : of all ranks
    stopped : why this rank is to stop early; empty: it is not
    """
    own = {"rank": comm.rank, "host": socket.gethostname(), "units": tally.units}
    own |= {"cases": tally.cases, "busy": tally.busy, "span": tally.span}
    gathered = comm.gather((own, stopped), root=0)
    if gathered is not None:
        shares = [share for share, _ in gathered]
        say(told(shares))
        try:
            why = next((why for _, why in gathered if why), "")
            write_run(folder, run, shares, why)
        except MissingFileError as full:  # a full disk: results do without
            say(f"the ranks' times were not kept: {full}")


def told(shares: list[Share]) -> str:
    """Return cases, seconds, throughput and busy fractions of the ranks in a line."""
    span = max(share["span"] for share in shares)
    busy = [share["busy"] / max(share["span"], 1e-9) for share in shares]
    cases = sum(share["cases"] for share in shares)
    ranks = f"{len(shares)} rank{'s' if len(shares) > 1 else ''}"
    least = f"{min(busy):.3f} to {max(busy):.3f}" if len(busy) > 1 else f"{busy[0]:.3f}"
    return (
        f"{cases} cases in {span:.1f} s on {ranks}: {cases / max(span, 1e-9):.3g} "
        f"cases/s, busy fraction {least}"
    )
