"""`hpcwhirl doctor`: what will break here, and how to mend it."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from pathlib import Path
from typing import Any

from hpcwhirl.cli.options import add_json, print_json
from hpcwhirl.launch import launched_first


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "--dir",
        type=Path,
        default=Path(),
        metavar="DIR",
        help="directory that campaigns are to write to (default: this one)",
    )
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Print findings and remedies; 1 where something will break, else 0."""
    from hpcwhirl.cluster.doctor.facts import launcher_facts, rank_facts, ranks_of
    from hpcwhirl.cluster.doctor.findings import BREAKS, findings
    from hpcwhirl.cluster.doctor.place import place_facts

    own = rank_facts()
    comm, told = ranks_of(own["launched"])
    own |= told
    own |= place_facts(args.dir, comm) | {"folder": str(args.dir.resolve())}
    everyone = comm.gather(own, root=0)
    code = 0
    if everyone is not None:
        everyone[0] |= launcher_facts()
        found = findings(everyone, comm.size)
        # Of several singletons one speaks; srun would kill it if another failed first.
        if comm.size == own["launched"] or launched_first():
            _show(args, found, everyone)
            code = int(any(finding.level == BREAKS for finding in found))
    return int(comm.bcast(code, root=0))


def _show(
    args: argparse.Namespace, found: list[Any], everyone: list[dict[str, Any]]
) -> None:
    if args.json:
        print_json({"findings": [asdict(one) for one in found], "ranks": everyone})
        return
    for one in found:
        print(f"{one.level:6}  {one.what}: {one.got}")
        if one.remedy:
            print(f"{'':6}  -> {one.remedy}")
