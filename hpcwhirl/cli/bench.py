"""`hpcwhirl bench`: what a step costs on this core."""

from __future__ import annotations

import argparse
from dataclasses import asdict

from hpcwhirl.cli.options import add_scene, print_json, scene_of
from hpcwhirl.errors import InputError


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_scene(parser)
    parser.add_argument("--repeats", type=int, default=9, help="timed runs (default 9)")


def run(args: argparse.Namespace) -> int:
    """Time the schemes one after the other in this process and print a table."""
    from hpcwhirl.dynamics.bench import time_schemes

    if args.repeats < 1:
        msg = f"--repeats must be >= 1, got {args.repeats}"
        raise InputError(msg)
    scene = scene_of(args.scene, args.settings)
    rows = [asdict(timing) for timing in time_schemes(scene, args.repeats)]
    if args.json:
        print_json({"rows": rows})
        return 0
    _show(rows)
    return 0


def _show(rows: list[dict[str, float]]) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table("scheme", "lanes", "steps in contact", "us a step", "spread")
    for row in rows:
        table.add_row(
            str(row["scheme"]), str(row["lanes"]), f"{row['contact']:.1%}",
            f"{row['microseconds_per_step']:.2f}", f"{row['spread']:.0%}",
        )  # fmt: skip
    Console().print(table)
