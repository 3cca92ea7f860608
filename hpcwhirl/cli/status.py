"""`hpcwhirl status`: how far a campaign is, from journals and notes of its ranks.

Counts by status, what each rank computes and for how long, rate, time and core-hours
left, the share of time spent in the kernel, why it stopped, and whether the page is
stale; as JSON all ranks, and since when.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hpcwhirl.cli.options import add_json, finite, print_json

if TYPE_CHECKING:
    from hpcwhirl.campaign.progress import Computing, Progress

EVERY = 5.0  # s between looks
FEWEST = 0.2  # s
MOST_SHOWN = 8  # ranks


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("folder", type=Path, metavar="DIR")
    parser.add_argument(
        "--watch",
        nargs="?",
        const=EVERY,
        type=float,
        metavar="SECONDS",
        help=f"look again every SECONDS (default {EVERY:g}) until nothing is left",
    )
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Print counts, rate, ETA, kernel share, core-hours, words, what ranks are at."""
    from hpcwhirl.campaign.progress import progress_of
    from hpcwhirl.errors import InputError

    if args.watch is not None and not FEWEST <= args.watch <= 1e6:
        msg = f"--watch must be >= {FEWEST} s and <= 1e6 s, got {args.watch:g}"
        raise InputError(msg)
    found = progress_of(args.folder)
    if args.watch is not None:
        return _watch(args, found)
    if args.json:
        print_json(asdict(found) | {"stale": _stale(args.folder)})
        return 0
    stale = _stale(args.folder)
    for name, value in (_shown(found) | ({"stale": stale} if stale else {})).items():
        print(f"{name}: {value}")
    return 0


def _stale(folder: Path) -> str:
    """Return what shows other results than there are, and the remedy; "" for none."""
    from hpcwhirl.errors import WhirlError

    if not (folder / "report.html").exists() or not (folder / "results.h5").exists():
        return ""
    from hpcwhirl.report.page.build import NAME, is_stale

    try:
        return f"{NAME}: hpcwhirl report {folder}" if is_stale(folder) else ""
    except WhirlError as failed:
        return f"not known of {NAME}: {failed}"


def _watch(args: argparse.Namespace, found: Progress) -> int:
    show = _Lines(as_json=args.json)
    if sys.stdout.isatty() and not args.json:
        show = _Screen()
    try:
        with show:
            show(found)
            while found.left:
                time.sleep(args.watch)
                found = _look(args.folder)
                show(found)
    except KeyboardInterrupt:
        return 0
    return 0


def _look(folder: Path) -> Progress:
    from hpcwhirl.campaign.progress import progress_of

    return progress_of(folder)


def _shown(found: Progress) -> dict[str, str]:
    """Return {name: text} of what is known."""
    out = {n: str(getattr(found, n)) for n in ("cases", "done", "failed", "left")}
    if found.grows:
        out["cases"] += " wanted so far"
    if found.dropped:
        out["left out by the budget"] = f"{found.dropped} or more"
    if found.statuses.keys() - {"ok"}:
        out["statuses"] = _counts(found.statuses)
    if found.stopped:
        at_it = any(not one.died for one in found.running)
        out["stopping" if at_it else "stopped"] = found.stopped
    out |= _pace(found)
    out["regimes"] = _counts(found.regimes) or ("none yet" if found.left else "none")
    for name, died in (("running", False), ("left by processes that died", True)):
        ranks = [one for one in found.running if one.died == died]
        if ranks:
            out[name] = _ranks(ranks)
    return out


def _pace(found: Progress) -> dict[str, str]:
    """Return {name: text} of rate, times and core-hours."""
    from hpcwhirl.campaign.progress import duration_text

    out = {}
    if found.rate is not None and found.left:
        out["ranks"] = str(found.ranks)
        out["rate"] = f"{found.rate:.4g} cases/h"
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
    """Return what ranks are at, the longest first; of many, those."""
    from hpcwhirl.campaign.progress import duration_text

    told = []
    for one in found[:MOST_SHOWN]:
        noun = "case" if len(one.cases) == 1 else "cases"
        text = f"rank {one.rank} {noun} {', '.join(map(str, one.cases))}"
        if one.seconds is not None:
            text += f" for {duration_text(max(one.seconds, 0.0))}"
        told.append(text)
    if len(found) > MOST_SHOWN:
        told.append(f"{len(found) - MOST_SHOWN} more")
    return "; ".join(told)


class _Lines:
    """A line a look: for logs and pipes, or one JSON object a line."""

    def __init__(self, *, as_json: bool = False) -> None:
        self.as_json = as_json

    def __enter__(self) -> _Lines:
        """Return itself."""
        return self

    def __exit__(self, *error: object) -> None:
        """Nothing to put back."""

    def __call__(self, found: Progress) -> None:
        """Print one line at once."""
        if self.as_json:
            print(json.dumps(finite(asdict(found)), allow_nan=False), flush=True)
            return
        shown = _shown(found)
        so_far = " so far" if found.grows else ""
        done = f"{found.done} of {found.cases} cases{so_far}"
        bad = [f"{found.failed} failed"] if found.failed else []
        names = (
            "rate", "left at this rate", "in the kernel", "last case finished",
            "stopping", "stopped",
        )  # fmt: skip
        parts = [
            f"{n} {shown[n]}" if n != "rate" else shown[n] for n in names if n in shown
        ]
        print(", ".join([done, *bad, *parts]), flush=True)


class _Screen(_Lines):
    """A table with a bar, redrawn in place on a terminal."""

    def __init__(self) -> None:
        super().__init__()
        from rich.live import Live

        self.live = Live(auto_refresh=False)

    def __enter__(self) -> _Screen:
        """Begin to draw."""
        self.live.__enter__()
        return self

    def __exit__(self, *error: Any) -> None:
        """Leave the last table on the terminal."""
        self.live.__exit__(*error)

    def __call__(self, found: Progress) -> None:
        """Draw anew."""
        from rich.console import Group
        from rich.progress_bar import ProgressBar
        from rich.table import Table

        table = Table.grid(padding=(0, 2))
        for name, value in _shown(found).items():
            table.add_row(name, value)
        bar = ProgressBar(total=max(found.cases, 1), completed=found.cases - found.left)
        self.live.update(Group(bar, table), refresh=True)
