"""`hpcwhirl gather`: write results.h5 from the journals and traces of a campaign."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from hpcwhirl.cli.command import add_option, code_of, tell_failure
from hpcwhirl.cli.options import OF_CAMPAIGN, add_json, add_take_over, print_paths
from hpcwhirl.errors import COMPLETE, FAILED, WhirlError, say

if TYPE_CHECKING:
    from hpcwhirl.store.directory.campaign_directory import Directory


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `hpcwhirl gather` on its parser."""
    # fmt: off
    parser.add_argument("folder", type=Path, metavar="DIR", help=OF_CAMPAIGN)
    add_option(parser, "--compress LEVEL",
        "gzip level of the traces, 1 to 9 (default 0: not compressed)",
        default=0, choices=range(10))
    add_take_over(parser)
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Gather all results so far into results.h5; return the exit code.

    A case without a result gets the status missing.

    The code is 0 only if every case has a result, and 1 if a case failed or is missing,
    even if a campaign is still computing that case.
    """
    from hpcwhirl import __version__
    from hpcwhirl.analysis.regimes import threshold_facts
    from hpcwhirl.errors import say
    from hpcwhirl.launch import communicator, end_all, from_root
    from hpcwhirl.store.directory.campaign_directory import Directory
    from hpcwhirl.store.directory.owner import Asking
    from hpcwhirl.store.results.gather import gather

    comm, directory = communicator(), Directory(args.folder)
    facts: dict[str, str | float] = {"version": __version__, **threshold_facts()}
    try:
        before = _words_and_numbers(directory) if comm.rank == 0 else ""
        asking = Asking(args.take_over, say)
        path = gather(directory, facts, comm, compress=args.compress, asking=asking)
    except WhirlError as failed:  # raised on every rank, printed by rank 0
        if comm.rank == 0:
            raise
        return code_of(failed)
    except Exception as failed:  # noqa: BLE001 - printed here, aborted below
        code = tell_failure(failed)
        end_all(comm, code)  # the other ranks may wait for this one
        return code
    code = COMPLETE
    if comm.rank == 0:
        from hpcwhirl.report.map.maps import refresh

        changed = _words_and_numbers(directory) != before
        drawn, stale = refresh(directory, changed=changed)
        print_paths(args, [path, *drawn])
        for line in stale:
            say(line)
        code = _code(path)
    return int(from_root(comm, code))


def _words_and_numbers(directory: Directory) -> str:
    """Return a digest of the numbers and words of results.h5; "" if there is none."""
    from hpcwhirl.store.reading.results_file import Results

    try:
        with Results(directory.results) as results:
            return results.digest(thresholds=False)
    except WhirlError:  # there is no file yet, or a damaged one that is replaced
        return ""


def _code(path: Path) -> int:
    """Print how many cases of a results file have no result; return the exit code.

    The code is 0 if all cases have results, else 1; path : results.h5
    """
    from hpcwhirl.store.reading.results_file import count_statuses

    statuses = count_statuses(path)
    cases = sum(statuses.values())
    bad = {name: count for name, count in statuses.items() if name != "ok"}
    if not bad:
        return COMPLETE
    why = ", ".join(f"{count} {name}" for name, count in bad.items())
    count = sum(bad.values())
    text = (
        f"{count} of {cases} cases {'has' if count == 1 else 'have'} no result: {why}"
    )
    if bad.keys() - {"missing"}:
        text += f"; see `status` and `message` in {path}"
    if "missing" in bad:
        text += "; the campaign's own command computes what is missing"
    say(text)
    return FAILED
