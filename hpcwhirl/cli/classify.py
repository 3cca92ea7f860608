"""`hpcwhirl classify`: regimes named again with other thresholds, no integration."""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any

from hpcwhirl.analysis.regimes import Thresholds
from hpcwhirl.analysis.rules import words_by_table
from hpcwhirl.cli.options import add_json, print_json
from hpcwhirl.errors import InputError, unknown


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("folder", type=Path, metavar="DIR")
    known = ", ".join(f"{n}={v:g}" for n, v in asdict(Thresholds()).items())
    parser.add_argument(
        "--set", dest="settings", action="append", default=[], metavar="NAME=VALUE",
        help=f"a threshold; defaults: {known}",
    )  # fmt: skip
    add_json(parser)


def thresholds_of(settings: list[str]) -> Thresholds:
    """Return the thresholds with ``name=value`` settings applied."""
    known = [f.name for f in fields(Thresholds)]
    changes: dict[str, Any] = {}
    for text in settings:
        name, _, raw = text.partition("=")
        if name not in known:
            raise unknown("threshold", name, known)
        try:
            changes[name] = float(raw)
        except ValueError:
            msg = f"threshold {name} must be a number >= 0, got '{raw}'"
            raise InputError(msg) from None
        if not 0.0 <= changes[name] < float("inf"):
            msg = f"threshold {name} must be a number >= 0, got '{raw}'"
            raise InputError(msg)
    return replace(Thresholds(), **changes)


def run(args: argparse.Namespace) -> int:
    """Rename every case from its stored evidence and say what changed."""
    from hpcwhirl.campaign.log import say
    from hpcwhirl.report.fresh import refresh
    from hpcwhirl.store.directory.owner import Asking
    from hpcwhirl.store.results.relabel import relabel

    limits = thresholds_of(args.settings)
    path, words = args.folder / "results.h5", asdict(limits)
    asking = Asking(say=say)
    changes = relabel(
        path, lambda numbers: words_by_table(numbers, words), words, asking
    )
    moved = Counter(f"{old[1]} -> {new[1]}" for old, new in changes if old[1] != new[1])
    turned = Counter(
        f"{old[2]} -> {new[2]}" for old, new in changes if old[2] != new[2]
    )
    facts = {
        "cases": len(changes),
        "regimes": dict(Counter(new[1] for _, new in changes)),
        "whirls": dict(Counter(new[2] for _, new in changes)),
        "changed": dict(moved + turned),
        "thresholds": asdict(limits),
    }
    drawn, stale = refresh(args.folder)
    facts["drawn again"] = [str(path) for path in drawn]
    for line in stale:
        print(f"hpcwhirl: {line}", file=sys.stderr)
    if args.json:
        print_json(facts)
        return 0
    for name, value in facts.items():
        print(f"{name}: {value}")
    return 0
