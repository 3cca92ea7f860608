"""`hpcwhirl status`: progress of a campaign, from its journals and heartbeats.

It prints counts by status, the cases that ranks compute and for how long, rate, time
and core-hours left, the share of time in the kernel, why the campaign stopped, and
whether report.html is out of date; JSON has all ranks, the text only the first.
"""

from __future__ import annotations

import argparse
import json
import shlex
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import nullcontext, suppress
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hpcwhirl.cli.command import add_option
from hpcwhirl.cli.options import OF_CAMPAIGN, add_json, finite, print_json
from hpcwhirl.errors import InputError, WhirlError, cases_told, legible

if TYPE_CHECKING:
    from hpcwhirl.campaign.progress import Computing, Progress
    from hpcwhirl.store.directory.campaign_directory import Directory

EVERY = 5.0  # s between updates of --watch
FEWEST = 0.2  # s, shortest time allowed between updates
MOST_SHOWN = 8  # largest number of ranks whose cases are printed


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `hpcwhirl status` on its parser."""
    # fmt: off
    parser.add_argument("folder", type=Path, metavar="DIR", help=OF_CAMPAIGN)
    add_option(parser, "--watch SECONDS",
        f"update every SECONDS (default {EVERY:g}) until all cases have ended",
        type=float, nargs="?", const=EVERY)
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Print the progress of a campaign; with --watch repeatedly until it is complete.

    Returns the exit code
    """
    from hpcwhirl.campaign.progress import progress_of
    from hpcwhirl.store.directory.campaign_directory import Directory

    if args.watch is not None and not FEWEST <= args.watch <= 1e6:
        msg = f"--watch must be >= {FEWEST} s and <= 1e6 s, got {args.watch:g}"
        raise InputError(msg)
    directory = Directory(args.folder)
    found = progress_of(directory)
    if args.watch is not None:
        return _watch(args, directory, found)
    if args.json:
        beside = {"stale": _stale(directory), "twins_told": _twins(directory.results)}
        print_json(asdict(found) | beside)
        return 0
    beside = {"credibility": _twins(directory.results), "stale": _stale(directory)}
    told = {name: text for name, text in beside.items() if text}
    for name, value in (_shown(found) | told).items():
        print(f"{name}: {legible(str(value))}")
    return 0


def _twins(results: Path) -> str:
    """Return a sentence on how many cases have the same word as all their twins.

    "" if there is no results.h5, or no twins; results : path of results.h5
    """
    if not results.exists():
        return ""
    from hpcwhirl.store.reading.results_file import Results
    from hpcwhirl.store.reading.shares import find_credibility

    try:
        with Results(results) as cases:
            found = find_credibility(cases)
    except WhirlError as failed:
        return f"not known: {failed}"
    return str(found) if found else ""


def _stale(directory: Directory) -> str:
    """Return a hint with the command that renews report.html, if it is out of date.

    "" otherwise.
    """
    if not directory.page.exists() or not directory.results.exists():
        return ""
    from hpcwhirl.report.page.build import is_stale
    from hpcwhirl.store.directory.campaign_directory import PAGE

    try:
        how = shlex.join(["hpcwhirl", "report", str(directory)])
        return f"{PAGE}: {how}" if is_stale(directory) else ""
    except WhirlError as failed:
        return f"{PAGE} cannot be checked: {failed}"


def _watch(args: argparse.Namespace, directory: Directory, found: Progress) -> int:
    """Print a campaign's progress every --watch seconds until all cases have ended.

    On a terminal it is updated in place. Returns the exit code

    found : progress at the first time
    """
    from hpcwhirl.campaign.progress import progress_of

    display: Any = nullcontext()
    if sys.stdout.isatty() and not args.json:
        from rich.live import Live

        display = Live(auto_refresh=False)
    with suppress(KeyboardInterrupt), display as live:
        while True:
            if live is not None:
                live.update(_screen(found), refresh=True)
            else:
                print(_line(found, as_json=args.json), flush=True)
            if not found.left:
                break
            time.sleep(args.watch)
            found = progress_of(directory)
    return 0


