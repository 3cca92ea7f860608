"""`hpcwhirl doctor`: check machine, MPI and directory; print problems and remedies."""

from __future__ import annotations

import argparse
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

from hpcwhirl.cli.command import add_option
from hpcwhirl.cli.options import add_json, print_json
from hpcwhirl.errors import say
from hpcwhirl.launch import from_root, launched_first

TURNING = {"engine.rotation": "full"}
COMPILED: dict[str, dict[str, Any]] = {  # {what is told: inputs of a scene}
    "equal sectors": {},
    "scheme exact": {"scheme": "exact"},
    "rotation full": TURNING,
    "supports that differ": {**TURNING, "stiffness_difference": 1e5},
    "unequal sectors": {"mistuning": [0.01, *[0.0] * 21]},
}


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `hpcwhirl doctor` on its parser."""
    # fmt: off
    add_option(parser, "--dir DIR",
        "directory in which campaigns will be stored (default: working directory)",
        default=Path(), type=Path)
    add_option(parser, "--compile",
        "first compile the kernels that most campaigns need, so that no later start "
        "waits for it; takes minutes once, and a second or so later")
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Print what is wrong with machine, MPI or directory, and how to repair it.

    Returns the exit code: 1 if something will break, else 0
    """
    from hpcwhirl.cluster.facts import launcher_facts, place_facts, rank_facts, ranks_of
    from hpcwhirl.cluster.findings import BREAKS, findings

    if args.compile and launched_first():
        fill_cache()
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


def fill_cache() -> None:
    """Compile the kernels of the scenes `COMPILED`; a line for each on stderr."""
    from hpcwhirl.case.resolve import resolve
    from hpcwhirl.dynamics.march import March
    from hpcwhirl.scene import apply_settings, named_scene

    for name, settings in COMPILED.items():
        began = time.perf_counter()
        March(resolve(apply_settings(named_scene("table2"), settings))).warm()
        say(f"{name}: {time.perf_counter() - began:.1f} s")


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
