"""`hpcwhirl job`: print or write a job script for a cluster's scheduler."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from hpcwhirl.cluster.jobs.request import LAUNCHERS, Request
from hpcwhirl.errors import InputError, MissingFileError
from hpcwhirl.safe_open import read_regular

TEXTS = {
    "out": (
        "DIR",
        "directory of the campaign (default: out of the file's [campaign] or campaign)",
    ),
    "time": (
        "[D-]HH:MM:SS",
        "time limit of the job (default: walltime of [campaign] in the file or 4 h)",
    ),
    "name": ("NAME", "name of the job (default hpcwhirl)"),
    "partition": ("NAME", "partition or queue"),
    "account": ("NAME", "account, project or bank"),
    "shard": ("I/N", "compute only the I-th of N shares of the campaign"),
    "launcher": (
        "NAME",
        "program that starts the ranks: mpirun, mpiexec, srun (Slurm) or flux (Flux)",
    ),
    "mpi": ("NAME", "value of srun --mpi, e.g. pmix or pmi2"),
    "pe": ("NAME", "parallel environment of Grid Engine (default mpi)"),
    "venv": ("DIR", "virtual environment to activate"),
    "script": ("PATH", "write the script to PATH instead of printing it"),
}
IN_FILE = {"out": "out", "time": "walltime"}  # option: key of [campaign], its default
NUMBERS = {
    "ntasks": "number of ranks, of an array for each element (default 32)",
    "nodes": "number of nodes to spread the ranks over (default: scheduler's choice)",
    "array": "make an array job of N elements, each of which computes a shard",
    "requeues": "restart the job up to N times while there is more to do (default 20)",
    "warning": "stop the campaign N seconds before the time limit (default 120)",
}


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "scheduler", metavar="SCHEDULER", help=f"one of {', '.join(LAUNCHERS)}"
    )
    parser.add_argument("file", metavar="FILE.toml", help="campaign file")
    defaults = Request.__dataclass_fields__
    for name, (shape, meaning) in TEXTS.items():
        default = None if name in IN_FILE else defaults[name].default
        parser.add_argument(f"--{name}", default=default, metavar=shape, help=meaning)
    for name, meaning in NUMBERS.items():
        default = defaults[name].default
        parser.add_argument(
            f"--{name}", type=int, default=default, metavar="N", help=meaning
        )
    parser.add_argument(
        "--module",
        action="append",
        default=[],
        dest="modules",
        metavar="NAME",
        help="environment module to load; may be repeated",
    )


def run(args: argparse.Namespace) -> int:
    """Print the script, or write it to --script and print the command to submit it."""
    from hpcwhirl.cluster.jobs.schedulers import SCHEDULERS
    from hpcwhirl.cluster.jobs.script import job_script

    values = {name: getattr(args, name) for name in Request.__dataclass_fields__}
    table = _in_file(Path(args.file), shards=bool(args.array or args.shard))
    for name, key in IN_FILE.items():
        if values[name] is None:
            default = Request.__dataclass_fields__[name].default
            values[name] = table.get(key, default)
    request = Request(**(values | {"modules": tuple(args.modules)}))
    text = job_script(request)
    if not request.script:
        sys.stdout.write(text)
        return 0
    _write(Path(request.script), text)
    print(f"{SCHEDULERS[request.scheduler].submit} {request.script}")
    return 0


def _in_file(path: Path, *, shards: bool) -> dict[str, Any]:
    """Check a campaign file and return the keys that its table [campaign] sets.

    Parameters
    ----------
    path : path of the file
    shards : whether the job computes a shard, which some campaigns do not allow

    Raises
    ------
    InputError, MissingFileError
        if it cannot be read or is no campaign: else the job would fail only after
        waiting in the queue
    """
    from hpcwhirl.campaign.plan.design import load_design

    design = load_design(path, {})
    late = [f"[twins] of = {t.of}" for t in [design.twins] if t and t.is_late]
    late = ["[refine]"] if design.grows else late
    if shards and late:
        msg = f"{late[0]} needs the words of all cases: neither --array nor --shard"
        raise InputError(msg)
    rules = design.rules
    return {name: getattr(rules, name) for name in rules.model_fields_set}


def _write(path: Path, text: str) -> None:
    """Write the script; an existing file is replaced only if it is such a script."""
    from hpcwhirl.cluster.jobs.script import PRINTED
    from hpcwhirl.store.atomic import write_whole

    try:
        old = read_regular(path).decode() if path.exists() else PRINTED
    except (OSError, UnicodeDecodeError):
        old = ""
    if path.is_dir():
        msg = f"cannot write {path}: it is a directory"
        raise MissingFileError(msg)
    if PRINTED not in old:
        msg = f"--script {path}: there is a file that is no job script; it is kept"
        raise InputError(msg)
    write_whole(path, text.encode())
