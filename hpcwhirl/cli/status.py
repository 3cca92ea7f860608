"""`hpcwhirl status`: how far a campaign is, from its journals alone."""

from __future__ import annotations

import argparse
from collections import Counter
from pathlib import Path

from hpcwhirl.cli.options import add_json, print_json


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("folder", type=Path, metavar="DIR")
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Print done, failed, left, the core-hours spent and the words so far."""
    from hpcwhirl.store.journal import read_records
    from hpcwhirl.store.plan import read_plan

    plan, records = read_plan(args.folder), read_records(args.folder)
    own = [records[d] for d in plan.digests if d in records]
    done = [r for r in own if r["status"] == "ok"]
    seconds = sum(r["performance"].get("seconds", 0.0) for r in own)
    facts = {
        "cases": len(plan.digests),
        "done": len(done),
        "failed": len(own) - len(done),
        "left": len(plan.digests) - len(own),
        "core_hours": seconds / 3600,
        "regimes": dict(Counter(r["row"]["regime"] for r in done)),
    }
    if args.json:
        print_json(facts)
        return 0
    for name, value in facts.items():
        shown = f"{value:.3g}" if isinstance(value, float) else value
        print(f"{name}: {shown}")
    return 0
