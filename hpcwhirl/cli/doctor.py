"""`hpcwhirl doctor`: check machine, MPI and directory; print problems and remedies."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from pathlib import Path
from typing import Any

from hpcwhirl.cli.command import add_option
from hpcwhirl.cli.options import add_json, print_json
from hpcwhirl.launch import from_root, launched_first


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `hpcwhirl doctor` on its parser."""
    # fmt: off
    add_option(parser, "--dir DIR",
        "directory in which campaigns will be stored (default: working directory)",
        default=Path(), type=Path)
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Print what is wrong with machine, MPI or directory, and how to repair it.

    Returns the exit code: 1 if something will break, else 0
    """
    from hpcwhirl.cluster.facts import launcher_facts, place_facts, rank_facts, ranks_of
    from hpcwhirl.cluster.findings import BREAKS, findings

    facts = rank_facts()
    comm, mpi = ranks_of(facts["launched"])
    facts |= mpi
    facts |= place_facts(args.dir, comm) | {"folder": str(args.dir.resolve())}
    everyone = comm.gather(facts, root=0)
    code = 0
    if everyone is not None:
        everyone[0] |= launcher_facts()
        results = findings(everyone, comm.size)
        # If MPI gave each process a world of its own, all are rank 0: then the process
        # that the launcher counts first prints; the others return 0, since srun kills
        # all processes if one fails.
        if comm.size == facts["launched"] or launched_first():
            _show(args, results, everyone)
            code = int(any(finding.level == BREAKS for finding in results))
    return int(from_root(comm, code))


def _show(
    args: argparse.Namespace, results: list[Any], everyone: list[dict[str, Any]]
) -> None:
    if args.json:
        print_json({"findings": [asdict(one) for one in results], "ranks": everyone})
        return
    for one in results:
        print(f"{one.level:6}  {one.what}: {one.got}")
        if one.remedy:
            print(f"{'':6}  -> {one.remedy}")
