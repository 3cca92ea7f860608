"""`hpcwhirl job`: a job script for a cluster's scheduler."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hpcwhirl.cluster.jobs.request import LAUNCHERS, Request
from hpcwhirl.errors import InputError, MissingFileError
from hpcwhirl.regular import read_regular

TEXTS = {
    "out": (
        "DIR",
        "directory of the campaign (default: of the file's [campaign], or campaign)",
    ),
    "time": (
        "[D-]HH:MM:SS",
        "time limit of the job (default: [campaign] walltime, or 04:00:00)",
    ),
    "name": ("NAME", "name of the job (default hpcwhirl)"),
    "partition": ("NAME", "partition or queue"),
    "account": ("NAME", "account, project or bank"),
    "shard": ("I/N", "only this share of the campaign"),
    "launcher": ("NAME", "mpirun, mpiexec, srun or flux; what the scheduler allows"),
    "mpi": ("NAME", "for srun --mpi, e.g. pmix or pmi2"),
    "pe": ("NAME", "parallel environment of Grid Engine (default mpi)"),
    "venv": ("DIR", "virtual environment to activate"),
    "script": ("PATH", "write the script there instead of printing it"),
}
IN_FILE = {"out": "out", "time": "walltime"}  # options, and keys of [campaign]
NUMBERS = {
    "ntasks": "ranks, of each element of an array (default 32)",
    "nodes": "nodes to spread the ranks over",
    "array": "an array job of so many shards",
    "requeues": "how often it may come again while there is more to do (default 20)",
    "warning": "seconds before the limit at which it stops (default 120)",
}


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "scheduler", metavar="SCHEDULER", help=f"one of {', '.join(LAUNCHERS)}"
    )
    parser.add_argument("file", metavar="FILE.toml", help="campaign")
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
        help="environment module to load; repeatable",
    )


def run(args: argparse.Namespace) -> int:
    """Print the script, or write it to the path it is to lie at."""
    from hpcwhirl.cluster.jobs.schedulers import SCHEDULERS
    from hpcwhirl.cluster.jobs.script import job_script

    values = {name: getattr(args, name) for name in Request.__dataclass_fields__}
    told = _in_file(Path(args.file))
    for name, key in IN_FILE.items():
        if values[name] is None:
            default = Request.__dataclass_fields__[name].default
            values[name] = told.get(key, default)
    request = Request(**(values | {"modules": tuple(args.modules)}))
    if request.array or request.shard:
        _check_shards(Path(args.file))
    text = job_script(request)
    if not request.script:
        sys.stdout.write(text)
        return 0
    _write(Path(request.script), text)
    print(f"{SCHEDULERS[request.scheduler].submit} {request.script}")
    return 0


def _in_file(path: Path) -> dict[str, Any]:
    """Return the options that a campaign's file sets; none where it is still to come.

    A script may be printed before the file is there, or on another machine.
    """
    from hpcwhirl.campaign.plan.design import rules_of
    from hpcwhirl.campaign.policy import Policy, options_of, with_rules
    from hpcwhirl.scene import load_document

    if not path.exists():
        return {}
    rules = rules_of(load_document(path))
    with_rules(Policy(), rules)
    return options_of(rules)


def _check_shards(path: Path) -> None:
    """Refuse shards of a campaign whose cases follow from the words of others."""
    from hpcwhirl.scene import load_document

    document = load_document(path) if path.exists() else {}
    twins = document.get("twins")
    boundary = isinstance(twins, Mapping) and twins.get("of") == "boundary"
    if "refine" in document or boundary:
        what = "[refine]" if "refine" in document else "[twins] of = boundary"
        msg = f"{what} needs the words of all cases: neither --array nor --shard"
        raise InputError(msg)


def _write(path: Path, text: str) -> None:
    """Write the script; only a script that was printed before is replaced."""
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