def _shown(found: Progress) -> dict[str, str]:
    """Return all that `status` prints of a campaign's progress, {label: text}."""
    out = {n: str(getattr(found, n)) for n in ("cases", "done", "failed", "left")}
    if found.grows:
        out["cases"] += " wanted so far"
    if any(found.twins):
        out["twins"] = _twins_told(found)
    if found.dropped:
        out["left out by the budget"] = f"{found.dropped} or more"
    if found.statuses.keys() - {"ok"}:
        out["statuses"] = _counts(found.statuses)
    if found.stopped:
        at_it = any(not one.died for one in found.running)
        out["stopping" if at_it else "stopped"] = found.stopped
    out |= _pace(found)
    out["words"] = _counts(found.words) or ("none yet" if found.left else "none")
    for name, died in (("running", False), ("left by processes that died", True)):
        ranks = [one for one in found.running if one.died == died]
        if ranks:
            out[name] = _ranks(ranks)
    return out


def _twins_told(found: Progress) -> str:
    """Return as text how many twins a campaign's cases have, and how many have ended.

    found : progress of the campaign
    """
    count, done, failed = found.twins
    so_far = " wanted so far" if found.left else ""
    bad = f", {failed} failed" if failed else ""
    return f"{count}{so_far}, {done} done{bad}"


def _pace(found: Progress) -> dict[str, str]:
    """Return what `status` prints on rate, time left and core-hours, {label: text}.

    found : progress of the campaign
    """
    from hpcwhirl.campaign.progress import duration_text

    out = {}
    if found.rate is not None and found.left:
        out["ranks with recent results"] = str(found.ranks)
        noun = "cases and twins" if any(found.twins) else "cases"
        out["rate"] = f"{found.rate:.4g} {noun}/h"
    if found.eta is not None and found.left:
        out["left at this rate"] = duration_text(found.eta)
    if found.kernel_share is not None:
        out["in the kernel"] = f"{100 * found.kernel_share:.1f} %"
    out["core_hours"] = f"{found.core_hours:.3g}"
    if found.core_hours_left is not None and found.left:
        out["core_hours left"] = f"{found.core_hours_left:.3g}"
    if found.idle_for is not None and found.left:
        out["last case finished"] = f"{duration_text(found.idle_for)} ago"
    return out


def _counts(found: Mapping[str, int]) -> str:
    return ", ".join(f"{name} {count}" for name, count in sorted(found.items()))


def _ranks(found: Sequence[Computing]) -> str:
    """Return as text which cases ranks compute, and for how long already.

    found : what each rank computes; only the first `MOST_SHOWN` are named
    """
    from hpcwhirl.campaign.progress import duration_text

    parts = []
    for one in found[:MOST_SHOWN]:
        noun = "case" if len(one.cases) == 1 else "cases"
        text = f"rank {one.rank} {noun} {', '.join(map(str, one.cases))}"
        if one.seconds is not None:
            text += f" for {duration_text(max(one.seconds, 0.0))}"
        parts.append(text)
    if len(found) > MOST_SHOWN:
        parts.append(f"{len(found) - MOST_SHOWN} more")
    return "; ".join(parts)


def _line(found: Progress, *, as_json: bool) -> str:
    """Return a campaign's progress as one line, for --watch into a log or a pipe.

    found, as_json : progress of the campaign; whether the line is a JSON object
    """
    if as_json:
        return json.dumps(finite(asdict(found)), allow_nan=False)
    shown = _shown(found)
    so_far = " so far" if found.grows else ""
    done = f"{found.done} of {cases_told(found.cases)}{so_far}"
    if any(found.twins):
        done += f", {found.twins[1]} of {found.twins[0]} twins"
    bad = [f"{found.failed} failed"] if found.failed else []
    names = (
        "rate", "left at this rate", "in the kernel", "last case finished", "stopping",
        "stopped",
    )  # fmt: skip
    parts = [
        f"{n} {shown[n]}" if n != "rate" else shown[n] for n in names if n in shown
    ]
    return ", ".join([done, *bad, *parts])


def _screen(found: Progress) -> Any:
    """Return a campaign's progress as a bar and a table, for --watch on a terminal."""
    from rich.console import Group
    from rich.progress_bar import ProgressBar
    from rich.table import Table

    table = Table.grid(padding=(0, 2))
    for name, value in _shown(found).items():
        table.add_row(name, value)
    bar = ProgressBar(total=max(found.cases, 1), completed=found.cases - found.left)
    return Group(bar, table)
